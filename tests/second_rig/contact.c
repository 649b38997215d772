/* Blades on a sheet: geometry, response, toughness, and where a running crack stops. */
#include "rig_internal.h"

#include <math.h>
#include <stddef.h>

double rig_clip(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

/* The moving edge over a contact: Newton's method for the station, from where it was last. */
touch rig_touch_at(rig *r, double opening, double contact)
{
    const rig_parameters *p = r->p;
    const double beta = p->moving > 1.5 ? 0.5 * opening : opening;
    if (beta != r->beta) {
        r->beta = beta;
        r->sine = sin(beta);
        r->cosine = cos(beta);
    }
    const double sine = r->sine, cosine = r->cosine;
    const double last = p->edge_length + 2.0 * p->tip_radius;
    touch none = {-1.0, 0.0, 0.0}, found;
    double s = r->station, e = 0.0, slope = 0.0;
    for (int turn = 0; turn < 40; turn++) {
        e = p->edge_offset + s * (p->edge_slope + s * (0.5 * p->edge_curvature + s * p->edge_cubic));
        slope = p->edge_slope + s * (p->edge_curvature + 3.0 * s * p->edge_cubic);
        if (s > p->edge_length) { /* a tip is rounded: the edge turns away from the sheet */
            const double beyond = (s - p->edge_length) / p->tip_radius;
            e += 0.5 * p->tip_radius * beyond * beyond;
            slope += beyond;
        }
        const double grade = cosine - slope * sine;
        if (!(grade > 0.05)) {
            return none;
        }
        const double step = (contact - (s * cosine - e * sine)) / grade;
        if (fabs(step) < 1e-13) {
            break;
        }
        s = rig_clip(s + step, -0.05, last);
        if (s >= last && step > 0.0 && turn > 20) {
            return none;
        }
    }
    if (s >= last || s <= 0.0) {
        r->station = 0.5 * p->edge_length;
        return none;
    }
    r->station = s;
    const double height = s * sine + e * cosine;
    found.slope = (sine + slope * cosine) / (cosine - slope * sine);
    found.delta = p->upper_face - height;
    found.lever = contact + height * found.slope;
    return found;
}

/* Force (N) of one edge at an indentation, and the energy (J) that it has stored. */
double rig_response(const rig_parameters *p, double delta, double *energy)
{
    if (delta <= 0.0) {
        *energy = 0.0;
        return 0.0;
    }
    const double ratio = delta / p->reference;
    if (p->law < 0.5) {
        const double force = p->force * pow(ratio, p->exponent);
        *energy = force * delta / (p->exponent + 1.0);
        return force;
    }
    if (p->law < 1.5) {
        const double scale = p->force / expm1(p->exponent), grown = expm1(p->exponent * ratio);
        *energy = scale * (p->reference * grown / p->exponent - delta);
        return scale * grown;
    }
    const double beyond = delta > p->knee ? delta - p->knee : 0.0;
    const double at_reference =
        p->reference + (p->reference > p->knee ? (p->knee_ratio - 1.0) * (p->reference - p->knee) : 0.0);
    const double stiffness = p->force / at_reference, more = (p->knee_ratio - 1.0) * beyond;
    *energy = 0.5 * stiffness * (delta * delta + more * beyond);
    return stiffness * (delta + more);
}

/* Between grid points the toughness is linear in the place, so its integral is exact. */
double rig_toughness_at(const rig *r, double place, double *integral)
{
    const double at = rig_clip(place / r->p->grid_step, 0.0, (double)(r->in->grid - 1));
    int64_t cell = (int64_t)at;
    cell = cell > r->in->grid - 2 ? r->in->grid - 2 : cell;
    const double share = at - (double)cell;
    const double low = r->toughness[cell], rise = r->toughness[cell + 1] - low;
    if (integral) {
        *integral = r->integral[cell] + r->p->grid_step * share * (low + 0.5 * share * rise);
    }
    return low + share * rise;
}

double rig_drive_of(const rig *r, const touch *where)
{
    double energy;
    return where->delta > 0.0 ? r->p->moving * rig_response(r->p, where->delta, &energy) * where->slope
                              : 0.0;
}

/* Drive less `kappa` times the toughness with the crack at a place, the blades standing still. */
double rig_excess_at(rig *r, double th, double x, double place, double kappa)
{
    const touch where = rig_touch_at(r, th, place - x);
    return rig_drive_of(r, &where) - kappa * rig_toughness_at(r, place, NULL);
}

/* The place between `low` and `high` at which the drive is spent: secants within a bracket. */
static double spent_between(rig *r, double th, double x, double kappa, double low, double at_low,
                            double high, double at_high)
{
    double last = high, at_last = at_high, now = low, at_now = at_low;
    for (int turn = 0; turn < 80 && high - low > 1e-15; turn++) {
        double next = now - at_now * (last - now) / (at_last - at_now);
        if (!(next > low && next < high)) {
            next = 0.5 * (low + high);
        }
        last = now;
        at_last = at_now;
        now = next;
        at_now = rig_excess_at(r, th, x, now, kappa);
        if (fabs(at_now) < 1e-11) {
            return now;
        }
        if (at_now > 0.0) {
            low = now;
        } else {
            high = now;
        }
    }
    return high;
}

/* Where a crack that runs from `from` stops: the first place at which the drive is spent. */
double rig_stop_of_run(rig *r, double th, double x, double from, double kappa)
{
    const double grid = r->p->grid_step, end = r->p->sheet_length;
    double low = from, at_low = rig_excess_at(r, th, x, from, kappa);
    if (at_low <= 0.0) {
        return from;
    }
    for (int64_t node = (int64_t)(from / grid) + 1;; node++) {
        double high = (double)node * grid;
        if (high >= end) {
            return end;
        }
        double at_high = rig_excess_at(r, th, x, high, kappa);
        if (at_high > 0.0) {
            low = high;
            at_low = at_high;
            continue;
        }
        return spent_between(r, th, x, kappa, low, at_low, high, at_high);
    }
}

int rig_is_loaded(const rig *r)
{
    return r->toughness != NULL && !r->severed;
}

double rig_stored_in(rig *r, const state *y)
{
    double energy = 0.0;
    if (rig_is_loaded(r)) {
        const touch where = rig_touch_at(r, y->th, y->crack - y->x);
        (void)rig_response(r->p, where.delta, &energy);
    }
    return r->p->moving * energy;
}
