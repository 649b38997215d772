/* The loop of a board without an operating system: measure, receive, decide, drive, send.
 *
 * A brushed motor on a bridge that is fed with a voltage gets
 *
 *     u = R i_wanted + k rate + z,        z += R (i_wanted - i_measured) / 2
 *
 * The winding's time constant is well below a tick, so a tick's current is (u - k rate) / R, and the
 * correction z halves what is left of an error in each tick. k is the torque constant, which in SI
 * units is the back-EMF's too.
 */
#include "board.h"

typedef struct {
    float correction;   /* V */
    float wanted;       /* A, of the last tick */
    float last_opening; /* rad */
    float rate;         /* rad/s, over some four ticks */
} motor_state;

static fw_core core;
static fw_render render;
static float image[FW_IMAGE_MOST_BYTES / 4]; /* of a package, loaded by the host */
static motor_state motor;
static int running;

static float within(float value, float most)
{
    return value > most ? most : value < -most ? -most : value;
}

/* The share of the supply to put on the motor. */
static float motor_duty(const fw_inputs *in, const fw_outputs *out)
{
    const fw_board *board = &board_table;
    const float rate = (in->opening - motor.last_opening) * 1e6f / (float)board->tick_us;
    const float supply = in->supply > 1.0f ? in->supply : 1.0f;
    motor.last_opening = in->opening;
    motor.rate += 0.25f * (rate - motor.rate);
    if (out->drive != FW_DRIVE) {
        motor.correction = 0.0f;
        motor.wanted = 0.0f;
        return 0.0f;
    }
    if (board->capabilities & SC_CAPABILITY_TORQUE_MEASURED) {
        motor.correction += 0.5f * board->resistance * (motor.wanted - in->current);
        motor.correction = within(motor.correction, supply); /* winds up no farther */
    }
    motor.wanted = out->torque / board->torque_per_A;
    const float volts = board->resistance * motor.wanted + board->torque_per_A * motor.rate;
    return within((volts + motor.correction) / supply, board_duty_max);
}

void loop_start(void)
{
    board_start();
    board_release();
    running = fw_init(&core, &board_table); /* fw_board_problem names why it is not */
    fw_let_render(&core, &render, image, sizeof image);
    board_start_watchdog();
}

void loop_tick(void)
{
    fw_inputs in;
    fw_outputs out;
    const uint8_t *data;
    board_wait();
    if (!running) {
        return;
    }
    board_measure(&in);
    /* A tick's bytes of the fastest line in docs/protocol.md: 3,000,000 baud and ten bits a byte are
     * three in 10 us. What USB brings beyond that waits for the next tick. */
    const size_t most = board_table.tick_us * 3u / 10u + 1u;
    for (size_t got = 0, size = 1; got < most && size > 0; got += size) {
        size = board_receive(&data);
        fw_receive(&core, data, size);
    }
    fw_tick(&core, &in, &out);
    board_drive(out.drive, motor_duty(&in, &out));
    const size_t room = board_send_room();
    if (room > 0) {
        board_send(fw_take(&core, board_send_buffer(), room));
    }
}
