#include "sc_wire.h"

#include "sc_bytes.h"

#include <string.h>

uint16_t sc_crc16(const uint8_t *data, size_t size)
{
    static const uint16_t nibble[16] = {0x0000, 0x1021, 0x2042, 0x3063, 0x4084, 0x50A5,
                                        0x60C6, 0x70E7, 0x8108, 0x9129, 0xA14A, 0xB16B,
                                        0xC18C, 0xD1AD, 0xE1CE, 0xF1EF};
    uint16_t crc = 0xFFFFu;
    for (size_t i = 0; i < size; i++) {
        crc = (uint16_t)((crc << 4) ^ nibble[(crc >> 12) ^ (data[i] >> 4)]);
        crc = (uint16_t)((crc << 4) ^ nibble[(crc >> 12) ^ (data[i] & 0x0Fu)]);
    }
    return crc;
}

size_t sc_encode_frame(const uint8_t *payload, size_t size, uint8_t *frame, size_t capacity)
{
    if (size == 0 || size > SC_PAYLOAD_MAX || capacity < size + 4) {
        return 0;
    }
    const uint16_t crc = sc_crc16(payload, size);
    size_t code_at = 0;
    size_t out = 1;
    for (size_t i = 0; i < size + 2; i++) {
        uint8_t byte;
        if (i < size) {
            byte = payload[i];
        } else {
            byte = (uint8_t)(i == size ? crc & 0xFFu : crc >> 8);
        }
        if (byte == 0) {
            frame[code_at] = (uint8_t)(out - code_at);
            code_at = out++;
        } else {
            frame[out++] = byte;
        }
    }
    frame[code_at] = (uint8_t)(out - code_at);
    frame[out++] = 0;
    return out;
}

void sc_decoder_init(sc_decoder *decoder)
{
    memset(decoder, 0, sizeof *decoder);
}

/* Undo COBS in place (what is written never overtakes what is read); 0 if it is malformed. */
static size_t uncobs(uint8_t *buffer, size_t fill)
{
    size_t in = 0;
    size_t out = 0;
    while (in < fill) {
        const uint8_t code = buffer[in++];
        if (code == 0xFF || (size_t)(code - 1) > fill - in) {
            return 0;
        }
        for (uint8_t i = 1; i < code; i++) {
            buffer[out++] = buffer[in++];
        }
        if (in < fill) {
            buffer[out++] = 0;
        }
    }
    return out;
}

static int finish_frame(sc_decoder *decoder)
{
    const size_t fill = decoder->fill;
    const int overrun = decoder->overrun;
    decoder->fill = 0;
    decoder->overrun = 0;
    if (fill == 0 && !overrun) {
        return 0; /* delimiters in a row are how a sender makes sure of a fresh start */
    }
    const size_t size = overrun ? 0 : uncobs(decoder->buffer, fill);
    if (size >= 3) {
        const uint8_t *crc = decoder->buffer + size - 2;
        if (sc_crc16(decoder->buffer, size - 2) == get_u16(crc)) {
            return (int)(size - 2);
        }
    }
    decoder->garbled++;
    return -1;
}

int sc_decoder_push(sc_decoder *decoder, uint8_t byte)
{
    decoder->bytes_received++;
    if (byte == 0) {
        return finish_frame(decoder);
    }
    if (decoder->fill < SC_FRAME_MAX - 1) {
        decoder->buffer[decoder->fill++] = byte;
    } else {
        decoder->overrun = 1;
    }
    return 0;
}

int sc_decoder_feed(sc_decoder *decoder, const uint8_t *data, size_t size, size_t *taken)
{
    while (*taken < size) {
        const int got = sc_decoder_push(decoder, data[(*taken)++]);
        if (got > 0) {
            return got;
        }
    }
    return 0;
}
