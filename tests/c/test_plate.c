/* A plate whose pose is estimated: the step on it against the golden vectors, and how it moves. */
#include "check.h"
#include "json.h"
#include "models.h"
#include "sc_servo.h"

#include <string.h>

static const sc_section FLAT = {0.0f, 1e-4f, 0.0f, 1.0f, 1.0f};
static const sc_plate_config CONFIG = {1, 100000, 0.015f, 0.1f, -1.0f, 1.0f};

static float at(const json *one, const char *name, size_t k)
{
    return (float)json_get(one, name)->items[k].number;
}

static double largest(const json *column)
{
    double most = 0.0;
    for (size_t i = 0; i < column->size; i++) {
        most = fmax(most, fabs(column->items[i].number));
    }
    return most;
}

static void near_column(const json *one, const char *name, size_t k, double got, double tolerance,
                        const char *title)
{
    const json *column = json_get(one, name);
    NEAR(got, column->items[k].number, tolerance * largest(column) + 1e-12, name, title);
}

static void check_case(const json *one, double tolerance)
{
    static storage rooms[5];
    const char *title = json_text(one, "title");
    const sc_model model = load_model(json_get(one, "model"), rooms);
    sc_crack crack = {0.0f, 0, 0, 0};
    sc_step_output out;
    sc_pull pull;
    for (size_t k = 0; k < json_get(one, "opening")->size; k++) {
        const sc_section section = {at(one, "edge_x", k), at(one, "edge_y", k), at(one, "pitch", k),
                                    at(one, "stretch", k), at(one, "thickening", k)};
        CHECK(sc_section_is_sound(&section, model.moving_blades), title);
        sc_plate_step(&CONFIG, &model, &section, &crack, at(one, "opening", k),
                      at(one, "rate", k), at(one, "advance", k), &out, &pull);
        near_column(one, "out_torque", k, out.torque, tolerance, title);
        near_column(one, "out_force", k, out.force, tolerance, title);
        near_column(one, "out_stored_J", k, out.stored_J, tolerance, title);
        near_column(one, "out_fracture_J", k, out.fracture_J, tolerance, title);
        near_column(one, "out_arrest_J", k, out.arrest_J, tolerance, title);
        near_column(one, "out_pull_edge_x", k, pull.edge_x, tolerance, title);
        near_column(one, "out_pull_edge_y", k, pull.edge_y, tolerance, title);
        near_column(one, "out_pull_pitch", k, pull.pitch, tolerance, title);
        near_column(one, "out_pull_stretch", k, pull.stretch, tolerance, title);
        near_column(one, "out_crack", k, crack.crack, tolerance, title);
    }
}

/* On the section that is the model's own, the step is the model's, to the last bit. */
static void check_own_place(const json *one)
{
    static storage rooms[5];
    const char *title = "the model's own place";
    const sc_model model = load_model(json_get(one, "model"), rooms);
    const sc_section own = {0.0f, model.upper_face, 0.0f, 1.0f, 1.0f};
    sc_crack known = {0.0f, 0, 0, 0}, placed = known;
    sc_step_output a, b;
    for (size_t k = 0; k < json_get(one, "opening")->size; k++) {
        const float opening = at(one, "opening", k), rate = at(one, "rate", k);
        sc_model_step(&model, &known, opening, rate, -0.015f, &a);
        sc_plate_step(&CONFIG, &model, &own, &placed, opening, rate, -0.015f, &b, NULL);
        CHECK(a.torque == b.torque && a.stored_J == b.stored_J && a.flags == b.flags, title);
        NEAR(b.force, a.force, 1e-6 * fabs((double)a.force), "force", title);
        CHECK(known.crack == placed.crack, title);
    }
    CHECK(known.crack > 0.0f, title);
}

static void check_soundness(void)
{
    const char *title = "sound";
    sc_section s = FLAT;
    CHECK(sc_section_is_sound(&s, 1) && sc_section_is_sound(&s, 2), title);
    s.pitch = 0.1f;
    CHECK(sc_section_is_sound(&s, 1) && !sc_section_is_sound(&s, 2), title);
    s.pitch = 1.1f;
    CHECK(!sc_section_is_sound(&s, 1), title);
    float *const numbers[] = {&s.edge_x, &s.edge_y, &s.pitch, &s.stretch, &s.thickening};
    for (size_t i = 0; i < 5; i++) {
        const float bad[] = {NAN, INFINITY, -INFINITY, 1e30f};
        for (size_t j = 0; j < 4; j++) {
            s = FLAT;
            *numbers[i] = bad[j];
            CHECK(!sc_section_is_sound(&s, 1), title);
        }
    }
    sc_plate_config config = CONFIG;
    CHECK(sc_plate_config_is_sound(&config), title);
    config.fall_s = 0.0f;
    CHECK(!sc_plate_config_is_sound(&config), title);
    config.is_estimated = 0;
    CHECK(sc_plate_config_is_sound(&config), title);
}

/* The section moves to an estimate in a straight line, and is there at once without any force. */
static void check_way(void)
{
    const char *title = "way to an estimate";
    sc_plate plate;
    sc_placing placing = {FLAT, 1, 0};
    memset(&plate, 0, sizeof plate);
    sc_plate_move(&CONFIG, 0.5f, 0.001f, &plate);
    CHECK(plate.share == 0.0f, title); /* none yet */
    sc_plate_take(&placing, 1, &plate);
    CHECK(memcmp(&plate.now, &FLAT, sizeof FLAT) == 0, title);
    for (int i = 0; i < 600; i++) {
        placing.age_us = 0;
        sc_plate_take(&placing, 1, &plate);
        sc_plate_move(&CONFIG, 0.5f, 0.001f, &plate);
        NEAR(plate.share, fmin((i + 1) * 0.002, 1.0), 1e-4, "share", title);
    }
    placing.section.edge_x = 0.015f;
    placing.section.pitch = 0.03f;
    sc_plate_take(&placing, 1, &plate);
    for (int i = 1; i <= 15; i++) {
        sc_plate_move(&CONFIG, 0.5f, 0.001f, &plate);
        NEAR(plate.now.edge_x, 0.001 * i, 1e-7, "edge", title);
        NEAR(plate.now.pitch, 0.002 * i, 1e-7, "pitch", title);
    }
    CHECK(plate.now.edge_x == 0.015f, title);
    placing.section.stretch = NAN;
    sc_plate_take(&placing, 1, &plate);
    CHECK(!plate.usable && plate.now.stretch == 1.0f, title);
}

/* Without news the force falls after stale_us, within fall_s. */
static void check_silence(void)
{
    const char *title = "silence";
    sc_plate plate;
    const sc_placing placing = {FLAT, 1, 40000}, lost = {FLAT, 0, 0};
    memset(&plate, 0, sizeof plate);
    sc_plate_take(&placing, 1, &plate);
    sc_plate_move(&CONFIG, 0.0f, 0.001f, &plate);
    CHECK(plate.share == 1.0f, title);
    for (int ms = 1; ms <= 200; ms++) {
        sc_plate_pass(&plate, 1000);
        sc_plate_move(&CONFIG, 0.5f, 0.001f, &plate);
        const double fallen = ms <= 60 ? 0.0 : fmin((ms - 60) * 0.01, 1.0);
        NEAR(plate.share, 1.0 - fallen, 1e-4, "share", title);
    }
    sc_plate_pass(&plate, UINT32_MAX);
    CHECK(plate.age_us == UINT32_MAX, title);
    sc_plate_take(&placing, 1, &plate);
    sc_plate_move(&CONFIG, 0.5f, 0.001f, &plate);
    NEAR(plate.share, 0.002, 1e-6, "share", title);
    sc_plate_take(&lost, 1, &plate);
    sc_plate_move(&CONFIG, 0.5f, 0.001f, &plate);
    CHECK(plate.share == 0.0f, title);
}

int main(int argc, char **argv)
{
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "plate.json");
    const json *cases = json_get(&vectors, "cases");
    for (size_t i = 0; i < cases->size; i++) {
        check_case(&cases->items[i], json_number(&vectors, "tolerance"));
    }
    check_own_place(&cases->items[0]);
    check_soundness();
    check_way();
    check_silence();
    json_free(&vectors);
    return checks_done("plate");
}
