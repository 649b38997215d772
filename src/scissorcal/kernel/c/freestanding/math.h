/* What the C core uses of <math.h>, for a compiler without a C library. The processor has the rest;
 * library.c defines the last three. */
#ifndef SC_FREESTANDING_MATH_H
#define SC_FREESTANDING_MATH_H

#define NAN __builtin_nanf("")
#define INFINITY __builtin_inff()
#define isfinite(value) __builtin_isfinite(value)
#define isnan(value) __builtin_isnan(value)
#define fabsf(value) __builtin_fabsf(value)
#define sqrtf(value) __builtin_sqrtf(value) /* one instruction of an FPU (-fno-math-errno) */

float ceilf(float value);
float fminf(float first, float second);
float fmaxf(float first, float second);

#endif
