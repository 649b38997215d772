/* Data that pass between Python and the second virtual rig. SI units and radians throughout. */
#ifndef SECOND_RIG_H
#define SECOND_RIG_H

#include <stdint.h>

enum { RIG_OFF = 0, RIG_SERVO = 1, RIG_BRAKE = 2, RIG_HAND = 3 };
enum { RIG_POWER = 0, RIG_EXPONENTIAL = 1, RIG_TWO_SLOPES = 2 };
enum { RIG_PRESS = 0, RIG_CRACK = 1 };

/* Doubles only, so that the layout is the order of the names. */
typedef struct {
    double tick_s, step_s;
    double inertia, coulomb_pos, coulomb_neg, viscous_pos, viscous_neg, stribeck, stribeck_rate;
    double angle_slope, angle_curvature, angle_center, presliding, presliding_shape, load_share, offset;
    double cogging, cogging_periods, cogging_phase;
    double mass, sledge_coulomb, sledge_viscous, sledge_presliding;
    double delay_ticks, lag_s, torque_limit, force_limit, brake;
    double opening_step, advance_step;
    double rate_gain, position_gain, integral_gain, observer_hz, feed_inertia, feed_coulomb,
        feed_viscous;
    double sledge_kp, sledge_kd, sledge_ki, sledge_observer_hz;
    double moving, edge_offset, edge_slope, edge_curvature, edge_cubic, edge_length, tip_radius,
        upper_face;
    double law, force, reference, exponent, knee, knee_ratio, damping;
    double fracture, kappa, sheet_length, grid_step;
    double radius, hand_stiffness, hand_damping, hand_strength, hand_push, hand_drag, hand_reach;
} rig_parameters;

/* What happens at each tick; arrays of `ticks`. Sheet -1: empty. Hand paths are read in hand
 * mode only; the sheets' toughness J (N) and its integral over the place (J) have `grid` entries
 * for each sheet. */
typedef struct {
    const double *opening, *rate, *advance, *advance_rate, *tremor;
    const int32_t *mode, *sheet;
    const double *toughness, *toughness_integral;
    int64_t ticks, grid;
    double start_opening, start_advance;
} rig_inputs;

/* One row of books for each tick, at the instant at which the sensors are read. */
typedef struct {
    double opening, rate, advance, advance_rate, crack, motor_torque, sledge_force, handle_force,
        cut_torque, friction_torque, indentation, measured_opening, measured_advance,
        torque_command, force_command;
    double kinetic, stored, fracture, arrest;
    double motor_work, sledge_motor_work, cogging_work, offset_work, hand_work, sledge_hand_work,
        friction_work, sledge_friction_work, cut_work, sledge_cut_work, damping_work;
} rig_row;

/* One run of the crack. */
typedef struct {
    double time, opening, advance, start, end, toughness, drive_after, sheet;
} rig_jump;

int rig_run(const rig_parameters *p, const rig_inputs *in, rig_row *rows, rig_jump *jumps,
            int64_t jump_room, int64_t *jump_count);
double rig_sizes(int which);

#endif
