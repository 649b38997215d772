#include "sc_fracture.h"

#include <math.h>
#include <string.h>

static const float WIDEST_OPENING = 3.14159274f; /* rad */

static int is_finite_step(const sc_step_output *out)
{
    return isfinite(out->torque) && isfinite(out->force) && isfinite(out->contact) &&
           isfinite(out->indentation) && isfinite(out->height) && isfinite(out->response) &&
           isfinite(out->stored_J) && isfinite(out->fracture_J) && isfinite(out->arrest_J);
}

/* Within half a turn either way: sines of larger angles would only pretend to mean something. */
static int is_usable(const sc_model *model, sc_turn turn, float opening, float rate, float place)
{
    return fabsf(opening) <= WIDEST_OPENING && isfinite(rate) && isfinite(place) &&
           sc_edge_stands(model->flattest, model->steepest, turn);
}

static void refuse(sc_step_output *out)
{
    memset(out, 0, sizeof *out);
    out->flags = SC_STEP_INVALID;
}

static sc_turn turn_of(const sc_model *model, float opening)
{
    return sc_turn_of(opening / (float)model->moving_blades);
}

int sc_falls_at(const sc_model *model, float opening)
{
    return model->release_falls && opening >= model->opening_min && opening <= model->opening_max;
}

float sc_model_friction(const sc_model *model, float opening, float rate)
{
    const float speed = fabsf(rate);
    const float eps = model->friction_rate_eps;
    const sc_table *table = rate > 0.0f ? &model->friction_opening : &model->friction_closing;
    float level = sc_table_held(table, speed > eps ? speed : eps);
    if (speed < eps) {
        level *= speed / eps;
    }
    level *= sc_table_held(&model->friction_angle, opening);
    return rate > 0.0f ? level : -level;
}

/* Torque from the edge's force at a place, by the model's closure. */
static float torque_of(const sc_model *model, const sc_edge_point *point, float force)
{
    if (model->closure == SC_CLOSURE_EQ4) {
        return force * point->x / sqrtf(1.0f + point->taper * point->taper);
    }
    return force * (point->x + point->y * point->slope);
}

/* Hunt-Crossley: the response, stiffer while the blade goes in, never pulling as it leaves. */
static float damped(const sc_model *model, const sc_edge_point *point, float response, float rate)
{
    const float lever = point->x + point->y * point->slope;
    const float deepening = -lever * rate / (float)model->moving_blades;
    const float factor = 1.0f + model->rate_damping * deepening;
    return factor > 0.0f ? response * factor : 0.0f;
}

/* The material leaves the blade; what it stored is lost. */
static void detach(sc_crack *state, float stored, sc_step_output *out)
{
    state->detached = 1;
    out->arrest_J += stored;
}

/* The crack moves on; an advance below float's resolution is none. */
static void book_advance(sc_crack *state, float moved, float per_metre, sc_step_output *out)
{
    const float crack = state->crack + moved;
    if (crack > state->crack) {
        out->fracture_J += per_metre * (crack - state->crack);
        out->flags |= SC_STEP_ADVANCED;
        state->crack = crack;
    }
}

/* Rippled fracture: each run starts at J_c h and stops at kappa J_c h, which takes one length; several
 * runs may fall into one step. The crack advances by as many whole lengths as bring the release down
 * to J_c h, so the phase of the ripple, and with it the mean force, does not depend on the step.
 * 0 where a length is too short for float: then it is as smooth. */
static int ripple(const sc_model *model, sc_crack *state, sc_turn turn, int falls,
                  const sc_bite *start, sc_bite *bite, sc_step_output *out)
{
    const float contact = bite->point.x;
    const float kept = model->kappa * model->fracture_energy;
    sc_bite stop = *start;
    (void)sc_run_out(model, turn, falls, kept, &stop);
    const float length = stop.point.x - start->point.x;
    if (!(length > SC_SHORTEST_RUN)) {
        return 0;
    }
    const float runs = ceilf((start->point.x - contact) / length);
    const float lost = start->stored - stop.stored - kept * length;
    book_advance(state, runs * length, kept, out);
    out->arrest_J += lost > 0.0f ? runs * lost : 0.0f;
    if (sc_edge_over(&model->edge, turn, contact + runs * length, &bite->point)) {
        sc_sit(model, bite);
    } else {
        *bite = *start;
    }
    return 1;
}

/* The crack runs: smoothly, so that it keeps the release at J_c h, or in ripples. */
static void fracture(const sc_model *model, sc_crack *state, sc_turn turn, int falls, sc_bite *bite,
                     sc_step_output *out)
{
    sc_bite start = *bite;
    if (!sc_run_out(model, turn, falls, model->fracture_energy, &start)) {
        book_advance(state, start.point.x - bite->point.x, model->kappa * model->fracture_energy,
                     out);
        detach(state, bite->stored, out);
        *bite = start;
        return;
    }
    if (model->kappa < 1.0f && ripple(model, state, turn, falls, &start, bite, out)) {
        return;
    }
    book_advance(state, start.point.x - bite->point.x, model->fracture_energy, out);
    *bite = start;
}

/* Whether the blade reaches the material. Once it left at the tip, it is met again only from
 * outside: so no stored energy appears from nothing. */
static int in_reach(const sc_model *model, sc_crack *state, const sc_bite *bite,
                    sc_step_output *out)
{
    if (bite->point.station >= model->tip_station) {
        if (!state->detached) {
            detach(state, bite->stored, out);
        }
        return 0;
    }
    if (state->detached && !(bite->indentation > 0.0f)) {
        state->detached = 0;
    }
    return !state->detached;
}

static void press(const sc_model *model, sc_crack *state, sc_turn turn, int falls, float rate,
                  sc_bite *bite, sc_step_output *out)
{
    if (!in_reach(model, state, bite, out)) {
        out->flags |= SC_STEP_BEYOND_TIP;
        return;
    }
    if (!(bite->indentation > 0.0f)) {
        return;
    }
    const float release = sc_release(model, bite);
    if (release == 0.0f) {
        out->flags |= SC_STEP_NOT_CUTTING;
    } else if (model->fracture_energy > 0.0f && release > model->fracture_energy) {
        fracture(model, state, turn, falls, bite, out);
        if (state->detached) {
            out->flags |= SC_STEP_BEYOND_TIP;
            return;
        }
    }
    out->flags |= SC_STEP_TOUCHING;
    out->response = bite->force;
    out->stored_J = bite->stored;
    const float force = damped(model, &bite->point, bite->force, rate);
    out->torque = torque_of(model, &bite->point, force);
    out->force = -(float)model->moving_blades * force * bite->point.slope;
}

void sc_model_step(const sc_model *model, sc_crack *state, float opening, float rate, float advance,
                   sc_step_output *out)
{
    const sc_crack before = *state;
    const sc_turn turn = turn_of(model, opening);
    sc_bite bite;
    bite.point.knot = state->edge_knot;
    bite.knot = state->response_knot;
    memset(out, 0, sizeof *out);
    if (!is_usable(model, turn, opening, rate, state->crack - advance) ||
        !sc_edge_over(&model->edge, turn, state->crack - advance, &bite.point)) {
        refuse(out);
        return;
    }
    sc_sit(model, &bite);
    press(model, state, turn, sc_falls_at(model, opening), rate, &bite, out);
    state->edge_knot = bite.point.knot;
    state->response_knot = bite.knot;
    out->contact = bite.point.x;
    out->height = bite.point.y;
    out->indentation = bite.indentation;
    if (opening < model->opening_min || opening > model->opening_max ||
        bite.point.x < model->contact_min || bite.point.x > model->contact_max) {
        out->flags |= SC_STEP_OUT_OF_RANGE;
    }
    if (model->render_friction) {
        out->friction_torque = -sc_model_friction(model, opening, rate);
        out->torque += out->friction_torque;
    }
    if (!is_finite_step(out) || !isfinite(state->crack)) {
        *state = before;
        refuse(out);
    }
}

/* 0 where a step would be INVALID. */
static int settled_torque(const sc_model *model, float opening, float rate, float contact,
                          float *torque)
{
    const sc_turn turn = turn_of(model, opening);
    sc_bite bite;
    bite.point.knot = bite.knot = 0;
    *torque = 0.0f;
    if (!is_usable(model, turn, opening, rate, contact) ||
        !sc_edge_over(&model->edge, turn, contact, &bite.point)) {
        return 0;
    }
    sc_sit(model, &bite);
    int reached = bite.point.station < model->tip_station;
    if (reached && model->fracture_energy > 0.0f &&
        sc_release(model, &bite) > model->fracture_energy) {
        reached = sc_run_out(model, turn, sc_falls_at(model, opening), model->fracture_energy, &bite);
    }
    if (reached) {
        *torque = torque_of(model, &bite.point, damped(model, &bite.point, bite.force, rate));
    }
    if (model->render_friction) {
        *torque -= sc_model_friction(model, opening, rate);
    }
    return isfinite(*torque);
}

float sc_model_settled_torque(const sc_model *model, float opening, float rate, float contact)
{
    float torque;
    return settled_torque(model, opening, rate, contact, &torque) ? torque : 0.0f;
}

void sc_model_step_many(const sc_model *model, sc_crack *state, int64_t n, const float *opening,
                        const float *rate, const float *advance, sc_step_output *out)
{
    for (int64_t i = 0; i < n; i++) {
        sc_model_step(model, state, opening[i], rate[i], advance[i], &out[i]);
    }
}

void sc_model_torque_many(const sc_model *model, int64_t n, const float *opening, const float *rate,
                          const float *contact, float *torque)
{
    for (int64_t i = 0; i < n; i++) {
        if (!settled_torque(model, opening[i], rate[i], contact[i], &torque[i])) {
            torque[i] = NAN;
        }
    }
}
