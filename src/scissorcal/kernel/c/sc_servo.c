#include "sc_servo.h"
#include "sc_servo_end.h"
#include "sc_servo_plate.h"
#include "sc_servo_control.h"
#include "sc_servo_watch.h"

#include <math.h>
#include <string.h>

static const float LONGEST_TICK_S = 0.01f;       /* a gap does not widen the slew without bound */

enum {
    CLEARINGS_UNTIL_STOP = 100,
    STALE_US = 20000 /* a torque without news acts for 20 ms at most, as the device's own brake */
};

typedef struct {
    float torque;
    float force;
} effort;

/* The way since the last usable frame. */
typedef struct {
    double turned;    /* [rad] */
    double moved;     /* [m] */
    double delivered; /* work of the motors [J] */
    float dt;
} way;

static int is_level(float value)
{
    return isfinite(value) && value >= 0.0f;
}

int sc_servo_config_is_sound(const sc_servo_config *config)
{
    return is_level(config->torque_limit) && is_level(config->torque_slew) &&
           is_level(config->force_limit) && is_level(config->force_slew) &&
           is_level(config->ramp_s) && is_level(config->damping_Nm_s_per_rad) &&
           is_level(config->let_go_damping_Nm_s_per_rad) &&
           is_level(config->rate_cutoff_Hz) && is_level(config->opening_kp) &&
           is_level(config->opening_kd) && is_level(config->opening_ki) &&
           is_level(config->advance_kp) && is_level(config->advance_kd) &&
           is_level(config->advance_ki) && config->opening_error_limit > 0.0f &&
           config->advance_error_limit > 0.0f && config->tick_us > 0 &&
           isfinite(config->opening_low) && isfinite(config->opening_high) &&
           config->opening_low < config->opening_high && config->opening_rate_limit > 0.0f &&
           config->advance_rate_limit > 0.0f && isfinite(config->motor_sign) &&
           sc_passivity_is_sound(&config->passivity) &&
           sc_plate_config_is_sound(&config->plate) && sc_pieces_are_sound(&config->pieces) &&
           !(config->plate.is_estimated && config->pieces.count > 0) &&
           sc_watch_config_is_sound(&config->watch);
}

/* Only what a late host brings about, or what a device of version 1 does not tell, may be cleared while
 * motors run: a person who pressed the stop button, and a motor that was too hot or too fast, do not
 * expect it to go on by itself. */
static int clears(uint8_t cause)
{
    return cause == SC_CAUSE_NONE || cause == SC_CAUSE_WATCHDOG;
}

/* A latched fault is cleared at the start and then a bounded number of times; else the servo stops.
 * A fault that persists is counted by the clearings that were sent, not by the frames that report
 * it: after a stall of the host hundreds of those are queued, from before any clearing was sent.
 * Returns 1 while it persists. */
static int handle_fault(const sc_servo_config *config, sc_servo *servo, const sc_state *state)
{
    if (state->flags & SC_STATE_ENCODER_FAULT) {
        sc_servo_stop(servo, SC_STOP_ENCODER_FAULT);
        return 1;
    }
    if (state->flags & SC_STATE_NOT_HOMED) {
        sc_servo_stop(servo, SC_STOP_NOT_HOMED);
        return 1;
    }
    if (!(state->flags & SC_STATE_FAULT_LATCHED)) {
        servo->fault_seen = 0;
        return 0;
    }
    if (!servo->fault_seen) {
        servo->fault_seen = 1;
        servo->fault_cause = state->cause;
        servo->clearings_sent = 0;
        servo->faults += servo->enabled_once;
        servo->opening_integral = 0.0f;
        servo->advance_integral = 0.0f;
        if (servo->enabled_once && !clears(state->cause)) {
            sc_servo_stop(servo, SC_STOP_DEVICE_FAULT);
        }
    }
    servo->engaged_s = 0.0f; /* the ramp begins when the fault ends */
    servo->engaged_at = servo->sequence - servo->track_index; /* the reference waits, too */
    if (servo->faults > config->fault_clearings ||
        servo->clearings_sent >= CLEARINGS_UNTIL_STOP) {
        sc_servo_stop(servo, SC_STOP_DEVICE_FAULT);
    }
    return 1;
}

static effort track(const sc_servo_config *config, const sc_reference *reference, sc_servo *servo,
                    float dt)
{
    effort wanted = {0.0f, 0.0f};
    servo->track_index = servo->sequence - servo->engaged_at;
    if (reference == NULL || reference->size == 0) {
        return wanted;
    }
    const uint32_t last = reference->size - 1;
    const uint32_t at = servo->track_index < last ? servo->track_index : last;
    const sc_motion *motion = &servo->motion;
    float opening_rate = reference->opening_rate[at];
    float advance_rate = 0.0f;
    if (at < last) {
        advance_rate =
            (reference->advance[at + 1] - reference->advance[at]) * 1e6f / (float)config->tick_us;
        servo->sample.stroke = reference->stroke[at];
    } else {
        opening_rate = 0.0f;
    }
    servo->aim_opening = reference->opening[at];
    servo->aim_rate = opening_rate;
    servo->aim_advance = reference->advance[at];
    const float opening_error = reference->opening[at] - motion->opening;
    const float advance_error = reference->advance[at] - motion->advance;
    if (fabsf(opening_error) > config->opening_error_limit ||
        fabsf(advance_error) > config->advance_error_limit) {
        sc_servo_let_go(servo, SC_STOP_TRACKING_LOST);
        return wanted;
    }
    const sc_pid_gains opening = {config->opening_kp, config->opening_kd, config->opening_ki,
                                  config->torque_limit};
    const sc_pid_gains advance = {config->advance_kp, config->advance_kd, config->advance_ki,
                                  config->force_limit};
    wanted.torque = sc_pid(&opening, &servo->opening_integral, opening_error,
                           opening_rate - motion->opening_rate, dt);
    wanted.force = sc_pid(&advance, &servo->advance_integral, advance_error,
                          advance_rate - motion->advance_rate, dt);
    return wanted;
}

static effort render(const sc_servo_config *config, const sc_model *model, sc_servo *servo,
                     const way *since)
{
    effort wanted = {0.0f, 0.0f};
    if (model == NULL) {
        return wanted;
    }
    const sc_motion *motion = &servo->motion;
    float share = servo->engaged_s < config->ramp_s ? servo->engaged_s / config->ramp_s : 1.0f;
    if (!sc_servo_step_model(config, model, servo, &share)) {
        return wanted;
    }
    sc_near_rest(model, config->passivity.friction_width, &servo->port.anchor, motion->opening,
                 motion->opening_rate, &servo->step);
    servo->sample.flags |= servo->step.flags << SC_SAMPLE_STEP_SHIFT;
    const sc_port_tick tick = {since->turned, since->moved,         since->delivered,
                               since->dt,     motion->opening_rate, share,
                               config->torque_limit, config->force_limit};
    const float damping =
        sc_port_render(&config->passivity, &servo->port, &servo->ledger, &tick, &servo->step);
    wanted.torque = share * servo->step.torque + damping;
    wanted.force = share * servo->step.force;
    return wanted;
}

/* Limit an effort: finite, within the limit, and no faster than the slew. */
static float limited(float wanted, float sent, float limit, float most_change, uint64_t *at_limit,
                     uint64_t *slewed)
{
    float given = isfinite(wanted) ? wanted : 0.0f;
    if (given > limit || given < -limit) {
        given = given > 0.0f ? limit : -limit;
        (*at_limit)++;
    }
    if (given > sent + most_change || given < sent - most_change) {
        given = given > sent ? sent + most_change : sent - most_change;
        (*slewed)++;
    }
    return fminf(fmaxf(given, -limit), limit);
}

static void apply_limits(const sc_servo_config *config, sc_servo *servo, effort wanted)
{
    const uint64_t torque_before = servo->torque_limited;
    const uint64_t force_before = servo->force_limited;
    const float time_s = fminf((float)servo->slew_us * 1e-6f, LONGEST_TICK_S);
    servo->torque = limited(wanted.torque, servo->sent_torque, config->torque_limit,
                            config->torque_slew * time_s, &servo->torque_limited,
                            &servo->torque_slewed);
    servo->force =
        limited(wanted.force, servo->sent_force, config->force_limit,
                config->force_slew * time_s, &servo->force_limited, &servo->force_slewed);
    if (servo->torque_limited != torque_before) {
        servo->sample.flags |= SC_SAMPLE_TORQUE_LIMITED;
    }
    if (servo->force_limited != force_before && config->force_limit > 0.0f) {
        servo->sample.flags |= SC_SAMPLE_FORCE_LIMITED;
    }
}

/* Where the blades went since the last usable frame, and the motors' work on the way if they were
 * on. */
static way way_since(const sc_servo_config *config, sc_servo *servo, const sc_motion *before,
                     const sc_state *state, float dt)
{
    way since = {0.0, 0.0, 0.0, dt};
    if (before->started) {
        since.turned = (double)state->opening - (double)before->opening;
        since.moved = (double)state->advance - (double)before->advance;
    }
    if (!before->started || !(state->flags & SC_STATE_MOTOR_ENABLED)) {
        servo->port.was_measured = 0;
        servo->port.had_hand = 0;
        return since;
    }
    since.delivered =
        sc_port_delivered(&config->passivity, &servo->port, since.turned, since.moved,
                          servo->sent_torque, servo->sent_force, state->motor_torque);
    servo->ledger.delivered_J += since.delivered;
    servo->ledger.hand_J +=
        sc_port_hand(&config->passivity, &servo->port, since.turned, state->handle_force);
    return since;
}

static void begin_sample(sc_servo *servo, const sc_state *state)
{
    sc_sample *sample = &servo->sample;
    memset(sample, 0, sizeof *sample);
    sample->sequence = state->sequence;
    sample->flags = state->flags;
    sample->opening = (double)state->opening;
    sample->advance = (double)state->advance;
    sample->motor_torque = (double)state->motor_torque;
    sample->handle_force = (double)state->handle_force;
    sample->stroke = -1;
}

static void write_command(sc_servo *servo, uint16_t flags, sc_command *command)
{
    command->hold_ticks = 0;
    command->flags = flags;
    command->echo_sequence = servo->sequence;
    command->torque = servo->torque;
    command->force = servo->force;
    servo->sample.torque_command = (double)servo->torque;
    servo->sample.force_command = (double)servo->force;
    servo->command_flags = flags;
    if (flags & SC_COMMAND_ENABLE) {
        servo->enabled_once = 1;
    }
}

static void release_motors(sc_servo *servo, uint16_t flags, sc_command *command)
{
    servo->torque = 0.0f;
    servo->force = 0.0f;
    write_command(servo, flags, command);
}

static effort effort_of_mode(const sc_servo_config *config, const sc_model *model,
                             const sc_reference *reference, sc_servo *servo, const way *since)
{
    effort wanted = {0.0f, 0.0f};
    if (servo->mode == SC_MODE_TRACK && !servo->ending) {
        wanted = track(config, reference, servo, since->dt);
    } else if (servo->mode == SC_MODE_RENDER) {
        wanted = render(config, model, servo, since);
    } else if (servo->mode == SC_MODE_DAMP) {
        wanted.torque = -config->damping_Nm_s_per_rad * servo->motion.opening_rate;
    } else if (servo->mode == SC_MODE_CONTROL && !servo->ending) {
        sc_servo_control(reference, servo, since->dt, &wanted.torque, &wanted.force);
    }
    return wanted;
}

/* Set the command: motors released unless there is no fault. */
static void answer(const sc_servo_config *config, sc_servo *servo, int valid, int faulty,
                   effort wanted, sc_command *command)
{
    const uint16_t clear = faulty ? SC_COMMAND_CLEAR_FAULT : 0;
    if (servo->stop_reason != SC_STOP_NONE) {
        release_motors(servo, 0, command);
    } else if (servo->mode == SC_MODE_IDLE) {
        release_motors(servo, clear, command);
    } else if (faulty || !valid) {
        release_motors(servo, SC_COMMAND_ENABLE | clear, command);
    } else {
        apply_limits(config, servo, wanted);
        write_command(servo, SC_COMMAND_ENABLE, command);
    }
}

/* The last command again; without news for too long it falls to zero as fast as the slew lets it. */
static void repeat_command(const sc_servo_config *config, sc_servo *servo, sc_command *command)
{
    const effort none = {0.0f, 0.0f};
    if (servo->stop_reason != SC_STOP_NONE) {
        release_motors(servo, 0, command);
        return;
    }
    if (servo->mode == SC_MODE_IDLE) {
        release_motors(servo, (uint16_t)(servo->command_flags & SC_COMMAND_CLEAR_FAULT), command);
        return;
    }
    if (servo->stale_us > STALE_US) {
        apply_limits(config, servo, none);
    }
    write_command(servo, (uint16_t)servo->command_flags, command);
}

static int step(const sc_servo_config *config, const sc_model *model,
                const sc_reference *reference, const sc_orders *orders, sc_servo *servo,
                const sc_state *state, sc_command *command)
{
    sc_servo_obey(orders, servo);
    if (servo->started && state->sequence == servo->sequence) {
        servo->duplicates++;
        repeat_command(config, servo, command);
        return 0;
    }
    begin_sample(servo, state);
    sc_servo_count_frame(config, servo, state);
    servo->stale_us = 0;
    sc_lag_state(&servo->lag, servo->mode, state->sequence);
    const int valid = sc_servo_is_plausible(config, servo, state);
    way since = {0.0, 0.0, 0.0, 0.0f};
    if (valid) {
        const sc_motion before = servo->motion;
        float dt = sc_motion_update(&servo->motion, config->rate_cutoff_Hz,
                                    servo->unused_us + servo->stamps.passed_us, state->opening,
                                    state->advance);
        servo->unused_us = 0;
        dt = fminf(dt, LONGEST_TICK_S); /* a gap neither ends the ramp nor fills an integral */
        since = way_since(config, servo, &before, state, dt);
        servo->engaged_s += dt;
        sc_servo_follow_mean(servo, dt);
        sc_servo_move_plate(config, servo, dt);
        sc_servo_watch_speed(config, servo);
    } else {
        sc_servo_pass_unused(servo);
        servo->invalid_frames++;
        servo->sample.flags |= SC_SAMPLE_INVALID;
    }
    servo->sample.device_time_us = servo->motion.device_time_us;
    if (servo->fallback) {
        servo->fallback_frames++;
        servo->sample.flags |= SC_SAMPLE_FALLBACK;
    }
    const int faulty = handle_fault(config, servo, state);
    effort wanted = {0.0f, 0.0f};
    if (valid && !faulty && servo->stop_reason == SC_STOP_NONE) {
        wanted = effort_of_mode(config, model, reference, servo, &since);
    } else {
        sc_port_rest(&servo->port, &servo->ledger);
        sc_control_rest(&servo->control);
    }
    sc_servo_watch_state(config, servo, state, since.dt, valid);
    if (servo->ending) {
        sc_servo_ending(config, servo, &wanted.torque, &wanted.force);
        sc_servo_finish_ending(servo, valid && !faulty && servo->mode != SC_MODE_IDLE);
    }
    answer(config, servo, valid, faulty, wanted, command);
    return 1;
}

int sc_servo_step(const sc_servo_config *config, const sc_model *model,
                  const sc_reference *reference, const sc_orders *orders, sc_servo *servo,
                  const sc_state *state, sc_command *command)
{
    const float sign = config->motor_sign < 0.0f ? -1.0f : 1.0f;
    sc_state corrected = *state;
    corrected.motor_torque *= sign;
    const int fresh = step(config, model, reference, orders, servo, &corrected, command);
    command->torque *= sign;
    return fresh;
}

void sc_servo_sent(sc_servo *servo)
{
    servo->sent_torque = servo->torque;
    servo->sent_force = servo->force;
    servo->slew_us = 0;
    sc_lag_sent(&servo->lag, servo->sequence);
}

void sc_servo_not_sent(sc_servo *servo)
{
    servo->sample.torque_command = (double)servo->sent_torque;
    servo->sample.force_command = (double)servo->sent_force;
}

void sc_servo_answered(sc_servo *servo)
{
    if (servo->command_flags & SC_COMMAND_CLEAR_FAULT) {
        servo->clearings_sent++;
    }
}
