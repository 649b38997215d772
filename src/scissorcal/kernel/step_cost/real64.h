/* Included before the core, to compile it in double precision: a reference for its speed. The core's own
 * headers of the language come first, so that the words are changed in the core alone. */
#ifndef REAL64_H
#define REAL64_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define float double
#define fabsf fabs
#define sqrtf sqrt
#define ceilf ceil
#define fminf fmin
#define fmaxf fmax

#endif
