/* Arrays of golden vectors, each with its exact size on the heap, so that the sanitizers see every read
 * beyond an end. */
#ifndef ARRAYS_H
#define ARRAYS_H

#include "json.h"

#include <stdint.h>
#include <stdlib.h>

enum { MOST_ARRAYS = 64 };

static void *arrays[MOST_ARRAYS];
static size_t array_count;

static inline void *room(size_t bytes)
{
    void *found = malloc(bytes ? bytes : 1);
    if (!found || array_count == MOST_ARRAYS) exit(2);
    arrays[array_count++] = found;
    return found;
}

static inline void free_arrays(void)
{
    while (array_count > 0) free(arrays[--array_count]);
}

static inline double *doubles(const json *object, const char *key)
{
    const json *array = json_get(object, key);
    double *values = room(array->size * sizeof *values);
    for (size_t i = 0; i < array->size; i++) values[i] = array->items[i].number;
    return values;
}

static inline int32_t *integers(const json *object, const char *key)
{
    const json *array = json_get(object, key);
    int32_t *values = room(array->size * sizeof *values);
    for (size_t i = 0; i < array->size; i++) values[i] = (int32_t)array->items[i].number;
    return values;
}

#endif
