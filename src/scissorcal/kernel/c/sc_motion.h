/* What a stream of measured places says: an unwrapped clock, filtered rates; and a PID on them. */
#ifndef SC_MOTION_H
#define SC_MOTION_H

#include <stdint.h>

enum { SC_LONGEST_GAP_US = 100000 };

typedef struct {
    int64_t device_time_us; /* unwrapped, never falls */
    uint32_t last_us;
    int32_t started;
    float opening;
    float opening_rate;
    float advance;
    float advance_rate;
} sc_motion;

/* Take a measurement and return the seconds since the last one, by the device's clock.
 *
 * Rates are backward differences behind a first-order low-pass at cutoff_Hz (0: none). A gap of
 * time is divided by its true length; after more than 0.1 s, or when the clock decreased (a device
 * that restarted), the rates start again from 0. A repeated measurement changes
 * nothing and returns 0; another place at a repeated time counts as a tick later. */
float sc_motion_update(sc_motion *motion, float cutoff_Hz, uint32_t tick_us, uint32_t device_us,
                       float opening, float advance);

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
