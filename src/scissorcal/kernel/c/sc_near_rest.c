#include "sc_near_rest.h"

#include <math.h>

void sc_near_rest(const sc_model *model, float width, sc_anchor *anchor, float opening, float rate,
                  sc_step_output *step)
{
    if (!model->render_friction || !(width > 0.0f) || (step->flags & SC_STEP_INVALID)) {
        return;
    }
    if (!anchor->is_set) {
        anchor->opening = opening;
        anchor->is_set = 1;
    }
    float stretch = opening - anchor->opening;
    if (fabsf(stretch) > width) {
        stretch = fminf(fmaxf(stretch, -width), width);
        anchor->opening = opening - stretch;
    }
    const float speed = fmaxf(fabsf(rate), model->friction_rate_eps);
    const float level = sc_model_friction(model, opening, stretch > 0.0f ? speed : -speed);
    const float torque = -fabsf(level) * stretch / width;
    step->torque += torque - step->friction_torque;
    step->friction_torque = torque;
}
