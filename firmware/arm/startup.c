/* From reset to the loop on a Cortex-M4F: vector table, data, bss, FPU. Faults release the motors. */
#include <stdint.h>

#include "board.h"

/* Of the linker script; only their addresses mean something. */
extern uint32_t fw_stack_top[], fw_data_load[], fw_data_start[], fw_data_end[];
extern uint32_t fw_bss_start[], fw_bss_end[];

void fw_reset(void);
void fw_unexpected(void);

/* SCB_CPACR, coprocessor access (PM0214, section 4.6.1): full access to CP10 and CP11, the FPU. */
#define CPACR REG(0xE000ED88u)

/* Nothing is enabled that interrupts, so any exception is a fault: release the motors and wait for
 * the watchdog, which resets. */
void fw_unexpected(void)
{
    board_release();
    for (;;) {
    }
}

void fw_reset(void)
{
    const uint32_t *load = fw_data_load;
    CPACR |= 0xFu << 20;
    __asm__ volatile("dsb\n isb" ::: "memory");
    for (uint32_t *word = fw_data_start; word < fw_data_end; word++) {
        *word = *load++;
    }
    for (uint32_t *word = fw_bss_start; word < fw_bss_end; word++) {
        *word = 0;
    }
    loop_start();
    for (;;) {
        loop_tick();
    }
}

/* The 16 words of the architecture (PM0214, section 2.3.4). The second is where reset begins. */
__attribute__((section(".vectors"), used)) static const struct {
    const uint32_t *stack;
    void (*handlers[15])(void);
} fw_vectors = {
    fw_stack_top,
    {fw_reset, fw_unexpected, fw_unexpected, fw_unexpected, fw_unexpected, fw_unexpected, 0, 0, 0, 0,
     fw_unexpected, fw_unexpected, 0, fw_unexpected, fw_unexpected},
};
