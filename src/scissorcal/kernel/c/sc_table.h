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

/* 1 if the size is allowed, all numbers are finite and x ascends strictly. */
int sc_table_is_sound(const sc_table *table);

/* Value at x and, unless slope is null, the derivative. Beyond the ends the table goes on as a
 * straight line with the end's slope. */
float sc_table_at(const sc_table *table, float x, float *slope);

/* Value at x; beyond the ends that of the nearest end. */
float sc_table_held(const sc_table *table, float x);

/* Integral of the table from x[0] to x, straight lines beyond the ends included. */
float sc_table_area(const sc_table *table, float x);

/* Fill area (size entries) for a table whose x, y and slope are in place. */
void sc_table_accumulate(const sc_table *table, float *area);

/* Values at n places, for arrays: held as sc_table_held if `held`, else as sc_table_at. */
void sc_table_many(const sc_table *table, int held, const float *x, float *y, int64_t n);

#endif
