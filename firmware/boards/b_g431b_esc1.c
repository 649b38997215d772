/* B-G431B-ESC1 (STM32G431CB): a brushed motor between the outputs U and V.
 *
 * Not yet run on hardware. Registers and bits: compared with ST's stm32g431xx.h (cmsis-device-g4) and
 * stm32g4xx_ll_adc.h, _ll_opamp.h, RCC and DMA requests with NuttX's stm32g4xxxx_*.h; section numbers
 * are RM0440's. Pins and alternate functions: stm32duino's tables of this board. The clock is the
 * part's own HSI16, right within 1 %: the host learns its rate.
 *
 *     PB3, PB4    USART2 to the ST-LINK, 921600 baud    PB6, PB7  encoder A, B (J8)
 *     PA8, PC13   phase U, high and low side            PA2       its current, amplified by OPAMP1
 *     PA9, PA12   phase V, high and low side            PA0       supply
 *     PA10, PB15  phase W, never switched on            PB8       stop button, closed to ground (J8: Z)
 */
#include "b_g431b_esc1_table.h"

static float current_zero; /* steps */
static int32_t counts;
static uint32_t taken;     /* of the ring */
static uint8_t ring[RX_SIZE], sending[TX_SIZE];
static volatile uint16_t readings[PERIODS * CHANNELS];

/* 144 MHz: HSI16 / 4 * 72 / 2; half of it for a moment, so that the supply follows (RM0440, 7.2.7). */
static void start_clock(void)
{
    REG(FLASH_ACR) = 1u << 18 | 7u << 8 | 4u; /* debugger, caches, prefetch, 4 wait states */
    while ((REG(FLASH_ACR) & 15u) != 4u) {
    }
    REG(RCC + 0x0Cu) = 1u << 24 | 72u << 8 | 3u << 4 | 2u;
    REG(RCC + 0x00u) |= 1u << 24; /* PLL */
    while (!(REG(RCC + 0x00u) & 1u << 25)) {
    }
    REG(RCC + 0x08u) = 8u << 4 | 3u;
    while ((REG(RCC + 0x08u) & 12u) != 12u) {
    }
    for (volatile int wait = 0; wait < 100; wait++) {
    }
    REG(RCC + 0x08u) = 3u;
    REG(RCC + 0x48u) |= 1u << 2 | 1u;                 /* DMAMUX, DMA1 */
    REG(RCC + 0x4Cu) |= 1u << 13 | 7u;                /* ADC12, GPIOA, B, C */
    REG(RCC + 0x58u) |= 1u << 17 | 1u << 4 | 1u << 2 | 1u; /* USART2, TIM6, TIM4, TIM2 */
    REG(RCC + 0x60u) |= 1u << 11 | 1u;                /* TIM1, SYSCFG with the OPAMPs */
}

/* Regulator 20 us, calibration, on. */
static void start_adc(void)
{
    const uint32_t began = REG(TIM2 + 0x24u);
    while (REG(TIM2 + 0x24u) - began < 50u) {
    }
    REG(ADC1 + 0x08u) |= 1u << 31;
    while (REG(ADC1 + 0x08u) & 1u << 31) {
    }
    for (volatile int wait = 0; wait < 100; wait++) {
    }
    REG(ADC1 + 0x00u) = 1u;
    REG(ADC1 + 0x08u) |= 1u;
    while (!(REG(ADC1 + 0x00u) & 1u)) {
    }
    REG(ADC1 + 0x08u) |= 1u << 2;
}

/* Mean of a channel over the last PERIODS of the PWM: a tick of 1 ms, in steps. */
static float mean_of(int channel)
{
    uint32_t sum = 0;
    for (int period = 0; period < PERIODS; period++) {
        sum += readings[period * CHANNELS + channel];
    }
    return (float)sum / (float)PERIODS;
}

void board_start(void)
{
    start_clock();
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        REG(settings[i][0]) = settings[i][1];
    }
    REG(TIM6 + 0x2Cu) = board_table.tick_us - 1u;
    REG(TIM6 + 0x14u) = 1u;
    REG(TIM6 + 0x00u) = 1u;
    REG(DMA1 + 0x14u) = (uint32_t)(uintptr_t)ring;
    REG(DMA1 + 0x08u) = 1u << 7 | 1u << 5 | 1u; /* circular */
    REG(DMA1 + 0x28u) = (uint32_t)(uintptr_t)sending;
    REG(DMA1 + 0x3Cu) = (uint32_t)(uintptr_t)readings;
    REG(DMA1 + 0x30u) = 1u << 10 | 1u << 8 | 1u << 7 | 1u << 5 | 1u; /* 16 bits, circular */
    start_adc();
    board_wait();
    board_wait();
    board_wait();
    current_zero = mean_of(0); /* no current: the bridge was never on */
}

void board_start_watchdog(void)
{
    REG(IWDG + 0x00u) = 0xCCCCu;
    REG(IWDG + 0x00u) = 0x5555u;
    REG(IWDG + 0x04u) = 0u; /* 32 kHz / 4, 128 steps: 16 ms */
    REG(IWDG + 0x08u) = 127u;
}

void board_wait(void)
{
    while (!(REG(TIM6 + 0x10u) & 1u)) {
    }
    REG(TIM6 + 0x10u) = 0u;
    REG(IWDG + 0x00u) = 0xAAAAu;
}

void board_measure(fw_inputs *in)
{
    in->device_us = REG(TIM2 + 0x24u);
    counts += (int16_t)((uint16_t)REG(TIM4 + 0x24u) - (uint16_t)counts);
    in->opening = (float)counts * RAD_PER_COUNT;
    in->advance = 0.0f;
    in->current = (mean_of(0) - current_zero) * AMPS_PER_COUNT * MOTOR_SIGN;
    in->motor_torque = in->current * board_table.torque_per_A;
    in->supply = mean_of(1) * VOLTS_PER_COUNT;
    in->temperature = 0.0f;
    in->handle_force = 0.0f;
    in->flags = (REG(GPIOB + 0x10u) >> 8 & 1u) * FW_IN_STOP_BUTTON;
}

void board_release(void)
{
    REG(TIM1 + 0x44u) &= ~(1u << 15); /* MOE */
}

/* The two phases around half the supply; both low sides on brake. */
void board_drive(uint32_t drive, float duty)
{
    const float swing = 0.5f * duty * MOTOR_SIGN;
    const float middle = drive == FW_DRIVE ? 0.5f : 0.0f;
    REG(TIM1 + 0x34u) = (uint32_t)((middle + swing) * (float)PWM_TOP);
    REG(TIM1 + 0x38u) = (uint32_t)((middle - swing) * (float)PWM_TOP);
    if (drive == FW_RELEASE) {
        board_release();
    } else {
        REG(TIM1 + 0x44u) |= 1u << 15;
    }
}

size_t board_receive(const uint8_t **data)
{
    const uint32_t filled = (RX_SIZE - REG(DMA1 + 0x0Cu)) % RX_SIZE;
    const uint32_t from = taken, to = filled < from ? (uint32_t)RX_SIZE : filled;
    *data = ring + from;
    taken = to % RX_SIZE;
    return to - from;
}

/* What the line carries in a tick, so that a long reply delays no STATE; 0 while it sends. */
size_t board_send_room(void)
{
    return REG(DMA1 + 0x20u) > 0 ? 0u : (size_t)TX_SIZE;
}

uint8_t *board_send_buffer(void)
{
    return sending;
}

void board_send(size_t size)
{
    if (size > 0) {
        REG(DMA1 + 0x1Cu) = 0u; /* the count is written while the channel is off */
        REG(DMA1 + 0x04u) = 15u << 4;
        REG(DMA1 + 0x20u) = (uint32_t)size;
        REG(DMA1 + 0x1Cu) = 1u << 7 | 1u << 4 | 1u;
    }
}
