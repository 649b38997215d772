/* How much time passed between two states: by their device_us and by their sequence numbers, each of
 * which may be wrong. A wrong one changes no rate by more than a factor of two and switches no watch
 * off; where they contradict each other too often, the servo stops. */
#ifndef SC_STAMP_H
#define SC_STAMP_H

#include <stdint.h>

enum {
    SC_RECENT_STATES = 20,       /* over so many the contradictions are counted ... */
    SC_STAMPS_UNTIL_STOP = 8,    /* ... and so many of them stop: see sc_stamp.c */
    SC_LONGEST_GAP_US = 100000   /* longer gaps are not taken from a sequence number alone */
};

/* What the stamps say in the end. */
enum {
    SC_STAMPS_AGREE = 0,
    SC_STAMPS_OFF = 1, /* the clock goes on evenly, at another rate than tick_us says */
    SC_STAMPS_CONTRADICT = 2
};

typedef struct {
    uint32_t begun;
    uint32_t sequence;
    uint32_t device_us;
    uint32_t recent;     /* bit i: i states ago the stamps contradicted each other */
    int32_t wrong_us[SC_STAMPS_UNTIL_STOP]; /* of device_us a tick, then: the newest ones in turn */
    uint32_t wrong;      /* how often, ever */
    uint32_t ticks;      /* that passed before this state, as it is taken */
    uint32_t passed_us;  /* time, as it is taken ... */
    uint32_t shortest_us; /* ... and the least that it may have been: for what bounds a rate */
    int32_t stated_us;   /* by the device's clock, whatever it says */
} sc_stamps;

/* Take the stamps of a state that repeats no sequence number; returns SC_STAMPS_... */
int sc_stamps_take(sc_stamps *stamps, uint32_t tick_us, uint32_t sequence, uint32_t device_us);

/* Note in a history of the last SC_RECENT_STATES whether something is wrong now, and return how
 * often it was among them. Faults that come and go count so, too. */
uint32_t sc_count_recent(uint32_t *recent, int wrong);

#endif
