/* Friction of a model, without regard to the rate at which the blades rest: it builds up over `width`
 * [rad] of opening after a reversal (Hayward and Armstrong 2000, doi:10.1007/BFb0119420), so that an
 * encoder's count moves it by a small part.
 */
#ifndef SC_NEAR_REST_H
#define SC_NEAR_REST_H

#include "sc_model.h"

/* The opening from which friction near rest is counted; all zero: not yet known. */
typedef struct {
    uint32_t is_set;
    float opening;
} sc_anchor;

/* Replaces step's friction in step->torque; nothing with a width of 0, without friction, and for an
 * invalid step. */
void sc_near_rest(const sc_model *model, float width, sc_anchor *anchor, float opening, float rate,
                  sc_step_output *step);

#endif
