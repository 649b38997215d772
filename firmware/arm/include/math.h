/* What the core uses of the C library's mathematics. The processor has
 * the rest; library.c defines the last three. */
#ifndef FW_MATH_H
#define FW_MATH_H

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
