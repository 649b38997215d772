/* Models of the golden vectors. */
#ifndef TEST_MODELS_H
#define TEST_MODELS_H

#include "json.h"
#include "sc_model.h"

#include <string.h>

typedef struct {
    float x[SC_TABLE_MAX], y[SC_TABLE_MAX], slope[SC_TABLE_MAX], area[SC_TABLE_MAX];
} storage;

static inline sc_table load_table(const json *columns, storage *room)
{
    sc_table table = {room->x, room->y, room->slope, room->area, 0};
    table.size = (int32_t)json_floats(json_get(columns, "x"), room->x, SC_TABLE_MAX);
    json_floats(json_get(columns, "y"), room->y, SC_TABLE_MAX);
    json_floats(json_get(columns, "slope"), room->slope, SC_TABLE_MAX);
    sc_table_accumulate(&table, room->area);
    return table;
}

static inline sc_model load_model(const json *from, storage rooms[5])
{
    sc_model model;
    memset(&model, 0, sizeof model);
    model.edge = load_table(json_get(from, "edge"), &rooms[0]);
    model.response = load_table(json_get(from, "response"), &rooms[1]);
    model.friction_opening = load_table(json_get(from, "friction_opening"), &rooms[2]);
    model.friction_closing = load_table(json_get(from, "friction_closing"), &rooms[3]);
    model.friction_angle = load_table(json_get(from, "friction_angle"), &rooms[4]);
    model.moving_blades = (int32_t)json_number(from, "moving_blades");
    model.closure =
        strcmp(json_text(from, "closure"), "eq4") == 0 ? SC_CLOSURE_EQ4 : SC_CLOSURE_WORK;
    model.render_friction = (int32_t)json_number(from, "render_friction");
    model.upper_face = (float)json_number(from, "upper_face");
    model.fracture_energy = (float)json_number(from, "fracture_energy");
    model.kappa = (float)json_number(from, "kappa");
    model.rate_damping = (float)json_number(from, "rate_damping");
    model.friction_rate_eps = (float)json_number(from, "friction_rate_eps");
    model.handle_radius = (float)json_number(from, "handle_radius");
    model.tip_station = (float)json_number(from, "tip_station");
    model.opening_min = (float)json_number(from, "opening_min");
    model.opening_max = (float)json_number(from, "opening_max");
    model.contact_min = (float)json_number(from, "contact_min");
    model.contact_max = (float)json_number(from, "contact_max");
    return model;
}

#endif
