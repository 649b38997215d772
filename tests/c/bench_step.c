/* How long a step of the model takes: on the host in nanoseconds, on a Cortex-M4F under qemu in
 * instructions. Every step is repeated from the same state and its least figure counts. */
#include "bench_clock.h"
#include "bench_models.h"

#include <stdio.h>
#include <stdlib.h>

enum { STEPS = 400 };

static const bench_case CASES[] = {
    {"straight edge, smooth", 2, 19, 0.0f, 1.5f, 1.0f, 0.6f, 0},
    {"straight edge, smooth, friction", 2, 19, 0.0f, 1.5f, 1.0f, 0.6f, 1},
    {"straight edge, rippled, friction", 2, 19, 0.0f, 1.5f, 0.7f, 0.6f, 1},
    {"straight edge, pressed, friction", 2, 19, 0.0f, 1.5f, 1.0f, 0.0f, 1},
    {"16 knots, smooth, friction", 16, 64, 1.0f, 1.5f, 1.0f, 0.6f, 1},
    {"64 knots, smooth, friction", 64, 64, 1.0f, 1.5f, 1.0f, 0.6f, 1},
    {"64 knots, rippled, friction", 64, 64, 1.0f, 1.5f, 0.7f, 0.6f, 1},
    {"256 knots, smooth, friction", 256, 256, 1.0f, 1.5f, 1.0f, 0.6f, 1},
    {"256 knots, rippled, friction", 256, 256, 1.0f, 1.5f, 0.7f, 0.6f, 1},
    {"256 knots, scanned, friction", 256, 256, 1.0f, 1.5f, 1.0f, 0.6f, 1},
};

typedef enum { CORE, BY_HAND } who;

static uint32_t one_step(who stepper, const bench_case *one, const sc_model *model,
                         const sc_crack *from, bench_place at, sc_crack *to)
{
    sc_step_output out;
    const uint32_t start = bench_now();
    *to = *from;
    if (stepper == CORE) {
        sc_model_step(model, to, at.opening, at.rate, at.advance, &out);
    } else {
        bench_by_hand(one, to, at.opening, at.rate, at.advance, &out);
    }
    return bench_since(start);
}

static uint32_t least(who stepper, const bench_case *one, const sc_model *model, sc_crack *state,
                      bench_place at)
{
    sc_crack after = *state;
    uint32_t best = UINT32_MAX;
    for (int i = 0; i < BENCH_REPEATS; i++) {
        const uint32_t took = one_step(stepper, one, model, state, at, &after);
        best = took < best ? took : best;
    }
    *state = after;
    return best;
}

static int by_size(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Figures of a stroke or of random steps, in order; the clock's own share is taken off. */
static void figures(who stepper, const bench_case *one, const sc_model *model, int random,
                    uint32_t *took)
{
    static const sc_crack FRESH = {0.0f, 0, 0, 0};
    sc_crack state = FRESH;
    uint32_t seed = 20240501u;
    const uint32_t nothing = bench_nothing();
    for (int32_t k = 0; k < STEPS; k++) {
        bench_place at = bench_stroke(k, STEPS);
        if (random) {
            state.detached = 0;
            at = bench_random(&seed, &state.crack);
        }
        took[k] = least(stepper, one, model, &state, at);
        took[k] = took[k] > nothing ? took[k] - nothing : 0;
    }
    qsort(took, STEPS, sizeof *took, by_size);
}

int main(void)
{
    static bench_room room;
    static uint32_t hand[STEPS], stroke[STEPS], random[STEPS];
    bench_start();
    printf("%-34s %9s %9s %7s %9s %9s\n", BENCH_UNIT, "by hand", "stroke", "ratio", "random", "worst");
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        sc_model model = bench_model(&CASES[i], &room);
#ifndef BENCH_OLD_CORE
        if (i + 1 == sizeof CASES / sizeof *CASES) {
            model.release_falls = 0;
        }
#endif
        figures(BY_HAND, &CASES[i], &model, 0, hand);
        figures(CORE, &CASES[i], &model, 0, stroke);
        figures(CORE, &CASES[i], &model, 1, random);
        printf("%-34s %9lu %9lu %7.2f %9lu %9lu\n", CASES[i].title, (unsigned long)hand[STEPS / 2],
               (unsigned long)stroke[STEPS / 2],
               (double)stroke[STEPS / 2] / (double)hand[STEPS / 2],
               (unsigned long)random[STEPS / 2], (unsigned long)random[STEPS - 1]);
    }
    return 0;
}
