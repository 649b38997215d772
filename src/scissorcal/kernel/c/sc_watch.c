#include "sc_watch.h"
#include "sc_stamp.h"

#include <math.h>

/* An effort acts on the rate after wire, motor and filter: in less than this at delays that can be
 * controlled. Blades that speed up against it from then on are driven the wrong way. */
static const float EFFORT_ACTS_S = 0.008f;
static const float STILL_S = 0.5f;
/* Delays of 10 ms move a mean over 30 ms little; the ratio is taken over half a second. */
static const float SMOOTH_S = 0.03f;
static const float SETTLED_S = 0.12f;
static const float FORGET_S = 0.5f;
static const float EXCITED_S = 0.1f;
static const float DIFFERS_S = 0.1f;
static const float ZERO_S = 0.2f;
static const float REVERSED_BELOW = -0.3f; /* a ratio between it ... */
static const float REVERSED_ABOVE = -3.0f; /* ... and this has the wrong sign and about its size */
static const float AT_LIMIT = 0.999f;
static const float BRIEFLY = 0.99f;
static const float RESTS = 0.05f; /* rad/s; motors that are off and turn give a torque */
static const int64_t CLOCK_US = 250000;  /* by ticks: 1 us of jitter is 4 ppm of it */
static const uint32_t HOST_US = 2000000;  /* by this computer's clock: 20 ms of jitter are 1 % */
static const uint32_t OFF_UNTIL_STOP = 3; /* windows in a row */
static const uint32_t STATES_UNTIL_STOP = 20; /* in a row */
static const uint32_t UNREADABLE_UNTIL_STOP = 8; /* among SC_RECENT_STATES, as for stamps */

enum { LONGEST_US = 0x40000000 };

int sc_watch_config_is_sound(const sc_watch_config *config)
{
    const float levels[] = {
        config->held_s,       config->swing_rate,   config->swing_torque,     config->swing_Hz,
        config->runaway_rate, config->still_rad,    config->still_m,          config->still_torque,
        config->rest_torque,  config->rest_share,   config->jitter_s,
        config->least_ratio,  config->most_ratio,   config->ratio_torque,     config->clock_share,
        config->host_clock_share, config->handle_radius, config->runaway_speed,
        config->stop_margin, config->swing_inertia,
        config->swing_delay_ticks, config->held_up_ticks};
    for (unsigned i = 0; i < sizeof levels / sizeof levels[0]; i++) {
        if (!isfinite(levels[i]) || levels[i] < 0.0f) {
            return 0;
        }
    }
    if (config->ratio_torque > 0.0f &&
        (config->least_ratio >= 1.0f || config->most_ratio <= 1.0f)) {
        return 0;
    }
    return isfinite(config->stop_low) && isfinite(config->stop_high) &&
           isfinite(config->handle_zero);
}

void sc_watch_pass(sc_watch *watch, uint32_t elapsed_us)
{
    if (watch->host_us < LONGEST_US && elapsed_us < LONGEST_US) {
        watch->host_us += elapsed_us;
    }
}

static void keep(sc_watch *watch, int which, float share)
{
    if (share > watch->worst[which]) {
        watch->worst[which] = share;
    }
}

/* Keep the largest share of a threshold, and say whether it is reached. */
static int over(sc_watch *watch, int which, float value, float threshold)
{
    if (!(threshold > 0.0f)) {
        return 0;
    }
    keep(watch, which, value / threshold);
    return value >= threshold;
}

/* The same for what has to stay beyond its threshold to count: until then it is below. */
static int over_for_long(sc_watch *watch, int which, float share, int long_enough)
{
    keep(watch, which, long_enough ? share : fminf(share, BRIEFLY));
    return long_enough && share >= 1.0f;
}

static int held(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    const int at_limit = fabsf(in->torque) >= AT_LIMIT * in->torque_limit;
    watch->held_s = fmaxf(watch->held_s + (at_limit ? in->time_s : -in->time_s), 0.0f);
    return over(watch, SC_WATCH_HELD, watch->held_s, config->held_s);
}

static int swings(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    const sc_swing_config level = {config->swing_rate,    config->swing_torque,
                                   config->swing_Hz,      config->swing_inertia,
                                   config->swing_delay_ticks, config->held_up_ticks};
    const sc_swing_input now = {in->time_s, in->opening, in->opening_rate,
                                in->tracking ? in->aim_rate : 0.0f, in->torque, in->late};
    float share;
    const int found = sc_swing_take(&level, &watch->swing, &now, &share);
    if (found == SC_SWING_HELD_UP) {
        keep(watch, SC_WATCH_HELD_UP, share);
        return SC_WATCH_HELD_UP;
    }
    keep(watch, SC_WATCH_SWING, share);
    return found == SC_SWING_FED ? SC_WATCH_SWING : SC_WATCH_NOTHING;
}

/* How fast an axis is against an effort of one sign, and got since that effort could act. */
static float speed_against(sc_watch_effort *since, float effort, float rate, float time_s)
{
    const int32_t sign = effort > 0.0f ? 1 : effort < 0.0f ? -1 : 0;
    const int begins = sign != since->sign || sign == 0;
    since->sign = sign;
    since->for_s = begins ? 0.0f : since->for_s + time_s;
    if (since->for_s < EFFORT_ACTS_S) {
        since->rate = rate;
        return 0.0f;
    }
    return fminf(-(float)sign * rate, -(float)sign * (rate - since->rate));
}

/* A hand may speed up an axis against its motor; a motor that follows a reference does not. */
static int runs_away(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    if (!in->tracking) {
        watch->torque.sign = watch->force.sign = 0;
        return SC_WATCH_NOTHING;
    }
    const float blades = speed_against(&watch->torque, in->torque, in->opening_rate, in->time_s);
    const float sledge = speed_against(&watch->force, in->force, in->advance_rate, in->time_s);
    if (over(watch, SC_WATCH_RUNAWAY, blades, config->runaway_rate)) {
        return SC_WATCH_RUNAWAY;
    }
    return over(watch, SC_WATCH_RUNAWAY_ADVANCE, sledge, config->runaway_speed)
               ? SC_WATCH_RUNAWAY_ADVANCE
               : SC_WATCH_NOTHING;
}

static int is_elsewhere(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    const float away = fminf(fabsf(in->opening - config->stop_low),
                             fabsf(in->opening - config->stop_high));
    watch->elsewhere = in->at_stop && away > config->stop_margin ? watch->elsewhere + 1 : 0;
    return config->stop_margin > 0.0f &&
           over(watch, SC_WATCH_STOP, (float)watch->elsewhere, (float)STATES_UNTIL_STOP);
}

/* Blades rest where friction holds what motor and hand leave over. Of what the two hold between them
 * a share may be missing, as their scales may be off. */
static int rests_against(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    const float hand = config->handle_radius * (in->handle_force - config->handle_zero);
    const float motor = in->measured - watch->zero;
    const float drive = isfinite(motor - hand) ? motor - hand : 0.0f;
    const float load = isfinite(motor - hand) ? fminf(fabsf(motor), fabsf(hand)) : 0.0f;
    watch->imbalance += in->time_s / (SMOOTH_S + in->time_s) * (drive - watch->imbalance);
    if (!(config->handle_radius > 0.0f && config->rest_torque > 0.0f) || watch->still_s < STILL_S) {
        return 0;
    }
    return over(watch, SC_WATCH_STILL, fabsf(watch->imbalance),
                config->rest_torque + config->rest_share * load);
}

static int stands(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    if (!watch->has_still || in->opening != watch->still_opening) {
        watch->still_opening = in->opening;
        watch->still_aim = in->aim_opening;
        watch->still_s = 0.0f;
        watch->imbalance = 0.0f;
    }
    if (!watch->has_still || in->advance != watch->still_advance) {
        watch->still_advance = in->advance;
        watch->still_aim_advance = in->aim_advance;
    }
    watch->has_still = 1;
    watch->still_s = in->at_stop ? 0.0f : watch->still_s + in->time_s;
    if (over(watch, SC_WATCH_STILL, watch->still_s, config->jitter_s)) {
        return 1;
    }
    if (in->tracking) {
        const float moved = fabsf(in->aim_opening - watch->still_aim);
        const float pushed = fabsf(in->torque);
        return config->still_rad > 0.0f && config->still_torque > 0.0f &&
               over(watch, SC_WATCH_STILL,
                    fminf(moved / config->still_rad, pushed / config->still_torque), 1.0f);
    }
    watch->still_aim = in->aim_opening;
    watch->still_aim_advance = in->aim_advance;
    return rests_against(config, watch, in);
}

static int advance_stands(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    return in->tracking && over(watch, SC_WATCH_STILL_ADVANCE,
                                fabsf(in->aim_advance - watch->still_aim_advance), config->still_m);
}

/* Mean of the measured torque while the motors are off and the blades rest. */
static void take_zero(sc_watch *watch, const sc_watch_input *in)
{
    if (isfinite(in->measured) && in->released && fabsf(in->opening_rate) < RESTS &&
        in->time_s > 0.0f) {
        const float age = fminf(watch->zero_s, ZERO_S);
        watch->zero_s += in->time_s;
        watch->zero += (in->measured - watch->zero) * in->time_s / (age + in->time_s);
    }
}

/* The measured over the commanded torque, in half a second in which there was enough of it: which
 * watch stops, if any. */
static int compare_torques(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    const float share = in->time_s / (SMOOTH_S + in->time_s);
    if (!(config->ratio_torque > 0.0f) || !isfinite(in->measured)) {
        return SC_WATCH_NOTHING;
    }
    watch->smooth_torque += share * (in->torque - watch->smooth_torque);
    watch->smooth_measured += share * (in->measured - watch->zero - watch->smooth_measured);
    watch->driven_s += in->time_s;
    if (watch->driven_s < SETTLED_S) {
        return SC_WATCH_NOTHING;
    }
    const float kept = FORGET_S / (FORGET_S + in->time_s);
    watch->sum_cc = kept * watch->sum_cc + in->time_s * watch->smooth_torque * watch->smooth_torque;
    watch->sum_cm =
        kept * watch->sum_cm + in->time_s * watch->smooth_torque * watch->smooth_measured;
    if (watch->sum_cc < EXCITED_S * config->ratio_torque * config->ratio_torque) {
        watch->differs_s = 0.0f;
        return SC_WATCH_NOTHING;
    }
    const float ratio = watch->sum_cm / watch->sum_cc;
    const float off = ratio < 1.0f ? (1.0f - ratio) / (1.0f - config->least_ratio)
                                   : (ratio - 1.0f) / (config->most_ratio - 1.0f);
    const int which = ratio < REVERSED_BELOW && ratio > REVERSED_ABOVE ? SC_WATCH_REVERSED
                                                                       : SC_WATCH_DIFFERS;
    watch->differs_s = off >= 1.0f ? watch->differs_s + in->time_s : 0.0f;
    return over_for_long(watch, which, off, watch->differs_s >= DIFFERS_S) ? which
                                                                           : SC_WATCH_NOTHING;
}

/* Count the windows in a row in which a clock is off by more than allowed. */
static int is_off(sc_watch *watch, int64_t clock_us, int64_t passed_us, float allowed,
                  uint32_t *windows)
{
    if (!(allowed > 0.0f)) {
        return 0;
    }
    const float share = fabsf((float)(clock_us - passed_us) / (float)passed_us) / allowed;
    *windows = share >= 1.0f ? *windows + 1 : 0;
    return over_for_long(watch, SC_WATCH_CLOCK, share, *windows >= OFF_UNTIL_STOP);
}

/* Time by the device's clock against what its sequence numbers, or this computer, say passed. Every
 * stamp counts, also one that no rate is taken from. */
static int clock_is_off(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    int off = 0;
    if (!watch->has_clock) {
        watch->has_clock = 1;
        watch->host_us = 0;
    }
    watch->ticks_us += in->ticks_us;
    watch->clock_us += in->stated_us;
    watch->host_clock_us += in->stated_us;
    if (watch->ticks_us >= CLOCK_US) {
        off = is_off(watch, watch->clock_us, watch->ticks_us, config->clock_share,
                     &watch->off_ticks);
        watch->ticks_us = watch->clock_us = 0;
    }
    if (watch->host_us >= HOST_US) {
        off |= is_off(watch, watch->host_clock_us, watch->host_us, config->host_clock_share,
                      &watch->off_host);
        watch->host_clock_us = 0;
        watch->host_us = 0;
    }
    return off;
}

static int unreadable(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    const int readable = isfinite(in->measured) &&
                         (isfinite(in->handle_force) || !(config->handle_radius > 0.0f));
    const uint32_t count = sc_count_recent(&watch->unreadable, !readable);
    return config->ratio_torque > 0.0f &&
           over(watch, SC_WATCH_UNREADABLE, (float)count, (float)UNREADABLE_UNTIL_STOP);
}

/* Begin again what counts over a time in which motors drive. */
static void rest(sc_watch *watch)
{
    watch->held_s = 0.0f;
    sc_swing_rest(&watch->swing);
    watch->torque.sign = watch->force.sign = 0;
    watch->has_still = 0;
    watch->smooth_torque = watch->smooth_measured = 0.0f;
    watch->driven_s = 0.0f;
    watch->sum_cc = watch->sum_cm = 0.0f;
    watch->differs_s = 0.0f;
}

int sc_watch_take(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *in)
{
    if (clock_is_off(config, watch, in)) {
        return SC_WATCH_CLOCK;
    }
    if (unreadable(config, watch, in)) {
        return SC_WATCH_UNREADABLE;
    }
    if (!in->driven || !in->usable) {
        if (!in->driven) {
            rest(watch);
            take_zero(watch, in);
        }
        return SC_WATCH_NOTHING;
    }
    const int running = runs_away(config, watch, in);
    if (running != SC_WATCH_NOTHING) {
        return running;
    }
    if (is_elsewhere(config, watch, in)) {
        return SC_WATCH_STOP;
    }
    const int swinging = swings(config, watch, in);
    if (swinging != SC_WATCH_NOTHING) {
        return swinging;
    }
    const int differing = compare_torques(config, watch, in);
    if (differing != SC_WATCH_NOTHING) {
        return differing;
    }
    if (stands(config, watch, in)) {
        return SC_WATCH_STILL;
    }
    if (advance_stands(config, watch, in)) {
        return SC_WATCH_STILL_ADVANCE;
    }
    return held(config, watch, in) ? SC_WATCH_HELD : SC_WATCH_NOTHING;
}
