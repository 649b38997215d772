/* What goes wrong while motors drive the blades, told from commands and measurements alone.
 *
 * Every watch is a few numbers that are brought up to date once a state. Thresholds of 0 switch a
 * watch off. The largest value that each has seen is kept as a share of its threshold.
 */
#ifndef SC_WATCH_H
#define SC_WATCH_H

#include "sc_swing.h"

#include <stdint.h>

enum {
    SC_WATCH_NOTHING = -1,
    SC_WATCH_HELD = 0,          /* torque at its limit for too long */
    SC_WATCH_SWING = 1,         /* blades and torque swing to and fro faster than any hand */
    SC_WATCH_RUNAWAY = 2,       /* blades speed up against the torque */
    SC_WATCH_STILL = 3,         /* the opening stands although it cannot */
    SC_WATCH_STILL_ADVANCE = 4, /* so does the advance */
    SC_WATCH_REVERSED = 5,      /* measured torque has the sign opposite to the commanded one */
    SC_WATCH_DIFFERS = 6,       /* measured torque is another one than commanded */
    SC_WATCH_CLOCK = 7,         /* the device's clock, against its ticks or this computer's clock */
    SC_WATCH_UNREADABLE = 8,    /* motor torque or handle force is no number */
    SC_WATCH_RUNAWAY_ADVANCE = 9,
    SC_WATCH_STOP = 10,         /* the device says that it is at a stop; the opening is elsewhere */
    SC_WATCH_HELD_UP = 11,      /* as SWING, while commands came late */
    SC_WATCHES = 12
};

typedef struct {
    float held_s;            /* at the limit so long, less the time below it since */
    float swing_rate;        /* what swings count, and who drives them: sc_swing_config */
    float swing_torque;
    float swing_Hz;
    float swing_inertia;
    float swing_delay_ticks;
    float held_up_ticks;
    float runaway_rate;      /* [rad/s] */
    float runaway_speed;     /* of the advance [m/s] */
    float still_rad;         /* motion of the reference while the opening stands ... */
    float still_m;           /* motion of the reference while the advance stands */
    float still_torque;      /* ... under so large a torque [N m] */
    float rest_torque;       /* without a reference, an imbalance of motor and hand [N m] that cannot
                                leave blades at rest ... */
    float rest_share;        /* ... beyond this share of the smaller of the two */
    float jitter_s;          /* an encoder that jitters repeats no reading for so long */
    float least_ratio;       /* of measured to commanded torque ... */
    float most_ratio;        /* ... outside of which they differ */
    float ratio_torque;      /* torques below it say nothing about that [N m]; 0: nothing that is
                                measured beside the places is watched */
    float clock_share;       /* of the device's clock against its ticks */
    float host_clock_share;  /* of the device's clock against this computer's */
    float stop_low, stop_high; /* openings of the stops [rad] ... */
    float stop_margin;       /* ... and how far from both a stop is none */
    float handle_radius;     /* of a rig that measures the force of the hand [m]; else 0 */
    float handle_zero;       /* what its sensor shows without a hand [N] */
} sc_watch_config;

/* What a state says, and what was in force until it came. */
typedef struct {
    float time_s;        /* since the last usable state, by the device's clock */
    int32_t usable;      /* whether its place is */
    int32_t driven;      /* whether motors follow commands, in this state and by this servo's */
    int32_t released;    /* whether motors are off, and do not brake either */
    int32_t tracking;    /* whether there is a reference */
    int32_t at_stop;
    float torque;        /* the commands in force [N m], [N] */
    float force;
    float torque_limit;
    float measured;      /* torque [N m] */
    float handle_force;  /* [N] */
    float opening;
    float opening_rate;
    float advance;
    float advance_rate;
    float aim_opening;   /* of the reference, as its rate and the advance */
    float aim_rate;
    float aim_advance;
    float late;          /* ticks since the state that the newest command answers */
    uint32_t ticks_us;   /* ticks since the last state, usable or not ... */
    int32_t stated_us;   /* ... and what the device's clock says to that */
} sc_watch_input;

/* Of one axis: since when its effort has one sign, and how fast it was once that could act. */
typedef struct {
    int32_t sign;
    float for_s;
    float rate;
} sc_watch_effort;

typedef struct {
    float worst[SC_WATCHES]; /* largest value over threshold; 1 stops */
    float held_s;
    sc_swing swing;
    sc_watch_effort torque, force;
    uint32_t elsewhere;     /* states in a row at a stop that is none */
    int32_t has_still;
    float still_opening, still_aim;
    float still_advance, still_aim_advance;
    float still_s;
    float imbalance;
    float zero, zero_s;     /* of the measured torque, while the motors were off */
    float smooth_torque, smooth_measured;
    float driven_s;
    float sum_cc, sum_cm;   /* of smooth torques, forgetting */
    float differs_s;
    int32_t has_clock;
    int64_t ticks_us;       /* of the window by ticks ... */
    int64_t clock_us;       /* ... and the device's clock over it */
    uint32_t off_ticks;     /* windows in a row in which the clock was off its ticks */
    int64_t host_clock_us;  /* the device's clock over the window by this computer's ... */
    uint32_t host_us;       /* ... time */
    uint32_t off_host;      /* windows in a row in which it was off this computer's */
    uint32_t unreadable;    /* history of states: sc_count_recent */
} sc_watch;

/* 1 if every threshold is a finite number >= 0. */
int sc_watch_config_is_sound(const sc_watch_config *config);

/* Tell it of time that passed by this computer's clock. */
void sc_watch_pass(sc_watch *watch, uint32_t elapsed_us);

/* Take a state; returns which watch stops, or SC_WATCH_NOTHING. */
int sc_watch_take(const sc_watch_config *config, sc_watch *watch, const sc_watch_input *input);

#endif
