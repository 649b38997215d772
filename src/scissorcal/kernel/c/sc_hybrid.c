#include "sc_hybrid.h"
#include "sc_point.h"

#include <math.h>
#include <string.h>

enum { MOST = SC_HYBRID_MOST };

static const float LONGEST_STEP_S = 0.01f; /* a gap in time fills neither the integral nor the ramp */
static const float TWO_PI = 6.28318531f;
static const float SHARPER = 5.0f;         /* wanted rates have no noise, and feed nothing back */

/* What the parts of a step share. */
typedef struct {
    sc_point point;
    float dt;
    float velocity[MOST]; /* of the point */
    float slip[MOST];     /* of the point over the material, along the surface */
    float gap_rate;
    float gathered[MOST]; /* the path's integral as it would grow */
    float normal;         /* a_n */
    float fall;           /* rate that is wanted of the gap */
    float answer;         /* h without lambda_d and the integral */
    float pressing;       /* h as it was */
} moment;

static float clipped(float value, float most)
{
    return fminf(fmaxf(value, -most), most);
}

static void drop_normal(int axes, const float *normal, float *vector)
{
    const float along = sc_point_dot(axes, normal, vector);
    for (int i = 0; i < axes; i++) {
        vector[i] -= along * normal[i];
    }
}

static void look(const sc_hybrid_input *in, moment *now)
{
    const int axes = now->point.axes;
    sc_point_times(axes, &in->jacobian[0][0], in->rate, now->velocity);
    for (int i = 0; i < axes; i++) {
        now->slip[i] = now->velocity[i] - in->surface_velocity[i];
    }
    now->gap_rate = sc_point_dot(axes, in->normal, now->slip);
    drop_normal(axes, in->normal, now->slip);
    now->dt = fminf(in->dt, LONGEST_STEP_S);
}

/* Begin or end touching, by the measured force. Returns 1 while the material is pressed. */
static int is_pressed(const sc_hybrid_config *config, sc_hybrid *state, const sc_hybrid_input *in,
                      float dt, uint32_t *flags)
{
    if (!state->touching && in->force >= config->touch_force) {
        state->touching = 1;
        state->integral = 0.0f;
        state->force_aim = config->touch_force;
        *flags |= SC_HYBRID_TOUCHED;
    }
    const int pressed = state->touching && in->force >= config->leave_force;
    if (pressed) {
        state->below_s = 0.0f;
        state->approaching = 0;
    } else if (state->touching) {
        state->below_s += dt;
        state->force_aim = config->touch_force;
        *flags |= SC_HYBRID_INTEGRAL_HELD;
        if (state->below_s > config->leave_s) {
            state->touching = 0;
            state->below_s = 0.0f;
            state->integral = 0.0f;
            state->force_aim = 0.0f;
            *flags |= SC_HYBRID_LOST;
        }
    }
    if (state->touching) {
        *flags |= SC_HYBRID_CONTACT;
    }
    return pressed;
}

/* The surface's rate along the normal, felt while it is pressed; anew after a gap in time. Friction
 * is compensated by the given rate: the felt one contains the measured rate, and would feed back. */
static void feel(const sc_hybrid_config *config, sc_hybrid *state, const sc_hybrid_input *in,
                 int pressed, moment *now)
{
    if (!pressed || config->surface_cutoff_Hz == 0.0f || in->dt > LONGEST_STEP_S) {
        state->feels = 0;
        return;
    }
    const int axes = now->point.axes;
    const float given = sc_point_dot(axes, in->normal, in->surface_velocity);
    if (!state->feels) {
        state->feels = 1;
        state->surface_rate = given;
        state->force_before = in->force;
    }
    const float corner = TWO_PI * config->surface_cutoff_Hz;
    const float out = sc_point_dot(axes, in->normal, now->velocity);
    const float moved = now->dt * (out - state->surface_rate) +
                        in->compliance * (in->force - state->force_before);
    state->surface_rate += corner / (1.0f + corner * now->dt) * moved;
    state->force_before = in->force;
    now->gap_rate = out - state->surface_rate;
}

/* Let the gap follow a wanted one, at the rate `fall`. */
static void follow_gap(const sc_hybrid_config *config, const sc_hybrid_input *in, float gap,
                       moment *now)
{
    now->normal = in->surface_acceleration + config->normal_kd * (now->fall - now->gap_rate) +
                  config->normal_kp * (gap - in->gap);
}

static void approach(const sc_hybrid_config *config, sc_hybrid *state, const sc_hybrid_input *in,
                     moment *now)
{
    const float most = config->approach_force * now->point.mobility;
    const float lead = config->normal_kp > 0.0f ? most / config->normal_kp : 0.0f;
    const float fastest = fmaxf(config->approach_speed, config->approach_rate * in->gap);
    if (!state->approaching) {
        state->approaching = 1;
        state->aim = in->gap;
        state->speed = fminf(fmaxf(-now->gap_rate, 0.0f), fastest);
    }
    const float grows = config->normal_kp * now->dt; /* in the loop's own time, kd / kp */
    const float share = grows < config->normal_kd ? grows / config->normal_kd : 1.0f;
    state->speed += share * (fastest - state->speed);
    state->aim -= state->speed * now->dt;
    state->aim = in->gap + clipped(state->aim - in->gap, lead);
    now->fall = -state->speed;
    follow_gap(config, in, state->aim, now);
}

/* Let lambda_d follow what is wanted, answer its error, and return the integral as it would grow. */
static float press(const sc_hybrid_config *config, sc_hybrid *state, const sc_hybrid_input *in,
                   moment *now, uint32_t *flags)
{
    const float wanted = fminf(fmaxf(in->force_wanted, config->touch_force), config->force_most);
    if (wanted != in->force_wanted) {
        *flags |= SC_HYBRID_FORCE_BOUNDED;
    }
    state->force_aim += clipped(wanted - state->force_aim, config->force_slew * now->dt);
    const float error = state->force_aim - in->force;
    now->answer = clipped(config->force_kp * error, config->integral_most);
    return clipped(state->integral + config->force_ki * error * now->dt, config->integral_most);
}

/* The path's integral along the surface, no larger than what the largest error pulls. */
static void gather(const sc_hybrid_config *config, const sc_hybrid *state,
                   const sc_hybrid_input *in, const float *error, moment *now)
{
    const int axes = now->point.axes;
    const float most = config->path_kp * config->path_error_most;
    for (int i = 0; i < axes; i++) {
        now->gathered[i] = state->gathered[i] + config->path_ki * error[i] * now->dt;
    }
    drop_normal(axes, in->normal, now->gathered);
    const float size = sqrtf(sc_point_dot(axes, now->gathered, now->gathered));
    for (int i = 0; i < axes && size > most; i++) {
        now->gathered[i] *= most / size;
    }
}

/* a_p: along the path, and against the share of the force that is not balanced, which would move
 * the point along the surface where the mechanism is not equally heavy in all directions. */
static void follow_path(const sc_hybrid_config *config, const sc_hybrid *state,
                        const sc_hybrid_input *in, moment *now, float *pull,
                        sc_hybrid_output *out)
{
    const int axes = now->point.axes;
    float error[MOST];
    for (int i = 0; i < axes; i++) {
        error[i] = in->path[i] - in->point[i];
    }
    drop_normal(axes, in->normal, error);
    out->path_error = sqrtf(sc_point_dot(axes, error, error));
    const float shorter = out->path_error > config->path_error_most
                              ? config->path_error_most / out->path_error
                              : 1.0f;
    for (int i = 0; i < axes; i++) {
        error[i] *= shorter;
    }
    gather(config, state, in, error, now);
    for (int i = 0; i < axes; i++) {
        pull[i] = in->path_acceleration[i] +
                  config->path_kd * (in->path_rate[i] - now->velocity[i]) +
                  config->path_kp * error[i] + now->gathered[i] -
                  now->point.yields[i] * (in->force - now->pressing);
    }
    drop_normal(axes, in->normal, pull);
}

/* How surely a wanted rate tells the direction of motion, 0 to 1; the rest is left to the measured
 * one, within its band. */
static float sureness(float wanted, float band)
{
    return band > 0.0f ? fminf(SHARPER * fabsf(wanted) / band, 1.0f) : 0.0f;
}

/* Share of dry friction that an axis has, -1 to 1. */
static float sliding(float wanted, float rate, float band)
{
    const float sure = sureness(wanted, band);
    const float measured = band > 0.0f ? clipped(rate / band, 1.0f) : 0.0f;
    return (wanted < 0.0f ? -sure : sure) + (1.0f - sure) * measured;
}

/* Add the share of dry friction in the axes and along the surface. */
static void compensate(const sc_hybrid_config *config, const sc_hybrid_input *in,
                       const moment *now, float *effort)
{
    const int axes = now->point.axes;
    const float out = now->fall + sc_point_dot(axes, in->normal, in->surface_velocity);
    float wanted[MOST], glide[MOST], rates[MOST];
    for (int i = 0; i < axes; i++) {
        wanted[i] = in->path_rate[i];
        glide[i] = in->path_rate[i] - in->surface_velocity[i];
    }
    drop_normal(axes, in->normal, wanted);
    drop_normal(axes, in->normal, glide);
    for (int i = 0; i < axes; i++) {
        wanted[i] += out * in->normal[i];
    }
    sc_point_times(axes, &now->point.inverse[0][0], wanted, rates);
    const float drag = config->friction_share * in->surface_friction *
                       fminf(fmaxf(in->force, 0.0f), config->force_most);
    const float way = sqrtf(sc_point_dot(axes, glide, glide));
    const float slip = sqrtf(sc_point_dot(axes, now->slip, now->slip));
    const float sure = sureness(way, config->slip_rate);
    const float by_wish = way > 0.0f ? drag * sure / way : 0.0f;
    const float by_slip =
        slip > 0.0f ? drag * (1.0f - sure) / fmaxf(slip, config->slip_rate) : 0.0f;
    for (int j = 0; j < axes; j++) {
        effort[j] += config->friction_share * in->dry_friction[j] *
                     sliding(rates[j], in->rate[j], config->friction_rate[j]);
        for (int i = 0; i < axes; i++) {
            effort[j] += in->jacobian[i][j] * (by_wish * glide[i] + by_slip * now->slip[i]);
        }
    }
}

/* The effort that moves the point along the normal, and the path's. */
static void move(const sc_hybrid_input *in, const moment *now, const float *pull, float *effort,
                 float *path_effort)
{
    const int axes = now->point.axes;
    float wanted[MOST], rates[MOST];
    for (int i = 0; i < axes; i++) {
        wanted[i] = now->normal * in->normal[i] - in->jacobian_rate[i];
    }
    sc_point_times(axes, &now->point.inverse[0][0], wanted, rates);
    sc_point_times(axes, &in->inertia[0][0], rates, effort);
    sc_point_times(axes, &now->point.inverse[0][0], pull, rates);
    sc_point_times(axes, &in->inertia[0][0], rates, path_effort);
    for (int j = 0; j < axes; j++) {
        effort[j] += in->bias[j];
    }
}

/* Let the integral grow unless it drives an axis beyond its limit. */
static void integrate(const sc_hybrid_config *config, sc_hybrid *state, const moment *now,
                      float grown, const float *effort, uint32_t *flags)
{
    const float change = grown - state->integral;
    for (int j = 0; j < now->point.axes; j++) {
        const float by = now->point.press[j];
        const float whole = effort[j] + by * (state->force_aim + now->answer + grown);
        if (fabsf(whole) > config->effort_limit[j] && whole * by * change > 0.0f) {
            *flags |= SC_HYBRID_INTEGRAL_HELD;
            return;
        }
    }
    state->integral = grown;
}

/* Keep each axis within its limit: the path yields first. */
static void limit(const sc_hybrid_config *config, const float *effort, const float *path_effort,
                  sc_hybrid_output *out)
{
    float share = 1.0f;
    for (int j = 0; j < config->axes; j++) {
        const float most = config->effort_limit[j];
        if (fabsf(effort[j]) > most) {
            out->flags |= SC_HYBRID_EFFORT_LIMITED;
        }
        if (fabsf(effort[j] + path_effort[j]) > most && path_effort[j] != 0.0f) {
            const float room = (path_effort[j] < 0.0f ? -most : most) - effort[j];
            share = fminf(share, fmaxf(room / path_effort[j], 0.0f));
        }
    }
    if (share < 1.0f) {
        out->flags |= SC_HYBRID_PATH_YIELDS;
    }
    out->path_share = share;
    for (int j = 0; j < config->axes; j++) {
        out->effort[j] = clipped(effort[j] + share * path_effort[j], config->effort_limit[j]);
    }
}

static void refuse(sc_hybrid *state, sc_hybrid_output *out, uint32_t flag)
{
    memset(state, 0, sizeof *state);
    memset(out, 0, sizeof *out);
    out->flags = flag;
}

static int is_finite_step(const sc_hybrid *state, int axes, const float *effort,
                          const float *path_effort)
{
    float sum = state->aim + state->speed + state->force_aim + state->integral +
                state->surface_rate;
    for (int j = 0; j < axes; j++) {
        sum += state->gathered[j] + fabsf(effort[j]) + fabsf(path_effort[j]);
    }
    return isfinite(sum);
}

void sc_hybrid_step(const sc_hybrid_config *config, sc_hybrid *state, const sc_hybrid_input *input,
                    sc_hybrid_output *out)
{
    moment now;
    float pull[MOST], effort[MOST], path_effort[MOST], grown = 0.0f;
    memset(out, 0, sizeof *out);
    if (!sc_hybrid_input_is_usable(config->axes, input)) {
        refuse(state, out, SC_HYBRID_INVALID);
        return;
    }
    if (!sc_point_find(&now.point, config->axes, input->jacobian, input->inertia, input->normal,
                       config->least_volume)) {
        refuse(state, out, SC_HYBRID_SINGULAR);
        return;
    }
    look(input, &now);
    const int pressed = is_pressed(config, state, input, now.dt, &out->flags) &&
                        config->normal_law == SC_HYBRID_FORCE;
    feel(config, state, input, pressed, &now);
    now.fall = now.answer = 0.0f;
    if (pressed) {
        grown = press(config, state, input, &now, &out->flags);
        now.normal = input->surface_acceleration - config->contact_kd * now.gap_rate;
    } else if (config->normal_law == SC_HYBRID_FORCE) {
        approach(config, state, input, &now);
    } else {
        now.fall = input->gap_rate_wanted;
        follow_gap(config, input, input->gap_wanted, &now);
    }
    now.pressing = pressed ? state->force_aim + now.answer + state->integral : 0.0f;
    follow_path(config, state, input, &now, pull, out);
    move(input, &now, pull, effort, path_effort);
    compensate(config, input, &now, effort);
    if (pressed) {
        integrate(config, state, &now, grown, effort, &out->flags);
        out->force_aim = state->force_aim;
        out->pressing = state->force_aim + now.answer + state->integral;
        for (int j = 0; j < config->axes; j++) {
            effort[j] += now.point.press[j] * out->pressing;
        }
    }
    limit(config, effort, path_effort, out);
    if (out->path_share == 1.0f) {
        memcpy(state->gathered, now.gathered, (size_t)config->axes * sizeof(float));
    }
    out->gap_rate = now.gap_rate;
    out->mass = 1.0f / now.point.mobility;
    if (!is_finite_step(state, config->axes, effort, path_effort) || !isfinite(out->mass) ||
        !isfinite(out->path_error)) {
        refuse(state, out, SC_HYBRID_INVALID);
    }
}

void sc_hybrid_step_many(const sc_hybrid_config *config, sc_hybrid *state, int64_t n,
                         const sc_hybrid_input *input, sc_hybrid_output *out)
{
    for (int64_t i = 0; i < n; i++) {
        sc_hybrid_step(config, state, &input[i], &out[i]);
    }
}
