#include "sc_fracture.h"

#include <math.h>
#include <stddef.h>

static const float RESPONSE_CAP = 1e6f; /* N: far beyond any rig, keeps all that follows finite */
static const float PARALLEL = 1e-6f;    /* tan(psi) up to which edges count as parallel */
static const float CLOSE_ENOUGH = 2e-6f;

enum { MOST_STEPS = 48 };

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

/* The excess changes sign between low and high: regula falsi (Illinois), every third step a
 * bisection, so that the bracket shrinks whatever the response's shape. */
static void close_bracket(const sc_model *model, sc_turn turn, float target, float low,
                          float excess_low, float high, float excess_high, sc_edge_point *point)
{
    int side = 0;
    for (int i = 0; i < MOST_STEPS; i++) {
        float station = 0.5f * (low + high);
        if (i % 3 != 2) {
            const float chord = high - excess_high * (high - low) / (excess_high - excess_low);
            if (chord > low && chord < high) {
                station = chord;
            }
        }
        if (!(station > low && station < high)) {
            break;
        }
        const float excess = excess_at(model, turn, target, station, point);
        if (excess > 0.0f) {
            low = station;
            excess_low = excess;
            excess_high *= side > 0 ? 0.5f : 1.0f;
            side = 1;
        } else {
            high = station;
            excess_high = excess;
            if (excess >= -CLOSE_ENOUGH * target) {
                return;
            }
            excess_low *= side < 0 ? 0.5f : 1.0f;
            side = -1;
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
    float low = point->station;
    float excess_low = sc_release_at(model, point) - target;
    if (!(excess_low > 0.0f)) {
        return 1;
    }
    for (int i = 0; i <= SC_TABLE_MAX; i++) {
        float high = next_stop(model, turn, &knot, low);
        const int at_tip = high >= model->tip_station;
        if (at_tip) {
            high = model->tip_station;
        }
        const float excess = excess_at(model, turn, target, high, point);
        if (!(excess > 0.0f)) {
            close_bracket(model, turn, target, low, excess_low, high, excess, point);
            return 1;
        }
        if (at_tip) {
            return 0;
        }
        if (!(high > low)) {
            break; /* nothing left to change: rounding at the very end of the material */
        }
        low = high;
        excess_low = excess;
    }
    return 1;
}
