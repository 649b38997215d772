#include "sc_edge.h"

#include <math.h>

/* x_s = cos(beta) - e'(s) sin(beta) falls to 0 as the edge turns upright. */
static const float SMALLEST_RUN = 0.05f;

enum { MOST_STEPS = 32 };

int sc_edge_at_station(const sc_table *edge, sc_turn turn, float station, sc_edge_point *point)
{
    const float offset = sc_table_at(edge, station, &point->taper);
    const float run = turn.cosine - point->taper * turn.sine;
    point->station = station;
    point->x = station * turn.cosine - offset * turn.sine;
    point->y = station * turn.sine + offset * turn.cosine;
    point->slope = (turn.sine + point->taper * turn.cosine) / run;
    return run > SMALLEST_RUN;
}

static float end_x(const sc_table *edge, sc_turn turn, int32_t end)
{
    return edge->x[end] * turn.cosine - edge->y[end] * turn.sine;
}

/* Station over x on the straight line that continues the edge beyond one end. */
static int beyond_end(const sc_table *edge, sc_turn turn, float x, int32_t end, float *station)
{
    const float run = turn.cosine - edge->slope[end] * turn.sine;
    *station = edge->x[end] + (x - end_x(edge, turn, end)) / run;
    return run > SMALLEST_RUN;
}

/* Newton on x(s) = x, kept inside a shrinking bracket: it halves where Newton would leave it. */
static float within_table(const sc_table *edge, sc_turn turn, float x)
{
    float low = edge->x[0];
    float high = edge->x[edge->size - 1];
    float taper;
    float station = x / turn.cosine;
    if (!(station > low && station < high)) {
        station = 0.5f * (low + high);
    }
    for (int i = 0; i < MOST_STEPS; i++) {
        const float offset = sc_table_at(edge, station, &taper);
        const float away = station * turn.cosine - offset * turn.sine - x;
        if (away > 0.0f) {
            high = station;
        } else {
            low = station;
        }
        float next = station - away / (turn.cosine - taper * turn.sine);
        if (!(next >= low && next <= high)) {
            next = 0.5f * (low + high);
        }
        const float moved = fabsf(next - station);
        station = next;
        if (moved <= 2e-7f * fabsf(station) + 1e-10f) {
            break;
        }
    }
    return station;
}

int sc_edge_over(const sc_table *edge, sc_turn turn, float x, sc_edge_point *point)
{
    const int32_t last = edge->size - 1;
    float station;
    if (!(turn.cosine > SMALLEST_RUN)) {
        return 0;
    }
    if (x <= end_x(edge, turn, 0)) {
        if (!beyond_end(edge, turn, x, 0, &station)) {
            return 0;
        }
    } else if (x >= end_x(edge, turn, last)) {
        if (!beyond_end(edge, turn, x, last, &station)) {
            return 0;
        }
    } else {
        station = within_table(edge, turn, x);
    }
    return sc_edge_at_station(edge, turn, station, point);
}
