/* Any numbers as a table, of floats and stored in 16 bits; a sound one has finite values in its range. */
#include "input.h"
#include "sc_table16.h"

enum { MOST = 24 };

/* Numbers whose cubics cannot leave the range of a float. */
static int is_moderate(const sc_table *table)
{
    for (int32_t i = 0; i < table->size; i++) {
        if (!(fabsf(table->x[i]) < 1e6f && fabsf(table->y[i]) < 1e6f && fabsf(table->slope[i]) < 1e6f)) {
            return 0;
        }
    }
    return 1;
}

static void look_around(const sc_table *table, input *from)
{
    sc_place place = {(int32_t)take_word(from), 0.0f, 0.0f, 0.0f, 0.0f};
    float slope, many[4], at[4];
    for (int i = 0; i < 4; i++) {
        const float x = at[i] = take_float(from, table->x[0] - 1.0f, table->x[table->size - 1] + 1.0f);
        const float held = sc_table_held(table, x);
        const float y = sc_table_at(table, x, &slope);
        place.index = (int32_t)take_byte(from) - 8;
        sc_table_look(table, x, &place);
        PROMISED(!isfinite(x) || place.y == y || (isnan(place.y) && isnan(y)));
        PROMISED(!isfinite(x) || isfinite(held) || !is_moderate(table));
        (void)sc_table_area(table, x);
        (void)sc_table_piece(table, x, (int32_t)take_byte(from));
        (void)sc_table_inverse(table, y, &place);
    }
    sc_table_many(table, 1, at, many, 4);
    sc_table_many(table, 0, at, many, 4);
    (void)sc_share_of_rise(at[0], at[1], at[2], at[3]);
}

static void stored(input *from)
{
    int16_t numbers[3][MOST];
    float x[MOST], y[MOST], slope[MOST], area[MOST];
    sc_table table;
    for (int row = 0; row < 3; row++) {
        int32_t sum = -30000;
        for (int i = 0; i < MOST; i++) {
            const int16_t any = (int16_t)(take_byte(from) << 8 | take_byte(from));
            sum += row == 0 ? any & 0x7ff : 0;
            numbers[row][i] = row == 0 ? (int16_t)sum : any;
        }
    }
    const sc_table16 table16 = {{numbers[0], take_float(from, -1.0f, 1.0f), take_float(from, 0.0f, 0.1f)},
                                {numbers[1], take_float(from, -1.0f, 1.0f), take_float(from, 0.0f, 0.1f)},
                                {numbers[2], take_float(from, -1.0f, 1.0f), take_float(from, 0.0f, 0.1f)},
                                2 + take_byte(from) % (MOST - 1)};
    if (sc_table16_decode(&table16, x, y, slope, &table)) {
        PROMISED(sc_table_is_sound(&table));
        sc_table_accumulate(&table, area);
        table.area = area;
        look_around(&table, from);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input from = {data, size};
    float x[MOST], y[MOST], slope[MOST], area[MOST];
    if (take_byte(&from) % 2) {
        stored(&from);
        return 0;
    }
    sc_table table = {x, y, slope, area, take_byte(&from) % (MOST + 1)};
    float place = take_float(&from, -1.0f, 1.0f);
    for (int i = 0; i < MOST; i++) {
        x[i] = place += take_float(&from, 0.0f, 0.1f);
        y[i] = take_float(&from, -1.0f, 1.0f);
        slope[i] = take_float(&from, -10.0f, 10.0f);
    }
    if (sc_table_is_sound(&table)) {
        PROMISED(table.size >= 2);
        sc_table_accumulate(&table, area);
        look_around(&table, &from);
    }
    return 0;
}
