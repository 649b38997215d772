/* The loop by a made-up clock: when it ends for silence, of the device or of its supervisor, and
 * that a pause of this computer is neither; and how large the torque of damping becomes. */
#define _POSIX_C_SOURCE 200809L

#include "check.h"
#include "sc_block.h"
#include "sc_wire.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define RATE_PER_TICK 1e-4f /* rad; 0.1 rad/s, closing */
#define TORQUE_LIMIT 0.25f

enum { TICK_NS = 1000000, BEFORE = 100, AFTER = 100, LIMIT_MS = 1000, SUPERVISOR_MS = 100 };

/* A device that sends a state each tick of the made-up clock, and what happens to it. */
static struct {
    sc_block *block;
    int64_t now_ns;
    int64_t due_ns;      /* of the next state */
    int64_t sent_ns;     /* of the last one */
    uint32_t sequence;
    int64_t pause_ns;    /* of computer and device together, after the first states */
    int falls_silent;    /* after the first states */
    int beats;           /* whether the supervisor goes on after them */
    int commands;
    sc_decoder decoder;  /* of the commands */
    float largest;       /* torque of a command */
    int64_t held_up_ns;  /* as the loop noted it */
} world;

static int made_up_clock(clockid_t clock, struct timespec *now)
{
    (void)clock;
    now->tv_sec = (time_t)(world.now_ns / 1000000000);
    now->tv_nsec = (long)(world.now_ns % 1000000000);
    return 0;
}

static int made_up_poll(struct pollfd *line, nfds_t count, int timeout_ms)
{
    CHECK(count == 1, "one line");
    if (world.beats) {
        sc_block_beat(world.block);
    }
    line->revents = line->events;
    if (line->events & POLLOUT) {
        return 1;
    }
    if (world.sequence == BEFORE && world.pause_ns > 0) {
        world.now_ns += world.pause_ns;
        world.due_ns = world.now_ns;
        world.pause_ns = 0;
    }
    const int64_t until_ns = world.now_ns + timeout_ms * (int64_t)TICK_NS;
    if (world.due_ns > until_ns) {
        world.now_ns = until_ns;
        line->revents = 0;
        return 0;
    }
    world.now_ns = world.now_ns > world.due_ns ? world.now_ns : world.due_ns;
    return 1;
}

static ssize_t made_up_read(int fd, void *bytes, size_t room)
{
    uint8_t payload[SC_SIZE_STATE];
    (void)fd;
    world.sent_ns = world.now_ns;
    world.due_ns += TICK_NS;
    world.sequence++;
    if (world.sequence == BEFORE && world.falls_silent) {
        world.due_ns = INT64_MAX;
    }
    if (world.sequence <= BEFORE) {
        sc_block_beat(world.block);
    }
    if (world.sequence == BEFORE + AFTER && world.beats) {
        sc_block_stop(world.block);
    }
    const sc_state state = {0, SC_STATE_MOTOR_ENABLED, world.sequence, 1000u * world.sequence,
                            0.5f - RATE_PER_TICK * (float)world.sequence, 0.0f, 0.0f, 0.0f};
    CHECK(room >= SC_FRAME_MAX, "room");
    return (ssize_t)sc_encode_frame(payload, sc_pack_state(&state, payload), bytes, room);
}

static ssize_t made_up_write(int fd, const void *bytes, size_t size)
{
    size_t taken = 0;
    int got;
    sc_command command;
    (void)fd;
    while ((got = sc_decoder_feed(&world.decoder, bytes, size, &taken)) > 0) {
        CHECK(sc_unpack_command(world.decoder.buffer, (size_t)got, &command), "command");
        CHECK(command.torque >= 0.0f, "damping opposes closing");
        world.largest = fmaxf(world.largest, fabsf(command.torque));
    }
    world.commands++;
    return (ssize_t)size;
}

#define clock_gettime made_up_clock
#define poll(line, count, timeout_ms) made_up_poll(line, count, timeout_ms)
#define read made_up_read
#define write made_up_write
#define sc_loop_run run_by_the_made_up_clock
#include "sc_loop.c"
#undef poll
#undef read
#undef write

static uint32_t run_in(uint32_t mode, float damping, int64_t pause_ns, int falls_silent, int beats)
{
    sc_block *block = malloc((size_t)sc_block_size(1));
    if (block == NULL) {
        exit(2);
    }
    sc_block_init(block, 1);
    block->config.torque_limit = TORQUE_LIMIT;
    block->config.torque_slew = 100.0f;
    block->config.damping_Nm_s_per_rad = damping;
    block->config.rate_cutoff_Hz = 100.0f;
    block->config.opening_error_limit = 1.0f;
    block->config.advance_error_limit = 1.0f;
    block->config.supervisor_ms = SUPERVISOR_MS;
    block->config.opening_low = -3.0f;
    block->config.opening_high = 3.0f;
    block->config.opening_rate_limit = 30.0f;
    block->config.advance_rate_limit = 5.0f;
    block->config.tick_us = 1000;
    block->silence_limit_ms = LIMIT_MS;
    memset(&world, 0, sizeof world);
    world.block = block;
    world.now_ns = 5000000000;
    world.due_ns = world.now_ns + TICK_NS;
    world.pause_ns = pause_ns;
    world.falls_silent = falls_silent;
    world.beats = beats;
    sc_decoder_init(&world.decoder);
    sc_block_order(block, mode);
    const int line = open("/dev/null", O_RDWR);
    const uint32_t reason = run_by_the_made_up_clock(line, block);
    close(line);
    world.held_up_ns = block->held_up_ns;
    CHECK(block->recent_held_up_ns == block->held_up_ns, "the longest of the last seconds");
    CHECK(block->servo.frames == world.sequence, "every state is taken");
    free(block);
    return reason;
}

static uint32_t run(int64_t pause_ns, int falls_silent, int beats)
{
    return run_in(SC_MODE_IDLE, 1.0f, pause_ns, falls_silent, beats);
}

int main(void)
{
    const int64_t ms = 1000000;
    CHECK(run(0, 0, 1) == SC_STOP_ASKED, "nothing happens");
    CHECK(world.commands == BEFORE + AFTER + FAREWELLS, "each state is answered");
    CHECK(world.held_up_ns == 0, "the loop ran all the time");

    CHECK(run(1300 * ms, 0, 1) == SC_STOP_ASKED, "a pause of this computer is no silence");
    NEAR((double)world.held_up_ns / 1e6, 1300.0, 2.0 * POLL_MS, "ms", "and is noted as such");

    CHECK(run(0, 1, 1) == SC_STOP_SILENCE, "a device that falls silent ends the loop");
    NEAR((double)(world.now_ns - world.sent_ns) / 1e6, LIMIT_MS, 2.0 * POLL_MS, "after", "silence");
    CHECK(world.held_up_ns == 0, "the device was silent, and this computer ran");

    CHECK(run(0, 0, 0) == SC_STOP_SUPERVISOR_LOST, "a supervisor that falls silent ends the loop");
    NEAR(world.sequence - BEFORE, 5 * SUPERVISOR_MS, 2, "after", "supervisor");

    CHECK(run(1300 * ms, 0, 0) == SC_STOP_SUPERVISOR_LOST, "a pause does not hide it");
    NEAR(world.sequence - BEFORE, 5 * SUPERVISOR_MS, 12, "after", "a pause counts for 10 ms");

    /* Damping times the rate of 0.1 rad/s, which the filter of 1.6 ms has reached, and the limit. */
    CHECK(run_in(SC_MODE_DAMP, 1.0f, 0, 0, 1) == SC_STOP_ASKED, "damped");
    NEAR(world.largest, 0.1, 1e-3, "torque", "damped");
    CHECK(run_in(SC_MODE_DAMP, 5.0f, 0, 0, 1) == SC_STOP_ASKED, "damped more");
    NEAR(world.largest, TORQUE_LIMIT, 0.0, "torque", "damped at the limit");
    return checks_done("loop by a made-up clock");
}
