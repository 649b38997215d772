/* STM32F405: a brushed motor on a bridge with two inputs, an encoder, four analogue channels.
 *
 * Not yet run on hardware. Registers and bits: compared with ST's SVD file STM32F40x; section numbers
 * are RM0090's. DMA streams and alternate functions: NuttX's and stm32duino's tables.
 *
 *     PC6, PC7       USART6 to the host, 921600 baud      PA0, PA1   encoder A, B
 *     PA8, PA9       bridge IN1, IN2 (00 free, 11 brake)  PA4        motor current, mid-supply at 0 A
 *     PC0            stop button, closed to ground        PA5, PA6   supply, temperature (TMP36)
 *     PC1            bridge fault, low when it has one    PA7        handle force
 *     PC2            home switch, low when pressed
 */
#include "stm32f405_table.h"

static float current_zero; /* steps */
static uint32_t taken;     /* of the ring */
static uint8_t ring[RX_SIZE], sending[TX_SIZE];

/* 168 MHz from the crystal: APB1 at 42, APB2 at 84, their timers at 84 and 168 MHz. */
static void start_clock(void)
{
    REG(FLASH_ACR) = 7u << 8 | 5u; /* caches, prefetch, 5 wait states */
    REG(RCC + 0x00u) |= 1u << 16;  /* HSE */
    while (!(REG(RCC + 0x00u) & 1u << 17)) {
    }
    REG(RCC + 0x04u) = 7u << 24 | 1u << 22 | 336u << 6 | HSE_MHZ;
    REG(RCC + 0x00u) |= 1u << 24; /* PLL */
    while (!(REG(RCC + 0x00u) & 1u << 25)) {
    }
    REG(RCC + 0x08u) = 4u << 13 | 5u << 10 | 2u;
    while ((REG(RCC + 0x08u) & 12u) != 8u) {
    }
    REG(RCC + 0x30u) |= 1u << 22 | 1u << 2 | 1u; /* DMA2, GPIOC, GPIOA */
    REG(RCC + 0x40u) |= 1u << 4 | 1u << 3 | 1u;  /* TIM6, TIM5, TIM2 */
    REG(RCC + 0x44u) |= 1u << 8 | 1u << 5 | 1u;  /* ADC1, USART6, TIM1 */
}

/* Means of ADC_REPEATS readings of each channel, in steps. */
static void read_adc(float *mean)
{
    uint32_t sum[ADC_CHANNELS] = {0};
    for (int repeat = 0; repeat < ADC_REPEATS; repeat++) {
        REG(ADC1 + 0x00u) = 0u;
        REG(ADC1 + 0x08u) |= 1u << 22; /* JSWSTART */
        while (!(REG(ADC1 + 0x00u) & 1u << 2)) {
        }
        for (uint32_t channel = 0; channel < ADC_CHANNELS; channel++) {
            sum[channel] += REG(ADC1 + 0x3Cu + 4u * channel);
        }
    }
    for (int channel = 0; channel < ADC_CHANNELS; channel++) {
        mean[channel] = (float)sum[channel] / (float)ADC_REPEATS;
    }
}

void board_start(void)
{
    float steps[ADC_CHANNELS];
    start_clock();
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        REG(settings[i][0]) = settings[i][1];
    }
    REG(TIM6 + 0x2Cu) = board_table.tick_us - 1u;
    REG(TIM6 + 0x14u) = 1u;
    REG(TIM6 + 0x00u) = 1u;
    REG(DMA2 + 0x34u) = (uint32_t)(uintptr_t)ring;
    REG(DMA2 + 0x28u) = 5u << 25 | 1u << 10 | 1u << 8 | 1u; /* circular */
    REG(DMA2 + 0xACu) = (uint32_t)(uintptr_t)sending;
    read_adc(steps); /* what comes first after power-on is discarded */
    read_adc(steps);
    current_zero = steps[0];
}

void board_start_watchdog(void)
{
    REG(IWDG + 0x00u) = 0xCCCCu;
    REG(IWDG + 0x00u) = 0x5555u;
    REG(IWDG + 0x04u) = 0u; /* 32 kHz (17 to 47) / 4, 128 steps: 11 to 30 ms */
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
    float steps[ADC_CHANNELS];
    in->device_us = REG(TIM5 + 0x24u);
    in->opening = (float)(int32_t)REG(TIM2 + 0x24u) * RAD_PER_COUNT;
    in->advance = 0.0f;
    read_adc(steps);
    in->current = (steps[0] - current_zero) * AMPS_PER_COUNT * MOTOR_SIGN;
    in->motor_torque = in->current * board_table.torque_per_A;
    in->supply = steps[1] * VOLTS_PER_COUNT;
    in->temperature = steps[2] * DEGC_PER_COUNT + DEGC_AT_ZERO;
    in->handle_force = steps[3] * NEWTONS_PER_COUNT + NEWTONS_AT_ZERO;
    const uint32_t pins = REG(GPIOC + 0x10u) ^ 6u; /* the button breaks its line, the others close it */
    in->flags = (pins & 1u) * FW_IN_STOP_BUTTON | (pins >> 1 & 1u) * FW_IN_DRIVER_FAULT |
                (pins >> 2 & 1u) * FW_IN_AT_HOME |
                (steps[3] < 8.0f || steps[3] > 4087.0f ? (uint32_t)FW_IN_FORCE_SATURATED : 0u);
}

void board_release(void)
{
    REG(TIM1 + 0x44u) &= ~(1u << 15); /* MOE */
}

/* Both inputs high brake, so one of them is low for the share of time that drives. */
void board_drive(uint32_t drive, float duty)
{
    const float share = duty * MOTOR_SIGN;
    const uint32_t low = (uint32_t)((share < 0.0f ? -share : share) * (float)PWM_TOP);
    REG(TIM1 + 0x34u) = share < 0.0f ? PWM_TOP - low : (uint32_t)PWM_TOP;
    REG(TIM1 + 0x38u) = share < 0.0f ? (uint32_t)PWM_TOP : PWM_TOP - low;
    if (drive == FW_RELEASE) {
        board_release();
    } else {
        REG(TIM1 + 0x44u) |= 1u << 15;
    }
}

size_t board_receive(const uint8_t **data)
{
    const uint32_t filled = (RX_SIZE - REG(DMA2 + 0x2Cu)) % RX_SIZE;
    const uint32_t from = taken, to = filled < from ? (uint32_t)RX_SIZE : filled;
    *data = ring + from;
    taken = to % RX_SIZE;
    return to - from;
}

/* What the line carries in a tick, so that a long reply delays no STATE; 0 while it sends. */
size_t board_send_room(void)
{
    return REG(DMA2 + 0xA0u) & 1u ? 0u : (size_t)TX_SIZE;
}

uint8_t *board_send_buffer(void)
{
    return sending;
}

void board_send(size_t size)
{
    if (size > 0) {
        REG(DMA2 + 0x0Cu) = 0x3Du << 16; /* flags of stream 6 */
        REG(DMA2 + 0xA4u) = (uint32_t)size;
        REG(DMA2 + 0xA0u) = 5u << 25 | 1u << 10 | 1u << 6 | 1u;
    }
}
