#include "sc_edge.h"

#include <math.h>

/* x_s = cos(beta) - e'(s) sin(beta) falls to 0 as the edge turns upright. */
static const float SMALLEST_RUN = 0.05f;

/* All about a place from its station, offset and taper. */
static int stand(sc_turn turn, float offset, sc_edge_point *point)
{
    point->x = point->station * turn.cosine - offset * turn.sine;
    point->y = point->station * turn.sine + offset * turn.cosine;
    point->rise = turn.sine + point->taper * turn.cosine;
    point->run = turn.cosine - point->taper * turn.sine;
    point->slope = point->rise / point->run;
    return point->run > SMALLEST_RUN;
}

/* The edge at a share of a piece. */
static int stand_in(const sc_piece *piece, sc_turn turn, float t, sc_edge_point *point)
{
    const float quadratic = t * 3.0f * piece->third;
    point->knot = piece->index;
    const float offset =
        piece->y + t * (piece->start + t * (piece->second + t * piece->third));
    point->taper = (piece->start + t * (2.0f * piece->second + quadratic)) * piece->per_width;
    point->bend = 2.0f * (piece->second + quadratic) * piece->per_width * piece->per_width;
    return stand(turn, offset, point);
}

int sc_edge_stands(float flattest, float steepest, sc_turn turn)
{
    const float slope = turn.sine > 0.0f ? steepest : flattest;
    return turn.cosine - slope * turn.sine > SMALLEST_RUN;
}

int sc_edge_at_station(const sc_table *edge, sc_turn turn, float station, sc_edge_point *point)
{
    const sc_piece piece = sc_table_piece(edge, station, point->knot);
    point->station = station;
    return stand_in(&piece, turn, (station - piece.x) * piece.per_width, point);
}

int sc_edge_at_knot(const sc_table *edge, sc_turn turn, int32_t knot, sc_edge_point *point)
{
    point->knot = knot;
    point->station = edge->x[knot];
    point->taper = edge->slope[knot];
    point->bend = 0.0f;
    return stand(turn, edge->y[knot], point);
}

static float x_of_knot(const sc_table *edge, sc_turn turn, int32_t knot)
{
    return edge->x[knot] * turn.cosine - edge->y[knot] * turn.sine;
}

/* On the straight line that continues the edge beyond one end. */
static int beyond_end(const sc_table *edge, sc_turn turn, float x, int32_t end,
                      sc_edge_point *point)
{
    const float run = turn.cosine - edge->slope[end] * turn.sine;
    const float away = (x - x_of_knot(edge, turn, end)) / run;
    if (!(run > SMALLEST_RUN)) {
        return 0;
    }
    point->knot = end;
    point->station = edge->x[end] + away;
    point->taper = edge->slope[end];
    point->bend = 0.0f;
    return stand(turn, edge->y[end] + edge->slope[end] * away, point);
}

/* The last knot but the end's that stands no farther out than x; `near` is tried first. */
static int32_t knot_before(const sc_table *edge, sc_turn turn, float x, int32_t near)
{
    int32_t low = 0;
    int32_t left = edge->size - 1;
    if (near >= 0 && near < left && x_of_knot(edge, turn, near) <= x &&
        x < x_of_knot(edge, turn, near + 1)) {
        return near;
    }
    while (left > 1) {
        const int32_t half = left / 2;
        low = x_of_knot(edge, turn, low + half) <= x ? low + half : low;
        left -= half;
    }
    return low;
}

int sc_edge_over(const sc_table *edge, sc_turn turn, float x, sc_edge_point *point)
{
    const int32_t last = edge->size - 1;
    if (!(turn.cosine > SMALLEST_RUN)) {
        return 0;
    }
    if (x <= x_of_knot(edge, turn, 0)) {
        return beyond_end(edge, turn, x, 0, point);
    }
    if (x >= x_of_knot(edge, turn, last)) {
        return beyond_end(edge, turn, x, last, point);
    }
    const int32_t knot = knot_before(edge, turn, x, point->knot);
    const sc_piece piece = sc_piece_from(edge, knot);
    const float t = sc_share_of_rise(piece.width * turn.cosine - piece.start * turn.sine,
                                     -piece.second * turn.sine, -piece.third * turn.sine,
                                     x - x_of_knot(edge, turn, knot));
    point->station = piece.x + t * piece.width;
    return stand_in(&piece, turn, t, point);
}
