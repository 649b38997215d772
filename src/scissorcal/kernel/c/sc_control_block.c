#include "sc_control_block.h"

#include <string.h>

/* Writer and reader may be at a contour or a sample at the same time, so that their words are atomic. */
typedef uint32_t __attribute__((may_alias)) sc_control_word;

/* Fails to compile where one of them is no whole number of words. */
typedef char sc_words_fill_control[sizeof(sc_contour) % sizeof(sc_control_word) == 0 &&
                                           sizeof(sc_control_sample) % sizeof(sc_control_word) == 0
                                       ? 1
                                       : -1];

static void share(void *shared, const void *own, size_t size)
{
    sc_control_word *to = (sc_control_word *)shared;
    const sc_control_word *from = (const sc_control_word *)own;
    for (size_t i = 0; i < size / sizeof *to; i++) {
        __atomic_store_n(&to[i], from[i], __ATOMIC_RELAXED);
    }
}

static void fetch(const void *shared, void *own, size_t size)
{
    const sc_control_word *from = (const sc_control_word *)shared;
    sc_control_word *to = (sc_control_word *)own;
    for (size_t i = 0; i < size / sizeof *to; i++) {
        to[i] = __atomic_load_n(&from[i], __ATOMIC_RELAXED);
    }
}

void sc_control_block_send(sc_control_block *block, const sc_contour *contour)
{
    const uint32_t lock = __atomic_load_n(&block->lock, __ATOMIC_RELAXED);
    sc_contour numbered = *contour;
    numbered.number = block->contour.number + 1u;
    __atomic_store_n(&block->lock, lock + 1u, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE); /* no word is seen before the odd number */
    share(&block->contour, &numbered, sizeof numbered);
    __atomic_store_n(&block->lock, lock + 2u, __ATOMIC_RELEASE);
}

int sc_control_block_receive(const sc_control_block *block, sc_contour *contour)
{
    sc_contour newest;
    const uint32_t lock = __atomic_load_n(&block->lock, __ATOMIC_ACQUIRE);
    if (lock & 1u) {
        return 0;
    }
    fetch(&block->contour, &newest, sizeof newest);
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(&block->lock, __ATOMIC_RELAXED) != lock) {
        return 0;
    }
    *contour = newest;
    return 1;
}

void sc_control_block_push(sc_control_block *block, const sc_control_sample *sample)
{
    __atomic_thread_fence(__ATOMIC_RELEASE); /* as in sc_block_push */
    share(&block->ring[block->written % SC_CONTROL_RING], sample, sizeof *sample);
    __atomic_store_n(&block->written, block->written + 1, __ATOMIC_RELEASE);
}

/* Oldest sample that a reader may still touch: the writer may be busy with the one after the last. */
static uint64_t oldest_kept(const sc_control_block *block)
{
    const uint64_t written = __atomic_load_n(&block->written, __ATOMIC_ACQUIRE);
    return written < SC_CONTROL_RING ? 0 : written - SC_CONTROL_RING + 1;
}

uint64_t sc_control_block_read(const sc_control_block *block, uint64_t *cursor,
                               sc_control_sample *samples, uint64_t n, uint64_t *lost)
{
    const uint64_t oldest = oldest_kept(block);
    const uint64_t written = __atomic_load_n(&block->written, __ATOMIC_ACQUIRE);
    if (*cursor < oldest) {
        *lost += oldest - *cursor;
        *cursor = oldest;
    }
    uint64_t count = 0;
    while (count < n && *cursor + count < written) {
        fetch(&block->ring[(*cursor + count) % SC_CONTROL_RING], &samples[count], sizeof *samples);
        count++;
    }
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    const uint64_t kept = oldest_kept(block);
    uint64_t torn = kept > *cursor ? kept - *cursor : 0;
    torn = torn < count ? torn : count;
    memmove(samples, samples + torn, (size_t)(count - torn) * sizeof *samples);
    *lost += torn;
    *cursor += count;
    return count - torn;
}
