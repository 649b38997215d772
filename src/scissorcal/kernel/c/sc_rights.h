/* What a loop's process may ask of the system for the sake of its latency: POSIX and Linux; elsewhere
 * nothing is granted. */
#ifndef SC_RIGHTS_H
#define SC_RIGHTS_H

#include <stdint.h>

/* Keep all memory of this process, also what it gets later, from being paged out; 1 if granted. */
int sc_rights_lock_memory(void);

/* Ask for a time slice of this length [us] for this thread, which needs no right. From Linux 6.12 on
 * a thread interrupts those of longer slices when it wakes, and takes no more of the processor for it.
 * Ends real-time priority. 1 if granted, 0 where the system does not know it. */
int sc_rights_slice(uint32_t slice_us);

#endif
