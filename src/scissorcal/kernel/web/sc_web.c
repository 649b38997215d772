/* One model with a crack in it, for WebAssembly: what a page or any other host without C calls.
 *
 * Fill the tables (sc_web_table), make the model (sc_web_make), add the plate's pieces where it has
 * any (sc_web_piece_begin, sc_web_piece_strip), then step it. An instance of the module
 * holds one model; a host that compares two makes two instances. Not part of the portable core: it
 * keeps its model in static memory, because a host has no other place in it.
 */
#include "sc_pieces.h"
#include "sc_plate.h"

#include <math.h>
#include <string.h>

#define EXPORT(name) __attribute__((export_name(#name), visibility("default"))) name

enum { TABLES = 5, BATCH = 4096 };

typedef struct {
    float x[SC_TABLE_MAX], y[SC_TABLE_MAX], slope[SC_TABLE_MAX], area[SC_TABLE_MAX];
} store;

/* A step's arguments, or those of a settled torque, whose third is the contact. */
typedef struct {
    float opening, rate, advance;
} place;

static store stores[TABLES];
static sc_model model;
static sc_crack crack;
static sc_section section;
static int32_t is_placed;
static sc_pieces_config config;
static sc_pieces pieces;
static int32_t is_open;     /* a piece that has begun and has no strip yet: the one after the last */
static int32_t is_prepared; /* the pieces, as they are now */
static place places[BATCH];
static sc_step_output outputs[BATCH];

/* Tables in the order of the model: edge, response, friction opening, closing, by angle. */
static sc_table *table_of(int32_t which)
{
    sc_table *const tables[TABLES] = {&model.edge, &model.response, &model.friction_opening,
                                      &model.friction_closing, &model.friction_angle};
    return which >= 0 && which < TABLES ? tables[which] : 0;
}

/* Where to write x, y and slope of a table, SC_TABLE_MAX floats after one another; 0 where there is no
 * such table or size. */
float *EXPORT(sc_web_table)(int32_t which, int32_t size)
{
    sc_table *const table = table_of(which);
    if (!table || size < 2 || size > SC_TABLE_MAX) {
        return 0;
    }
    store *const kept = &stores[which];
    const sc_table made = {kept->x, kept->y, kept->slope, kept->area, size};
    *table = made;
    return kept->x;
}

int32_t EXPORT(sc_web_table_max)(void)
{
    return SC_TABLE_MAX;
}

int32_t EXPORT(sc_web_batch_max)(void)
{
    return BATCH;
}

/* No pieces: the plate is a uniform sheet. */
void EXPORT(sc_web_pieces_clear)(void)
{
    memset(&config, 0, sizeof config);
    memset(&pieces, 0, sizeof pieces);
    is_open = is_prepared = 0;
}

/* Begin a piece; its strips follow. 1, or 0, and nothing is changed, where a number is not sound, there
 * is no room, the piece before has no strip yet, or the plate was placed. */
int32_t EXPORT(sc_web_piece_begin)(float begin, float upper_face, float scale)
{
    const sc_plate_piece *const last = &config.piece[config.count > 0 ? config.count - 1 : 0];
    const sc_plate_piece begun = {begin, upper_face, scale, last->first + last->count, 0, 0};
    if (is_placed || is_open || config.count >= SC_PIECES_MAX || !sc_piece_is_sound(&begun)) {
        return 0;
    }
    config.piece[config.count] = begun;
    is_open = 1;
    return 1;
}

/* Bond a strip to the last piece that has begun; the sheet is fresh. 1, or 0, and nothing is changed,
 * where it is not sound, or there is no room or no piece. */
int32_t EXPORT(sc_web_piece_strip)(float end, float fracture_energy)
{
    const int32_t at = is_open ? config.count : config.count - 1;
    if (at < 0) {
        return 0;
    }
    sc_plate_piece *const piece = &config.piece[at];
    const int32_t next = piece->first + piece->count;
    if (next >= SC_STRIPS_MAX) {
        return 0;
    }
    config.strip[next].end = end;
    config.strip[next].fracture_energy = fracture_energy;
    piece->count++;
    config.count = at + 1;
    if (!sc_pieces_are_sound(&config)) {
        piece->count--;
        config.count = is_open ? at : at + 1;
        return 0;
    }
    memset(&pieces, 0, sizeof pieces);
    is_open = is_prepared = 0;
    return 1;
}

/* Crack tip of a piece; not a number where there is none. */
float EXPORT(sc_web_piece_crack)(int32_t which)
{
    if (which < 0 || which >= config.count) {
        return NAN;
    }
    return pieces.begun ? pieces.of[which].crack.crack : config.piece[which].begin;
}

/* Put the crack of a piece farther on, as after a cut to there. 1, or 0, and nothing is changed, where
 * there is no such piece or the place is not beyond its near edge. */
int32_t EXPORT(sc_web_piece_set_crack)(int32_t which, float at)
{
    if (which < 0 || which >= config.count || !(at > config.piece[which].begin)) {
        return 0;
    }
    if (!pieces.begun) {
        sc_pieces_fresh(&config, &pieces);
    }
    const sc_plate_piece *const piece = &config.piece[which];
    const sc_strip *const strip = &config.strip[piece->first];
    sc_piece_crack *const own = &pieces.of[which];
    own->strip = 0;
    while (own->strip < piece->count && at >= strip[own->strip].end) {
        own->strip++;
    }
    own->crack.crack = own->strip < piece->count ? at : strip[piece->count - 1].end;
    own->crack.detached = 0;
    return 1;
}

/* Make the model from the tables as they are and these numbers; 1 if it is sound. The crack is at 0, the
 * plate a uniform sheet in the model's own place. */
int32_t EXPORT(sc_web_make)(int32_t moving_blades, int32_t closure, int32_t render_friction,
                            float upper_face, float fracture_energy, float kappa,
                            float rate_damping, float friction_rate_eps, float handle_radius,
                            float tip_station, float opening_min, float opening_max,
                            float contact_min, float contact_max)
{
    memset(&crack, 0, sizeof crack);
    is_placed = 0;
    sc_web_pieces_clear();
    model.moving_blades = moving_blades;
    model.closure = closure;
    model.render_friction = render_friction;
    model.upper_face = upper_face;
    model.fracture_energy = fracture_energy;
    model.kappa = kappa;
    model.rate_damping = rate_damping;
    model.friction_rate_eps = friction_rate_eps;
    model.handle_radius = handle_radius;
    model.tip_station = tip_station;
    model.opening_min = opening_min;
    model.opening_max = opening_max;
    model.contact_min = contact_min;
    model.contact_max = contact_max;
    model.flattest = model.steepest = 0.0f;
    model.release_falls = 0;
    for (int32_t i = 0; i < TABLES; i++) {
        const sc_table *const table = table_of(i);
        if (table->size < 2) {
            return 0;
        }
        sc_table_accumulate(table, stores[i].area);
    }
    if (!sc_model_is_sound(&model)) {
        return 0;
    }
    sc_model_edge_slopes(&model);
    model.release_falls = sc_model_release_falls(&model);
    return 1;
}

/* A fresh sheet with the crack at a place; the cracks of pieces are at their near edges. */
void EXPORT(sc_web_reset)(float at)
{
    memset(&crack, 0, sizeof crack);
    memset(&pieces, 0, sizeof pieces);
    crack.crack = at;
}

/* With pieces, that of the piece which the last step showed. */
float EXPORT(sc_web_crack)(void)
{
    return crack.crack;
}

/* From here on the plate stands on this section (sc_plate.h); 0, and nothing is changed, where it is
 * not sound, or the plate is made of pieces. */
int32_t EXPORT(sc_web_place)(float edge_x, float edge_y, float pitch, float stretch,
                             float thickening)
{
    const sc_section wanted = {edge_x, edge_y, pitch, stretch, thickening};
    if (config.count > 0 || is_open || !sc_section_is_sound(&wanted, model.moving_blades)) {
        return 0;
    }
    section = wanted;
    is_placed = 1;
    return 1;
}

/* Arguments and results of the two functions below, up to BATCH of them. */
place *EXPORT(sc_web_places)(void)
{
    return places;
}

sc_step_output *EXPORT(sc_web_outputs)(void)
{
    return outputs;
}

/* Steps from the places in their order; the cracks go on from one to the next. */
void EXPORT(sc_web_steps)(int32_t count)
{
    const sc_plate_config plate = {1, 0, 1.0f, 1.0f, 0.0f, 0.0f};
    if (config.count > 0 && !is_prepared) {
        sc_pieces_prepare(&model, &config);
        is_prepared = 1;
    }
    for (int32_t i = 0; i < count && i < BATCH; i++) {
        const place *const at = &places[i];
        if (config.count > 0) {
            sc_pieces_step(&config, &model, &pieces, at->opening, at->rate, at->advance,
                           &outputs[i]);
            crack = pieces.of[pieces.shown].crack;
        } else if (is_placed) {
            sc_plate_step(&plate, &model, &section, &crack, at->opening, at->rate, at->advance,
                          &outputs[i], 0);
        } else {
            sc_model_step(&model, &crack, at->opening, at->rate, at->advance, &outputs[i]);
        }
    }
}

/* Settled torques of the uniform sheet at the places: each into `torque` of its result; not a number
 * where a step would be INVALID. */
void EXPORT(sc_web_settled)(int32_t count)
{
    for (int32_t i = 0; i < count && i < BATCH; i++) {
        sc_model_torque_many(&model, 1, &places[i].opening, &places[i].rate, &places[i].advance,
                             &outputs[i].torque);
    }
}
