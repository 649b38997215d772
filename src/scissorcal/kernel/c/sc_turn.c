#include "sc_turn.h"

#include <math.h>
#include <stdint.h>

/* pi/2 in three parts of 11, 11 and 24 bits: a multiple up to 2^13 of the first two is exact (Cody and
 * Waite 1980, Software Manual for the Elementary Functions). */
static const float PER_QUARTER = 0.63661977f;
static const float QUARTER_HIGH = 1.5703125f;
static const float QUARTER_MIDDLE = 4.837512969970703e-4f;
static const float QUARTER_LOW = 7.549790126404332e-8f;

/* Polynomials in the square z of an angle up to pi/4: sin(r) = r + r z S(z) with a relative error of
 * 5.2e-12, cos(r) = 1 - z / 2 + z^2 C(z) with one of 1.2e-13. Remez exchange, to 40 digits. */
static const float S0 = -0.166666666407f, S1 = 0.00833332929878f, S2 = -0.000198393103087f,
                   S3 = 2.71810285058e-6f;
static const float C0 = 0.0416666666194f, C1 = -0.00138888834919f, C2 = 2.47994580176e-5f,
                   C3 = -2.72055782356e-7f;

sc_turn sc_turn_of(float angle)
{
    if (!(fabsf(angle) <= SC_TURN_WIDEST)) {
        const sc_turn none = {NAN, NAN};
        return none;
    }
    const float quarters = angle * PER_QUARTER;
    const int32_t turns = (int32_t)(quarters + (quarters < 0.0f ? -0.5f : 0.5f));
    const float whole = (float)turns;
    const float r =
        ((angle - whole * QUARTER_HIGH) - whole * QUARTER_MIDDLE) - whole * QUARTER_LOW;
    const float z = r * r;
    const float sine = r + r * z * (S0 + z * (S1 + z * (S2 + z * S3)));
    const float half = 0.5f * z, near = 1.0f - half; /* what near lost in rounding comes back */
    const float cosine =
        near + (((1.0f - near) - half) + z * z * (C0 + z * (C1 + z * (C2 + z * C3))));
    switch ((uint32_t)turns & 3u) {
    case 0: return (sc_turn){sine, cosine};
    case 1: return (sc_turn){cosine, -sine};
    case 2: return (sc_turn){-sine, -cosine};
    default: return (sc_turn){-cosine, sine};
    }
}
