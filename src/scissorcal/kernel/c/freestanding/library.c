/* The C library's part of a bare-metal build. Compiled with -fno-builtin: otherwise the compiler
 * would replace each loop by a call of the function that holds it. */
#include <math.h>
#include <stdint.h>
#include <string.h>

/* What the ARM run-time ABI (IHI 0043, section 4.3.4) names for the compiler's own calls. */
void __aeabi_memcpy(void *to, const void *from, size_t size);
void __aeabi_memcpy4(void *to, const void *from, size_t size);
void __aeabi_memcpy8(void *to, const void *from, size_t size);
void __aeabi_memmove(void *to, const void *from, size_t size);
void __aeabi_memset(void *to, size_t size, int value);
void __aeabi_memclr(void *to, size_t size);
void __aeabi_memclr4(void *to, size_t size);
void __aeabi_memclr8(void *to, size_t size);

/* Whole words where both ends are aligned: records and states are copied each tick. */
void *memcpy(void *restrict to, const void *restrict from, size_t size)
{
    uint8_t *out = to;
    const uint8_t *in = from;
    if ((((uintptr_t)to | (uintptr_t)from) & 3u) == 0) {
        for (; size >= 4; size -= 4, out += 4, in += 4) {
            *(uint32_t *)(void *)out = *(const uint32_t *)(const void *)in;
        }
    }
    while (size-- > 0) {
        *out++ = *in++;
    }
    return to;
}

void *memmove(void *to, const void *from, size_t size)
{
    uint8_t *out = to;
    const uint8_t *in = from;
    if (out <= in) {
        for (size_t i = 0; i < size; i++) {
            out[i] = in[i];
        }
    } else {
        while (size-- > 0) {
            out[size] = in[size];
        }
    }
    return to;
}

void *memset(void *to, int value, size_t size)
{
    uint8_t *out = to;
    if (value == 0 && ((uintptr_t)to & 3u) == 0) {
        for (; size >= 4; size -= 4, out += 4) {
            *(uint32_t *)(void *)out = 0;
        }
    }
    while (size-- > 0) {
        *out++ = (uint8_t)value;
    }
    return to;
}

int memcmp(const void *first, const void *second, size_t size)
{
    const uint8_t *a = first;
    const uint8_t *b = second;
    for (size_t i = 0; i < size; i++) {
        if (a[i] != b[i]) {
            return a[i] < b[i] ? -1 : 1;
        }
    }
    return 0;
}

void __aeabi_memcpy(void *to, const void *from, size_t size) { memcpy(to, from, size); }
void __aeabi_memcpy4(void *to, const void *from, size_t size) { memcpy(to, from, size); }
void __aeabi_memcpy8(void *to, const void *from, size_t size) { memcpy(to, from, size); }
void __aeabi_memmove(void *to, const void *from, size_t size) { memmove(to, from, size); }
void __aeabi_memset(void *to, size_t size, int value) { memset(to, value, size); }
void __aeabi_memclr(void *to, size_t size) { memset(to, 0, size); }
void __aeabi_memclr4(void *to, size_t size) { memset(to, 0, size); }
void __aeabi_memclr8(void *to, size_t size) { memset(to, 0, size); }

/* From 2^23 on every float is whole; so is what is no number. */
float ceilf(float value)
{
    if (!(value < 8388608.0f && value > -8388608.0f)) {
        return value;
    }
    const float whole = (float)(int32_t)value;
    return whole < value ? whole + 1.0f : whole;
}

/* The other number where one is none (C99, 7.12.12). */
float fminf(float first, float second)
{
    return first < second || isnan(second) ? first : second;
}

float fmaxf(float first, float second)
{
    return first > second || isnan(second) ? first : second;
}
