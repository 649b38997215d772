#include "json.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void give_up(const char *why)
{
    fprintf(stderr, "golden vectors: %s\n", why);
    exit(2);
}

static void *grown(void *block, size_t count, size_t size)
{
    void *wider = realloc(block, count * size);
    if (wider == NULL) {
        give_up("out of memory");
    }
    return wider;
}

static char *read_file(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        give_up(path);
    }
    fseek(file, 0, SEEK_END);
    const size_t size = (size_t)ftell(file);
    rewind(file);
    char *text = grown(NULL, size + 1, 1);
    if (fread(text, 1, size, file) != size) {
        give_up("cannot be read");
    }
    text[size] = '\0';
    fclose(file);
    return text;
}

static void skip_space(const char **at)
{
    while (isspace((unsigned char)**at)) {
        (*at)++;
    }
}

static void expect(const char **at, char wanted)
{
    skip_space(at);
    if (**at != wanted) {
        give_up("malformed");
    }
    (*at)++;
}

static char *parse_text(const char **at)
{
    expect(at, '"');
    const char *end = strchr(*at, '"');
    if (end == NULL) {
        give_up("a string without end");
    }
    const size_t size = (size_t)(end - *at);
    char *text = grown(NULL, size + 1, 1);
    memcpy(text, *at, size);
    text[size] = '\0';
    *at = end + 1;
    return text;
}

static json parse_value(const char **at);

static json parse_group(const char **at, json_kind kind, char close)
{
    json group = {kind, 0.0, NULL, 0, NULL, NULL};
    (*at)++;
    skip_space(at);
    while (**at != close) {
        if (group.size > 0) {
            expect(at, ',');
            skip_space(at);
        }
        if (kind == JSON_OBJECT) {
            group.keys = grown(group.keys, group.size + 1, sizeof *group.keys);
            group.keys[group.size] = parse_text(at);
            expect(at, ':');
        }
        const json item = parse_value(at);
        group.items = grown(group.items, group.size + 1, sizeof *group.items);
        group.items[group.size++] = item;
        skip_space(at);
    }
    (*at)++;
    return group;
}

static json parse_value(const char **at)
{
    json value = {JSON_NULL, 0.0, NULL, 0, NULL, NULL};
    skip_space(at);
    if (**at == '{') {
        return parse_group(at, JSON_OBJECT, '}');
    }
    if (**at == '[') {
        return parse_group(at, JSON_ARRAY, ']');
    }
    if (**at == '"') {
        value.kind = JSON_STRING;
        value.text = parse_text(at);
    } else if (strncmp(*at, "true", 4) == 0 || strncmp(*at, "false", 5) == 0) {
        value.kind = JSON_BOOL;
        value.number = **at == 't';
        *at += **at == 't' ? 4 : 5;
    } else if (strncmp(*at, "null", 4) == 0) {
        *at += 4;
    } else {
        char *end;
        value.kind = JSON_NUMBER;
        value.number = strtod(*at, &end);
        if (end == *at) {
            give_up("malformed number");
        }
        *at = end;
    }
    return value;
}

json json_load(const char *folder, const char *name)
{
    char path[1024];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    char *text = read_file(path);
    const char *at = text;
    const json value = parse_value(&at);
    free(text);
    return value;
}

void json_free(json *value)
{
    for (size_t i = 0; i < value->size; i++) {
        json_free(&value->items[i]);
        if (value->keys != NULL) {
            free(value->keys[i]);
        }
    }
    free(value->items);
    free(value->keys);
    free(value->text);
}

const json *json_get(const json *object, const char *key)
{
    for (size_t i = 0; i < object->size; i++) {
        if (object->keys != NULL && strcmp(object->keys[i], key) == 0) {
            return &object->items[i];
        }
    }
    give_up(key);
    return NULL;
}

double json_number(const json *object, const char *key)
{
    return json_get(object, key)->number;
}

const char *json_text(const json *object, const char *key)
{
    return json_get(object, key)->text;
}

size_t json_bytes(const char *hex, uint8_t *bytes, size_t capacity)
{
    const size_t size = strlen(hex) / 2;
    if (size > capacity) {
        give_up("more bytes than expected");
    }
    for (size_t i = 0; i < size; i++) {
        unsigned value;
        if (sscanf(hex + 2 * i, "%2x", &value) != 1) {
            give_up("no hexadecimal number");
        }
        bytes[i] = (uint8_t)value;
    }
    return size;
}

size_t json_floats(const json *array, float *values, size_t capacity)
{
    if (array->size > capacity) {
        give_up("more numbers than expected");
    }
    for (size_t i = 0; i < array->size; i++) {
        values[i] = (float)array->items[i].number;
    }
    return array->size;
}
