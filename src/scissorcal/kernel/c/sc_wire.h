/* Wire frames: COBS(payload + CRC-16/CCITT-FALSE, little-endian) + 0x00.
 *
 * docs/protocol.md explains them; sc_messages.h has the payloads. Portable C99 without allocation or
 * globals. Declarations in the headers stay free of macros, because the Python binding parses them
 * as they are.
 */
#ifndef SC_WIRE_H
#define SC_WIRE_H

#include "sc_messages.h"

typedef struct {
    uint64_t bytes_received;
    uint32_t garbled;
    uint16_t fill;
    uint8_t overrun;
    uint8_t buffer[SC_FRAME_MAX];
} sc_decoder;

/* CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, no reflection, no final xor. */
uint16_t sc_crc16(const uint8_t *data, size_t size);

/* Write the whole frame, delimiter included; returns its size, 0 if the payload does not fit. */
size_t sc_encode_frame(const uint8_t *payload, size_t size, uint8_t *frame, size_t capacity);

void sc_decoder_init(sc_decoder *decoder);

/* Take one byte. Returns the payload's size when it completes a valid frame (the payload then
 * stands at the start of decoder->buffer until the next byte), 0 while there is none, and -1 when
 * a frame was discarded, which garbled counts. */
int sc_decoder_push(sc_decoder *decoder, uint8_t byte);

/* Take bytes until a valid frame completes or they are used up. Adds what was taken to *taken;
 * returns the payload's size, 0 when the bytes ran out. */
int sc_decoder_feed(sc_decoder *decoder, const uint8_t *data, size_t size, size_t *taken);

#endif
