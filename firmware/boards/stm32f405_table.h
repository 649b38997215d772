/* The constants of one device on an STM32F405, an example's: replace each by your device's. Then the
 * part's registers, which stay.
 *
 * The example: a coreless 12 V motor of 20 mN m/A and 5 ohm behind a capstan of 10:1, an AMT102
 * encoder of 512 lines on the motor, a 1 V/A current amplifier, a handle force sensor of +-50 N.
 */
#include "board.h"

const fw_board board_table = {
    .name = "stm32f405",
    .serial = "1",
    .firmware_version = 1,
    .tick_us = 1000,
    .capabilities = SC_CAPABILITY_HANDLE_FORCE_SENSOR | SC_CAPABILITY_TORQUE_MEASURED | SC_CAPABILITY_HOMES,
    .torque_limit = 0.25f,
    .opening_min = 0.0f,
    .opening_max = 1.05f,
    .opening_resolution = 3.0679616e-4f, /* 2 pi / (4 * 512 * 10) */
    .handle_radius = 0.07f,
    .torque_slew = 250.0f,
    .overspeed = 25.0f,
    .opening_leap = 0.1f,
    .torque_per_A = 0.2f,
    .resistance = 5.0f,
    .current_limit = 1.5f,
    .current_continuous = 0.6f,
    .i2t_limit = 10.0f,
    .supply_min = 10.0f,
    .supply_max = 14.0f,
    .temperature_max = 70.0f,
    .home_torque = 0.04f,
    .home_speed = 0.3f,
    .home_opening = 1.05f,
    .home_timeout = 10.0f,
    .home_at_stop = 1,
};

/* A bridge's high side needs pauses. */
const float board_duty_max = 0.95f;

/* Wiring and scales that only this board knows. */
#define HSE_MHZ 8u                            /* crystal of the board */
#define MOTOR_SIGN 1.0f                       /* -1 if a positive torque closes the blades */
#define RAD_PER_COUNT 3.0679616e-4f           /* negative if opening counts down */
#define AMPS_PER_COUNT (3.3f / 4096.0f / 1.0f) /* reference, ADC steps, V/A of the amplifier */
#define VOLTS_PER_COUNT (3.3f / 4096.0f * 6.0f) /* divider 50k over 10k */
#define DEGC_PER_COUNT (3.3f / 4096.0f * 100.0f) /* TMP36: 10 mV/degC */
#define DEGC_AT_ZERO (-50.0f)                 /* TMP36: 0.5 V at 0 degC */
#define NEWTONS_PER_COUNT (100.0f / 4096.0f)
#define NEWTONS_AT_ZERO (-50.0f)

/* Peripherals: RM0090, the section behind each. */
enum { ADC_REPEATS = 8, ADC_CHANNELS = 4, PWM_TOP = 4200, RX_SIZE = 512, TX_SIZE = 88 };

#define RCC 0x40023800u       /* 7.3 */
#define FLASH_ACR 0x40023C00u /* 3.9.1 */
#define GPIOA 0x40020000u     /* 8.4 */
#define GPIOC 0x40020800u
#define TIM1 0x40010000u      /* 17.4 */
#define TIM2 0x40000000u      /* 18.4 */
#define TIM5 0x40000C00u
#define TIM6 0x40001000u      /* 20.4 */
#define ADC1 0x40012000u      /* 13.13 */
#define ADC_CCR 0x40012304u
#define USART6 0x40011400u    /* 30.6 */
#define DMA2 0x40026400u      /* 10.5; table 43: channel 5, USART6_RX on stream 1, _TX on stream 6 */
#define IWDG 0x40003000u      /* 21.4 */

/* Registers and what they are set to, in this order. PA13 and PA14 stay with the debugger. */
static const uint32_t settings[][2] = {
    {GPIOA + 0x20u, 0x00000011u}, {GPIOA + 0x24u, 0x00000011u}, /* AF1: TIM2 on PA0, 1; TIM1 on PA8, 9 */
    {GPIOA + 0x00u, 0xA80AFF0Au}, {GPIOC + 0x20u, 0x88000000u}, /* analogue PA4 to 7; AF8 on PC6, 7 */
    {GPIOC + 0x00u, 0x0000A000u}, {GPIOC + 0x0Cu, 0x00004015u}, /* pull-ups on PC0, 1, 2 and 7 */
    {TIM1 + 0x2Cu, PWM_TOP - 1},  {TIM1 + 0x18u, 0x6868u},      /* PWM mode 1 at 40 kHz, preloaded */
    {TIM1 + 0x20u, 0x11u},        {TIM1 + 0x44u, 3u << 10},     /* outputs low while MOE is 0 */
    {TIM1 + 0x00u, 0x81u},        {TIM2 + 0x2Cu, 0xFFFFFFFFu},
    {TIM2 + 0x18u, 0x3131u},      {TIM2 + 0x08u, 3u},           /* all four edges, filter of 8 samples */
    {TIM2 + 0x00u, 1u},           {TIM5 + 0x28u, 83u},          /* microseconds */
    {TIM5 + 0x2Cu, 0xFFFFFFFFu},  {TIM5 + 0x14u, 1u},
    {TIM5 + 0x00u, 1u},           {TIM6 + 0x28u, 83u},          /* the tick */
    {USART6 + 0x08u, 91u},        {USART6 + 0x14u, 3u << 6},    /* 84 MHz / 91 = 923,077 baud; DMA */
    {USART6 + 0x0Cu, 1u << 13 | 3u << 2},
    {DMA2 + 0x30u, USART6 + 4u},  {DMA2 + 0x2Cu, RX_SIZE},
    {DMA2 + 0xA8u, USART6 + 4u},  {ADC_CCR, 1u << 16},          /* ADC clock 21 MHz */
    {ADC1 + 0x04u, 1u << 8},      {ADC1 + 0x10u, 02222u << 12}, /* scan; 28 cycles, channels 4 to 7 */
    {ADC1 + 0x38u, 3u << 20 | 7u << 15 | 6u << 10 | 5u << 5 | 4u},
    {ADC1 + 0x08u, 1u},
};
