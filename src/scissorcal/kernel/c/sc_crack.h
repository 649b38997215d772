/* A blade that loads a crack, exactly from sample to sample: for simulated recordings.
 *
 * Between two samples opening and advance change linearly. The crack stands and the edge is elastic
 * until what the edge would release, m g(delta) tan(psi), exceeds the energy J at the crack's place;
 * it then runs until that has fallen to kappa J (kappa = 1, or teeth below 0.1 um: it runs along with
 * the edge).
 */
#ifndef SC_CRACK_H
#define SC_CRACK_H

#include <stdint.h>

/* Values and slopes on an even grid, cubic between knots and straight beyond the ends. */
typedef struct {
    int32_t size;
    double first, step;
    const double *value, *slope;
} sc_curve;

enum { SC_CRACK_NONE = 0, SC_CRACK_SMOOTH = 1, SC_CRACK_RIPPLED = 2 };

/* Edge: offset (m) against station (m). Response and stored energy of one blade: logarithms of force
 * (N) and energy (J) against the logarithm of the indentation (m). Toughness: the local energy per
 * length (J/m), linear between places (m, sheet's frame) tough_step apart, constant beyond. */
typedef struct {
    sc_curve edge, response, energy;
    double moving_blades, upper_face;
    int32_t eq4, fracture;
    double kappa, damping, tick_s;
    int32_t tough_size;
    double tough_first, tough_step;
    const double *tough;
} sc_crack_law;

/* stored: elastic energy (J) at the last sample; lost: what running cracks took (J); jumps: how
 * often a crack ran; place: the crack (m, sheet's frame), read at the start, too. */
typedef struct {
    double place, stored, lost;
    int32_t jumps;
} sc_crack_books;

/* Walk over count samples. torque (count - 1): mean torque that opens the blades, over the time from
 * each sample to the next (N m); push (count - 1): mean force on the sledge against the advance (N);
 * place (count): the crack. Nothing is written but these and books. */
void sc_crack_walk(const sc_crack_law *law, const double *opening, const double *advance,
                   int32_t count, double *torque, double *push, double *place,
                   sc_crack_books *books);

#endif
