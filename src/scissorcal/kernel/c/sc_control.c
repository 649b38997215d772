#include "sc_control.h"
#include "sc_turn.h"

#include <math.h>
#include <string.h>

static const float LONGEST_STEP_S = 0.01f;
static const float SLIDES = 1e-3f; /* m/s; slower friction on the surface is in proportion */
static const float SETTLED = 0.9f; /* share of the wanted force from which the path goes on */

enum { AXES = 2, TORQUE = 0, FORCE = 1 };

/* What the contour says about the tip now. */
typedef struct {
    float tip[AXES];
    float jacobian[AXES][AXES];
    float jacobian_rate[AXES];
    float normal[AXES];
    float tangent[AXES];
    float velocity[AXES]; /* of the material under the tip */
    float gap, place;
    float gap_rate, place_rate; /* of the tip against the material */
    float curvature;
} look;

static int is_level(float value)
{
    return isfinite(value) && value >= 0.0f;
}

static int is_sound_friction(const sc_axis_friction *friction)
{
    for (int i = 0; i < SC_FRICTION_POINTS; i++) {
        if (!is_level(friction->positive[i]) || !is_level(friction->negative[i])) {
            return 0;
        }
    }
    return friction->fastest > 0.0f && isfinite(friction->fastest) && isfinite(friction->slope) &&
           isfinite(friction->bend) && isfinite(friction->centre);
}

int sc_control_config_is_sound(const sc_control_config *config)
{
    const float levels[] = {
        config->surface_friction, config->stiffness,  config->force_cutoff_Hz, config->torque_sd,
        config->force_band,
        config->pace_s,           config->stale_s,    config->lift_gap,        config->lift_speed,
        config->force_stop,       config->path_stop,  config->handle_stop,     config->sustained_s};
    const float above[] = {config->station, config->inertia, config->mass,  config->presliding,
                           config->tick_s,  config->away,    config->end_s, config->approach_s,
                           config->least_lever};
    for (size_t i = 0; i < sizeof levels / sizeof levels[0]; i++) {
        if (!is_level(levels[i])) {
            return 0;
        }
    }
    for (size_t i = 0; i < sizeof above / sizeof above[0]; i++) {
        if (!is_level(above[i]) || above[i] == 0.0f) {
            return 0;
        }
    }
    return config->law.axes == AXES && config->law.normal_law == SC_HYBRID_FORCE &&
           sc_hybrid_config_is_sound(&config->law) && isfinite(config->edge_offset) &&
           config->law.force_kp == 0.0f && config->law.surface_cutoff_Hz == 0.0f &&
           isfinite(config->offset) &&
           isfinite(config->torque_zero) && isfinite(config->handle_zero) &&
           (config->moving_blades == 1.0f || config->moving_blades == 2.0f) &&
           is_sound_friction(&config->opening) && is_sound_friction(&config->advance);
}

static float dot(const float *a, const float *b)
{
    return a[0] * b[0] + a[1] * b[1];
}

static void find_tip(const sc_control_config *config, const sc_control_tick *tick, look *now)
{
    const float m = config->moving_blades;
    const sc_turn blade = sc_turn_of(tick->opening / m);
    const float along = config->station * blade.cosine - config->edge_offset * blade.sine;
    const float up = config->station * blade.sine + config->edge_offset * blade.cosine;
    const float turn = tick->opening_rate / m;
    now->tip[0] = tick->advance + along;
    now->tip[1] = up;
    now->jacobian[0][TORQUE] = -up / m;
    now->jacobian[1][TORQUE] = along / m;
    now->jacobian[0][FORCE] = 1.0f;
    now->jacobian[1][FORCE] = 0.0f;
    now->jacobian_rate[0] = -turn * turn * along;
    now->jacobian_rate[1] = -turn * turn * up;
}

/* Where the tip is against the contour, which has moved on for its age. */
static void find_surface(const sc_contour *contour, float age_s, const sc_control_tick *tick,
                         look *now)
{
    const sc_turn moved = sc_turn_of(contour->turn_rate * age_s);
    const float normal[AXES] = {contour->normal[0] * moved.cosine - contour->normal[1] * moved.sine,
                                contour->normal[0] * moved.sine + contour->normal[1] * moved.cosine};
    const float tangent[AXES] = {normal[1], -normal[0]};
    const float away[AXES] = {now->tip[0] - contour->point[0] - contour->velocity[0] * age_s,
                              now->tip[1] - contour->point[1] - contour->velocity[1] * age_s};
    const float u = dot(tangent, away), up = dot(normal, away);
    const float foot = u / (1.0f + contour->curvature * up); /* exact for a circle, as is bend */
    const float bend = contour->curvature * foot;
    const float length = sqrtf(1.0f + bend * bend);
    for (int i = 0; i < AXES; i++) {
        now->normal[i] = (normal[i] + bend * tangent[i]) / length;
    }
    now->tangent[0] = now->normal[1];
    now->tangent[1] = -now->normal[0];
    now->gap = up + 0.5f * bend * u * (1.0f - 0.25f * bend * bend);
    now->place = contour->place + foot * (1.0f - bend * bend / 3.0f);
    now->curvature = contour->curvature;
    now->velocity[0] = contour->velocity[0] - contour->turn_rate * away[1];
    now->velocity[1] = contour->velocity[1] + contour->turn_rate * away[0];
    float speed[AXES];
    for (int i = 0; i < AXES; i++) {
        speed[i] = now->jacobian[i][TORQUE] * tick->opening_rate +
                   now->jacobian[i][FORCE] * tick->advance_rate - now->velocity[i];
    }
    now->gap_rate = dot(now->normal, speed);
    now->place_rate = dot(now->tangent, speed);
}

/* Torque on the opening of a newton on the tip: along the normal, less what slides with it. */
static float lever_of(const sc_control_config *config, const look *now)
{
    const float slip = now->place_rate / fmaxf(fabsf(now->place_rate), SLIDES);
    float lever = 0.0f;
    for (int i = 0; i < AXES; i++) {
        lever += now->jacobian[i][TORQUE] *
                 (now->normal[i] - config->surface_friction * slip * now->tangent[i]);
    }
    return lever;
}

/* Of two neighbours, `part` of the way from the first. */
static float between(const float *values, uint32_t at, uint32_t next, float part)
{
    return values[at] + part * (values[next] - values[at]);
}

/* The path goes on while the force is there; its pace changes over pace_s. */
static void walk(const sc_control_task *task, sc_control *control, int may_go, float dt,
                 const look *now, sc_hybrid_input *input)
{
    const sc_control_config *config = task->config;
    const sc_path *path = &task->path;
    float wanted = now->place, rate = 0.0f, acceleration = 0.0f;
    if (path->size > 0) {
        const uint32_t last = path->size - 1;
        const float step = config->pace_s > 0.0f ? dt / config->pace_s : 1.0f;
        const float before = control->pace;
        const float settled = SETTLED * path->force[(uint32_t)control->index];
        const int goes_on = may_go && control->law.touching && control->law.force_aim >= settled;
        control->pace = fminf(fmaxf(before + (goes_on ? step : -step), 0.0f), 1.0f);
        control->index += (double)(control->pace * dt / config->tick_s);
        if (control->index > (double)last) {
            control->index = (double)last;
        }
        const uint32_t at = (uint32_t)control->index;
        const uint32_t next = at < last ? at + 1 : last;
        const float part = (float)(control->index - (double)at);
        wanted = between(path->place, at, next, part);
        rate = between(path->rate, at, next, part);
        const float change = (path->rate[next] - path->rate[at]) / config->tick_s;
        const float quickens = dt > 0.0f ? (control->pace - before) / dt : 0.0f;
        acceleration = control->pace * control->pace * change + quickens * rate;
        rate *= control->pace;
        input->force_wanted = between(path->force, at, next, part);
        control->sample.stage = path->stage[at];
        control->sample.flags |= at == last ? SC_CONTROL_DONE : 0u;
    }
    control->sample.force_wanted = input->force_wanted;
    control->sample.place_wanted = wanted;
    control->sample.index = (float)control->index;
    for (int i = 0; i < AXES; i++) {
        input->path[i] = now->tip[i] + (wanted - now->place) * now->tangent[i];
        input->path_rate[i] = now->velocity[i] + rate * now->tangent[i];
        input->path_acceleration[i] = acceleration * now->tangent[i];
    }
}

/* Let the force fall to what touching needs, then lift the tip at lift_speed. */
static void let_go(const sc_control_config *config, sc_control *control, sc_hybrid_config *law,
                   sc_hybrid_input *input)
{
    control->sample.flags |= SC_CONTROL_LETS_GO;
    if (!control->lifting && control->law.touching &&
        control->law.force_aim > config->law.touch_force) {
        input->force_wanted = config->law.touch_force;
        return;
    }
    if (!control->lifting) {
        control->lifting = 1;
        control->lift = input->gap;
        memset(&control->law, 0, sizeof control->law);
    }
    control->lift = fminf(control->lift + config->lift_speed * input->dt, config->lift_gap);
    control->lift = fminf(control->lift, input->gap + config->away);
    law->normal_law = SC_HYBRID_POSITION;
    input->gap_wanted = control->lift;
    input->gap_rate_wanted = control->lift < config->lift_gap ? config->lift_speed : 0.0f;
    if (input->gap > 0.5f * config->lift_gap) {
        control->sample.flags |= SC_CONTROL_LIFTED;
    }
}

static float longer(float time_s, float dt, int goes_on)
{
    return goes_on ? time_s + dt : 0.0f;
}

/* What ends the mode, looked for at each tick. */
static int ends(const sc_control_config *config, sc_control *control, const look *now,
                const sc_control_tick *tick, float force, float path_error)
{
    const float dt = tick->dt;
    const int touching = control->law.touching != 0;
    const float handle = fabsf(tick->handle_force - config->handle_zero);
    control->handle_s = longer(control->handle_s, dt, !(handle <= config->handle_stop));
    control->pressed_s = longer(control->pressed_s, dt, !(force <= config->force_stop));
    control->away_s = longer(control->away_s, dt, touching && fabsf(now->gap) > config->away);
    control->unpressed_s = longer(control->unpressed_s, dt, !touching && !control->lifting);
    if (control->handle_s > config->sustained_s) {
        return SC_CONTROL_HANDLE;
    }
    if (control->pressed_s > config->sustained_s) {
        return SC_CONTROL_PRESSED;
    }
    if (control->away_s > config->sustained_s) {
        return now->gap > 0.0f ? SC_CONTROL_AWAY : SC_CONTROL_NO_SURFACE;
    }
    if (!touching && !control->lifting &&
        (now->gap < -config->away || control->unpressed_s > config->approach_s)) {
        return SC_CONTROL_NO_SURFACE;
    }
    if (path_error > config->path_stop) {
        return SC_CONTROL_PATH_LOST;
    }
    return control->age_s > config->end_s ? SC_CONTROL_NO_CONTOUR : SC_CONTROL_GOES_ON;
}

static void describe(const sc_control_config *config, const sc_control_tick *tick,
                     const look *now, sc_hybrid_input *input)
{
    memset(input, 0, sizeof *input);
    input->dt = fminf(tick->dt, LONGEST_STEP_S);
    input->rate[TORQUE] = tick->opening_rate;
    input->rate[FORCE] = tick->advance_rate;
    input->inertia[TORQUE][TORQUE] = config->inertia;
    input->inertia[FORCE][FORCE] = config->mass;
    input->bias[TORQUE] = config->offset;
    input->dry_friction[TORQUE] =
        sc_axis_friction_at(&config->opening, tick->opening, tick->opening_rate);
    input->dry_friction[FORCE] =
        sc_axis_friction_at(&config->advance, tick->advance, tick->advance_rate);
    input->surface_friction = config->surface_friction;
    for (int i = 0; i < AXES; i++) {
        input->jacobian[i][TORQUE] = now->jacobian[i][TORQUE];
        input->jacobian[i][FORCE] = now->jacobian[i][FORCE];
        input->jacobian_rate[i] = now->jacobian_rate[i];
        input->point[i] = now->tip[i];
        input->normal[i] = now->normal[i];
        input->surface_velocity[i] = now->velocity[i];
    }
    input->gap = now->gap;
    input->surface_acceleration = -now->curvature * now->place_rate * now->place_rate;
}

static void tell(sc_control *control, const look *now, float force, float sd)
{
    sc_control_sample *sample = &control->sample;
    sample->contour = control->contour;
    sample->force = force;
    sample->force_sd = sd;
    sample->force_aim = control->law.force_aim;
    sample->gap = now->gap;
    sample->gap_rate = now->gap_rate;
    sample->place = now->place;
    sample->tip_x = now->tip[0];
    sample->tip_y = now->tip[1];
    sample->contour_age = control->age_s;
}

/* Take over the newest contour; its age counts from then on. */
static void age(const sc_control_task *task, sc_control *control, float dt)
{
    if (task->contour.number != control->contour) {
        control->contour = task->contour.number;
        control->age_s = 0.0f;
    } else {
        control->age_s += dt;
    }
}

int sc_control_step(const sc_control_task *task, sc_control *control, const sc_control_tick *tick,
                    float effort[2])
{
    const sc_control_config *config = task->config;
    sc_hybrid_config law = config->law;
    sc_hybrid_input input;
    sc_hybrid_output out;
    look now;
    effort[TORQUE] = effort[FORCE] = 0.0f;
    memset(&control->sample, 0, sizeof control->sample);
    age(task, control, tick->dt);
    if (control->contour == 0) {
        return control->age_s > config->end_s ? SC_CONTROL_NO_CONTOUR : SC_CONTROL_GOES_ON;
    }
    find_tip(config, tick, &now);
    find_surface(&task->contour, fminf(control->age_s, config->stale_s), tick, &now);
    describe(config, tick, &now, &input);
    const float lever = lever_of(config, &now);
    if (!(lever >= config->least_lever)) {
        return SC_CONTROL_REFUSED;
    }
    const float sinking = control->law.touching ? -now.gap_rate : 0.0f;
    const float force = sc_balance_take(config, &control->balance, tick, sinking, lever) / lever;
    input.force = force;
    control->sample.flags |= control->balance.held_s > 0.0f ? SC_CONTROL_HELD : 0u;
    const int lets_go = task->contour.lift || control->age_s > config->stale_s;
    walk(task, control, !lets_go, input.dt, &now, &input);
    const float error = control->law.force_aim - input.force;
    if (control->balance.held_s > 0.0f && fabsf(error) < config->force_band) {
        input.force = control->law.force_aim; /* friction holds: what is as small is not known */
    }
    if (lets_go) {
        let_go(config, control, &law, &input);
    } else {
        control->lifting = 0;
    }
    sc_hybrid_step(&law, &control->law, &input, &out);
    control->sample.flags |= out.flags;
    tell(control, &now, force, sc_balance_sd(config, &control->balance) / lever);
    if (out.flags & (SC_HYBRID_INVALID | SC_HYBRID_SINGULAR)) {
        return SC_CONTROL_REFUSED;
    }
    const int seen = ends(config, control, &now, tick, force, out.path_error);
    if (seen == SC_CONTROL_GOES_ON) {
        effort[TORQUE] = out.effort[TORQUE];
        effort[FORCE] = out.effort[FORCE];
    }
    return seen;
}

void sc_control_rest(sc_control *control)
{
    memset(&control->law, 0, sizeof control->law);
    memset(&control->balance, 0, sizeof control->balance);
    control->pace = 0.0f;
    control->lifting = 0;
    control->unpressed_s = control->away_s = control->pressed_s = control->handle_s = 0.0f;
}
