/* The loop of a bare-metal board: a tick ends whatever the line does. */
#include "board.h"
#include "check.h"
#include "rig.h"

/* 1 ms; at 3,000,000 baud it takes 300 bytes, and a part of the last piece. */
enum { PIECE = 64, MOST = 300 + PIECE };

static uint8_t line[PIECE], sent[256];
static size_t given, waiting;
static int never_ends, driven, watchdog;

const fw_board board_table = {
    .name = "loop", .serial = "1", .tick_us = 1000, .torque_limit = 0.2f, .opening_max = 1.0f,
    .opening_resolution = 1e-4f, .handle_radius = 0.06f, .torque_slew = 100.0f, .overspeed = 20.0f,
    .opening_leap = 0.1f, .torque_per_A = 0.1f, .resistance = 1.0f, .current_limit = 4.0f,
    .current_continuous = 1.0f, .i2t_limit = 10.0f, .supply_min = 10.0f,
};
const float board_duty_max = 0.9f;

void board_start(void) {}
void board_start_watchdog(void) { watchdog = 1; }
void board_wait(void) {}
void board_measure(fw_inputs *in)
{
    memset(in, 0, sizeof *in);
    in->opening = 0.5f;
}
void board_drive(uint32_t drive, float duty)
{
    (void)drive;
    (void)duty;
    driven++;
}
void board_release(void) {}
size_t board_receive(const uint8_t **data)
{
    const size_t size = never_ends || waiting > PIECE ? PIECE : waiting;
    *data = line;
    waiting -= size < waiting ? size : waiting;
    given += size;
    return size;
}
size_t board_send_room(void) { return sizeof sent; }
uint8_t *board_send_buffer(void) { return sent; }
void board_send(size_t size) { (void)size; }

int main(void)
{
    loop_start();
    CHECK(watchdog, "the watchdog runs from the start");
    never_ends = 1;
    loop_tick();
    CHECK(driven == 1 && given >= 300 && given <= MOST, "a line that never ends does not stop a tick");
    loop_tick();
    CHECK(driven == 2 && given <= 2 * MOST, "nor the next");
    never_ends = 0;
    given = 0;
    waiting = 100;
    loop_tick();
    CHECK(given == 100, "what a line brings in a tick is taken");
    waiting = 700;
    loop_tick();
    loop_tick();
    loop_tick();
    CHECK(given == 800 && waiting == 0, "what came while a tick was late follows");
    return checks_done("loop");
}
