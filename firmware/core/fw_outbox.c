/* Frames on their way to the host. */
#include "fw_parts.h"

#include <string.h>

void fw_put_reply(fw_outbox *outbox, const uint8_t *payload, size_t size)
{
    const size_t left = (size_t)(outbox->reply_fill - outbox->reply_sent);
    memmove(outbox->replies, outbox->replies + outbox->reply_sent, left);
    outbox->reply_sent = 0;
    const size_t whole =
        sc_encode_frame(payload, size, outbox->replies + left, FW_REPLY_BYTES - left);
    outbox->reply_fill = (uint16_t)(left + whole);
}

void fw_put_state(fw_outbox *outbox, const sc_state *state)
{
    uint8_t payload[SC_SIZE_STATE];
    if (outbox->state_sent == 0) {
        outbox->state_fill = (uint8_t)sc_encode_frame(payload, sc_pack_state(state, payload),
                                                      outbox->state, FW_STATE_FRAME);
    }
}

static size_t take_state(fw_outbox *outbox, uint8_t *data, size_t capacity)
{
    size_t size = (size_t)(outbox->state_fill - outbox->state_sent);
    size = size < capacity ? size : capacity;
    memcpy(data, outbox->state + outbox->state_sent, size);
    outbox->state_sent = (uint8_t)(outbox->state_sent + size);
    if (outbox->state_sent == outbox->state_fill) {
        outbox->state_fill = outbox->state_sent = 0;
    }
    return size;
}

size_t fw_take(fw_core *core, uint8_t *data, size_t capacity)
{
    fw_outbox *outbox = &core->outbox;
    size_t taken = 0;
    if (outbox->state_sent > 0) {
        taken = take_state(outbox, data, capacity);
        if (outbox->state_sent > 0) {
            return taken;
        }
    }
    size_t size = (size_t)(outbox->reply_fill - outbox->reply_sent);
    size = size < capacity - taken ? size : capacity - taken;
    memcpy(data + taken, outbox->replies + outbox->reply_sent, size);
    outbox->reply_sent = (uint16_t)(outbox->reply_sent + size);
    taken += size;
    if (outbox->reply_sent == outbox->reply_fill) {
        outbox->reply_fill = outbox->reply_sent = 0;
        taken += take_state(outbox, data + taken, capacity - taken);
    }
    return taken;
}
