/* A core in a test: its board, its inputs, what it sent last. */
#ifndef TEST_RIG_H
#define TEST_RIG_H

#include "fw_record.h"

#include <string.h>

typedef struct {
    fw_core core;
    fw_board board;
    fw_record_in in;
    fw_record_out out;
    sc_decoder decoder;
    sc_state state; /* the last one */
    sc_identity identity;
    sc_config_echo echo;
    sc_load_echo load;
    int states;     /* frames decoded, of each kind */
    int identities;
    int echoes;
    int garbled;
} rig;

static inline fw_board sound_board(void)
{
    fw_board b;
    memset(&b, 0, sizeof b);
    memcpy(b.name, "test", 4);
    memcpy(b.serial, "0001", 4);
    b.firmware_version = 7;
    b.tick_us = 1000;
    b.capabilities = SC_CAPABILITY_ADVANCE_MOTOR | SC_CAPABILITY_TORQUE_MEASURED |
                     SC_CAPABILITY_HANDLE_FORCE_SENSOR;
    b.torque_limit = 0.5f;
    b.force_limit = 20.0f;
    b.opening_min = 0.0f;
    b.opening_max = 1.0f;
    b.advance_min = -0.1f;
    b.advance_max = 0.2f;
    b.opening_resolution = 1e-4f;
    b.advance_resolution = 1e-6f;
    b.handle_radius = 0.06f;
    b.torque_slew = 1000.0f;
    b.force_slew = 40000.0f;
    b.overspeed = 20.0f;
    b.opening_leap = 0.1f;
    b.advance_leap = 0.01f;
    b.torque_per_A = 0.1f;
    b.resistance = 1.0f;
    b.current_limit = 8.0f;
    b.current_continuous = 2.0f;
    b.i2t_limit = 10.0f;
    b.supply_min = 11.0f;
    b.supply_max = 13.0f;
    b.temperature_max = 80.0f;
    return b;
}

static inline fw_board homing_board(void)
{
    fw_board b = sound_board();
    b.capabilities |= SC_CAPABILITY_HOMES;
    b.home_torque = 0.05f;
    b.home_speed = 0.2f;
    b.home_opening = 0.9f;
    b.home_timeout = 4.0f;
    return b;
}

static inline int start(rig *r, const fw_board *board)
{
    memset(r, 0, sizeof *r);
    r->board = *board;
    r->in.inputs.opening = 0.5f;
    r->in.inputs.supply = 12.0f;
    r->in.inputs.temperature = 25.0f;
    sc_decoder_init(&r->decoder);
    return fw_init(&r->core, board);
}

static inline void put(rig *r, const uint8_t *payload, size_t size)
{
    uint8_t *at = r->in.received + r->in.received_size;
    r->in.received_size +=
        (uint32_t)sc_encode_frame(payload, size, at, FW_RECORD_RECEIVED - r->in.received_size);
}

static inline void command_for(rig *r, unsigned flags, float torque, float force, unsigned hold)
{
    uint8_t payload[SC_SIZE_COMMAND];
    sc_command command;
    memset(&command, 0, sizeof command);
    command.flags = (uint16_t)flags;
    command.torque = torque;
    command.force = force;
    command.hold_ticks = (uint8_t)hold;
    put(r, payload, sc_pack_command(&command, payload));
}

static inline void command(rig *r, unsigned flags, float torque)
{
    command_for(r, flags, torque, 0.0f, 0);
}

static inline void set(rig *r, unsigned key, float value)
{
    uint8_t payload[SC_SIZE_CONFIG];
    sc_config config;
    memset(&config, 0, sizeof config);
    config.key = (uint16_t)key;
    config.nonce = 5;
    config.value = value;
    put(r, payload, sc_pack_config(&config, payload));
}

static inline void hello(rig *r, uint32_t nonce)
{
    uint8_t payload[SC_SIZE_HELLO];
    sc_hello message;
    message.protocol_version = SC_PROTOCOL_VERSION;
    message.nonce = nonce;
    put(r, payload, sc_pack_hello(&message, payload));
}

/* Read what was sent. */
static inline void read_frames(rig *r, const uint8_t *data, size_t size)
{
    size_t taken = 0;
    int got;
    while ((got = sc_decoder_feed(&r->decoder, data, size, &taken)) > 0) {
        const uint8_t *payload = r->decoder.buffer;
        r->states += sc_unpack_state(payload, (size_t)got, &r->state);
        r->identities += sc_unpack_identity(payload, (size_t)got, &r->identity);
        r->echoes += sc_unpack_config_echo(payload, (size_t)got, &r->echo);
        sc_unpack_load_echo(payload, (size_t)got, &r->load);
    }
    r->garbled = (int)r->decoder.garbled;
}

/* Pass one tick with what was put; the clock goes on. */
static inline void tick(rig *r)
{
    r->in.inputs.device_us += r->board.tick_us;
    fw_record_tick(&r->core, &r->in, &r->out);
    r->in.received_size = 0;
    read_frames(r, r->out.sent, r->out.sent_size);
}

static inline void ticks(rig *r, int count)
{
    while (count-- > 0) {
        tick(r);
    }
}

/* Pass ticks, each with the same COMMAND. */
static inline void commanded_ticks(rig *r, int count, unsigned flags, float torque)
{
    while (count-- > 0) {
        command(r, flags, torque);
        tick(r);
    }
}

static inline int has(const rig *r, unsigned flag)
{
    return (r->state.flags & flag) != 0;
}

#endif
