/* What a stream of measured places says: filtered rates; and a PID on them. */
#ifndef SC_MOTION_H
#define SC_MOTION_H

#include <stdint.h>

typedef struct {
    int64_t device_time_us; /* since the first measurement; never falls */
    int32_t started;
    float opening;
    float opening_rate;
    float advance;
    float advance_rate;
} sc_motion;

/* Take a measurement, passed_us after the last one; returns that in seconds.
 *
 * Rates are backward differences behind a first-order low-pass at cutoff_Hz (0: none), and 0 at the
 * first place. A gap is divided by its true length. */
float sc_motion_update(sc_motion *motion, float cutoff_Hz, uint32_t passed_us, float opening,
                       float advance);

typedef struct {
    float kp;
    float kd;
    float ki;
    float limit;
} sc_pid_gains;

/* Effort for an error and its rate. The integral is held while the effort is at its limit and
 * the error would drive it further, and never exceeds the limit itself. */
float sc_pid(const sc_pid_gains *gains, float *integral, float error, float error_rate, float dt);

#endif
