#include "sc_pieces.h"
#include "sc_fracture.h"

#include <math.h>
#include <string.h>

static const float LARGEST_SCALE = 1000.0f;

/* What the pieces of one step have in common: the model without friction, with the upper face and the
 * energy of the piece and strip that is looked at. */
typedef struct {
    sc_model sheet;
    sc_turn turn;
    float opening, rate, advance;
} hand;

/* A crack that runs: from where (contact), at a release that it had at *start, and what it kept. */
typedef struct {
    sc_bite start;
    int reached;  /* *start is a place on the blade, not its tip */
    float energy; /* at which it started */
    float share;  /* of a strip's energy at which it stops, and which it takes */
    float from;
} run;

int sc_piece_is_sound(const sc_plate_piece *piece)
{
    return isfinite(piece->begin) && isfinite(piece->upper_face) && piece->upper_face > 0.0f &&
           piece->scale > 0.0f && piece->scale <= LARGEST_SCALE;
}

static int strips_are_sound(const sc_plate_piece *piece, const sc_strip *strips)
{
    float begin = piece->begin;
    for (int32_t k = 0; k < piece->count; k++) {
        const float energy = strips[k].fracture_energy;
        if (!isfinite(strips[k].end) || !(strips[k].end > begin) || !(energy >= 0.0f) ||
            !isfinite(energy) || !isfinite(energy / piece->scale)) {
            return 0;
        }
        begin = strips[k].end;
    }
    return 1;
}

int sc_pieces_are_sound(const sc_pieces_config *config)
{
    if (config->count < 0 || config->count > SC_PIECES_MAX) {
        return 0;
    }
    for (int32_t i = 0; i < config->count; i++) {
        const sc_plate_piece *const piece = &config->piece[i];
        if (!sc_piece_is_sound(piece) || piece->first < 0 || piece->count < 1 ||
            piece->count > SC_STRIPS_MAX - piece->first ||
            !strips_are_sound(piece, &config->strip[piece->first])) {
            return 0;
        }
    }
    return 1;
}

void sc_pieces_prepare(const sc_model *model, sc_pieces_config *config)
{
    for (int32_t i = 0; i < config->count; i++) {
        sc_plate_piece *const piece = &config->piece[i];
        const sc_strip *const strips = &config->strip[piece->first];
        float least = INFINITY, most = 0.0f;
        for (int32_t k = 0; k < piece->count; k++) {
            const float energy = strips[k].fracture_energy / piece->scale;
            most = fmaxf(most, energy);
            least = energy > 0.0f ? fminf(least, energy) : least;
        }
        sc_model sheet = *model; /* all releases at which a crack of the piece starts or stops */
        sheet.upper_face = piece->upper_face;
        sheet.fracture_energy = most;
        sheet.kappa *= most > 0.0f ? least / most : 1.0f;
        piece->release_falls = sc_model_release_falls(&sheet);
    }
}

void sc_pieces_fresh(const sc_pieces_config *config, sc_pieces *pieces)
{
    memset(pieces, 0, sizeof *pieces);
    pieces->begun = 1;
    for (int32_t i = 0; i < config->count; i++) {
        pieces->of[i].crack.crack = config->piece[i].begin;
        pieces->of[i].crack.detached = 1;
    }
}

/* Start a run out of the strip of this end: where the crack stands when it leaves the last whole
 * ripple, or at the end itself. What was cut until then is booked. */
static void set_off(const hand *by, const sc_crack *crack, float end, run *made,
                    sc_step_output *out)
{
    const sc_model *const sheet = &by->sheet;
    const int falls = sc_falls_at(sheet, by->opening);
    const float contact = crack->crack - by->advance;
    sc_bite *const start = &made->start;
    start->point.knot = crack->edge_knot;
    start->knot = crack->response_knot;
    (void)sc_edge_over(&sheet->edge, by->turn, contact, &start->point);
    sc_sit(sheet, start);
    made->energy = sheet->fracture_energy;
    made->reached = sc_run_out(sheet, by->turn, falls, made->energy, start);
    made->share = made->reached ? 1.0f : sheet->kappa;
    made->from = end;
    if (made->reached && sheet->kappa < 1.0f) {
        sc_bite stop = *start;
        const float kept = sheet->kappa * made->energy;
        (void)sc_run_out(sheet, by->turn, falls, kept, &stop);
        const float length = stop.point.x - start->point.x;
        if (length > SC_SHORTEST_RUN) {
            const float runs = -ceilf((contact - end) / length); /* whole ones */
            const float lost = start->stored - stop.stored - kept * length;
            made->share = sheet->kappa;
            made->from = fminf(contact + runs * length, end);
            out->arrest_J += lost > 0.0f ? runs * lost : 0.0f;
        }
    }
    out->fracture_J += made->share * made->energy * (made->from - contact);
}

/* What the piece stores where the running crack has come to `at`. */
static float kept_at(const hand *by, const run *made, float at)
{
    sc_bite there = made->start;
    if (!(at > made->from)) {
        return there.stored;
    }
    const float contact = made->start.point.x + (at - made->from);
    if (!sc_edge_over(&by->sheet.edge, by->turn, contact, &there.point)) {
        return 0.0f;
    }
    sc_sit(&by->sheet, &there);
    return there.stored;
}

/* The crack leaves its strip and runs to where it stops in a later one, at the border of a tougher
 * one, or through the piece's far end. */
static void cross(const hand *by, const sc_plate_piece *piece, const sc_strip *strips,
                  sc_piece_crack *state, sc_step_output *out)
{
    const sc_model *const sheet = &by->sheet;
    const int falls = sc_falls_at(sheet, by->opening);
    float end = strips[state->strip].end;
    float at = end - by->advance;
    run made;
    set_off(by, &state->crack, at, &made, out);
    float paid = made.share * made.energy * (at - made.from), crack = end, kept = -1.0f;
    int32_t strip = state->strip + 1;
    for (; made.reached && kept < 0.0f && strip < piece->count; strip += kept < 0.0f) {
        const float target = made.share * strips[strip].fracture_energy / piece->scale;
        if (!(target > 0.0f) || !(target < made.energy)) {
            break;
        }
        sc_bite stop = made.start;
        (void)sc_run_out(sheet, by->turn, falls, target, &stop);
        const float stops = made.from + (stop.point.x - made.start.point.x);
        if (!(stops > at)) {
            break;
        }
        end = strips[strip].end;
        const float to = fminf(stops, end - by->advance);
        paid += target * (to - at);
        if (stops <= end - by->advance) {
            crack = fminf(fmaxf(stops + by->advance, crack), end);
            kept = stop.stored;
        } else {
            crack = end;
        }
        at = to;
    }
    if (strip == piece->count) {
        kept = 0.0f;
    } else if (kept < 0.0f) {
        kept = kept_at(by, &made, at);
    }
    const float lost = made.start.stored - kept - paid;
    out->fracture_J += paid;
    out->arrest_J += lost > 0.0f ? lost : 0.0f;
    out->flags |= SC_STEP_ADVANCED;
    state->crack.crack = crack;
    state->strip = strip;
}

/* The step of one piece that is not cut through yet, without its scale. */
static void step_piece(hand *by, const sc_plate_piece *piece, const sc_strip *strips,
                       sc_piece_crack *state, sc_step_output *out)
{
    sc_step_output crossed;
    memset(&crossed, 0, sizeof crossed);
    by->sheet.upper_face = piece->upper_face;
    by->sheet.release_falls = piece->release_falls;
    for (;;) {
        sc_crack crack = state->crack;
        by->sheet.fracture_energy = strips[state->strip].fracture_energy / piece->scale;
        sc_model_step(&by->sheet, &crack, by->opening, by->rate, by->advance, out);
        if (out->flags & SC_STEP_INVALID) {
            return;
        }
        if (!(crack.crack > strips[state->strip].end)) {
            state->crack = crack;
            break;
        }
        cross(by, piece, strips, state, &crossed);
        if (state->strip == piece->count) {
            memset(out, 0, sizeof *out);
            break;
        }
    }
    out->fracture_J += crossed.fracture_J;
    out->arrest_J += crossed.arrest_J;
    out->flags |= crossed.flags;
}

/* How much a piece says about where the blades are: any that touches more than one that does not, and
 * that more than one beyond the blade's reach. */
typedef struct {
    int rank;
    float within;
} claim;

static claim claim_of(const sc_step_output *one, float scale)
{
    const claim touches = {3, scale * one->response};
    const claim near = {2, one->indentation};
    const claim far = {1, -one->contact};
    if (one->flags & SC_STEP_TOUCHING) {
        return touches;
    }
    return one->flags & SC_STEP_BEYOND_TIP ? far : near;
}

/* Add one piece to the sums. */
static void add(const sc_step_output *one, float scale, sc_step_output *out)
{
    out->torque += scale * one->torque;
    out->force += scale * one->force;
    out->stored_J += scale * one->stored_J;
    out->fracture_J += scale * one->fracture_J;
    out->arrest_J += scale * one->arrest_J;
    if (one->flags & (SC_STEP_TOUCHING | SC_STEP_ADVANCED)) {
        out->flags |= one->flags;
    }
}

static void show(const sc_step_output *one, float scale, sc_step_output *out)
{
    out->contact = one->contact;
    out->indentation = one->indentation;
    out->height = one->height;
    out->response = scale * one->response;
}

/* All pieces are cut through: where the edge stands over the farthest end. */
static void pass_through(const sc_pieces_config *config, hand *by, sc_pieces *pieces,
                         sc_step_output *out)
{
    sc_step_output one;
    pieces->shown = 0;
    for (int32_t i = 1; i < config->count; i++) {
        if (pieces->of[i].crack.crack > pieces->of[pieces->shown].crack.crack) {
            pieces->shown = i;
        }
    }
    sc_crack nothing = pieces->of[pieces->shown].crack;
    by->sheet.upper_face = config->piece[pieces->shown].upper_face;
    by->sheet.fracture_energy = 0.0f;
    sc_model_step(&by->sheet, &nothing, by->opening, by->rate, by->advance, &one);
    show(&one, 0.0f, out);
    out->flags |= one.flags & (SC_STEP_INVALID | SC_STEP_OUT_OF_RANGE);
}

static void step_all(const sc_pieces_config *config, hand *by, sc_pieces *pieces,
                     sc_step_output *out)
{
    claim shown = {0, 0.0f};
    uint32_t flags = 0;
    for (int32_t i = 0; i < config->count; i++) {
        const sc_plate_piece *const piece = &config->piece[i];
        sc_piece_crack *const state = &pieces->of[i];
        sc_step_output one;
        if (state->strip == piece->count) {
            continue;
        }
        step_piece(by, piece, &config->strip[piece->first], state, &one);
        if (one.flags & SC_STEP_INVALID) {
            out->flags |= SC_STEP_INVALID;
            return;
        }
        add(&one, piece->scale, out);
        if (state->strip == piece->count) {
            continue;
        }
        const claim its = claim_of(&one, piece->scale);
        if (its.rank > shown.rank || (its.rank == shown.rank && its.within > shown.within)) {
            shown = its;
            flags = one.flags;
            pieces->shown = i;
            show(&one, piece->scale, out);
        }
    }
    out->flags |= flags;
    if (shown.rank == 0) {
        pass_through(config, by, pieces, out);
    }
}

static int is_finite_sum(const sc_step_output *out)
{
    return isfinite(out->torque) && isfinite(out->force) && isfinite(out->response) &&
           isfinite(out->stored_J) && isfinite(out->fracture_J) && isfinite(out->arrest_J);
}

void sc_pieces_step(const sc_pieces_config *config, const sc_model *model, sc_pieces *pieces,
                    float opening, float rate, float advance, sc_step_output *out)
{
    const sc_pieces before = *pieces;
    hand by = {*model, sc_turn_of(opening / (float)model->moving_blades), opening, rate, advance};
    by.sheet.render_friction = 0;
    memset(out, 0, sizeof *out);
    if (!pieces->begun) {
        sc_pieces_fresh(config, pieces);
    }
    step_all(config, &by, pieces, out);
    if (model->render_friction && !(out->flags & SC_STEP_INVALID)) {
        out->friction_torque = -sc_model_friction(model, opening, rate);
        out->torque += out->friction_torque;
    }
    if ((out->flags & SC_STEP_INVALID) || !is_finite_sum(out)) {
        *pieces = before;
        memset(out, 0, sizeof *out);
        out->flags = SC_STEP_INVALID;
    }
}

void sc_pieces_step_many(const sc_pieces_config *config, const sc_model *model, sc_pieces *pieces,
                         int64_t n, const float *opening, const float *rate, const float *advance,
                         sc_step_output *out)
{
    for (int64_t i = 0; i < n; i++) {
        sc_pieces_step(config, model, pieces, opening[i], rate[i], advance[i], &out[i]);
    }
}
