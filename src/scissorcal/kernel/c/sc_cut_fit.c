#include "sc_cut_fit.h"

#include <math.h>
#include <stddef.h>

static const double TINY = 1e-300;
static const double LEAST_SLOPE = 1e-6;
/* Longest step of a crack's place towards its highest density. */
static const double REST_REACH_M = 3e-5;
/* A step below this is not taken: what it would gain is added, by the parabola that it comes from. */
static const double REST_ARRIVED_M = 1e-7;

void sc_cut_cycle(const sc_cut_parameters *parameters, double moving_blades, double slope,
                  double *start_depth, double *stop_depth, double *mean_share)
{
    const sc_response_table *table = &parameters->response;
    double tangent = slope > LEAST_SLOPE ? slope : LEAST_SLOPE;
    double log_peak = log(parameters->energy / (moving_blades * tangent));
    double log_start = sc_response_log_depth(table, log_peak);
    *start_depth = exp(log_start);
    if (parameters->fracture != SC_CUT_RIPPLED) {
        *stop_depth = *start_depth;
        *mean_share = 1.0;
        return;
    }
    double log_stop = sc_response_log_depth(table, log_peak + log(parameters->kappa));
    *stop_depth = exp(log_stop);
    double travel = *start_depth - *stop_depth;
    if (travel < 1e-9 * *start_depth) {
        *mean_share = 0.5 * (1.0 + parameters->kappa);
        return;
    }
    double slope_there;
    double gained = exp(sc_response_log_energy(table, log_start, &slope_there)) -
                    exp(sc_response_log_energy(table, log_stop, &slope_there));
    *mean_share = gained / travel / exp(log_peak);
}

static double departure(const double *gradient, const double *edge, int32_t count)
{
    double sum = 0.0;
    for (int32_t i = 0; i < count; i++) sum += gradient[i] * edge[i];
    return sum;
}

static double damped(double damping, double sinking)
{
    double factor = 1.0 + damping * sinking;
    return factor > 0.0 ? factor : 0.0;
}

/* Mean torque (N m) of the response over a segment, and its derivative by the crack's place, with the
 * crack `moved` from where the geometry was expanded. */
static double elastic_torque(const sc_cut_data *data, const sc_cut_parameters *p, int32_t segment,
                             double moved, double *by_place)
{
    double depth[SC_CUT_ENDS];
    int32_t q = data->edge_count, first = segment * SC_CUT_ENDS;
    for (int32_t i = 0; i < SC_CUT_ENDS; i++)
        depth[i] = data->depth[first + i] + data->depth_dx[first + i] * moved +
                   departure(data->depth_de + (ptrdiff_t)(first + i) * q, p->edge, q);
    double lever = data->lever[segment] + data->lever_dx[segment] * moved +
                   departure(data->lever_de + (ptrdiff_t)segment * q, p->edge, q);
    double slope;
    double force = sc_response_mean_force(&p->response, depth[0], depth[1], data->depth_dx[first],
                                          data->depth_dx[first + 1], &slope);
    double factor = damped(p->damping, data->sinking[segment]);
    *by_place = factor * (slope * lever + force * data->lever_dx[segment]);
    return factor * force * lever;
}

/* A crack at rest: where it is expected, and what its pieces say of a place. */
typedef struct {
    int32_t index;
    int held;
    double centre, spread;
} rest_belief;

typedef struct {
    double cost, pull, curvature;
} rest_sums;

/* Whitened residuals z of the pieces at one rest if its crack stands at `place`, with the sums that
 * a Gauss-Newton step needs: half their squares, and the first two derivatives by the place. */
static rest_sums rest_pass(const sc_cut_data *data, const sc_cut_parameters *p,
                           const rest_belief *rest, double place, double *residuals, double *z,
                           double *zx)
{
    double scale = 1.0 / p->noise_scale, moved = place - data->rest_place[rest->index];
    rest_sums sums = {0.0, 0.0, 0.0};
    for (int32_t i = 0; i < data->pieces; i++) {
        if (data->piece_rest[i] != rest->index) continue;
        int32_t low = data->piece_first[i], high = data->piece_first[i + 1];
        double offset = data->piece_closing[i] ? p->offset_closing : p->offset_opening;
        const double *row = data->whitener + data->white_first[i];
        for (int32_t k = low; k < high; k++) {
            double slope, torque = elastic_torque(data, p, k, moved, &slope);
            double gain = 1.0 - p->load * data->direction[k];
            residuals[k] = data->torque[k] - p->delay * data->late[k] - gain * torque - offset;
            zx[k] = -gain * slope;
        }
        for (int32_t k = low; k < high; k++, row += k - low) {
            double value = 0.0, by_place = 0.0;
            for (int32_t j = low; j <= k; j++) {
                value += row[j - low] * residuals[j];
                by_place += row[j - low] * zx[j];
            }
            z[k] = scale * value;
            by_place *= scale;
            sums.cost += 0.5 * z[k] * z[k];
            sums.curvature += by_place * by_place;
            sums.pull += by_place * z[k];
        }
    }
    if (rest->held) return sums;
    double weight = 1.0 / (rest->spread * rest->spread), away = place - rest->centre;
    sums.cost += 0.5 * weight * away * away;
    sums.curvature += weight;
    sums.pull += weight * away;
    return sums;
}

/* The place of highest density by Gauss-Newton steps, shortened until they climb; `sums` are those
 * there, and a last step below REST_ARRIVED_M is counted by the parabola that it comes from. */
static double settle(const sc_cut_data *data, const sc_cut_parameters *p, const rest_belief *rest,
                     double place, double *residuals, double *z, double *zx, rest_sums *sums)
{
    *sums = rest_pass(data, p, rest, place, residuals, z, zx);
    for (int32_t step = 0; step < SC_CUT_REST_STEPS && !rest->held; step++) {
        double move = -sums->pull / sums->curvature;
        if (fabs(move) < REST_ARRIVED_M) {
            sums->cost += 0.5 * move * sums->pull;
            break;
        }
        if (move > REST_REACH_M) move = REST_REACH_M;
        if (move < -REST_REACH_M) move = -REST_REACH_M;
        rest_sums next = rest_pass(data, p, rest, place + move, residuals, z, zx);
        while (!(next.cost <= sums->cost) && fabs(move) >= REST_ARRIVED_M) {
            move *= 0.25;
            next = rest_pass(data, p, rest, place + move, residuals, z, zx);
        }
        if (!(next.cost <= sums->cost)) {
            *sums = rest_pass(data, p, rest, place, residuals, z, zx);
            break;
        }
        place += move;
        *sums = next;
    }
    return place;
}

static rest_belief belief_of(const sc_cut_data *data, const sc_cut_parameters *p, int32_t r)
{
    rest_belief rest = {r, 0, 0.0, data->known_sd};
    if (data->rest_known[r]) {
        rest.held = data->known_sd <= 0.0;
        return rest;
    }
    double start, stop, share, power, tangent = data->rest_slope[r];
    sc_cut_cycle(p, data->moving_blades, tangent, &start, &stop, &share);
    double cycle = (start - stop) / tangent, depth = stop + p->rest_phase * (start - stop);
    sc_response_log_force(&p->response, log(start), &power);
    double uneven = p->variation * start / (power * tangent);
    const double *de = data->rest_de + (ptrdiff_t)r * data->edge_count;
    rest.centre = data->rest_at_reference[r] - (depth - data->reference_depth) / tangent +
                  departure(de, p->edge, data->edge_count);
    rest.spread = sqrt(p->rest_spread * p->rest_spread * cycle * cycle + uneven * uneven + 4e-12);
    return rest;
}

static double elastic(const sc_cut_data *data, const sc_cut_parameters *p, double *terms,
                      double *residuals, double *scaled, double *places, double *work)
{
    int32_t count = data->piece_first[data->pieces];
    double *z = work, *zx = work + count, log_scale = log(p->noise_scale), sum = 0.0;
    for (int32_t r = 0; r < data->rests; r++) {
        rest_belief rest = belief_of(data, p, r);
        rest_sums sums;
        places[r] = settle(data, p, &rest, data->rest_known[r] ? 0.0 : data->rest_place[r],
                           residuals, z, zx, &sums);
        /* What a rest's place adds goes to the first segment of its first piece. */
        double squares = 0.0, *first = NULL;
        for (int32_t i = 0; i < data->pieces; i++) {
            if (data->piece_rest[i] != r) continue;
            int32_t low = data->piece_first[i];
            const double *row = data->whitener + data->white_first[i];
            if (!first) first = &terms[low];
            for (int32_t k = low; k < data->piece_first[i + 1]; k++, row += k - low) {
                terms[k] = -0.5 * z[k] * z[k] + log(row[k - low]) - log_scale;
                squares += 0.5 * z[k] * z[k];
                if (scaled) scaled[k] = z[k];
                sum += terms[k];
            }
        }
        if (!first || rest.held) continue;
        double added = squares - sums.cost - log(rest.spread) - 0.5 * log(sums.curvature);
        *first += added;
        sum += added;
    }
    return sum;
}

/* Means and covariances of unevenness (0), the sheet's share (1) and the work's error at the place
 * where the next segment starts (2). */
typedef struct {
    double mean[3];
    double var[3];
    double cov01, cov02, cov12;
} filter;

static void decay(filter *f, double keep)
{
    f->mean[0] *= keep;
    f->cov01 *= keep;
    f->cov02 *= keep;
    f->var[0] = keep * keep * f->var[0] + (1.0 - keep * keep);
}

static void forget_work(filter *f, double variance)
{
    f->mean[2] = f->cov02 = f->cov12 = 0.0;
    f->var[2] = variance;
}

/* Update by a residual = torque * (variation * unevenness + sheet) + (end - start) / step + noise.
 * The work's error at the end has variance `end` and is independent of all before; afterwards it is
 * that of the next segment's start. */
static double observe(filter *f, double variation, double torque, double step, double end,
                      double noise, double residual, double *standard)
{
    double each = 1.0 / step, by_uneven = variation * torque;
    double gain0 = f->var[0] * by_uneven + f->cov01 * torque - f->cov02 * each;
    double gain1 = f->cov01 * by_uneven + f->var[1] * torque - f->cov12 * each;
    double gain2 = f->cov02 * by_uneven + f->cov12 * torque - f->var[2] * each;
    double gain3 = end * each;
    double variance = noise + by_uneven * gain0 + torque * gain1 - each * gain2 + each * gain3;
    double innovation =
        residual - by_uneven * f->mean[0] - torque * f->mean[1] + each * f->mean[2];
    double inverse = 1.0 / variance, weight = innovation * inverse;
    f->mean[0] += gain0 * weight;
    f->mean[1] += gain1 * weight;
    f->mean[2] = gain3 * weight;
    f->var[0] -= gain0 * gain0 * inverse;
    f->var[1] -= gain1 * gain1 * inverse;
    f->cov01 -= gain0 * gain1 * inverse;
    f->var[2] = end - gain3 * gain3 * inverse;
    f->cov02 = -gain0 * gain3 * inverse;
    f->cov12 = -gain1 * gain3 * inverse;
    *standard = innovation * sqrt(inverse);
    return -0.5 * innovation * weight - 0.5 * log(variance);
}

/* What a cycle is at slopes between two, by cubic interpolation in the slope. */
enum { CYCLE_KNOTS = 21 };

typedef struct {
    double start, stop, share, power;
} cycle;

typedef struct {
    double first, per_step;
    cycle at[CYCLE_KNOTS];
} cycle_table;

static void fill_cycles(cycle_table *table, const sc_cut_parameters *p, double blades, double low,
                        double high)
{
    double step = (high - low) / (double)(CYCLE_KNOTS - 1);
    table->first = low;
    table->per_step = 1.0 / step;
    for (int32_t i = 0; i < CYCLE_KNOTS; i++) {
        cycle *c = &table->at[i];
        sc_cut_cycle(p, blades, low + step * (double)i, &c->start, &c->stop, &c->share);
        sc_response_log_force(&p->response, log(c->start), &c->power);
    }
}

static cycle cycle_at(const cycle_table *table, double slope)
{
    double place = (slope - table->first) * table->per_step;
    int32_t low = place < (double)(CYCLE_KNOTS - 3) ? (int32_t)fmax(place, 1.0) - 1 : CYCLE_KNOTS - 4;
    double t = place - (double)low;
    double a = -(t - 1.0) * (t - 2.0) * (t - 3.0) / 6.0, b = t * (t - 2.0) * (t - 3.0) / 2.0;
    double c = -t * (t - 1.0) * (t - 3.0) / 2.0, d = t * (t - 1.0) * (t - 2.0) / 6.0;
    const cycle *at = &table->at[low];
    cycle found = {a * at[0].start + b * at[1].start + c * at[2].start + d * at[3].start,
                   a * at[0].stop + b * at[1].stop + c * at[2].stop + d * at[3].stop,
                   a * at[0].share + b * at[1].share + c * at[2].share + d * at[3].share,
                   a * at[0].power + b * at[1].power + c * at[2].power + d * at[3].power};
    return found;
}

static double running(const sc_cut_data *data, const sc_cut_parameters *p, double *terms,
                      double *residuals, double *scaled, double *line_log_period)
{
    double sum = 0.0, line = 0.0, blades = data->moving_blades;
    double per_length = 1.0 / p->variation_length;
    int32_t count = data->run_first[data->sheets];
    double lowest = HUGE_VAL, highest = 0.0;
    for (int32_t k = 0; k < count; k++) {
        if (data->run_slope[k] < lowest) lowest = data->run_slope[k];
        if (data->run_slope[k] > highest) highest = data->run_slope[k];
    }
    cycle_table cycles;
    lowest = 0.97 * (lowest > LEAST_SLOPE ? lowest : LEAST_SLOPE);
    fill_cycles(&cycles, p, blades, lowest, 1.03 * (highest > lowest ? highest : 2.0 * lowest));
    for (int32_t sheet = 0; sheet < data->sheets; sheet++) {
        filter f = {{0.0, 0.0, 0.0},
                    {1.0, p->sheet_variation * p->sheet_variation, 0.0},
                    0.0,
                    0.0,
                    0.0};
        for (int32_t k = data->run_first[sheet]; k < data->run_first[sheet + 1]; k++) {
            const double *le = data->run_lever_de + (ptrdiff_t)k * data->edge_count;
            const double *se = data->run_slope_de + (ptrdiff_t)k * data->edge_count;
            double slope = data->run_slope[k] + departure(se, p->edge, data->edge_count);
            cycle c = cycle_at(&cycles, slope > LEAST_SLOPE ? slope : LEAST_SLOPE);
            double middle = 0.5 * (c.start + c.stop), away = middle - data->reference_depth;
            slope += data->run_slope_dd[k] * away;
            double lever = data->run_lever[k] + data->run_lever_dd[k] * away +
                           departure(le, p->edge, data->edge_count);
            double peak = p->energy * lever / (blades * slope) *
                          damped(p->damping, data->run_sinking[k]);
            double torque = (1.0 - p->load * data->run_direction[k]) * c.share * peak;
            if (data->line_weight[k] > 0.0 && p->fracture == SC_CUT_RIPPLED) {
                double turn = middle * (1.0 + slope * slope) / (c.power * slope);
                double period = blades * (c.start - c.stop) / (lever - turn);
                /* A tougher place has longer teeth: with the torque to the power 1 / c.power. */
                double seen = torque + p->offset_closing;
                double tougher = log(seen > TINY ? seen : TINY) - data->line_log_torque;
                line += data->line_weight[k] *
                        (log(period > TINY ? period : TINY) - tougher / c.power);
            }
            if (k > data->run_first[sheet]) {
                double gone = fabs(data->run_place[k] - data->run_place[k - 1]);
                decay(&f, exp(-gone * per_length));
            }
            if (k == data->run_first[sheet] || !data->joined[k])
                forget_work(&f, data->start_noise[k]);
            residuals[k] = data->run_torque[k] - p->delay * data->run_late[k] - torque -
                           p->offset_closing;
            double standard;
            terms[k] = observe(&f, p->variation, torque, data->run_step[k], data->end_noise[k],
                               data->run_noise[k], residuals[k], &standard);
            if (scaled) scaled[k] = standard;
            sum += terms[k];
        }
    }
    *line_log_period = line;
    return sum;
}

double sc_cut_log_likelihood(const sc_cut_data *data, const sc_cut_parameters *parameters,
                             double *terms, double *residuals, double *scaled, double *places,
                             double *line_log_period, double *work)
{
    ptrdiff_t count = data->piece_first[data->pieces];
    double sum = elastic(data, parameters, terms, residuals, scaled, places, work);
    *line_log_period = 0.0;
    if (parameters->fracture != SC_CUT_PRESSED && data->sheets > 0)
        sum += running(data, parameters, terms + count, residuals + count,
                       scaled ? scaled + count : NULL, line_log_period);
    return isfinite(sum) && isfinite(*line_log_period) ? sum : -HUGE_VAL;
}

void sc_cut_log_likelihoods(const sc_cut_data *data, const sc_cut_parameters *points,
                            int32_t count, double *totals, double *line_log_periods, double *work)
{
    ptrdiff_t elastic_count = data->piece_first[data->pieces];
    ptrdiff_t every = elastic_count + data->run_first[data->sheets];
    double *terms = work, *residuals = terms + every, *places = residuals + every;
    for (int32_t i = 0; i < count; i++)
        totals[i] = sc_cut_log_likelihood(data, &points[i], terms, residuals, NULL, places,
                                          &line_log_periods[i], places + data->rests);
}
