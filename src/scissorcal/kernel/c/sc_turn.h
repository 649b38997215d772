/* Sine and cosine of the core's own, so that every computer, microcontroller and browser gets the same
 * bits: C libraries differ in the last one.
 */
#ifndef SC_TURN_H
#define SC_TURN_H

/* An angle by its sine and cosine, which one step needs many times. */
typedef struct {
    float sine;
    float cosine;
} sc_turn;

/* Both within 1.5 units in the last place for angles up to half a turn either way, and within 1.5e-7 up to
 * SC_TURN_WIDEST [rad]; not a number beyond, and where the angle is none. */
sc_turn sc_turn_of(float angle);

#define SC_TURN_WIDEST 12000.0f

#endif
