/* Ring and mailbox between two threads: nothing is torn, nothing is seen too early. Under
 * ThreadSanitizer (make threads) also that every word they share is published properly. */
#define _POSIX_C_SOURCE 200809L

#include "check.h"
#include "sc_block.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES = 400000, REQUESTS = 20000, GIVEN_UP = 7 };

static sc_sample sample_of(uint32_t k)
{
    sc_sample sample;
    memset(&sample, 0, sizeof sample);
    sample.sequence = k;
    sample.flags = ~k;
    sample.device_time_us = (int64_t)k * 3;
    sample.opening = sample.advance = sample.torque_command = (double)k;
    sample.stroke = (int32_t)k;
    sample.latency_ns = k;
    return sample;
}

static void *write_samples(void *shared)
{
    for (uint32_t k = 0; k < SAMPLES; k++) {
        const sc_sample sample = sample_of(k);
        sc_block_push(shared, &sample);
    }
    return NULL;
}

static void check_ring(sc_block *block)
{
    static sc_sample samples[500];
    pthread_t writer;
    uint64_t cursor = 0, lost = 0, read = 0, torn = 0, late = 0, rounds = 0;
    CHECK(pthread_create(&writer, NULL, write_samples, block) == 0, "ring");
    uint32_t next = 0;
    while (cursor < SAMPLES) {
        const uint64_t late_by = rounds++ % 2 ? 50 : 0; /* just overtaken, or about to be */
        const uint64_t full = cursor + SC_RING_SAMPLES - 25 + late_by;
        while (__atomic_load_n(&block->written, __ATOMIC_RELAXED) <
               (full < SAMPLES ? full : SAMPLES)) {
        }
        const uint64_t n = sc_block_read(block, &cursor, samples, 500, &lost);
        for (uint64_t i = 0; i < n; i++) {
            const sc_sample whole = sample_of(samples[i].sequence);
            torn += memcmp(&whole, &samples[i], sizeof whole) != 0;
            late += samples[i].sequence < next;
            next = samples[i].sequence + 1;
        }
        read += n;
    }
    pthread_join(writer, NULL);
    CHECK(torn == 0, "ring");
    CHECK(late == 0, "ring");
    CHECK(read + lost == SAMPLES, "ring");
    CHECK(lost > 0, "ring");
}

/* What the loop does with the mailbox, at full speed: a request's value is its key's square. */
static void *answer_requests(void *shared)
{
    sc_block *block = shared;
    size_t mixed = 0;
    uint32_t answered = 0;
    while (answered != REQUESTS) {
        uint32_t key;
        float value;
        const uint32_t wanted = sc_block_wanted(block, &key, &value);
        mixed += value != (float)key * (float)key;
        if (wanted != answered) {
            answered = wanted;
            sc_block_answer(block, wanted, key, value);
        }
    }
    return (void *)mixed;
}

static void check_mailbox(sc_block *block)
{
    pthread_t loop;
    void *mixed;
    size_t wrong = 0;
    CHECK(pthread_create(&loop, NULL, answer_requests, block) == 0, "mailbox");
    for (uint32_t k = 1; k <= REQUESTS; k++) {
        const uint32_t key = k % 4000;
        const uint32_t request = sc_block_request(block, key, (float)key * (float)key);
        if (k % GIVEN_UP == 0 && k < REQUESTS) {
            continue; /* as after a timeout: the next request comes while this one is being read */
        }
        while (!sc_block_answered(block, request)) {
        }
        wrong += block->mailbox.status != key;
        wrong += block->mailbox.value_in_force != (float)key * (float)key;
    }
    pthread_join(loop, &mixed);
    CHECK(mixed == NULL, "mailbox");
    CHECK(wrong == 0, "mailbox");
}

/* Estimates of the plate at full speed: all five numbers of a section are of one estimate. */
static void *write_estimates(void *shared)
{
    for (uint32_t k = 1; k <= REQUESTS; k++) {
        const float number = (float)k;
        const sc_placing placing = {{number, number, number, number, number}, k, k};
        sc_block_place(shared, &placing);
    }
    return NULL;
}

static void check_estimates(sc_block *block)
{
    pthread_t supervisor;
    uint32_t turn = 0, last = 0, taken = 0, mixed = 0, back = 0;
    sc_placing placing = {{0.0f, 0.0f, 0.0f, 0.0f, 0.0f}, 0, 0};
    CHECK(sc_block_placed(block, &turn, &placing) == 0, "estimates");
    CHECK(pthread_create(&supervisor, NULL, write_estimates, block) == 0, "estimates");
    while (last < REQUESTS) {
        if (!sc_block_placed(block, &turn, &placing)) {
            continue;
        }
        const sc_section *s = &placing.section;
        const float number = (float)placing.usable;
        mixed += placing.age_us != placing.usable || s->edge_x != number || s->edge_y != number ||
                 s->pitch != number || s->stretch != number || s->thickening != number;
        back += placing.usable <= last;
        last = placing.usable;
        taken++;
    }
    pthread_join(supervisor, NULL);
    CHECK(mixed == 0 && back == 0 && taken > 0, "estimates");
    CHECK(sc_block_placed(block, &turn, &placing) == 0, "estimates");
}

int main(void)
{
    sc_block *block = malloc((size_t)sc_block_size(0));
    sc_block_init(block, 0);
    CHECK(sc_block_is_sound(block, sc_block_size(0)), "block");
    check_ring(block);
    check_mailbox(block);
    check_estimates(block);
    free(block);
    return checks_done("block");
}
