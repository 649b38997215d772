/* The cut's likelihood against its twin's answers; arrays have their exact sizes on the heap, so that
 * the sanitizers see every read beyond an end. */
#include "arrays.h"
#include "check.h"
#include "sc_cut_fit.h"

#include <stdlib.h>

static sc_cut_data load_data(const json *one)
{
    sc_cut_data data;
    data.pieces = (int32_t)json_get(one, "piece_rest")->size;
    data.rests = (int32_t)json_get(one, "rest_place")->size;
    data.sheets = (int32_t)json_get(one, "run_first")->size - 1;
    data.edge_count = (int32_t)json_number(one, "edge_count");
    data.moving_blades = json_number(one, "moving_blades");
    data.reference_depth = json_number(one, "reference_depth");
    data.known_sd = json_number(one, "known_sd");
    data.line_log_torque = json_number(one, "line_log_torque");
    data.piece_first = integers(one, "piece_first");
    data.piece_rest = integers(one, "piece_rest");
    data.piece_closing = integers(one, "piece_closing");
    data.white_first = integers(one, "white_first");
    data.rest_known = integers(one, "rest_known");
    data.run_first = integers(one, "run_first");
    data.joined = integers(one, "joined");
    return data;
}

static void load_arrays(sc_cut_data *data, const json *one)
{
    data->whitener = doubles(one, "whitener");
    data->torque = doubles(one, "torque");
    data->late = doubles(one, "late");
    data->direction = doubles(one, "direction");
    data->run_direction = doubles(one, "run_direction");
    data->depth = doubles(one, "depth");
    data->depth_dx = doubles(one, "depth_dx");
    data->lever = doubles(one, "lever");
    data->lever_dx = doubles(one, "lever_dx");
    data->sinking = doubles(one, "sinking");
    data->depth_de = doubles(one, "depth_de");
    data->lever_de = doubles(one, "lever_de");
    data->rest_place = doubles(one, "rest_place");
    data->rest_at_reference = doubles(one, "rest_at_reference");
    data->rest_slope = doubles(one, "rest_slope");
    data->rest_de = doubles(one, "rest_de");
    data->run_torque = doubles(one, "run_torque");
    data->run_late = doubles(one, "run_late");
    data->run_lever = doubles(one, "run_lever");
    data->run_lever_dd = doubles(one, "run_lever_dd");
    data->run_slope = doubles(one, "run_slope");
    data->run_slope_dd = doubles(one, "run_slope_dd");
    data->run_lever_de = doubles(one, "run_lever_de");
    data->run_slope_de = doubles(one, "run_slope_de");
    data->run_sinking = doubles(one, "run_sinking");
    data->run_place = doubles(one, "run_place");
    data->run_step = doubles(one, "run_step");
    data->run_noise = doubles(one, "run_noise");
    data->start_noise = doubles(one, "start_noise");
    data->end_noise = doubles(one, "end_noise");
    data->line_weight = doubles(one, "line_weight");
}

static sc_cut_parameters load_parameters(const json *one)
{
    sc_cut_parameters given;
    given.response.size = (int32_t)json_get(one, "log_force")->size;
    given.response.first = json_number(one, "first");
    given.response.step = json_number(one, "step");
    given.response.log_force = doubles(one, "log_force");
    given.response.force_slope = doubles(one, "force_slope");
    given.response.log_energy = doubles(one, "log_energy");
    given.fracture = (int32_t)json_number(one, "fracture");
    given.edge = doubles(one, "edge");
    given.energy = json_number(one, "energy");
    given.kappa = json_number(one, "kappa");
    given.rest_phase = json_number(one, "rest_phase");
    given.rest_spread = json_number(one, "rest_spread");
    given.variation = json_number(one, "variation");
    given.variation_length = json_number(one, "variation_length");
    given.sheet_variation = json_number(one, "sheet_variation");
    given.offset_closing = json_number(one, "offset_closing");
    given.offset_opening = json_number(one, "offset_opening");
    given.load = json_number(one, "load");
    given.noise_scale = json_number(one, "noise_scale");
    given.damping = json_number(one, "damping");
    given.delay = json_number(one, "delay");
    return given;
}

static void check_array(const json *one, const char *key, const double *got, double tolerance,
                        const char *title)
{
    const json *wanted = json_get(one, key);
    double largest = 1e-12;
    for (size_t i = 0; i < wanted->size; i++)
        largest = fmax(largest, fabs(wanted->items[i].number));
    for (size_t i = 0; i < wanted->size; i++)
        NEAR(got[i], wanted->items[i].number, tolerance * largest, key, title);
}

static void check_case(const json *one, double tolerance)
{
    const char *title = json_text(one, "title");
    sc_cut_data data = load_data(json_get(one, "data"));
    load_arrays(&data, json_get(one, "data"));
    sc_cut_parameters given = load_parameters(json_get(one, "parameters"));
    const size_t elastic = (size_t)data.piece_first[data.pieces];
    const size_t count = elastic + (size_t)data.run_first[data.sheets];
    const size_t rests = (size_t)data.rests;
    double *terms = room(count * sizeof *terms), *residuals = room(count * sizeof *residuals);
    double *scaled = room(count * sizeof *scaled), *places = room(rests * sizeof *places);
    double *work = room(2 * elastic * sizeof *work), period;
    for (size_t i = 0; i < count; i++) terms[i] = residuals[i] = scaled[i] = 0.0;
    double total = sc_cut_log_likelihood(&data, &given, terms, residuals, scaled, places, &period,
                                         work);
    double wanted = json_number(one, "total");
    NEAR(total, wanted, tolerance * fabs(wanted), "total", title);
    NEAR(period, json_number(one, "log_period"), tolerance * 10.0, "log period", title);
    check_array(one, "terms", terms, tolerance, title);
    check_array(one, "residuals", residuals, tolerance, title);
    check_array(one, "standardised", scaled, tolerance, title);
    check_array(one, "places", places, tolerance, title);
    double again = sc_cut_log_likelihood(&data, &given, terms, residuals, NULL, places, &period,
                                         work);
    CHECK(again == total, title);
    given.energy = NAN;
    total = sc_cut_log_likelihood(&data, &given, terms, residuals, scaled, places, &period, work);
    if (given.fracture != SC_CUT_PRESSED) CHECK(total == -HUGE_VAL, title);
    free_arrays();
}

int main(int argc, char **argv)
{
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "cut_fit.json");
    const json *cases = json_get(&vectors, "cases");
    for (size_t i = 0; i < cases->size; i++)
        check_case(&cases->items[i], json_number(&vectors, "tolerance"));
    json_free(&vectors);
    return checks_done("cut's likelihood");
}
