/* How far the crack runs: m g(delta) tan(psi) against the fracture energy per metre.
 *
 * A crack that runs stops at the first place outwards whose release is the target. There the response
 * is target / (m tan(psi)), so its inverse gives the indentation that the place bears, and the edge
 * the place that has it. Both are looked up once in each round of Newton's method. For a straight edge
 * one round is exact; as long as the release falls along the blade, its relative error in a round is
 *
 *     delta e'' / (n rise^2 run),    n = d ln g / d ln delta,
 *
 * before Newton's correction squares it, and below one exactly where the release falls.
 */
#ifndef SC_FRACTURE_H
#define SC_FRACTURE_H

#include "sc_model.h"

/* Rounds of one run: from where the crack stands, and within one interval of the edge, in which
 * bisections alone would reach float's resolution. */
enum { SC_RUN_ROUNDS = 4, SC_CLOSE_ROUNDS = 24 };

#define SC_SHORTEST_RUN 1e-7f /* m: a ripple below float resolution counts as smooth */

/* The edge in the material: its place, how deep it sits, the response and m times its integral [J].
 * `knot`: as in sc_place, of the response. */
typedef struct {
    sc_edge_point point;
    float indentation;
    float force;
    float stored;
    int32_t knot;
} sc_bite;

/* Fill in the rest from the edge's place: nothing without contact, the table within it, straight on
 * beyond up to a cap. */
void sc_sit(const sc_model *model, sc_bite *bite);

/* Energy released per metre of crack [N]; 0 where edges are parallel. */
float sc_release(const sc_model *model, const sc_bite *bite);

/* Whether the release is known to fall outwards along the blade at this opening. */
int sc_falls_at(const sc_model *model, float opening);

/* From a place that releases more than target, go outwards to where it does not. There the indentation
 * is what that place bears, free of the rounding of upper_face - y. 0 if the target is not met before
 * the blade's tip; *bite is then there.
 *
 * Where the release falls along the blade (falls), at most SC_RUN_ROUNDS rounds; of the few runs that
 * they leave open, as towards a place where the edges are parallel, halving the knots finds the
 * interval, and SC_CLOSE_ROUNDS the place in it. On any other blade the knots are tried one by one, so
 * that it is the first such place. */
int sc_run_out(const sc_model *model, sc_turn turn, int falls, float target, sc_bite *bite);

#endif
