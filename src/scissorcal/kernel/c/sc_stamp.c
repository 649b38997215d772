#include "sc_stamp.h"

/* Why 8 of 20. A clock that counts down, stands, or is random contradicts the sequence at each state
 * and stops in 8. One wrong stamp spoils two intervals, the one before and the one after it, so that
 * every third wrong gives 13 of 20 and stops within 12 states. Four wrong stamps must fall into 20
 * states for a false stop: at g a state that is g C(20, 3) g^3 = 1140 g^4 a state, with one in 1,000
 * once in 240 hours at 1 kHz, with one in 10,000 never in a laboratory's life. One leap of a clock
 * that goes on from there, as after its reset, spoils one interval.
 *
 * An interval is right within a factor of two: rates are wrong by no more, and ticks that truly
 * jitter, of which device_us is the better clock, stay below it (docs/protocol.md). What a clock is
 * off by less is seen over 0.25 s (sc_watch.c). */
enum { TOLERANCE = 2 };

static int agrees(int64_t stated_us, int64_t by_ticks_us)
{
    return stated_us * TOLERANCE >= by_ticks_us && stated_us <= by_ticks_us * TOLERANCE;
}

uint32_t sc_count_recent(uint32_t *recent, int wrong)
{
    const uint32_t kept = (1u << SC_RECENT_STATES) - 1u;
    uint32_t count = 0;
    *recent = (*recent << 1 | (wrong ? 1u : 0u)) & kept;
    for (uint32_t left = *recent; left != 0; left &= left - 1u) {
        count++;
    }
    return count;
}

/* Time and ticks where the two contradict each other: by the sequence, but by the clock where that says
 * less, and a tick or more: then the sequence leapt. */
static void decide(sc_stamps *stamps, uint32_t tick_us, uint32_t ticks)
{
    const int64_t stated_us = stamps->stated_us;
    if (TOLERANCE * stated_us >= tick_us && stated_us < (int64_t)ticks * tick_us &&
        stated_us <= SC_LONGEST_GAP_US) {
        stamps->ticks = ((uint32_t)stated_us + tick_us / 2) / tick_us;
    } else if (ticks <= SC_LONGEST_GAP_US / tick_us) {
        stamps->ticks = ticks;
    } else {
        stamps->ticks = 1;
    }
    stamps->ticks = stamps->ticks > 0 ? stamps->ticks : 1;
    stamps->passed_us = stamps->ticks * tick_us;
    stamps->shortest_us = tick_us; /* the sequence may be what is wrong, and a tick did pass */
}

/* Wrong stamps in a row that are all wrong alike are a clock in another unit. */
static int are_alike(const sc_stamps *stamps, uint32_t tick_us)
{
    const uint32_t newest = (1u << SC_STAMPS_UNTIL_STOP) - 1u;
    int32_t least = stamps->wrong_us[0], most = stamps->wrong_us[0];
    for (int i = 1; i < SC_STAMPS_UNTIL_STOP; i++) {
        least = stamps->wrong_us[i] < least ? stamps->wrong_us[i] : least;
        most = stamps->wrong_us[i] > most ? stamps->wrong_us[i] : most;
    }
    return (stamps->recent & newest) == newest && least >= 0 && most > 0 && (int64_t)most - least <= (int64_t)(tick_us / 2);
}

int sc_stamps_take(sc_stamps *stamps, uint32_t tick_us, uint32_t sequence, uint32_t device_us)
{
    const uint32_t ticks = sequence - stamps->sequence;
    const uint32_t stated = device_us - stamps->device_us;
    const int64_t by_ticks_us = (int64_t)ticks * tick_us;
    stamps->stated_us = stated < 0x80000000u ? (int32_t)stated : -(int32_t)(~stated) - 1;
    stamps->sequence = sequence;
    stamps->device_us = device_us;
    if (!stamps->begun) {
        stamps->begun = 1;
        stamps->stated_us = 0;
        stamps->ticks = stamps->passed_us = stamps->shortest_us = 0;
        return SC_STAMPS_AGREE;
    }
    const int right = agrees(stamps->stated_us, by_ticks_us);
    if (right) {
        stamps->ticks = ticks;
        stamps->passed_us = (uint32_t)stamps->stated_us;
        stamps->shortest_us =
            stamps->stated_us < by_ticks_us ? stamps->passed_us : (uint32_t)by_ticks_us;
    } else {
        decide(stamps, tick_us, ticks);
        stamps->wrong_us[stamps->wrong++ % SC_STAMPS_UNTIL_STOP] =
            stamps->stated_us / (int32_t)stamps->ticks;
    }
    if (sc_count_recent(&stamps->recent, !right) < SC_STAMPS_UNTIL_STOP) {
        return SC_STAMPS_AGREE;
    }
    return are_alike(stamps, tick_us) ? SC_STAMPS_OFF : SC_STAMPS_CONTRADICT;
}
