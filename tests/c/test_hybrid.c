/* The hybrid law against its reference's answers; extremes and nonsense give bounded efforts. */
#include "arrays.h"
#include "check.h"
#include "sc_hybrid.h"

#include <stddef.h>
#include <string.h>

typedef struct {
    const char *name;
    size_t offset;
    size_t count; /* of numbers, all float */
} member;

#define OF(type, name) {#name, offsetof(type, name), sizeof(((type *)0)->name) / sizeof(float)}
#define COUNT(array) (sizeof(array) / sizeof *(array))

static const member CONFIG[] = {
    OF(sc_hybrid_config, contact_kd),      OF(sc_hybrid_config, force_ki),
    OF(sc_hybrid_config, approach_rate),
    OF(sc_hybrid_config, force_kp),        OF(sc_hybrid_config, surface_cutoff_Hz),
    OF(sc_hybrid_config, normal_kp),       OF(sc_hybrid_config, normal_kd),
    OF(sc_hybrid_config, path_kp),         OF(sc_hybrid_config, path_kd),
    OF(sc_hybrid_config, path_ki),
    OF(sc_hybrid_config, path_error_most), OF(sc_hybrid_config, force_most),
    OF(sc_hybrid_config, force_slew),      OF(sc_hybrid_config, integral_most),
    OF(sc_hybrid_config, touch_force),     OF(sc_hybrid_config, leave_force),
    OF(sc_hybrid_config, leave_s),         OF(sc_hybrid_config, approach_speed),
    OF(sc_hybrid_config, approach_force),  OF(sc_hybrid_config, friction_share),
    OF(sc_hybrid_config, slip_rate),       OF(sc_hybrid_config, least_volume),
};

static const member INPUT[] = {
    OF(sc_hybrid_input, dt),
    OF(sc_hybrid_input, rate),
    OF(sc_hybrid_input, inertia),
    OF(sc_hybrid_input, bias),
    OF(sc_hybrid_input, dry_friction),
    OF(sc_hybrid_input, jacobian),
    OF(sc_hybrid_input, jacobian_rate),
    OF(sc_hybrid_input, point),
    OF(sc_hybrid_input, normal),
    OF(sc_hybrid_input, gap),
    OF(sc_hybrid_input, surface_velocity),
    OF(sc_hybrid_input, surface_acceleration),
    OF(sc_hybrid_input, surface_friction),
    OF(sc_hybrid_input, force),
    OF(sc_hybrid_input, compliance),
    OF(sc_hybrid_input, force_wanted),
    OF(sc_hybrid_input, gap_wanted),
    OF(sc_hybrid_input, gap_rate_wanted),
    OF(sc_hybrid_input, path),
    OF(sc_hybrid_input, path_rate),
    OF(sc_hybrid_input, path_acceleration),
};

static const member OUTPUT[] = {
    OF(sc_hybrid_output, effort),     OF(sc_hybrid_output, force_aim),
    OF(sc_hybrid_output, pressing),   OF(sc_hybrid_output, mass),
    OF(sc_hybrid_output, gap_rate),   OF(sc_hybrid_output, path_error),
    OF(sc_hybrid_output, path_share),
};

static float *numbers(void *object, const member *one)
{
    return (float *)(void *)((char *)object + one->offset);
}

static float number_of(const json *value)
{
    return value->kind == JSON_NULL ? NAN : (float)value->number;
}

static sc_hybrid_config config_of(const json *one)
{
    const json *from = json_get(one, "config");
    sc_hybrid_config config;
    memset(&config, 0, sizeof config);
    config.axes = (int32_t)json_number(from, "axes");
    config.normal_law = (uint32_t)json_number(from, "normal_law");
    for (size_t i = 0; i < COUNT(CONFIG); i++) {
        *numbers(&config, &CONFIG[i]) = (float)json_number(from, CONFIG[i].name);
    }
    for (int32_t j = 0; j < config.axes; j++) {
        config.friction_rate[j] = number_of(&json_get(from, "friction_rate")->items[j]);
        config.effort_limit[j] = number_of(&json_get(from, "effort_limit")->items[j]);
    }
    return config;
}

/* Inputs of a case, in an array of their exact size. */
static sc_hybrid_input *inputs_of(const json *one, size_t steps)
{
    sc_hybrid_input *inputs = room(steps * sizeof *inputs);
    for (size_t i = 0; i < COUNT(INPUT); i++) {
        const json *column = json_get(json_get(one, "in"), INPUT[i].name);
        for (size_t k = 0; k < steps; k++) {
            for (size_t j = 0; j < INPUT[i].count; j++) {
                numbers(&inputs[k], &INPUT[i])[j] =
                    number_of(&column->items[k * INPUT[i].count + j]);
            }
        }
    }
    return inputs;
}

static void check_answers(const json *one, sc_hybrid_output *outputs, size_t steps,
                          double tolerance)
{
    const char *title = json_text(one, "title");
    const json *wanted = json_get(one, "out");
    for (size_t i = 0; i < COUNT(OUTPUT); i++) {
        const json *column = json_get(wanted, OUTPUT[i].name);
        double largest = 1e-12;
        for (size_t k = 0; k < column->size; k++) {
            largest = fmax(largest, fabs(column->items[k].number));
        }
        for (size_t k = 0; k < column->size; k++) {
            const size_t step = k / OUTPUT[i].count;
            NEAR((double)numbers(&outputs[step], &OUTPUT[i])[k % OUTPUT[i].count],
                 column->items[k].number, tolerance * largest, OUTPUT[i].name, title);
        }
    }
    for (size_t k = 0; k < steps; k++) {
        CHECK(outputs[k].flags == (uint32_t)json_get(wanted, "flags")->items[k].number, title);
    }
}

static int is_bounded(const sc_hybrid_config *config, const sc_hybrid_output *out)
{
    for (int j = 0; j < SC_HYBRID_MOST; j++) {
        const float most = j < config->axes ? config->effort_limit[j] : 0.0f;
        if (!(fabsf(out->effort[j]) <= most)) {
            return 0;
        }
    }
    return isfinite(out->force_aim) && isfinite(out->pressing) && isfinite(out->mass) &&
           isfinite(out->gap_rate) && isfinite(out->path_error) && out->path_share >= 0.0f &&
           out->path_share <= 1.0f;
}

/* Each number of an input in turn is nonsense: no effort, and the next step is a usual one. */
static void check_nonsense(const sc_hybrid_config *config, const sc_hybrid_input *usual,
                           const char *title)
{
    const float nonsense[] = {NAN, INFINITY, -INFINITY, 3e38f, -3e38f};
    for (size_t i = 0; i < COUNT(INPUT); i++) {
        for (size_t n = 0; n < COUNT(nonsense); n++) {
            sc_hybrid state;
            sc_hybrid_output out;
            sc_hybrid_input input = *usual;
            memset(&state, 0, sizeof state);
            state.touching = 1;
            state.integral = 1.0f;
            numbers(&input, &INPUT[i])[0] = nonsense[n];
            sc_hybrid_step(config, &state, &input, &out);
            CHECK(out.flags == SC_HYBRID_INVALID && is_bounded(config, &out), INPUT[i].name);
            CHECK(out.effort[0] == 0.0f && out.effort[1] == 0.0f, title);
            CHECK(!state.touching && state.integral == 0.0f, title);
            sc_hybrid_step(config, &state, usual, &out);
            CHECK(!(out.flags & SC_HYBRID_INVALID) && is_bounded(config, &out), title);
        }
    }
}

static float random_float(uint32_t *seed, int wild)
{
    *seed = *seed * 1664525u + 1013904223u;
    const float unit = (float)(*seed >> 8) / 8388608.0f - 1.0f;
    *seed = *seed * 1664525u + 1013904223u;
    return wild ? ldexpf(unit, (int)((*seed >> 8) % 80u) - 50) : unit;
}

/* Random inputs, of every size: efforts stay finite and within the limits. */
static void check_random(const sc_hybrid_config *config, const sc_hybrid_input *usual)
{
    uint32_t seed = 12345u;
    int32_t worked = 0;
    sc_hybrid state;
    memset(&state, 0, sizeof state);
    for (int32_t k = 0; k < 20000; k++) {
        sc_hybrid_output out;
        sc_hybrid_input input = *usual;
        for (size_t i = 0; i < COUNT(INPUT); i++) {
            if (k % 3 == 0 || strcmp(INPUT[i].name, "normal") != 0) {
                for (size_t j = 0; j < INPUT[i].count; j++) {
                    numbers(&input, &INPUT[i])[j] *= random_float(&seed, k % 2);
                }
            }
        }
        sc_hybrid_step(config, &state, &input, &out);
        CHECK(is_bounded(config, &out), "random inputs");
        worked += out.flags <= SC_HYBRID_CONTACT * 2 && !(out.flags & SC_HYBRID_INVALID);
    }
    CHECK(worked > 100, "random inputs");
}

static void check_configs(const sc_hybrid_config *sound)
{
    CHECK(sc_hybrid_config_is_sound(sound), "config");
    for (size_t i = 0; i < COUNT(CONFIG); i++) {
        const float nonsense[] = {NAN, INFINITY, -1.0f, 2e9f};
        for (size_t n = 0; n < COUNT(nonsense); n++) {
            sc_hybrid_config config = *sound;
            *numbers(&config, &CONFIG[i]) = nonsense[n];
            CHECK(!sc_hybrid_config_is_sound(&config), CONFIG[i].name);
        }
    }
    sc_hybrid_config config = *sound;
    config.axes = 4;
    CHECK(!sc_hybrid_config_is_sound(&config), "four axes");
    config = *sound;
    config.normal_law = 2;
    CHECK(!sc_hybrid_config_is_sound(&config), "no such law");
    config = *sound;
    config.leave_force = config.touch_force;
    CHECK(!sc_hybrid_config_is_sound(&config), "leaves where it touches");
    config = *sound;
    config.approach_force = config.touch_force;
    CHECK(!sc_hybrid_config_is_sound(&config), "an approach that never touches");
    config = *sound;
    config.effort_limit[1] = NAN;
    CHECK(!sc_hybrid_config_is_sound(&config), "no limit");
}

int main(int argc, char **argv)
{
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "hybrid.json");
    const json *cases = json_get(&vectors, "cases");
    const size_t steps = (size_t)json_number(&vectors, "steps");
    for (size_t i = 0; i < cases->size; i++) {
        const json *one = &cases->items[i];
        const sc_hybrid_config config = config_of(one);
        sc_hybrid_input *inputs = inputs_of(one, steps);
        sc_hybrid_output *outputs = room(steps * sizeof *outputs);
        sc_hybrid state;
        memset(&state, 0, sizeof state);
        sc_hybrid_step_many(&config, &state, (int64_t)steps, inputs, outputs);
        check_answers(one, outputs, steps, json_number(&vectors, "tolerance"));
        check_nonsense(&config, &inputs[0], json_text(one, "title"));
        check_random(&config, &inputs[steps - 1]);
        check_configs(&config);
        free_arrays();
    }
    json_free(&vectors);
    return checks_done("hybrid");
}
