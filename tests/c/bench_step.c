/* How long a step of the model takes: on the host in nanoseconds, on a Cortex-M4F under qemu in
 * instructions. The mean of a slow stroke, against a step written by hand; median and worst of random
 * steps, each the least of some repetitions. */
#include "bench_clock.h"
#include "bench_models.h"

#include <stdio.h>
#include <stdlib.h>

enum { STEPS = 1000, PIECE = 100 };

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

static void step(who stepper, const bench_case *one, const sc_model *model, sc_crack *crack,
                 bench_place at, sc_step_output *out)
{
    if (stepper == CORE) {
        sc_model_step(model, crack, at.opening, at.rate, at.advance, out);
    } else {
        bench_by_hand(one, crack, at.opening, at.rate, at.advance, out);
    }
}

/* Mean of a slow stroke's steps, the least of some strokes; a piece of it fits into any clock. */
static uint32_t mean_of_stroke(who stepper, const bench_case *one, const sc_model *model)
{
    uint32_t best = UINT32_MAX;
    for (int i = 0; i < BENCH_REPEATS; i++) {
        sc_crack crack = {0.0f, 0, 0, 0};
        sc_step_output out;
        uint32_t took = 0;
        for (int32_t k = 0; k < STEPS; k += PIECE) {
            const uint32_t start = bench_now();
            for (int32_t j = k; j < k + PIECE; j++) {
                step(stepper, one, model, &crack, bench_stroke(j, STEPS), &out);
            }
            took += bench_since(start) / PIECE;
        }
        best = took < best ? took : best;
    }
    return best / (STEPS / PIECE);
}

static int by_size(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Random steps, in order of what they took; the clock's share is taken off. */
static void random_steps(const bench_case *one, const sc_model *model, uint32_t *took)
{
    uint32_t seed = 20240501u;
    const uint32_t nothing = bench_nothing();
    for (int32_t k = 0; k < STEPS; k++) {
        sc_crack from = {0.0f, 0, 0, 0};
        const bench_place at = bench_random(&seed, &from.crack);
        took[k] = UINT32_MAX;
        for (int i = 0; i < BENCH_REPEATS; i++) {
            sc_crack crack = from;
            sc_step_output out;
            const uint32_t start = bench_now();
            step(CORE, one, model, &crack, at, &out);
            const uint32_t passed = bench_since(start);
            took[k] = passed < took[k] ? passed : took[k];
        }
        took[k] = took[k] > nothing ? took[k] - nothing : 0;
    }
    qsort(took, STEPS, sizeof *took, by_size);
}

/* The clock counts what it should. */
static int clock_is_right(void)
{
    const uint32_t start = bench_now();
    bench_known();
    const int64_t away = (int64_t)bench_since(start) - (int64_t)bench_nothing() - BENCH_KNOWN;
    return BENCH_KNOWN == 0 || (away >= -2 && away <= 2);
}

int main(void)
{
    static bench_room room;
    static uint32_t random[STEPS];
    bench_start();
    if (!clock_is_right()) {
        printf("the clock does not count instructions\n");
        return 1;
    }
    printf("%-34s %9s %9s %7s %9s %9s\n", BENCH_UNIT, "by hand", "stroke", "ratio", "random",
           "worst");
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        sc_model model = bench_model(&CASES[i], &room);
        if (i + 1 == sizeof CASES / sizeof *CASES) {
            model.release_falls = 0;
        }
        const uint32_t hand = mean_of_stroke(BY_HAND, &CASES[i], &model);
        const uint32_t stroke = mean_of_stroke(CORE, &CASES[i], &model);
        random_steps(&CASES[i], &model, random);
        printf("%-34s %9lu %9lu %7.2f %9lu %9lu\n", CASES[i].title, (unsigned long)hand,
               (unsigned long)stroke, (double)stroke / (double)hand,
               (unsigned long)random[STEPS / 2], (unsigned long)random[STEPS - 1]);
    }
    return 0;
}
