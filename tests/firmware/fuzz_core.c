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

static void random_bytes(rig *r)
{
    switch (word() % 12) {
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
    long phases[5] = {0}, sent = 0;
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
        sc_decoder_init(&decoder);
        memset(&asked, 0, sizeof asked);
        for (long i = 0; i < 2000 && left > 0; i++, left--) {
            const float torque = r.out.outputs.torque, force = r.out.outputs.force;
            random_inputs(&r.in.inputs);
            random_bytes(&r);
            follow(&decoder, &r, &asked);
            tick(&r);
            phases[r.out.phase]++;
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
    printf("fuzz: %ld bytes sent\n", sent);
    return 0;
}
