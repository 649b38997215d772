#include "sc_joint.h"

#include <math.h>

/* A step of the symplectic Euler method is stable below 2 / angular frequency and errs in it by
 * phase^2 / 24: 1.5 % at 0.6. */
static const double PHASE = 0.6;
static const double SHORTEST_STEP = 5e-5;

/* exp(-x) for x >= 0: right to x^4 / 24 where x is small, and falling to 0 for all x. */
static double decay(double x)
{
    return 1.0 / (1.0 + x * (1.0 + x * (0.5 + x * (1.0 / 6.0))));
}

static double longest_step(const sc_joint *joint, double most)
{
    double level = fmax(joint->opening, joint->closing) + joint->rise;
    double stiffness = level * ((1.0 - joint->slow_share) / joint->fine +
                                joint->slow_share / joint->slow);
    double step = PHASE * sqrt(joint->inertia / fmax(stiffness, 1e-12));
    return fmax(fmin(step, most), SHORTEST_STEP);
}

void sc_joint_follow(const sc_joint *joint, const double *times, const double *rests, size_t count,
                     const double *switches, const double *torques, size_t commands, double step,
                     double *places)
{
    double place = 0.0, rate = 0.0, motor = 0.0, command = 0.0, ahead = 0.0;
    double fine = 0.0, slow = 0.0;
    const double longest = longest_step(joint, step);
    const double per_fine = 1.0 / joint->fine, per_slow = 1.0 / joint->slow;
    size_t next = 0;
    if (count == 0)
        return;
    double now = times[0];
    for (size_t i = 0; i < count; i++) {
        while (now < times[i]) {
            double until = times[i];
            while (next < commands && switches[next] <= now)
                command = torques[next++];
            if (next < commands && switches[next] < until)
                until = switches[next];
            const double left = until - now;
            const double steps = ceil(left / longest - 1e-9);
            const double dt = left / steps;
            const double lag = joint->motor_lag;
            const double follow = lag > 0.0 ? -expm1(-dt / lag) : 1.0;
            const double missing = follow * lag / dt; /* of the command, on average over a step */
            for (double done = 0.0; done < steps; done += 1.0) {
                const double share = joint->slow_share;
                const double acting = command + missing * (motor - command);
                motor += follow * (command - motor);
                const double built = (1.0 - share) * fine + share * slow;
                const double level = built > 0.0 ? joint->opening : joint->closing;
                const double over = rate / joint->rise_rate;
                const double rise = joint->rise > 0.0 ? joint->rise * decay(over * over) : 0.0;
                const double torque = acting + joint->carrying +
                                      joint->carrying_slope * (place - joint->turn) -
                                      (level + rise) * built;
                const double yields = 1.0 - (rate < 0.0 ? -fine : fine);
                const double damping = joint->viscous + joint->bristle * yields;
                rate = (rate + dt * torque / joint->inertia) / (1.0 + dt * damping / joint->inertia);
                const double way = dt * rate;
                place += way;
                const double sign = way < 0.0 ? -1.0 : 1.0;
                fine = sign - (sign - fine) * decay(fabs(way) * per_fine);
                slow = sign - (sign - slow) * decay(fabs(way) * per_slow);
            }
            now = until;
            ahead = 0.5 * dt * rate; /* a symplectic place is half a step ahead of its time */
        }
        if (i == 0 || isfinite(rests[i])) {
            place = isfinite(rests[i]) ? rests[i] : place;
            rate = ahead = 0.0;
            if (i == 0 && joint->carrying != 0.0) {
                const double level = joint->carrying > 0.0 ? joint->opening : joint->closing;
                const double built = joint->carrying / fmax(level + joint->rise, 1e-12);
                fine = slow = fmax(-0.999, fmin(0.999, built));
            }
        }
        places[i] = place - ahead;
    }
}
