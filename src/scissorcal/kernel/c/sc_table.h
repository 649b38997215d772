/* Tables: piecewise cubic Hermite on ascending, unevenly spaced knots. */
#ifndef SC_TABLE_H
#define SC_TABLE_H

#include <stdint.h>

enum { SC_TABLE_MAX = 256 };

/* The arrays have `size` entries (2 to SC_TABLE_MAX) and belong to the caller, who may keep them in
 * flash. area[i] is the integral of the table from x[0] to x[i]; it may be null where
 * sc_table_area is never asked. */
typedef struct {
    const float *x;
    const float *y;
    const float *slope;
    const float *area;
    int32_t size;
} sc_table;

/* One interval of a table: y + t (start + t (second + t third)) at x + t width. From knot `index` on;
 * beyond the ends a straight line of width 1. */
typedef struct {
    int32_t index;
    float x, width, per_width;
    float y, start, second, third;
} sc_piece;

/* A place of a table: value, derivative and, of a table that has areas, integral from x[0] on. `index`
 * names its piece; what it holds before a look-up is where to look first, which never changes the
 * result. */
typedef struct {
    int32_t index;
    float x, y, slope, area;
} sc_place;

/* 1 if the size is allowed, all numbers are finite and x ascends strictly. */
int sc_table_is_sound(const sc_table *table);

/* Value at x and, unless slope is null, the derivative. Beyond the ends the table goes on as a
 * straight line with the end's slope. */
float sc_table_at(const sc_table *table, float x, float *slope);

/* Value at x; beyond the ends that of the nearest end. */
float sc_table_held(const sc_table *table, float x);

/* Integral of the table from x[0] to x. */
float sc_table_area(const sc_table *table, float x);

/* All about the table at x, straight lines beyond the ends included, in one look-up. */
void sc_table_look(const sc_table *table, float x, sc_place *place);

/* The same where a table that never falls reaches y, at the largest such x; y must not be below the
 * first value. x is infinite where the table never gets there. */
void sc_table_inverse(const sc_table *table, float y, sc_place *place);

/* The piece that holds x, looked for first at the knot `near`; and the one from a knot on. */
sc_piece sc_table_piece(const sc_table *table, float x, int32_t near);
sc_piece sc_piece_from(const sc_table *table, int32_t knot);

/* Share t of an interval, from 0 to 1, at which start t + second t^2 + third t^3 has risen that far;
 * the sum must rise from 0 to that or more. Halley's method in a bracket, at most 12 steps; one or two
 * are usual. */
float sc_share_of_rise(float start, float second, float third, float rise);

/* Fill area (size entries) for a table whose x, y and slope are in place. */
void sc_table_accumulate(const sc_table *table, float *area);

/* Values at n places, for arrays: held as sc_table_held if `held`, else as sc_table_at. */
void sc_table_many(const sc_table *table, int held, const float *x, float *y, int64_t n);

#endif
