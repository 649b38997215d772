/* What the two halves of the second rig share: its physics (rig.c) and its day (day.c). */
#ifndef SECOND_RIG_INTERNAL_H
#define SECOND_RIG_INTERNAL_H

#include "rig.h"

#define LATEST_TICKS 8 /* commands that may be on their way to the motor */
#define EVENTS_PER_TICK 4000

enum { MOTOR, SLEDGE_MOTOR, COGGING, OFFSET, HAND, SLEDGE_HAND, FRICTION, SLEDGE_FRICTION, CUT,
       SLEDGE_CUT, DAMPING, WORKS };

typedef struct {
    double th, w, x, v;
    double u, ux; /* share of the dry friction that the bristles of each axis bear, -1 to 1 */
    double crack;
    double work[WORKS];
    double torque, thrust; /* what the motors give */
} state;

typedef struct {
    double delta, slope, lever; /* indentation, tan psi, x_c + phi tan psi */
} touch;

typedef struct {
    const rig_parameters *p;
    const rig_inputs *in;
    const double *toughness, *integral; /* of the sheet in place, NULL without one */
    int severed, mode;
    double beta, sine, cosine; /* of the last blade angle */
    double station; /* where Newton's method found the last contact on the blade */
    double torque_target, thrust_target;
    int64_t tick;
    double into_tick; /* seconds since the tick began */
    double fracture, arrest;
    double time;
    double cut_torque, friction_torque, handle_force, indentation; /* at the last first stage */
    rig_jump *jumps;
    int64_t jump_room, jump_count, sheet;
} rig;

typedef struct {
    double rate_estimate, place_estimate, integral;
    double sledge_rate, sledge_place, sledge_integral;
    int awake;
    double torques[LATEST_TICKS], forces[LATEST_TICKS]; /* newest first */
} servo;

double rig_clip(double value, double low, double high);
touch rig_touch_at(rig *r, double opening, double contact);
double rig_response(const rig_parameters *p, double delta, double *energy);
double rig_toughness_at(const rig *r, double place, double *integral);
double rig_drive_of(const rig *r, const touch *where);
double rig_excess_at(rig *r, double th, double x, double place, double kappa);
double rig_stop_of_run(rig *r, double th, double x, double from, double kappa);
int rig_is_loaded(const rig *r);
double rig_stored_in(rig *r, const state *y);
void rig_stage(rig *r, const state *y0, state *y, double into, double accelerations[2],
               double power[WORKS]);
int rig_advance(rig *r, state *y, double seconds);

#endif
