/* What a board without an operating system gives to the loop (loop.c): its table and its functions. */
#ifndef FW_BOARDS_BOARD_H
#define FW_BOARDS_BOARD_H

#include "fw_core.h"

#define REG(address) (*(volatile uint32_t *)(uintptr_t)(address))

extern const fw_board board_table;
extern const float board_duty_max; /* share of the supply that the bridge can put on the motor */

void board_start(void);            /* clock, pins, timers, port, ADC; the motors stay released */
void board_start_watchdog(void);   /* from here on a loop that stops resets the board within 30 ms */
void board_wait(void);             /* until the next tick begins; feeds the watchdog */
void board_measure(fw_inputs *in);
void board_drive(uint32_t drive, float duty); /* FW_DRIVE: duty of the supply, -1 to 1 */
void board_release(void);          /* no current, from any state: also the answer to a fault */

/* Bytes that came: sets *data and returns how many stand there in a row; 0 when there are no more. */
size_t board_receive(const uint8_t **data);

/* How many bytes the line takes in this tick without waiting, and that it shall send them. */
size_t board_send_room(void);
uint8_t *board_send_buffer(void);
void board_send(size_t size);

/* Of loop.c: once, then for each tick. */
void loop_start(void);
void loop_tick(void);

#endif
