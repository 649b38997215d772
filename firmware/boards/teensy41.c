/* Teensy 4.1 (i.MX RT1062): a brushed motor on a bridge with two inputs, on Teensyduino's start and
 * native USB.
 *
 * Not yet run on hardware. The functions below are those of Teensyduino's core
 * (github.com/PaulStoffregen/cores, teensy4/core_pins.h, pwm.c and usb_serial.h), which calls setup and
 * loop. The watchdog's addresses: its imxrt.h; bits, keys and order as in tonton81/WDT_T4. Its reset
 * needs a core whose startup.c sets IOMUXC_GPR_GPR16 to 0x00200007, as the present one does.
 *
 *     2, 3      encoder A, B                    14 (A0)  motor current, mid-supply at 0 A
 *     4, 5      bridge IN1, IN2                 15 (A1)  supply
 *     6         stop button, closed to ground   16 (A2)  handle force
 *     7         bridge fault, low when it has one
 */
#include "teensy41_table.h"

uint32_t micros(void);
void pinMode(uint8_t pin, uint8_t mode);
uint8_t digitalRead(uint8_t pin);
void attachInterrupt(uint8_t pin, void (*function)(void), int mode);
int analogRead(uint8_t pin);
void analogReadRes(unsigned int bits);
void analogReadAveraging(unsigned int num);
void analogWrite(uint8_t pin, int value);
uint32_t analogWriteRes(uint32_t bits);
void analogWriteFrequency(uint8_t pin, float frequency);
int usb_serial_read(void *buffer, uint32_t size);
int usb_serial_write(const void *buffer, uint32_t size);
int usb_serial_write_buffer_free(void);
void usb_serial_flush_output(void);
void setup(void);
void loop(void);

static volatile int32_t counts;
static volatile uint8_t phase; /* encoder A and B when an edge came last */
static float current_zero;     /* steps */
static uint32_t tick_began;
static uint8_t received[512], sending[SEND_SIZE];

/* An edge of A or B: one step of the Gray code either way; two at once are a lost edge, not counted. */
static void count_edge(void)
{
    static const int8_t steps[16] = {0, 1, -1, 0, -1, 0, 0, 1, 1, 0, 0, -1, 0, -1, 1, 0};
    const uint8_t now = (uint8_t)(digitalRead(ENCODER_A) << 1 | digitalRead(ENCODER_B));
    counts += steps[phase << 2 | now];
    phase = now;
}

void board_start(void)
{
    const uint8_t inputs[] = {ENCODER_A, ENCODER_B, STOP_BUTTON, BRIDGE_FAULT};
    for (size_t i = 0; i < sizeof inputs; i++) {
        pinMode(inputs[i], INPUT_PULLUP);
    }
    analogWriteRes(PWM_BITS);
    analogWriteFrequency(BRIDGE_IN1, PWM_HZ); /* pins 4 and 5 are of different timers */
    analogWriteFrequency(BRIDGE_IN2, PWM_HZ);
    board_release();
    analogReadRes(12);
    analogReadAveraging(8);
    phase = (uint8_t)(digitalRead(ENCODER_A) << 1 | digitalRead(ENCODER_B));
    attachInterrupt(ENCODER_A, count_edge, CHANGE);
    attachInterrupt(ENCODER_B, count_edge, CHANGE);
    for (int repeat = 0; repeat < 64; repeat++) {
        current_zero += (float)analogRead(CURRENT) / 64.0f;
    }
    tick_began = micros();
}

/* RTWDOG (WDOG3): 524 periods of 32,768 Hz are 16 ms; WDOG1 counts half seconds. It is unlocked for 128
 * bus clocks, so no interrupt may come between. The reset leaves the bridge's inputs open: pull both
 * down, so that it lets go. */
void board_start_watchdog(void)
{
    REG(CCM_CCGR5) |= 3u << 4; /* its clock */
    __asm__ volatile("cpsid i" ::: "memory");
    REG(WDOG3 + 0x04u) = 0xD928C520u;
    while (!(REG(WDOG3) & 1u << 11)) {
    }
    REG(WDOG3 + 0x08u) = 524u;
    REG(WDOG3 + 0x0Cu) = 0u;                    /* no window */
    REG(WDOG3) = 1u << 13 | 1u << 8 | 1u << 7; /* 32-bit commands, LPO clock, on, no change later */
    __asm__ volatile("cpsie i" ::: "memory");
    while (!(REG(WDOG3) & 1u << 10)) {
    }
}

void board_wait(void)
{
    while (micros() - tick_began < board_table.tick_us) {
    }
    tick_began += board_table.tick_us;
    REG(WDOG3 + 0x04u) = 0xB480A602u;
}

void board_measure(fw_inputs *in)
{
    in->device_us = micros();
    in->opening = (float)counts * RAD_PER_COUNT;
    in->advance = 0.0f;
    in->current = ((float)analogRead(CURRENT) - current_zero) * AMPS_PER_COUNT * MOTOR_SIGN;
    in->motor_torque = in->current * board_table.torque_per_A;
    in->supply = (float)analogRead(SUPPLY) * VOLTS_PER_COUNT;
    in->temperature = 0.0f;
    const int force = analogRead(FORCE);
    in->handle_force = (float)force * NEWTONS_PER_COUNT + NEWTONS_AT_ZERO;
    in->flags = (digitalRead(STOP_BUTTON) ? (uint32_t)FW_IN_STOP_BUTTON : 0u) |
                (digitalRead(BRIDGE_FAULT) ? 0u : (uint32_t)FW_IN_DRIVER_FAULT) |
                (force < 8 || force > 4087 ? (uint32_t)FW_IN_FORCE_SATURATED : 0u);
}

static void set_bridge(int first, int second)
{
    analogWrite(BRIDGE_IN1, first);
    analogWrite(BRIDGE_IN2, second);
}

void board_release(void)
{
    set_bridge(0, 0);
}

/* Both inputs high brake, so one of them is low for the share of time that drives. */
void board_drive(uint32_t drive, float duty)
{
    const int top = 1 << PWM_BITS;
    const float share = duty * MOTOR_SIGN;
    const int low = (int)((share < 0.0f ? -share : share) * (float)top);
    if (drive == FW_RELEASE) {
        board_release();
    } else {
        set_bridge(share < 0.0f ? top - low : top, share < 0.0f ? top : top - low);
    }
}

size_t board_receive(const uint8_t **data)
{
    const int size = usb_serial_read(received, sizeof received);
    *data = received;
    return size > 0 ? (size_t)size : 0u;
}

/* Never more than USB takes at once: a host that does not read stops no tick. */
size_t board_send_room(void)
{
    const int room = usb_serial_write_buffer_free();
    return room >= (int)sizeof sending ? sizeof sending : 0u;
}

uint8_t *board_send_buffer(void)
{
    return sending;
}

void board_send(size_t size)
{
    if (size > 0) {
        usb_serial_write(sending, (uint32_t)size);
        usb_serial_flush_output(); /* now, not when a packet is full */
    }
}

void setup(void)
{
    loop_start();
}

void loop(void)
{
    loop_tick();
}
