/* A device without hardware: the core as a process on a pseudo-terminal at the tick's rate.
 *
 *   posix            prints the port's path, serves in real time until stdin ends
 *   posix --records  no port and no clock: a board, then fw_record_in from stdin, fw_record_out out
 *
 * Behind it stand blades with inertia, dry and viscous friction between two stops, and a carriage.
 * A hand at the blades follows stdin: c closes, o opens, h leaves them half open, l lets go.
 */
#include "fw_record.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

static const fw_board BOARD = {
    .name = "posix", .serial = "1", .firmware_version = 1,
    .tick_us = 1000,
    .capabilities = SC_CAPABILITY_ADVANCE_MOTOR | SC_CAPABILITY_TORQUE_MEASURED,
    .torque_limit = 0.8f,
    .force_limit = 25.0f,
    .opening_min = 0.05f,
    .opening_max = 1.0f,
    .advance_min = -0.12f,
    .advance_max = 0.25f,
    .opening_resolution = 4e-5f,
    .advance_resolution = 2.5e-6f,
    .handle_radius = 0.06f,
    .torque_slew = 800.0f,
    .force_slew = 25000.0f,
    .overspeed = 60.0f,
    .opening_leap = 0.12f,
    .advance_leap = 0.01f,
    .torque_per_A = 0.1f,
    .resistance = 1.0f,
    .current_limit = 10.0f,
    .current_continuous = 4.0f,
    .i2t_limit = 50.0f,
    .supply_min = 11.0f,
    .supply_max = 13.0f,
};

/* One axis, SI; a hand takes it to a goal at 6 rad/s or less, or lets go (a goal below 0). */
typedef struct {
    double place, speed, inertia, dry, viscous, braking, low, high, goal;
} axis;

static void plant_step(axis *a, double effort, int brakes, double dt)
{
    const double hand = a->goal < 0.0 ? 0.0 : 6.0 * (a->goal - a->place) - a->speed;
    const double damped = effort + hand - (a->viscous + (brakes ? a->braking : 0.0)) * a->speed;
    const double free = a->speed + damped / a->inertia * dt;
    const double grip = a->dry / a->inertia * dt; /* what dry friction can take away in a step */
    a->speed = free > grip ? free - grip : free < -grip ? free + grip : 0.0;
    a->place += a->speed * dt;
    if (a->place < a->low || a->place > a->high) {
        a->place = a->place < a->low ? a->low : a->high;
        a->speed = 0.0;
    }
}

static float measured(double value, float step)
{
    return (float)(long)(value / (double)step) * step; /* towards zero, as a counter does */
}

/* A torque sensor's noise, uniform, with the 0.2 mN m (rms) of the course build's averaged readings:
 * docs/build/course.md. */
static float sensor_noise(void)
{
    static uint32_t state = 1u;
    state = 1664525u * state + 1013904223u;
    return 0.2e-3f * 3.4641016f * ((float)(state >> 8) / 16777216.0f - 0.5f);
}

static void plant_tick(axis axes[2], const fw_outputs *drive, fw_inputs *inputs)
{
    /* A step takes viscous dt / 2 off the inertia that motion shows: 0.02 % of the blades'. */
    enum { STEPS = 16 };
    const double dt = 1e-6 * (double)BOARD.tick_us / (double)STEPS;
    for (int i = 0; i < STEPS; i++) {
        plant_step(&axes[0], (double)drive->torque, drive->drive == FW_BRAKE, dt);
        plant_step(&axes[1], (double)drive->force, drive->drive == FW_BRAKE, dt);
    }
    inputs->device_us += BOARD.tick_us;
    inputs->opening = measured(axes[0].place, BOARD.opening_resolution);
    inputs->advance = measured(axes[1].place, BOARD.advance_resolution);
    inputs->motor_torque = drive->torque + sensor_noise();
    inputs->current = drive->torque / BOARD.torque_per_A;
}

static void serve(fw_core *core, fw_record_in *in, fw_record_out *out, int port)
{
    axis axes[2] = {{0.5, 0.0, 3e-4, 0.012, 2e-3, 0.05, 0.05, 1.0, -1.0},
                    {-0.05, 0.0, 0.35, 0.6, 3.0, 40.0, -0.12, 0.25, -1.0}};
    struct timespec due;
    struct pollfd parent = {STDIN_FILENO, POLLIN, 0};
    in->inputs.supply = 12.0f;
    clock_gettime(CLOCK_MONOTONIC, &due);
    for (;;) {
        char byte;
        plant_tick(axes, &out->outputs, &in->inputs);
        const ssize_t got = read(port, in->received, sizeof in->received);
        in->received_size = got > 0 ? (uint32_t)got : 0u;
        fw_record_tick(core, in, out);
        if (write(port, out->sent, out->sent_size) < 0 && errno != EAGAIN && errno != EIO) {
            return; /* a full buffer loses frames, as a line that nobody reads does */
        }
        if (poll(&parent, 1, 0) > 0) {
            if (read(STDIN_FILENO, &byte, 1) <= 0) {
                return;
            }
            axes[0].goal = byte == 'c' ? 0.0 : byte == 'o' ? 1.05 : byte == 'h' ? 0.5 : -1.0;
        }
        due.tv_nsec += 1000L * (long)BOARD.tick_us;
        due.tv_sec += due.tv_nsec / 1000000000L;
        due.tv_nsec %= 1000000000L;
        (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, 0);
    }
}

int main(int count, char **words)
{
    static fw_core core;
    static fw_record_in in;
    static fw_record_out out;
    fw_board board = BOARD;
    const char *sentence = "No board came: send one first.";
    const int records = count > 1 && strcmp(words[1], "--records") == 0;
    if ((records && fread(&board, sizeof board, 1, stdin) != 1) ||
        fw_board_problem(&board, &sentence) != FW_BOARD_POSSIBLE) {
        fprintf(stderr, "%s\n", sentence);
        return 2;
    }
    fw_init(&core, &board);
    while (records && fread(&in, sizeof in, 1, stdin) == 1) {
        fw_record_tick(&core, &in, &out);
        fwrite(&out, sizeof out, 1, stdout);
    }
    static fw_render render;
    static float image[FW_IMAGE_MOST_BYTES / 4];
    fw_let_render(&core, &render, image, sizeof image);
    const int port = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (records || port < 0 || grantpt(port) != 0 || unlockpt(port) != 0) {
        return !records;
    }
    const int own = open(ptsname(port), O_RDWR | O_NOCTTY); /* it stays open between hosts */
    struct termios line = {.c_cflag = CS8 | CREAD | CLOCAL, .c_cc = {[VMIN] = 1}}; /* raw */
    tcsetattr(own, TCSANOW, &line);
    printf("%s\n", ptsname(port));
    fflush(stdout);
    serve(&core, &in, &out, port);
    return 0;
}
