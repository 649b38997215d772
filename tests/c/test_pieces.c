/* A plate made of pieces: against the golden vectors, against the model's own step, and what is sound. */
#include "check.h"
#include "json.h"
#include "models.h"
#include "sc_servo.h"

#include <string.h>

static float at(const json *one, const char *name, size_t k)
{
    return (float)json_get(one, name)->items[k].number;
}

static sc_pieces_config load_pieces(const json *from)
{
    sc_pieces_config config;
    int32_t next = 0;
    memset(&config, 0, sizeof config);
    config.count = (int32_t)from->size;
    for (size_t i = 0; i < from->size; i++) {
        const json *one = &from->items[i], *strips = json_get(one, "strips");
        const sc_plate_piece piece = {(float)json_number(one, "begin_m"),
                                      (float)json_number(one, "upper_face_m"),
                                      (float)json_number(one, "scale"), next,
                                      (int32_t)strips->size, 0};
        for (size_t k = 0; k < strips->size; k++, next++) {
            config.strip[next].end = (float)json_number(&strips->items[k], "end_m");
            config.strip[next].fracture_energy =
                (float)json_number(&strips->items[k], "fracture_energy_J_per_m");
        }
        config.piece[i] = piece;
    }
    return config;
}

static int has(const json *object, const char *key)
{
    for (size_t i = 0; i < object->size; i++) {
        if (strcmp(object->keys[i], key) == 0) {
            return 1;
        }
    }
    return 0;
}

static void near_column(const json *one, const char *name, size_t k, double got, double tolerance,
                        const char *title)
{
    if (!has(one, name)) {
        return;
    }
    const json *column = json_get(one, name);
    double most = 0.0;
    for (size_t i = 0; i < column->size; i++) {
        most = fmax(most, fabs(column->items[i].number));
    }
    NEAR(got, column->items[k].number, tolerance * most + 1e-9, name, title);
}

/* Prepared, a run looks its end up; else it scans the edge. Both go to the same place. */
static void check_case(const json *one, int prepared)
{
    static storage rooms[5];
    const char *title = json_text(one, "title");
    const double tolerance = json_number(one, "tolerance");
    const double arrest = has(one, "arrest_tolerance") ? json_number(one, "arrest_tolerance") : tolerance;
    sc_model model = load_model(json_get(one, "model"), rooms);
    sc_pieces_config config = load_pieces(json_get(one, "pieces"));
    double fracture_J = 0.0, arrest_J = 0.0;
    sc_pieces pieces;
    sc_step_output out;
    memset(&pieces, 0, sizeof pieces);
    CHECK(sc_pieces_are_sound(&config), title);
    if (prepared) {
        sc_model_edge_slopes(&model);
        sc_pieces_prepare(&model, &config);
        CHECK(config.piece[0].release_falls, title);
    }
    for (size_t k = 0; k < json_get(one, "opening")->size; k++) {
        sc_pieces_step(&config, &model, &pieces, at(one, "opening", k), at(one, "rate", k),
                       at(one, "advance", k), &out);
        CHECK(!(out.flags & SC_STEP_INVALID) && out.arrest_J >= 0.0f, title);
        fracture_J += (double)out.fracture_J;
        arrest_J += (double)out.arrest_J;
        near_column(one, "out_torque", k, out.torque, tolerance, title);
        near_column(one, "out_force", k, out.force, tolerance, title);
        near_column(one, "out_stored_J", k, out.stored_J, tolerance, title);
        near_column(one, "out_fracture_J", k, fracture_J, fmax(tolerance, 1e-4), title);
        near_column(one, "out_arrest_J", k, arrest_J, arrest, title);
    }
    CHECK(fracture_J > 0.002, title);
    for (int32_t i = 0; i < config.count; i++) {
        NEAR(pieces.of[i].crack.crack, json_get(one, "cracks")->items[i].number,
             tolerance < 1e-3 ? 2e-7 : 3e-4, "crack", title);
    }
}

/* One piece of one strip that no crack reaches the end of is the uniform sheet, to the last bit. */
static void check_uniform(const json *one)
{
    static storage rooms[5];
    const char *title = "one piece of one strip";
    const sc_model model = load_model(json_get(one, "model"), rooms);
    const sc_pieces_config config = {1, {{0.0f, model.upper_face, 1.0f, 0, 1, 0}},
                                     {{1.0f, model.fracture_energy}}};
    sc_crack crack = {0.0f, 0, 0, 0};
    sc_pieces pieces;
    sc_step_output a, b;
    memset(&pieces, 0, sizeof pieces);
    for (size_t k = 0; k < json_get(one, "opening")->size; k++) {
        const float opening = at(one, "opening", k), rate = at(one, "rate", k);
        const float advance = at(one, "advance", k);
        sc_model_step(&model, &crack, opening, rate, advance, &a);
        sc_pieces_step(&config, &model, &pieces, opening, rate, advance, &b);
        CHECK(a.torque == b.torque && a.force == b.force && a.contact == b.contact, title);
        CHECK(a.stored_J == b.stored_J && a.fracture_J == b.fracture_J, title);
        CHECK(a.arrest_J == b.arrest_J && a.flags == b.flags, title);
        CHECK(a.friction_torque == b.friction_torque && a.response == b.response, title);
    }
    CHECK(crack.crack > 0.001f && crack.crack == pieces.of[0].crack.crack, title);
    const sc_pieces before = pieces;
    sc_pieces_step(&config, &model, &pieces, NAN, 0.0f, 0.0f, &b);
    CHECK(b.flags == SC_STEP_INVALID && b.torque == 0.0f, title);
    CHECK(memcmp(&pieces, &before, sizeof before) == 0, title);
}

/* A fresh sheet under closed blades has no energy; it is felt once they have opened. */
static void check_fresh(const json *one)
{
    static storage rooms[5];
    const char *title = "fresh";
    const sc_model model = load_model(json_get(one, "model"), rooms);
    const sc_pieces_config config = load_pieces(json_get(one, "pieces"));
    sc_pieces pieces;
    sc_step_output out;
    memset(&pieces, 0, sizeof pieces);
    sc_pieces_step(&config, &model, &pieces, 0.25f, 0.0f, -0.03f, &out);
    CHECK(out.torque == 0.0f && out.stored_J == 0.0f && out.indentation > 0.0f, title);
    CHECK(out.flags & SC_STEP_BEYOND_TIP, title);
    sc_pieces_step(&config, &model, &pieces, 0.8f, 0.0f, -0.03f, &out);
    CHECK(out.torque == 0.0f && !(out.flags & SC_STEP_BEYOND_TIP), title);
    sc_pieces_step(&config, &model, &pieces, 0.25f, 0.0f, -0.03f, &out);
    CHECK(out.fracture_J > 0.0f && out.arrest_J > 0.0f, title);
    CHECK(pieces.of[0].strip == config.piece[0].count, title); /* cut through */
    sc_pieces_fresh(&config, &pieces);
    CHECK(pieces.of[0].strip == 0 && pieces.of[0].crack.crack == config.piece[0].begin, title);
}

static void check_soundness(void)
{
    const char *title = "sound";
    const sc_pieces_config good = {2, {{0.0f, 1e-4f, 1.0f, 0, 2, 0}, {0.01f, 2e-4f, 1000.0f, 2, 1, 0}},
                                   {{0.01f, 0.6f}, {0.02f, 0.0f}, {0.03f, 0.5f}}};
    sc_pieces_config c = good;
    CHECK(sc_pieces_are_sound(&c), title);
    c.count = 0;
    CHECK(sc_pieces_are_sound(&c), title);
    const int32_t counts[] = {-1, SC_PIECES_MAX + 1, INT32_MAX, INT32_MIN, 3};
    for (size_t i = 0; i < sizeof counts / sizeof *counts; i++) {
        c = good;
        c.count = counts[i];
        CHECK(!sc_pieces_are_sound(&c), title);
    }
    const int32_t firsts[] = {-1, SC_STRIPS_MAX, SC_STRIPS_MAX - 1, INT32_MAX, INT32_MIN};
    const int32_t strips[] = {-1, 0, SC_STRIPS_MAX + 1, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < 5; i++) {
        c = good;
        c.piece[0].first = firsts[i];
        CHECK(!sc_pieces_are_sound(&c), title);
        c = good;
        c.piece[0].count = strips[i];
        CHECK(!sc_pieces_are_sound(&c), title);
    }
    float *const numbers[] = {&c.piece[1].begin, &c.piece[1].upper_face, &c.piece[1].scale,
                              &c.strip[2].end, &c.strip[2].fracture_energy};
    const float bad[] = {NAN, INFINITY, -INFINITY, -1.0f};
    for (size_t i = 0; i < 5; i++) {
        for (size_t j = 0; j < 4; j++) {
            c = good;
            *numbers[i] = bad[j];
            CHECK(sc_pieces_are_sound(&c) == (i == 0 && j == 3), title); /* begin may be behind */
        }
    }
    c = good;
    c.piece[1].scale = 1000.1f;
    CHECK(!sc_pieces_are_sound(&c), title);
    c = good;
    c.strip[1].end = 0.01f; /* no longer ascends */
    CHECK(!sc_pieces_are_sound(&c), title);
    c = good;
    c.strip[2].fracture_energy = 1e20f;
    c.piece[1].scale = 1e-30f; /* their ratio overflows */
    CHECK(!sc_pieces_are_sound(&c), title);
}

static void check_servo_config(void)
{
    const char *title = "servo";
    const sc_pieces_config pieces = {1, {{0.0f, 1e-4f, 1.0f, 0, 1, 0}}, {{0.01f, 0.6f}}};
    const sc_plate_config estimated = {1, 100000, 0.015f, 0.1f, -1.0f, 1.0f};
    sc_servo_config config;
    memset(&config, 0, sizeof config);
    config.opening_error_limit = config.advance_error_limit = 1.0f;
    config.opening_low = -1.0f;
    config.opening_high = 2.0f;
    config.opening_rate_limit = config.advance_rate_limit = 30.0f;
    config.tick_us = 1000;
    CHECK(sc_servo_config_is_sound(&config), title);
    config.pieces = pieces;
    CHECK(sc_servo_config_is_sound(&config), title);
    config.plate = estimated;
    CHECK(!sc_servo_config_is_sound(&config), title);
    config.pieces.count = 0;
    CHECK(sc_servo_config_is_sound(&config), title);
    memset(&config.plate, 0, sizeof config.plate);
    config.pieces.count = SC_PIECES_MAX + 1;
    CHECK(!sc_servo_config_is_sound(&config), title);
}

int main(int argc, char **argv)
{
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "pieces.json");
    const json *cases = json_get(&vectors, "cases");
    for (size_t i = 0; i < cases->size; i++) {
        check_case(&cases->items[i], 0);
        check_case(&cases->items[i], 1);
        check_uniform(&cases->items[i]);
    }
    check_fresh(&cases->items[0]);
    check_soundness();
    check_servo_config();
    json_free(&vectors);
    return checks_done("pieces");
}
