/* The servo: one STATE in, one COMMAND out. Modes, limits, ramps, watchdog, energy ledger.
 *
 * IDLE    motors off (commands of zero without ENABLE)
 * TRACK   opening and advance follow a reference by PID
 * RENDER  torque and force come from the model, ramped up from 0 when it engages
 * DAMP    torque = -damping * rate, no force
 * CONTROL the tip presses on a surface and follows a path along it: sc_control.h
 * WATCH   motors on without torque or force: the device renders by itself. The watches take the
 *         torque that it states for the command; what would end gently ends at once, and a missing
 *         heartbeat ends without damping before
 *
 * All commands pass the same limits: at most torque_limit and force_limit, and from one command
 * that is sent to the next no faster than the slews; only to zero at once, on a state that is not
 * usable, a fault, IDLE and a stop. A command that is not finite becomes 0.
 *
 * Time that passes is the host's (sc_servo_pass), so that neither a backlog of frames nor a device
 * that repeats itself changes what silence means.
 */
#ifndef SC_SERVO_H
#define SC_SERVO_H

#include "sc_control.h"
#include "sc_lag.h"
#include "sc_model.h"
#include "sc_motion.h"
#include "sc_passivity.h"
#include "sc_pieces.h"
#include "sc_plate.h"
#include "sc_stamp.h"
#include "sc_watch.h"
#include "sc_wire.h"

enum {
    SC_LEAP_RATES = 2 /* times the limit of the rate, beyond which no motion is taken */
};

enum {
    SC_MODE_IDLE = 0,
    SC_MODE_TRACK = 1,
    SC_MODE_RENDER = 2,
    SC_MODE_DAMP = 3,
    SC_MODE_CONTROL = 4,
    SC_MODE_WATCH = 5
};

/* Why the servo stopped; once it has, it stays stopped. */
enum {
    SC_STOP_NONE = 0,
    SC_STOP_ASKED = 1,
    SC_STOP_SUPERVISOR_LOST = 2,
    SC_STOP_DEVICE_FAULT = 3,
    SC_STOP_ENCODER_FAULT = 4,
    SC_STOP_TRACKING_LOST = 5,
    SC_STOP_HANGUP = 6,
    SC_STOP_SILENCE = 7,
    SC_STOP_LINE_ERROR = 8,
    SC_STOP_BAD_BLOCK = 9,
    SC_STOP_IMPLAUSIBLE = 10,
    SC_STOP_DEVICE_CLOCK = 11,
    SC_STOP_OVERSPEED = 12,
    SC_STOP_RESTARTED = 13,
    SC_STOP_NOT_HOMED = 14,
    SC_STOP_CONTROL = 16, /* and above: by what ended CONTROL, SC_CONTROL_... */
    SC_STOP_WATCHED = 32 /* and above: by what a watch saw, SC_WATCH_... */
};

/* A sample's flags above the 16 bits of the device. */
enum {
    SC_SAMPLE_TORQUE_LIMITED = 0x10000,
    SC_SAMPLE_FORCE_LIMITED = 0x20000,
    SC_SAMPLE_FALLBACK = 0x40000,
    SC_SAMPLE_INVALID = 0x80000,
    SC_SAMPLE_AFTER_GAP = 0x100000,
    SC_SAMPLE_PLATE_OUT = 0x800000, /* RENDER, and less than its force: for want of the plate's pose */
    SC_SAMPLE_STEP_SHIFT = 24 /* a rendered step's flags from this bit on */
};

typedef struct {
    float torque_limit;        /* [N m] */
    float torque_slew;         /* [N m/s] */
    float force_limit;         /* [N]; 0 renders and drives no force at all */
    float force_slew;          /* [N/s] */
    float ramp_s;              /* from engaging RENDER to its full force */
    float damping_Nm_s_per_rad; /* of DAMP */
    float let_go_damping_Nm_s_per_rad; /* while the servo ends gently */
    float rate_cutoff_Hz;      /* of the rate estimator; 0: none */
    float opening_kp, opening_kd, opening_ki;
    float advance_kp, advance_kd, advance_ki;
    float opening_error_limit; /* TRACK stops beyond this error [rad] ... */
    float advance_error_limit; /* ... or this [m] */
    float opening_low, opening_high; /* openings beyond them are not usable [rad] */
    float opening_rate_limit;  /* a faster motion stops while the motors are on [rad/s] ... */
    float advance_rate_limit;  /* ... [m/s]; places that would need twice as fast a one are not
                                  usable */
    uint32_t supervisor_ms;    /* without heartbeat until damping only; five times as long until
                                  the stop; 0: no supervision */
    uint32_t fault_clearings;  /* latched faults that are cleared before the servo stops */
    uint32_t tick_us;
    sc_passivity_config passivity;
    float motor_sign;          /* below 0: the motor's torque is turned round, commanded and
                                  measured; everything else here is of corrected signs */
    sc_watch_config watch;
    sc_plate_config plate;
    sc_pieces_config pieces;   /* of a plate whose pose is known; none: a uniform sheet */
} sc_servo_config;

typedef struct {
    const float *opening;
    const float *opening_rate;
    const float *advance;
    const int32_t *stroke;
    uint32_t size;
    const sc_control_task *task; /* what CONTROL follows; null: nothing */
} sc_reference;

/* The supervisor's orders. `order` and `sheet` count up: a new number engages the mode again, or
 * puts the crack at `crack` (those of pieces at their near edges). `heartbeat` has to change within supervisor_ms. */
typedef struct {
    uint32_t mode;
    uint32_t order;
    uint32_t sheet;
    float crack;
    uint32_t heartbeat;
    uint32_t stop;
} sc_orders;

/* One record of telemetry; layout as in a recording. */
typedef struct {
    uint32_t sequence;
    uint32_t flags;
    int64_t host_time_ns;
    int64_t device_time_us;
    double opening;
    double advance;
    double motor_torque;
    double handle_force;
    double torque_command;
    double force_command;
    int32_t stroke;
    uint32_t latency_ns;
} sc_sample;

typedef struct {
    sc_motion motion;
    sc_watch watch;
    float aim_opening, aim_rate, aim_advance; /* of the reference at the last state */
    sc_crack crack; /* with pieces, where that of the shown one stands */
    sc_pieces pieces;
    sc_plate plate;
    sc_control control;
    sc_ledger ledger; /* delivered in every mode; the rest while rendering */
    sc_port port;
    sc_sample sample; /* of the last frame; host time and latency are the loop's to fill */
    sc_step_output step;
    uint32_t started;
    uint32_t mode; /* in force, which may be DAMP by fallback */
    uint32_t order;
    uint32_t sheet;
    uint32_t heartbeat;
    uint32_t silent_us; /* of the supervisor */
    uint32_t stale_us;  /* since the last state that was no repeat */
    uint32_t slew_us;   /* since the last command that was sent, at most a tick */
    sc_stamps stamps;
    uint32_t unused_us;    /* passed over states before this one whose places were not usable */
    uint32_t implausible;  /* history of places that were not usable: sc_count_recent */
    uint32_t fallback;
    uint32_t fallback_from; /* mode that the missing heartbeat ended */
    uint32_t stop_reason;
    uint32_t ending;     /* reason for which torque and force fall to zero before it stops, or 0 */
    uint32_t ending_us;
    uint32_t fall_us;    /* over which they fall; 0: as fast as the slews let them */
    float held_torque, held_force; /* from which they fall */
    float mean_torque, mean_force; /* of the commands that were sent lately */
    uint32_t sequence;
    uint32_t begins;     /* the next frame is the first of its mode */
    uint32_t engaged_at; /* sequence at which the mode engaged, less the time in faults */
    float engaged_s;     /* time since then */
    float opening_integral;
    float advance_integral;
    float torque; /* answers the last state */
    float force;
    float sent_torque; /* last command that was sent */
    float sent_force;
    uint32_t track_index;
    uint32_t fault_seen;
    uint32_t fault_cause; /* of the last fault, SC_CAUSE_...; 0 of a device of version 1 */
    uint32_t clearings_sent; /* since the fault that stands was first seen */
    uint32_t enabled_once;
    uint32_t command_flags;
    uint64_t frames;
    uint64_t misses;
    uint64_t duplicates;
    uint64_t invalid_frames;
    uint64_t torque_limited;
    uint64_t force_limited;
    uint64_t torque_slewed;
    uint64_t force_slewed;
    uint64_t device_saturated;
    uint64_t fallback_frames;
    uint64_t plate_out_frames;
    uint64_t faults;
    sc_lag lag;
} sc_servo;

/* Let time pass, by the host's clock: call it before the states that arrived then, also when none
 * did. A supervisor whose heartbeat is missing for supervisor_ms leaves damping only; RENDER
 * engages again, from zero force, when it returns. Time in which this computer stalled must not be
 * in elapsed_us: the supervisor could not beat then either. */
void sc_servo_pass(const sc_servo_config *config, const sc_orders *orders, sc_servo *servo,
                   uint32_t elapsed_us);

/* Answer a state. Returns 1, and servo->sample is of this frame; or 0 for a frame that repeats the
 * last sequence: it gets the last command again, for 20 ms at most, then one that falls to zero.
 *
 * model and reference may be null: RENDER and TRACK then give no torque. A state whose opening or
 * advance is not usable (not finite, beyond the stops, or a leap that no motion makes) gets zero
 * torque and moves nothing; four among the last 20 stop. Where device_us and sequence contradict each
 * other a state is taken as so many ticks as its sequence says, after a leap of it as one; eight among
 * the last 20 stop. */
int sc_servo_step(const sc_servo_config *config, const sc_model *model,
                  const sc_reference *reference, const sc_orders *orders, sc_servo *servo,
                  const sc_state *state, sc_command *command);

/* Take an estimate of the plate's pose; model may be null. For a plate whose pose is known it does
 * nothing. */
void sc_servo_place(const sc_servo_config *config, const sc_model *model, sc_servo *servo,
                    const sc_placing *placing);

/* State that the last command was sent. Slews are from one such command to the next, and work is
 * booked for those alone. */
void sc_servo_sent(sc_servo *servo);

/* State that the last command is not sent, as where a newer state is there already: the sample then
 * has the command that is in force. */
void sc_servo_not_sent(sc_servo *servo);

/* State that the device has had time to act on a command, at most once a tick: a fault that it has
 * latched counts as one that does not clear by these calls alone. */
void sc_servo_answered(sc_servo *servo);

/* Latch the stop; the first reason stands. The motors are released at once. */
void sc_servo_stop(sc_servo *servo, uint32_t reason);

/* Latch the end: torque and force fall to zero as fast as the slews let them, within 0.1 s; then it
 * stops. The first reason stands. */
void sc_servo_end(sc_servo *servo, uint32_t reason);

/* 1 if every limit and gain is a finite number >= 0, and there are no pieces on a plate whose pose is
 * estimated. */
int sc_servo_config_is_sound(const sc_servo_config *config);

#endif
