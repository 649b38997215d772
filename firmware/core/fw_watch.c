/* What latches a fault. */
#include "fw_parts.h"

enum {
    RATE_TICKS = 4,    /* the rate is smoothed over these; fw_board.c refuses too coarse encoders */
    ENCODER_TICKS = 16, /* plausible readings in a row after which an encoder is believed again */
    LONGEST_US = 1000000 /* BRAKE_AFTER_MS at most: nothing drives blades on through a longer pause */
};

/* Time since the last measurement by the clock, which wraps; the table's tick where it stands still. */
static float passed(const fw_core *core, uint32_t device_us)
{
    const uint32_t us = device_us - core->last_us;
    if (!core->measured || us == 0u) {
        return core->tick_s;
    }
    return 1e-6f * (float)(us < (uint32_t)LONGEST_US ? us : (uint32_t)LONGEST_US);
}

static int leaps(float from, float to, float farthest)
{
    return !(fw_magnitude(to - from) <= farthest);
}

static int encoders_wrong(const fw_core *core, const fw_inputs *inputs)
{
    if ((inputs->flags & FW_IN_ENCODER_BAD) != 0 || !fw_finite(inputs->opening)) {
        return 1;
    }
    if (fw_has_carriage(core) && !fw_finite(inputs->advance)) {
        return 1;
    }
    if (!core->measured) {
        return 0;
    }
    /* A late measurement may be farther from the last one; an early one is no better than in a tick. */
    const float late = core->passed_s > core->tick_s ? core->passed_s / core->tick_s : 1.0f;
    return leaps(core->last_opening, inputs->opening, late * core->board.opening_leap) ||
           (fw_has_carriage(core) &&
            leaps(core->last_advance, inputs->advance, late * core->board.advance_leap));
}

static float current(const fw_core *core, const fw_inputs *inputs)
{
    return fw_has(core, SC_CAPABILITY_TORQUE_MEASURED) ? inputs->current
                                                       : core->torque / core->board.torque_per_A;
}

static void warm(fw_core *core, float amperes)
{
    const fw_board *board = &core->board;
    const float bears = board->current_continuous * board->current_continuous;
    const float most = 2.0f * board->i2t_limit; /* so that it cools in bounded time */
    core->heat += (amperes * amperes - bears) * core->passed_s;
    if (!(core->heat < most)) {
        core->heat = most;
    } else if (core->heat < 0.0f) {
        core->heat = 0.0f;
    }
}

void fw_measure(fw_core *core, const fw_inputs *inputs)
{
    const float amperes = current(core, inputs);
    core->passed_s = passed(core, inputs->device_us);
    core->last_us = inputs->device_us;
    if (fw_finite(amperes)) {
        warm(core, amperes);
    }
    if (encoders_wrong(core, inputs)) {
        core->encoder_doubt = ENCODER_TICKS;
        core->rate = 0.0f;
        if (fw_has(core, SC_CAPABILITY_HOMES)) {
            core->homed = 0; /* counts may be lost */
        }
    } else if (core->measured) {
        /* a lag of RATE_TICKS - 1 ticks of time: a quarter of the way in a tick, less in a shorter one */
        const float rate = (inputs->opening - core->last_opening) / core->passed_s;
        const float share = 1.0f + (float)(RATE_TICKS - 1) * (core->tick_s / core->passed_s);
        core->rate += (rate - core->rate) / share;
        if (core->encoder_doubt > 0) {
            core->encoder_doubt--;
        }
    }
    if (fw_finite(inputs->opening) && (fw_finite(inputs->advance) || !fw_has_carriage(core))) {
        core->last_opening = inputs->opening;
        core->last_advance = inputs->advance;
        core->measured = 1;
    }
}

uint8_t fw_present_cause(const fw_core *core, const fw_inputs *inputs)
{
    const fw_board *board = &core->board;
    if ((inputs->flags & FW_IN_STOP_BUTTON) != 0) {
        return SC_CAUSE_STOP_BUTTON;
    }
    if (board->supply_max > 0.0f &&
        !(inputs->supply >= board->supply_min && inputs->supply <= board->supply_max)) {
        return SC_CAUSE_SUPPLY;
    }
    if ((inputs->flags & FW_IN_DRIVER_FAULT) != 0) {
        return SC_CAUSE_DRIVER;
    }
    if (core->encoder_doubt > 0) {
        return SC_CAUSE_ENCODER;
    }
    if (!(fw_magnitude(current(core, inputs)) <= board->current_limit) ||
        !(core->heat <= board->i2t_limit)) {
        return SC_CAUSE_CURRENT;
    }
    if (core->phase >= FW_ENABLED || core->phase == FW_HOMING) {
        if (!(fw_magnitude(core->rate) <= board->overspeed)) { /* a hand may be fast, motors off */
            return SC_CAUSE_SPEED;
        }
    }
    if (board->temperature_max > 0.0f && !(inputs->temperature <= board->temperature_max)) {
        return SC_CAUSE_HEAT;
    }
    return core->lost ? SC_CAUSE_WATCHDOG : SC_CAUSE_NONE;
}
