/* How far the crack runs: m g(delta) tan(psi) against the fracture energy per metre. */
#ifndef SC_FRACTURE_H
#define SC_FRACTURE_H

#include "sc_model.h"

/* Response g(delta): 0 without contact, the table within it, straight on beyond up to a cap. */
float sc_response_at(const sc_model *model, float indentation);

/* Energy m times the integral of g from 0 to the indentation [J]. */
float sc_stored_energy(const sc_model *model, float indentation);

/* Energy released per metre of crack at a place of the edge [N]; 0 where edges are parallel. */
float sc_release_at(const sc_model *model, const sc_edge_point *point);

/* From where the release exceeds target, go outwards to the first place where it does not, to 2e-6
 * of the target or as well as float resolves it. 0 if it is not met before the blade's tip; *point
 * is then the tip. */
int sc_run_out(const sc_model *model, sc_turn turn, float target, sc_edge_point *point);

#endif
