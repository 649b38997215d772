/* What the files of the core share with one another, and nobody else. */
#ifndef FW_PARTS_H
#define FW_PARTS_H

#include "fw_core.h"

static inline float fw_magnitude(float value)
{
    return value < 0.0f ? -value : value;
}

/* 0 for an infinity and for what is no number; without a C library. */
static inline int fw_finite(float value)
{
    return value - value == 0.0f;
}

static inline float fw_clip(float value, float limit)
{
    if (value > limit) {
        return limit;
    }
    return value < -limit ? -limit : value;
}

static inline int fw_has(const fw_core *core, uint32_t capability)
{
    return (core->board.capabilities & capability) != 0;
}

static inline int fw_has_carriage(const fw_core *core)
{
    return core->board.advance_max > core->board.advance_min;
}

/* fw_outbox.c. A reply that finds no room is dropped whole: a host that asks more than it reads
 * repeats. A STATE replaces the one before it, unless that is partly taken. */
void fw_put_reply(fw_outbox *outbox, const uint8_t *payload, size_t size);
void fw_put_state(fw_outbox *outbox, const sc_state *state);

/* fw_watch.c. Take the readings of a tick: rate, heat, doubt about the encoders. */
void fw_measure(fw_core *core, const fw_inputs *inputs);

/* Cause of a fault that holds now, SC_CAUSE_NONE without one. */
uint8_t fw_present_cause(const fw_core *core, const fw_inputs *inputs);

/* fw_home.c. */
void fw_home_begin(fw_core *core, const fw_inputs *last);
void fw_home_end(fw_core *core, uint8_t result);

/* Pass one tick of homing; returns the torque, and leaves the phase when it ends. */
float fw_home_tick(fw_core *core, const fw_inputs *inputs);

#endif
