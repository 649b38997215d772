/* Packs messages byte by byte, so that padding and byte order do not matter.
 * Generated from data_schemas/wire.json by write_wire.py: do not edit. */
#include "sc_messages.h"

#include "sc_bytes.h"

uint64_t sc_schema_hash(void)
{
    return UINT64_C(0xAE72CC7C5BFA0A33);
}

size_t sc_pack_state(const sc_state *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_STATE);
    put_u8(payload + 1, message->cause);
    put_u16(payload + 2, message->flags);
    put_u32(payload + 4, message->sequence);
    put_u32(payload + 8, message->device_us);
    put_f32(payload + 12, message->opening);
    put_f32(payload + 16, message->advance);
    put_f32(payload + 20, message->motor_torque);
    put_f32(payload + 24, message->handle_force);
    return SC_SIZE_STATE;
}

int sc_unpack_state(const uint8_t *payload, size_t size, sc_state *message)
{
    if (size != SC_SIZE_STATE || payload[0] != SC_TYPE_STATE) {
        return 0;
    }
    message->cause = get_u8(payload + 1);
    message->flags = get_u16(payload + 2);
    message->sequence = get_u32(payload + 4);
    message->device_us = get_u32(payload + 8);
    message->opening = get_f32(payload + 12);
    message->advance = get_f32(payload + 16);
    message->motor_torque = get_f32(payload + 20);
    message->handle_force = get_f32(payload + 24);
    return 1;
}

size_t sc_pack_command(const sc_command *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_COMMAND);
    put_u8(payload + 1, message->hold_ticks);
    put_u16(payload + 2, message->flags);
    put_u32(payload + 4, message->echo_sequence);
    put_f32(payload + 8, message->torque);
    put_f32(payload + 12, message->force);
    return SC_SIZE_COMMAND;
}

int sc_unpack_command(const uint8_t *payload, size_t size, sc_command *message)
{
    if (size != SC_SIZE_COMMAND || payload[0] != SC_TYPE_COMMAND) {
        return 0;
    }
    message->hold_ticks = get_u8(payload + 1);
    message->flags = get_u16(payload + 2);
    message->echo_sequence = get_u32(payload + 4);
    message->torque = get_f32(payload + 8);
    message->force = get_f32(payload + 12);
    return 1;
}

size_t sc_pack_hello(const sc_hello *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_HELLO);
    put_u8(payload + 1, message->protocol_version);
    put_u16(payload + 2, 0);
    put_u32(payload + 4, message->nonce);
    return SC_SIZE_HELLO;
}

int sc_unpack_hello(const uint8_t *payload, size_t size, sc_hello *message)
{
    if (size != SC_SIZE_HELLO || payload[0] != SC_TYPE_HELLO) {
        return 0;
    }
    message->protocol_version = get_u8(payload + 1);
    message->nonce = get_u32(payload + 4);
    return 1;
}

size_t sc_pack_identity(const sc_identity *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_IDENTITY);
    put_u8(payload + 1, message->protocol_version);
    put_u16(payload + 2, message->capabilities);
    put_u32(payload + 4, message->nonce_echo);
    put_u64(payload + 8, message->schema_hash);
    memcpy(payload + 16, message->name, sizeof message->name);
    memcpy(payload + 32, message->serial, sizeof message->serial);
    put_u32(payload + 48, message->firmware_version);
    put_u32(payload + 52, message->tick_us);
    put_f32(payload + 56, message->torque_limit);
    put_f32(payload + 60, message->force_limit);
    put_f32(payload + 64, message->opening_min);
    put_f32(payload + 68, message->opening_max);
    put_f32(payload + 72, message->advance_min);
    put_f32(payload + 76, message->advance_max);
    put_f32(payload + 80, message->opening_resolution);
    put_f32(payload + 84, message->advance_resolution);
    put_f32(payload + 88, message->handle_radius);
    return SC_SIZE_IDENTITY;
}

int sc_unpack_identity(const uint8_t *payload, size_t size, sc_identity *message)
{
    if (size != SC_SIZE_IDENTITY || payload[0] != SC_TYPE_IDENTITY) {
        return 0;
    }
    message->protocol_version = get_u8(payload + 1);
    message->capabilities = get_u16(payload + 2);
    message->nonce_echo = get_u32(payload + 4);
    message->schema_hash = get_u64(payload + 8);
    memcpy(message->name, payload + 16, sizeof message->name);
    memcpy(message->serial, payload + 32, sizeof message->serial);
    message->firmware_version = get_u32(payload + 48);
    message->tick_us = get_u32(payload + 52);
    message->torque_limit = get_f32(payload + 56);
    message->force_limit = get_f32(payload + 60);
    message->opening_min = get_f32(payload + 64);
    message->opening_max = get_f32(payload + 68);
    message->advance_min = get_f32(payload + 72);
    message->advance_max = get_f32(payload + 76);
    message->opening_resolution = get_f32(payload + 80);
    message->advance_resolution = get_f32(payload + 84);
    message->handle_radius = get_f32(payload + 88);
    return 1;
}

size_t sc_pack_config(const sc_config *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_CONFIG);
    put_u8(payload + 1, 0);
    put_u16(payload + 2, message->key);
    put_u32(payload + 4, message->nonce);
    put_f32(payload + 8, message->value);
    return SC_SIZE_CONFIG;
}

int sc_unpack_config(const uint8_t *payload, size_t size, sc_config *message)
{
    if (size != SC_SIZE_CONFIG || payload[0] != SC_TYPE_CONFIG) {
        return 0;
    }
    message->key = get_u16(payload + 2);
    message->nonce = get_u32(payload + 4);
    message->value = get_f32(payload + 8);
    return 1;
}

size_t sc_pack_config_echo(const sc_config_echo *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_CONFIG_ECHO);
    put_u8(payload + 1, message->status);
    put_u16(payload + 2, message->key);
    put_u32(payload + 4, message->nonce);
    put_f32(payload + 8, message->value);
    return SC_SIZE_CONFIG_ECHO;
}

int sc_unpack_config_echo(const uint8_t *payload, size_t size, sc_config_echo *message)
{
    if (size != SC_SIZE_CONFIG_ECHO || payload[0] != SC_TYPE_CONFIG_ECHO) {
        return 0;
    }
    message->status = get_u8(payload + 1);
    message->key = get_u16(payload + 2);
    message->nonce = get_u32(payload + 4);
    message->value = get_f32(payload + 8);
    return 1;
}

size_t sc_pack_load_begin(const sc_load_begin *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_LOAD_BEGIN);
    put_u8(payload + 1, 0);
    put_u16(payload + 2, message->image_format);
    put_u32(payload + 4, message->nonce);
    put_u32(payload + 8, message->size);
    put_u32(payload + 12, message->crc32);
    return SC_SIZE_LOAD_BEGIN;
}

int sc_unpack_load_begin(const uint8_t *payload, size_t size, sc_load_begin *message)
{
    if (size != SC_SIZE_LOAD_BEGIN || payload[0] != SC_TYPE_LOAD_BEGIN) {
        return 0;
    }
    message->image_format = get_u16(payload + 2);
    message->nonce = get_u32(payload + 4);
    message->size = get_u32(payload + 8);
    message->crc32 = get_u32(payload + 12);
    return 1;
}

size_t sc_pack_load_chunk(const sc_load_chunk *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_LOAD_CHUNK);
    put_u8(payload + 1, message->count);
    put_u16(payload + 2, 0);
    put_u32(payload + 4, message->nonce);
    put_u32(payload + 8, message->offset);
    memcpy(payload + 12, message->bytes, sizeof message->bytes);
    return SC_SIZE_LOAD_CHUNK;
}

int sc_unpack_load_chunk(const uint8_t *payload, size_t size, sc_load_chunk *message)
{
    if (size != SC_SIZE_LOAD_CHUNK || payload[0] != SC_TYPE_LOAD_CHUNK) {
        return 0;
    }
    message->count = get_u8(payload + 1);
    message->nonce = get_u32(payload + 4);
    message->offset = get_u32(payload + 8);
    memcpy(message->bytes, payload + 12, sizeof message->bytes);
    return 1;
}

size_t sc_pack_load_commit(const sc_load_commit *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_LOAD_COMMIT);
    put_u8(payload + 1, 0);
    put_u16(payload + 2, 0);
    put_u32(payload + 4, message->nonce);
    return SC_SIZE_LOAD_COMMIT;
}

int sc_unpack_load_commit(const uint8_t *payload, size_t size, sc_load_commit *message)
{
    if (size != SC_SIZE_LOAD_COMMIT || payload[0] != SC_TYPE_LOAD_COMMIT) {
        return 0;
    }
    message->nonce = get_u32(payload + 4);
    return 1;
}

size_t sc_pack_load_echo(const sc_load_echo *message, uint8_t *payload)
{
    put_u8(payload + 0, SC_TYPE_LOAD_ECHO);
    put_u8(payload + 1, message->status);
    put_u16(payload + 2, 0);
    put_u32(payload + 4, message->nonce);
    put_u32(payload + 8, message->received);
    put_u32(payload + 12, message->capacity);
    put_u32(payload + 16, message->crc32);
    return SC_SIZE_LOAD_ECHO;
}

int sc_unpack_load_echo(const uint8_t *payload, size_t size, sc_load_echo *message)
{
    if (size != SC_SIZE_LOAD_ECHO || payload[0] != SC_TYPE_LOAD_ECHO) {
        return 0;
    }
    message->status = get_u8(payload + 1);
    message->nonce = get_u32(payload + 4);
    message->received = get_u32(payload + 8);
    message->capacity = get_u32(payload + 12);
    message->crc32 = get_u32(payload + 16);
    return 1;
}
