#include "sc_hybrid.h"

#include <math.h>
#include <stddef.h>

static const float LARGEST = 1e9f;         /* what is beyond it counts as not finite */
static const float UNIT_TOLERANCE = 1e-3f; /* of the square of the normal's length */

static int is_level(float value)
{
    return value >= 0.0f && value <= LARGEST;
}

int sc_hybrid_config_is_sound(const sc_hybrid_config *config)
{
    const float levels[] = {
        config->contact_kd,      config->force_ki,       config->normal_kp,
        config->normal_kd,       config->path_kp,        config->path_kd,
        config->path_ki,         config->path_error_most, config->force_most,     config->force_slew,
        config->integral_most,   config->leave_force,    config->leave_s,
        config->approach_speed,  config->approach_force, config->friction_share,
        config->slip_rate,       config->touch_force,    config->force_kp,
        config->surface_cutoff_Hz, config->approach_rate};
    for (size_t i = 0; i < sizeof levels / sizeof levels[0]; i++) {
        if (!is_level(levels[i])) {
            return 0;
        }
    }
    if ((config->axes != 2 && config->axes != SC_HYBRID_MOST) || config->normal_law > SC_HYBRID_POSITION) {
        return 0;
    }
    for (int i = 0; i < config->axes; i++) {
        if (!is_level(config->friction_rate[i]) || !is_level(config->effort_limit[i])) {
            return 0;
        }
    }
    return config->leave_force < config->touch_force &&
           config->touch_force <= config->force_most &&
           config->touch_force < config->approach_force && config->least_volume > 0.0f &&
           config->least_volume < 1.0f;
}

static int all_usable(int count, const float *values)
{
    for (int i = 0; i < count; i++) {
        if (!(fabsf(values[i]) <= LARGEST)) {
            return 0;
        }
    }
    return 1;
}

static int is_unit(int count, const float *values)
{
    float square = 0.0f;
    for (int i = 0; i < count; i++) {
        square += values[i] * values[i];
    }
    return fabsf(square - 1.0f) < UNIT_TOLERANCE;
}

int sc_hybrid_input_is_usable(int32_t axes, const sc_hybrid_input *in)
{
    const float single[] = {in->gap,
                            in->surface_acceleration,
                            in->surface_friction,
                            in->force,
                            in->compliance,
                            in->force_wanted,
                            in->gap_wanted,
                            in->gap_rate_wanted,
                            in->dt};
    for (int i = 0; i < axes; i++) {
        if (!all_usable(axes, in->inertia[i]) || !all_usable(axes, in->jacobian[i]) ||
            !is_level(in->dry_friction[i])) {
            return 0;
        }
    }
    return all_usable((int)(sizeof single / sizeof single[0]), single) && in->dt >= 0.0f &&
           in->surface_friction >= 0.0f && in->compliance >= 0.0f && all_usable(axes, in->rate) &&
           all_usable(axes, in->bias) && all_usable(axes, in->jacobian_rate) &&
           all_usable(axes, in->point) && all_usable(axes, in->surface_velocity) &&
           all_usable(axes, in->path) && all_usable(axes, in->path_rate) &&
           all_usable(axes, in->path_acceleration) &&
           is_unit(axes, in->normal);
}
