/* The model's step: the crack's place, the torque and force there, and friction.
 *
 * Quantities: opening theta [rad], rate d(theta)/dt [rad/s], advance x_n [m], crack X [m],
 * contact x_c = X - x_n [m], indentation delta = y_top - phi(x_c, theta) [m], response g(delta) [N].
 *
 *     work:  torque = g (x_c + phi tan(psi))      eq4:  torque = x_c g cos(alpha)
 *     both:  force  = -m g tan(psi) on the pivot, along the cut
 *
 * With m the number of moving blades and psi the edge's slope angle, m g tan(psi) is the energy that
 * a crack releases per metre. Above J_c h (fracture_energy) the crack runs until kappa J_c h is left.
 * X never decreases; with fracture_energy = 0 nothing is cut and X never moves.
 *
 * Limiting cases:
 *   parallel edges, tan(psi) <= 1e-6   nothing is released; they press, the crack stays (NOT_CUTTING)
 *   contact at or behind the pivot     the formulas go on (the lever may change its sign); flagged
 *   contact at the tip or beyond       no force; what was stored is an arrest loss; the material is
 *                                      met again only from outside, so no energy is created
 *   deeper than the response's table   straight on with its last slope, up to 1e6 N
 *   beyond the edge's table            the edge goes on straight
 *   |rate| beyond the friction tables  the last value is held
 *   opening beyond half a turn, or an edge that anywhere stands steeper than some 87 deg or leans
 *                                      back: refused (INVALID)
 *
 * All outputs of a step are finite: what cannot be evaluated gives zero torque and
 * force with SC_STEP_INVALID set.
 */
#ifndef SC_MODEL_H
#define SC_MODEL_H

#include "sc_edge.h"

enum { SC_CLOSURE_WORK = 0, SC_CLOSURE_EQ4 = 1 };

enum {
    SC_STEP_INVALID = 1,      /* input not finite, or the edge stands upright: nothing computed */
    SC_STEP_TOUCHING = 2,     /* the edge indents the material */
    SC_STEP_ADVANCED = 4,     /* the crack advanced in this step */
    SC_STEP_OUT_OF_RANGE = 8, /* opening or contact outside what the tables were made for */
    SC_STEP_BEYOND_TIP = 16,  /* the material is out of the blade's reach: no force */
    SC_STEP_NOT_CUTTING = 32  /* edges parallel or opening outwards: no release, no advance */
};

typedef struct {
    sc_table edge;             /* e(s) [m] over s [m] */
    sc_table response;         /* g [N] over delta [m], from (0, 0), with area */
    sc_table friction_opening; /* level [N m] over |rate| [rad/s] */
    sc_table friction_closing;
    sc_table friction_angle; /* factor over theta */
    int32_t moving_blades;   /* m: 1 or 2 */
    int32_t closure;
    int32_t render_friction;
    int32_t release_falls; /* sc_model_release_falls: how a run finds its end */
    float upper_face;      /* y_top [m] */
    float fracture_energy; /* J_c h [N]; 0: nothing is cut */
    float kappa;           /* in (0, 1] */
    float rate_damping;    /* c [s/m]: force g (1 + c d(delta)/dt), never pulling (Hunt and Crossley
                              1975, doi:10.1115/1.3423596) */
    float friction_rate_eps; /* below this |rate| friction is linear through 0 [rad/s] */
    float handle_radius;     /* [m] */
    float tip_station;       /* s of the blade's tip [m]; no force from there on; may be huge */
    float opening_min, opening_max, contact_min, contact_max;
    float flattest, steepest; /* least and largest e' of the edge: sc_model_edge_slopes */
} sc_model;

typedef struct {
    float crack;      /* X [m] */
    int32_t detached; /* the material left the blade at its tip; until the blades open again */
    int32_t edge_knot, response_knot; /* where to look first; any value is right */
} sc_crack;

typedef struct {
    float torque; /* on the pivot [N m], positive opens; cutting plus, if rendered, friction */
    float force;  /* on the pivot along the cut [N] */
    float contact;
    float indentation;
    float height;          /* phi [m] */
    float response;        /* g [N] without rate damping */
    float friction_torque; /* the friction's share of torque */
    float stored_J;        /* m times the integral of g up to delta */
    float fracture_J;      /* kappa J_c h times the crack's advance in this step */
    float arrest_J;        /* what this step's crack runs released beyond that */
    uint32_t flags;
} sc_step_output;

void sc_model_step(const sc_model *model, sc_crack *state, float opening, float rate, float advance,
                   sc_step_output *out);

/* Torque with the crack at contact, or farther out where it settles (m g tan(psi) = J_c h). */
float sc_model_settled_torque(const sc_model *model, float opening, float rate, float contact);

/* Friction against the motion, F >= 0 while opening; the rendered share of torque is -F. */
float sc_model_friction(const sc_model *model, float opening, float rate);

/* Both over n places; the step keeps its state from one to the next. */
void sc_model_step_many(const sc_model *model, sc_crack *state, int64_t n, const float *opening,
                        const float *rate, const float *advance, sc_step_output *out);
/* Not a number where a step would be INVALID. */
void sc_model_torque_many(const sc_model *model, int64_t n, const float *opening, const float *rate,
                          const float *contact, float *torque);

/* 1 if all tables and numbers are valid: friction and its factor nowhere below 0, a response from
 * (0, 0) whose values never fall. */
int sc_model_is_sound(const sc_model *model);

/* Find the least and the largest slope of the edge's table, once, and store them in the model; while
 * both are 0, an edge that leans back is refused only where it stands over the contact. */
void sc_model_edge_slopes(sc_model *model);

/* 1 if at every opening of the range the release falls outwards along the blade, once it has passed its
 * largest value, as far as it decides where a crack stops. Then a run needs no scan of the edge's
 * knots. Store the answer in release_falls, once; 0 there is always right, and slower. */
int sc_model_release_falls(const sc_model *model);

#endif
