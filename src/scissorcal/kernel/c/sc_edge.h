/* The cutting edge: blade frame (s, e(s)) turned by beta, seen from the cut.
 *
 *     x = s cos(beta) - e(s) sin(beta),   y = s sin(beta) + e(s) cos(beta),   y_x = tan(psi)
 */
#ifndef SC_EDGE_H
#define SC_EDGE_H

#include "sc_table.h"
#include "sc_turn.h"

/* One place of the edge: station on the blade, where it stands (x, y), its slope tan(psi) against
 * the cut, its taper e'(s) against the blade's centreline, its bend e''(s), and its rise dy/ds and run
 * dx/ds along the blade. `knot` names its interval; before a look-up, where to look first. */
typedef struct {
    int32_t knot;
    float station;
    float x;
    float y;
    float slope;
    float taper;
    float bend;
    float rise;
    float run;
} sc_edge_point;

/* 1 unless an edge whose slope e' lies between both ends stands upright or leans back somewhere: then
 * more than one of its points, or none, may stand over a place. */
int sc_edge_stands(float flattest, float steepest, sc_turn turn);

/* The edge at a station; 0 if it stands too steeply against the cut there (psi > 87 deg). */
int sc_edge_at_station(const sc_table *edge, sc_turn turn, float station, sc_edge_point *point);

/* The same at a knot, without a look-up; the bend is left out. */
int sc_edge_at_knot(const sc_table *edge, sc_turn turn, int32_t knot, sc_edge_point *point);

/* The edge over x, looked for first at point->knot: one search for the interval and one cubic in it,
 * closed form beyond the table's ends, where the edge goes on straight. 0 if no edge of bearable
 * steepness stands there. */
int sc_edge_over(const sc_table *edge, sc_turn turn, float x, sc_edge_point *point);

#endif
