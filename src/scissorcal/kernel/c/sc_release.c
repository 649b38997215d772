/* Checks of a model that are made once, before it is stepped. */
#include "sc_fracture.h"

#include <math.h>
#include <stddef.h>

/* Openings of the range, and places in each interval of the edge, at which the release is compared. */
enum { OPENINGS = 65, PLACES = 4 };

/* A dip or bump below this share of the release is rounding. */
static const float DIP = 1e-3f;

/* A table's value may fall below 0 by this share of its largest, as float32 rounds. */
static const float ROUNDING = 1e-6f;

/* Releases are compared between this share of kappa J_c h and its inverse of J_c h. */
static const float MARGIN = 0.9f;

/* The release along the blade, followed outwards. */
typedef struct {
    float least, most; /* releases beyond these are as good as these */
    float peak, low;
    int fallen;
} profile;

/* 0 once the release has fallen and rises again. */
static int falls_on(profile *seen, float release)
{
    const float held = fminf(fmaxf(release, seen->least), seen->most);
    if (!seen->fallen) {
        seen->peak = fmaxf(seen->peak, held);
        seen->fallen = held < seen->peak * (1.0f - DIP);
        seen->low = held;
        return 1;
    }
    seen->low = fminf(seen->low, held);
    return !(held > seen->low * (1.0f + DIP));
}

static int falls_at_opening(const sc_model *model, float opening)
{
    const sc_table *edge = &model->edge;
    const sc_turn turn = sc_turn_of(opening / (float)model->moving_blades);
    const int32_t last = edge->size - 1;
    profile seen = {MARGIN * model->kappa * model->fracture_energy,
                    model->fracture_energy / MARGIN, 0.0f, 0.0f, 0};
    sc_bite bite;
    bite.knot = bite.point.knot = 0;
    for (int32_t i = 0; i <= PLACES * last; i++) {
        const int32_t knot = i / PLACES;
        const float share = (float)(i % PLACES) / (float)PLACES;
        const float width = knot < last ? edge->x[knot + 1] - edge->x[knot] : 0.0f;
        const float station = edge->x[knot] + share * width;
        if (station > model->tip_station) {
            break;
        }
        const int stands = sc_edge_at_station(edge, turn, station, &bite.point);
        sc_sit(model, &bite);
        if (!falls_on(&seen, stands ? sc_release(model, &bite) : 0.0f)) {
            return 0;
        }
    }
    return 1;
}

int sc_model_release_falls(const sc_model *model)
{
    const float span = model->opening_max - model->opening_min;
    for (int i = 0; model->fracture_energy > 0.0f && i < OPENINGS; i++) {
        const float share = (float)i / (float)(OPENINGS - 1);
        if (!falls_at_opening(model, model->opening_min + share * span)) {
            return 0;
        }
    }
    return 1;
}

/* The least value of a table between its ends. */
static float least_value(const sc_table *table)
{
    float least = table->y[0];
    for (int32_t i = 0; i + 1 < table->size; i++) {
        const sc_piece piece = sc_piece_from(table, i);
        const float root = piece.second * piece.second - 3.0f * piece.third * piece.start;
        least = fminf(least, table->y[i + 1]);
        if (piece.start < 0.0f && root > 0.0f) {
            /* where its derivative goes from falling to rising; this form has no cancellation */
            const float t = -piece.start / (piece.second + sqrtf(root));
            if (t > 0.0f && t < 1.0f) {
                const float bend = piece.start + t * (piece.second + t * piece.third);
                least = fminf(least, piece.y + t * bend);
            }
        }
    }
    return least;
}

void sc_model_edge_slopes(sc_model *model)
{
    const sc_table *edge = &model->edge;
    model->flattest = model->steepest = edge->slope[0];
    for (int32_t i = 0; i + 1 < edge->size; i++) {
        const sc_piece piece = sc_piece_from(edge, i);
        const float inner = -piece.second / (3.0f * piece.third); /* where the slope is extreme */
        const float t = inner > 0.0f && inner < 1.0f ? inner : 1.0f;
        const float bent = piece.start + t * (2.0f * piece.second + t * 3.0f * piece.third);
        const float end = edge->slope[i + 1];
        model->flattest = fminf(model->flattest, fminf(end, bent * piece.per_width));
        model->steepest = fmaxf(model->steepest, fmaxf(end, bent * piece.per_width));
    }
}

/* Friction that is negative anywhere would drive the blades. */
static int opposes(const sc_table *table)
{
    float largest = 0.0f;
    if (!sc_table_is_sound(table)) {
        return 0;
    }
    for (int32_t i = 0; i < table->size; i++) {
        largest = fmaxf(largest, table->y[i]);
    }
    return least_value(table) >= -ROUNDING * largest;
}

static int response_is_sound(const sc_table *response)
{
    if (!sc_table_is_sound(response) || response->area == NULL) {
        return 0;
    }
    for (int32_t i = 0; i < response->size; i++) {
        if (!isfinite(response->area[i]) || (i > 0 && response->y[i] < response->y[i - 1])) {
            return 0;
        }
    }
    return response->x[0] == 0.0f && response->y[0] == 0.0f;
}

int sc_model_is_sound(const sc_model *model)
{
    return sc_table_is_sound(&model->edge) && response_is_sound(&model->response) &&
           opposes(&model->friction_opening) && opposes(&model->friction_closing) &&
           opposes(&model->friction_angle) &&
           (model->moving_blades == 1 || model->moving_blades == 2) &&
           (model->closure == SC_CLOSURE_WORK || model->closure == SC_CLOSURE_EQ4) &&
           isfinite(model->upper_face) && isfinite(model->fracture_energy) &&
           model->fracture_energy >= 0.0f && model->kappa > 0.0f && model->kappa <= 1.0f &&
           isfinite(model->rate_damping) && model->rate_damping >= 0.0f &&
           isfinite(model->friction_rate_eps) && model->friction_rate_eps > 0.0f &&
           isfinite(model->handle_radius) && model->tip_station > 0.0f &&
           model->opening_min <= model->opening_max && model->contact_min <= model->contact_max;
}
