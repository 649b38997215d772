#include "sc_servo_end.h"

#include <math.h>

/* Office paper presses back by 7 to 21 N m/rad: 0.3 N m are let go over 14 to 43 mrad, in 0.25 s at
 * 0.06 to 0.17 rad/s. */
enum { LET_GO_US = 250000, LONGEST_FALL_US = 100000 /* at the slews, in any case */ };
static const float MEAN_S = 0.03f;
static const float FOLLOWS = 0.5f; /* rad/s: blades that a torque moves so fast are not held by it */

void sc_servo_stop(sc_servo *servo, uint32_t reason)
{
    if (servo->stop_reason == SC_STOP_NONE) {
        servo->stop_reason = servo->ending != SC_STOP_NONE ? servo->ending : reason;
    }
}

static void begin(sc_servo *servo, uint32_t reason, uint32_t fall_us)
{
    if (servo->mode == SC_MODE_WATCH) { /* a torque of the host's would add to the device's */
        sc_servo_stop(servo, reason);
    } else if (servo->stop_reason == SC_STOP_NONE && servo->ending == SC_STOP_NONE) {
        servo->ending = reason;
        servo->ending_us = 0;
        servo->fall_us = fall_us;
        servo->held_torque = fall_us > 0 ? servo->mean_torque : 0.0f;
        servo->held_force = fall_us > 0 ? servo->mean_force : 0.0f;
    }
}

void sc_servo_end(sc_servo *servo, uint32_t reason)
{
    begin(servo, reason, 0);
}

void sc_servo_let_go(sc_servo *servo, uint32_t reason)
{
    begin(servo, reason, LET_GO_US);
}

void sc_servo_let_swings_go(sc_servo *servo, uint32_t reason)
{
    const float mean = servo->watch.swing.mean;
    sc_servo_let_go(servo, reason);
    if (servo->ending == reason) {
        servo->held_torque = mean;
    }
}

void sc_servo_follow_mean(sc_servo *servo, float time_s)
{
    const float share = time_s / (MEAN_S + time_s);
    servo->mean_torque += share * (servo->sent_torque - servo->mean_torque);
    servo->mean_force += share * (servo->sent_force - servo->mean_force);
}

void sc_servo_pass_ending(sc_servo *servo, uint32_t elapsed_us)
{
    const uint32_t most_us = servo->fall_us + LONGEST_FALL_US;
    if (!servo->ending) {
        return;
    }
    servo->ending_us = elapsed_us < most_us ? servo->ending_us + elapsed_us : most_us;
    if (servo->ending_us >= most_us) {
        sc_servo_stop(servo, servo->ending); /* also where the device only repeats itself */
    }
}

void sc_servo_ending(const sc_servo_config *config, sc_servo *servo, float *torque, float *force)
{
    const float rate = servo->motion.opening_rate;
    *torque = *force = 0.0f;
    if (servo->held_torque * rate > 0.0f && fabsf(rate) > FOLLOWS) {
        servo->held_torque = 0.0f;
    }
    if (servo->ending_us < servo->fall_us) {
        const float left = 1.0f - (float)servo->ending_us / (float)servo->fall_us;
        *torque = left * servo->held_torque - config->let_go_damping_Nm_s_per_rad * rate;
        *force = left * servo->held_force;
    }
}

void sc_servo_finish_ending(sc_servo *servo, int driven)
{
    const int let_go = servo->ending_us >= servo->fall_us && servo->sent_torque == 0.0f &&
                       servo->sent_force == 0.0f;
    if (servo->ending && (!driven || let_go)) {
        sc_servo_stop(servo, servo->ending);
    }
}
