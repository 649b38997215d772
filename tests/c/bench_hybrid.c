/* How long a step of the hybrid law takes: on the host in nanoseconds, on a Cortex-M4F under qemu in
 * instructions. Median and worst of steps at random states, each the least of some repetitions. */
#include "bench_clock.h"
#include "sc_hybrid.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { STEPS = 500 };

typedef struct {
    const char *title;
    int32_t axes;
    uint32_t law;
    float force;
} hybrid_case;

static const hybrid_case CASES[] = {
    {"hybrid law of 2 axes: approach", 2, SC_HYBRID_FORCE, 0.0f},
    {"hybrid law of 2 axes: pressing", 2, SC_HYBRID_FORCE, 2.0f},
    {"hybrid law of 2 axes: position", 2, SC_HYBRID_POSITION, 2.0f},
    {"hybrid law of 3 axes: pressing", 3, SC_HYBRID_FORCE, 2.0f},
};

static float random_unit(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (float)(*seed >> 8) / 8388608.0f - 1.0f;
}

static sc_hybrid_config config_of(const hybrid_case *one)
{
    const sc_hybrid_config config = {.axes = one->axes,
                                     .normal_law = one->law,
                                     .contact_kd = 100.0f,
                                     .force_kp = 0.5f,
                                     .force_ki = 10.0f,
                                     .surface_cutoff_Hz = 100.0f,
                                     .normal_kp = 4000.0f,
                                     .normal_kd = 100.0f,
                                     .path_kp = 4000.0f,
                                     .path_kd = 100.0f,
                                     .path_ki = 3e4f,
                                     .path_error_most = 2e-3f,
                                     .force_most = 5.0f,
                                     .force_slew = 10.0f,
                                     .integral_most = 3.0f,
                                     .touch_force = 0.2f,
                                     .leave_force = 0.1f,
                                     .leave_s = 0.02f,
                                     .approach_speed = 5e-3f,
                                     .approach_rate = 2.0f,
                                     .approach_force = 0.6f,
                                     .friction_share = 0.7f,
                                     .slip_rate = 1e-3f,
                                     .friction_rate = {0.2f, 0.01f, 0.2f},
                                     .effort_limit = {0.5f, 20.0f, 20.0f},
                                     .least_volume = 0.05f};
    return config;
}

static sc_hybrid_input input_of(const hybrid_case *one, uint32_t *seed)
{
    sc_hybrid_input in;
    memset(&in, 0, sizeof in);
    in.dt = 1e-3f;
    float square = 0.0f;
    for (int i = 0; i < one->axes; i++) {
        in.rate[i] = random_unit(seed);
        in.inertia[i][i] = 0.1f + 0.05f * random_unit(seed);
        in.bias[i] = random_unit(seed);
        in.dry_friction[i] = 0.1f;
        for (int j = 0; j < one->axes; j++) {
            in.jacobian[i][j] = (i == j ? 1.0f : 0.0f) + 0.3f * random_unit(seed);
        }
        in.normal[i] = i == 1 ? 1.0f : 0.3f * random_unit(seed);
        square += in.normal[i] * in.normal[i];
        in.point[i] = 0.01f * random_unit(seed);
        in.path[i] = 0.01f * random_unit(seed);
        in.path_rate[i] = random_unit(seed);
    }
    for (int i = 0; i < one->axes; i++) {
        in.normal[i] /= sqrtf(square);
    }
    in.surface_friction = 0.2f;
    in.force = one->force * (1.0f + 0.1f * random_unit(seed));
    in.force_wanted = 2.0f;
    in.compliance = 1e-4f;
    return in;
}

static int by_size(const void *a, const void *b)
{
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

int main(void)
{
    static uint32_t took[STEPS];
    bench_start();
    const uint32_t nothing = bench_nothing();
    printf("%-34s %9s %9s\n", BENCH_UNIT, "median", "worst");
    for (size_t i = 0; i < sizeof CASES / sizeof *CASES; i++) {
        const sc_hybrid_config config = config_of(&CASES[i]);
        uint32_t seed = 20240501u;
        if (!sc_hybrid_config_is_sound(&config)) {
            printf("the settings are not sound\n");
            return 1;
        }
        for (int32_t k = 0; k < STEPS; k++) {
            const sc_hybrid_input input = input_of(&CASES[i], &seed);
            took[k] = UINT32_MAX;
            for (int n = 0; n < BENCH_REPEATS; n++) {
                sc_hybrid state;
                sc_hybrid_output out;
                memset(&state, 0, sizeof state);
                const uint32_t start = bench_now();
                sc_hybrid_step(&config, &state, &input, &out);
                const uint32_t passed = bench_since(start);
                took[k] = passed < took[k] ? passed : took[k];
            }
            took[k] = took[k] > nothing ? took[k] - nothing : 0;
        }
        qsort(took, STEPS, sizeof *took, by_size);
        printf("%-34s %9lu %9lu\n", CASES[i].title, (unsigned long)took[STEPS / 2],
               (unsigned long)took[STEPS - 1]);
    }
    return 0;
}
