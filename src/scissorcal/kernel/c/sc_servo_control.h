/* The mode CONTROL within the servo. For sc_servo.c alone; callers of the servo need sc_servo.h only. */
#ifndef SC_SERVO_CONTROL_H
#define SC_SERVO_CONTROL_H

#include "sc_servo.h"

/* Torque and force of a tick of CONTROL; what ends the mode ends the servo. Without a task there are none. */
void sc_servo_control(const sc_reference *reference, sc_servo *servo, float dt, float *torque,
                      float *force);

#endif
