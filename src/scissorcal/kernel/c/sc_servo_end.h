/* How a servo ends: at once, as fast as the slews let it, or gently. For sc_servo.c and what belongs
 * to it. */
#ifndef SC_SERVO_END_H
#define SC_SERVO_END_H

#include "sc_servo.h"

/* Follow what the motors hold: the mean of the commands of the last 30 ms, over time_s more. */
void sc_servo_follow_mean(sc_servo *servo, float time_s);

/* Latch the end: what the motors held on average falls to zero within 0.25 s, with damping; then it
 * stops. Motors off would throw blades that a sheet of 0.3 N m springs back. */
void sc_servo_let_go(sc_servo *servo, uint32_t reason);

/* The same for blades that swing: what is held is the mean over 0.4 s, in which no swing is left. */
void sc_servo_let_swings_go(sc_servo *servo, uint32_t reason);

/* Let time pass for a servo that is ending. */
void sc_servo_pass_ending(sc_servo *servo, uint32_t elapsed_us);

/* Torque and force of a servo that is ending. A torque that the blades follow instead of being held
 * by it is let go of at once. */
void sc_servo_ending(const sc_servo_config *config, sc_servo *servo, float *torque, float *force);

/* Stop a servo that is ending, once nothing is left to let go of. */
void sc_servo_finish_ending(sc_servo *servo, int driven);

#endif
