#include "sc_control.h"

#include <math.h>
#include <string.h>

static const float LATE = 2.0f;       /* times the last count took: a later next one means rest */
static const float STANDS_S = 0.04f;  /* without a count blades stand, however slow they were */
static const float DOUBT = 0.3f;      /* share of friction by which a sliding blade's may be wrong ... */
static const float AT_ONCE = 2.5f;    /* ... and, after so many ticks without a count, does not slide */
static const float FASTER = 10.0f;    /* times the slew of a force: a faster gap presses on nothing */
static const float MARGIN = 1.1f;     /* of the level of friction that can hold */
static const float UNKNOWN_AFTER_S = 1.0f;
static const float RESTS = 1e-9f;     /* a rate with a sign, and no size */

float sc_axis_friction_at(const sc_axis_friction *friction, float place, float rate)
{
    const float *level = rate < 0.0f ? friction->negative : friction->positive;
    const float share = fminf(fabsf(rate) / friction->fastest, 1.0f);
    const float along = sqrtf(sqrtf(share)) * (float)(SC_FRICTION_POINTS - 1);
    const int last = SC_FRICTION_POINTS - 2;
    const int at = along < (float)last ? (int)along : last;
    const float away = place - friction->centre;
    const float factor = 1.0f + away * (friction->slope + away * friction->bend);
    const float size = level[at] + (along - (float)at) * (level[at + 1] - level[at]);
    return fmaxf(factor, 0.0f) * size;
}

/* Bring up to date how far the blades went in one direction. An encoder that flickers at rest moves
 * nothing on. */
static void follow_direction(const sc_control_config *config, sc_balance *balance, float opening,
                             float dt)
{
    const float width = config->presliding;
    const float wound = balance->bristle + (opening - balance->opening);
    balance->opening = opening;
    balance->bristle = fminf(fmaxf(wound, -width), width);
    balance->still_s += dt;
    if (balance->bristle != wound) {
        balance->count_s = balance->still_s;
        balance->still_s = 0.0f;
    }
}

/* How surely the blades slide, 0 to 1: they went on in one direction, and lately. */
static float sliding(const sc_control_config *config, const sc_balance *balance)
{
    const float wound = fabsf(balance->bristle) / config->presliding;
    const float patience = fminf(LATE * balance->count_s, STANDS_S);
    if (balance->still_s > patience) {
        return 0.0f;
    }
    return fminf(fmaxf(2.0f * wound - 1.0f, 0.0f), 1.0f);
}

static float between(float from, float to, float share)
{
    return from + share * (to - from);
}

static void restart(sc_balance *balance, const sc_control_tick *tick)
{
    memset(balance, 0, sizeof *balance);
    balance->started = 1;
    balance->rate = tick->opening_rate;
    balance->opening = tick->opening;
    balance->still_s = balance->count_s = STANDS_S;
}

static float level(const sc_control_config *config, const sc_control_tick *tick, float rate)
{
    return sc_axis_friction_at(&config->opening, tick->opening, rate);
}

/* Bring the low-passed balance up to date; returns the balance of this tick alone. */
static float weigh(const sc_control_config *config, sc_balance *balance,
                   const sc_control_tick *tick, float share)
{
    if (!(tick->dt > 0.0f)) {
        return balance->balance;
    }
    const float acceleration = (tick->opening_rate - balance->rate) / tick->dt;
    const float needed = config->inertia * acceleration - tick->motor_torque +
                         config->torque_zero + config->offset;
    balance->balance += share * (needed - balance->balance);
    balance->rate = tick->opening_rate;
    return needed;
}

float sc_balance_take(const sc_control_config *config, sc_balance *balance,
                      const sc_control_tick *tick, float sinking, float lever)
{
    if (!balance->started) {
        restart(balance, tick);
    }
    const float weight = 6.2831853f * config->force_cutoff_Hz * tick->dt;
    const float share = config->force_cutoff_Hz > 0.0f ? weight / (1.0f + weight) : 1.0f;
    const float needed = weigh(config, balance, tick, share);
    follow_direction(config, balance, tick->opening, tick->dt);
    const float direction = balance->bristle < 0.0f ? -1.0f : 1.0f;
    const float along = direction * fmaxf(direction * tick->opening_rate, RESTS);
    const float friction = direction * level(config, tick, along);
    const float news = needed + friction - balance->torque;
    float slides = sliding(config, balance);
    if (balance->still_s > AT_ONCE * tick->dt && fabsf(news) > DOUBT * fabsf(friction)) {
        slides = 0.0f;
    }
    balance->held_s = slides > 0.5f ? 0.0f : balance->held_s + tick->dt;
    const float loading = config->stiffness * sinking;
    if (fabsf(loading) <= FASTER * config->law.force_slew) {
        balance->torque += loading * lever * tick->dt;
    }
    balance->torque += slides * share * news;
    const float band = DOUBT * fabsf(friction);
    const float most = between(MARGIN * level(config, tick, RESTS), friction + band, slides);
    const float least = between(-MARGIN * level(config, tick, -RESTS), friction - band, slides);
    balance->torque =
        fminf(fmaxf(balance->torque, balance->balance + least), balance->balance + most);
    return balance->torque;
}

float sc_balance_sd(const sc_control_config *config, const sc_balance *balance)
{
    const float most = fmaxf(config->opening.positive[0], config->opening.negative[0]);
    const float unknown = 0.57735f * most * fminf(balance->held_s / UNKNOWN_AFTER_S, 1.0f);
    return sqrtf(config->torque_sd * config->torque_sd + unknown * unknown);
}
