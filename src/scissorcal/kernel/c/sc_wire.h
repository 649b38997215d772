/* Wire frames: COBS(payload + CRC-16/CCITT-FALSE, little-endian) + 0x00, and the payloads in them.
 *
 * The layouts are those of data_schemas/wire.json; docs/protocol.md explains them byte by byte.
 * Portable C99 without allocation or globals. Declarations in this header stay free of macros,
 * because the Python binding parses them as they stand.
 */
#ifndef SC_WIRE_H
#define SC_WIRE_H

#include <stddef.h>
#include <stdint.h>

enum {
    SC_PROTOCOL_VERSION = 1,
    SC_PAYLOAD_MAX = 250, /* so that a COBS code never reaches 0xFF */
    SC_FRAME_MAX = 254    /* payload, two bytes of CRC, one COBS code, the delimiter */
};

enum {
    SC_TYPE_STATE = 0x01,
    SC_TYPE_COMMAND = 0x02,
    SC_TYPE_HELLO = 0x10,
    SC_TYPE_IDENTITY = 0x11,
    SC_TYPE_CONFIG = 0x12,
    SC_TYPE_CONFIG_ECHO = 0x13
};

enum {
    SC_SIZE_STATE = 28,
    SC_SIZE_COMMAND = 16,
    SC_SIZE_HELLO = 8,
    SC_SIZE_IDENTITY = 92,
    SC_SIZE_CONFIG = 12,
    SC_SIZE_CONFIG_ECHO = 12
};

enum {
    SC_STATE_MOTOR_ENABLED = 1,
    SC_STATE_FAULT_LATCHED = 2,
    SC_STATE_COMMANDS_LOST = 4,
    SC_STATE_OPENING_AT_STOP = 8,
    SC_STATE_TORQUE_SATURATED = 16,
    SC_STATE_HANDLE_FORCE_SATURATED = 32,
    SC_STATE_ENCODER_FAULT = 64
};

enum { SC_COMMAND_ENABLE = 1, SC_COMMAND_CLEAR_FAULT = 2 };

typedef struct {
    uint16_t flags;
    uint32_t sequence;
    uint32_t device_us;
    float opening;
    float advance;
    float motor_torque;
    float handle_force;
} sc_state;

typedef struct {
    uint16_t flags;
    uint32_t echo_sequence;
    float torque;
    float force;
} sc_command;

typedef struct {
    uint8_t protocol_version;
    uint32_t nonce;
} sc_hello;

typedef struct {
    uint8_t protocol_version;
    uint16_t capabilities;
    uint32_t nonce_echo;
    uint64_t schema_hash;
    uint8_t name[16];
    uint8_t serial[16];
    uint32_t firmware_version;
    uint32_t tick_us;
    float torque_limit;
    float force_limit;
    float opening_min;
    float opening_max;
    float advance_min;
    float advance_max;
    float opening_resolution;
    float advance_resolution;
    float handle_radius;
} sc_identity;

/* CONFIG and CONFIG_ECHO share one layout; status is 0 in CONFIG. */
typedef struct {
    uint8_t status;
    uint16_t key;
    uint32_t nonce;
    float value;
} sc_config;

typedef struct {
    uint64_t bytes_received;
    uint32_t garbled;
    uint16_t fill;
    uint8_t overrun;
    uint8_t buffer[SC_FRAME_MAX];
} sc_decoder;

/* First 8 bytes, little-endian, of SHA-256 over the canonical form of wire.json. */
uint64_t sc_schema_hash(void);

/* CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, no reflection, no final xor. */
uint16_t sc_crc16(const uint8_t *data, size_t size);

/* Write the whole frame, delimiter included; returns its size, 0 if the payload does not fit. */
size_t sc_encode_frame(const uint8_t *payload, size_t size, uint8_t *frame, size_t capacity);

void sc_decoder_init(sc_decoder *decoder);

/* Take one byte. Returns the payload's size when it completes a sound frame (the payload then
 * stands at the start of decoder->buffer until the next byte), 0 while there is none, and -1 when
 * a frame was thrown away, which garbled counts. */
int sc_decoder_push(sc_decoder *decoder, uint8_t byte);

/* Take bytes until a sound frame completes or they are used up. Adds what was taken to *taken;
 * returns the payload's size, 0 when the bytes ran out. */
int sc_decoder_feed(sc_decoder *decoder, const uint8_t *data, size_t size, size_t *taken);

/* pack: write the payload (SC_SIZE_... bytes) and return its size. */
size_t sc_pack_state(const sc_state *state, uint8_t *payload);
size_t sc_pack_command(const sc_command *command, uint8_t *payload);
size_t sc_pack_hello(const sc_hello *hello, uint8_t *payload);
size_t sc_pack_identity(const sc_identity *identity, uint8_t *payload);
size_t sc_pack_config(const sc_config *config, uint8_t type, uint8_t *payload);

/* unpack: 1 if type and size fit, else 0 and nothing is written. */
int sc_unpack_state(const uint8_t *payload, size_t size, sc_state *state);
int sc_unpack_command(const uint8_t *payload, size_t size, sc_command *command);
int sc_unpack_hello(const uint8_t *payload, size_t size, sc_hello *hello);
int sc_unpack_identity(const uint8_t *payload, size_t size, sc_identity *identity);
int sc_unpack_config(const uint8_t *payload, size_t size, uint8_t type, sc_config *config);

#endif
