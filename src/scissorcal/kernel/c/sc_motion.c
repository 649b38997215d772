#include "sc_motion.h"

#include <math.h>

static float low_pass(float old, float fresh, float cutoff_Hz, float dt)
{
    const float weight = 6.2831853f * cutoff_Hz * dt;
    const float rate = cutoff_Hz > 0.0f ? old + (fresh - old) * weight / (1.0f + weight) : fresh;
    return isfinite(rate) ? rate : 0.0f;
}

float sc_motion_update(sc_motion *motion, float cutoff_Hz, uint32_t passed_us, float opening,
                       float advance)
{
    const float dt = (float)passed_us * 1e-6f;
    if (motion->started && passed_us > 0) {
        motion->opening_rate =
            low_pass(motion->opening_rate, (opening - motion->opening) / dt, cutoff_Hz, dt);
        motion->advance_rate =
            low_pass(motion->advance_rate, (advance - motion->advance) / dt, cutoff_Hz, dt);
    }
    motion->device_time_us += passed_us;
    motion->started = 1;
    motion->opening = opening;
    motion->advance = advance;
    return dt;
}

float sc_pid(const sc_pid_gains *gains, float *integral, float error, float error_rate, float dt)
{
    const float grown = *integral + gains->ki * error * dt;
    const float direct = gains->kp * error + gains->kd * error_rate;
    const float effort = direct + grown;
    const int drives_further =
        (effort > gains->limit && error > 0.0f) || (effort < -gains->limit && error < 0.0f);
    if (!drives_further) {
        *integral = fminf(fmaxf(grown, -gains->limit), gains->limit);
    }
    return direct + *integral;
}
