/* Payloads, field by field and byte by byte, so that neither padding nor byte order matters. */
#include "sc_wire.h"

#include <string.h>

uint64_t sc_schema_hash(void)
{
    return UINT64_C(0xB09FB42A7F073F64);
}

static uint8_t *put_u8(uint8_t *at, uint8_t value)
{
    *at = value;
    return at + 1;
}

static uint8_t *put_u16(uint8_t *at, uint16_t value)
{
    at[0] = (uint8_t)(value & 0xFFu);
    at[1] = (uint8_t)(value >> 8);
    return at + 2;
}

static uint8_t *put_u32(uint8_t *at, uint32_t value)
{
    at = put_u16(at, (uint16_t)(value & 0xFFFFu));
    return put_u16(at, (uint16_t)(value >> 16));
}

static uint8_t *put_f32(uint8_t *at, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return put_u32(at, bits);
}

static uint16_t get_u16(const uint8_t *at)
{
    return (uint16_t)(at[0] | (at[1] << 8));
}

static uint32_t get_u32(const uint8_t *at)
{
    return (uint32_t)get_u16(at) | ((uint32_t)get_u16(at + 2) << 16);
}

static uint64_t get_u64(const uint8_t *at)
{
    return (uint64_t)get_u32(at) | ((uint64_t)get_u32(at + 4) << 32);
}

static float get_f32(const uint8_t *at)
{
    const uint32_t bits = get_u32(at);
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

size_t sc_pack_state(const sc_state *state, uint8_t *payload)
{
    uint8_t *at = put_u8(payload, SC_TYPE_STATE);
    at = put_u8(at, 0);
    at = put_u16(at, state->flags);
    at = put_u32(at, state->sequence);
    at = put_u32(at, state->device_us);
    at = put_f32(at, state->opening);
    at = put_f32(at, state->advance);
    at = put_f32(at, state->motor_torque);
    at = put_f32(at, state->handle_force);
    return (size_t)(at - payload);
}

size_t sc_pack_command(const sc_command *command, uint8_t *payload)
{
    uint8_t *at = put_u8(payload, SC_TYPE_COMMAND);
    at = put_u8(at, 0);
    at = put_u16(at, command->flags);
    at = put_u32(at, command->echo_sequence);
    at = put_f32(at, command->torque);
    at = put_f32(at, command->force);
    return (size_t)(at - payload);
}

size_t sc_pack_hello(const sc_hello *hello, uint8_t *payload)
{
    uint8_t *at = put_u8(payload, SC_TYPE_HELLO);
    at = put_u8(at, hello->protocol_version);
    at = put_u16(at, 0);
    at = put_u32(at, hello->nonce);
    return (size_t)(at - payload);
}

size_t sc_pack_identity(const sc_identity *identity, uint8_t *payload)
{
    uint8_t *at = put_u8(payload, SC_TYPE_IDENTITY);
    at = put_u8(at, identity->protocol_version);
    at = put_u16(at, identity->capabilities);
    at = put_u32(at, identity->nonce_echo);
    at = put_u32(at, (uint32_t)(identity->schema_hash & 0xFFFFFFFFu));
    at = put_u32(at, (uint32_t)(identity->schema_hash >> 32));
    memcpy(at, identity->name, sizeof identity->name);
    at += sizeof identity->name;
    memcpy(at, identity->serial, sizeof identity->serial);
    at += sizeof identity->serial;
    at = put_u32(at, identity->firmware_version);
    at = put_u32(at, identity->tick_us);
    at = put_f32(at, identity->torque_limit);
    at = put_f32(at, identity->force_limit);
    at = put_f32(at, identity->opening_min);
    at = put_f32(at, identity->opening_max);
    at = put_f32(at, identity->advance_min);
    at = put_f32(at, identity->advance_max);
    at = put_f32(at, identity->opening_resolution);
    at = put_f32(at, identity->advance_resolution);
    at = put_f32(at, identity->handle_radius);
    return (size_t)(at - payload);
}

size_t sc_pack_config(const sc_config *config, uint8_t type, uint8_t *payload)
{
    uint8_t *at = put_u8(payload, type);
    at = put_u8(at, config->status);
    at = put_u16(at, config->key);
    at = put_u32(at, config->nonce);
    at = put_f32(at, config->value);
    return (size_t)(at - payload);
}

static int is_message(const uint8_t *payload, size_t size, uint8_t type, size_t expected)
{
    return size == expected && payload[0] == type;
}

int sc_unpack_state(const uint8_t *payload, size_t size, sc_state *state)
{
    if (!is_message(payload, size, SC_TYPE_STATE, SC_SIZE_STATE)) {
        return 0;
    }
    state->flags = get_u16(payload + 2);
    state->sequence = get_u32(payload + 4);
    state->device_us = get_u32(payload + 8);
    state->opening = get_f32(payload + 12);
    state->advance = get_f32(payload + 16);
    state->motor_torque = get_f32(payload + 20);
    state->handle_force = get_f32(payload + 24);
    return 1;
}

int sc_unpack_command(const uint8_t *payload, size_t size, sc_command *command)
{
    if (!is_message(payload, size, SC_TYPE_COMMAND, SC_SIZE_COMMAND)) {
        return 0;
    }
    command->flags = get_u16(payload + 2);
    command->echo_sequence = get_u32(payload + 4);
    command->torque = get_f32(payload + 8);
    command->force = get_f32(payload + 12);
    return 1;
}

int sc_unpack_hello(const uint8_t *payload, size_t size, sc_hello *hello)
{
    if (!is_message(payload, size, SC_TYPE_HELLO, SC_SIZE_HELLO)) {
        return 0;
    }
    hello->protocol_version = payload[1];
    hello->nonce = get_u32(payload + 4);
    return 1;
}

int sc_unpack_identity(const uint8_t *payload, size_t size, sc_identity *identity)
{
    if (!is_message(payload, size, SC_TYPE_IDENTITY, SC_SIZE_IDENTITY)) {
        return 0;
    }
    identity->protocol_version = payload[1];
    identity->capabilities = get_u16(payload + 2);
    identity->nonce_echo = get_u32(payload + 4);
    identity->schema_hash = get_u64(payload + 8);
    memcpy(identity->name, payload + 16, sizeof identity->name);
    memcpy(identity->serial, payload + 32, sizeof identity->serial);
    identity->firmware_version = get_u32(payload + 48);
    identity->tick_us = get_u32(payload + 52);
    identity->torque_limit = get_f32(payload + 56);
    identity->force_limit = get_f32(payload + 60);
    identity->opening_min = get_f32(payload + 64);
    identity->opening_max = get_f32(payload + 68);
    identity->advance_min = get_f32(payload + 72);
    identity->advance_max = get_f32(payload + 76);
    identity->opening_resolution = get_f32(payload + 80);
    identity->advance_resolution = get_f32(payload + 84);
    identity->handle_radius = get_f32(payload + 88);
    return 1;
}

int sc_unpack_config(const uint8_t *payload, size_t size, uint8_t type, sc_config *config)
{
    if (!is_message(payload, size, type, SC_SIZE_CONFIG)) {
        return 0;
    }
    config->status = payload[1];
    config->key = get_u16(payload + 2);
    config->nonce = get_u32(payload + 4);
    config->value = get_f32(payload + 8);
    return 1;
}
