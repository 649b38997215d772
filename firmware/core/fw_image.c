/* The image of a package, opened where it lies: see fw_image.h. */
#include "fw_image.h"

#include "sc_bytes.h"
#include "sc_messages.h"

#include <math.h>
#include <stddef.h>

enum { TABLES = 5, SIZES_AT = 4, WHOLE_AT = 9, MODEL_AT = 13, DRIVE_AT = 24 };

static uint32_t word(const float *memory, int32_t at)
{
    return get_u32((const uint8_t *)(const void *)(memory + at));
}

uint32_t fw_crc32(uint32_t crc, const uint8_t *bytes, uint32_t count)
{
    static const uint32_t OF_NIBBLE[16] = {
        0x00000000u, 0x1DB71064u, 0x3B6E20C8u, 0x26D930ACu, 0x76DC4190u, 0x6B6B51F4u,
        0x4DB26158u, 0x5005713Cu, 0xEDB88320u, 0xF00F9344u, 0xD6D6A3E8u, 0xCB61B38Cu,
        0x9B64C2B0u, 0x86D3D2D4u, 0xA00AE278u, 0xBDBDF21Cu};
    uint32_t rest = ~crc;
    for (uint32_t i = 0; i < count; i++) {
        rest ^= bytes[i];
        rest = (rest >> 4) ^ OF_NIBBLE[rest & 15u];
        rest = (rest >> 4) ^ OF_NIBBLE[rest & 15u];
    }
    return ~rest;
}

/* Words that the arrays take, 0 where a table has too few knots or too many. */
static uint32_t array_words(const float *memory)
{
    uint32_t words = 0;
    for (int32_t i = 0; i < TABLES; i++) {
        const uint32_t knots = word(memory, SIZES_AT + i);
        if (knots < 2u || knots > (uint32_t)SC_TABLE_MAX) {
            return 0;
        }
        words += knots * (i == 1 ? 4u : 3u);
    }
    return words;
}

/* Let a table point at its arrays; returns what follows them. */
static const float *point_at(sc_table *table, const float *first, uint32_t knots, int has_area)
{
    table->size = (int32_t)knots;
    table->x = first;
    table->y = first + knots;
    table->slope = first + 2u * knots;
    table->area = has_area ? first + 3u * knots : NULL;
    return first + (has_area ? 4u : 3u) * knots;
}

static void point_at_tables(const float *memory, sc_model *model)
{
    sc_table *const tables[TABLES] = {&model->edge, &model->response, &model->friction_opening,
                                      &model->friction_closing, &model->friction_angle};
    const float *next = memory + FW_IMAGE_WORDS;
    for (int32_t i = 0; i < TABLES; i++) {
        next = point_at(tables[i], next, word(memory, SIZES_AT + i), i == 1);
    }
}

static void read_numbers(const float *memory, sc_model *model)
{
    const float *number = memory + MODEL_AT;
    model->moving_blades = (int32_t)word(memory, WHOLE_AT);
    model->closure = (int32_t)word(memory, WHOLE_AT + 1);
    model->render_friction = word(memory, WHOLE_AT + 2) != 0u;
    model->release_falls = word(memory, WHOLE_AT + 3) != 0u;
    model->upper_face = number[0];
    model->fracture_energy = number[1];
    model->kappa = number[2];
    model->rate_damping = number[3];
    model->friction_rate_eps = number[4];
    model->handle_radius = number[5];
    model->tip_station = number[6];
    model->opening_min = number[7];
    model->opening_max = number[8];
    model->contact_min = number[9];
    model->contact_max = number[10];
}

static void read_drive(const float *memory, fw_drive *drive)
{
    const float *number = memory + DRIVE_AT;
    drive->torque_limit = number[0];
    drive->torque_slew = number[1];
    drive->force_limit = number[2];
    drive->force_slew = number[3];
    drive->ramp_s = number[4];
    drive->rate_cutoff_Hz = number[5];
    drive->friction_width = number[6];
    drive->is_measured = number[7];
    drive->rig_damping = number[8];
    drive->rig_coulomb = number[9];
    drive->margin_J = number[10];
    drive->most_damping = number[11];
    drive->motor_sign = number[12];
}

/* Every number but the sign is finite and 0 or more. */
static int drive_is_sound(const float *memory)
{
    for (int32_t i = DRIVE_AT; i < FW_IMAGE_WORDS - 1; i++) {
        if (!isfinite(memory[i]) || memory[i] < 0.0f) {
            return 0;
        }
    }
    return memory[FW_IMAGE_WORDS - 1] == 1.0f || memory[FW_IMAGE_WORDS - 1] == -1.0f;
}

uint32_t fw_image_open(const float *memory, uint32_t bytes, fw_image *image)
{
    if (bytes < 4u * FW_IMAGE_WORDS) {
        return SC_LOAD_TORN;
    }
    if (word(memory, 0) != FW_IMAGE_MAGIC || word(memory, 1) != FW_IMAGE_FORMAT ||
        memory[3] != 1.0f) {
        return SC_LOAD_OTHER_FORMAT;
    }
    const uint32_t arrays = array_words(memory);
    if (arrays == 0u || word(memory, 2) != bytes || bytes != 4u * (FW_IMAGE_WORDS + arrays)) {
        return SC_LOAD_TORN;
    }
    point_at_tables(memory, &image->model);
    read_numbers(memory, &image->model);
    read_drive(memory, &image->drive);
    if (!drive_is_sound(memory) || !sc_model_is_sound(&image->model)) {
        return SC_LOAD_NOT_SOUND;
    }
    sc_model_edge_slopes(&image->model);
    return SC_LOAD_OK;
}
