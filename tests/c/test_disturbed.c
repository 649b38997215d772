/* The servo over arbitrary sequences of states: stalls, backlogs, repeats, leaps, faults, clocks.
 *   test_disturbed GOLDEN [TICKS] [SEED]
 * What must hold whatever comes is checked at each command that is sent; the figures are printed. */
#include "check.h"
#include "controls.h"
#include "json.h"
#include "models.h"
#include "sc_servo.h"

#include <stdlib.h>

enum {
    TICKS = 1000000,
    EPISODE_TICKS = 20000,
    TICKS_AFTER_STOP = 300,
    PATH_TICKS = 4096,
    MOST_QUEUED = 24,
    STALE_US = 20000
};
static const char *const TITLE = "disturbed";
static const float ROUNDING = 1e-4f;

typedef struct {
    unsigned long long plate_out; /* frames with less than their force for want of a pose */
    double torque_over, force_over; /* share of the limit */
    double slew_over;               /* share of a tick's slew */
    double end_s;                   /* from the start of an end to the stop */
    double silence_over_s;          /* beyond five times supervisor_ms */
    double energy_error;            /* J */
    double energy_moved;            /* J */
    unsigned long long sent, stops, ends, unlatched, late_news;
} figures;

typedef struct {
    uint64_t random;
    sc_servo_config config;
    sc_servo servo;
    sc_orders orders;
    sc_reference reference;
    sc_control_config control;
    sc_control_task task;
    const sc_model *model;
    float opening, rate, advance, speed;
    float torque, force; /* held by the device */
    float measured_gain;
    int enabled, faulty;
    uint32_t sequence, device_us;
    sc_state state;
    uint32_t silent_us, stale_us, ending_us, stale_passes;
    uint32_t stopped_by;
    double booked_J;
    double sent_torque, sent_force;
    uint32_t quiet_ticks, stuck_ticks, fault_ticks;
} trial;

static float path_opening[PATH_TICKS], path_rate[PATH_TICKS], path_advance[PATH_TICKS];
static int32_t path_stroke[PATH_TICKS];

static float along_place[PATH_TICKS], along_rate[PATH_TICKS], along_force[PATH_TICKS];

static uint32_t drawn(trial *t)
{
    t->random ^= t->random << 13;
    t->random ^= t->random >> 7;
    t->random ^= t->random << 17;
    return (uint32_t)(t->random >> 32);
}

static float uniform(trial *t, float low, float high)
{
    return low + (high - low) * (float)(drawn(t) >> 8) / 16777216.0f;
}

static int chance(trial *t, float share)
{
    return uniform(t, 0.0f, 1.0f) < share;
}

static void make_path(void)
{
    for (int i = 0; i < PATH_TICKS; i++) {
        const float phase = 6.2831853f * (float)i / 1024.0f;
        path_opening[i] = 0.55f + 0.15f * cosf(phase);
        path_rate[i] = -0.15f * 6.2831853f / 1.024f * sinf(phase);
        path_advance[i] = -0.02f;
        path_stroke[i] = 0;
        along_place[i] = 1e-3f * sinf(phase);
        along_rate[i] = 1e-3f * 6.2831853f / 1.024f * cosf(phase);
        along_force[i] = 2.0f;
    }
}

static sc_watch_config watches(const sc_servo_config *c)
{
    const sc_watch_config w = {.held_s = 1.0f,
                               .swing_rate = 0.5f,
                               .swing_torque = 0.1f * c->torque_limit,
                               .swing_Hz = 8.0f,
                               .runaway_rate = 1.0f,
                               .runaway_speed = 0.1f,
                               .still_rad = 0.02f,
                               .still_m = 0.005f,
                               .still_torque = 0.1f,
                               .rest_torque = 0.1f,
                               .jitter_s = 0.5f,
                               .least_ratio = 0.7f,
                               .most_ratio = 1.4f,
                               .ratio_torque = 0.01f,
                               .clock_share = 0.02f,
                               .host_clock_share = 0.0f,
                               .handle_radius = 0.06f};
    return w;
}

static void begin(trial *t, const sc_model *model)
{
    static const uint32_t ticks_us[] = {250, 500, 1000, 2000};
    const uint64_t random = t->random;
    memset(t, 0, sizeof *t);
    t->random = random;
    sc_servo_config *c = &t->config;
    c->motor_sign = 1.0f;
    c->tick_us = ticks_us[drawn(t) % 4];
    c->torque_limit = uniform(t, 0.1f, 1.0f);
    c->torque_slew = uniform(t, 20.0f, 400.0f);
    c->force_limit = chance(t, 0.3f) ? 0.0f : uniform(t, 1.0f, 30.0f);
    c->force_slew = uniform(t, 100.0f, 5000.0f);
    c->ramp_s = uniform(t, 0.05f, 0.5f);
    c->damping_Nm_s_per_rad = 0.02f;
    c->rate_cutoff_Hz = 100.0f;
    c->opening_kp = uniform(t, 0.5f, 12.0f);
    c->opening_kd = 0.01f * c->opening_kp;
    c->opening_ki = 3.0f * c->opening_kp;
    c->advance_kp = 1000.0f;
    c->advance_kd = 30.0f;
    c->opening_error_limit = 0.3f;
    c->advance_error_limit = 0.1f;
    c->opening_low = 0.05f;
    c->opening_high = 1.2f;
    c->opening_rate_limit = 30.0f;
    c->advance_rate_limit = 5.0f;
    c->supervisor_ms = 20 + drawn(t) % 200;
    c->fault_clearings = drawn(t) % 30;
    if (chance(t, 0.7f)) {
        c->watch = watches(c);
    }
    if (chance(t, 0.4f)) {
        c->plate = (sc_plate_config){1, 50000, 0.015f, 0.1f, -1.0f, 1.0f};
    }
    t->model = model;
    t->reference = (sc_reference){path_opening, path_rate, path_advance, path_stroke, PATH_TICKS,
                                  &t->task};
    t->control = sound_control();
    t->control.tick_s = 1e-6f * (float)c->tick_us;
    t->control.end_s = 10.0f;
    t->task.config = &t->control;
    t->task.path = (sc_path){along_place, along_rate, along_force, path_stroke, PATH_TICKS};
    t->opening = uniform(t, 0.4f, 0.7f);
    t->advance = -0.02f;
    t->measured_gain = chance(t, 0.8f) ? 1.0f : uniform(t, -1.0f, 2.0f);
    t->sequence = drawn(t);
    t->device_us = drawn(t);
    t->orders.mode = 1 + drawn(t) % 4;
    t->orders.order = 1;
}

/* The mechanism for a tick, with a hand that pushes now and then. */
static void move(trial *t)
{
    const float dt = (float)t->config.tick_us * 1e-6f;
    const float hand = chance(t, 0.5f) ? 0.0f : uniform(t, -0.1f, 0.1f);
    const float motor = t->enabled && !t->faulty ? t->torque : 0.0f;
    const float force = t->enabled && !t->faulty ? t->force : 0.0f;
    t->rate += dt * (motor + hand - 0.01f * t->rate) / 4e-4f;
    t->opening += dt * t->rate;
    if (t->opening < 0.1f || t->opening > 1.1f) {
        t->opening = fminf(fmaxf(t->opening, 0.1f), 1.1f);
        t->rate = 0.0f;
    }
    t->speed += dt * (force - 20.0f * t->speed) / 0.4f;
    t->advance = fminf(fmaxf(t->advance + dt * t->speed, -0.05f), 0.05f);
    t->sequence++;
    t->device_us += t->config.tick_us;
}

/* What the device sends: the truth, or something else. */
static void measure(trial *t)
{
    sc_state *s = &t->state;
    if (chance(t, 0.01f)) {
        return; /* repeats itself */
    }
    if (t->stuck_ticks == 0 && chance(t, 2e-5f)) {
        t->stuck_ticks = drawn(t) % 100;
    }
    if (t->fault_ticks == 0 && chance(t, 2e-4f)) {
        t->fault_ticks = 1 + drawn(t) % 200;
        t->faulty = 1;
    }
    const uint32_t us = t->stuck_ticks > 0 ? s->device_us : t->device_us;
    t->stuck_ticks -= t->stuck_ticks > 0;
    s->flags = (uint16_t)((t->enabled ? SC_STATE_MOTOR_ENABLED : 0) |
                          (t->faulty ? SC_STATE_FAULT_LATCHED : 0) |
                          (chance(t, 2e-6f) ? SC_STATE_ENCODER_FAULT : 0));
    s->sequence = t->sequence;
    s->device_us = chance(t, 1e-5f) ? drawn(t) : us;
    s->opening = chance(t, 1e-3f)   ? t->opening + uniform(t, -0.5f, 0.5f)
                 : chance(t, 1e-4f) ? NAN
                                    : t->opening;
    s->advance = chance(t, 1e-4f) ? INFINITY : t->advance;
    s->motor_torque = chance(t, 1e-4f) ? NAN : t->measured_gain * t->torque;
    s->handle_force = uniform(t, -0.5f, 0.5f);
    if (chance(t, 1e-5f)) {
        t->sequence -= drawn(t) % 100000; /* it restarted */
    } else if (chance(t, 2e-3f)) {
        const uint32_t lost = drawn(t) % 10;
        t->sequence += lost;
        t->device_us += lost * t->config.tick_us;
    }
}

/* A surface near where the tip is, or somewhere else, or none. */
static void send_contour(trial *t)
{
    const float slant = uniform(t, -0.2f, 0.2f), beta = 0.5f * t->opening;
    const float off = chance(t, 0.9f) ? uniform(t, -2e-3f, 2e-3f) : uniform(t, -0.1f, 0.1f);
    sc_contour *to = &t->task.contour;
    to->point[0] = t->advance + 0.075f * cosf(beta);
    to->point[1] = 0.075f * sinf(beta) - 5e-3f + off;
    to->normal[0] = -sinf(slant);
    to->normal[1] = chance(t, 1e-3f) ? NAN : cosf(slant);
    to->curvature = uniform(t, -20.0f, 20.0f);
    to->place = uniform(t, -1e-3f, 1e-3f);
    to->velocity[1] = uniform(t, -0.01f, 0.01f);
    to->turn_rate = uniform(t, -0.1f, 0.1f);
    to->lift = chance(t, 0.05f) ? 1u : 0u;
    to->number++;
}

static void disturb_host(trial *t)
{
    if (t->quiet_ticks == 0 && chance(t, 1e-4f)) {
        t->quiet_ticks = drawn(t) % 1000;
    }
    if (t->quiet_ticks > 0) {
        t->quiet_ticks--;
    } else {
        t->orders.heartbeat++;
    }
    if (chance(t, 2e-4f)) {
        t->orders.mode = drawn(t) % 5;
        t->orders.order++;
    }
    if (chance(t, 0.02f)) {
        send_contour(t);
    }
    if (chance(t, 1e-4f)) {
        t->orders.sheet++;
    }
    if (chance(t, 2e-6f)) {
        t->orders.stop = 1;
    }
}

/* A plate that is somewhere, or nowhere, and now and then without any news for long. */
static void disturb_plate(trial *t)
{
    const float pitch = t->model->moving_blades == 1 ? uniform(t, -0.2f, 0.2f) : 0.0f;
    const sc_placing p = {{uniform(t, -0.06f, 0.0f), uniform(t, -2e-3f, 2e-3f), pitch,
                           uniform(t, 0.98f, 1.02f), chance(t, 0.01f) ? NAN : 1.02f},
                          !chance(t, 0.02f), drawn(t) % 30000};
    if (t->quiet_ticks == 0 && chance(t, 0.1f)) {
        sc_servo_place(&t->config, t->model, &t->servo, &p);
    }
}

/* The work of what was sent over the way between usable places, by this program's own count. */
static void book(trial *t, const sc_motion *before, const sc_state *state)
{
    if (before->started && (state->flags & SC_STATE_MOTOR_ENABLED) &&
        !(t->servo.sample.flags & SC_SAMPLE_INVALID)) {
        t->booked_J += t->sent_torque * ((double)state->opening - (double)before->opening) +
                       t->sent_force * ((double)state->advance - (double)before->advance);
    }
}

static void most(double *worst, double value)
{
    *worst = value > *worst ? value : *worst;
}

static void check_sent(trial *t, const sc_command *command, figures *f)
{
    const sc_servo_config *c = &t->config;
    const double tick_s = 1e-6 * c->tick_us;
    const double torque = (double)command->torque, force = (double)command->force;
    f->sent++;
    most(&f->torque_over, fabs(torque) / (double)c->torque_limit - 1.0);
    const double most_force = (double)c->force_limit;
    most(&f->force_over, most_force > 0.0 ? fabs(force) / most_force - 1.0 : fabs(force));
    if (torque != 0.0) {
        const double slew = (double)c->torque_slew * tick_s;
        most(&f->slew_over, fabs(torque - t->sent_torque) / slew - 1.0);
    }
    if (force != 0.0) {
        const double slew = (double)c->force_slew * tick_s;
        most(&f->slew_over, fabs(force - t->sent_force) / slew - 1.0);
    }
    const double fall = (double)c->torque_limit / ((double)c->torque_slew * tick_s);
    f->late_news += t->stale_passes > (uint32_t)fall + 2 && torque != 0.0;
    t->sent_torque = t->torque = command->torque;
    t->sent_force = t->force = command->force;
    t->enabled = (command->flags & SC_COMMAND_ENABLE) != 0;
    if ((command->flags & SC_COMMAND_CLEAR_FAULT) && t->fault_ticks == 0) {
        t->faulty = 0;
    }
}

/* What was stopped stays so, by its first reason, with motors off. */
static void check_latched(trial *t, const sc_command *command, figures *f)
{
    const uint32_t by = t->servo.stop_reason;
    if (t->stopped_by != SC_STOP_NONE) {
        f->unlatched += by != t->stopped_by || command->flags != 0 || command->torque != 0.0f ||
                        command->force != 0.0f;
    } else if (by != SC_STOP_NONE) {
        f->stops++;
        f->unlatched += command->flags != 0 || command->torque != 0.0f;
    }
    t->stopped_by = by;
}

static void pass_time(trial *t, uint32_t elapsed_us, figures *f)
{
    const int was_stopped = t->servo.stop_reason != SC_STOP_NONE;
    t->silent_us = t->orders.heartbeat == t->servo.heartbeat ? t->silent_us + elapsed_us : 0;
    t->stale_us += elapsed_us;
    t->stale_passes = t->stale_us > STALE_US ? t->stale_passes + 1 : 0;
    t->ending_us = t->servo.ending && !was_stopped ? t->ending_us + elapsed_us : 0;
    sc_servo_pass(&t->config, &t->orders, &t->servo, elapsed_us);
    const uint32_t longest_us = 5000 * t->config.supervisor_ms;
    if (!was_stopped && t->silent_us >= longest_us + 1000) {
        most(&f->silence_over_s, t->servo.stop_reason != SC_STOP_NONE
                                     ? 1e-6 * (t->silent_us - longest_us)
                                     : 1e9);
    }
}

/* Frames that wait are read at once; the newest is answered, unless the line is full. */
static void turn(trial *t, figures *f)
{
    const uint32_t queued = chance(t, 2e-3f) ? 1 + drawn(t) % MOST_QUEUED : 1;
    uint32_t elapsed_us = t->config.tick_us;
    if (chance(t, 0.01f)) {
        elapsed_us = drawn(t) % 5000;
    }
    sc_command command;
    disturb_host(t);
    disturb_plate(t);
    pass_time(t, elapsed_us, f);
    for (uint32_t i = 0; i < queued; i++) {
        move(t);
        t->fault_ticks -= t->fault_ticks > 0;
        measure(t);
        const sc_motion before = t->servo.motion;
        if (sc_servo_step(&t->config, t->model, &t->reference, &t->orders, &t->servo, &t->state,
                          &command)) {
            t->stale_us = t->stale_passes = 0;
            book(t, &before, &t->state);
        }
        check_latched(t, &command, f);
        if (i + 1 < queued || chance(t, 1e-3f)) {
            sc_servo_not_sent(&t->servo);
            continue;
        }
        check_sent(t, &command, f);
        sc_servo_sent(&t->servo);
        sc_servo_answered(&t->servo);
    }
    if (t->servo.ending && t->servo.stop_reason != SC_STOP_NONE && t->ending_us > 0) {
        most(&f->end_s, 1e-6 * t->ending_us);
        f->ends++;
        t->ending_us = 0;
    }
}

static uint32_t run_episode(trial *t, const sc_model *model, figures *f)
{
    uint32_t ticks = 0, after = 0;
    begin(t, model);
    while (ticks < EPISODE_TICKS && after < TICKS_AFTER_STOP) {
        turn(t, f);
        ticks++;
        after += t->servo.stop_reason != SC_STOP_NONE;
    }
    most(&f->energy_error, fabs(t->servo.ledger.delivered_J - t->booked_J));
    f->energy_moved += fabs(t->booked_J);
    f->plate_out += t->servo.plate_out_frames;
    return ticks;
}

int main(int argc, char **argv)
{
    static storage rooms[5];
    static trial t;
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "model.json");
    const json *cases = json_get(&vectors, "cases");
    const unsigned long long wanted = argc > 2 ? strtoull(argv[2], NULL, 10) : TICKS;
    unsigned long long ticks = 0, episodes = 0;
    figures f;
    memset(&f, 0, sizeof f);
    f.torque_over = f.force_over = f.slew_over = -1.0;
    t.random = (argc > 3 ? strtoull(argv[3], NULL, 10) : 1) * 0x9E3779B97F4A7C15u + 1;
    make_path();
    while (ticks < wanted) {
        const json *one = &cases->items[episodes++ % cases->size];
        const sc_model model = load_model(json_get(one, "model"), rooms);
        ticks += run_episode(&t, &model, &f);
    }
    printf("%llu ticks in %llu servos, %llu commands, %llu stops, %llu of them by a gentle end\n",
           ticks, episodes, f.sent, f.stops, f.ends);
    printf("over its limit: torque %.1e, force %.1e; over a tick's slew: %.1e (shares; below 0: "
           "within)\n", f.torque_over, f.force_over, f.slew_over);
    printf("longest end %.4f s; stop after silence, beyond the promise: %.4f s; energy booked less "
           "energy sent: %.1e J at most, of %.1f J in all\n", f.end_s, f.silence_over_s,
           f.energy_error, f.energy_moved);
    CHECK(f.torque_over <= 0.0 && f.force_over <= 0.0, TITLE);
    CHECK(f.slew_over <= (double)ROUNDING, TITLE);
    CHECK(f.unlatched == 0, TITLE);
    CHECK(f.late_news == 0, TITLE);
    CHECK(f.stops > 0 && f.ends > 0, TITLE);
    CHECK(f.end_s <= 0.355 && f.plate_out > 1000, TITLE);
    CHECK(f.silence_over_s <= 0.006, TITLE);
    CHECK(f.energy_error <= 1e-9 && f.energy_moved > 0.0, TITLE);
    json_free(&vectors);
    return checks_done(TITLE);
}
