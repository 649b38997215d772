/* A reader of the golden vectors' JSON: numbers, strings without escapes, arrays, objects.
 * For tests only: it allocates, and any surprise ends the program. */
#ifndef TEST_JSON_H
#define TEST_JSON_H

#include <stddef.h>
#include <stdint.h>

typedef enum { JSON_NULL, JSON_BOOL, JSON_NUMBER, JSON_STRING, JSON_ARRAY, JSON_OBJECT } json_kind;

typedef struct json {
    json_kind kind;
    double number; /* of a number or a bool */
    char *text;    /* of a string */
    size_t size;   /* of an array or an object */
    char **keys;
    struct json *items;
} json;

json json_load(const char *folder, const char *name);
void json_free(json *value);

/* A member that must be there. */
const json *json_get(const json *object, const char *key);
double json_number(const json *object, const char *key);
const char *json_text(const json *object, const char *key);

/* Bytes of a hexadecimal string; returns how many. */
size_t json_bytes(const char *hex, uint8_t *bytes, size_t capacity);

/* An array of numbers as floats; returns how many. */
size_t json_floats(const json *array, float *values, size_t capacity);

#endif
