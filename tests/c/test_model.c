#include "check.h"
#include "json.h"
#include "models.h"
#include "sc_table16.h"

#include <stddef.h>
#include <string.h>

static double largest(const json *column)
{
    double most = 0.0;
    for (size_t i = 0; i < column->size; i++) {
        most = fmax(most, fabs(column->items[i].number));
    }
    return most;
}

static void check_tables(const char *folder)
{
    json vectors = json_load(folder, "tables.json");
    const double tolerance = json_number(&vectors, "tolerance");
    const json *cases = json_get(&vectors, "tables");
    for (size_t i = 0; i < cases->size; i++) {
        static storage room;
        const json *one = &cases->items[i];
        const char *title = json_text(one, "title");
        const sc_table table = load_table(one, &room);
        const json *at = json_get(one, "at"), *value = json_get(one, "value");
        const json *grade = json_get(one, "grade"), *held = json_get(one, "held");
        const json *integral = json_get(one, "integral");
        CHECK(sc_table_is_sound(&table), title);
        for (size_t k = 0; k < at->size; k++) {
            float slope;
            const float x = (float)at->items[k].number;
            NEAR(sc_table_at(&table, x, &slope), value->items[k].number,
                 tolerance * largest(value), "value", title);
            NEAR(slope, grade->items[k].number, 10.0 * tolerance * largest(grade), "slope", title);
            NEAR(sc_table_held(&table, x), held->items[k].number, tolerance * largest(value),
                 "held", title);
            NEAR(sc_table_area(&table, x), integral->items[k].number,
                 tolerance * largest(integral), "integral", title);
        }
        room.x[1] = room.x[0];
        CHECK(!sc_table_is_sound(&table), title);
        room.x[1] = NAN;
        CHECK(!sc_table_is_sound(&table), title);
    }
    json_free(&vectors);
}

enum { NUMBERS = SC_TABLE_MAX };

static sc_row16 load_row(const json *one, const char *numbers, const char *row, int16_t *room)
{
    const json *from = json_get(one, numbers), *scale = json_get(one, row);
    const sc_row16 loaded = {room, (float)scale->items[0].number, (float)scale->items[1].number};
    for (size_t i = 0; i < from->size && i < NUMBERS; i++) {
        room[i] = (int16_t)from->items[i].number;
    }
    return loaded;
}

static void check_stored_tables(const char *folder)
{
    json vectors = json_load(folder, "tables.json");
    const json *cases = json_get(&vectors, "stored");
    for (size_t i = 0; i < cases->size; i++) {
        static int16_t numbers[3][NUMBERS];
        static storage room, wanted;
        const json *one = &cases->items[i];
        const char *title = json_text(one, "title");
        sc_table table;
        sc_table16 stored = {load_row(one, "x_numbers", "x_row", numbers[0]),
                             load_row(one, "y_numbers", "y_row", numbers[1]),
                             load_row(one, "slope_numbers", "slope_row", numbers[2]), 0};
        stored.size = (int32_t)json_floats(json_get(one, "x"), wanted.x, SC_TABLE_MAX);
        json_floats(json_get(one, "y"), wanted.y, SC_TABLE_MAX);
        json_floats(json_get(one, "slope"), wanted.slope, SC_TABLE_MAX);
        CHECK(sc_table16_decode(&stored, room.x, room.y, room.slope, &table), title);
        CHECK(table.size == stored.size && table.area == NULL, title);
        for (int32_t k = 0; k < table.size; k++) {
            NEAR(table.x[k], wanted.x[k], 0.0, "x", title);
            NEAR(table.y[k], wanted.y[k], 0.0, "y", title);
            NEAR(table.slope[k], wanted.slope[k], 0.0, "slope", title);
        }
        numbers[0][1] = numbers[0][0];
        CHECK(!sc_table16_decode(&stored, room.x, room.y, room.slope, &table), title);
        stored.size = 1;
        CHECK(!sc_table16_decode(&stored, room.x, room.y, room.slope, &table), title);
        stored.size = SC_TABLE_MAX + 1;
        CHECK(!sc_table16_decode(&stored, room.x, room.y, room.slope, &table), title);
    }
    CHECK(cases->size > 0, "stored tables");
    json_free(&vectors);
}

typedef struct {
    const char *name;
    size_t offset;
} column;

static const column COLUMNS[] = {
    {"torque", offsetof(sc_step_output, torque)},
    {"force", offsetof(sc_step_output, force)},
    {"contact", offsetof(sc_step_output, contact)},
    {"indentation", offsetof(sc_step_output, indentation)},
    {"height", offsetof(sc_step_output, height)},
    {"response", offsetof(sc_step_output, response)},
    {"friction_torque", offsetof(sc_step_output, friction_torque)},
    {"stored_J", offsetof(sc_step_output, stored_J)},
    {"fracture_J", offsetof(sc_step_output, fracture_J)},
    {"arrest_J", offsetof(sc_step_output, arrest_J)},
};

static float number_at(const json *array, size_t i)
{
    return (float)array->items[i].number;
}

static void check_steps(const json *one)
{
    static storage rooms[5];
    const char *title = json_text(one, "title");
    const double tolerance = json_number(one, "tolerance");
    const sc_model model = load_model(json_get(one, "model"), rooms);
    const json *opening = json_get(one, "opening"), *rate = json_get(one, "rate");
    const json *advance = json_get(one, "advance");
    sc_crack state = {0.0f, 0, 0, 0};
    CHECK(sc_model_is_sound(&model), title);
    for (size_t i = 0; i < opening->size; i++) {
        sc_step_output out;
        const float before = state.crack;
        sc_model_step(&model, &state, number_at(opening, i), number_at(rate, i),
                      number_at(advance, i), &out);
        CHECK(state.crack >= before, title);
        for (size_t k = 0; k < sizeof COLUMNS / sizeof *COLUMNS; k++) {
            const json *wanted = json_get(one, COLUMNS[k].name);
            float got;
            memcpy(&got, (const char *)&out + COLUMNS[k].offset, sizeof got);
            NEAR(got, wanted->items[i].number, tolerance * largest(wanted) + 1e-12,
                 COLUMNS[k].name, title);
        }
        const json *settled = json_get(one, "settled_torque");
        NEAR(sc_model_settled_torque(&model, number_at(opening, i), number_at(rate, i),
                                     number_at(json_get(one, "settled_contact"), i)),
             settled->items[i].number, tolerance * largest(settled) + 1e-12, "settled", title);
    }
    NEAR(state.crack, json_number(one, "crack"), 4e-7, "crack", title);
}

/* Numbers that no rig gives: nothing but finite torques may come out. */
static void check_absurd(const json *one)
{
    static storage rooms[5];
    static const float odd[] = {0.0f,  -0.0f, 1e-30f, -1e-30f, 1.0f,     -1.0f,    3.1f,
                                -3.1f, 1e6f,  -1e6f,  1e30f,   INFINITY, -INFINITY, NAN};
    const char *title = json_text(one, "title");
    const sc_model model = load_model(json_get(one, "model"), rooms);
    const size_t n = sizeof odd / sizeof *odd;
    for (size_t i = 0; i < n * n * n; i++) {
        sc_crack state = {0.0f, 0, 0, 0};
        sc_step_output out;
        const float theta = odd[i % n], rate = odd[i / n % n], advance = odd[i / n / n];
        sc_model_step(&model, &state, theta, rate, advance, &out);
        CHECK(isfinite(out.torque) && isfinite(out.force) && isfinite(state.crack), title);
        CHECK(state.crack >= 0.0f, title);
        CHECK(isfinite(sc_model_settled_torque(&model, theta, rate, advance)), title);
    }
}

static void refused(const sc_model *model, const char *why)
{
    CHECK(!sc_model_is_sound(model), why);
}

/* What must not be rendered: each change makes a sound model unsound, and undone it is sound again. */
static void check_soundness(const json *one)
{
    static storage rooms[5];
    const char *title = json_text(one, "title");
    sc_model model = load_model(json_get(one, "model"), rooms);
    static float *const levels[] = {&rooms[2].y[1], &rooms[3].y[0], &rooms[4].y[1]};
    static const float bad[] = {-1e-3f, NAN, INFINITY, -INFINITY};
    CHECK(sc_model_is_sound(&model), title);
    for (size_t i = 0; i < 3 * sizeof bad / sizeof *bad; i++) {
        float *level = levels[i % 3], kept = *level;
        *level = bad[i / 3];
        refused(&model, "friction");
        *level = kept;
    }
    float kept = rooms[2].slope[0];
    rooms[2].slope[0] = -1.0f; /* between two knots above 0 the cubic falls below it */
    refused(&model, "friction between knots");
    rooms[2].slope[0] = kept;
    kept = rooms[1].y[3];
    rooms[1].y[3] = 0.5f * rooms[1].y[2];
    refused(&model, "a response that falls");
    rooms[1].y[3] = kept;
    rooms[1].y[0] = 1e-3f;
    refused(&model, "a response without contact");
    rooms[1].y[0] = 0.0f;
    kept = rooms[0].x[1];
    rooms[0].x[1] = rooms[0].x[0];
    refused(&model, "knots that do not ascend");
    rooms[0].x[1] = kept;
    model.friction_rate_eps = 0.0f;
    refused(&model, "no band around rest");
    model.friction_rate_eps = 0.01f;
    model.opening_min = NAN;
    refused(&model, "no range");
    model.opening_min = 0.2f;
    model.kappa = 1.5f;
    refused(&model, "kappa");
    model.kappa = 1.0f;
    CHECK(sc_model_is_sound(&model), title);
}

int main(int argc, char **argv)
{
    const char *folder = argc > 1 ? argv[1] : "../golden";
    json vectors = json_load(folder, "model.json");
    const json *cases = json_get(&vectors, "cases");
    check_stored_tables(argv[1]);
    check_tables(folder);
    check_stored_tables(folder);
    check_soundness(&cases->items[0]);
    for (size_t i = 0; i < cases->size; i++) {
        check_steps(&cases->items[i]);
        check_absurd(&cases->items[i]);
    }
    json_free(&vectors);
    return checks_done("tables and model");
}
