/* The constants of one device on a Teensy 4.1, an example's: replace each by your device's. Then the
 * pins, and Teensyduino's numbers for modes.
 *
 * The example: a coreless 12 V motor of 20 mN m/A and 5 ohm behind a capstan of 10:1, an AMT102
 * encoder of 512 lines on the motor, a 1 V/A current amplifier, a handle force sensor of +-50 N.
 */
#include "board.h"

const fw_board board_table = {
    .name = "teensy41",
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
    .home_torque = 0.04f,
    .home_speed = 0.3f,
    .home_opening = 1.05f,
    .home_timeout = 10.0f,
    .home_at_stop = 1,
};

const float board_duty_max = 0.95f;

#define MOTOR_SIGN 1.0f                        /* -1 if a positive torque closes the blades */
#define RAD_PER_COUNT 3.0679616e-4f            /* negative if opening counts down */
#define AMPS_PER_COUNT (3.3f / 4096.0f / 1.0f) /* reference, ADC steps, V/A of the amplifier */
#define VOLTS_PER_COUNT (3.3f / 4096.0f * 6.0f) /* divider 50k over 10k */
#define NEWTONS_PER_COUNT (100.0f / 4096.0f)
#define NEWTONS_AT_ZERO (-50.0f)
#define PWM_HZ 36621.0f                        /* 150 MHz / 2^12: the finest steps at this rate */

#define CCM_CCGR5 0x400FC07Cu
#define WDOG3 0x400BC000u /* CS, CNT, TOVAL, WIN */

enum { ENCODER_A = 2, ENCODER_B = 3, BRIDGE_IN1 = 4, BRIDGE_IN2 = 5, STOP_BUTTON = 6, BRIDGE_FAULT = 7 };
enum { CURRENT = 14, SUPPLY = 15, FORCE = 16, PWM_BITS = 12, SEND_SIZE = 256 };
enum { INPUT_PULLUP = 2, CHANGE = 4 }; /* of core_pins.h */
