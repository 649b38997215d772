#include "sc_swing.h"

#include <math.h>
#include <string.h>

/* A limit cycle has repeated itself three times over; a jolt has not. One that grows to ten times the
 * amplitude has shown itself after two halves. */
static const float HALVES_UNTIL_STOP = 6.0f;
static const float WIDE = 4.0f;  /* times the amplitude: such a half of a swing counts as two ... */
static const float WILD = 10.0f; /* ... and such a one as three */
static const float NOISE_SHARE = 0.25f; /* of a swing's amplitude, within which it has no sign */
/* Work over kinetic energy: at a steady cycle the motor gives what friction takes in each half, 0.7
 * and more; teeth are driven through against the torque's change, -1.6 and less. */
static const float FED = 0.1f;
static const float KEPT = 0.8f;   /* from half to half: the sums are over five */
static const float MEAN_S = 0.4f; /* three swings at 8 Hz */

static void begin_half(sc_swing *swing, int32_t sign, float torque)
{
    swing->sign = sign;
    swing->half_s = 0.0f;
    swing->peak = 0.0f;
    memset(&swing->half, 0, sizeof swing->half);
    swing->low = swing->high = torque;
}

static void forget(sc_swing *swing)
{
    swing->count = 0;
    swing->kinetic = swing->latest = 0.0f;
    memset(&swing->all, 0, sizeof swing->all);
}

static uint32_t weight(float amplitude)
{
    return amplitude >= WILD ? 3 : amplitude >= WIDE ? 2 : 1;
}

static void end_half(const sc_swing_config *config, sc_swing *swing)
{
    const int counts = swing->sign != 0 && swing->half_s * 2.0f * config->Hz <= 1.0f &&
                       swing->peak >= config->rate && swing->high - swing->low >= config->torque;
    if (!counts) {
        forget(swing);
        return;
    }
    swing->count += weight(swing->peak / config->rate);
    swing->all.time = KEPT * swing->all.time + swing->half.time;
    swing->all.torque = KEPT * swing->all.torque + swing->half.torque;
    swing->all.turned = KEPT * swing->all.turned + swing->half.turned;
    swing->all.work = KEPT * swing->all.work + swing->half.work;
    swing->kinetic =
        KEPT * swing->kinetic + 0.5f * config->inertia * swing->peak * swing->peak;
}

/* Work of the torque less its mean over the swings: what moves the blades along is none of them. */
static float fed(const sc_swing_sums *sums)
{
    return sums->time > 0.0f ? sums->work - sums->torque * sums->turned / sums->time : 0.0f;
}

/* The torque that acted since the last state. */
static float acting(const sc_swing_config *config, sc_swing *swing, const sc_swing_input *in)
{
    const float late = fminf(config->delay_ticks, (float)(SC_SWING_TICKS - 2));
    const uint32_t back = (uint32_t)late;
    const float share = late - (float)back;
    if (!swing->begun) {
        swing->begun = 1;
        swing->opening = in->opening;
        swing->mean = in->torque;
        for (uint32_t i = 0; i < SC_SWING_TICKS; i++) {
            swing->sent[i] = in->torque;
        }
    }
    swing->at = (swing->at + 1) % SC_SWING_TICKS;
    swing->sent[swing->at] = in->torque;
    const float newer = swing->sent[(swing->at + SC_SWING_TICKS - back) % SC_SWING_TICKS];
    const float older = swing->sent[(swing->at + SC_SWING_TICKS - back - 1) % SC_SWING_TICKS];
    const float acted = newer + share * (older - newer);
    swing->mean += in->time_s / (MEAN_S + in->time_s) * (acted - swing->mean);
    return acted;
}

int sc_swing_take(const sc_swing_config *config, sc_swing *swing, const sc_swing_input *in,
                  float *share)
{
    const float noise = NOISE_SHARE * config->rate;
    *share = 0.0f;
    if (!(config->rate > 0.0f && config->Hz > 0.0f)) {
        return SC_SWING_NONE;
    }
    const float acted = acting(config, swing, in);
    const float rate = in->rate - in->aim_rate;
    const float turned = in->opening - swing->opening - in->aim_rate * in->time_s;
    swing->opening = in->opening;
    if (swing->sign == 0 || (float)swing->sign * rate < -noise) {
        end_half(config, swing);
        begin_half(swing, fabsf(rate) <= noise ? 0 : rate > 0.0f ? 1 : -1, in->torque);
    }
    swing->half_s += in->time_s;
    swing->half.time += in->time_s;
    swing->half.torque += acted * in->time_s;
    swing->half.turned += turned;
    swing->half.work += acted * turned;
    swing->peak = fmaxf(swing->peak, fabsf(rate));
    swing->low = fminf(swing->low, in->torque);
    swing->high = fmaxf(swing->high, in->torque);
    swing->latest = fmaxf(swing->latest, in->late);
    if (swing->half_s * 2.0f * config->Hz > 1.0f) {
        forget(swing);
    }
    const int is_fed = !(config->inertia > 0.0f) || fed(&swing->all) > FED * swing->kinetic;
    *share = is_fed ? (float)swing->count / HALVES_UNTIL_STOP : 0.0f;
    if (*share < 1.0f) {
        return SC_SWING_NONE;
    }
    const int held_up = config->late_ticks > 0.0f && swing->latest >= 1.0f + config->late_ticks;
    return held_up ? SC_SWING_HELD_UP : SC_SWING_FED;
}

void sc_swing_rest(sc_swing *swing)
{
    memset(swing, 0, sizeof *swing);
}
