/* What a fit on a host computes in C: the walk of a crack, the likelihood of a cut, presliding. Arrays have
 * their exact sizes on the heap; nothing is written but what the caller gave. */
#include "input.h"
#include "sc_crack.h"
#include "sc_cut_fit.h"
#include "sc_presliding.h"

enum { MOST_ARRAYS = 64, EDGES = 2, KNOTS = 12 };

static void *arrays[MOST_ARRAYS];
static int array_count;

static void *room(size_t bytes)
{
    if (array_count == MOST_ARRAYS) abort();
    void *found = arrays[array_count++] = malloc(bytes ? bytes : 1);
    if (!found) abort();
    return found;
}

static double *numbers(input *from, int count, double low, double high)
{
    double *found = room((size_t)count * sizeof *found);
    for (int i = 0; i < count; i++) {
        found[i] = low + (high - low) * (take_byte(from) * 256 + take_byte(from)) / 65535.0;
    }
    for (int odd = take_byte(from); odd >= 250 && count > 0; odd--) {
        found[take_byte(from) % count] = (double)take_bits(from);
    }
    return found;
}

static double *rising(input *from, int count, double start, double step)
{
    double *found = numbers(from, count, 0.0, 2.0 * step);
    for (int i = 0; i < count; i++) found[i] += i ? found[i - 1] : start;
    return found;
}

static void walk(input *from)
{
    const int count = 2 + take_byte(from) % 100;
    const uint8_t kind = take_byte(from);
    sc_crack_law law = {
        {KNOTS, 0.0, 0.008, rising(from, KNOTS, -0.008, 2e-4), numbers(from, KNOTS, 0.01, 0.1)},
        {KNOTS, -12.0, 0.6, rising(from, KNOTS, -6.0, 0.9), numbers(from, KNOTS, 0.5, 2.5)},
        {KNOTS, -12.0, 0.6, rising(from, KNOTS, -18.0, 1.5), numbers(from, KNOTS, 1.5, 3.5)},
        .moving_blades = kind & 1 ? 2.0 : 1.0,
        .upper_face = 5e-5,
        .eq4 = kind >> 1 & 1,
        .fracture = kind >> 2 & 3,
        .kappa = kind & 16 ? 1.0 : 0.05 + take_byte(from) / 300.0,
        .damping = kind & 32 ? 0.1 : 0.0,
        .tick_s = 1e-3,
        .tough_size = 4,
        .tough_first = 0.0,
        .tough_step = 0.02,
        .tough = numbers(from, 4, kind & 64 ? 0.5 : 0.0, 2.0)};
    const double *opening = numbers(from, count, 0.1, 0.9);
    const double *advance = kind & 128 ? numbers(from, count, -0.02, 0.02) : numbers(from, count, 0.0, 0.0);
    double *torque = room((size_t)(count - 1) * sizeof *torque);
    double *push = room((size_t)(count - 1) * sizeof *push);
    double *place = room((size_t)count * sizeof *place);
    sc_crack_books books = {0.02, 0.0, 0.0, 0};
    double *ordered = room((size_t)count * sizeof *ordered);
    double *moved = room((size_t)count * sizeof *moved);
    memcpy(ordered, opening, (size_t)count * sizeof *ordered);
    /* A walk makes a step for each tooth that it passes, so that its length has to be one of blades. */
    for (int i = 0; i < count; i++) {
        ordered[i] = ordered[i] >= 0.0 && ordered[i] <= 1.5 ? ordered[i] : 0.5;
        moved[i] = advance[i] >= -0.1 && advance[i] <= 0.1 ? advance[i] : 0.0;
    }
    if (take_byte(from) % 2) { /* a stroke, rather than leaps */
        for (int i = 0; i < count; i++) ordered[i] = 0.8 - 0.6 * i / count + 1e-3 * ordered[i];
    }
    sc_crack_walk(&law, ordered, moved, count, torque, push, place, &books);
    PROMISED(books.jumps >= 0);
    sc_presliding(ordered, (size_t)count, 0.002, place);
}

static sc_cut_parameters parameters_of(input *from, uint8_t kind)
{
    const sc_response_table response = {KNOTS, -12.0, 0.6, rising(from, KNOTS, -6.0, 0.9),
                                        numbers(from, KNOTS, 0.5, 2.5), rising(from, KNOTS, -18.0, 1.5)};
    const double *n = numbers(from, 12, 0.0, 1.0);
    const sc_cut_parameters given = {.response = response,
                                     .fracture = kind % 3,
                                     .energy = n[0] * 2.0,
                                     .kappa = kind & 8 ? 1.0 : n[1],
                                     .rest_phase = n[2],
                                     .rest_spread = 0.1 * n[3],
                                     .variation = n[4],
                                     .variation_length = 0.01 * n[5],
                                     .sheet_variation = n[6],
                                     .offset_closing = 0.01 * n[7],
                                     .offset_opening = 0.01 * n[8],
                                     .load = 0.3 * n[9],
                                     .noise_scale = 0.5 + n[10],
                                     .damping = kind & 16 ? n[11] : 0.0,
                                     .delay = kind & 32 ? 1.0 : 0.0,
                                     .edge = numbers(from, EDGES, -1.0, 1.0)};
    return given;
}

static void likelihood(input *from)
{
    const uint8_t kind = take_byte(from);
    const int each = 1 + take_byte(from) % 3, pieces = 1 + take_byte(from) % 3;
    const int rests = 1 + take_byte(from) % 3, running = take_byte(from) % 12;
    const int elastic = pieces * each, triangle = each * (each + 1) / 2;
    int32_t *first = room((size_t)(pieces + 1) * 4), *rest = room((size_t)pieces * 4);
    int32_t *closing = room((size_t)pieces * 4), *white = room((size_t)pieces * 4);
    int32_t *known = room((size_t)rests * 4), *run_first = room(3 * 4), *joined = room((size_t)running * 4);
    for (int i = 0; i < pieces; i++) {
        first[i] = i * each;
        white[i] = i * triangle;
        rest[i] = take_byte(from) % rests;
        closing[i] = take_byte(from) % 2;
    }
    first[pieces] = elastic;
    for (int i = 0; i < rests; i++) known[i] = take_byte(from) % 2;
    for (int i = 0; i < running; i++) joined[i] = i > 0 && take_byte(from) % 2;
    run_first[0] = 0;
    run_first[1] = running / 2;
    run_first[2] = running;
    const sc_cut_data data = {.pieces = pieces, .rests = rests, .sheets = 2, .edge_count = EDGES,
        .moving_blades = kind & 1 ? 2.0 : 1.0, .reference_depth = 3e-4,
        .piece_first = first, .piece_rest = rest, .piece_closing = closing, .white_first = white,
        .whitener = numbers(from, pieces * triangle, 1.0, 100.0),
        .torque = numbers(from, elastic, -0.1, 0.2), .late = numbers(from, elastic, -0.01, 0.01),
        .direction = numbers(from, elastic, -1.0, 1.0), .depth = numbers(from, 2 * elastic, -1e-4, 1e-3),
        .depth_dx = numbers(from, 2 * elastic, -0.1, 0.1), .lever = numbers(from, elastic, 0.0, 0.07),
        .lever_dx = numbers(from, elastic, -1.0, 1.0), .sinking = numbers(from, elastic, -0.1, 0.1),
        .depth_de = numbers(from, 2 * elastic * EDGES, -1e-4, 1e-4),
        .lever_de = numbers(from, elastic * EDGES, -1e-3, 1e-3), .rest_known = known,
        .rest_place = numbers(from, rests, 0.0, 0.06),
        .rest_at_reference = numbers(from, rests, 0.0, 0.06), .rest_slope = numbers(from, rests, 0.01, 0.1),
        .rest_de = numbers(from, rests * EDGES, -1e-3, 1e-3), .known_sd = 1e-4,
        .run_first = run_first, .joined = joined, .run_torque = numbers(from, running, -0.1, 0.2),
        .run_late = numbers(from, running, -0.01, 0.01),
        .run_direction = numbers(from, running, -1.0, 1.0),
        .run_lever = numbers(from, running, 0.0, 0.07), .run_lever_dd = numbers(from, running, -1.0, 1.0),
        .run_slope = numbers(from, running, 0.0, 0.1), .run_slope_dd = numbers(from, running, -1.0, 1.0),
        .run_lever_de = numbers(from, running * EDGES, -1e-3, 1e-3),
        .run_slope_de = numbers(from, running * EDGES, -1e-3, 1e-3),
        .run_sinking = numbers(from, running, -0.1, 0.1),
        .run_place = numbers(from, running, 0.0, 0.06), .run_step = numbers(from, running, 1e-4, 1e-2),
        .run_noise = numbers(from, running, 1e-8, 1e-4), .start_noise = numbers(from, running, 0.0, 1e-6),
        .end_noise = numbers(from, running, 0.0, 1e-6), .line_weight = numbers(from, running, 0.0, 0.1),
        .line_log_torque = -3.0};
    const sc_cut_parameters points[2] = {parameters_of(from, kind), parameters_of(from, (uint8_t)(kind + 1))};
    const size_t segments = (size_t)(elastic + running), doubles = sizeof(double);
    double *terms = room(segments * doubles), *residuals = room(segments * doubles);
    double *scaled = room(segments * doubles), *places = room((size_t)rests * doubles);
    double *work = room((2 * segments + 2 * (size_t)elastic + (size_t)rests) * doubles);
    double totals[2], periods[2], line;
    const double sum = sc_cut_log_likelihood(&data, points, terms, residuals, kind & 64 ? scaled : NULL,
                                             places, &line, work);
    PROMISED(!isnan(sum) && sum < INFINITY);
    sc_cut_log_likelihoods(&data, points, 2, totals, periods, work);
    PROMISED(totals[0] == sum && !isnan(totals[1]));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input from = {data, size};
    if (take_byte(&from) % 2) walk(&from);
    else likelihood(&from);
    while (array_count > 0) free(arrays[--array_count]);
    return 0;
}
