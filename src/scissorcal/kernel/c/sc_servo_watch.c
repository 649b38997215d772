#include "sc_servo_watch.h"
#include "sc_servo_end.h"

#include <math.h>
#include <string.h>

static const float WIDEST_OPENING = 3.14159274f; /* rad; no scissors open wider */

enum {
    SILENCE_UNTIL_STOP = 5,
    LONGEST_US = 0x40000000,
    IMPLAUSIBLE_UNTIL_STOP = 4 /* among SC_RECENT_STATES: in a row, or every fifth one */
};

void sc_servo_engage(sc_servo *servo, uint32_t mode)
{
    servo->ledger.arrest_J += servo->ledger.stored_J;
    servo->ledger.stored_J = 0.0;
    memset(&servo->step, 0, sizeof servo->step);
    memset(&servo->port, 0, sizeof servo->port);
    servo->plate.share = servo->plate.usable ? 1.0f : 0.0f; /* the engagement's ramp is enough */
    memset(&servo->control, 0, sizeof servo->control);
    servo->mode = mode;
    servo->begins = 1;
    servo->engaged_s = 0.0f;
    servo->opening_integral = 0.0f;
    servo->advance_integral = 0.0f;
    servo->track_index = 0;
}

void sc_servo_obey(const sc_orders *orders, sc_servo *servo)
{
    if (orders->stop) {
        sc_servo_stop(servo, SC_STOP_ASKED);
    }
    if (orders->order != servo->order) {
        servo->order = orders->order;
        servo->fallback = 0;
        sc_servo_engage(servo, orders->mode <= SC_MODE_WATCH ? orders->mode : SC_MODE_IDLE);
    }
    if (orders->sheet != servo->sheet) {
        servo->sheet = orders->sheet;
        servo->crack.crack = isfinite(orders->crack) ? orders->crack : 0.0f;
        servo->crack.detached = 0;
        servo->pieces.begun = 0;
    }
}

static uint32_t longer(uint32_t time_us, uint32_t elapsed_us)
{
    return time_us < LONGEST_US && elapsed_us < LONGEST_US ? time_us + elapsed_us : LONGEST_US;
}

/* Without a heartbeat the servo falls back to damping, then stops. With its return RENDER ramps up
 * again; a path that was left is not taken up in its middle. */
static void watch_supervisor(const sc_servo_config *config, const sc_orders *orders,
                             sc_servo *servo, uint32_t elapsed_us)
{
    if (orders->heartbeat != servo->heartbeat) {
        servo->heartbeat = orders->heartbeat;
        servo->silent_us = 0;
        if (servo->fallback && servo->fallback_from == SC_MODE_RENDER) {
            servo->fallback = 0;
            sc_servo_engage(servo, SC_MODE_RENDER);
        }
        return;
    }
    servo->silent_us = longer(servo->silent_us, elapsed_us);
    const uint32_t silent_ms = servo->silent_us / 1000u;
    if (silent_ms / SILENCE_UNTIL_STOP >= config->supervisor_ms) {
        sc_servo_stop(servo, SC_STOP_SUPERVISOR_LOST);
    } else if (silent_ms >= config->supervisor_ms && !servo->fallback &&
               servo->mode != SC_MODE_WATCH) {
        servo->fallback = 1;
        servo->fallback_from = servo->mode;
        if (servo->mode != SC_MODE_IDLE) {
            sc_servo_engage(servo, SC_MODE_DAMP);
        }
    }
}

void sc_servo_pass(const sc_servo_config *config, const sc_orders *orders, sc_servo *servo,
                   uint32_t elapsed_us)
{
    sc_servo_obey(orders, servo);
    if (config->supervisor_ms > 0) {
        watch_supervisor(config, orders, servo, elapsed_us);
    }
    sc_watch_pass(&servo->watch, elapsed_us);
    sc_plate_pass(&servo->plate, elapsed_us);
    sc_servo_pass_ending(servo, elapsed_us);
    servo->stale_us = longer(servo->stale_us, elapsed_us);
    servo->slew_us = longer(servo->slew_us, elapsed_us);
    if (servo->slew_us > config->tick_us) {
        servo->slew_us = config->tick_us;
    }
}

/* Returns the ticks that passed since the last state, 0 for the first. */
static uint32_t take_stamps(const sc_servo_config *config, sc_servo *servo, const sc_state *state)
{
    const int found =
        sc_stamps_take(&servo->stamps, config->tick_us, state->sequence, state->device_us);
    if (found == SC_STAMPS_OFF) {
        sc_servo_stop(servo, SC_STOP_WATCHED + SC_WATCH_CLOCK);
    } else if (found == SC_STAMPS_CONTRADICT) {
        sc_servo_stop(servo, SC_STOP_DEVICE_CLOCK);
    }
    return servo->stamps.ticks;
}

void sc_servo_count_frame(const sc_servo_config *config, sc_servo *servo, const sc_state *state)
{
    const uint32_t passed = state->sequence - servo->sequence;
    const uint32_t taken = take_stamps(config, servo, state);
    servo->frames++;
    if (taken > 1) {
        servo->misses += taken - 1;
        servo->sample.flags |= SC_SAMPLE_AFTER_GAP;
    }
    if (servo->started && passed >= 0x80000000u) {
        sc_servo_stop(servo, SC_STOP_RESTARTED); /* the reference counts by sequence numbers */
    }
    if (taken != passed || taken > SC_LONGEST_GAP_US / config->tick_us) {
        servo->engaged_at += passed - 1; /* the reference waits for blades that did not follow it */
    }
    servo->sequence = state->sequence;
    servo->started = 1;
    if (servo->begins) {
        servo->engaged_at = servo->sequence;
        servo->begins = 0;
    }
    if (state->flags & SC_STATE_TORQUE_SATURATED) {
        servo->device_saturated++;
    }
}

int sc_servo_is_plausible(const sc_servo_config *config, sc_servo *servo, const sc_state *state)
{
    const sc_motion *last = &servo->motion;
    int plausible = isfinite(state->opening) && isfinite(state->advance) &&
                    fabsf(state->opening) <= WIDEST_OPENING &&
                    state->opening >= config->opening_low &&
                    state->opening <= config->opening_high;
    if (plausible && last->started) {
        const float passed_us = (float)servo->unused_us + (float)servo->stamps.shortest_us;
        const float leap_s = (float)SC_LEAP_RATES * 1e-6f * passed_us;
        plausible = fabsf(state->opening - last->opening) <= config->opening_rate_limit * leap_s &&
                    fabsf(state->advance - last->advance) <= config->advance_rate_limit * leap_s;
    }
    if (sc_count_recent(&servo->implausible, !plausible) >= IMPLAUSIBLE_UNTIL_STOP) {
        sc_servo_stop(servo, SC_STOP_IMPLAUSIBLE);
    }
    return plausible;
}

void sc_servo_pass_unused(sc_servo *servo)
{
    servo->unused_us =
        longer(servo->unused_us, servo->motion.started ? servo->stamps.shortest_us : 0);
}

void sc_servo_watch_speed(const sc_servo_config *config, sc_servo *servo)
{
    const sc_motion *motion = &servo->motion;
    const sc_stamps *stamps = &servo->stamps;
    const float faster = stamps->shortest_us > 0 /* than the rate, if less time passed */
                             ? (float)stamps->passed_us / (float)stamps->shortest_us
                             : 1.0f;
    const int fast = faster * fabsf(motion->opening_rate) > config->opening_rate_limit ||
                     faster * fabsf(motion->advance_rate) > config->advance_rate_limit;
    if (fast && servo->mode != SC_MODE_IDLE) {
        sc_servo_stop(servo, SC_STOP_OVERSPEED);
    }
}

static sc_watch_input watched(const sc_servo_config *config, const sc_servo *servo,
                              const sc_state *state, float time_s, int usable)
{
    const sc_motion *motion = &servo->motion;
    const uint32_t not_driven = SC_STATE_FAULT_LATCHED | SC_STATE_ENCODER_FAULT;
    const int enabled = (state->flags & SC_STATE_MOTOR_ENABLED) != 0;
    const int by_itself = servo->mode == SC_MODE_WATCH;
    const sc_watch_input input = {
        time_s,
        usable,
        enabled && !(state->flags & not_driven) && servo->mode != SC_MODE_IDLE &&
            (servo->command_flags & SC_COMMAND_ENABLE),
        !enabled && !(state->flags & not_driven),
        servo->mode == SC_MODE_TRACK,
        (state->flags & SC_STATE_OPENING_AT_STOP) != 0,
        by_itself ? state->motor_torque : servo->sent_torque,
        servo->sent_force,
        config->torque_limit,
        state->motor_torque,
        state->handle_force,
        motion->opening,
        motion->opening_rate,
        motion->advance,
        motion->advance_rate,
        servo->aim_opening,
        servo->aim_rate,
        servo->aim_advance,
        by_itself ? 1.0f : (float)servo->lag.late,
        servo->stamps.ticks * config->tick_us,
        servo->stamps.stated_us};
    return input;
}

void sc_servo_watch_state(const sc_servo_config *config, sc_servo *servo, const sc_state *state,
                          float time_s, int usable)
{
    const sc_watch_input input = watched(config, servo, state, time_s, usable);
    const int seen = sc_watch_take(&config->watch, &servo->watch, &input);
    const uint32_t reason = SC_STOP_WATCHED + (uint32_t)seen;
    switch (seen) {
    case SC_WATCH_NOTHING:
        break;
    case SC_WATCH_SWING:
    case SC_WATCH_HELD_UP:
        sc_servo_let_swings_go(servo, reason);
        break;
    case SC_WATCH_HELD:
    case SC_WATCH_DIFFERS:
    case SC_WATCH_UNREADABLE:
        sc_servo_let_go(servo, reason);
        break;
    default: /* with a motor, an encoder or a clock that is wrong torque and damping may drive */
        sc_servo_stop(servo, reason);
    }
}
