/* The table of a cut's response: force and energy over depth, and depth over force. */
#include "sc_cut_fit.h"

#include <math.h>

static const double LEAST_DEPTH = 1e-12;
/* Depths that differ by less, as a share, count as one: energies would cancel. */
static const double LEAST_WAY = 1e-3;

typedef struct {
    double t, t2, t3;
} cell;

static int32_t locate(const sc_response_table *table, double log_depth, cell *inside)
{
    double place = (log_depth - table->first) / table->step;
    int32_t index = 0; /* chosen before the cast, which a place beyond all numbers would not survive */
    if (place >= (double)(table->size - 2)) index = table->size - 2;
    else if (place > 0.0) index = (int32_t)place;
    inside->t = place - (double)index;
    inside->t2 = inside->t * inside->t;
    inside->t3 = inside->t2 * inside->t;
    return index;
}

static double hermite(double y0, double y1, double m0, double m1, const cell *c)
{
    return (2.0 * c->t3 - 3.0 * c->t2 + 1.0) * y0 + (c->t3 - 2.0 * c->t2 + c->t) * m0 +
           (3.0 * c->t2 - 2.0 * c->t3) * y1 + (c->t3 - c->t2) * m1;
}

static double hermite_slope(double y0, double y1, double m0, double m1, const cell *c)
{
    return (6.0 * c->t2 - 6.0 * c->t) * (y0 - y1) + (3.0 * c->t2 - 4.0 * c->t + 1.0) * m0 +
           (3.0 * c->t2 - 2.0 * c->t) * m1;
}

double sc_response_log_force(const sc_response_table *table, double log_depth, double *slope)
{
    int32_t last = table->size - 1;
    double end = table->first + table->step * (double)last;
    if (log_depth <= table->first) {
        *slope = table->force_slope[0];
        return table->log_force[0] + *slope * (log_depth - table->first);
    }
    if (log_depth >= end) {
        *slope = table->force_slope[last];
        return table->log_force[last] + *slope * (log_depth - end);
    }
    cell c;
    int32_t i = locate(table, log_depth, &c);
    double m0 = table->force_slope[i] * table->step, m1 = table->force_slope[i + 1] * table->step;
    double y0 = table->log_force[i], y1 = table->log_force[i + 1];
    *slope = hermite_slope(y0, y1, m0, m1, &c) / table->step;
    return hermite(y0, y1, m0, m1, &c);
}

/* d(log energy)/d(log depth) = depth * force / energy, known at the knots. */
static double energy_slope(const sc_response_table *table, int32_t i)
{
    double log_depth = table->first + table->step * (double)i;
    return exp(log_depth + table->log_force[i] - table->log_energy[i]);
}

double sc_response_log_energy(const sc_response_table *table, double log_depth, double *slope)
{
    int32_t last = table->size - 1;
    double end = table->first + table->step * (double)last;
    if (log_depth <= table->first) {
        *slope = energy_slope(table, 0);
        return table->log_energy[0] + *slope * (log_depth - table->first);
    }
    if (log_depth >= end) {
        *slope = energy_slope(table, last);
        return table->log_energy[last] + *slope * (log_depth - end);
    }
    cell c;
    int32_t i = locate(table, log_depth, &c);
    double m0 = energy_slope(table, i) * table->step;
    double m1 = energy_slope(table, i + 1) * table->step;
    double y0 = table->log_energy[i], y1 = table->log_energy[i + 1];
    *slope = hermite_slope(y0, y1, m0, m1, &c) / table->step;
    return hermite(y0, y1, m0, m1, &c);
}

double sc_response_log_depth(const sc_response_table *table, double log_force)
{
    int32_t last = table->size - 1, low = 0, high = last;
    double end = table->first + table->step * (double)last;
    if (log_force <= table->log_force[0])
        return table->first + (log_force - table->log_force[0]) / table->force_slope[0];
    if (log_force >= table->log_force[last])
        return end + (log_force - table->log_force[last]) / table->force_slope[last];
    while (high - low > 1) {
        int32_t middle = (low + high) / 2;
        if (table->log_force[middle] <= log_force) low = middle;
        else high = middle;
    }
    double left = table->first + table->step * (double)low;
    double rise = table->log_force[high] - table->log_force[low];
    double place = left + table->step * (log_force - table->log_force[low]) / rise;
    for (int32_t k = 0; k < 6; k++) {
        double slope, value = sc_response_log_force(table, place, &slope);
        double step = (log_force - value) / slope;
        place += step;
        if (place < left) place = left;
        if (place > left + table->step) place = left + table->step;
        if (fabs(step) < 1e-14) break;
    }
    return place;
}

/* Energy (J) stored at a depth, and the force (N) there; nothing outside the material. */
static double stored(const sc_response_table *table, double depth, double *force)
{
    *force = 0.0;
    if (depth <= LEAST_DEPTH) return 0.0;
    double slope, energy = exp(sc_response_log_energy(table, log(depth), &slope));
    *force = energy * slope / depth;
    return energy;
}

double sc_response_mean_force(const sc_response_table *table, double low, double high,
                              double low_dx, double high_dx, double *by_place)
{
    double at_low, at_high, way = high - low, middle = 0.5 * (low + high);
    if (fabs(way) <= LEAST_WAY * fabs(middle)) {
        double slope;
        *by_place = 0.0;
        if (middle <= LEAST_DEPTH) return 0.0;
        double force = exp(sc_response_log_force(table, log(middle), &slope));
        *by_place = 0.5 * force * slope / middle * (low_dx + high_dx);
        return force;
    }
    double gained = stored(table, high, &at_high) - stored(table, low, &at_low);
    double mean = gained / way;
    *by_place = (at_high * high_dx - at_low * low_dx - mean * (high_dx - low_dx)) / way;
    return mean;
}
