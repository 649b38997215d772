#include "sc_table16.h"

#include <stddef.h>

static void decode_row(const sc_row16 *row, int32_t size, float *values)
{
    for (int32_t i = 0; i < size; i++) {
        const float away = row->scale * (float)row->numbers[i];
        values[i] = row->offset + away;
    }
}

int sc_table16_decode(const sc_table16 *stored, float *x, float *y, float *slope, sc_table *table)
{
    if (stored->size < 2 || stored->size > SC_TABLE_MAX) {
        return 0;
    }
    decode_row(&stored->x, stored->size, x);
    decode_row(&stored->y, stored->size, y);
    decode_row(&stored->slope, stored->size, slope);
    table->x = x;
    table->y = y;
    table->slope = slope;
    table->area = NULL;
    table->size = stored->size;
    return sc_table_is_sound(table);
}
