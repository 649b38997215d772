/* What a step of one model takes: the model and its states stand in model_data.h, which is generated.
 * Prints the work of loading the model, of the mean step of a slow closing stroke and of the mean settled
 * torque; then a line for each state: work of its step, and its settled mean torque. Work is ns here, instructions on a Cortex-M under qemu. */
#include "bench_clock.h"
#include "model_data.h"

#include <stdio.h>

enum { STEPS = 1000, PIECE = 10 };

/* Mean of a stroke's steps, the least of some strokes; a piece of it fits into any clock. */
static uint32_t mean_of_stroke(const sc_model *model, uint32_t nothing)
{
    const float span = model->opening_max - model->opening_min;
    uint32_t best = UINT32_MAX;
    for (int i = 0; i < BENCH_REPEATS; i++) {
        sc_crack crack = {model->contact_min, 0, 0, 0};
        sc_step_output out;
        uint32_t took = 0;
        for (int32_t k = 0; k < STEPS; k += PIECE) {
            const uint32_t start = bench_now();
            for (int32_t j = k; j < k + PIECE; j++) {
                const float opening = model->opening_max - span * (float)j / (float)STEPS;
                sc_model_step(model, &crack, opening, STROKE_RATE, 0.0f, &out);
            }
            const uint32_t passed = bench_since(start);
            took += passed > nothing ? passed - nothing : 0;
        }
        best = took < best ? took : best;
    }
    return best / STEPS;
}

/* Mean of the settled torques of all states, likewise. */
static uint32_t mean_of_torques(const sc_model *model, uint32_t nothing)
{
    volatile float kept = 0.0f;
    uint32_t best = UINT32_MAX;
    for (int i = 0; i < BENCH_REPEATS; i++) {
        uint64_t took = 0;
        for (int32_t k = 0; k + PIECE <= STATES; k += PIECE) {
            const uint32_t start = bench_now();
            for (int32_t j = k; j < k + PIECE; j++) {
                kept = sc_model_settled_torque(model, STATE[j][0], STATE[j][1], STATE[j][2]);
            }
            const uint32_t passed = bench_since(start);
            took += passed > nothing ? passed - nothing : 0;
        }
        const uint32_t mean = (uint32_t)(took / (STATES / PIECE * PIECE));
        best = mean < best ? mean : best;
    }
    (void)kept;
    return best;
}

static uint32_t of_state(const sc_model *model, const float *at, uint32_t nothing)
{
    uint32_t best = UINT32_MAX;
    for (int i = 0; i < BENCH_REPEATS; i++) {
        sc_crack crack = {at[2], 0, 0, 0};
        sc_step_output out;
        const uint32_t start = bench_now();
        sc_model_step(model, &crack, at[0], at[1], 0.0f, &out);
        const uint32_t passed = bench_since(start);
        best = passed < best ? passed : best;
    }
    return best > nothing ? best - nothing : 0;
}

int main(void)
{
    static sc_model model;
    bench_start();
    const uint32_t nothing = bench_nothing();
    const uint32_t start = bench_now();
    const int loads = load_model(&model);
    const uint32_t loading = bench_since(start);
    if (!loads || !sc_model_is_sound(&model)) {
        printf("the model is not sound\n");
        return 1;
    }
    model.release_falls = sc_model_release_falls(&model);
    sc_model smooth = model;
    smooth.kappa = 1.0f;
    printf("%lu %lu %lu\n", (unsigned long)loading, (unsigned long)mean_of_stroke(&model, nothing),
           (unsigned long)mean_of_torques(&model, nothing));
    for (int32_t k = 0; k < STATES; k++) {
        const float *at = STATE[k];
        const uint32_t took = of_state(&model, at, nothing);
        smooth.fracture_energy = at[3];
        const float torque = sc_model_settled_torque(&smooth, at[0], at[1], at[2]);
        printf("%lu %.17g\n", (unsigned long)took, (double)torque);
    }
    return 0;
}
