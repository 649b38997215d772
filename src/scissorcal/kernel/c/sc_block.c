#include "sc_block.h"

#include <string.h>

uint64_t sc_block_size(uint32_t reference_capacity)
{
    return sizeof(sc_block) + (uint64_t)reference_capacity * 4u * sizeof(float);
}

void sc_block_init(sc_block *block, uint32_t reference_capacity)
{
    memset(block, 0, (size_t)sc_block_size(reference_capacity));
    block->magic = SC_BLOCK_MAGIC;
    block->version = SC_BLOCK_VERSION;
    block->size = sc_block_size(reference_capacity);
    block->reference_capacity = reference_capacity;
    block->silence_limit_ms = 1000;
}

int sc_block_is_sound(const sc_block *block, uint64_t size)
{
    return size >= sizeof(sc_block) && block->magic == SC_BLOCK_MAGIC &&
           block->version == SC_BLOCK_VERSION && block->size <= size &&
           block->size == sc_block_size(block->reference_capacity) &&
           block->reference_size <= block->reference_capacity;
}

static void view_table(const sc_table_store *store, sc_table *table)
{
    table->x = store->x;
    table->y = store->y;
    table->slope = store->slope;
    table->area = store->area;
    table->size = store->size;
}

int sc_block_model(const sc_block *block, sc_model *model)
{
    if (!block->has_model) {
        return 0;
    }
    *model = block->model;
    view_table(&block->edge, &model->edge);
    view_table(&block->response, &model->response);
    view_table(&block->friction_opening, &model->friction_opening);
    view_table(&block->friction_closing, &model->friction_closing);
    view_table(&block->friction_angle, &model->friction_angle);
    return sc_model_is_sound(model);
}

void sc_block_reference(const sc_block *block, sc_reference *reference)
{
    const float *first = (const float *)(const void *)(block + 1);
    const uint32_t capacity = block->reference_capacity;
    reference->opening = first;
    reference->opening_rate = first + capacity;
    reference->advance = first + 2 * (size_t)capacity;
    reference->stroke = (const int32_t *)(const void *)(first + 3 * (size_t)capacity);
    const uint32_t size = __atomic_load_n(&block->reference_size, __ATOMIC_ACQUIRE);
    reference->size = size < capacity ? size : capacity;
    reference->task = NULL;
}

void sc_block_task(const sc_block *block, sc_control_task *task)
{
    sc_reference path;
    sc_block_reference(block, &path);
    task->config = &block->control.config;
    task->path.place = path.opening;
    task->path.rate = path.opening_rate;
    task->path.force = path.advance;
    task->path.stage = path.stroke;
    task->path.size = path.size;
}

void sc_block_order(sc_block *block, uint32_t mode)
{
    __atomic_store_n(&block->orders.mode, mode, __ATOMIC_RELAXED);
    __atomic_add_fetch(&block->orders.order, 1u, __ATOMIC_RELEASE);
}

void sc_block_fresh_sheet(sc_block *block, float crack)
{
    __atomic_store(&block->orders.crack, &crack, __ATOMIC_RELAXED);
    __atomic_add_fetch(&block->orders.sheet, 1u, __ATOMIC_RELEASE);
}

/* Writer and reader may be at it at the same time, so that its words are atomic. */
typedef uint32_t __attribute__((may_alias)) sc_half;

enum { SC_HALVES = sizeof(sc_placing) / sizeof(sc_half) };

void sc_block_place(sc_block *block, const sc_placing *placing)
{
    sc_half *to = (sc_half *)(void *)&block->plate.placing;
    const sc_half *from = (const sc_half *)(const void *)placing;
    const uint32_t turn = __atomic_load_n(&block->plate.turn, __ATOMIC_RELAXED);
    __atomic_store_n(&block->plate.turn, turn + 1u, __ATOMIC_RELAXED);
    __atomic_thread_fence(__ATOMIC_RELEASE); /* no word is seen before the odd turn */
    for (size_t i = 0; i < SC_HALVES; i++) {
        __atomic_store_n(&to[i], from[i], __ATOMIC_RELAXED);
    }
    __atomic_store_n(&block->plate.turn, turn + 2u, __ATOMIC_RELEASE);
}

int sc_block_placed(const sc_block *block, uint32_t *turn, sc_placing *placing)
{
    const sc_half *from = (const sc_half *)(const void *)&block->plate.placing;
    sc_half *to = (sc_half *)(void *)placing;
    const uint32_t now = __atomic_load_n(&block->plate.turn, __ATOMIC_ACQUIRE);
    if (now == *turn || (now & 1u)) {
        return 0;
    }
    for (size_t i = 0; i < SC_HALVES; i++) {
        to[i] = __atomic_load_n(&from[i], __ATOMIC_RELAXED);
    }
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    if (__atomic_load_n(&block->plate.turn, __ATOMIC_RELAXED) != now) {
        return 0;
    }
    *turn = now;
    return 1;
}

void sc_block_beat(sc_block *block)
{
    __atomic_add_fetch(&block->orders.heartbeat, 1u, __ATOMIC_RELAXED);
}

void sc_block_stop(sc_block *block)
{
    __atomic_store_n(&block->orders.stop, 1u, __ATOMIC_RELEASE);
}

uint32_t sc_block_request(sc_block *block, uint32_t key, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    __atomic_store_n(&block->mailbox.content, ((uint64_t)bits << 32) | key, __ATOMIC_RELAXED);
    return __atomic_add_fetch(&block->mailbox.wanted, 1u, __ATOMIC_RELEASE);
}

/* The content of this request or, where the supervisor gave up on it, of a later one: never a mixture. */
uint32_t sc_block_wanted(const sc_block *block, uint32_t *key, float *value)
{
    const uint32_t wanted = __atomic_load_n(&block->mailbox.wanted, __ATOMIC_ACQUIRE);
    const uint64_t content = __atomic_load_n(&block->mailbox.content, __ATOMIC_RELAXED);
    const uint32_t bits = (uint32_t)(content >> 32);
    *key = (uint32_t)(content & 0xFFFFFFFFu);
    memcpy(value, &bits, sizeof *value);
    return wanted;
}

void sc_block_answer(sc_block *block, uint32_t request, uint32_t status, float value)
{
    block->mailbox.status = status;
    block->mailbox.value_in_force = value;
    __atomic_store_n(&block->mailbox.answered, request, __ATOMIC_RELEASE);
}

void sc_block_set_reference_size(sc_block *block, uint32_t size)
{
    __atomic_store_n(&block->reference_size, size, __ATOMIC_RELEASE);
}

int sc_block_answered(const sc_block *block, uint32_t request)
{
    return __atomic_load_n(&block->mailbox.answered, __ATOMIC_ACQUIRE) == request;
}

void sc_block_read_orders(const sc_block *block, sc_orders *orders)
{
    const sc_orders *shared = &block->orders;
    orders->order = __atomic_load_n(&shared->order, __ATOMIC_ACQUIRE);
    orders->mode = __atomic_load_n(&shared->mode, __ATOMIC_RELAXED);
    orders->sheet = __atomic_load_n(&shared->sheet, __ATOMIC_ACQUIRE);
    __atomic_load(&shared->crack, &orders->crack, __ATOMIC_RELAXED);
    orders->heartbeat = __atomic_load_n(&shared->heartbeat, __ATOMIC_RELAXED);
    orders->stop = __atomic_load_n(&shared->stop, __ATOMIC_ACQUIRE);
}

/* Writer and reader may be at one sample of the ring at the same time, so that its words are atomic; the
 * reader finds out afterwards and drops what it read. */
typedef uint64_t __attribute__((may_alias)) sc_word;

enum { SC_WORDS = sizeof(sc_sample) / sizeof(sc_word) };

/* Fails to compile where a sample is no whole number of words. */
typedef char sc_words_fill_a_sample[sizeof(sc_sample) % sizeof(sc_word) == 0 ? 1 : -1];

static void write_words(sc_sample *shared, const sc_sample *sample)
{
    sc_word *to = (sc_word *)(void *)shared;
    const sc_word *from = (const sc_word *)(const void *)sample;
    for (size_t i = 0; i < SC_WORDS; i++) {
        __atomic_store_n(&to[i], from[i], __ATOMIC_RELAXED);
    }
}

static void read_words(const sc_sample *shared, sc_sample *sample)
{
    const sc_word *from = (const sc_word *)(const void *)shared;
    sc_word *to = (sc_word *)(void *)sample;
    for (size_t i = 0; i < SC_WORDS; i++) {
        to[i] = __atomic_load_n(&from[i], __ATOMIC_RELAXED);
    }
}

void sc_block_push(sc_block *block, const sc_sample *sample)
{
    /* No part of this sample may be seen before the count of those before it, or a reader on
     * another core would take an overwritten sample for a whole one. */
    __atomic_thread_fence(__ATOMIC_RELEASE);
    write_words(&block->ring[block->written % SC_RING_SAMPLES], sample);
    __atomic_store_n(&block->written, block->written + 1, __ATOMIC_RELEASE);
}

/* Oldest sample that a reader may still touch: the writer may be busy with the one after the last. */
static uint64_t oldest_kept(const sc_block *block)
{
    const uint64_t written = __atomic_load_n(&block->written, __ATOMIC_ACQUIRE);
    return written < SC_RING_SAMPLES ? 0 : written - SC_RING_SAMPLES + 1;
}

uint64_t sc_block_read(const sc_block *block, uint64_t *cursor, sc_sample *samples, uint64_t n,
                       uint64_t *lost)
{
    const uint64_t oldest = oldest_kept(block);
    const uint64_t written = __atomic_load_n(&block->written, __ATOMIC_ACQUIRE);
    if (*cursor < oldest) {
        *lost += oldest - *cursor;
        *cursor = oldest;
    }
    uint64_t count = 0;
    while (count < n && *cursor + count < written) {
        read_words(&block->ring[(*cursor + count) % SC_RING_SAMPLES], &samples[count]);
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

static uint32_t bin_of(uint64_t us_8)
{
    uint32_t octave = 0; /* us_8: eighths of a microsecond, at least 8 */
    while (us_8 >= 16 && octave < SC_HISTOGRAM_BINS / SC_BINS_PER_OCTAVE) {
        us_8 >>= 1;
        octave++;
    }
    const uint32_t bin = octave * SC_BINS_PER_OCTAVE + (uint32_t)(us_8 - 8);
    return bin < SC_HISTOGRAM_BINS ? bin : SC_HISTOGRAM_BINS - 1;
}

void sc_histogram_add(sc_histogram *histogram, int64_t time_ns)
{
    const uint64_t ns = time_ns > 0 ? (uint64_t)time_ns : 0;
    const uint64_t us_8 = ns / 125u;
    histogram->count[us_8 < 8 ? 0 : bin_of(us_8)]++;
    histogram->total++;
    if (ns > histogram->largest_ns) {
        histogram->largest_ns = ns;
    }
}
