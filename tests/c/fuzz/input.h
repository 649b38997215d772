/* What a fuzzer's bytes become: numbers, and changes of a configuration that is sound to begin with.
 * Bytes that are used up give zeros. */
#ifndef FUZZ_INPUT_H
#define FUZZ_INPUT_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A promise of the core's headers; the fuzzer keeps the bytes that break it. */
#define PROMISED(holds)                                                            \
    do {                                                                           \
        if (!(holds)) {                                                            \
            fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #holds); \
            abort();                                                               \
        }                                                                          \
    } while (0)

typedef struct {
    const uint8_t *data;
    size_t size;
} input;

static inline uint8_t take_byte(input *from)
{
    if (from->size == 0) return 0;
    from->size--;
    return *from->data++;
}

static inline uint32_t take_word(input *from)
{
    uint32_t word = 0;
    for (int i = 0; i < 4; i++) word = word << 8 | take_byte(from);
    return word;
}

static inline float take_bits(input *from)
{
    const uint32_t word = take_word(from);
    float value;
    memcpy(&value, &word, sizeof value);
    return value;
}

/* Mostly within the two ends, in 65536 steps; one time in 16 any bits at all. */
static inline float take_float(input *from, float low, float high)
{
    if (take_byte(from) % 16 == 15) return take_bits(from);
    const uint32_t step = (uint32_t)take_byte(from) << 8 | take_byte(from);
    return low + (high - low) * (float)step / 65535.0f;
}

/* Change none, or up to 7, of the 4-byte words of a struct: a float by a factor or to any bits, a count
 * by one. */
static inline void change_words(input *from, void *what, size_t bytes)
{
    static const float FACTORS[8] = {0.0f, -1.0f, 0.5f, 2.0f, 1e3f, 1e-3f, 0.9f, 1.1f};
    const uint8_t many = take_byte(from);
    for (int left = many < 128 ? 0 : many % 8; left > 0; left--) {
        const uint32_t place = ((uint32_t)take_byte(from) << 8 | take_byte(from)) % (bytes / 4);
        uint8_t *word = (uint8_t *)what + 4 * (size_t)place;
        const uint8_t how = take_byte(from);
        uint32_t count;
        float value;
        memcpy(&count, word, 4);
        memcpy(&value, word, 4);
        if (how < 128) {
            value *= FACTORS[how % 8];
            memcpy(word, &value, 4);
        } else {
            count = how < 160 ? count + 1 : how < 192 ? how % 8u : take_word(from);
            memcpy(word, &count, 4);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
