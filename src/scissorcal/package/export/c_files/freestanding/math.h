/* What the core takes of <math.h>, for a compiler without a C library. */
#ifndef FREESTANDING_MATH_H
#define FREESTANDING_MATH_H

#define INFINITY __builtin_inff()
#define NAN __builtin_nanf("")
#define isfinite(x) __builtin_isfinite(x)
#define fabsf(x) __builtin_fabsf(x)
#define sqrtf(x) __builtin_sqrtf(x)

static inline float fminf(float a, float b)
{
    return a != a || b < a ? b : a;
}

static inline float fmaxf(float a, float b)
{
    return a != a || b > a ? b : a;
}

/* Any number of 2^23 or more is whole. */
static inline float ceilf(float x)
{
    if (!(fabsf(x) < 8388608.0f)) {
        return x;
    }
    const float whole = (float)(int)x;
    return whole < x ? whole + 1.0f : whole;
}

#endif
