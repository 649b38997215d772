/* Random boards, bytes and inputs into the core: what it never does, whatever comes.
 *
 *   fuzz_core            200,000 ticks from a fixed seed
 *   fuzz_core SEED TICKS
 */
#include "rig.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PROMISED(holds)                                                               \
    do {                                                                              \
        if (!(holds)) {                                                               \
            fprintf(stderr, "line %d: does not hold: %s\n", __LINE__, #holds);        \
            abort();                                                                  \
        }                                                                             \
    } while (0)

static uint64_t random_state;

static uint32_t word(void) /* splitmix64, Steele et al. 2014, doi:10.1145/2660193.2660195 */
{
    uint64_t z = (random_state += UINT64_C(0x9E3779B97F4A7C15));
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return (uint32_t)((z ^ (z >> 31)) >> 32);
}

static int one_in(uint32_t count)
{
    return word() % count == 0;
}

static float any_bits(void)
{
    const uint32_t bits = word();
    float value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Mostly within the ends, one time in odd any bits at all. */
static float value_in(float low, float high, uint32_t odd)
{
    return one_in(odd) ? any_bits() : low + (high - low) * (float)(word() % 4096u) / 4095.0f;
}

static void random_inputs(fw_inputs *in)
{
    in->device_us = one_in(50) ? word() : in->device_us + 1000u;
    in->opening = one_in(300) ? any_bits() : in->opening + value_in(-2e-3f, 2e-3f, 5000);
    if (!(fabsf(in->opening) < 2.0f) && one_in(20)) {
        in->opening = 0.5f;
    }
    in->advance = value_in(0.0f, 1e-3f, 3000);
    in->motor_torque = value_in(-0.5f, 0.5f, 100);
    in->handle_force = value_in(-9.0f, 9.0f, 100);
    in->current = value_in(-3.0f, 3.0f, 3000);
    in->supply = value_in(11.5f, 12.5f, 3000);
    in->temperature = value_in(20.0f, 60.0f, 3000);
    in->flags = one_in(500) ? word() : (one_in(100) ? FW_IN_AT_HOME : 0u);
}

enum { IMAGE_MOST = 600 };

/* A straight edge and response, level friction; at times with one bit wrong. */
static uint32_t image_of_paper(uint8_t *image)
{
    static const uint32_t whole[] = {FW_IMAGE_MAGIC, FW_IMAGE_FORMAT, 4u * (FW_IMAGE_WORDS + 32u)};
    static const uint32_t knots[] = {2, 2, 2, 2, 2, 1, SC_CLOSURE_WORK, 1, 1};
    static const float numbers[] = {5e-5f, 0.6f, 0.8f, 0.1f, 0.01f, 0.06f, 0.075f, 0.0f, 1.0f,
                                    0.0f, 0.1f, /* the drive */ 0.4f, 50.0f, 9.0f, 900.0f, 0.2f,
                                    100.0f, 0.003f, 0.0f, 1e-4f, 1e-3f, 1e-6f, 0.02f, 1.0f};
    static const float tables[] = {0.0f, 0.075f, -0.008f, -0.005f, 0.04f, 0.04f,
                                   0.0f, 0.002f, 0.0f, 30.0f, 15000.0f, 15000.0f, 0.0f, 0.03f,
                                   0.0f, 5.0f, 0.01f, 0.01f, 0.0f, 0.0f,
                                   0.0f, 5.0f, 0.01f, 0.01f, 0.0f, 0.0f,
                                   0.0f, 1.0f, 1.0f, 1.0f, 0.0f, 0.0f};
    const float one = 1.0f;
    memcpy(image, whole, sizeof whole);
    memcpy(image + 12, &one, 4);
    memcpy(image + 16, knots, sizeof knots);
    memcpy(image + 52, numbers, sizeof numbers);
    memcpy(image + 148, tables, sizeof tables);
    if (one_in(3)) {
        image[word() % whole[2]] ^= (uint8_t)(1u << word() % 8u);
    }
    return whole[2];
}

/* The next part of an upload, in order but at times. */
static void upload(rig *r)
{
    static uint8_t image[IMAGE_MOST];
    static uint32_t size, offset;
    uint8_t payload[SC_PAYLOAD_MAX];
    size_t filled;
    if (size == 0u || one_in(40)) {
        size = image_of_paper(image);
        offset = 0;
        const sc_load_begin begin = {(uint16_t)(one_in(20) ? word() : FW_IMAGE_FORMAT), word(),
                                     one_in(20) ? word() : size, fw_crc32(0, image, size)};
        filled = sc_pack_load_begin(&begin, payload);
    } else if (offset < size) {
        sc_load_chunk chunk = {0, word(), one_in(20) ? word() : offset, {0}};
        const uint32_t left = size - offset < 192u ? size - offset : 192u;
        chunk.count = (uint8_t)(one_in(20) ? word() % 256u : left);
        memcpy(chunk.bytes, image + offset, left);
        offset += left;
        filled = sc_pack_load_chunk(&chunk, payload);
    } else {
        const sc_load_commit commit = {word()};
        filled = sc_pack_load_commit(&commit, payload);
        size = one_in(2) ? 0u : size;
    }
    r->in.received_size =
        (uint32_t)sc_encode_frame(payload, filled, r->in.received, sizeof r->in.received);
}

static void random_bytes(rig *r)
{
    switch (word() % 13) {
    case 5: upload(r); break;
    case 0:
        r->in.received_size = word() % 40u;
        for (uint32_t i = 0; i < r->in.received_size; i++) {
            r->in.received[i] = (uint8_t)word();
        }
        break;
    case 1: set(r, word() % 6u, one_in(2) ? (float)(word() % 2u) : any_bits()); break;
    case 2: hello(r, word()); break;
    case 3: set(r, SC_KEY_STREAM, one_in(4) ? 0.0f : 1.0f); break;
    case 4: break;
    default:
        command_for(r, word() % 4u, value_in(-1.0f, 1.0f, 50), value_in(-40.0f, 40.0f, 50),
                    word() % 4u ? 0u : word() % 256u);
        if (one_in(20)) { /* one byte wrong */
            r->in.received[word() % r->in.received_size] ^= (uint8_t)(word() | 1u);
        }
    }
    if (one_in(1000)) {
        r->in.received_size = word();
    }
}

/* What the last readable COMMAND asked for, decoded beside the core. */
static void follow(sc_decoder *decoder, const rig *r, sc_command *last)
{
    size_t taken = 0;
    int got;
    const size_t size =
        r->in.received_size < FW_RECORD_RECEIVED ? r->in.received_size : FW_RECORD_RECEIVED;
    while ((got = sc_decoder_feed(decoder, r->in.received, size, &taken)) > 0) {
        sc_command command;
        if (sc_unpack_command(decoder->buffer, (size_t)got, &command) &&
            isfinite(command.torque) && isfinite(command.force)) {
            *last = command;
        }
    }
}

static void check(const rig *r, const sc_command *asked, float torque, float force)
{
    const fw_board *b = &r->board;
    const fw_outputs *out = &r->out.outputs;
    const float step = 1.0001f * b->torque_slew * 1e-6f * (float)b->tick_us;
    PROMISED(out->drive <= FW_BRAKE && r->out.phase <= FW_FAULT);
    PROMISED(fabsf(out->torque) <= b->torque_limit && fabsf(out->force) <= b->force_limit);
    PROMISED(out->drive == FW_DRIVE || (out->torque == 0.0f && out->force == 0.0f));
    PROMISED((out->drive == FW_BRAKE) == (r->out.phase == FW_FAULT));
    PROMISED((r->out.cause != SC_CAUSE_NONE) == (r->out.phase == FW_FAULT));
    if (r->out.phase == FW_ENABLED) {
        PROMISED((asked->flags & SC_COMMAND_ENABLE) != 0);
    } else if (r->out.phase == FW_HOMING) {
        PROMISED(fabsf(out->torque) <= fabsf(b->home_torque) && out->force == 0.0f);
    } else {
        PROMISED(out->drive != FW_DRIVE);
    }
    if ((r->in.inputs.flags & (FW_IN_STOP_BUTTON | FW_IN_DRIVER_FAULT)) != 0 ||
        !isfinite(r->in.inputs.opening)) {
        PROMISED(out->drive == FW_BRAKE);
    }
    PROMISED(fabsf(out->torque) <= fabsf(torque) + step);
    PROMISED(fabsf(out->force) <= fabsf(force) + b->force_slew * 1.0001e-6f * (float)b->tick_us);
    const float opening = r->in.inputs.opening + r->core.opening_zero;
    PROMISED(r->out.phase == FW_HOMING || !(opening >= b->opening_max && out->torque > 0.0f));
    PROMISED(r->out.phase == FW_HOMING || !(opening <= b->opening_min && out->torque < 0.0f));
    PROMISED(r->garbled == 0);
}

int main(int count, char **words)
{
    random_state = count > 1 ? strtoull(words[1], 0, 10) : 1u;
    long left = count > 2 ? strtol(words[2], 0, 10) : 200000;
    long phases[5] = {0}, sent = 0, rendered = 0;
    while (left > 0) {
        static rig r;
        sc_decoder decoder;
        sc_command asked;
        fw_board board = one_in(2) ? homing_board() : sound_board();
        board.torque_slew = one_in(2) ? 5.0f : 1000.0f;
        if (one_in(10)) { /* a table with one wrong number */
            float *numbers = &board.torque_limit;
            numbers[word() % 26u] = any_bits();
        }
        start(&r, &board);
        static fw_render render;
        static float memory[IMAGE_MOST / 4];
        if (r.core.problem == FW_BOARD_POSSIBLE && !one_in(4)) {
            fw_let_render(&r.core, &render, memory, sizeof memory);
        }
        sc_decoder_init(&decoder);
        memset(&asked, 0, sizeof asked);
        for (long i = 0; i < 2000 && left > 0; i++, left--) {
            const float torque = r.out.outputs.torque, force = r.out.outputs.force;
            random_inputs(&r.in.inputs);
            random_bytes(&r);
            follow(&decoder, &r, &asked);
            tick(&r);
            phases[r.out.phase]++;
            rendered += r.core.rendering && render.step.torque != 0.0f;
            sent += (long)r.out.sent_size;
            if (r.core.problem == FW_BOARD_POSSIBLE) {
                check(&r, &asked, torque, force);
            } else {
                PROMISED(r.out.outputs.drive == FW_RELEASE && r.out.sent_size == 0);
            }
        }
    }
    for (int phase = 0; phase < 5; phase++) {
        PROMISED(phases[phase] > 0);
        printf("%ld ticks in phase %d\n", phases[phase], phase);
    }
    PROMISED(rendered > 0);
    printf("%ld ticks rendered a torque\n", rendered);
    printf("fuzz: %ld bytes sent\n", sent);
    return 0;
}
