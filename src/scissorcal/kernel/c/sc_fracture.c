#include "sc_fracture.h"

#include <math.h>
#include <stddef.h>

static const float RESPONSE_CAP = 1e6f; /* N: far beyond any rig, keeps all that follows finite */
static const float PARALLEL = 1e-6f;    /* tan(psi) up to which edges count as parallel */
static const float CLOSE_ENOUGH = 2e-6f;  /* of the target */
static const float RESOLUTION = 1e-7f;      /* of a station: about the resolution of float */

enum { MOST_STEPS = 75 }; /* 25 bisections: the whole blade down to float's resolution */

float sc_response_at(const sc_model *model, float indentation)
{
    if (!(indentation > 0.0f)) {
        return 0.0f;
    }
    const float force = sc_table_at(&model->response, indentation, NULL);
    return fminf(fmaxf(force, 0.0f), RESPONSE_CAP);
}

float sc_stored_energy(const sc_model *model, float indentation)
{
    if (!(indentation > 0.0f)) {
        return 0.0f;
    }
    const sc_table *response = &model->response;
    const int32_t last = response->size - 1;
    const float away = indentation - response->x[last];
    float energy = sc_table_area(response, indentation);
    if (away > 0.0f) {
        const float excess = sc_table_at(response, indentation, NULL) - RESPONSE_CAP;
        if (excess > 0.0f && response->slope[last] > 0.0f) {
            energy -= 0.5f * excess * (excess / response->slope[last]);
        }
    }
    return (float)model->moving_blades * energy;
}

float sc_release_at(const sc_model *model, const sc_edge_point *point)
{
    if (!(point->slope > PARALLEL)) {
        return 0.0f;
    }
    const float force = sc_response_at(model, model->upper_face - point->y);
    return (float)model->moving_blades * force * point->slope;
}

/* Release at a station, less the target; a place too steep to evaluate releases nothing. */
static float excess_at(const sc_model *model, sc_turn turn, float target, float station,
                       sc_edge_point *point)
{
    if (!sc_edge_at_station(&model->edge, turn, station, point)) {
        return -target;
    }
    return sc_release_at(model, point) - target;
}

/* How far a Newton step goes from a point: the release falls as the edge rises out of the material
 * (its change of slope matters less, and the bracket makes up for it). Infinite where the response
 * stands at its cap. */
static float newton_step(const sc_model *model, sc_turn turn, const sc_edge_point *point,
                         float excess)
{
    float stiffness;
    const float force =
        sc_table_at(&model->response, model->upper_face - point->y, &stiffness);
    const float rise = turn.sine + point->taper * turn.cosine;
    if (force >= RESPONSE_CAP) {
        return INFINITY;
    }
    return excess / ((float)model->moving_blades * stiffness * rise * point->slope);
}

/* The excess changes sign between low, where *point stands, and high. Newton steps that stay inside
 * the shrinking bracket, every third step a bisection, so that it shrinks whatever the shape. Done
 * when the next step would be below the resolution of float; such a step back from
 * the far side is lengthened to as much, to bracket the root. */
static void close_bracket(const sc_model *model, sc_turn turn, float target, float high,
                          float excess, sc_edge_point *point)
{
    float low = point->station;
    for (int i = 0; i < MOST_STEPS; i++) {
        const float shortest = RESOLUTION * fabsf(point->station);
        float step = newton_step(model, turn, point, excess);
        if (fabsf(step) < shortest) {
            if (excess > 0.0f) {
                return;
            }
            step = -shortest;
        }
        float station = point->station + step;
        if (i % 3 == 2 || !(station > low && station < high)) {
            station = 0.5f * (low + high);
        }
        if (!(station > low && station < high)) {
            break;
        }
        excess = excess_at(model, turn, target, station, point);
        if (fabsf(excess) <= CLOSE_ENOUGH * target) {
            return;
        }
        if (excess > 0.0f) {
            low = station;
        } else {
            high = station;
        }
    }
    (void)excess_at(model, turn, target, high, point);
}

/* Next station at which to look for a change of sign: the next knot, or, on the straight
 * continuation, where the edge leaves the material. */
static float next_stop(const sc_model *model, sc_turn turn, int32_t *knot, float station)
{
    const sc_table *edge = &model->edge;
    const int32_t last = edge->size - 1;
    while (*knot <= last && edge->x[*knot] <= station) {
        (*knot)++;
    }
    if (*knot <= last) {
        return edge->x[*knot];
    }
    const float rise = turn.sine + edge->slope[last] * turn.cosine;
    const float end = edge->x[last] * turn.sine + edge->y[last] * turn.cosine;
    if (!(rise > 0.0f)) {
        return station;
    }
    const float leaves = edge->x[last] + (model->upper_face - end) / rise;
    return leaves > station ? leaves : station;
}

int sc_run_out(const sc_model *model, sc_turn turn, float target, sc_edge_point *point)
{
    int32_t knot = 0;
    float excess = sc_release_at(model, point) - target;
    if (!(excess > 0.0f)) {
        return 1;
    }
    for (int i = 0; i <= SC_TABLE_MAX; i++) {
        float high = next_stop(model, turn, &knot, point->station);
        const int at_tip = high >= model->tip_station;
        if (at_tip) {
            high = model->tip_station;
        }
        sc_edge_point far_end;
        const float far_excess = excess_at(model, turn, target, high, &far_end);
        if (!(far_excess > 0.0f)) {
            close_bracket(model, turn, target, high, excess, point);
            return 1;
        }
        const int ends = !(high > point->station); /* rounding at the material's very end */
        *point = far_end;
        excess = far_excess;
        if (at_tip || ends) {
            return !at_tip;
        }
    }
    return 1;
}
