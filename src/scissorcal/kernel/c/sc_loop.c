#define _POSIX_C_SOURCE 200809L

#include "sc_loop.h"

#if defined(_WIN32)

uint32_t sc_loop_run(int fd, sc_block *block)
{
    (void)fd;
    (void)block;
    return SC_STOP_NONE;
}

#else

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

enum {
    POLL_MS = 5,
    LONGEST_LISTENED_NS = 10000000,
    LATELY_S = 2,
    WRITE_PATIENCE_MS = 20,
    READ_BYTES = 4096,
    FAREWELLS = 3,
    FRAMES_UNTIL_ASKED_AGAIN = 50,
    EMPTY_READS_OF_AN_END = 10 /* some ports give one now and then without an error */
};

/* State of the loop besides the block, on its stack. */
typedef struct {
    int fd;
    sc_block *block;
    const sc_model *model;
    sc_reference reference;
    sc_control_task task;
    sc_decoder decoder;
    sc_command command;
    int64_t epoch_ns; /* CLOCK_REALTIME at the start, less CLOCK_MONOTONIC then */
    int64_t arrived_ns;
    int64_t passed_ns; /* until when the servo was told of the time */
    int64_t last_state_ns;
    int64_t silent_ns;  /* listened since then without a state */
    int64_t counted_ns; /* when an answer was last counted as one */
    int has_state; /* any since the start */
    int unanswered;
    int empty_reads;
    uint32_t plate_turn; /* of the estimate that was taken last */
    uint32_t asked_frames;
    uint32_t asked;
    size_t pending; /* bytes of a frame that the line has not taken yet */
    uint8_t out[SC_FRAME_MAX];
} loop;

static int64_t clock_ns(clockid_t clock)
{
    struct timespec now;
    clock_gettime(clock, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static void fail(loop *self, uint32_t reason, int error)
{
    if (self->block->servo.stop_reason == SC_STOP_NONE) {
        self->block->exit_errno = error;
    }
    sc_servo_stop(&self->block->servo, reason);
}

/* Write what is pending, waiting briefly where the line is full. Frames stay whole: what remains is
 * sent before anything else. Returns 1 once all is written. */
static int flush_pending(loop *self)
{
    int64_t until_ns = 0; /* the clock is read only where the line is full */
    while (self->pending > 0) {
        const ssize_t wrote = write(self->fd, self->out, self->pending);
        if (wrote > 0) {
            self->pending -= (size_t)wrote;
            memmove(self->out, self->out + wrote, self->pending);
        } else if (wrote == 0 || errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) {
            struct pollfd line = {self->fd, POLLOUT, 0};
            const int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
            until_ns = until_ns > 0 ? until_ns : now_ns + WRITE_PATIENCE_MS * (int64_t)1000000;
            if (now_ns >= until_ns || poll(&line, 1, WRITE_PATIENCE_MS) == 0) {
                return 0;
            }
            if (line.revents & (POLLHUP | POLLERR | POLLNVAL)) {
                fail(self, SC_STOP_HANGUP, 0);
                return 0;
            }
        } else {
            fail(self, errno == EIO || errno == ENXIO || errno == EPIPE ? SC_STOP_HANGUP
                                                                         : SC_STOP_LINE_ERROR,
                 errno);
            return 0;
        }
    }
    return 1;
}

static int send_payload(loop *self, const uint8_t *payload, size_t size)
{
    if (!flush_pending(self)) {
        self->block->unsent++;
        return 0;
    }
    self->pending = sc_encode_frame(payload, size, self->out, sizeof self->out);
    return flush_pending(self);
}

/* A command that the line has taken in part is sent, too: its rest goes out before all else. */
static void send_command(loop *self)
{
    uint8_t payload[SC_SIZE_COMMAND];
    const size_t size = sc_pack_command(&self->command, payload);
    const uint64_t unsent = self->block->unsent;
    if (send_payload(self, payload, size)) {
        self->block->answers++;
    }
    if (self->block->unsent == unsent) {
        sc_servo_sent(&self->block->servo);
    } else {
        sc_servo_not_sent(&self->block->servo);
    }
}

static void say_farewell(loop *self)
{
    const uint32_t echo = self->command.echo_sequence;
    memset(&self->command, 0, sizeof self->command);
    self->command.echo_sequence = echo;
    for (int i = 0; i < FAREWELLS; i++) {
        send_command(self);
    }
}

/* Send a requested CONFIG, and repeat it until its echo arrives. */
static void serve_mailbox(loop *self)
{
    uint32_t key;
    float value;
    const uint32_t wanted = sc_block_wanted(self->block, &key, &value);
    if (wanted == self->block->mailbox.answered ||
        (wanted == self->asked && ++self->asked_frames < FRAMES_UNTIL_ASKED_AGAIN)) {
        return;
    }
    uint8_t payload[SC_SIZE_CONFIG];
    const sc_config config = {(uint16_t)key, wanted, value};
    self->asked = wanted;
    self->asked_frames = 0;
    (void)send_payload(self, payload, sc_pack_config(&config, payload));
}

static void take_other(loop *self, const uint8_t *payload, size_t size)
{
    sc_config_echo echo;
    uint32_t key;
    float value;
    self->block->other_frames++;
    if (sc_unpack_config_echo(payload, size, &echo) &&
        echo.nonce == sc_block_wanted(self->block, &key, &value) &&
        echo.nonce != self->block->mailbox.answered && echo.key == key) {
        sc_block_answer(self->block, echo.nonce, echo.status, echo.value);
    }
}

static void push_sample(loop *self)
{
    sc_block *block = self->block;
    sc_block_push(block, &block->servo.sample);
    if (block->servo.mode == SC_MODE_CONTROL) {
        sc_control_block_push(&block->control, &block->servo.control.sample);
    }
    self->unanswered = 0;
}

static void note_interval(loop *self)
{
    sc_block *block = self->block;
    if (self->has_state) {
        const int64_t interval = self->arrived_ns - self->last_state_ns;
        sc_histogram_add(&block->interval, interval);
        if (interval > (int64_t)block->config.tick_us * 1000 * SC_TICKS_OF_A_STALL) {
            block->stalls++;
        }
    }
    self->has_state = 1;
    self->last_state_ns = self->arrived_ns;
}

/* Step the servo; the sample waits until its command is out or the next state comes. */
static void take_state(loop *self, const sc_state *state)
{
    sc_block *block = self->block;
    sc_orders orders;
    sc_placing placing;
    if (self->unanswered) {
        sc_servo_not_sent(&block->servo);
        push_sample(self);
    }
    note_interval(self);
    sc_block_read_orders(block, &orders);
    if (block->config.plate.is_estimated &&
        sc_block_placed(block, &self->plate_turn, &placing)) {
        sc_servo_place(&block->config, self->model, &block->servo, &placing);
    }
    sc_block_reference(block, &self->reference);
    if (block->control.has_config) {
        sc_block_task(block, &self->task);
        (void)sc_control_block_receive(&block->control, &self->task.contour);
        self->reference.task = &self->task;
    }
    if (sc_servo_step(&block->config, self->model, &self->reference, &orders, &block->servo, state,
                      &self->command)) {
        block->servo.sample.host_time_ns = self->epoch_ns + self->arrived_ns;
        self->unanswered = 1;
        self->silent_ns = 0; /* a device that repeats itself is silent */
    }
}

/* Answers closer together than a tick, as while frames of a stall are worked off, count as one. A
 * line that accepts nothing counts too, or a fault behind it would never end the loop. */
static void count_answer(loop *self, int64_t now_ns)
{
    if (now_ns - self->counted_ns >= (int64_t)self->block->config.tick_us * 1000) {
        self->counted_ns = now_ns;
        sc_servo_answered(&self->block->servo);
    }
}

static void answer_newest(loop *self)
{
    sc_block *block = self->block;
    send_command(self);
    const int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
    const int64_t latency = now_ns - self->arrived_ns;
    count_answer(self, now_ns);
    sc_histogram_add(&block->latency, latency);
    if (self->unanswered) {
        block->servo.sample.latency_ns =
            latency < (int64_t)UINT32_MAX ? (uint32_t)latency : UINT32_MAX;
        push_sample(self);
    }
    serve_mailbox(self);
}

static void take_bytes(loop *self, const uint8_t *bytes, size_t size)
{
    size_t taken = 0;
    int states = 0;
    int got;
    while ((got = sc_decoder_feed(&self->decoder, bytes, size, &taken)) > 0) {
        sc_state state;
        if (sc_unpack_state(self->decoder.buffer, (size_t)got, &state)) {
            take_state(self, &state);
            states++;
        } else {
            take_other(self, self->decoder.buffer, (size_t)got);
        }
    }
    self->block->garbled = self->decoder.garbled;
    self->block->bytes_received = self->decoder.bytes_received;
    if (states > 0) {
        answer_newest(self);
    }
}

/* Read once; the end of the line becomes a stop. */
static void read_line(loop *self, short events)
{
    uint8_t bytes[READ_BYTES];
    if (!(events & POLLIN)) {
        fail(self, SC_STOP_HANGUP, 0);
        return;
    }
    const ssize_t size = read(self->fd, bytes, sizeof bytes);
    if (size > 0) {
        self->arrived_ns = clock_ns(CLOCK_MONOTONIC);
        self->empty_reads = 0;
        take_bytes(self, bytes, (size_t)size);
    } else if (size == 0) {
        if ((events & POLLHUP) || ++self->empty_reads >= EMPTY_READS_OF_AN_END) {
            fail(self, SC_STOP_HANGUP, 0);
        }
    } else if (errno == EIO || errno == ENXIO) {
        fail(self, SC_STOP_HANGUP, errno);
    } else if (errno != EINTR && errno != EAGAIN && errno != EWOULDBLOCK) {
        fail(self, SC_STOP_LINE_ERROR, errno);
    }
}

/* Note a time in which this computer did not run the loop. */
static void note_held_up(sc_block *block, int64_t held_up_ns, int64_t now_ns)
{
    const int64_t lately_ns = (int64_t)LATELY_S * 1000000000;
    if (held_up_ns > block->held_up_ns) {
        block->held_up_ns = held_up_ns;
    }
    if (held_up_ns > block->recent_held_up_ns ||
        now_ns - block->recent_held_up_until_ns > lately_ns) {
        block->recent_held_up_ns = held_up_ns;
        block->recent_held_up_until_ns = now_ns;
    }
}

/* Let time pass. That in which this computer stalled counts neither as silence of the device nor of
 * the supervisor. */
static void pass_time(loop *self)
{
    sc_block *block = self->block;
    sc_orders orders;
    const int64_t now_ns = clock_ns(CLOCK_MONOTONIC);
    const int64_t passed_ns = now_ns - self->passed_ns;
    const int64_t listened_ns = passed_ns < LONGEST_LISTENED_NS ? passed_ns : LONGEST_LISTENED_NS;
    const int64_t whole_us = listened_ns / 1000;
    if (whole_us <= 0) {
        return;
    }
    self->passed_ns = passed_ns > listened_ns ? now_ns : self->passed_ns + whole_us * 1000;
    if (passed_ns > listened_ns) { /* the device's clock went on meanwhile, and is compared */
        sc_watch_pass(&block->servo.watch, (uint32_t)((passed_ns - listened_ns) / 1000));
        note_held_up(block, passed_ns, now_ns);
    }
    self->silent_ns += whole_us * 1000;
    sc_block_read_orders(block, &orders);
    sc_servo_pass(&block->config, &orders, &block->servo, (uint32_t)whole_us);
    if (self->silent_ns > (int64_t)block->silence_limit_ms * 1000000) {
        sc_servo_stop(&block->servo, SC_STOP_SILENCE);
    }
}

static void wait_and_serve(loop *self)
{
    struct pollfd line = {self->fd, POLLIN, 0};
    const int ready = poll(&line, 1, POLL_MS);
    pass_time(self);
    if (ready > 0) {
        read_line(self, line.revents);
    } else if (ready < 0 && errno != EINTR) {
        fail(self, SC_STOP_LINE_ERROR, errno);
    }
}

uint32_t sc_loop_run(int fd, sc_block *block)
{
    sc_model model;
    loop self;
    memset(&self, 0, sizeof self);
    self.fd = fd;
    self.block = block;
    if (!sc_servo_config_is_sound(&block->config) ||
        (block->has_model && !sc_block_model(block, &model)) ||
        (block->control.has_config && !sc_control_config_is_sound(&block->control.config))) {
        block->exit_reason = SC_STOP_BAD_BLOCK;
        return SC_STOP_BAD_BLOCK;
    }
    self.model = block->has_model ? &model : NULL;
    sc_decoder_init(&self.decoder);
    self.last_state_ns = clock_ns(CLOCK_MONOTONIC);
    self.passed_ns = self.last_state_ns;
    self.epoch_ns = clock_ns(CLOCK_REALTIME) - self.last_state_ns;
    block->started_ns = self.epoch_ns + self.last_state_ns;
    __atomic_store_n(&block->running, 1u, __ATOMIC_RELEASE);
    const int line_flags = fcntl(fd, F_GETFL);
    (void)fcntl(fd, F_SETFL, line_flags | O_NONBLOCK); /* a full line must not block the loop */
    while (block->servo.stop_reason == SC_STOP_NONE) {
        wait_and_serve(&self);
    }
    say_farewell(&self);
    (void)fcntl(fd, F_SETFL, line_flags);
    block->exit_reason = block->servo.stop_reason;
    __atomic_store_n(&block->running, 0u, __ATOMIC_RELEASE);
    return block->exit_reason;
}

#endif
