/* Hybrid force/position law: press on a surface with a wanted force, follow a path along it.
 *
 * A mechanism of 2 or 3 axes carries a point p(q) of as many coordinates. With J = dp/dq, the unit
 * normal n of the surface, which points out of the material, the gap along it (below 0: pressed in)
 * and the pressing force lambda >= 0, the mechanism moves by
 *
 *     D qdd + bias + dry friction = effort + J^T n lambda
 *
 * and the law is
 *
 *     effort = D alpha + bias - J^T n h + compensation of dry friction
 *     alpha = J^-1 (n a_n + (1 - n n^T) a_p - Jdot qd)
 *     a_p = pdd_d + path_kd (pd_d - pd) + path_kp (p_d - p) + path_ki * integral of (p_d - p)
 *           - J D^-1 J^T n (lambda - h)
 *
 * with one of these along the normal, where a_s is the acceleration at which the gap's rate stays:
 *
 *     FORCE, touching     a_n = a_s - contact_kd (n^T pd - w),
 *                         h = lambda_d + force_kp (lambda_d - lambda)
 *                             + force_ki * integral of (lambda_d - lambda)
 *     FORCE, not touching a_n = a_s + normal_kd (aim' - gap') + normal_kp (aim - gap), h = 0;
 *                         the aim's fall grows from the gap's to approach_speed or, where that
 *                         is faster, approach_rate * gap; and the aim is no farther ahead than
 *                         presses by approach_force
 *     POSITION            a_n = a_s + normal_kd (gap_d' - gap') + normal_kp (gap_d - gap), h = 0
 *
 * While it touches, the surface's rate w along n is felt: a point that presses with lambda moves with
 * the surface but for the change of the indentation, compliance * lambda, so that w follows
 * n^T pd + compliance * lambda' behind a low-pass of surface_cutoff_Hz. It starts at the given
 * surface's rate, and stays there with a cutoff of 0.
 *
 * Touching begins at touch_force, and lambda_d rises from there at force_slew. Below leave_force the
 * approach takes over at once, lambda_d falls back to touch_force, and after leave_s touching has
 * ended, with the integral at 0.
 *
 * Dry friction is compensated by friction_share, in the direction of the wanted rate of an axis where
 * that is more than a fifth of its friction_rate, else in proportion to the measured rate up to it;
 * friction on the surface, mu lambda, likewise along the sliding.
 *
 * Limits: each axis's effort stays within its own; where it would not, the path yields before the
 * force does, and the integral does not grow against a limit. Outputs are finite: an input or a
 * result that is not gives zero effort with SC_HYBRID_INVALID, a Jacobian or an inertia that is
 * singular zero effort with SC_HYBRID_SINGULAR, and contact starts afresh after either.
 */
#ifndef SC_HYBRID_H
#define SC_HYBRID_H

#include <stdint.h>

enum { SC_HYBRID_MOST = 3 };

enum { SC_HYBRID_FORCE = 0, SC_HYBRID_POSITION = 1 };

enum {
    SC_HYBRID_INVALID = 1,         /* an input or the effort was not finite: zero effort */
    SC_HYBRID_SINGULAR = 2,        /* the point does not move in every direction: zero effort */
    SC_HYBRID_CONTACT = 4,         /* touching */
    SC_HYBRID_TOUCHED = 8,         /* touching began in this step */
    SC_HYBRID_LOST = 16,           /* touching ended in this step */
    SC_HYBRID_EFFORT_LIMITED = 32, /* an axis is at its limit, and would be beyond without path */
    SC_HYBRID_PATH_YIELDS = 64,    /* the path got less than its whole effort, to keep a limit */
    SC_HYBRID_FORCE_BOUNDED = 128, /* a force beyond touch_force to force_most was wanted */
    SC_HYBRID_INTEGRAL_HELD = 256  /* against a limit, or because nothing is pressed */
};

typedef struct {
    int32_t axes;          /* 2 or 3 */
    uint32_t normal_law;
    float contact_kd;      /* damping along the normal while touching [1/s] */
    float force_kp;        /* its part of h stays within integral_most */
    float force_ki;        /* [1/s] */
    float surface_cutoff_Hz; /* above it the surface's rate is not felt; 0: it is the given one */
    float normal_kp;       /* [1/s^2] */
    float normal_kd;       /* [1/s] */
    float path_kp;         /* [1/s^2] */
    float path_kd;         /* [1/s] */
    float path_ki;         /* [1/s^3] */
    float path_error_most; /* larger errors of the path count as this long [m] */
    float force_most;      /* of the force that is wanted [N] */
    float force_slew;      /* [N/s] */
    float integral_most;   /* [N] */
    float touch_force;     /* [N] */
    float leave_force;     /* below touch_force [N] */
    float leave_s;
    float approach_speed;  /* [m/s] */
    float approach_rate;   /* from afar the gap shrinks by this share of it; where the gap is wrong by
                              more than approach_speed / approach_rate, touching is faster [1/s] */
    float approach_force;  /* above touch_force [N] */
    float friction_share;  /* of dry friction that is compensated */
    float slip_rate;       /* of sliding on the surface, as friction_rate [m/s] */
    float friction_rate[SC_HYBRID_MOST]; /* slower measured rates count in proportion */
    float effort_limit[SC_HYBRID_MOST];  /* [N] or [N m] */
    float least_volume;    /* singular below: volume that the Jacobian's columns at unit length span */
} sc_hybrid_config;

/* What a step needs. Of arrays and matrices the first `axes` places (and rows of as many) count.
 * Point, normal, surface and path are in one frame. */
typedef struct {
    float dt;                                       /* since the step before; 0 or more [s] */
    float rate[SC_HYBRID_MOST];                     /* qd */
    float inertia[SC_HYBRID_MOST][SC_HYBRID_MOST];  /* D(q) */
    float bias[SC_HYBRID_MOST];                     /* all but inertia, dry friction and contact */
    float dry_friction[SC_HYBRID_MOST];             /* level of each axis, 0 or more */
    float jacobian[SC_HYBRID_MOST][SC_HYBRID_MOST]; /* J: row of a coordinate, column of an axis */
    float jacobian_rate[SC_HYBRID_MOST];            /* Jdot qd */
    float point[SC_HYBRID_MOST];                    /* p [m] */
    float normal[SC_HYBRID_MOST];                   /* n */
    float gap;                                      /* phi / |grad phi| [m] */
    float surface_velocity[SC_HYBRID_MOST];         /* of the material under the point [m/s] */
    float surface_acceleration; /* a_s; of a surface at rest -v^T Hessian v / |grad phi| [m/s^2] */
    float surface_friction;     /* mu; 0 compensates none */
    float force;                /* measured lambda [N] */
    float compliance;           /* indentation by a newton, for the surface's felt rate [m/N] */
    float force_wanted;         /* [N] */
    float gap_wanted;           /* of POSITION [m] */
    float gap_rate_wanted;      /* [m/s] */
    float path[SC_HYBRID_MOST]; /* p_d; what it has along the normal does not count */
    float path_rate[SC_HYBRID_MOST];
    float path_acceleration[SC_HYBRID_MOST];
} sc_hybrid_input;

/* All zero is a start without contact. */
typedef struct {
    uint32_t touching;
    uint32_t approaching; /* the aim is set */
    float aim;            /* gap that the approach aims at [m] */
    float speed;          /* at which the aim falls [m/s] */
    float force_aim;      /* lambda_d behind its slew [N] */
    float integral;       /* force_ki times the integral of the force's error [N] */
    uint32_t feels;       /* the two that follow are set */
    float surface_rate;   /* of the surface along the normal, as felt [m/s] */
    float force_before;   /* [N] */
    float below_s;        /* how long the force has been below leave_force */
    float gathered[SC_HYBRID_MOST]; /* path_ki times the integral of the path's error [m/s^2] */
} sc_hybrid;

typedef struct {
    float effort[SC_HYBRID_MOST];
    float force_aim;  /* lambda_d behind its slew; 0 while nothing is pressed [N] */
    float pressing;   /* h [N] */
    float mass;       /* that the surface meets along its normal [kg] */
    float gap_rate;   /* against the surface's rate, felt or given [m/s] */
    float path_error; /* length of the error along the surface [m] */
    float path_share; /* of the path's effort that was given */
    uint32_t flags;
} sc_hybrid_output;

void sc_hybrid_step(const sc_hybrid_config *config, sc_hybrid *state, const sc_hybrid_input *input,
                    sc_hybrid_output *out);

/* A step for each of n inputs in order of time. */
void sc_hybrid_step_many(const sc_hybrid_config *config, sc_hybrid *state, int64_t n,
                         const sc_hybrid_input *input, sc_hybrid_output *out);

/* 1 if all that counts with so many axes is finite, no level below 0, the normal of length 1. */
int sc_hybrid_input_is_usable(int32_t axes, const sc_hybrid_input *input);

/* 1 if the axes are 2 or 3, the law exists, every number is finite and in its range. */
int sc_hybrid_config_is_sound(const sc_hybrid_config *config);

#endif
