#include "sc_crack.h"

#include <math.h>
#include <stddef.h>

enum { NEWTON_STEPS = 40, ROOT_STEPS = 60 };

static const double LEAST_DEPTH = 1e-12; /* m: below, an indentation counts as none */
static const double LEAST_SLOPE = 1e-9;  /* tan(psi) up to which no force acts along the cut */
static const double LEAST_RUN = 1e-3;   /* dx/ds from which an edge has a point over a place */
static const double STEP_CLOSE_M = 1e-7;
static const double LEAST_TOOTH_M = 1e-7; /* cracks with shorter teeth run along for the tick */
static const double DEPTH_CLOSE_M = 1e-17;
static const double LOG_CLOSE = 1e-13;
static const double FARTHEST_M = 10.0; /* a place beyond which no crack is followed */
static const double LARGEST_LOG = 60.0;

typedef struct {
    double sine, cosine;
} turned;

typedef struct {
    double station, rise, run, taper, contact, height, slope, lever;
    double depth, power, force, release;
} spot;

static double curve_at(const sc_curve *curve, double x, double *slope)
{
    double u = (x - curve->first) / curve->step;
    int32_t last = curve->size - 1;
    if (!(u > 0.0)) {
        *slope = curve->slope[0];
        return curve->value[0] + *slope * (x - curve->first);
    }
    if (u >= (double)last) {
        *slope = curve->slope[last];
        return curve->value[last] + *slope * (x - curve->first - curve->step * (double)last);
    }
    int32_t low = (int32_t)u;
    double t = u - (double)low, h = curve->step;
    double a = curve->value[low], b = curve->value[low + 1];
    double p = h * curve->slope[low], q = h * curve->slope[low + 1];
    double rise = b - a, c = 3.0 * rise - 2.0 * p - q, d = p + q - 2.0 * rise;
    *slope = (p + t * (2.0 * c + 3.0 * d * t)) / h;
    return a + t * (p + t * (c + t * d));
}

static double toughness(const sc_crack_law *law, double place)
{
    double u = (place - law->tough_first) / law->tough_step;
    int32_t last = law->tough_size - 1;
    if (!(u > 0.0)) return law->tough[0];
    if (u >= (double)last) return law->tough[last];
    int32_t low = (int32_t)u;
    double t = u - (double)low;
    return law->tough[low] + t * (law->tough[low + 1] - law->tough[low]);
}

static turned turn_of(const sc_crack_law *law, double opening)
{
    double beta = opening / law->moving_blades;
    turned t = {sin(beta), cos(beta)};
    return t;
}

/* All about the edge's point at a station. An edge that stands upright touches nothing. */
static void stand_at(const sc_crack_law *law, turned t, double station, spot *at)
{
    double taper, offset = curve_at(&law->edge, station, &taper);
    at->station = station;
    at->taper = taper;
    at->rise = t.sine + taper * t.cosine;
    at->run = t.cosine - taper * t.sine;
    at->contact = station * t.cosine - offset * t.sine;
    at->height = station * t.sine + offset * t.cosine;
    int upright = !(at->run > LEAST_RUN);
    at->slope = upright ? 0.0 : at->rise / at->run;
    at->lever = at->contact + at->height * at->slope;
    at->depth = upright ? 0.0 : law->upper_face - at->height;
    at->power = 1.0;
    at->force = at->release = 0.0;
    if (at->depth > LEAST_DEPTH) {
        double grown = curve_at(&law->response, log(at->depth), &at->power);
        at->force = exp(grown < LARGEST_LOG ? grown : LARGEST_LOG);
        if (at->slope > LEAST_SLOPE) at->release = law->moving_blades * at->force * at->slope;
    }
}

/* The edge's point over a contact, sought from the station that *at has. */
static void stand_over(const sc_crack_law *law, turned t, double contact, spot *at)
{
    double station = at->station;
    for (int32_t i = 0; i < NEWTON_STEPS; i++) {
        double taper, offset = curve_at(&law->edge, station, &taper);
        double step = (contact - station * t.cosine + offset * t.sine) / (t.cosine - taper * t.sine);
        if (!isfinite(step)) break;
        station += step;
        if (fabs(station) > FARTHEST_M) station = copysign(FARTHEST_M, station);
        if (fabs(step) < STEP_CLOSE_M) break; /* Newton: what is left is its square */
    }
    stand_at(law, t, station, at);
}

/* Move out along the edge to where the release has fallen to target; a release that falls by the
 * response's own power needs one step. Bracketed, as the slope changes along a bent edge. */
static void run_out(const sc_crack_law *law, turned t, double target, spot *at)
{
    double low = at->station, high = HUGE_VAL;
    for (int32_t i = 0; i < ROOT_STEPS; i++) {
        double off = target > 0.0 ? log(at->release / target) : HUGE_VAL;
        if (fabs(off) < LOG_CLOSE || !(at->rise > LEAST_SLOPE)) return;
        if (off > 0.0) low = at->station;
        else high = at->station;
        double depth = target > 0.0 ? at->depth * exp(-off / at->power) : 0.0;
        double next = at->station + (at->depth - depth) / at->rise;
        if (!(at->depth > LEAST_DEPTH)) {
            if (!(target > 0.0)) return;
            next = 0.5 * (low + at->station);
        }
        if (!(next > low && next < high)) {
            if (!isfinite(high)) {
                if (!isfinite(next) || next > FARTHEST_M) return;
            } else {
                next = 0.5 * (low + high);
                if (!(next > low && next < high)) return;
            }
        }
        stand_at(law, t, next, at);
    }
}

/* A crack that runs along with the edge: out to where the release equals the toughness there. */
static void settle(const sc_crack_law *law, turned t, double advance, spot *at)
{
    for (int32_t i = 0; i < ROOT_STEPS; i++) {
        double target = toughness(law, at->contact + advance);
        if (!(at->release > target * (1.0 + LOG_CLOSE))) return;
        run_out(law, t, target, at);
    }
}

static double stored(const sc_crack_law *law, const spot *at)
{
    double slope;
    if (!(at->depth > LEAST_DEPTH)) return 0.0;
    double grown = curve_at(&law->energy, log(at->depth), &slope);
    return law->moving_blades * exp(grown < LARGEST_LOG ? grown : LARGEST_LOG);
}

static double torque_of(const sc_crack_law *law, const spot *at, double rate)
{
    double sinking = -at->lever * rate / law->moving_blades;
    double damped = 1.0 + law->damping * sinking;
    double force = at->force * (damped > 0.0 ? damped : 0.0);
    if (law->eq4) return force * at->contact / sqrt(1.0 + at->taper * at->taper);
    return force * at->lever;
}

/* One tick: opening and advance at its start, their change over it. */
typedef struct {
    double opening, by_opening, advance, by_advance, rate;
} tick;

static turned blades_at(const sc_crack_law *law, const tick *k, double s)
{
    return turn_of(law, k->opening + s * k->by_opening);
}

static void look(const sc_crack_law *law, const tick *k, double s, double place, spot *at)
{
    stand_over(law, blades_at(law, k, s), place - (k->advance + s * k->by_advance), at);
}

/* How much deeper the edge sits than where its release would be the limit: nearly linear in time, as
 * a response is nearly a power. Without contact, against the depth `critical` of another place. */
static double beyond(const spot *at, double limit, double critical)
{
    if (!(at->release > 0.0)) return at->depth - critical;
    return at->depth * (1.0 - exp(-log(at->release / limit) / at->power));
}

/* The time after `from`, where *begin stands, at which the release reaches the limit; at the tick's
 * end, *end, it is above. *at gets what is there. Regula falsi, by Illinois. */
static double time_of_start(const sc_crack_law *law, const tick *k, double place, double limit,
                            double from, const spot *begin, const spot *end, spot *at)
{
    double low = from, high = 1.0, above = beyond(end, limit, 0.0);
    const double critical = end->depth - above;
    double below = beyond(begin, limit, critical);
    int32_t side = 0;
    *at = *end;
    for (int32_t i = 0; i < ROOT_STEPS; i++) {
        double s = low + (high - low) * below / (below - above);
        if (!(s > low && s < high)) s = 0.5 * (low + high);
        if (!(s > low && s < high)) return high;
        look(law, k, s, place, at);
        double off = beyond(at, limit, critical);
        if (fabs(off) < DEPTH_CLOSE_M) return s;
        if (off < 0.0) {
            low = s;
            below = off;
            if (side < 0) above *= 0.5;
            side = -1;
        } else {
            high = s;
            above = off;
            if (side > 0) below *= 0.5;
            side = 1;
        }
    }
    return high;
}

/* Simpson's rule over a stretch of a tick. */
static void add(double share, double first, double middle, double last, double *sum)
{
    *sum += share * (first + 4.0 * middle + last) / 6.0;
}

typedef struct {
    double torque, push;
} felt;

static felt felt_at(const sc_crack_law *law, const spot *at, double rate)
{
    felt f = {torque_of(law, at, rate), law->moving_blades * at->force * at->slope};
    return f;
}

static void add_felt(double share, felt first, felt middle, felt last, double *torque, double *push)
{
    add(share, first.torque, middle.torque, last.torque, torque);
    add(share, first.push, middle.push, last.push, push);
}

/* The rest of a tick, from `from` on, over which the crack runs along with the edge if it must. */
static void run_along(const sc_crack_law *law, const tick *k, double from, spot *at, double *torque,
                      double *push, sc_crack_books *books)
{
    felt f[3];
    f[0] = felt_at(law, at, k->rate);
    for (int32_t i = 1; i < 3; i++) {
        double s = from + 0.5 * (double)i * (1.0 - from);
        double advance = k->advance + s * k->by_advance, before = toughness(law, books->place);
        turned t = blades_at(law, k, s);
        stand_over(law, t, books->place - advance, at);
        settle(law, t, advance, at);
        double place = at->contact + advance;
        if (place > books->place) {
            books->lost += 0.5 * (before + toughness(law, place)) * (place - books->place);
            books->place = place;
        }
        f[i] = felt_at(law, at, k->rate);
    }
    add_felt(1.0 - from, f[0], f[1], f[2], torque, push);
}

/* A crack starts at time s: it runs at once to where the release is kappa of the toughness met. */
static void jump(const sc_crack_law *law, const tick *k, double s, spot *at, sc_crack_books *books)
{
    double advance = k->advance + s * k->by_advance, before = stored(law, at);
    run_out(law, blades_at(law, k, s), law->kappa * toughness(law, books->place), at);
    double place = at->contact + advance;
    if (place > books->place) books->place = place;
    books->lost += before - stored(law, at);
    books->jumps++;
}

static void walk_tick(const sc_crack_law *law, const tick *k, spot *at, double *torque, double *push,
                      sc_crack_books *books)
{
    double from = 0.0;
    *torque = *push = 0.0;
    while (from < 1.0) {
        spot begin = *at, end = *at, middle = *at, found = *at;
        look(law, k, 1.0, books->place, &end);
        double limit = HUGE_VAL, to = 1.0;
        if (law->fracture != SC_CRACK_NONE) limit = toughness(law, books->place);
        int starts = end.release > limit;
        if (starts) {
            to = from;
            if (begin.release < limit)
                to = time_of_start(law, k, books->place, limit, from, &begin, &end, &found);
            end = to > from ? found : begin;
        }
        if (to > from && (begin.depth > 0.0 || end.depth > 0.0)) {
            look(law, k, 0.5 * (from + to), books->place, &middle);
            add_felt(to - from, felt_at(law, &begin, k->rate), felt_at(law, &middle, k->rate),
                     felt_at(law, &end, k->rate), torque, push);
        }
        *at = end;
        from = to;
        if (!starts) return;
        double before = books->place;
        if (law->fracture == SC_CRACK_RIPPLED) jump(law, k, from, at, books);
        if (law->fracture == SC_CRACK_SMOOTH || !(books->place - before > LEAST_TOOTH_M)) {
            run_along(law, k, from, at, torque, push, books);
            return;
        }
    }
}

void sc_crack_walk(const sc_crack_law *law, const double *opening, const double *advance,
                   int32_t count, double *torque, double *push, double *place,
                   sc_crack_books *books)
{
    spot at = {0};
    if (count < 1) return;
    at.station = books->place - advance[0];
    stand_over(law, turn_of(law, opening[0]), books->place - advance[0], &at);
    place[0] = books->place;
    for (int32_t i = 0; i + 1 < count; i++) {
        tick k = {opening[i], opening[i + 1] - opening[i], advance[i], advance[i + 1] - advance[i],
                  (opening[i + 1] - opening[i]) / law->tick_s};
        walk_tick(law, &k, &at, &torque[i], &push[i], books);
        place[i + 1] = books->place;
    }
    books->stored = stored(law, &at);
}
