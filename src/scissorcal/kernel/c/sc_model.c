#include "sc_fracture.h"

#include <math.h>
#include <string.h>

static const float SHORTEST_RUN = 1e-7f; /* m: a ripple below float resolution counts as smooth */
static const float WIDEST_OPENING = 3.14159274f; /* rad */

static int is_finite_step(const sc_step_output *out)
{
    return isfinite(out->torque) && isfinite(out->force) && isfinite(out->contact) &&
           isfinite(out->indentation) && isfinite(out->height) && isfinite(out->response) &&
           isfinite(out->stored_J) && isfinite(out->fracture_J) && isfinite(out->arrest_J);
}

/* Within half a turn either way: sines of larger angles would only pretend to mean something. */
static int is_usable(float opening, float rate, float place)
{
    return fabsf(opening) <= WIDEST_OPENING && isfinite(rate) && isfinite(place);
}

static void refuse(sc_step_output *out)
{
    memset(out, 0, sizeof *out);
    out->flags = SC_STEP_INVALID;
}

static sc_turn turn_of(const sc_model *model, float opening)
{
    const float beta = opening / (float)model->moving_blades;
    const sc_turn turn = {sinf(beta), cosf(beta)};
    return turn;
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
    return response * fmaxf(1.0f + model->rate_damping * deepening, 0.0f);
}

/* The material leaves the blade; what it stored is lost. */
static void detach(const sc_model *model, sc_crack *state, float indentation, sc_step_output *out)
{
    state->detached = 1;
    out->arrest_J += sc_stored_energy(model, indentation);
}

static void book_advance(sc_crack *state, float crack, float per_metre, sc_step_output *out)
{
    if (crack > state->crack) {
        out->fracture_J += per_metre * (crack - state->crack);
        out->flags |= SC_STEP_ADVANCED;
        state->crack = crack;
    }
}

/* Smooth fracture: the crack keeps the release at J_c h.
 *
 * Rippled: each run starts at J_c h and stops at kappa J_c h, which takes one length; several runs
 * may fall into one step. The crack advances by as many whole lengths as bring the release down
 * to J_c h, so the phase of the ripple, and with it the mean force, does not depend on the step. */
static void fracture(const sc_model *model, sc_crack *state, sc_turn turn, float advance,
                     sc_edge_point *point, sc_step_output *out)
{
    const float indentation = model->upper_face - point->y;
    const float contact = point->x;
    sc_edge_point start = *point;
    if (!sc_run_out(model, turn, model->fracture_energy, &start)) {
        book_advance(state, advance + start.x, model->kappa * model->fracture_energy, out);
        detach(model, state, indentation, out);
        *point = start;
        return;
    }
    sc_edge_point stop = start;
    if (model->kappa < 1.0f) {
        (void)sc_run_out(model, turn, model->kappa * model->fracture_energy, &stop);
    }
    const float length = stop.x - start.x;
    if (!(length > SHORTEST_RUN)) {
        book_advance(state, advance + start.x, model->fracture_energy, out);
        *point = start;
        return;
    }
    const float runs = ceilf((start.x - contact) / length);
    const float taken = model->kappa * model->fracture_energy * length;
    const float released = sc_stored_energy(model, model->upper_face - start.y) -
                           sc_stored_energy(model, model->upper_face - stop.y);
    book_advance(state, advance + contact + runs * length, taken / length, out);
    out->arrest_J += runs * fmaxf(released - taken, 0.0f);
    if (!sc_edge_over(&model->edge, turn, contact + runs * length, point)) {
        *point = start;
    }
}

/* Whether the blade reaches the material. Once it left at the tip, it is met again only from
 * outside: so no stored energy appears from nothing. */
static int in_reach(const sc_model *model, sc_crack *state, const sc_edge_point *point,
                    sc_step_output *out)
{
    const float indentation = model->upper_face - point->y;
    if (point->station >= model->tip_station) {
        if (!state->detached) {
            detach(model, state, indentation, out);
        }
        return 0;
    }
    if (state->detached && !(indentation > 0.0f)) {
        state->detached = 0;
    }
    return !state->detached;
}

static void press(const sc_model *model, sc_crack *state, sc_turn turn, float rate, float advance,
                  sc_edge_point *point, sc_step_output *out)
{
    if (!in_reach(model, state, point, out)) {
        out->flags |= SC_STEP_BEYOND_TIP;
        return;
    }
    if (!(model->upper_face - point->y > 0.0f)) {
        return;
    }
    const float release = sc_release_at(model, point);
    if (release == 0.0f) {
        out->flags |= SC_STEP_NOT_CUTTING;
    } else if (model->fracture_energy > 0.0f && release > model->fracture_energy) {
        fracture(model, state, turn, advance, point, out);
        if (state->detached) {
            out->flags |= SC_STEP_BEYOND_TIP;
            return;
        }
    }
    out->flags |= SC_STEP_TOUCHING;
    out->response = sc_response_at(model, model->upper_face - point->y);
    out->stored_J = sc_stored_energy(model, model->upper_face - point->y);
    const float force = damped(model, point, out->response, rate);
    out->torque = torque_of(model, point, force);
    out->force = -(float)model->moving_blades * force * point->slope;
}

void sc_model_step(const sc_model *model, sc_crack *state, float opening, float rate, float advance,
                   sc_step_output *out)
{
    const sc_crack before = *state;
    const sc_turn turn = turn_of(model, opening);
    sc_edge_point point;
    memset(out, 0, sizeof *out);
    if (!is_usable(opening, rate, state->crack - advance) ||
        !sc_edge_over(&model->edge, turn, state->crack - advance, &point)) {
        refuse(out);
        return;
    }
    press(model, state, turn, rate, advance, &point, out);
    out->contact = point.x;
    out->height = point.y;
    out->indentation = model->upper_face - point.y;
    if (opening < model->opening_min || opening > model->opening_max ||
        point.x < model->contact_min || point.x > model->contact_max) {
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

float sc_model_settled_torque(const sc_model *model, float opening, float rate, float contact)
{
    const sc_turn turn = turn_of(model, opening);
    sc_edge_point point;
    if (!is_usable(opening, rate, contact) ||
        !sc_edge_over(&model->edge, turn, contact, &point)) {
        return 0.0f;
    }
    float torque = 0.0f;
    int reached = point.station < model->tip_station;
    if (reached && model->fracture_energy > 0.0f) {
        reached = sc_run_out(model, turn, model->fracture_energy, &point);
    }
    if (reached) {
        const float response = sc_response_at(model, model->upper_face - point.y);
        torque = torque_of(model, &point, damped(model, &point, response, rate));
    }
    if (model->render_friction) {
        torque -= sc_model_friction(model, opening, rate);
    }
    return isfinite(torque) ? torque : 0.0f;
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
        torque[i] = sc_model_settled_torque(model, opening[i], rate[i], contact[i]);
    }
}

int sc_model_is_sound(const sc_model *model)
{
    const sc_table *response = &model->response;
    return sc_table_is_sound(&model->edge) && sc_table_is_sound(response) &&
           sc_table_is_sound(&model->friction_opening) &&
           sc_table_is_sound(&model->friction_closing) &&
           sc_table_is_sound(&model->friction_angle) && response->area != NULL &&
           (model->moving_blades == 1 || model->moving_blades == 2) &&
           (model->closure == SC_CLOSURE_WORK || model->closure == SC_CLOSURE_EQ4) &&
           isfinite(model->upper_face) && isfinite(model->fracture_energy) &&
           model->fracture_energy >= 0.0f && model->kappa > 0.0f && model->kappa <= 1.0f &&
           isfinite(model->rate_damping) && model->rate_damping >= 0.0f &&
           isfinite(model->friction_rate_eps) && model->friction_rate_eps > 0.0f &&
           model->tip_station > 0.0f;
}
