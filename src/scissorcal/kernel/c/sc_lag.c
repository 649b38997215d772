#include "sc_lag.h"

static const uint32_t HALF = 0x80000000u; /* of the sequence numbers, which wrap */

void sc_lag_state(sc_lag *lag, uint32_t mode, uint32_t sequence)
{
    const uint32_t passed = sequence - lag->last;
    const uint32_t late = sequence - lag->answers;
    lag->last = sequence;
    lag->late = lag->begun && late < HALF ? late : 0;
    if (!lag->begun || mode >= SC_LAG_MODES || passed == 0 || passed >= HALF || late < passed ||
        late >= HALF) {
        return;
    }
    uint64_t *count = lag->count[mode];
    uint32_t left = passed; /* ticks of lags late, late - 1, ... */
    if (late > SC_LAG_TICKS) {
        const uint32_t beyond = late - SC_LAG_TICKS < left ? late - SC_LAG_TICKS : left;
        count[SC_LAG_TICKS - 1] += beyond;
        left -= beyond;
    }
    for (uint32_t at = late - passed + left; left > 0; left--, at--) {
        count[at - 1]++;
    }
    lag->held[mode] += lag->fresh ? passed - 1 : passed;
    if (late > lag->worst[mode]) {
        lag->worst[mode] = late;
    }
    lag->fresh = 0;
}

void sc_lag_sent(sc_lag *lag, uint32_t sequence)
{
    lag->answers = sequence;
    lag->fresh = 1;
    lag->begun = 1;
}
