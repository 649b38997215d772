/* The constants of one device on a B-G431B-ESC1, an example's: replace each by your device's. Then
 * the part's registers, which stay.
 *
 * The example: a 12 V brushed motor of 60 mN m/A and 0.6 ohm behind a capstan of 8:1, an encoder of
 * 1024 lines on the motor. The board's shunts of 3 mohm resolve 29 mA: for a motor of many amperes.
 */
#include "board.h"

const fw_board board_table = {
    .name = "b_g431b_esc1",
    .serial = "1",
    .firmware_version = 1,
    .tick_us = 1000,
    .capabilities = SC_CAPABILITY_TORQUE_MEASURED | SC_CAPABILITY_HOMES,
    .torque_limit = 2.0f,
    .opening_min = 0.0f,
    .opening_max = 1.05f,
    .opening_resolution = 1.9174760e-4f, /* 2 pi / (4 * 1024 * 8) */
    .handle_radius = 0.07f,
    .torque_slew = 2000.0f,
    .overspeed = 25.0f,
    .opening_leap = 0.1f,
    .torque_per_A = 0.48f,
    .resistance = 0.6f,
    .current_limit = 10.0f,
    .current_continuous = 4.0f,
    .i2t_limit = 100.0f,
    .supply_min = 10.0f,
    .supply_max = 14.0f,
    .home_torque = 0.1f,
    .home_speed = 0.3f,
    .home_opening = 1.05f,
    .home_timeout = 10.0f,
    .home_at_stop = 1,
};

/* The low sides must conduct for a while in each period, for the shunts and the bootstraps: at 0.8 in
 * 3.4 us of 41.7, with the dead time. diglet48/FOC-Stim measured that this board's shunts need 2.6. */
const float board_duty_max = 0.8f;

/* Wiring and scales that only this board knows. */
#define MOTOR_SIGN 1.0f             /* -1 if a positive torque closes the blades */
#define RAD_PER_COUNT 1.9174760e-4f /* negative if opening counts down */
/* Shunt and gain as in SimpleFOC's example for the board; 1.5k, 2.2k and 22k leave 4/7 for the PGA's 16. */
#define AMPS_PER_COUNT (-3.3f / 4096.0f / (0.003f * 64.0f / 7.0f))
#define VOLTS_PER_COUNT (3.3f / 4096.0f * (169.0f + 18.0f) / 18.0f) /* 169k over 18k */

/* Peripherals: RM0440, the chapter behind each. */
enum { PWM_TOP = 3000, PERIODS = 24, CHANNELS = 2, RX_SIZE = 512, TX_SIZE = 88 };

#define FLASH_ACR 0x40022000u /* 3 */
#define RCC 0x40021000u       /* 7 */
#define GPIOA 0x48000000u     /* 9 */
#define GPIOB 0x48000400u
#define GPIOC 0x48000800u
#define DMA1 0x40020000u      /* 12: channel 1 receives, 2 sends, 3 has the ADC's readings */
#define DMAMUX 0x40020800u    /* 13: requests 26 USART2_RX, 27 USART2_TX, 5 ADC1 */
#define ADC1 0x50000000u      /* 21 */
#define ADC12_CCR 0x50000308u
#define OPAMP1_CSR 0x40010300u /* 25 */
#define TIM1 0x40012C00u      /* 28 */
#define TIM2 0x40000000u      /* 29 */
#define TIM4 0x40000800u
#define TIM6 0x40001000u      /* 31 */
#define USART2 0x40004400u    /* 37 */
#define IWDG 0x40003000u      /* 42 */

/* Registers and what they are set to, in this order. PA13 and PA14 stay with the debugger. */
static const uint32_t settings[][2] = {
    {TIM1 + 0x00u, 3u << 5},      {TIM1 + 0x2Cu, PWM_TOP},      /* up and down: 24 kHz at 144 MHz */
    {TIM1 + 0x18u, 0x6868u},      {TIM1 + 0x1Cu, 0x7000u},      /* PWM mode 1; channel 4: mode 2 */
    {TIM1 + 0x40u, PWM_TOP - 1},  {TIM1 + 0x04u, 7u << 4},      /* which triggers the ADC at the top */
    {TIM1 + 0x20u, 0x55u},        {TIM1 + 0x44u, 3u << 10 | 115u}, /* outputs low while MOE is 0; 0.8 us */
    {TIM1 + 0x00u, 3u << 5 | 0x81u},
    {GPIOA + 0x24u, 0x00060066u}, {GPIOA + 0x00u, 0xEADAFFFFu}, /* AF6: PA8, 9, 12; PA10 low */
    {GPIOB + 0x20u, 0x22077000u}, {GPIOB + 0x0Cu, 0x00010100u}, /* AF7: PB3, 4; AF2: PB6, 7 */
    {GPIOB + 0x00u, 0x7FFCAEBFu}, {GPIOC + 0x24u, 0x00400000u}, /* PB15 low; AF4: PC13 */
    {GPIOC + 0x00u, 0xFBFFFFFFu}, {TIM4 + 0x2Cu, 0xFFFFu},
    {TIM4 + 0x18u, 0x3131u},      {TIM4 + 0x08u, 3u},           /* all four edges, filter of 8 samples */
    {TIM4 + 0x00u, 1u},           {TIM2 + 0x28u, 143u},         /* microseconds */
    {TIM2 + 0x2Cu, 0xFFFFFFFFu},  {TIM2 + 0x14u, 1u},
    {TIM2 + 0x00u, 1u},           {TIM6 + 0x28u, 143u},         /* the tick */
    {USART2 + 0x0Cu, 156u},       {USART2 + 0x08u, 3u << 6 | 1u << 12}, /* 923,077 baud; DMA, no overrun */
    {USART2 + 0x00u, 3u << 2 | 1u}, {DMAMUX + 0x00u, 26u},
    {DMAMUX + 0x04u, 27u},        {DMAMUX + 0x08u, 5u},
    {DMA1 + 0x0Cu, RX_SIZE},      {DMA1 + 0x10u, USART2 + 0x24u},
    {DMA1 + 0x24u, USART2 + 0x28u}, {DMA1 + 0x34u, PERIODS * CHANNELS},
    {DMA1 + 0x38u, ADC1 + 0x40u}, {OPAMP1_CSR, 11u << 14 | 1u << 7 | 2u << 5}, /* PGA of 16, VINM0 biased */
    {OPAMP1_CSR, 11u << 14 | 1u << 7 | 2u << 5 | 1u},
    {ADC12_CCR, 3u << 16},        {ADC1 + 0x08u, 0u},           /* ADC clock 36 MHz; no deep power-down */
    {ADC1 + 0x08u, 1u << 28},     {ADC1 + 0x14u, 3u << 9 | 3u << 3}, /* channels 3 and 1: 24.5 cycles */
    {ADC1 + 0x30u, 1u << 12 | 3u << 6 | 1u},                    /* OPAMP1's output, then the supply */
    {ADC1 + 0x0Cu, 1u << 12 | 1u << 10 | 9u << 5 | 3u},         /* each rising TIM1_TRGO; DMA, circular */
};
