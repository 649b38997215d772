/* What supervisor and loop share of the mode CONTROL: the contour that the outer loop sends, and a
 * ring of the mode's samples. Part of sc_block; its path is the block's reference arrays.
 *
 * A contour is written between two increments of `lock`; a reader that saw an odd or a changed number
 * keeps the contour that it had.
 */
#ifndef SC_CONTROL_BLOCK_H
#define SC_CONTROL_BLOCK_H

#include "sc_control.h"

#include <stdint.h>

enum { SC_CONTROL_RING = 16384 };

typedef struct {
    sc_control_config config;
    uint32_t has_config;
    uint32_t lock;
    sc_contour contour;
    uint64_t written; /* samples ever written to the ring */
    sc_control_sample ring[SC_CONTROL_RING];
} sc_control_block;

/* The supervisor's side. Its number is one more than the last one's. */
void sc_control_block_send(sc_control_block *block, const sc_contour *contour);

/* Copy up to n samples from *cursor on and move it; adds to *lost those that were overwritten. */
uint64_t sc_control_block_read(const sc_control_block *block, uint64_t *cursor,
                               sc_control_sample *samples, uint64_t n, uint64_t *lost);

/* The loop's side. Returns 1, and the newest contour, unless it was being written. */
int sc_control_block_receive(const sc_control_block *block, sc_contour *contour);
void sc_control_block_push(sc_control_block *block, const sc_control_sample *sample);

#endif
