/* Registers by their address, and what startup.c needs of a board. */
#ifndef FW_REGISTERS_H
#define FW_REGISTERS_H

#include <stdint.h>

#define REG(address) (*(volatile uint32_t *)(uintptr_t)(address))

/* Motors without current, from any state: also the answer to a fault of the processor. */
void board_release(void);

#endif
