#include "sc_table.h"

#include <math.h>
#include <stddef.h>

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

/* Index of the interval that holds x, for x within the table. */
static int32_t interval_of(const sc_table *table, float x)
{
    int32_t low = 0;
    int32_t high = table->size - 1;
    while (high - low > 1) {
        const int32_t middle = (low + high) / 2;
        if (table->x[middle] <= x) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

float sc_table_at(const sc_table *table, float x, float *slope)
{
    const int32_t last = table->size - 1;
    if (x <= table->x[0] || x >= table->x[last]) {
        const int32_t end = x <= table->x[0] ? 0 : last;
        if (slope != NULL) {
            *slope = table->slope[end];
        }
        return table->y[end] + table->slope[end] * (x - table->x[end]);
    }
    const int32_t i = interval_of(table, x);
    const float width = table->x[i + 1] - table->x[i];
    const float t = (x - table->x[i]) / width;
    const float start = table->slope[i] * width;
    const float rise = table->y[i + 1] - table->y[i];
    const float third = start + table->slope[i + 1] * width - 2.0f * rise;
    const float second = rise - start - third;
    if (slope != NULL) {
        *slope = (start + t * (2.0f * second + t * 3.0f * third)) / width;
    }
    return table->y[i] + t * (start + t * (second + t * third));
}

float sc_table_held(const sc_table *table, float x)
{
    const int32_t last = table->size - 1;
    if (x <= table->x[0]) {
        return table->y[0];
    }
    return x >= table->x[last] ? table->y[last] : sc_table_at(table, x, NULL);
}

/* Integral over the first share t of interval i. */
static float partial_area(const sc_table *table, int32_t i, float t)
{
    const float width = table->x[i + 1] - table->x[i];
    const float start = table->slope[i] * width;
    const float rise = table->y[i + 1] - table->y[i];
    const float third = start + table->slope[i + 1] * width - 2.0f * rise;
    const float second = rise - start - third;
    const float bend = start / 2.0f + t * (second / 3.0f + t * third / 4.0f);
    return width * t * (table->y[i] + t * bend);
}

float sc_table_area(const sc_table *table, float x)
{
    const int32_t last = table->size - 1;
    if (x <= table->x[0] || x >= table->x[last]) {
        const int32_t end = x <= table->x[0] ? 0 : last;
        const float away = x - table->x[end];
        return table->area[end] + away * (table->y[end] + 0.5f * table->slope[end] * away);
    }
    const int32_t i = interval_of(table, x);
    const float t = (x - table->x[i]) / (table->x[i + 1] - table->x[i]);
    return table->area[i] + partial_area(table, i, t);
}

void sc_table_accumulate(const sc_table *table, float *area)
{
    area[0] = 0.0f;
    for (int32_t i = 0; i + 1 < table->size; i++) {
        area[i + 1] = area[i] + partial_area(table, i, 1.0f);
    }
}

void sc_table_many(const sc_table *table, int held, const float *x, float *y, int64_t n)
{
    for (int64_t i = 0; i < n; i++) {
        y[i] = held ? sc_table_held(table, x[i]) : sc_table_at(table, x[i], NULL);
    }
}
