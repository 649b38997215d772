/* The lag of a loop as the hand feels it: how old the state is that the command in force answers.
 *
 * At each tick of the device the lag is the tick's sequence less the sequence that the newest
 * command answers which was sent before that tick's state arrived: 1 in a loop that always answers
 * in time. Ticks whose state was lost count, too. The line's fixed transport is not in it.
 */
#ifndef SC_LAG_H
#define SC_LAG_H

#include <stdint.h>

enum {
    SC_LAG_MODES = 6, /* SC_MODE_... in force at the tick */
    SC_LAG_TICKS = 64 /* entry i counts lags of i + 1 ticks, the last all longer ones, too */
};

typedef struct {
    uint64_t count[SC_LAG_MODES][SC_LAG_TICKS];
    uint64_t held[SC_LAG_MODES]; /* ticks without a new command since the tick before */
    uint32_t worst[SC_LAG_MODES];
    uint32_t last;    /* newest tick ... */
    uint32_t late;    /* ... and its lag */
    uint32_t answers; /* sequence that the newest command answers */
    uint32_t fresh;   /* a command was sent since the newest tick */
    uint32_t begun;   /* a command was sent at all */
} sc_lag;

/* A state has arrived. A sequence that repeats or decreases, as after a restart, counts nothing. */
void sc_lag_state(sc_lag *lag, uint32_t mode, uint32_t sequence);

/* A command has been sent that answers the state of this sequence. */
void sc_lag_sent(sc_lag *lag, uint32_t sequence);

#endif
