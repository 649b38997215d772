#include "sc_plate.h"

#include <math.h>
#include <string.h>

static const float FARTHEST_M = 10.0f;
static const float STEEPEST_PITCH = 1.0f; /* rad */
static const float WIDEST_STRETCH = 2.0f;

static int is_stretch(float value)
{
    return value >= 1.0f / WIDEST_STRETCH && value <= WIDEST_STRETCH;
}

int sc_section_is_sound(const sc_section *section, int32_t moving_blades)
{
    const float most = moving_blades == 1 ? STEEPEST_PITCH : 0.0f;
    return fabsf(section->edge_x) <= FARTHEST_M && fabsf(section->edge_y) <= FARTHEST_M &&
           fabsf(section->pitch) <= most && is_stretch(section->stretch) &&
           is_stretch(section->thickening);
}

int sc_plate_config_is_sound(const sc_plate_config *config)
{
    return !config->is_estimated ||
           (config->stale_us > 0 && config->move_s > 0.0f && isfinite(config->move_s) &&
            config->fall_s > 0.0f && isfinite(config->fall_s) && isfinite(config->face_low) &&
            isfinite(config->face_high));
}

void sc_plate_take(const sc_placing *placing, int32_t moving_blades, sc_plate *plate)
{
    plate->usable = placing->usable && sc_section_is_sound(&placing->section, moving_blades);
    plate->age_us = placing->age_us;
    if (!plate->usable) {
        return;
    }
    plate->from = plate->share > 0.0f ? plate->now : placing->section;
    plate->now = plate->from;
    plate->to = placing->section;
    plate->moved_s = 0.0f;
    plate->placed = 1;
}

void sc_plate_pass(sc_plate *plate, uint32_t elapsed_us)
{
    plate->age_us = plate->age_us <= UINT32_MAX - elapsed_us ? plate->age_us + elapsed_us : UINT32_MAX;
}

static float between(float from, float to, float way)
{
    return from + way * (to - from);
}

void sc_plate_move(const sc_plate_config *config, float ramp_s, float dt, sc_plate *plate)
{
    const int holds = plate->placed && plate->usable && plate->age_us <= config->stale_us;
    if (!holds) {
        plate->share = fmaxf(plate->share - dt / config->fall_s, 0.0f);
    } else {
        plate->share = ramp_s > dt ? fminf(plate->share + dt / ramp_s, 1.0f) : 1.0f;
    }
    plate->moved_s += dt;
    if (!(plate->moved_s < config->move_s)) {
        plate->now = plate->to; /* without the rounding of the line to there */
        return;
    }
    const float way = plate->moved_s / config->move_s;
    plate->now.edge_x = between(plate->from.edge_x, plate->to.edge_x, way);
    plate->now.edge_y = between(plate->from.edge_y, plate->to.edge_y, way);
    plate->now.pitch = between(plate->from.pitch, plate->to.pitch, way);
    plate->now.stretch = between(plate->from.stretch, plate->to.stretch, way);
    plate->now.thickening = between(plate->from.thickening, plate->to.thickening, way);
}

/* A model seen from the plate, and the rig's state there. */
typedef struct {
    sc_model model;
    sc_turn pitch;
    float opening; /* of blades against the face */
    float along;   /* u_n */
} seen;

static void look(const sc_model *model, const sc_section *section, float opening, float advance,
                 seen *from)
{
    const float away = advance - section->edge_x;
    from->model = *model;
    from->pitch = sc_turn_of(section->pitch);
    from->opening = opening - (float)model->moving_blades * section->pitch;
    from->along = from->pitch.cosine * away - from->pitch.sine * section->edge_y;
    from->model.upper_face = from->pitch.sine * away + from->pitch.cosine * section->edge_y;
    from->model.fracture_energy *= section->thickening;
    from->model.render_friction = 0;
}

/* How the edge that presses stands, as the step left it: its slope, and with rate damping the force
 * of one edge instead of the response alone. */
static float press(const seen *from, const sc_step_output *out, float rate, int32_t knot,
                   float *slope)
{
    const float blades = (float)from->model.moving_blades;
    const sc_turn turn = sc_turn_of(from->opening / blades);
    sc_edge_point point;
    point.knot = knot;
    *slope = 0.0f;
    if (!(out->response > 0.0f) ||
        !sc_edge_over(&from->model.edge, turn, out->contact, &point)) {
        return 0.0f;
    }
    *slope = point.slope;
    const float lever = point.x + point.y * point.slope;
    const float damped = 1.0f - from->model.rate_damping * lever * rate / blades;
    return damped > 0.0f ? out->response * damped : 0.0f;
}

/* The gradient of the stored energy by the section. */
static sc_pull pull_of(const seen *from, const sc_step_output *out, float slope, float crack,
                       float stretch)
{
    const float force = (float)from->model.moving_blades * out->response;
    const sc_pull pull = {-force * (slope * from->pitch.cosine + from->pitch.sine),
                          force * (from->pitch.cosine - slope * from->pitch.sine),
                          force * (stretch * crack - slope * out->indentation),
                          -force * slope * crack};
    return pull;
}

void sc_plate_step(const sc_plate_config *config, const sc_model *model, const sc_section *section,
                   sc_crack *state, float opening, float rate, float advance, sc_step_output *out,
                   sc_pull *pull)
{
    seen from;
    sc_crack crack = *state;
    float slope;
    look(model, section, opening, advance, &from);
    const float face = from.model.upper_face;
    if (face < config->face_low || face > config->face_high) {
        from.model.release_falls = 0;
    }
    crack.crack = section->stretch * state->crack;
    sc_model_step(&from.model, &crack, from.opening, rate, from.along, out);
    if (out->flags & SC_STEP_ADVANCED) {
        crack.crack = fmaxf(crack.crack / section->stretch, state->crack);
    } else {
        crack.crack = state->crack;
    }
    *state = crack;
    const float force = press(&from, out, rate, crack.edge_knot, &slope);
    if (out->response > 0.0f) {
        out->force =
            -(float)model->moving_blades * force * (slope * from.pitch.cosine + from.pitch.sine);
    }
    if (pull != NULL) {
        *pull = pull_of(&from, out, slope, crack.crack, section->stretch);
    }
    if (model->render_friction && !(out->flags & SC_STEP_INVALID)) {
        out->friction_torque = -sc_model_friction(model, opening, rate);
        out->torque += out->friction_torque;
    }
}

double sc_plate_work(sc_plate *plate, int rested, float share, const sc_pull *pull)
{
    const sc_pull now = {share * pull->edge_x, share * pull->edge_y, share * pull->pitch,
                         share * pull->stretch};
    const sc_section *to = &plate->now, *from = &plate->booked;
    double work = 0.0;
    if (!rested) {
        work = 0.5 * (((double)plate->pull.edge_x + (double)now.edge_x) *
                          ((double)to->edge_x - (double)from->edge_x) +
                      ((double)plate->pull.edge_y + (double)now.edge_y) *
                          ((double)to->edge_y - (double)from->edge_y) +
                      ((double)plate->pull.pitch + (double)now.pitch) *
                          ((double)to->pitch - (double)from->pitch) +
                      ((double)plate->pull.stretch + (double)now.stretch) *
                          ((double)to->stretch - (double)from->stretch));
    }
    plate->booked = plate->now;
    plate->pull = now;
    return work;
}

float sc_plate_torque(const sc_model *model, const sc_section *section, float opening,
                      float advance, float crack)
{
    seen from;
    float torque, contact;
    const float rate = 0.0f;
    look(model, section, opening, advance, &from);
    from.model.release_falls = 0;
    contact = section->stretch * crack - from.along;
    if (model->fracture_energy > 0.0f) {
        contact = 0.0f; /* it runs out from there to where it holds */
    }
    sc_model_torque_many(&from.model, 1, &from.opening, &rate, &contact, &torque);
    return torque;
}
