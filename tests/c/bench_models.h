/* Models made from formulas, as tests/kernel/zoo.py makes them, and a step written by hand to compare
 * the core's with. */
#ifndef BENCH_MODELS_H
#define BENCH_MODELS_H

#include "sc_model.h"

/* Blades of 75 mm whose edge is a parabola of this curvature (1/m) in `edge_knots` tables' knots, and a
 * power law of this exponent in `response_knots`. */
typedef struct {
    const char *title;
    int32_t edge_knots, response_knots;
    float curvature, exponent, kappa, fracture_energy;
    int32_t render_friction;
} bench_case;

/* Storage of one model's tables. */
typedef struct {
    float x[2][SC_TABLE_MAX], y[2][SC_TABLE_MAX], slope[2][SC_TABLE_MAX], area[SC_TABLE_MAX];
} bench_room;

sc_model bench_model(const bench_case *one, bench_room *room);

/* One motion's next place: opening (rad), rate (rad/s), advance (m). */
typedef struct {
    float opening, rate, advance;
} bench_place;

/* Step k of a slow stroke, from 0.8 rad to 0.3 in `steps` steps; and a random one, for which the crack
 * may stand anywhere in the model's range of contacts. */
bench_place bench_stroke(int32_t k, int32_t steps);
bench_place bench_random(uint32_t *seed, float *crack);

/* The step of a straight edge and a power law, both blades moving, written by hand with the closed
 * form of where the crack settles: the least that a rig's programmer would write for this model. */
void bench_by_hand(const bench_case *one, sc_crack *state, float opening, float rate, float advance,
                   sc_step_output *out);

#endif
