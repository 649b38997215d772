/* What the C core and a compiler use of <string.h>, for a compiler without a C library; library.c
 * defines them. */
#ifndef SC_FREESTANDING_STRING_H
#define SC_FREESTANDING_STRING_H

#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
int memcmp(const void *first, const void *second, size_t size);

#endif
