/* Any sound model, any motion: every output of a step is finite, and the crack never goes back. */
#include "models.h"
#include "sc_fracture.h"
#include "sc_pieces.h"
#include "sc_plate.h"

/* Slopes of a cubic that never falls between its knots (Fritsch and Carlson 1980,
 * doi:10.1137/0717021): where they are others a sound model may store less than nothing. */
static int never_falls(const sc_table *table)
{
    for (int32_t i = 0; i + 1 < table->size; i++) {
        const float most = 3.0f * (table->y[i + 1] - table->y[i]) / (table->x[i + 1] - table->x[i]);
        if (!(table->slope[i] >= 0.0f && table->slope[i] <= most && table->slope[i + 1] <= most)) return 0;
    }
    return table->slope[table->size - 1] >= 0.0f;
}

static void hold_step(const sc_model *model, const sc_step_output *out)
{
    const float *numbers = &out->torque;
    for (size_t i = 0; i < offsetof(sc_step_output, flags) / sizeof *numbers; i++) {
        PROMISED(isfinite(numbers[i]));
    }
    PROMISED(out->fracture_J >= 0.0f);
    PROMISED(out->stored_J >= 0.0f || !never_falls(&model->response));
    PROMISED(!(out->flags & SC_STEP_INVALID) || (out->torque == 0.0f && out->force == 0.0f));
}

static void on_a_plate(const sc_model *model, input *from)
{
    sc_plate_config config = {1, 100000, 0.015f, 0.1f, -1.0f, 1.0f};
    sc_placing placing = {{take_float(from, -0.1f, 0.1f), take_float(from, -0.01f, 0.01f),
                           take_float(from, -0.5f, 0.5f), take_float(from, 0.5f, 2.0f),
                           take_float(from, 0.5f, 2.0f)},
                          take_byte(from) % 4 != 0,
                          take_word(from) % 200000};
    sc_plate plate;
    sc_crack crack = {0.03f, 0, 0, 0};
    sc_step_output out;
    sc_pull pull;
    memset(&plate, 0, sizeof plate);
    change_words(from, &config, sizeof config);
    if (!sc_plate_config_is_sound(&config)) return;
    sc_plate_take(&placing, model->moving_blades, &plate);
    for (int i = 0; i < 8; i++) {
        sc_plate_pass(&plate, take_word(from) % 100000);
        const float dt = take_float(from, 0.0f, 0.01f);
        sc_plate_move(&config, 0.05f, dt >= 0.0f && dt < 1.0f ? dt : 0.0f, &plate);
        PROMISED(plate.share >= 0.0f && plate.share <= 1.0f);
        if (!sc_section_is_sound(&plate.now, model->moving_blades)) continue;
        const float opening = take_float(from, 0.1f, 1.0f), advance = take_float(from, -0.05f, 0.05f);
        sc_plate_step(&config, model, &plate.now, &crack, opening, take_float(from, -3.0f, 3.0f),
                      advance, &out, &pull);
        hold_step(model, &out);
        PROMISED(isfinite(sc_plate_work(&plate, i == 0, plate.share, &pull)));
        (void)sc_plate_torque(model, &plate.now, opening, advance, crack.crack);
    }
}

/* Pieces of any sound numbers: cracks never go back, and stay in their pieces. */
static void on_pieces(const sc_model *model, input *from)
{
    sc_pieces_config config;
    sc_pieces pieces, before;
    sc_step_output out;
    memset(&config, 0, sizeof config);
    memset(&pieces, 0, sizeof pieces);
    config.count = 1 + take_byte(from) % 4;
    for (int32_t i = 0, first = 0; i < config.count; first += config.piece[i++].count) {
        const sc_plate_piece piece = {take_float(from, -0.01f, 0.05f), take_float(from, 1e-5f, 1e-3f),
                                      take_float(from, 0.1f, 5.0f), first, 1 + take_byte(from) % 5, 0};
        float end = piece.begin;
        for (int32_t k = 0; k < piece.count; k++) {
            const sc_strip strip = {end += take_float(from, 0.0f, 0.01f), take_float(from, 0.0f, 2.0f)};
            config.strip[first + k] = strip;
        }
        config.piece[i] = piece;
    }
    change_words(from, &config, sizeof config);
    if (!sc_pieces_are_sound(&config) || config.count == 0) return;
    if (take_byte(from) % 2) sc_pieces_prepare(model, &config);
    float opening = 0.8f;
    for (int i = 0; i < 60; i++) {
        const float rate = take_float(from, -5.0f, 1.0f), advance = take_float(from, -0.03f, -0.02f);
        opening = isfinite(opening) ? opening + 0.02f * rate : 0.8f;
        before = pieces;
        sc_pieces_step(&config, model, &pieces, opening, rate, advance, &out);
        hold_step(model, &out);
        PROMISED(out.arrest_J >= 0.0f || !never_falls(&model->response));
        for (int32_t k = 0; k < config.count && before.begun && pieces.begun; k++) {
            const sc_plate_piece *piece = &config.piece[k];
            const int32_t strip = pieces.of[k].strip;
            PROMISED(strip >= before.of[k].strip && strip <= piece->count);
            PROMISED(!(pieces.of[k].crack.crack < before.of[k].crack.crack));
            PROMISED(!(pieces.of[k].crack.crack > config.strip[piece->first + piece->count - 1].end));
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input from = {data, size};
    bench_room room;
    sc_model model = taken_model(&from, &room);
    if (!sc_model_is_sound(&model)) return 0;
    sc_model_edge_slopes(&model);
    model.release_falls = sc_model_release_falls(&model);
    sc_crack crack = {take_float(&from, 0.0f, 0.06f), 0, (int32_t)take_byte(&from) - 4,
                      (int32_t)take_byte(&from) - 4};
    const float start = crack.crack;
    sc_crack other = crack;
    sc_step_output out, again;
    float opening = 0.8f, advance = 0.0f;
    for (int i = 0; i < 200 && from.size > 0; i++) {
        const uint8_t leap = take_byte(&from);
        const float rate = take_float(&from, -3.0f, 3.0f);
        opening = leap % 8 == 0 ? take_float(&from, 0.0f, 1.2f) : opening + 0.01f * rate;
        advance += leap % 8 == 1 ? take_float(&from, -0.02f, 0.02f) : 0.0f;
        const float before = crack.crack;
        sc_model_step(&model, &crack, opening, rate, advance, &out);
        hold_step(&model, &out);
        PROMISED(!(crack.crack < before));
        sc_model_step_many(&model, &other, 1, &opening, &rate, &advance, &again);
        PROMISED(memcmp(&out, &again, sizeof out) == 0);
        const float torque = sc_model_settled_torque(&model, opening, rate, out.contact);
        float many;
        sc_model_torque_many(&model, 1, &opening, &rate, &out.contact, &many);
        (void)torque;
        if (!isfinite(opening)) opening = 0.8f;
        if (!isfinite(advance)) advance = 0.0f;
    }
    PROMISED(!isfinite(start) || isfinite(crack.crack));
    on_a_plate(&model, &from);
    on_pieces(&model, &from);
    return 0;
}
