/* The mode CONTROL: the upper blade's tip presses on a surface and follows a path along it.
 *
 * In the rig's plane (x advance, y up) the tip of a blade turned by beta = opening / m is at
 *
 *     p = (advance + s cos(beta) - e sin(beta), s sin(beta) + e cos(beta)),
 *
 * and the surface there is a contour that the outer loop sends: a point c, the normal n out of the
 * material, the curvature k (positive where it bulges) and how both move. With t = (n_y, -n_x),
 *
 *     gap = n (p - c) + k (t (p - c))^2 / (2 (1 + k n (p - c))),
 *
 * to the third order what it is above a circle.
 *
 * sc_hybrid gives the efforts. The pressing force has no sensor: it follows from the balance of the
 * opening axis, inertia * acceleration = torque - offset - friction + lever * force, whose friction is
 * known while the blades slide; a stated stiffness makes of the gap's rate what is faster than the
 * balance's low-pass. While they stand, friction holds any torque: then the force follows the gap alone,
 * as far as the friction that the balance asks for is below its level.
 *
 * Without a contour for stale_s, or where a contour says lift, the force falls and the tip is lifted; the
 * path waits wherever nothing is pressed. All that ends the mode is a SC_CONTROL_... below.
 */
#ifndef SC_CONTROL_H
#define SC_CONTROL_H

#include "sc_hybrid.h"

#include <stdint.h>

enum { SC_FRICTION_POINTS = 24 };

/* What ends the mode. */
enum {
    SC_CONTROL_GOES_ON = 0,
    SC_CONTROL_NO_CONTOUR = 1, /* none for end_s */
    SC_CONTROL_HANDLE = 2,     /* somebody holds the handles */
    SC_CONTROL_AWAY = 3,       /* it presses above where the surface is */
    SC_CONTROL_NO_SURFACE = 4, /* nothing to press on where the surface should be */
    SC_CONTROL_PRESSED = 5,    /* a force beyond force_stop */
    SC_CONTROL_PATH_LOST = 6,
    SC_CONTROL_REFUSED = 7,    /* sc_hybrid gave no effort */
    SC_CONTROL_ENDS = 8
};

/* A sample's flags above those of sc_hybrid. */
enum {
    SC_CONTROL_HELD = 0x1000,    /* the force is the last known one: the blades stand */
    SC_CONTROL_LETS_GO = 0x2000, /* without a contour, or lifting */
    SC_CONTROL_LIFTED = 0x4000,
    SC_CONTROL_DONE = 0x8000     /* the path's end is reached */
};

/* Friction of one axis: its size at the rate fastest (i / (SC_FRICTION_POINTS - 1))^4, linear in the
 * fourth root of the rate between, times 1 + slope d + bend d^2 at the distance d from `centre`. */
typedef struct {
    float fastest; /* [rad/s] or [m/s]; beyond it the last value is held */
    float positive[SC_FRICTION_POINTS];
    float negative[SC_FRICTION_POINTS];
    float slope, bend, centre;
} sc_axis_friction;

typedef struct {
    sc_hybrid_config law;
    float station, edge_offset; /* of the tip on the blade [m] */
    float moving_blades;
    float inertia;              /* of the opening [kg m^2] */
    float mass;                 /* of the advance [kg] */
    float offset;               /* constant torque that the drive bears [N m] */
    float torque_zero;          /* what the sensor of the torque shows of none [N m] */
    sc_axis_friction opening, advance;
    float surface_friction;     /* between tip and material */
    float stiffness;            /* of the material [N/m]; 0: a standing blade's force stays */
    float presliding;           /* opening over which friction turns round [rad] */
    float force_cutoff_Hz;      /* low-pass of the balance; 0: none */
    float force_band;           /* of a standing blade's force within which none is corrected [N] */
    float torque_sd;            /* standard deviation of the balance while sliding [N m] */
    float least_lever;          /* of torque to force; less is refused [m] */
    float tick_s;
    float pace_s;               /* in which the path starts and halts */
    float stale_s;              /* without a contour until the force falls */
    float end_s;                /* without a contour until the mode ends */
    float lift_gap, lift_speed; /* [m], [m/s] */
    float away;                 /* gap beyond which nothing may press, and the tip find nothing [m] */
    float approach_s;           /* most time without pressing */
    float force_stop;           /* [N] */
    float path_stop;            /* error of the path [m] */
    float handle_stop;          /* force at the handles [N] ... */
    float handle_zero;          /* ... from what the sensor shows untouched */
    float sustained_s;          /* for which what ends the mode has to last */
} sc_control_config;

/* The surface's curve in the rig's plane, near the tip. */
typedef struct {
    float point[2];
    float normal[2];
    float curvature;   /* [1/m] */
    float place;       /* of the point along the surface, growing along t [m] */
    float velocity[2]; /* of the material at the point [m/s] */
    float turn_rate;   /* [rad/s] */
    uint32_t lift;
    uint32_t number;   /* of this contour; 0: there is none yet */
} sc_contour;

/* What is followed: one entry a tick, at the pace of 1. */
typedef struct {
    const float *place; /* along the surface [m] */
    const float *rate;  /* [m/s] */
    const float *force; /* [N] */
    const int32_t *stage;
    uint32_t size;
} sc_path;

typedef struct {
    const sc_control_config *config;
    sc_contour contour;
    sc_path path;
} sc_control_task;

/* One tick's state of the rig. */
typedef struct {
    float dt;
    float opening, opening_rate;
    float advance, advance_rate;
    float motor_torque;
    float handle_force;
} sc_control_tick;

/* One record of telemetry: 64 bytes. */
typedef struct {
    uint32_t sequence;
    uint32_t flags;
    int32_t stage;
    uint32_t contour;
    float force;        /* [N], from the balance */
    float force_sd;
    float force_wanted;
    float force_aim;    /* behind its slew */
    float gap;          /* [m] */
    float gap_rate;
    float place;        /* along the surface [m] */
    float place_wanted;
    float tip_x, tip_y;
    float contour_age;  /* [s] */
    float index;        /* of the path */
} sc_control_sample;

/* The balance of the opening axis. */
typedef struct {
    int32_t started;
    float rate;    /* of the opening, at the tick before */
    float balance; /* low-passed inertia * acceleration - torque + offset [N m] */
    float torque;  /* of the pressing force on the opening [N m] */
    float bristle; /* way into the present direction, at most `presliding` either way [rad] */
    float still_s; /* since that was last pushed on ... */
    float count_s; /* ... and how long it took until then */
    float held_s;
    float opening;
} sc_balance;

typedef struct {
    sc_hybrid law;
    sc_balance balance;
    sc_control_sample sample; /* of the last tick */
    uint32_t contour;         /* number of the last one */
    float age_s;              /* of the contour */
    double index;
    float pace;
    float lift;               /* gap that is wanted while lifting [m] */
    uint32_t lifting;
    float unpressed_s, away_s, pressed_s, handle_s;
} sc_control;

/* Efforts (torque [N m], force [N]) for a tick. Returns SC_CONTROL_GOES_ON or what ends the mode;
 * efforts are 0 then, and while there was no contour yet. All zero is a start. */
int sc_control_step(const sc_control_task *task, sc_control *control, const sc_control_tick *tick,
                    float effort[2]);

/* State that a tick was not controlled: contact starts afresh, the path waits where it is. */
void sc_control_rest(sc_control *control);

/* Size of an axis's friction, 0 or more. */
float sc_axis_friction_at(const sc_axis_friction *friction, float place, float rate);

/* Take a tick into the balance; returns the torque of the pressing force [N m]. `sinking` is the rate at
 * which the tip sinks into the material [m/s], `lever` the torque of a newton there. */
float sc_balance_take(const sc_control_config *config, sc_balance *balance,
                      const sc_control_tick *tick, float sinking, float lever);

/* Standard deviation of that torque [N m]. */
float sc_balance_sd(const sc_control_config *config, const sc_balance *balance);

/* 1 if the law is sound for two axes and every number is finite and in its range. */
int sc_control_config_is_sound(const sc_control_config *config);

#endif
