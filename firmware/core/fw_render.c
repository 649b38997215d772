/* The torque and force of an image at each tick: see fw_render.h. */
#include "fw_render.h"

#include <math.h>
#include <string.h>

static const float LONGEST_TICK_S = 0.01f; /* as in sc_servo.c */
static const float MEMORY_S = 0.5f;        /* of the observer; these two as in sc_passivity.c */
static const float LEAST_SQUARE = 1e-6f;

void fw_render_init(fw_render *render, float *memory, uint32_t capacity)
{
    memset(render, 0, sizeof *render);
    render->memory = memory;
    render->capacity = capacity;
}

static void fresh_start(fw_render *render)
{
    render->engaged_s = 0.0f;
    render->anchor.is_set = 0;
    memset(&render->observer, 0, sizeof render->observer);
}

uint8_t fw_render_set(fw_render *render, float value)
{
    if (value == 1.0f && render->crc32 != 0u) {
        render->on = 1;
        memset(&render->crack, 0, sizeof render->crack);
        fresh_start(render);
        return SC_CONFIG_OK;
    }
    if (value == 0.0f) {
        render->on = 0;
        return SC_CONFIG_OK;
    }
    return SC_CONFIG_VALUE_REFUSED;
}

/* Time since the last tick by the clock, or the tick where the clock cannot be right. */
static uint32_t passed_us(fw_render *render, const fw_render_tick_inputs *in)
{
    const uint32_t passed = in->device_us - render->last_us;
    render->last_us = in->device_us;
    const int is_usable = passed >= in->tick_us / 2u && passed <= 2u * in->tick_us;
    return is_usable ? passed : in->tick_us;
}

static float within(float value, float limit)
{
    return fminf(fmaxf(value, -limit), limit);
}

/* Finite, within the limit, and not farther than `most` from what was given before. */
static float limited(float wanted, float before, float limit, float most)
{
    const float given = within(isfinite(wanted) ? wanted : 0.0f, limit);
    if (given > before + most) {
        return before + most;
    }
    return given < before - most ? before - most : given;
}

/* Damping against energy that the loop made: what the motors did beyond the torque that the model had
 * on the way, less what the rig's own friction takes. */
static float damping(fw_render *render, const fw_render_tick_inputs *in, float torque, float force,
                     float dt)
{
    const fw_drive *drive = &render->image.drive;
    fw_observer *kept = &render->observer;
    const float measured = drive->motor_sign * in->motor_torque;
    const float rate = render->motion.opening_rate;
    float added = 0.0f;
    if (kept->started) {
        const float turned = in->opening - kept->opening;
        const float moved = in->advance - kept->advance;
        const float did = drive->is_measured != 0.0f && isfinite(measured)
                              ? 0.5f * (kept->measured + measured)
                              : render->torque;
        const float late = (did - 0.5f * (kept->torque + torque)) * turned +
                           (render->force - 0.5f * (kept->force + force)) * moved;
        const float taken =
            drive->rig_coulomb * fabsf(turned) + drive->rig_damping * turned / dt * turned;
        const float left = (1.0f - dt / MEMORY_S) * kept->observed_J + late - taken;
        kept->observed_J = left > 0.0f ? left : 0.0f;
        const float excess = kept->observed_J - drive->margin_J;
        if (excess > 0.0f) {
            const float square = fmaxf(rate * rate, LEAST_SQUARE);
            added = -fminf(drive->most_damping, excess / (dt * square)) * rate;
        }
    }
    kept->started = 1;
    kept->torque = torque;
    kept->force = force;
    kept->opening = in->opening;
    kept->advance = in->advance;
    kept->measured = isfinite(measured) ? measured : 0.0f;
    return added;
}

/* What the model answers now, ramped; not yet slewed. */
static void wanted_now(fw_render *render, const fw_render_tick_inputs *in, float dt, float *torque,
                       float *force)
{
    const fw_drive *drive = &render->image.drive;
    const sc_motion *motion = &render->motion;
    render->engaged_s += dt;
    const float share = render->engaged_s < drive->ramp_s ? render->engaged_s / drive->ramp_s : 1.0f;
    sc_model_step(&render->image.model, &render->crack, motion->opening, motion->opening_rate,
                  motion->advance, &render->step);
    sc_near_rest(&render->image.model, drive->friction_width, &render->anchor, motion->opening,
                 motion->opening_rate, &render->step);
    *torque = share * render->step.torque;
    *force = share * render->step.force;
    *torque += damping(render, in, within(*torque, drive->torque_limit),
                       within(*force, drive->force_limit), dt);
}

void fw_render_tick(fw_render *render, const fw_render_tick_inputs *in,
                    fw_render_tick_outputs *out)
{
    const fw_drive *drive = &render->image.drive;
    const uint32_t passed = passed_us(render, in);
    memset(out, 0, sizeof *out);
    if (render->crc32 == 0u) {
        render->torque = render->force = 0.0f;
        return;
    }
    const float dt = fminf(sc_motion_update(&render->motion, drive->rate_cutoff_Hz, passed,
                                            in->opening, in->advance),
                           LONGEST_TICK_S);
    if (!in->enabled) {
        fresh_start(render);
        render->torque = render->force = 0.0f;
        return;
    }
    float torque = 0.0f, force = 0.0f;
    if (render->on) {
        wanted_now(render, in, dt, &torque, &force);
    } else {
        fresh_start(render);
    }
    render->torque = limited(torque, render->torque, drive->torque_limit, drive->torque_slew * dt);
    render->force = limited(force, render->force, drive->force_limit, drive->force_slew * dt);
    out->torque = drive->motor_sign * render->torque;
    out->force = render->force;
    out->rendering = render->on;
}
