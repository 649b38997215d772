/* Rendering on the device: the upload of a package's image, and its torque and force at each tick.
 *
 * The board gives the memory for one image, which is used where it lies. LOAD_BEGIN discards the image
 * in force and sets RENDER to 0; LOAD_CHUNKs come in order, one that has come already is confirmed
 * again; LOAD_COMMIT checks the whole and puts it in force, so that the next tick has it. While the
 * motors are enabled all three are refused (SC_LOAD_BUSY). RENDER = 1 puts a fresh sheet between the
 * blades.
 *
 * Torque and force are those of the host's loop (sc_servo): the same sc_model_step, sc_near_rest and
 * rate, from this tick's own measurement; ramped up from nothing each time the motors are enabled or
 * RENDER is set; within the image's limits, and no faster than its slews. RENDER = 0 lets them fall
 * that way, too. What differs: the energy that the loop creates is summed in float, not in double, and
 * no books of the energies are kept.
 *
 * While RENDER is 1 the host may be silent for FW_RENDER_SILENCE_MS: docs/decisions has why.
 */
#ifndef FW_RENDER_H
#define FW_RENDER_H

#include "fw_image.h"
#include "sc_messages.h"
#include "sc_motion.h"
#include "sc_near_rest.h"

#include <stddef.h>

enum {
    FW_RENDER_SILENCE_MS = 2000, /* without a COMMAND, until the device brakes */
    FW_IMAGE_MOST_BYTES = 4 * (FW_IMAGE_WORDS + 16 * SC_TABLE_MAX) /* the largest that there is */
};

/* Of the image announced last. */
typedef struct {
    uint32_t announced; /* 1 until it is refused */
    uint32_t size;      /* bytes ... */
    uint32_t crc32;     /* ... and checksum, as announced */
    uint32_t received;  /* bytes */
    uint32_t crc;       /* of what was received */
} fw_load;

/* What the observer keeps from the tick before: see sc_passivity.h. */
typedef struct {
    uint32_t started;
    float torque, force;     /* the model's, within the limits */
    float opening, advance;
    float measured;
    float observed_J;
} fw_observer;

typedef struct {
    float *memory;     /* of one image */
    uint32_t capacity; /* bytes */
    fw_load load;
    fw_image image;    /* in force where crc32 is not 0 */
    uint32_t crc32;    /* of the image in force, 0 without one */
    uint32_t on;       /* RENDER */
    uint32_t last_us;
    sc_motion motion;
    sc_crack crack;
    sc_anchor anchor;
    sc_step_output step; /* of the last rendered tick */
    fw_observer observer;
    float engaged_s;
    float torque, force; /* given in the last tick, of the model's sign */
} fw_render;

typedef struct {
    uint32_t device_us;
    uint32_t tick_us;
    float opening, advance; /* from home */
    float motor_torque;     /* measured, where the image says so */
    uint32_t enabled;       /* the motors are, and no fault stands */
} fw_render_tick_inputs;

typedef struct {
    float torque, force;
    uint32_t rendering; /* for SC_STATE_RENDERING */
} fw_render_tick_outputs;

/* Start without an image. `memory`: capacity bytes that stay the caller's and are not read or written by
 * anybody else. */
void fw_render_init(fw_render *render, float *memory, uint32_t capacity);

/* 1 if the payload is a LOAD message, and *echo is the answer. */
int fw_render_load(fw_render *render, const uint8_t *payload, size_t size, int enabled,
                   sc_load_echo *echo);

/* The same answer by a device that renders nothing: no format, no capacity. */
int fw_refuse_load(const uint8_t *payload, size_t size, sc_load_echo *echo);

/* Set RENDER; SC_CONFIG_OK, or SC_CONFIG_VALUE_REFUSED for another value than 0 and 1, and for 1
 * without an image in force. */
uint8_t fw_render_set(fw_render *render, float value);

/* Pass a tick; once in each, also while the motors are off. */
void fw_render_tick(fw_render *render, const fw_render_tick_inputs *in,
                    fw_render_tick_outputs *out);

#endif
