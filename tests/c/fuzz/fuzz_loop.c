/* Any bytes from a device, and any orders, through the loop and its block of shared memory. */
#define _POSIX_C_SOURCE 200809L

#include "../controls.h"
#include "models.h"
#include "sc_loop.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

enum { REFERENCE = 16 };

static void store(const sc_table *table, sc_table_store *into)
{
    into->size = table->size;
    memcpy(into->x, table->x, (size_t)table->size * sizeof *into->x);
    memcpy(into->y, table->y, (size_t)table->size * sizeof *into->y);
    memcpy(into->slope, table->slope, (size_t)table->size * sizeof *into->slope);
    sc_table_accumulate(table, into->area);
}

static void fill(sc_block *block, input *from)
{
    bench_room room;
    sc_servo_config *config = &block->config;
    config->torque_limit = 0.25f;
    config->torque_slew = 100.0f;
    config->force_limit = 5.0f;
    config->force_slew = 1000.0f;
    config->damping_Nm_s_per_rad = 0.05f;
    config->rate_cutoff_Hz = 100.0f;
    config->opening_kp = 2.0f;
    config->opening_error_limit = config->advance_error_limit = 1.0f;
    config->supervisor_ms = 1000;
    config->opening_low = -3.0f;
    config->opening_high = 3.0f;
    config->opening_rate_limit = 30.0f;
    config->advance_rate_limit = 5.0f;
    config->tick_us = 1000;
    const sc_plate_config plate = {take_byte(from) % 2, 100000, 0.015f, 0.1f, -1.0f, 1.0f};
    config->plate = plate;
    const sc_model model = taken_model(from, &room);
    block->model = model;
    store(&model.edge, &block->edge);
    store(&model.response, &block->response);
    store(&model.friction_opening, &block->friction_opening);
    store(&model.friction_closing, &block->friction_closing);
    store(&model.friction_angle, &block->friction_angle);
    block->has_model = take_byte(from) % 4 != 0;
    block->silence_limit_ms = 1;
    block->control.config = sound_control();
    block->control.has_config = take_byte(from) % 2;
    change_words(from, config, offsetof(sc_servo_config, pieces));
    if (take_byte(from) % 8 == 0) change_words(from, block, offsetof(sc_block, ring));
    (void)sc_block_is_sound(block, sc_block_size(REFERENCE));
    block->reference_capacity = REFERENCE; /* what the memory has */
    sc_block_set_reference_size(block, take_byte(from) % (REFERENCE + 1));
}

static void order(sc_block *block, input *from)
{
    sc_placing placing = {{0.0f, 0.0f, 0.0f, 1.0f, 1.0f}, 1, 0};
    const sc_contour contour = {{0.07f, 0.0f}, {0.0f, 1.0f}, 0.0f, 0.0f, {0.0f, 0.0f}, 0.0f, 0, 1};
    change_words(from, &placing, sizeof placing);
    sc_block_order(block, take_byte(from) % 6u);
    sc_block_fresh_sheet(block, take_float(from, 0.0f, 0.05f));
    sc_block_place(block, &placing);
    sc_control_block_send(&block->control, &contour);
    if (take_byte(from) % 2) (void)sc_block_request(block, take_word(from) % 8u, take_bits(from));
    if (take_byte(from) % 16 == 0) sc_block_stop(block);
    sc_block_beat(block);
}

static void send_states(int fd, input *from)
{
    uint8_t payload[SC_PAYLOAD_MAX], frame[SC_FRAME_MAX];
    uint32_t sequence = 0;
    while (from->size > 0) {
        const uint8_t what = take_byte(from);
        size_t whole;
        if (what % 8 == 7) {
            whole = 1u + take_byte(from) % 32u;
            for (size_t i = 0; i < whole; i++) frame[i] = take_byte(from);
        } else if (what % 8 == 6) {
            const sc_config_echo echo = {.key = take_byte(from) % 8u, .nonce = take_byte(from) % 4u,
                                         .value = take_bits(from)};
            whole = sc_encode_frame(payload, sc_pack_config_echo(&echo, payload), frame, sizeof frame);
        } else {
            sequence += what % 8 != 5;
            const sc_state state = {0, (uint16_t)(what & 8 ? take_word(from) : SC_STATE_MOTOR_ENABLED),
                                    sequence, sequence * 1000u, take_float(from, 0.2f, 0.9f),
                                    take_float(from, -0.03f, 0.03f), take_float(from, -0.2f, 0.2f),
                                    take_float(from, -3.0f, 3.0f)};
            whole = sc_encode_frame(payload, sc_pack_state(&state, payload), frame, sizeof frame);
        }
        if (write(fd, frame, whole) != (ssize_t)whole) return;
    }
}

static void hold_answers(int fd, const sc_block *block)
{
    sc_decoder decoder;
    sc_command command;
    uint8_t bytes[4096];
    ssize_t got;
    sc_decoder_init(&decoder);
    while ((got = read(fd, bytes, sizeof bytes)) > 0) {
        size_t taken = 0;
        int size;
        while ((size = sc_decoder_feed(&decoder, bytes, (size_t)got, &taken)) > 0) {
            if (!sc_unpack_command(decoder.buffer, (size_t)size, &command)) continue;
            PROMISED(fabsf(command.torque) <= block->config.torque_limit);
            PROMISED(fabsf(command.force) <= block->config.force_limit);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static sc_block *block;
    input from = {data, size};
    int ends[2];
    sc_sample samples[64];
    uint64_t cursor = 0, lost = 0;
    signal(SIGPIPE, SIG_IGN);
    if (!block) block = malloc((size_t)sc_block_size(REFERENCE));
    if (!block || socketpair(AF_UNIX, SOCK_STREAM, 0, ends)) abort();
    sc_block_init(block, REFERENCE);
    fill(block, &from);
    order(block, &from);
    fcntl(ends[1], F_SETFL, O_NONBLOCK);
    send_states(ends[1], &from);
    const int hangs_up = take_byte(&from) % 2;
    shutdown(ends[1], hangs_up ? SHUT_RDWR : SHUT_WR);
    const uint32_t reason = sc_loop_run(ends[0], block);
    PROMISED(reason != SC_STOP_NONE && block->exit_reason == reason);
    close(ends[0]);
    if (!hangs_up) hold_answers(ends[1], block);
    close(ends[1]);
    if (size > 0 && data[0] % 32 == 31) { /* a reader that was away for longer than the ring holds */
        sc_control_sample tick;
        memset(&tick, 0, sizeof tick);
        for (uint32_t i = 0; i < SC_RING_SAMPLES + 10u; i++) {
            sc_block_push(block, &block->servo.sample);
            sc_control_block_push(&block->control, &tick);
        }
    }
    while (sc_block_read(block, &cursor, samples, 64, &lost) > 0) {
    }
    (void)sc_block_answered(block, 1);
    sc_control_sample control[8];
    uint64_t at = 0, missed = 0;
    (void)sc_control_block_read(&block->control, &at, control, 8, &missed);
    return 0;
}
