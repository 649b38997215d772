#include "sc_table.h"

#include "sc_count.h"

#include <math.h>
#include <stddef.h>

/* Even where the cubic has an inflection without slope, and Halley's method is at its slowest, each step
 * halves t's error and takes 7/8 of what is left of the rise: float's resolution after 8. */
enum { SC_ROOT_STEPS = 12 };

/* Slope, as a share of the chord's, below which a cubic hardly rises at first. */
static const float LITTLE = 0.01f;

/* Share of t up to which its error counts as none. */
static const float ROOT_CLOSE = 1e-7f;

int sc_table_is_sound(const sc_table *table)
{
    if (table->size < 2 || table->size > SC_TABLE_MAX) {
        return 0;
    }
    for (int32_t i = 0; i < table->size; i++) {
        if (!isfinite(table->x[i]) || !isfinite(table->y[i]) || !isfinite(table->slope[i])) {
            return 0;
        }
        if (i > 0 && !(table->x[i] > table->x[i - 1])) {
            return 0;
        }
    }
    return 1;
}

/* Index of the last but the end's of ascending values that does not exceed the one sought, which lies
 * between their ends: `near` or beside it, or by halving. */
static int32_t interval_of(const float *values, int32_t size, float sought, int32_t near)
{
    int32_t low = 0;
    int32_t left = size - 1;
    if (near >= 0 && near < left) {
        if (values[near] <= sought) {
            if (sought < values[near + 1]) {
                return near;
            }
            if (near + 1 < left && sought < values[near + 2]) {
                return near + 1;
            }
        } else if (near > 0 && values[near - 1] <= sought) {
            return near - 1;
        }
    }
    while (left > 1) {
        const int32_t half = left / 2;
        low = values[low + half] <= sought ? low + half : low;
        left -= half;
    }
    return low;
}

static sc_piece straight_from(const sc_table *table, int32_t end)
{
    const sc_piece piece = {end, table->x[end], 1.0f, 1.0f, table->y[end], table->slope[end],
                            0.0f, 0.0f};
    return piece;
}

sc_piece sc_piece_from(const sc_table *table, int32_t knot)
{
    const int32_t i = knot;
    sc_piece piece;
    SC_COUNT(sc_lookups);
    piece.index = i;
    piece.x = table->x[i];
    piece.width = table->x[i + 1] - table->x[i];
    piece.per_width = 1.0f / piece.width;
    piece.y = table->y[i];
    piece.start = table->slope[i] * piece.width;
    const float rise = table->y[i + 1] - table->y[i];
    piece.third = piece.start + table->slope[i + 1] * piece.width - 2.0f * rise;
    piece.second = rise - piece.start - piece.third;
    return piece;
}

sc_piece sc_table_piece(const sc_table *table, float x, int32_t near)
{
    const int32_t last = table->size - 1;
    if (x <= table->x[0]) {
        return straight_from(table, 0);
    }
    if (x >= table->x[last]) {
        return straight_from(table, last);
    }
    return sc_piece_from(table, interval_of(table->x, table->size, x, near));
}

static float value_in(const sc_piece *piece, float t)
{
    return piece->y + t * (piece->start + t * (piece->second + t * piece->third));
}

static float slope_in(const sc_piece *piece, float t)
{
    return (piece->start + t * (2.0f * piece->second + t * 3.0f * piece->third)) * piece->per_width;
}

/* Integral over the first share t of a piece. */
static float area_in(const sc_piece *piece, float t)
{
    const float bend = piece->start / 2.0f + t * (piece->second / 3.0f + t * piece->third / 4.0f);
    return piece->width * t * (piece->y + t * bend);
}

float sc_table_at(const sc_table *table, float x, float *slope)
{
    const sc_piece piece = sc_table_piece(table, x, 0);
    const float t = (x - piece.x) * piece.per_width;
    if (slope != NULL) {
        *slope = slope_in(&piece, t);
    }
    return value_in(&piece, t);
}

float sc_table_held(const sc_table *table, float x)
{
    const int32_t last = table->size - 1;
    if (x <= table->x[0]) {
        return table->y[0];
    }
    return x >= table->x[last] ? table->y[last] : sc_table_at(table, x, NULL);
}

float sc_table_area(const sc_table *table, float x)
{
    const sc_piece piece = sc_table_piece(table, x, 0);
    return table->area[piece.index] + area_in(&piece, (x - piece.x) * piece.per_width);
}

static void place_in(const sc_table *table, const sc_piece *piece, float t, sc_place *place)
{
    place->index = piece->index;
    place->y = value_in(piece, t);
    place->slope = slope_in(piece, t);
    place->area = table->area == NULL ? 0.0f : table->area[piece->index] + area_in(piece, t);
}

void sc_table_look(const sc_table *table, float x, sc_place *place)
{
    const sc_piece piece = sc_table_piece(table, x, place->index);
    place->x = x;
    place_in(table, &piece, (x - piece.x) * piece.per_width, place);
}

void sc_table_inverse(const sc_table *table, float y, sc_place *place)
{
    const int32_t last = table->size - 1;
    if (y >= table->y[last]) {
        const sc_piece piece = straight_from(table, last);
        const float away = (y - piece.y) / piece.start;
        place_in(table, &piece, away, place);
        place->x = piece.start > 0.0f ? piece.x + away : INFINITY;
        place->y = y;
        return;
    }
    const sc_piece piece =
        sc_piece_from(table, interval_of(table->y, table->size, y, place->index));
    const float t = sc_share_of_rise(piece.start, piece.second, piece.third, y - piece.y);
    place_in(table, &piece, t, place);
    place->x = piece.x + t * piece.width;
    place->y = y;
}

float sc_share_of_rise(float start, float second, float third, float rise)
{
    const float whole = start + second + third;
    const float per_whole = 1.0f / whole;
    const float even = rise / whole;
    float low = 0.0f;
    float high = 1.0f;
    if (!(even > 0.0f)) {
        return 0.0f;
    }
    if (even >= 1.0f) {
        return 1.0f;
    }
    /* what the bend takes from an even rise, given back along the chord */
    const float curved = (fabsf(second) + 3.0f * fabsf(third)) * per_whole;
    float t = even + even * (1.0f - even) * (second + third * (1.0f + even)) * per_whole;
    if (curved * curved <= ROOT_CLOSE) {
        return t; /* what this leaves is the square of the curvature */
    }
    if (second > start) { /* little slope at first: a parabola */
        t = 2.0f * rise / (start + sqrtf(start * start + 4.0f * second * rise));
        t = t < 1.0f ? t : 1.0f;
    } else if (start < LITTLE * whole) { /* nor a bend: nearly a pure cubic, from its far end */
        t = 1.0f;
    } else if (!(t > 0.0f && t < 1.0f)) {
        t = even;
    }
    for (int i = 0; i < SC_ROOT_STEPS; i++) {
        const float away = t * (start + t * (second + t * third)) - rise;
        const float grade = start + t * (2.0f * second + t * 3.0f * third);
        const float bend = second + t * 3.0f * third;
        const float per_step = 1.0f / (grade * grade - away * bend);
        SC_COUNT(sc_root_steps);
        if (away > 0.0f) {
            high = t;
        } else {
            low = t;
        }
        float next = t - away * grade * per_step;
        if (!(next >= low && next <= high)) {
            next = 0.5f * (low + high);
        }
        const float moved = next - t;
        const float left = (bend * bend + fabsf(third * grade)) * per_step * moved * moved;
        t = next;
        if (left * fabsf(moved) <= ROOT_CLOSE * t) {
            break;
        }
    }
    return t;
}

void sc_table_accumulate(const sc_table *table, float *area)
{
    area[0] = 0.0f;
    for (int32_t i = 0; i + 1 < table->size; i++) {
        const sc_piece piece = sc_piece_from(table, i);
        area[i + 1] = area[i] + area_in(&piece, 1.0f);
    }
}

void sc_table_many(const sc_table *table, int held, const float *x, float *y, int64_t n)
{
    for (int64_t i = 0; i < n; i++) {
        y[i] = held ? sc_table_held(table, x[i]) : sc_table_at(table, x[i], NULL);
    }
}
