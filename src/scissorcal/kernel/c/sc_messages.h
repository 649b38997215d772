/* The messages of the wire. Generated from data_schemas/wire.json by write_wire.py: do not edit. */
#ifndef SC_MESSAGES_H
#define SC_MESSAGES_H

#include <stddef.h>
#include <stdint.h>

enum {
    SC_PROTOCOL_VERSION = 2,
    SC_PAYLOAD_MAX = 250,
    SC_FRAME_MAX = 254
};

enum {
    SC_TYPE_STATE = 1,
    SC_TYPE_COMMAND = 2,
    SC_TYPE_HELLO = 16,
    SC_TYPE_IDENTITY = 17,
    SC_TYPE_CONFIG = 18,
    SC_TYPE_CONFIG_ECHO = 19,
    SC_TYPE_LOAD_BEGIN = 20,
    SC_TYPE_LOAD_CHUNK = 21,
    SC_TYPE_LOAD_COMMIT = 22,
    SC_TYPE_LOAD_ECHO = 23
};

enum {
    SC_SIZE_STATE = 28,
    SC_SIZE_COMMAND = 16,
    SC_SIZE_HELLO = 8,
    SC_SIZE_IDENTITY = 92,
    SC_SIZE_CONFIG = 12,
    SC_SIZE_CONFIG_ECHO = 12,
    SC_SIZE_LOAD_BEGIN = 16,
    SC_SIZE_LOAD_CHUNK = 204,
    SC_SIZE_LOAD_COMMIT = 8,
    SC_SIZE_LOAD_ECHO = 20
};

enum {
    SC_STATE_MOTOR_ENABLED = 1,
    SC_STATE_FAULT_LATCHED = 2,
    SC_STATE_COMMANDS_LOST = 4,
    SC_STATE_OPENING_AT_STOP = 8,
    SC_STATE_TORQUE_SATURATED = 16,
    SC_STATE_HANDLE_FORCE_SATURATED = 32,
    SC_STATE_ENCODER_FAULT = 64,
    SC_STATE_NOT_HOMED = 128,
    SC_STATE_HOMING = 256,
    SC_STATE_RENDERING = 512
};

enum {
    SC_CAUSE_NONE = 0,
    SC_CAUSE_WATCHDOG = 1,
    SC_CAUSE_ENCODER = 2,
    SC_CAUSE_STOP_BUTTON = 3,
    SC_CAUSE_CURRENT = 4,
    SC_CAUSE_HEAT = 5,
    SC_CAUSE_SPEED = 6,
    SC_CAUSE_SUPPLY = 7,
    SC_CAUSE_DRIVER = 8
};

enum {
    SC_COMMAND_ENABLE = 1,
    SC_COMMAND_CLEAR_FAULT = 2
};

enum {
    SC_CAPABILITY_HANDLE_FORCE_SENSOR = 1,
    SC_CAPABILITY_ADVANCE_MOTOR = 2,
    SC_CAPABILITY_TORQUE_MEASURED = 4,
    SC_CAPABILITY_HOMES = 8,
    SC_CAPABILITY_RENDERS = 16,
    SC_CAPABILITY_SIMULATOR = 32768
};

enum {
    SC_CONFIG_OK = 0,
    SC_CONFIG_UNKNOWN_KEY = 1,
    SC_CONFIG_VALUE_REFUSED = 2
};

enum {
    SC_LOAD_OK = 0,
    SC_LOAD_NOT_ANNOUNCED = 1,
    SC_LOAD_OTHER_FORMAT = 2,
    SC_LOAD_TOO_LARGE = 3,
    SC_LOAD_OUT_OF_ORDER = 4,
    SC_LOAD_TORN = 5,
    SC_LOAD_NOT_SOUND = 6,
    SC_LOAD_BUSY = 7
};

enum {
    SC_KEY_STREAM = 1,
    SC_KEY_BRAKE_AFTER_MS = 2,
    SC_KEY_HOME = 3,
    SC_KEY_RENDER = 4,
    SC_KEY_HAND_SPEED_rad_per_s = 32769,
    SC_KEY_MATERIAL = 32770,
    SC_KEY_HAND_STROKES = 32771
};

/* What the device measures, sent each tick. */
typedef struct {
    uint8_t cause;
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
    uint8_t hold_ticks;
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

/* Announces an image of a package. */
typedef struct {
    uint16_t image_format;
    uint32_t nonce;
    uint32_t size;
    uint32_t crc32;
} sc_load_begin;

/* A piece of the image announced last. */
typedef struct {
    uint8_t count;
    uint32_t nonce;
    uint32_t offset;
    uint8_t bytes[192];
} sc_load_chunk;

/* Checks the image and puts it in force at the next tick. */
typedef struct {
    uint32_t nonce;
} sc_load_commit;

/* Answers LOAD_BEGIN, LOAD_CHUNK and LOAD_COMMIT. */
typedef struct {
    uint8_t status;
    uint32_t nonce;
    uint32_t received;
    uint32_t capacity;
    uint32_t crc32;
} sc_load_echo;

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
size_t sc_pack_load_begin(const sc_load_begin *message, uint8_t *payload);
int sc_unpack_load_begin(const uint8_t *payload, size_t size, sc_load_begin *message);
size_t sc_pack_load_chunk(const sc_load_chunk *message, uint8_t *payload);
int sc_unpack_load_chunk(const uint8_t *payload, size_t size, sc_load_chunk *message);
size_t sc_pack_load_commit(const sc_load_commit *message, uint8_t *payload);
int sc_unpack_load_commit(const uint8_t *payload, size_t size, sc_load_commit *message);
size_t sc_pack_load_echo(const sc_load_echo *message, uint8_t *payload);
int sc_unpack_load_echo(const uint8_t *payload, size_t size, sc_load_echo *message);

#endif
