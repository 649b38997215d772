/* What a loop's process may ask of the system for the sake of its latency: POSIX and Linux. */
#ifndef SC_RIGHTS_H
#define SC_RIGHTS_H

/* Keep all memory of this process, also what it gets later, from being paged out; 1 if granted. */
int sc_rights_lock_memory(void);

/* Ask for a short time slice, which needs no right: from Linux 6.12 on, a thread with a shorter
 * slice interrupts others when it wakes. 1 if granted, 0 where the system does not know it. */
int sc_rights_short_slice(void);

#endif
