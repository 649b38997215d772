/* The servo loop on a file descriptor: POSIX only; on Windows it runs nothing. */
#ifndef SC_LOOP_H
#define SC_LOOP_H

#include "sc_block.h"

/* Run until a stop, a hangup, silence or an error; returns the reason, which block->exit_reason
 * keeps too. Paced by the device's frames: the loop sleeps in poll(), decodes what arrived, steps the
 * servo once per STATE, answers the newest, and records a sample for each. At the end it sends
 * commands of zero without ENABLE. The descriptor stays open. Where it is a pipe or a
 * socket, have SIGPIPE ignored, as Python does. SC_STOP_NONE: this system has no such loop. */
uint32_t sc_loop_run(int fd, sc_block *block);

#endif
