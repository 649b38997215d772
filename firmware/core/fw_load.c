/* The upload of an image, by LOAD_BEGIN, LOAD_CHUNK and LOAD_COMMIT: see fw_render.h. */
#include "fw_render.h"

#include <string.h>

static uint8_t begin(fw_render *render, const sc_load_begin *message)
{
    fw_load *load = &render->load;
    memset(load, 0, sizeof *load);
    render->crc32 = 0;
    render->on = 0;
    if (message->image_format != FW_IMAGE_FORMAT) {
        return SC_LOAD_OTHER_FORMAT;
    }
    if (message->size > render->capacity) {
        return SC_LOAD_TOO_LARGE;
    }
    load->announced = 1;
    load->size = message->size;
    load->crc32 = message->crc32;
    return SC_LOAD_OK;
}

/* A piece that came already is confirmed again: the host may have lost the echo. */
static uint8_t chunk(fw_render *render, const sc_load_chunk *message)
{
    fw_load *load = &render->load;
    const uint32_t count = message->count;
    if (!load->announced) {
        return SC_LOAD_NOT_ANNOUNCED;
    }
    if (count == 0u || count > sizeof message->bytes || message->offset > load->received ||
        count > load->size - message->offset) {
        return SC_LOAD_OUT_OF_ORDER;
    }
    if (message->offset + count <= load->received) {
        return SC_LOAD_OK;
    }
    if (message->offset < load->received) {
        return SC_LOAD_OUT_OF_ORDER;
    }
    memcpy((uint8_t *)(void *)render->memory + load->received, message->bytes, count);
    load->crc = fw_crc32(load->crc, message->bytes, count);
    load->received += count;
    return SC_LOAD_OK;
}

static uint8_t commit(fw_render *render)
{
    fw_load *load = &render->load;
    if (!load->announced) {
        return SC_LOAD_NOT_ANNOUNCED;
    }
    if (render->crc32 != 0u) {
        return SC_LOAD_OK; /* asked again */
    }
    uint32_t status = SC_LOAD_TORN;
    if (load->received == load->size && load->crc == load->crc32 && load->crc != 0u) {
        status = fw_image_open(render->memory, load->size, &render->image);
    }
    if (status != SC_LOAD_OK) {
        load->announced = 0;
        return (uint8_t)status;
    }
    render->crc32 = load->crc;
    memset(&render->motion, 0, sizeof render->motion);
    return SC_LOAD_OK;
}

static void answer(const fw_render *render, uint32_t nonce, uint8_t status, sc_load_echo *echo)
{
    echo->status = status;
    echo->nonce = nonce;
    echo->received = render->load.received;
    echo->capacity = render->capacity;
    echo->crc32 = render->crc32;
}

int fw_render_load(fw_render *render, const uint8_t *payload, size_t size, int enabled,
                   sc_load_echo *echo)
{
    sc_load_begin first;
    sc_load_chunk piece;
    sc_load_commit last;
    if (sc_unpack_load_begin(payload, size, &first)) {
        answer(render, first.nonce, enabled ? SC_LOAD_BUSY : begin(render, &first), echo);
    } else if (sc_unpack_load_chunk(payload, size, &piece)) {
        answer(render, piece.nonce, enabled ? SC_LOAD_BUSY : chunk(render, &piece), echo);
    } else if (sc_unpack_load_commit(payload, size, &last)) {
        answer(render, last.nonce, enabled ? SC_LOAD_BUSY : commit(render), echo);
    } else {
        return 0;
    }
    return 1;
}

int fw_refuse_load(const uint8_t *payload, size_t size, sc_load_echo *echo)
{
    sc_load_begin first;
    sc_load_chunk piece;
    sc_load_commit last;
    memset(echo, 0, sizeof *echo);
    echo->status = SC_LOAD_NOT_ANNOUNCED;
    if (sc_unpack_load_begin(payload, size, &first)) {
        echo->status = SC_LOAD_OTHER_FORMAT;
        echo->nonce = first.nonce;
    } else if (sc_unpack_load_chunk(payload, size, &piece)) {
        echo->nonce = piece.nonce;
    } else if (sc_unpack_load_commit(payload, size, &last)) {
        echo->nonce = last.nonce;
    } else {
        return 0;
    }
    return 1;
}
