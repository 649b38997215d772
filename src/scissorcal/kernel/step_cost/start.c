/* Start of a program on a Cortex-M4F under qemu: the floating-point unit is enabled, input and output go
 * to the host by semihosting (newlib's librdimon), and the program's result ends qemu. qemu loads
 * the data where they belong and zeroes the rest. */
#include <stdint.h>
#include <stdlib.h>

extern char stack_top;
extern void initialise_monitor_handles(void);
extern int main(void);

void reset(void);
void _init(void); /* newlib calls both */
void _fini(void);
static void stuck(void);

typedef union {
    const void *stack;
    void (*handler)(void);
} vector;

__attribute__((section(".vectors"), used)) static const vector VECTORS[7] = {
    {&stack_top},       {.handler = reset}, {.handler = stuck}, {.handler = stuck},
    {.handler = stuck}, {.handler = stuck}, {.handler = stuck},
};

void _init(void)
{
}

void _fini(void)
{
}

void reset(void)
{
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20; /* CPACR: CP10 and CP11 */
    __asm volatile("dsb\n isb");
    initialise_monitor_handles();
    exit(main());
}

static void stuck(void)
{
    exit(99);
}
