#include "sc_presliding.h"

#include <math.h>

void sc_presliding(const double *opening, size_t count, double length, double *state)
{
    size_t first = 0;
    while (first + 1 < count && opening[first + 1] == opening[first])
        first++;
    if (first + 1 >= count) {
        for (size_t i = 0; i < count; i++)
            state[i] = 0.0;
        return;
    }
    double sign = opening[first + 1] > opening[first] ? 1.0 : -1.0;
    double reached = sign, turn = opening[first];
    for (size_t i = 0; i <= first; i++)
        state[i] = sign;
    for (size_t i = first + 1; i < count; i++) {
        double step = opening[i] - opening[i - 1];
        if (step * sign < 0.0) {
            reached = state[i - 1];
            turn = opening[i - 1];
            sign = -sign;
        }
        state[i] = step == 0.0
                       ? state[i - 1]
                       : sign - (sign - reached) * exp(-fabs(opening[i] - turn) / length);
    }
}
