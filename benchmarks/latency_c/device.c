/* A device on a pseudo-terminal that paces itself and measures the lag of whoever controls it.
 *
 *   device TICK_US      prints the port's path, serves until stdin ends, prints its figures
 *
 * It asks for real-time priority, as a device has a processor of its own. While ENABLE is in force
 * it counts at each tick the lag in ticks by echo_sequence, and for each command the time since the
 * STATE that it answers was written. The blades follow the torque, or a sine while the virtual hand
 * of HAND_SPEED moves them.
 */
#define _GNU_SOURCE

#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "sc_messages.h"
#include "sc_wire.h"

enum { REMEMBERED = 65536, LAGS = 4096, MOST_REPLIES = 1 << 22 };

static const double INERTIA = 1e-3, DAMPING = 0.02, MASS = 1.0, DRAG = 5.0;

static int master;
static uint32_t tick_us, sequence;
static int streaming, on, fault;
static double brake_after_us = 1e4, silent_us;
static float hand_speed;
static sc_command command;
static double opening = 0.6, rate, advance, advance_rate, hand_phase = 1.4274487578895312; /* at 0.6 */
static int64_t written_ns[REMEMBERED];
static uint64_t lags[LAGS], faults, held, ticks;
static uint32_t last_echo;
static float *replies;
static size_t reply_count;

static int64_t now_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static void send_payload(const uint8_t *payload, size_t size)
{
    uint8_t frame[SC_FRAME_MAX];
    const size_t whole = sc_encode_frame(payload, size, frame, sizeof frame);
    if (write(master, frame, whole) != (ssize_t)whole) {
        return; /* a full buffer loses the frame */
    }
}

static void say_who(uint32_t nonce)
{
    uint8_t payload[SC_SIZE_IDENTITY];
    sc_identity who = {SC_PROTOCOL_VERSION, 0x8003, nonce, sc_schema_hash(), "latency", "1", 1,
                       tick_us, 1.0f, 30.0f, 0.0f, 1.0f, -0.05f, 0.25f, 1e-5f, 1e-6f, 0.06f};
    send_payload(payload, sc_pack_identity(&who, payload));
}

static void set_value(const sc_config *config)
{
    uint8_t payload[SC_SIZE_CONFIG_ECHO];
    const sc_config_echo echo = {0, config->key, config->nonce, config->value};
    if (config->key == 1) {
        streaming = config->value != 0.0f;
    } else if (config->key == 2) {
        brake_after_us = 1e3 * (double)config->value;
    } else if (config->key == 0x8001) {
        hand_speed = config->value;
    }
    send_payload(payload, sc_pack_config_echo(&echo, payload));
}

static void take_command(const sc_command *taken, int64_t at_ns)
{
    if ((taken->flags & 1) && on && reply_count < MOST_REPLIES &&
        taken->echo_sequence != command.echo_sequence) {
        const int64_t since = at_ns - written_ns[taken->echo_sequence % REMEMBERED];
        replies[reply_count++] = (float)((double)since * 1e-3);
    }
    command = *taken;
    on = (taken->flags & 1) != 0;
    silent_us = 0.0;
    if (taken->flags & 2) {
        fault = 0;
    }
}

static void take_bytes(sc_decoder *decoder)
{
    uint8_t bytes[4096];
    ssize_t size;
    while ((size = read(master, bytes, sizeof bytes)) > 0) {
        const int64_t at_ns = now_ns();
        size_t taken = 0;
        int got;
        while ((got = sc_decoder_feed(decoder, bytes, (size_t)size, &taken)) > 0) {
            sc_command asked;
            sc_config config;
            sc_hello hello;
            if (sc_unpack_command(decoder->buffer, (size_t)got, &asked)) {
                take_command(&asked, at_ns);
            } else if (sc_unpack_config(decoder->buffer, (size_t)got, &config)) {
                set_value(&config);
            } else if (sc_unpack_hello(decoder->buffer, (size_t)got, &hello)) {
                say_who(hello.nonce);
            }
        }
    }
}

static void move(void)
{
    const double dt = tick_us * 1e-6, torque = on && !fault ? (double)command.torque : 0.0;
    const double force = on && !fault ? (double)command.force : 0.0;
    if (hand_speed > 0.0f) {
        hand_phase += dt * 2.0 * (double)hand_speed;
        const double next = 0.55 + 0.35 * cos(hand_phase);
        rate = (next - opening) / dt;
        opening = next;
    } else {
        rate += dt * (torque - DAMPING * rate) / INERTIA;
        opening += dt * rate;
    }
    advance_rate += dt * (force - DRAG * advance_rate) / MASS;
    advance += dt * advance_rate;
}

static void count_lag(void)
{
    if (!on) {
        return;
    }
    const uint32_t lag = sequence - command.echo_sequence;
    lags[lag < LAGS ? lag : LAGS - 1]++;
    held += command.echo_sequence == last_echo;
    last_echo = command.echo_sequence;
    ticks++;
}

static void tick(void)
{
    uint8_t payload[SC_SIZE_STATE];
    silent_us += tick_us;
    if (on && silent_us > brake_after_us && !fault) {
        fault = 1;
        faults++;
    }
    move();
    sequence++;
    count_lag();
    if (!streaming) {
        return;
    }
    const sc_state state = {(uint16_t)((on && !fault ? 1 : 0) | (fault ? 2 : 0)), sequence,
                            sequence * tick_us, (float)opening, (float)advance,
                            on ? command.torque : 0.0f, 0.0f};
    written_ns[sequence % REMEMBERED] = now_ns();
    send_payload(payload, sc_pack_state(&state, payload));
}

static int rising(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static double lag_at(double share)
{
    uint64_t sum = 0;
    for (int i = 0; i < LAGS; i++) {
        sum += lags[i];
        if ((double)sum >= share * (double)ticks && sum > 0) {
            return i;
        }
    }
    return 0;
}

static void report(int realtime)
{
    const double shares[] = {0.5, 0.99, 0.999, 1.0};
    qsort(replies, reply_count, sizeof *replies, rising);
    printf("{\"ticks\": %llu, \"held\": %llu, \"faults\": %llu, \"realtime\": %d, \"lag\": [",
           (unsigned long long)ticks, (unsigned long long)held, (unsigned long long)faults,
           realtime);
    for (int i = 0; i < 4; i++) {
        printf("%s%g", i ? ", " : "", lag_at(shares[i]));
    }
    printf("], \"reply_us\": [");
    for (int i = 0; i < 4; i++) {
        const size_t at = reply_count ? (size_t)(shares[i] * (double)(reply_count - 1)) : 0;
        printf("%s%.1f", i ? ", " : "", reply_count ? (double)replies[at] : 0.0);
    }
    printf("]}\n");
}

static void open_terminal(void)
{
    struct termios raw;
    master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    grantpt(master);
    unlockpt(master);
    const int slave = open(ptsname(master), O_RDWR | O_NOCTTY); /* stays open: no hangups */
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    printf("%s\n", ptsname(master));
    fflush(stdout);
}

int main(int argc, char **argv)
{
    const struct sched_param priority = {20};
    sc_decoder decoder;
    tick_us = argc > 1 ? (uint32_t)strtoul(argv[1], NULL, 10) : 1000;
    replies = calloc(MOST_REPLIES, sizeof *replies);
    const int realtime = sched_setscheduler(0, SCHED_FIFO, &priority) == 0;
    (void)mlockall(MCL_CURRENT | MCL_FUTURE);
    sc_decoder_init(&decoder);
    open_terminal();
    int64_t due_ns = now_ns() + (int64_t)tick_us * 1000;
    for (;;) {
        const int64_t left_ns = due_ns - now_ns();
        if (left_ns > 0) {
            struct pollfd ends[] = {{master, POLLIN, 0}, {STDIN_FILENO, POLLIN, 0}};
            const struct timespec wait = {0, (long)left_ns};
            if (ppoll(ends, 2, &wait, NULL) > 0 && ends[1].revents) {
                break;
            }
            take_bytes(&decoder);
            continue;
        }
        take_bytes(&decoder);
        tick();
        due_ns += (int64_t)tick_us * 1000;
    }
    report(realtime);
    return 0;
}
