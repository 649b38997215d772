/* The loop against a device played by another thread, over a socket pair. How large a torque becomes
 * depends on when the threads run, since it falls in silence: that is of test_servo, and of test_loop_clock. */
#define _POSIX_C_SOURCE 200809L

#include "check.h"
#include "sc_loop.h"

#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

enum { FRAMES = 500, BACKLOG = 200, REFERENCE = 64 };

typedef struct {
    int fd;
    sc_block *block;
    int commands;
    int enabled;
    float largest;
    sc_command last;
    int hang_up;
    int clears; /* a fault, once it is told to */
} device;

static void send_state(int fd, uint32_t sequence, uint16_t flags, int garble)
{
    uint8_t payload[SC_SIZE_STATE], frame[SC_FRAME_MAX];
    const sc_state state = {0, flags, sequence, sequence * 1000u,
                            0.6f - 1e-4f * (float)sequence, 0.0f, 0.0f, 0.0f};
    const size_t size = sc_pack_state(&state, payload);
    const size_t whole = sc_encode_frame(payload, size, frame, sizeof frame);
    if (garble) {
        frame[10] ^= 0x40;
    }
    CHECK(write(fd, frame, whole) == (ssize_t)whole, "device");
}

static void take_command(device *self, const uint8_t *payload, size_t size)
{
    if (sc_unpack_command(payload, size, &self->last)) {
        self->commands++;
        self->enabled += self->last.flags & SC_COMMAND_ENABLE;
        self->largest = fmaxf(self->largest, fabsf(self->last.torque));
    }
}

static void read_answers(device *self, sc_decoder *decoder)
{
    uint8_t bytes[512];
    const ssize_t size = read(self->fd, bytes, sizeof bytes);
    size_t taken = 0;
    int got;
    while (size > 0 && (got = sc_decoder_feed(decoder, bytes, (size_t)size, &taken)) > 0) {
        take_command(self, decoder->buffer, (size_t)got);
    }
}

/* In step with the loop: a state, then its answer. One frame in ten is garbled, so unanswered. */
static void *play_device(void *argument)
{
    device *self = argument;
    sc_decoder decoder;
    sc_decoder_init(&decoder);
    for (uint32_t sequence = 1; sequence <= FRAMES; sequence++) {
        const int garble = sequence % 10 == 5;
        send_state(self->fd, sequence, SC_STATE_MOTOR_ENABLED, garble);
        if (!garble) {
            read_answers(self, &decoder);
        }
    }
    if (self->hang_up) {
        close(self->fd);
        return NULL;
    }
    sc_block_stop(self->block);
    const int before = self->commands;
    while (self->commands < before + 3) {
        read_answers(self, &decoder);
    }
    return NULL;
}

static sc_block *new_block(void)
{
    sc_block *block = malloc((size_t)sc_block_size(REFERENCE));
    if (block == NULL) {
        exit(2);
    }
    sc_block_init(block, REFERENCE);
    block->config.torque_limit = 0.25f;
    block->config.torque_slew = 100.0f;
    block->config.damping_Nm_s_per_rad = 5.0f;
    block->config.rate_cutoff_Hz = 100.0f;
    block->config.opening_error_limit = 1.0f;
    block->config.advance_error_limit = 1.0f;
    block->config.supervisor_ms = 0; /* by the computer's clock; test_loop_clock has its own */
    block->config.opening_low = -3.0f;
    block->config.opening_high = 3.0f;
    block->config.opening_rate_limit = 30.0f;
    block->config.advance_rate_limit = 5.0f;
    block->config.tick_us = 1000;
    CHECK(sc_block_is_sound(block, block->size), "block");
    CHECK(!sc_block_is_sound(block, block->size - 1), "block");
    return block;
}

static void run_once(int hang_up)
{
    const char *title = hang_up ? "hang-up" : "stop";
    int ends[2];
    pthread_t thread;
    sc_block *block = new_block();
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) {
        exit(2);
    }
    device rig = {ends[1], block, 0, 0, 0.0f, {0, 0, 0, 0.0f, 0.0f}, hang_up, 0};
    sc_block_order(block, SC_MODE_DAMP);
    pthread_create(&thread, NULL, play_device, &rig);
    const uint32_t reason = sc_loop_run(ends[0], block);
    pthread_join(thread, NULL);
    CHECK(reason == (hang_up ? SC_STOP_HANGUP : SC_STOP_ASKED), title);
    CHECK(block->servo.frames == FRAMES - FRAMES / 10, title);
    CHECK(block->garbled == FRAMES / 10, title);
    CHECK(block->servo.misses == FRAMES / 10, title);
    CHECK(block->written == block->servo.frames, title);
    CHECK(block->latency.total == block->servo.frames, title);
    CHECK(rig.enabled > 0 && rig.largest > 0.0f && rig.largest <= 0.25f, title);
    if (!hang_up) {
        CHECK(rig.last.flags == 0 && rig.last.torque == 0.0f && rig.last.force == 0.0f, title);
        close(ends[1]);
    }
    close(ends[0]);
    free(block);
}

/* A host that stood still: a backlog of frames that all report the fault, then fresh ones. */
static void *play_latched(void *argument)
{
    device *self = argument;
    uint32_t sequence = 1;
    sc_decoder decoder;
    sc_decoder_init(&decoder);
    for (; sequence <= BACKLOG; sequence++) {
        send_state(self->fd, sequence, SC_STATE_FAULT_LATCHED, 0);
    }
    while (self->last.echo_sequence != BACKLOG) {
        read_answers(self, &decoder);
    }
    CHECK(self->last.flags == (SC_COMMAND_ENABLE | SC_COMMAND_CLEAR_FAULT), "backlog");
    while (self->last.flags != 0 && sequence < BACKLOG + FRAMES) {
        const uint16_t flags = self->clears ? SC_STATE_MOTOR_ENABLED : SC_STATE_FAULT_LATCHED;
        send_state(self->fd, sequence++, flags, 0);
        nanosleep(&(struct timespec){0, 1000000}, NULL);
        read_answers(self, &decoder);
    }
    sc_block_stop(self->block);
    return NULL;
}

static void run_latched(int clears)
{
    const char *title = clears ? "backlog that clears" : "fault that stays";
    int ends[2];
    pthread_t thread;
    sc_block *block = new_block();
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends) != 0) {
        exit(2);
    }
    block->config.fault_clearings = 1;
    device rig = {ends[1], block, 0, 0, 0.0f, {0, 0, 0, 0.0f, 0.0f}, 0, clears};
    sc_block_order(block, SC_MODE_DAMP);
    pthread_create(&thread, NULL, play_latched, &rig);
    const uint32_t reason = sc_loop_run(ends[0], block);
    pthread_join(thread, NULL);
    CHECK(reason == (clears ? SC_STOP_ASKED : SC_STOP_DEVICE_FAULT), title);
    CHECK(block->servo.frames > BACKLOG, title);
    CHECK((rig.largest > 0.0f) == clears, title);
    close(ends[0]);
    close(ends[1]);
    free(block);
}

static void check_ring(void)
{
    static sc_sample samples[SC_RING_SAMPLES];
    sc_block *block = new_block();
    uint64_t cursor = 0, lost = 0;
    sc_sample sample;
    memset(&sample, 0, sizeof sample);
    for (uint32_t i = 0; i < SC_RING_SAMPLES + 100; i++) {
        sample.sequence = i;
        sc_block_push(block, &sample);
    }
    const uint64_t count = sc_block_read(block, &cursor, samples, SC_RING_SAMPLES, &lost);
    CHECK(lost == 101 && count == SC_RING_SAMPLES - 1, "ring");
    CHECK(samples[0].sequence == 101, "ring");
    CHECK(samples[count - 1].sequence == SC_RING_SAMPLES + 99, "ring");
    CHECK(sc_block_read(block, &cursor, samples, SC_RING_SAMPLES, &lost) == 0, "ring");
    free(block);
}

static void check_histogram(void)
{
    static const int64_t times_ns[] = {-5, 0, 999, 1000, 1124, 1125, 1999, 2000, 2250, 1000000,
                                       1000000000, INT64_MAX};
    static const uint32_t bins[] = {0, 0, 0, 0, 0, 1, 7, 8, 9, 79, 159, 191};
    for (size_t i = 0; i < sizeof bins / sizeof *bins; i++) {
        sc_histogram histogram;
        memset(&histogram, 0, sizeof histogram);
        sc_histogram_add(&histogram, times_ns[i]);
        CHECK(histogram.count[bins[i]] == 1, "histogram");
    }
}

int main(void)
{
    signal(SIGPIPE, SIG_IGN);
    run_once(0);
    run_once(1);
    run_latched(1);
    run_latched(0);
    check_ring();
    check_histogram();
    return checks_done("loop");
}
