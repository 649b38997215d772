/* A day of the second virtual rig, tick by tick: sensors, servo, motors, sheets and the books.
 *
 * The servo is a cascade: a proportional law asks for a rate, a proportional-integral law on an
 * observer's rate asks for a torque, and the reference's own motion is fed forward. Commands are
 * held from tick to tick and reach the motor late, by a delay and a first-order lag. */
#include "rig_internal.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Tracking observer with two equal poles: place and rate from the encoder's counts. */
static void observe(double measured, double tick_s, double cutoff_hz, double *place, double *rate)
{
    const double pole = exp(-2.0 * 3.14159265358979323846 * cutoff_hz * tick_s);
    const double expected = *place + tick_s * *rate, error = measured - expected;
    *place = expected + (1.0 - pole * pole) * error;
    *rate += (1.0 - pole) * (1.0 - pole) / tick_s * error;
}

static double counted(double value, double step)
{
    return step > 0.0 ? step * floor(value / step + 0.5) : value;
}

/* Commands for the tick that begins: cascade with feed-forward on the blades, PID on the sledge. */
static void command(const rig *r, servo *s, int64_t k, double opening, double advance)
{
    const rig_parameters *p = r->p;
    const rig_inputs *in = r->in;
    const int64_t next = k + 1 < in->ticks ? k + 1 : k;
    if (!s->awake) {
        s->place_estimate = opening;
        s->sledge_place = advance;
        s->awake = 1;
    }
    observe(opening, p->tick_s, p->observer_hz, &s->place_estimate, &s->rate_estimate);
    observe(advance, p->tick_s, p->sledge_observer_hz, &s->sledge_place, &s->sledge_rate);
    memmove(s->torques + 1, s->torques, (LATEST_TICKS - 1) * sizeof(double));
    memmove(s->forces + 1, s->forces, (LATEST_TICKS - 1) * sizeof(double));
    s->torques[0] = s->forces[0] = 0.0;
    if (r->mode != RIG_SERVO) {
        s->integral = s->sledge_integral = 0.0;
        if (r->mode == RIG_BRAKE) {
            s->torques[0] = rig_clip(-p->brake * s->rate_estimate, -p->torque_limit, p->torque_limit);
        }
        return;
    }
    const double rate = in->rate[k], change = (in->rate[next] - rate) / p->tick_s;
    const double wanted = rate + p->position_gain * (in->opening[k] - opening);
    const double error = wanted - s->rate_estimate;
    const double ahead = p->feed_inertia * change + p->feed_viscous * rate +
                         p->feed_coulomb * tanh(rate / 0.02);
    s->integral = rig_clip(s->integral + p->integral_gain * p->tick_s * error, -p->torque_limit,
                           p->torque_limit);
    s->torques[0] = rig_clip(ahead + p->rate_gain * error + s->integral, -p->torque_limit,
                             p->torque_limit);
    const double sledge_error = in->advance[k] - advance;
    const double sledge_rate = (in->advance[next] - in->advance[k]) / p->tick_s;
    s->sledge_integral = rig_clip(s->sledge_integral + p->sledge_ki * p->tick_s * sledge_error,
                                  -p->force_limit, p->force_limit);
    s->forces[0] = rig_clip(p->sledge_kp * sledge_error +
                            p->sledge_kd * (sledge_rate - s->sledge_rate) + s->sledge_integral,
                            -p->force_limit, p->force_limit);
}

/* Give the motors a new target; a motor without lag has it at once. */
static void retarget(rig *r, state *y, const servo *s, int late)
{
    r->torque_target = s->torques[late];
    r->thrust_target = s->forces[late];
    if (!(r->p->lag_s > 0.0)) {
        y->torque = r->torque_target;
        y->thrust = r->thrust_target;
    }
}

/* One tick: the command on its way reaches the motors part of the way through. */
static int pass_tick(rig *r, state *y, const servo *s)
{
    const double whole = floor(r->p->delay_ticks), part = r->p->delay_ticks - whole;
    const int late = (int)whole;
    r->into_tick = 0.0;
    if (part > 0.0) {
        retarget(r, y, s, late + 1);
        if (!rig_advance(r, y, part * r->p->tick_s)) {
            return 0;
        }
    }
    retarget(r, y, s, late);
    return rig_advance(r, y, (1.0 - part) * r->p->tick_s);
}

/* Take the old sheet out, with what it stores, and put a new one in. Returns 0 where the blades
 * are in its way. */
static int change_sheet(rig *r, state *y, int64_t sheet)
{
    r->arrest += rig_stored_in(r, y);
    r->sheet = sheet;
    r->severed = 0;
    r->toughness = sheet < 0 ? NULL : r->in->toughness + sheet * r->in->grid;
    r->integral = sheet < 0 ? NULL : r->in->toughness_integral + sheet * r->in->grid;
    y->crack = 0.0;
    return sheet < 0 || rig_touch_at(r, y->th, -y->x).delta <= 0.0;
}

static void book(rig *r, const state *y, const servo *s, rig_row *row)
{
    const rig_parameters *p = r->p;
    double accelerations[2], power[WORKS];
    state now = *y;
    rig_stage(r, y, &now, 0.0, accelerations, power);
    const rig_row filled = {
        .opening = y->th, .rate = y->w, .advance = y->x, .advance_rate = y->v,
        .crack = r->toughness ? y->crack : NAN,
        .motor_torque = y->torque, .sledge_force = y->thrust, .handle_force = r->handle_force,
        .cut_torque = r->cut_torque, .friction_torque = r->friction_torque,
        .indentation = r->indentation,
        .measured_opening = counted(y->th, p->opening_step),
        .measured_advance = counted(y->x, p->advance_step),
        .torque_command = s->torques[0], .force_command = s->forces[0],
        .kinetic = 0.5 * (p->inertia * y->w * y->w + p->mass * y->v * y->v),
        .stored = rig_stored_in(r, y), .fracture = r->fracture, .arrest = r->arrest,
        .motor_work = y->work[MOTOR], .sledge_motor_work = y->work[SLEDGE_MOTOR],
        .cogging_work = y->work[COGGING], .offset_work = y->work[OFFSET],
        .hand_work = y->work[HAND], .sledge_hand_work = y->work[SLEDGE_HAND],
        .friction_work = y->work[FRICTION], .sledge_friction_work = y->work[SLEDGE_FRICTION],
        .cut_work = y->work[CUT], .sledge_cut_work = y->work[SLEDGE_CUT],
        .damping_work = y->work[DAMPING],
    };
    *row = filled;
}

/* Run all ticks. Returns 0, or 1 for a sheet that is in the blades' way, 2 for events without
 * end (or more runs of the crack than there is room for), 3 for a motion that is not finite. */
int rig_run(const rig_parameters *p, const rig_inputs *in, rig_row *rows, rig_jump *jumps,
            int64_t jump_room, int64_t *jump_count)
{
    rig r;
    state y;
    servo s;
    memset(&r, 0, sizeof r);
    memset(&y, 0, sizeof y);
    memset(&s, 0, sizeof s);
    r.p = p;
    r.in = in;
    r.sheet = -1;
    r.beta = NAN;
    r.station = 0.5 * p->edge_length;
    r.jumps = jumps;
    r.jump_room = jump_room;
    y.th = in->start_opening;
    y.x = in->start_advance;
    for (int64_t k = 0; k < in->ticks; k++) {
        r.tick = k;
        r.time = (double)k * p->tick_s;
        r.mode = in->mode[k];
        if (in->sheet[k] != r.sheet && !change_sheet(&r, &y, in->sheet[k])) {
            return 1;
        }
        command(&r, &s, k, counted(y.th, p->opening_step), counted(y.x, p->advance_step));
        r.into_tick = 0.0;
        book(&r, &y, &s, &rows[k]);
        if (!pass_tick(&r, &y, &s)) {
            *jump_count = r.jump_count;
            return 2;
        }
        if (!isfinite(y.th) || !isfinite(y.x)) {
            return 3;
        }
    }
    *jump_count = r.jump_count;
    return 0;
}

/* Number of doubles in what Python hands over, so that it can tell a stale layout. */
double rig_sizes(int which)
{
    return (double)(which == 0 ? sizeof(rig_parameters) : which == 1 ? sizeof(rig_row)
                    : which == 2 ? sizeof(rig_jump) : sizeof(rig_inputs)) / (double)sizeof(double);
}
