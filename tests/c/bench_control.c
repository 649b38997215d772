/* How long a tick of the mode CONTROL takes: on the host in nanoseconds, on a Cortex-M4F under qemu in
 * instructions. Median and worst over a motion, each the least of some repetitions. */
#include "bench_clock.h"
#include "controls.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 500, PATH_TICKS = 1000 };

typedef struct {
    const char *title;
    float pressed; /* force on the tip from then on [N] */
    float curvature;
    float turn_rate;
} control_case;

static const control_case CASES[] = {
    {"CONTROL: approach", 0.0f, 0.0f, 0.0f},
    {"CONTROL: pressing on a plane", 2.0f, 0.0f, 0.0f},
    {"CONTROL: pressing on a turning bulge", 2.0f, 25.0f, 0.05f},
};

/* Nothing ends the mode while it is measured. */
static sc_control_config endless(void)
{
    sc_control_config c = sound_control();
    c.stale_s = c.approach_s = c.force_stop = 1e3f;
    c.end_s = 1e4f;
    c.away = c.path_stop = 1.0f;
    return c;
}

static int by_size(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* The blades as they close slowly, pressed by a steady torque from the tenth tick on. */
static sc_control_tick tick_at(const control_case *one, int k)
{
    const float pressed = k > 10 ? one->pressed * 0.035f : 0.0f;
    const sc_control_tick tick = {1e-3f, 0.5f - 5e-5f * (float)k, -0.05f, 1e-5f * (float)k, 0.01f,
                                  -0.015f - pressed, 0.01f};
    return tick;
}

static uint32_t least(const sc_control_task *task, sc_control *control, const sc_control_tick *tick)
{
    uint32_t best = UINT32_MAX;
    float effort[2];
    for (int n = 0; n < BENCH_REPEATS; n++) {
        sc_control copy = *control;
        const uint32_t start = bench_now();
        (void)sc_control_step(task, &copy, tick, effort);
        const uint32_t passed = bench_since(start);
        best = passed < best ? passed : best;
    }
    (void)sc_control_step(task, control, tick, effort);
    return best;
}

int main(void)
{
    static uint32_t took[STEPS];
    static float place[PATH_TICKS], rate[PATH_TICKS], force[PATH_TICKS];
    static int32_t stage[PATH_TICKS];
    static sc_control_config config;
    bench_start();
    const uint32_t nothing = bench_nothing();
    config = endless();
    if (!sc_control_config_is_sound(&config)) {
        printf("the settings are not sound\n");
        return 1;
    }
    for (int i = 0; i < PATH_TICKS; i++) {
        place[i] = 1e-5f * (float)i;
        rate[i] = 0.01f;
        force[i] = 2.0f;
    }
    printf("%-38s %9s %9s\n", BENCH_UNIT, "median", "worst");
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        static sc_control control;
        sc_control_task task = {&config,
                                {{0.07f, 0.01f}, {0.0f, 1.0f}, CASES[i].curvature, 0.0f,
                                 {0.0f, 0.0f}, CASES[i].turn_rate, 0, 1},
                                {place, rate, force, stage, PATH_TICKS}};
        memset(&control, 0, sizeof control);
        for (int k = 0; k < STEPS; k++) {
            const sc_control_tick tick = tick_at(&CASES[i], k);
            const uint32_t passed = least(&task, &control, &tick);
            took[k] = passed > nothing ? passed - nothing : 0;
        }
        if ((control.law.touching != 0) != (CASES[i].pressed > 0.0f)) {
            printf("%s: the tip does not do what the case is about\n", CASES[i].title);
            return 1;
        }
        qsort(took, STEPS, sizeof *took, by_size);
        printf("%-38s %9lu %9lu\n", CASES[i].title, (unsigned long)took[STEPS / 2],
               (unsigned long)took[STEPS - 1]);
    }
    return 0;
}
