#include "joint.h"

#include <math.h>

#define STEP_S 25e-6

typedef struct {
    double place, rate, z_fine, z_slow;
} moving;

static double bristle(double z, double rate, double length)
{
    return rate - fabs(rate) * z / length;
}

/* Fast blades pass a bristle's length within a step; it is bent to its end then, and not beyond. */
static double bent(double z, double length)
{
    return fmax(-length, fmin(length, z));
}

static moving slopes(const joint *j, const moving *y, double torque, double hand, double grip)
{
    const double over = y->rate / j->rise_rate;
    const double base = y->rate > 0.0 ? j->opening : j->closing;
    const double level = base + j->rise * exp(-over * over);
    const double share = j->slow_share;
    const double dz_fine = bristle(y->z_fine, y->rate, j->fine);
    const double dz_slow = bristle(y->z_slow, y->rate, j->slow);
    const double built = (1.0 - share) * y->z_fine / j->fine + share * y->z_slow / j->slow;
    double sum = torque - level * built - j->viscous * y->rate - j->bristle_damping * dz_fine;
    sum += j->gravity * cos(y->place - j->gravity_phase);
    sum += j->cogging * sin(j->cogging_periods * y->place);
    if (grip > 0.0)
        sum += grip * (hand - y->place) - 0.6 * y->rate;
    const double beyond = y->place < j->low ? j->low - y->place
                          : y->place > j->high ? j->high - y->place : 0.0;
    if (beyond != 0.0)
        sum += j->stop_stiffness * beyond - j->stop_damping * y->rate;
    if (y->place < j->obstacle)
        sum += 0.2 * j->stop_stiffness * (j->obstacle - y->place) - 0.2 * j->stop_damping * y->rate;
    const moving dy = {y->rate, sum / j->inertia, dz_fine, dz_slow};
    return dy;
}

void joint_pass(joint *j, double seconds, int mode, double torque, double hand, double grip)
{
    const int steps = (int)ceil(seconds / STEP_S - 1e-9);
    const double dt = seconds / steps;
    const double keep = j->motor_lag > 0.0 ? exp(-dt / j->motor_lag) : 0.0;
    moving y = {j->place, j->rate, j->z_fine, j->z_slow};
    for (int i = 0; i < steps; i++) {
        const double goal = mode == 1 ? torque : 0.0;
        j->motor = goal + keep * (j->motor - goal);
        double acting = j->motor_gain * j->motor;
        if (mode == 2)
            acting -= j->brake * y.rate;
        const moving a = slopes(j, &y, acting, hand, grip);
        const moving mid = {y.place + dt * a.place, y.rate + dt * a.rate,
                            bent(y.z_fine + dt * a.z_fine, j->fine),
                            bent(y.z_slow + dt * a.z_slow, j->slow)};
        const moving b = slopes(j, &mid, acting, hand, grip);
        y.place += 0.5 * dt * (a.place + b.place);
        y.rate += 0.5 * dt * (a.rate + b.rate);
        y.z_fine = bent(y.z_fine + 0.5 * dt * (a.z_fine + b.z_fine), j->fine);
        y.z_slow = bent(y.z_slow + 0.5 * dt * (a.z_slow + b.z_slow), j->slow);
        if (fabs(y.rate) > j->largest_rate)
            j->largest_rate = fabs(y.rate);
        const double half = 0.5 * j->backlash;
        j->coupled = fmax(y.place - half, fmin(y.place + half, j->coupled));
    }
    j->place = y.place;
    j->rate = y.rate;
    j->z_fine = y.z_fine;
    j->z_slow = y.z_slow;
}

unsigned joint_size(void)
{
    return (unsigned)sizeof(joint);
}
