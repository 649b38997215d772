/* A model that is sound to begin with, and changed: its numbers, and its tables' numbers. */
#ifndef FUZZ_MODELS_H
#define FUZZ_MODELS_H

#include "../bench_models.h"
#include "input.h"

#include <stddef.h>

static inline sc_model taken_model(input *from, bench_room *room)
{
    static const float EXPONENTS[4] = {1.0f, 1.5f, 2.5f, 0.7f};
    const uint8_t kind = take_byte(from);
    const bench_case one = {"fuzz",
                            2 + take_byte(from) % 40,
                            2 + take_byte(from) % 40,
                            take_float(from, -2.0f, 2.0f),
                            EXPONENTS[kind % 4],
                            take_float(from, 0.05f, 1.0f),
                            take_float(from, 0.0f, 3.0f),
                            kind / 4 % 2};
    sc_model model = bench_model(&one, room);
    model.closure = kind & 16 ? SC_CLOSURE_EQ4 : SC_CLOSURE_WORK;
    model.moving_blades = kind & 32 ? 1 : 2;
    if (kind & 64) model.rate_damping = take_float(from, 0.0f, 10.0f);
    const size_t first = offsetof(sc_model, moving_blades);
    change_words(from, (uint8_t *)&model + first, sizeof model - first);
    change_words(from, room->x, sizeof room->x);
    change_words(from, room->y, sizeof room->y);
    change_words(from, room->slope, sizeof room->slope);
    sc_table_accumulate(&model.response, room->area);
    model.release_falls = 0;
    return model;
}

#endif
