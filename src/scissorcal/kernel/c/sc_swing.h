/* Whether blades swing to and fro because the loop drives them.
 *
 * Teeth of a cut, a hand, and a limit cycle look alike: fast, wide swings in which the torque changes.
 * They differ in who gives the energy. Over swings of a loop the motor's torque works for the motion,
 * over those of teeth against it. */
#ifndef SC_SWING_H
#define SC_SWING_H

#include <stdint.h>

enum { SC_SWING_TICKS = 64 /* commands that may be on their way */ };

enum { SC_SWING_NONE = 0, SC_SWING_FED = 1, SC_SWING_HELD_UP = 2 };

typedef struct {
    float rate;        /* amplitude of a swing [rad/s] ... */
    float torque;      /* ... and the change of torque within it [N m] that count */
    float Hz;          /* slower swings are a hand's, or planned */
    float inertia;     /* of the blades [kg m^2]; 0: not known, and every swing is a loop's */
    float delay_ticks; /* until a command acts on the blades */
    float late_ticks;  /* a command that is later by so much explains the swings; 0: none is */
} sc_swing_config;

typedef struct {
    float time_s;  /* since the last state */
    float opening; /* [rad] */
    float rate;    /* [rad/s] */
    float aim_rate; /* of the reference, where there is one; else 0 */
    float torque;  /* that was commanded in answer to the last state [N m] */
    float late;    /* ticks since the state that the newest command answers; 1 in a good loop */
} sc_swing_input;

typedef struct {
    float time;    /* [s] */
    float torque;  /* that acted, times time */
    float turned;  /* from the reference [rad] */
    float work;    /* of the torque on that [J] */
} sc_swing_sums;

typedef struct {
    int32_t sign;
    float half_s;
    float peak;
    float low, high;   /* torque within this half of a swing */
    uint32_t count;
    sc_swing_sums half; /* over this half ... */
    sc_swing_sums all;  /* ... and those that count, forgetting */
    float kinetic;     /* energy of their peaks [J] */
    float latest;      /* worst lateness over them [ticks] */
    float mean;        /* of the torque that acted, over 0.4 s: no swing is left in it */
    float opening;     /* at the last state */
    uint32_t begun;
    uint32_t at;
    float sent[SC_SWING_TICKS];
} sc_swing;

/* Take a state in which motors drive; returns SC_SWING_... and the count of halves over what stops
 * as a share. */
int sc_swing_take(const sc_swing_config *config, sc_swing *swing, const sc_swing_input *in,
                  float *share);

/* Begin again, as where motors are off. */
void sc_swing_rest(sc_swing *swing);

#endif
