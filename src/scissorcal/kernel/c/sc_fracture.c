#include "sc_fracture.h"

#include <math.h>

static const float RESPONSE_CAP = 1e6f; /* N: far beyond any rig, keeps all that follows finite */
static const float PARALLEL = 1e-6f;    /* tan(psi) up to which edges count as parallel */
static const float RESOLUTION = 1e-7f;  /* of a station: about the resolution of float */

/* Up to this change of the force that is borne, its indentation is taken along the tangent: an error
 * of less than its square, 1e-6. */
static const float SMALL_CHANGE = 1e-3f;

/* Share of the lengths that a gap is the difference of, up to which it is their rounding. */
static const float ROUNDED = 1e-6f;

/* Up to this share of the station, a step that is left is made along the tangent of the edge. */
static const float SHORT_STEP = 1e-4f;

void sc_sit(const sc_model *model, sc_bite *bite)
{
    const sc_table *response = &model->response;
    sc_place at = {bite->knot, 0.0f, 0.0f, 0.0f, 0.0f};
    bite->indentation = model->upper_face - bite->point.y;
    bite->force = bite->stored = 0.0f;
    if (!(bite->indentation > 0.0f)) {
        return;
    }
    sc_table_look(response, bite->indentation, &at);
    const int32_t last = response->size - 1;
    if (at.y > RESPONSE_CAP && at.index == last && at.slope > 0.0f) {
        /* Summed from the table's end on: what lies beyond may be so much larger than the capped
         * energy that a difference of the two has no digit left. */
        const float rise = fmaxf(RESPONSE_CAP - response->y[last], 0.0f);
        const float reached = rise / at.slope;
        const float beyond = bite->indentation - response->x[last] - reached;
        at.area = response->area[last] + reached * (response->y[last] + 0.5f * rise);
        at.area += RESPONSE_CAP * beyond;
    }
    bite->knot = at.index;
    bite->force = at.y > RESPONSE_CAP ? RESPONSE_CAP : at.y;
    bite->force = bite->force > 0.0f ? bite->force : 0.0f;
    bite->stored = (float)model->moving_blades * at.area;
}

float sc_release(const sc_model *model, const sc_bite *bite)
{
    const float slope = bite->point.slope;
    return slope > PARALLEL ? (float)model->moving_blades * bite->force * slope : 0.0f;
}

/* What a place of the edge would bear, and how much deeper it sits. */
typedef struct {
    sc_place response; /* at the force whose release is the target */
    float gap;         /* indentation beyond that: positive where the crack still runs */
    float grade;       /* how fast the gap closes outwards along the blade */
} bearing;

/* An edge that is parallel or opens outwards, or stands too steep, releases nothing. */
static void bear(const sc_model *model, float target, const sc_edge_point *point, int stands,
                 bearing *at)
{
    at->gap = -INFINITY;
    at->grade = 1.0f;
    if (!stands || !(point->slope > PARALLEL)) {
        return;
    }
    const float force = target / ((float)model->moving_blades * point->slope);
    if (!(force < RESPONSE_CAP)) {
        return;
    }
    sc_table_inverse(&model->response, force, &at->response);
    at->gap = model->upper_face - point->y - at->response.x;
    at->grade = point->rise;
    const float deeper = 1.0f + at->gap / at->response.x;
    const float turns = point->bend * force * deeper;
    const float yields = at->response.slope * point->run * point->run * point->slope;
    if (turns < yields * point->rise) {
        at->grade -= turns / yields;
    }
}

/* After a step so short that the force changes little, what is borne follows the tangent, and what is
 * left of the gap is closed along it. 1 if that is as good as another round. */
static int follow(const sc_model *model, float target, float low, bearing *at, sc_edge_point *point)
{
    const float force = target / ((float)model->moving_blades * point->slope);
    const float change = force - at->response.y;
    if (!(point->slope > PARALLEL) || !(fabsf(change) <= SMALL_CHANGE * force) ||
        !(at->response.slope > 0.0f)) {
        return 0;
    }
    const float deeper = change / at->response.slope;
    const float step = (model->upper_face - point->y - at->response.x - deeper) / at->grade;
    if (!(fabsf(step) <= SHORT_STEP * fabsf(point->station)) ||
        !(fabsf(point->bend * step) <= RESOLUTION * point->rise) ||
        !(point->station + step > low && point->station + step < model->tip_station)) {
        return 0;
    }
    at->response.area += deeper * (at->response.y + 0.5f * change);
    at->response.x += deeper;
    at->response.y = force;
    point->station += step;
    point->x += point->run * step;
    point->y += point->rise * step;
    return 1;
}

/* Where nothing more is released: the blade's tip or, on the straight continuation of an edge
 * without one, where it leaves the material. */
static float farthest(const sc_model *model, sc_turn turn)
{
    const sc_table *edge = &model->edge;
    const int32_t last = edge->size - 1;
    sc_edge_point end;
    if (model->tip_station <= edge->x[last]) {
        return model->tip_station;
    }
    (void)sc_edge_at_knot(edge, turn, last, &end);
    const float beyond = end.rise > 0.0f ? (model->upper_face - end.y) / end.rise : 0.0f;
    const float leaves = end.station + (beyond > 0.0f ? beyond : 0.0f);
    return leaves < model->tip_station ? leaves : model->tip_station;
}

/* Whether the station is as fine as it gets and yet leaves a gap: along edges that are all but
 * parallel, where a rounding of the station changes what the edge would bear. */
static int is_coarse(const sc_model *model, const bearing *at, const sc_edge_point *point)
{
    return fabsf(at->gap) > ROUNDED * (fabsf(model->upper_face) + fabsf(point->y));
}

typedef enum { SC_AT_TIP, SC_RESTS, SC_OPEN } ending;

/* The crack rests where the gap is closed. */
static ending rest(const sc_model *model, const bearing *at, sc_bite *bite)
{
    bite->indentation = at->response.x;
    bite->force = at->response.y;
    bite->stored = (float)model->moving_blades * at->response.area;
    bite->knot = at->response.index;
    return SC_RESTS;
}

/* Where nothing is found in between: the near side of what holds, or of what is past the tip. */
static ending hold_at(const sc_model *model, sc_turn turn, float target, float station, sc_bite *bite)
{
    (void)sc_edge_at_station(&model->edge, turn, station, &bite->point);
    sc_sit(model, bite);
    return station < model->tip_station || !(sc_release(model, bite) > target) ? SC_RESTS : SC_AT_TIP;
}

/* The place between low, where *bite stands and the gap is open, and high, where it is closed; an
 * infinite high stands for the end of what the blade reaches, which is looked at only if the rounds
 * lead there. Where they do not close the gap, *bite stays where it is known to be open. */
static ending close_gap(const sc_model *model, sc_turn turn, float target, float *high, int most,
                        sc_bite *bite)
{
    sc_edge_point *point = &bite->point;
    bearing at = {{bite->knot, 0.0f, 0.0f, 0.0f, 0.0f}, 0.0f, 1.0f};
    float low = point->station;
    int stands = 1;
    for (int i = 0; i < most; i++) {
        bear(model, target, point, stands, &at);
        const float step = at.gap / at.grade;
        if (fabsf(step) <= RESOLUTION * fabsf(point->station)) {
            if (is_coarse(model, &at, point)) {
                sc_sit(model, bite); /* the force of its depth */
                return SC_RESTS;
            }
            return rest(model, &at, bite);
        }
        if (at.gap > 0.0f) {
            low = point->station;
        } else {
            *high = point->station;
        }
        float next = point->station + step;
        if (!isfinite(*high) && !(next < model->tip_station)) {
            *high = next = farthest(model, turn);
            if (!(next > low)) {
                return next < model->tip_station ? SC_RESTS : SC_AT_TIP;
            }
        } else if (!(next > low && next < *high)) {
            next = 0.5f * (low + *high);
            if (!(next > low && next < *high)) {
                return hold_at(model, turn, target, *high, bite);
            }
        }
        stands = sc_edge_at_station(&model->edge, turn, next, point);
        if (stands && follow(model, target, low, &at, point)) {
            return rest(model, &at, bite);
        }
    }
    (void)sc_edge_at_station(&model->edge, turn, low, point);
    return SC_OPEN;
}

/* Move *bite to the last knot before the place sought and give the next one's station, or the end of
 * what the blade reaches, not yet looked at. Where the release falls the knots are halved, else tried
 * one by one, so that it is the first such place. */
static float between_knots(const sc_model *model, sc_turn turn, int falls, float target,
                           sc_bite *bite)
{
    const sc_table *edge = &model->edge;
    const float end = farthest(model, turn);
    int32_t open = bite->point.knot, closed = edge->size;
    while (open + 1 < closed && edge->x[open + 1] <= bite->point.station) {
        open++;
    }
    while (closed > 0 && edge->x[closed - 1] >= end) {
        closed--;
    }
    const int32_t beyond = closed;
    while (closed - open > 1) {
        sc_bite next = *bite;
        const int32_t knot = falls ? open + (closed - open) / 2 : open + 1;
        const int stands = sc_edge_at_knot(edge, turn, knot, &next.point);
        sc_sit(model, &next);
        if (stands && sc_release(model, &next) > target) {
            *bite = next;
            open = knot;
        } else {
            closed = knot;
        }
    }
    return closed < beyond ? edge->x[closed] : end;
}

int sc_run_out(const sc_model *model, sc_turn turn, int falls, float target, sc_bite *bite)
{
    float high = INFINITY;
    ending how = SC_OPEN;
    if (falls) {
        how = close_gap(model, turn, target, &high, SC_RUN_ROUNDS, bite);
    }
    if (how == SC_OPEN) {
        high = between_knots(model, turn, falls, target, bite);
        sc_bite there = *bite;
        if (hold_at(model, turn, target, high, &there) == SC_AT_TIP || !(high > bite->point.station)) {
            *bite = there;
            return high < model->tip_station;
        }
        how = close_gap(model, turn, target, &high, SC_CLOSE_ROUNDS, bite);
    }
    if (how == SC_OPEN) {
        how = hold_at(model, turn, target, high, bite);
    }
    return how == SC_RESTS;
}
