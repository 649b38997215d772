/* A clock for bench_step.c: nanoseconds on a host; on a Cortex-M under qemu the instructions executed,
 * by the system timer while qemu advances its time by 1024 ns for each (-icount shift=10). */
#ifndef BENCH_CLOCK_H
#define BENCH_CLOCK_H

#include <stdint.h>

#ifdef __arm__

#define BENCH_UNIT "instructions of a Cortex-M4F"
enum { BENCH_REPEATS = 1, BENCH_KNOWN = 1000 };

#define BENCH_TIMER ((volatile uint32_t *)0xE000E010u) /* SYST_CSR, SYST_RVR, SYST_CVR */

static inline void bench_start(void)
{
    BENCH_TIMER[1] = 0xFFFFFFu;
    BENCH_TIMER[2] = 0;
    BENCH_TIMER[0] = 5; /* enabled, at the processor's clock: 25 MHz on the mps2-an386 */
}

static inline void bench_known(void) /* 1000 instructions */
{
    __asm volatile(".rept 1000\n nop\n .endr");
}

static inline uint32_t bench_now(void)
{
    return BENCH_TIMER[2];
}

/* It counts down, 25.6 times for an instruction. */
static inline uint32_t bench_since(uint32_t start)
{
    const uint32_t ticks = (start - BENCH_TIMER[2]) & 0xFFFFFFu;
    return (ticks * 10u + 128u) / 256u;
}

#else

#include <time.h>

#define BENCH_UNIT "ns"
enum { BENCH_REPEATS = 25, BENCH_KNOWN = 0 };

static inline void bench_start(void)
{
}

static inline void bench_known(void)
{
}

static inline uint32_t bench_now(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)now.tv_sec * 1000000000u + (uint32_t)now.tv_nsec;
}

static inline uint32_t bench_since(uint32_t start)
{
    return bench_now() - start;
}

#endif

/* What the clock itself takes. */
static inline uint32_t bench_nothing(void)
{
    uint32_t best = UINT32_MAX;
    for (int i = 0; i < 100; i++) {
        const uint32_t took = bench_since(bench_now());
        best = took < best ? took : best;
    }
    return best;
}

#endif
