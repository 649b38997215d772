#include "sc_servo_control.h"

void sc_servo_control(const sc_reference *reference, sc_servo *servo, float dt, float *torque,
                      float *force)
{
    float effort[2];
    *torque = *force = 0.0f;
    if (reference == NULL || reference->task == NULL) {
        return;
    }
    const sc_motion *motion = &servo->motion;
    const sc_control_tick tick = {dt,
                                  motion->opening,
                                  motion->opening_rate,
                                  motion->advance,
                                  motion->advance_rate,
                                  (float)servo->sample.motor_torque,
                                  (float)servo->sample.handle_force};
    const int seen = sc_control_step(reference->task, &servo->control, &tick, effort);
    *torque = effort[0];
    *force = effort[1];
    servo->control.sample.sequence = servo->sequence;
    if (seen != SC_CONTROL_GOES_ON) {
        sc_servo_end(servo, SC_STOP_CONTROL + (uint32_t)seen);
    }
}
