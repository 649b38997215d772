/* Tables stored in 16-bit numbers, and how they become tables of floats. */
#ifndef SC_TABLE16_H
#define SC_TABLE16_H

#include "sc_table.h"

/* One row of a stored table: the value of a number q is offset + scale q, computed in float. A scale
 * with at most 8 significant bits makes the product exact, so that the sum is the only rounding and the
 * result is the same on every processor, whether or not it multiplies and adds in one instruction. */
typedef struct {
    const int16_t *numbers;
    float offset, scale;
} sc_row16;

/* A table as flash may hold it: half the bytes of floats. The numbers belong to the caller. */
typedef struct {
    sc_row16 x, y, slope;
    int32_t size;
} sc_table16;

/* Decode into the caller's arrays, of `size` floats each, and let *table point at them; once, before the
 * table is used: a step is then as quick as with floats. 1 if the result is sound; else 0, and *table is
 * not to be used. */
int sc_table16_decode(const sc_table16 *stored, float *x, float *y, float *slope, sc_table *table);

#endif
