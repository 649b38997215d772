/* A second virtual rig, for judging fits: classical Runge-Kutta steps with located events.
 *
 * Between events everything is smooth: opening and advance with their rates are integrated by
 * the fourth-order Runge-Kutta method, all works by the same quadrature. Dry friction remembers
 * its path (Dahl 1968): its state follows the path exactly, so that no step is too long for it.
 * A step ends where the opening's rate changes its sign, where the crack starts, and where the
 * motor's torque switches, so the length of the steps does not decide any of these. */
#include "rig_internal.h"

#include <math.h>
#include <stddef.h>

static int cracks(const rig *r)
{
    return rig_is_loaded(r) && r->p->fracture > 0.5;
}

/* Share of the dry friction borne after a path of `way`: it approaches the path's direction, its
 * distance from there falling as d' = -d^shape / length. */
static double after_path(double share, double way, double length, double shape)
{
    if (way == 0.0) {
        return share;
    }
    const double toward = way > 0.0 ? 1.0 : -1.0;
    const double far = fabs(way) / length, left = fabs(toward - share);
    if (shape > 1.0) {
        const double root = left > 1e-12 ? pow(left, 1.0 - shape) + (shape - 1.0) * far : INFINITY;
        return toward * (1.0 - pow(root, 1.0 / (1.0 - shape)));
    }
    return far > 40.0 ? toward : toward * (1.0 - left * exp(-far));
}

/* Friction of the opening axis. The part that grows with the load has no factor of the angle, and
 * a pivot without friction (load_share = 0) has none of it. */
static double dry_friction(const rig_parameters *p, double th, double w, double u, double load)
{
    const double away = th - p->angle_center;
    const double factor = 1.0 + away * (p->angle_slope + away * p->angle_curvature);
    const double speed = w / p->stribeck_rate, square = speed * speed;
    const double rise = p->stribeck > 0.0 && square < 40.0 ? p->stribeck * exp(-square) : 0.0;
    const double level = (u > 0.0 ? p->coulomb_pos : p->coulomb_neg) + rise;
    const double viscous = (w > 0.0 ? p->viscous_pos : p->viscous_neg) * w;
    return factor * (u * level + viscous) + u * p->load_share * fabs(load);
}

static void hand_forces(const rig *r, double into, const state *y, double *handle, double *push)
{
    const rig_parameters *p = r->p;
    const rig_inputs *in = r->in;
    const int64_t k = r->tick, next = k + 1 < in->ticks ? k + 1 : k;
    const double share = into / p->tick_s;
#define BETWEEN(a) ((a)[k] + share * ((a)[next] - (a)[k]))
    const double force = (p->hand_stiffness * (y->th - BETWEEN(in->opening)) +
                          p->hand_damping * (y->w - BETWEEN(in->rate))) / p->radius;
    *handle = rig_clip(force + BETWEEN(in->tremor), -p->hand_strength, p->hand_strength);
    *push = rig_clip(p->hand_push * (BETWEEN(in->advance) - y->x) +
                 p->hand_drag * (BETWEEN(in->advance_rate) - y->v), -p->hand_reach, p->hand_reach);
#undef BETWEEN
}

/* Accelerations and powers at one stage of a step that began at y0; y has the stage's motion. */
void rig_stage(rig *r, const state *y0, state *y, double into, double accelerations[2],
                  double power[WORKS])
{
    const rig_parameters *p = r->p;
    double cut = 0.0, along = 0.0, damped = 0.0, damped_along = 0.0, handle = 0.0, push = 0.0, energy;
    y->u = after_path(y0->u, y->th - y0->th, p->presliding, p->presliding_shape);
    y->ux = after_path(y0->ux, y->x - y0->x, p->sledge_presliding, 1.0);
    y->crack = y0->crack;
    r->indentation = 0.0;
    if (rig_is_loaded(r)) {
        if (p->fracture > 0.5 && p->kappa >= 1.0) {
            y->crack = rig_stop_of_run(r, y->th, y->x, y0->crack, 1.0);
        }
        const touch where = rig_touch_at(r, y->th, y->crack - y->x);
        r->indentation = where.delta;
        if (where.delta > 0.0) {
            const double force = rig_response(p, where.delta, &energy);
            const double deepening = where.slope * y->v - where.lever * y->w / p->moving;
            const double share = fmax(p->damping * deepening, -1.0) * force;
            cut = force * where.lever;
            along = -p->moving * force * where.slope;
            damped = share * where.lever;
            damped_along = -p->moving * share * where.slope;
        }
    }
    if (r->mode == RIG_HAND) {
        hand_forces(r, into, y, &handle, &push);
    }
    const double friction = dry_friction(p, y->th, y->w, y->u, cut + damped);
    const double drag = y->ux * p->sledge_coulomb + p->sledge_viscous * y->v;
    const double cogging =
        p->cogging != 0.0 ? p->cogging * sin(p->cogging_periods * y->th + p->cogging_phase) : 0.0;
    const double grip = -p->radius * handle;
    accelerations[0] =
        (y->torque + cogging + grip - p->offset + cut + damped - friction) / p->inertia;
    accelerations[1] = (y->thrust + push + along + damped_along - drag) / p->mass;
    power[MOTOR] = y->torque * y->w;
    power[SLEDGE_MOTOR] = y->thrust * y->v;
    power[COGGING] = cogging * y->w;
    power[OFFSET] = -p->offset * y->w;
    power[HAND] = grip * y->w;
    power[SLEDGE_HAND] = push * y->v;
    power[FRICTION] = friction * y->w;
    power[SLEDGE_FRICTION] = drag * y->v;
    power[CUT] = cut * y->w;
    power[SLEDGE_CUT] = along * y->v;
    power[DAMPING] = -(damped * y->w + damped_along * y->v);
    r->cut_torque = cut + damped;
    r->friction_torque = friction;
    r->handle_force = handle;
}

/* Share of the last torque that a motor with a first-order lag still has after a time. */
static double lag_keeps(double lag_s, double seconds)
{
    return lag_s > 0.0 ? exp(-seconds / lag_s) : 0.0;
}

/* One classical Runge-Kutta step without any event in it. */
static state step_of(rig *r, const state *y0, double dt)
{
    static const double reach[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    double a[2] = {0.0, 0.0}, power[WORKS], sum_v[2] = {0.0, 0.0}, sum_a[2] = {0.0, 0.0};
    double rates[2] = {0.0, 0.0};
    const double half = lag_keeps(r->p->lag_s, 0.5 * dt);
    state y = *y0, end = *y0;
    for (int i = 0; i < 4; i++) {
        const double h = reach[i] * dt;
        const double keep = i == 0 ? 1.0 : i == 3 ? half * half : half;
        y.th = y0->th + h * rates[0];
        y.x = y0->x + h * rates[1];
        y.w = y0->w + h * a[0];
        y.v = y0->v + h * a[1];
        y.torque = r->torque_target + keep * (y0->torque - r->torque_target);
        y.thrust = r->thrust_target + keep * (y0->thrust - r->thrust_target);
        rig_stage(r, y0, &y, r->into_tick + h, a, power);
        rates[0] = y.w;
        rates[1] = y.v;
        for (int j = 0; j < 2; j++) {
            sum_v[j] += weight[i] * rates[j] / 6.0;
            sum_a[j] += weight[i] * a[j] / 6.0;
        }
        for (int j = 0; j < WORKS; j++) {
            end.work[j] += dt * weight[i] / 6.0 * power[j];
        }
    }
    end.th += dt * sum_v[0];
    end.x += dt * sum_v[1];
    end.w += dt * sum_a[0];
    end.v += dt * sum_a[1];
    end.torque = y.torque;
    end.thrust = y.thrust;
    end.u = after_path(y0->u, end.th - y0->th, r->p->presliding, r->p->presliding_shape);
    end.ux = after_path(y0->ux, end.x - y0->x, r->p->sledge_presliding, 1.0);
    if (cracks(r) && r->p->kappa >= 1.0) {
        end.crack = rig_stop_of_run(r, end.th, end.x, y0->crack, 1.0);
    }
    return end;
}

/* Drive over toughness at the end of a step whose crack stood still: positive where it starts. */
static double start_of_run(rig *r, const state *y)
{
    return rig_excess_at(r, y->th, y->x, y->crack, 1.0);
}

static double event_value(rig *r, const state *y, int of_crack)
{
    return of_crack ? start_of_run(r, y) : y->w;
}

/* Find the length of the step after y0 at whose end an event's value is zero, by the Illinois
 * rule between 0 and dt; `y` is the state at dt and becomes the state there, just past it. */
static double locate(rig *r, const state *y0, double dt, int of_crack, state *y)
{
    double low = 0.0, high = dt;
    double at_low = event_value(r, y0, of_crack), at_high = event_value(r, y, of_crack);
    const double enough = of_crack ? 1e-10 : 1e-12;
    for (int turn = 0; turn < 60 && high - low > 1e-13 && fabs(at_high) > enough; turn++) {
        double middle = low + (high - low) * at_low / (at_low - at_high);
        if (!(middle > low && middle < high)) {
            middle = 0.5 * (low + high);
        }
        const state tried = step_of(r, y0, middle);
        const double at_middle = event_value(r, &tried, of_crack);
        if ((at_middle > 0.0) == (event_value(r, y, of_crack) > 0.0)) {
            high = middle;
            at_high = at_middle;
            at_low *= 0.5;
            *y = tried;
        } else {
            low = middle;
            at_low = at_middle;
            at_high *= 0.5;
        }
    }
    return high;
}

/* Let a crack that has started run to its stop, and book what that takes. */
static int run_crack(rig *r, state *y)
{
    double before, after;
    const double stored = rig_stored_in(r, y), start = y->crack;
    const double cost = rig_toughness_at(r, start, &before);
    const double stop = rig_stop_of_run(r, y->th, y->x, start, r->p->kappa);
    y->crack = stop;
    if (stop >= r->p->sheet_length) {
        y->crack = r->p->sheet_length;
    }
    const touch where = rig_touch_at(r, y->th, y->crack - y->x);
    (void)rig_toughness_at(r, y->crack, &after);
    const double drive_after = rig_drive_of(r, &where);
    r->severed = y->crack >= r->p->sheet_length;
    const double took = r->p->kappa * (after - before);
    r->fracture += took;
    r->arrest += stored - rig_stored_in(r, y) - took;
    if (r->jump_count < r->jump_room) {
        const rig_jump jump = {r->time, y->th, y->x, start, y->crack, cost, drive_after,
                               (double)r->sheet};
        r->jumps[r->jump_count] = jump;
    }
    r->jump_count++;
    return r->jump_count <= r->jump_room;
}

/* A smooth crack has moved within a step: its surface is paid for at the whole toughness. */
static void book_smooth(rig *r, const state *y0, const state *y)
{
    double before, after;
    (void)rig_toughness_at(r, y0->crack, &before);
    (void)rig_toughness_at(r, y->crack, &after);
    r->fracture += after - before;
    if (y->crack >= r->p->sheet_length) {
        r->arrest += rig_stored_in(r, y);
        r->severed = 1;
    }
}

/* Move on for a time in which no torque switches. Returns 0 where events do not end. */
int rig_advance(rig *r, state *y, double seconds)
{
    const double from = r->into_tick;
    const int steps = (int)ceil(seconds / r->p->step_s - 1e-9);
    double done = 0.0;
    int rippled = cracks(r) && r->p->kappa < 1.0;
    for (int i = 0, events = 0; i < steps;) {
        double dt = seconds * (double)(i + 1) / (double)steps - done;
        r->into_tick = from + done;
        state next = step_of(r, y, dt);
        int ended = 1, started = 0;
        if (y->w * next.w < 0.0 && fabs(y->w) > 1e-9) {
            dt = locate(r, y, dt, 0, &next);
            ended = 0;
        }
        if (rippled && start_of_run(r, &next) > 0.0) {
            if (start_of_run(r, y) <= 0.0) {
                dt = locate(r, y, dt, 1, &next);
            }
            started = 1;
            ended = 0;
        }
        done += dt;
        r->time += dt;
        if (cracks(r) && !rippled) {
            book_smooth(r, y, &next);
        }
        *y = next;
        if (started && !run_crack(r, y)) {
            return 0;
        }
        rippled = rippled && !r->severed;
        if (ended || seconds * (double)(i + 1) / (double)steps - done < 1e-12) {
            i++;
        }
        if (!ended && ++events > EVENTS_PER_TICK) {
            return 0;
        }
    }
    r->into_tick = from + seconds;
    return 1;
}
