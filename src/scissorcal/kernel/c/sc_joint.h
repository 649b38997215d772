/* Joints pushed by a motor, simulated along a record: what a probe compares with the encoder. */
#ifndef SC_JOINT_H
#define SC_JOINT_H

#include <stddef.h>

/* Inertia (kg m^2). Dry friction (N m) of each direction, reached over two lengths (rad) after a
 * reversal, the slow one for a share of it, and the damping of what yields (N m s/rad); what it is
 * more at rest, falling by exp(-(w / rate)^2); viscous (N m s/rad). The torque (N m) that carries
 * the blades at `turn` (rad) and its slope over the opening (N m/rad). Time constant of the motor
 * (s). `stop`: 1 where the blades rest on a stop that lets them go only to larger openings, -1 only
 * to smaller ones, 0 without; and the stiffness of that stop (N m/rad). */
typedef struct {
    double inertia;
    double opening, closing;
    double rise, rise_rate;
    double viscous;
    double fine, slow, slow_share, bristle;
    double carrying, carrying_slope, turn;
    double motor_lag;
    double stop, stop_stiffness;
} sc_joint;

/* Most joints that are followed at once: the fit's joint beside those that differ in one value. */
enum { SC_JOINTS = 16 };

/* Places (rad) of `joints` joints (SC_JOINTS at most) at `count` times (s, ascending): those of
 * joint j are places[j * count] and on. The motor's command changes to `torques[k]` at
 * `switches[k]` (s, ascending), and is 0 before. At the first time and wherever `rests[i]` is
 * finite the joint stands there: it is put to that place at rest, with what its friction has built
 * up, and on its stop, if it has one, as deep as what carries it presses. Before the first time
 * friction has built up what carries the joint, but nothing on a stop. Steps are at most `step` (s)
 * and short enough for the stiffest presliding of the first joint; all take the same, so that
 * places differ by the joints alone. */
void sc_joint_follow(const sc_joint *joint, size_t joints, const double *times, const double *rests,
                     size_t count, const double *switches, const double *torques, size_t commands,
                     double step, double *places);

#endif
