#include "bench_models.h"

#include <math.h>
#include <string.h>

static const float OFFSET = -0.008f, TAPER = 0.0349207695f, LENGTH = 0.075f, UPPER_FACE = 5e-5f;
static const float REFERENCE = 3e-4f, DEEPEST = 2e-3f, FORCE = 2.0f, RATE_EPS = 0.01f;
static const float CLOSING[2] = {0.012f, 0.006f}, OPENING[2] = {0.010f, 0.004f};
static const float ANGLE[2] = {0.9f, 0.2f};

static const float LINE_X[2] = {0.0f, 1.0f};
static const float LINE_Y[3][2] = {{0.010f, 0.014f}, {0.012f, 0.018f}, {0.9f, 1.1f}};
static const float LINE_SLOPE[3][2] = {{0.004f, 0.004f}, {0.006f, 0.006f}, {0.2f, 0.2f}};

static void fill_edge(const bench_case *one, bench_room *room)
{
    for (int32_t i = 0; i < one->edge_knots; i++) {
        const float s = LENGTH * (float)i / (float)(one->edge_knots - 1);
        room->x[0][i] = s;
        room->y[0][i] = OFFSET + s * (TAPER + 0.5f * one->curvature * s);
        room->slope[0][i] = TAPER + one->curvature * s;
    }
}

static void fill_response(const bench_case *one, bench_room *room)
{
    for (int32_t i = 0; i < one->response_knots; i++) {
        const float share = (float)i / (float)(one->response_knots - 1);
        const float depth = share * share * DEEPEST;
        const float ratio = depth / REFERENCE;
        room->x[1][i] = depth;
        room->y[1][i] = FORCE * powf(ratio, one->exponent);
        room->slope[1][i] = i == 0 ? 0.0f : one->exponent * room->y[1][i] / depth;
    }
    for (int32_t i = 0; i + 1 < one->response_knots; i++) {
        const float chord = (room->y[1][i + 1] - room->y[1][i]) / (room->x[1][i + 1] - room->x[1][i]);
        room->slope[1][i] = fminf(room->slope[1][i], 3.0f * chord); /* so that it never falls */
        room->slope[1][i + 1] = fminf(room->slope[1][i + 1], 3.0f * chord);
    }
}

static sc_table line_table(int which)
{
    const sc_table table = {LINE_X, LINE_Y[which], LINE_SLOPE[which], NULL, 2};
    return table;
}

sc_model bench_model(const bench_case *one, bench_room *room)
{
    sc_model model;
    memset(&model, 0, sizeof model);
    fill_edge(one, room);
    fill_response(one, room);
    const sc_table edge = {room->x[0], room->y[0], room->slope[0], NULL, one->edge_knots};
    const sc_table response = {room->x[1], room->y[1], room->slope[1], room->area,
                               one->response_knots};
    sc_table_accumulate(&response, room->area);
    model.edge = edge;
    model.response = response;
    model.friction_opening = line_table(0);
    model.friction_closing = line_table(1);
    model.friction_angle = line_table(2);
    model.moving_blades = 2;
    model.closure = SC_CLOSURE_WORK;
    model.render_friction = one->render_friction;
    model.upper_face = UPPER_FACE;
    model.fracture_energy = one->fracture_energy;
    model.kappa = one->kappa;
    model.friction_rate_eps = RATE_EPS;
    model.handle_radius = 0.06f;
    model.tip_station = LENGTH;
    model.opening_min = 0.2f;
    model.opening_max = 0.9f;
    model.contact_min = 0.015f;
    model.contact_max = 0.06f;
    model.release_falls = sc_model_release_falls(&model);
    return model;
}

bench_place bench_stroke(int32_t k, int32_t steps)
{
    const bench_place place = {0.8f - 0.5f * (float)k / (float)steps, -0.5f, -0.02f};
    return place;
}

/* Marsaglia 2003, xorshift32, as a share of 1. */
static float share_of(uint32_t *seed)
{
    *seed ^= *seed << 13;
    *seed ^= *seed >> 17;
    *seed ^= *seed << 5;
    return (float)(*seed >> 8) / 16777216.0f;
}

bench_place bench_random(uint32_t *seed, float *crack)
{
    bench_place place;
    place.opening = 0.2f + 0.7f * share_of(seed);
    place.rate = 4.0f * share_of(seed) - 2.0f;
    place.advance = -0.02f;
    *crack = place.advance + 0.015f + 0.045f * share_of(seed);
    return place;
}

static float friction_by_hand(float opening, float rate)
{
    const float speed = fabsf(rate);
    const float *line = rate > 0.0f ? OPENING : CLOSING;
    float level = line[0] + line[1] * fminf(fmaxf(speed, RATE_EPS), 1.0f);
    if (speed < RATE_EPS) {
        level *= speed / RATE_EPS;
    }
    level *= ANGLE[0] + ANGLE[1] * fminf(fmaxf(opening, 0.0f), 1.0f);
    return rate > 0.0f ? level : -level;
}

void bench_by_hand(const bench_case *one, sc_crack *state, float opening, float rate, float advance,
                   sc_step_output *out)
{
    const float beta = 0.5f * opening, sine = sinf(beta), cosine = cosf(beta);
    const float run = cosine - TAPER * sine, slope = (sine + TAPER * cosine) / run;
    const float zero = OFFSET / run; /* height of the edge's line over the pivot, as y = zero + slope x */
    float contact = state->crack - advance;
    float depth = UPPER_FACE - zero - slope * contact;
    memset(out, 0, sizeof *out);
    if (depth > 0.0f && slope > 0.0f) {
        float force = FORCE * powf(depth / REFERENCE, one->exponent);
        if (2.0f * force * slope > one->fracture_energy && one->fracture_energy > 0.0f) {
            force = one->fracture_energy / (2.0f * slope);
            depth = REFERENCE * powf(force / FORCE, 1.0f / one->exponent);
            contact = (UPPER_FACE - depth - zero) / slope;
            out->fracture_J = one->fracture_energy * (contact + advance - state->crack);
            state->crack = contact + advance;
        }
        out->response = force;
        out->stored_J = 2.0f * force * depth / (one->exponent + 1.0f);
        out->torque = force * (contact + (UPPER_FACE - depth) * slope);
        out->force = -2.0f * force * slope;
    }
    out->contact = contact;
    out->indentation = depth;
    out->height = UPPER_FACE - depth;
    if (one->render_friction) {
        out->friction_torque = -friction_by_hand(opening, rate);
        out->torque += out->friction_torque;
    }
    if (!isfinite(out->torque) || !isfinite(out->force)) {
        memset(out, 0, sizeof *out);
    }
}
