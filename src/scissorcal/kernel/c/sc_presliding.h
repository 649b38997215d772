/* Dahl's presliding along a path: how far dry friction has built up since the last reversal. */
#ifndef SC_PRESLIDING_H
#define SC_PRESLIDING_H

#include <stddef.h>

/* State z of `length` dz/dtheta = 1 - z sgn(dtheta) at each of `count` places, in order of time.
 * The path is taken to begin fully built up in its first direction; all zero where nothing moves. */
void sc_presliding(const double *opening, size_t count, double length, double *state);

#endif
