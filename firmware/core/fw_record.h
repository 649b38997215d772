/* One tick as a record of fixed size in and one out: the one interface for tests, emulators, plants.
 *
 * Members are 4-byte aligned without padding, in the processor's byte order (little-endian on all
 * that are tested), so that a record can be written to a file or copied into another processor's
 * memory as it is. Both are FW_RECORD_SIZE bytes.
 */
#ifndef FW_RECORD_H
#define FW_RECORD_H

#include "fw_core.h"

enum { FW_RECORD_SIZE = 512, FW_RECORD_RECEIVED = 472, FW_RECORD_SENT = 492 };

typedef struct {
    fw_inputs inputs;
    uint32_t received_size;
    uint8_t received[FW_RECORD_RECEIVED];
} fw_record_in;

typedef struct {
    fw_outputs outputs;
    uint8_t phase;
    uint8_t cause;
    uint8_t home_result;
    uint8_t reserved;
    uint32_t sent_size;
    uint8_t sent[FW_RECORD_SENT]; /* 0 beyond sent_size */
} fw_record_out;

/* fw_receive, fw_tick and fw_take in their order. A received_size beyond the room counts as the
 * room. */
void fw_record_tick(fw_core *core, const fw_record_in *in, fw_record_out *out);

#endif
