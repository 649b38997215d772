/* Any usable input of the force and position law, in any sound configuration: efforts are finite and limited. */
#include "../controls.h"
#include "input.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input from = {data, size};
    sc_hybrid_config config = sound_control().law;
    config.axes = 2 + take_byte(&from) % 2;
    config.normal_law = take_byte(&from) % 2;
    if (config.axes == 3) {
        config.effort_limit[2] = 5.0f;
        config.friction_rate[2] = 0.01f;
    }
    change_words(&from, &config, sizeof config);
    if (!sc_hybrid_config_is_sound(&config)) return 0;
    sc_hybrid state, other;
    sc_hybrid_input one;
    sc_hybrid_output out, again;
    memset(&state, 0, sizeof state);
    memset(&one, 0, sizeof one);
    one.dt = 1e-3f;
    for (int i = 0; i < SC_HYBRID_MOST; i++) {
        one.inertia[i][i] = i == 0 ? 1e-3f : 0.8f;
        one.jacobian[i][i] = i == 0 ? 0.07f : 1.0f;
    }
    one.normal[0] = 1.0f;
    for (int i = 0; i < 300 && from.size > 0; i++) {
        const uint8_t what = take_byte(&from);
        one.gap = take_float(&from, -1e-3f, 5e-3f);
        one.force = what & 1 ? take_float(&from, 0.0f, 5.0f) : 0.0f;
        one.force_wanted = what & 2 ? take_float(&from, 0.0f, 6.0f) : 0.0f;
        one.surface_friction = what & 4 ? 0.2f : 0.0f;
        one.compliance = what & 8 ? 1e-4f : 0.0f;
        if (what & 16) change_words(&from, &one, sizeof one);
        const int usable = sc_hybrid_input_is_usable(config.axes, &one);
        other = state;
        sc_hybrid_step(&config, &state, &one, &out);
        sc_hybrid_step_many(&config, &other, 1, &one, &again);
        PROMISED(memcmp(&out, &again, sizeof out) == 0);
        for (int axis = 0; axis < config.axes; axis++) {
            PROMISED(isfinite(out.effort[axis]));
            PROMISED(fabsf(out.effort[axis]) <= config.effort_limit[axis]);
            PROMISED(usable || out.effort[axis] == 0.0f);
        }
        PROMISED(out.path_share >= 0.0f && out.path_share <= 1.0f);
    }
    return 0;
}
