/* The shortest loop that answers each STATE: poll, decode, COMMAND of zero torque with ENABLE.
 *
 *   echo PORT SECONDS      with real-time priority and locked memory where they are granted
 */
#define _GNU_SOURCE

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "sc_messages.h"
#include "sc_wire.h"

static int port;

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void send_payload(const uint8_t *payload, size_t size)
{
    uint8_t frame[SC_FRAME_MAX];
    const size_t whole = sc_encode_frame(payload, size, frame, sizeof frame);
    if (write(port, frame, whole) != (ssize_t)whole) {
        exit(1);
    }
}

static void answer(uint16_t flags, uint32_t sequence)
{
    uint8_t payload[SC_SIZE_COMMAND];
    const sc_command command = {flags, sequence, 0.0f, 0.0f};
    send_payload(payload, sc_pack_command(&command, payload));
}

static void set_value(uint16_t key, float value)
{
    uint8_t payload[SC_SIZE_CONFIG];
    const sc_config config = {key, 1, value};
    send_payload(payload, sc_pack_config(&config, payload));
}

int main(int argc, char **argv)
{
    const struct sched_param priority = {10};
    sc_decoder decoder;
    struct termios raw;
    if (argc < 3 || (port = open(argv[1], O_RDWR | O_NOCTTY | O_NONBLOCK)) < 0) {
        return 1;
    }
    tcgetattr(port, &raw);
    cfmakeraw(&raw);
    tcsetattr(port, TCSANOW, &raw);
    (void)sched_setscheduler(0, SCHED_FIFO, &priority);
    (void)mlockall(MCL_CURRENT | MCL_FUTURE);
    sc_decoder_init(&decoder);
    set_value(2, 500.0f);
    set_value(1, 1.0f);
    const double end = now_s() + strtod(argv[2], NULL);
    uint32_t newest = 0;
    while (now_s() < end) {
        uint8_t bytes[4096];
        struct pollfd line = {port, POLLIN, 0};
        size_t taken = 0;
        int got, states = 0;
        if (poll(&line, 1, 5) <= 0) {
            continue;
        }
        const ssize_t size = read(port, bytes, sizeof bytes);
        while (size > 0 && (got = sc_decoder_feed(&decoder, bytes, (size_t)size, &taken)) > 0) {
            sc_state state;
            if (sc_unpack_state(decoder.buffer, (size_t)got, &state)) {
                newest = state.sequence;
                states++;
            }
        }
        if (states > 0) {
            answer(1, newest);
        }
    }
    answer(0, newest);
    set_value(1, 0.0f);
    return 0;
}
