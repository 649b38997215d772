/* Blades of a random rig: bristle friction (Canudas de Wit et al. 1995, doi:10.1109/9.376053) of two
 * lengths, gravity, cogging, soft stops, a hand. Integrated by Heun's method in steps of 25 us. */
#ifndef RANDOM_RIGS_JOINT_H
#define RANDOM_RIGS_JOINT_H

typedef struct {
    double inertia, opening, closing, rise, rise_rate, viscous;
    double fine, slow, slow_share, bristle_damping;
    double gravity, gravity_phase, cogging, cogging_periods;
    double motor_lag, motor_gain, brake;
    double low, high, stop_stiffness, stop_damping;
    double obstacle;           /* opening (rad) below which something soft lies between the blades */
    double backlash;           /* of the encoder's coupling (rad) */
    double place, rate, motor, z_fine, z_slow, coupled, largest_rate;
} joint;

/* Passes `seconds`; `mode` 0 releases the motor, 1 drives it with `torque`, 2 brakes. A hand pulls
 * towards `hand` (rad) with `grip` (N m/rad). */
void joint_pass(joint *j, double seconds, int mode, double torque, double hand, double grip);
unsigned joint_size(void);

#endif
