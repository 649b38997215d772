/* The messages of the wire. Generated from data_schemas/wire.json by write_wire.py: do not edit. */
#ifndef SC_MESSAGES_H
#define SC_MESSAGES_H

#include <stddef.h>
#include <stdint.h>

enum {
    SC_PROTOCOL_VERSION = 1,
    SC_PAYLOAD_MAX = 250,
    SC_FRAME_MAX = 254
};

enum {
    SC_TYPE_STATE = 1,
    SC_TYPE_COMMAND = 2,
    SC_TYPE_HELLO = 16,
    SC_TYPE_IDENTITY = 17,
    SC_TYPE_CONFIG = 18,
    SC_TYPE_CONFIG_ECHO = 19
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

enum {
    SC_COMMAND_ENABLE = 1,
    SC_COMMAND_CLEAR_FAULT = 2
};

/* What the device measures, sent each tick. */
typedef struct {
    uint16_t flags;
    uint32_t sequence;
    uint32_t device_us;
    float opening;
    float advance;
    float motor_torque;
    float handle_force;
} sc_state;

/* What the motors shall exert, one for each STATE. */
typedef struct {
    uint16_t flags;
    uint32_t echo_sequence;
    float torque;
    float force;
} sc_command;

/* Asks who is there. */
typedef struct {
    uint8_t protocol_version;
    uint32_t nonce;
} sc_hello;

/* Who the device is and what it can bear. */
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

/* Sets one value. */
typedef struct {
    uint16_t key;
    uint32_t nonce;
    float value;
} sc_config;

/* Answers CONFIG with the value now in force. */
typedef struct {
    uint8_t status;
    uint16_t key;
    uint32_t nonce;
    float value;
} sc_config_echo;

/* First 8 bytes, little-endian, of SHA-256 over the canonical form of wire.json. */
uint64_t sc_schema_hash(void);

/* pack: write the payload (SC_SIZE_... bytes) and return its size.
 * unpack: 1 if type and size are right, else 0 and nothing is written. */
size_t sc_pack_state(const sc_state *message, uint8_t *payload);
int sc_unpack_state(const uint8_t *payload, size_t size, sc_state *message);
size_t sc_pack_command(const sc_command *message, uint8_t *payload);
int sc_unpack_command(const uint8_t *payload, size_t size, sc_command *message);
size_t sc_pack_hello(const sc_hello *message, uint8_t *payload);
int sc_unpack_hello(const uint8_t *payload, size_t size, sc_hello *message);
size_t sc_pack_identity(const sc_identity *message, uint8_t *payload);
int sc_unpack_identity(const uint8_t *payload, size_t size, sc_identity *message);
size_t sc_pack_config(const sc_config *message, uint8_t *payload);
int sc_unpack_config(const uint8_t *payload, size_t size, sc_config *message);
size_t sc_pack_config_echo(const sc_config_echo *message, uint8_t *payload);
int sc_unpack_config_echo(const uint8_t *payload, size_t size, sc_config_echo *message);

#endif
