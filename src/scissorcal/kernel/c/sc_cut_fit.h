/* The likelihood of a cut over the path: work between openings, cracks at rest, cracks that run.
 *
 * Geometry comes in as arrays that were expanded about a nominal edge and place, so that nothing
 * here knows the family of an edge; the response comes as a table. Doubles throughout: this serves
 * a fit on a host. No allocation: the caller gives the workspace. */
#ifndef SC_CUT_FIT_H
#define SC_CUT_FIT_H

#include <stdint.h>

enum { SC_CUT_ENDS = 2, SC_CUT_REST_STEPS = 30 };

enum { SC_CUT_PRESSED = 0, SC_CUT_SMOOTH = 1, SC_CUT_RIPPLED = 2 };

/* Logarithms of force (N) and stored energy (J) of one blade at depths that are even in the
 * logarithm: log_depth = first + i * step. force_slope[i] = d(log force)/d(log depth). Cubic
 * Hermite between knots, a power law beyond them. */
typedef struct {
    int32_t size;
    double first;
    double step;
    const double *log_force;
    const double *force_slope;
    const double *log_energy;
} sc_response_table;

/* What was measured. Arrays belong to the caller.
 *
 * Elastic pieces: piece i has the segments piece_first[i] to piece_first[i + 1] - 1 and touches the
 * crack of rest piece_rest[i]; its whitener is the inverse Cholesky factor of the covariance of its
 * mean torques, rows of a lower triangle one after the other from white_first[i]. Every segment has
 * depths at its SC_CUT_ENDS ends and one lever, which turns the response's mean over the depths
 * between them into the mean torque; all are expanded in the crack's place about rest_place and in
 * the edge's parameters (edge_count values each). sinking (m/s) is one value a segment.
 *
 * Rests: the crack's place where the blades turned, for a depth of reference_depth, its slope, and
 * d(place)/d(edge); a known place (a fresh sheet) has known = 1 and the standard deviation
 * known_sd.
 *
 * Running segments: sheet j has run_first[j] to run_first[j + 1] - 1, in order of time. Lever and
 * slope of the edge are expanded in depth about reference_depth and in the edge's parameters;
 * joined[k] is 1 where segment k begins where k - 1 ended. start_noise[k] is the variance of the work
 * at the segment's start, end_noise[k] at its end. line_weight sums to 1
 * over the segments that show the line, or is 0 throughout; line_log_torque is the logarithm of the
 * mean measured torque (N m) there at which the line's period holds; of that, offset_closing is not
 * the material's. */
typedef struct {
    int32_t pieces;
    int32_t rests;
    int32_t sheets;
    int32_t edge_count;
    double moving_blades;
    double reference_depth;
    const int32_t *piece_first;
    const int32_t *piece_rest;
    const int32_t *piece_closing;
    const int32_t *white_first;
    const double *whitener;
    const double *torque;
    const double *late;
    const double *direction;
    const double *depth;
    const double *depth_dx;
    const double *lever;
    const double *lever_dx;
    const double *sinking;
    const double *depth_de;
    const double *lever_de;
    const int32_t *rest_known;
    const double *rest_place;
    const double *rest_at_reference;
    const double *rest_slope;
    const double *rest_de;
    double known_sd;
    const int32_t *run_first;
    const int32_t *joined;
    const double *run_torque;
    const double *run_late;
    const double *run_direction;
    const double *run_lever;
    const double *run_lever_dd;
    const double *run_slope;
    const double *run_slope_dd;
    const double *run_lever_de;
    const double *run_slope_de;
    const double *run_sinking;
    const double *run_place;
    const double *run_step;
    const double *run_noise;
    const double *start_noise;
    const double *end_noise;
    const double *line_weight;
    double line_log_torque;
} sc_cut_data;

/* Parameters in SI. energy is J_c h (N); fracture is one of SC_CUT_*. delay (ticks) is how late a
 * torque is measured: late and run_late say by how much mean torques fall for one tick of it. load is
 * the share of the cut's torque that friction adds against the motion: direction and run_direction are
 * the segments' mean directions, -1 closing and 1 opening, in between where friction has not built
 * up. rest_phase is the mean place of rests in the cycle (0: just arrested, 1: about to run) and
 * rest_spread their standard deviation in cycles; variation, its length (m) and sheet_variation
 * describe unevenness as shares; noise_scale multiplies the standard deviation of elastic pieces.
 * edge holds edge_count departures from the nominal edge. */
typedef struct {
    sc_response_table response;
    int32_t fracture;
    double energy;
    double kappa;
    double rest_phase;
    double rest_spread;
    double variation;
    double variation_length;
    double sheet_variation;
    double offset_closing;
    double offset_opening;
    double load;
    double noise_scale;
    double damping;
    double delay;
    const double *edge;
} sc_cut_parameters;

double sc_response_log_force(const sc_response_table *table, double log_depth, double *slope);
double sc_response_log_energy(const sc_response_table *table, double log_depth, double *slope);
double sc_response_log_depth(const sc_response_table *table, double log_force);

/* Mean force (N) between two depths: what the energy differs by, over the way. It is exact whatever
 * part of the segment lies outside the material; depths that hardly differ have the force between
 * them. `by_place` is its derivative where the depths change by `low_dx` and `high_dx`. */
double sc_response_mean_force(const sc_response_table *table, double low, double high,
                              double low_dx, double high_dx, double *by_place);

/* Depth at which a crack starts and at which it stops, the force's mean between them as a share of
 * its peak, where the edge has the slope `slope`. */
void sc_cut_cycle(const sc_cut_parameters *parameters, double moving_blades, double slope,
                  double *start_depth, double *stop_depth, double *mean_share);

/* Log-likelihood of every segment, elastic ones first and then running ones, up to a constant, with
 * residuals (measured less expected, N m) and, unless scaled is null, residuals that are standard
 * normal if the model is true, in the same order. places (rests) gets where each crack rests, at the highest density. line_log_period gets
 * the weighted mean of the logarithm of the teeth's period in opening, at the line's torque. Returns the sum; -HUGE_VAL
 * where a number is not finite. work has 2 * elastic segments values. */
double sc_cut_log_likelihood(const sc_cut_data *data, const sc_cut_parameters *parameters,
                             double *terms, double *residuals, double *scaled, double *places,
                             double *line_log_period, double *work);

/* The sums and line_log_periods of `count` points. work has 2 * segments + 2 * elastic segments + rests
 * values. */
void sc_cut_log_likelihoods(const sc_cut_data *data, const sc_cut_parameters *points,
                            int32_t count, double *totals, double *line_log_periods, double *work);

#endif
