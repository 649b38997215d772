#include "sc_joint.h"

#include <math.h>

/* A step of the symplectic Euler method is stable below 2 / angular frequency and errs in it by
 * phase^2 / 24: 1.5 % at 0.6. */
static const double PHASE = 0.6;
static const double SHORTEST_STEP = 5e-5;

/* Of critical: rubber and blades that are pressed on it. */
static const double STOP_DAMPING = 0.3;

/* What the steps take, a column for each joint, so that compilers do several at once. */
typedef struct {
    double place[SC_JOINTS], rate[SC_JOINTS], motor[SC_JOINTS];
    double fine[SC_JOINTS], slow[SC_JOINTS];
    double opening[SC_JOINTS], closing[SC_JOINTS], rise[SC_JOINTS], per_rate[SC_JOINTS];
    double per_inertia[SC_JOINTS], viscous[SC_JOINTS], bristle[SC_JOINTS];
    double per_fine[SC_JOINTS], per_slow[SC_JOINTS], share[SC_JOINTS];
    double carrying[SC_JOINTS], slope[SC_JOINTS], turn[SC_JOINTS];
    double follow[SC_JOINTS], missing[SC_JOINTS];
    double stop[SC_JOINTS], wall[SC_JOINTS], stiffness[SC_JOINTS], cushion[SC_JOINTS];
} columns;

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

static void set_up(columns *c, const sc_joint *joint, size_t joints, double longest)
{
    const double square = longest * longest;
    for (size_t j = 0; j < joints; j++) {
        c->place[j] = c->rate[j] = c->motor[j] = c->fine[j] = c->slow[j] = 0.0;
        c->opening[j] = joint[j].opening;
        c->closing[j] = joint[j].closing;
        c->rise[j] = joint[j].rise;
        c->per_rate[j] = 1.0 / joint[j].rise_rate;
        c->per_inertia[j] = 1.0 / joint[j].inertia;
        c->viscous[j] = joint[j].viscous;
        c->bristle[j] = joint[j].bristle;
        c->per_fine[j] = 1.0 / joint[j].fine;
        c->per_slow[j] = 1.0 / joint[j].slow;
        c->share[j] = joint[j].slow_share;
        c->carrying[j] = joint[j].carrying;
        c->slope[j] = joint[j].carrying_slope;
        c->turn[j] = joint[j].turn;
        c->stop[j] = joint[j].stop;
        c->wall[j] = 0.0;
        c->stiffness[j] = fmin(joint[j].stop_stiffness, PHASE * PHASE * joint[j].inertia / square);
        c->cushion[j] = 2.0 * STOP_DAMPING * sqrt(c->stiffness[j] * joint[j].inertia);
    }
}

/* How the motors follow a command over a step, and what of it is missing on average. */
static void set_lags(columns *c, const sc_joint *joint, size_t joints, double dt)
{
    for (size_t j = 0; j < joints; j++) {
        const double lag = joint[j].motor_lag;
        c->follow[j] = lag > 0.0 ? -expm1(-dt / lag) : 1.0;
        c->missing[j] = c->follow[j] * lag / dt;
    }
}

static void take_step(columns *c, size_t joints, double command, double dt)
{
    for (size_t j = 0; j < joints; j++) {
        const double rate = c->rate[j], fine = c->fine[j], slow = c->slow[j];
        const double short_of = c->motor[j] - command;
        const double acting = command + c->missing[j] * short_of;
        c->motor[j] -= c->follow[j] * short_of;
        const double built = fine + c->share[j] * (slow - fine);
        const double level = built > 0.0 ? c->opening[j] : c->closing[j];
        const double over = rate * c->per_rate[j];
        const double deep = c->stop[j] * (c->wall[j] - c->place[j]);
        const double pressed = deep > 0.0 ? c->stop[j] * c->stiffness[j] * deep : 0.0;
        const double torque = acting + c->carrying[j] + c->slope[j] * (c->place[j] - c->turn[j]) -
                              (level + c->rise[j] * decay(over * over)) * built + pressed;
        const double yields = 1.0 - (rate < 0.0 ? -fine : fine);
        const double damping = c->viscous[j] + c->bristle[j] * yields +
                               (deep > 0.0 ? c->cushion[j] : 0.0);
        const double by = dt * c->per_inertia[j];
        const double next = (rate + by * torque) / (1.0 + by * damping);
        const double size = dt * fabs(next), sign = next < 0.0 ? -1.0 : 1.0;
        c->rate[j] = next;
        c->place[j] += 0.5 * dt * (rate + next); /* by dt * next it would be half a step ahead */
        c->fine[j] = sign - (sign - fine) * decay(size * c->per_fine[j]);
        c->slow[j] = sign - (sign - slow) * decay(size * c->per_slow[j]);
    }
}

/* What friction of a joint that something carries has built up before anything is known of it.
 * Blades on a stop have rebounded from it: each small way out and back takes built by
 * -2 * built * way / length, so that their friction bears nothing and the stop all. */
static void hold(columns *c, const sc_joint *joint, size_t joints)
{
    for (size_t j = 0; j < joints; j++) {
        const double carrying = joint[j].carrying;
        const double level = carrying > 0.0 ? joint[j].opening : joint[j].closing;
        const double held = carrying / fmax(level + joint[j].rise, 1e-12);
        const double built = joint[j].stop == 0.0 ? held : 0.0;
        c->fine[j] = c->slow[j] = fmax(-0.999, fmin(0.999, built));
    }
}

/* Puts the stops of joints at rest to where they bear what friction does not. */
static void lay(columns *c, size_t joints)
{
    for (size_t j = 0; j < joints; j++) {
        const double built = c->fine[j] + c->share[j] * (c->slow[j] - c->fine[j]);
        const double level = (built > 0.0 ? c->opening[j] : c->closing[j]) + c->rise[j];
        const double carried = c->carrying[j] + c->slope[j] * (c->place[j] - c->turn[j]);
        const double load = fmax(0.0, c->stop[j] * (level * built - carried));
        c->wall[j] = c->place[j] + c->stop[j] * load / fmax(c->stiffness[j], 1e-9);
    }
}

void sc_joint_follow(const sc_joint *joint, size_t joints, const double *times, const double *rests,
                     size_t count, const double *switches, const double *torques, size_t commands,
                     double step, double *places)
{
    columns c;
    double command = 0.0, known_dt = -1.0;
    size_t next = 0;
    if (count == 0 || joints == 0 || joints > SC_JOINTS)
        return;
    const double longest = longest_step(joint, step);
    double now = times[0];
    set_up(&c, joint, joints, longest);
    for (size_t i = 0; i < count; i++) {
        while (now < times[i]) {
            double until = times[i];
            while (next < commands && switches[next] <= now)
                command = torques[next++];
            if (next < commands && switches[next] < until)
                until = switches[next];
            const double steps = fmax(1.0, ceil((until - now) / longest - 1e-9));
            const double dt = (until - now) / steps;
            if (fabs(dt - known_dt) > 1e-9 * dt) {
                set_lags(&c, joint, joints, dt);
                known_dt = dt;
            }
            for (double done = 0.0; done < steps; done += 1.0)
                take_step(&c, joints, command, dt);
            now = until;
        }
        if (i == 0)
            hold(&c, joint, joints);
        if (i == 0 || isfinite(rests[i])) {
            for (size_t j = 0; j < joints; j++) {
                c.place[j] = isfinite(rests[i]) ? rests[i] : c.place[j];
                c.rate[j] = 0.0;
            }
            lay(&c, joints);
        }
        for (size_t j = 0; j < joints; j++)
            places[j * count + i] = c.place[j];
    }
}
