/* The servo on a plate whose pose is estimated, or that is made of pieces. For sc_servo.c alone; callers need sc_servo.h only. */
#ifndef SC_SERVO_PLATE_H
#define SC_SERVO_PLATE_H

#include "sc_servo.h"

/* Move the section on, where there is one. */
void sc_servo_move_plate(const sc_servo_config *config, sc_servo *servo, float dt);

/* The model's step into servo->step: on the estimated plate, with *share times the force that its
 * state lets through; that of the pieces, where there are any; or where the model has it. 0 where there is nothing to render. */
int sc_servo_step_model(const sc_servo_config *config, const sc_model *model, sc_servo *servo,
                        float *share);

#endif
