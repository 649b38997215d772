/* What a step of the model costs at most, in look-ups of tables and steps inside their intervals, and
 * that the quick way out of the material ends where a scan of every knot does. */
#include "bench_models.h"
#include "check.h"
#include "sc_count.h"
#include "sc_fracture.h"

#include <stddef.h>
#include <string.h>

enum {
    HALVINGS = 8, /* of 255 intervals of an edge */
    PER_ROUND = 2, /* the response's inverse and the edge */
    PER_RUN = PER_ROUND * (SC_RUN_ROUNDS + SC_CLOSE_ROUNDS) + HALVINGS + 2 + 2 + 2,
    BESIDE = 2 + 2 + 2, /* edge and response at first and at last, two tables of friction */
    MOST_LOOKUPS = 2 * PER_RUN + BESIDE,
    MOST_SCANNED = MOST_LOOKUPS + 2 * SC_TABLE_MAX,
    USUAL_LOOKUPS = 22, /* on the blades of the recipes; and so in 99 % of the steps on any */
    ROOT_STEPS_PER_LOOKUP = 12
};

static uint32_t seed = 77u;

/* Marsaglia 2003, xorshift32, between low and high. */
static float between(float low, float high)
{
    seed ^= seed << 13;
    seed ^= seed >> 17;
    seed ^= seed << 5;
    return low + (high - low) * (float)(seed >> 8) / 16777216.0f;
}

typedef struct {
    long steps, above_usual, most, most_roots;
} work;

static void count_step(const sc_model *model, sc_crack *state, bench_place at, work *seen,
                       sc_step_output *out)
{
    sc_lookups = sc_root_steps = 0;
    sc_model_step(model, state, at.opening, at.rate, at.advance, out);
    seen->steps++;
    seen->above_usual += sc_lookups > USUAL_LOOKUPS;
    seen->most = sc_lookups > seen->most ? sc_lookups : seen->most;
    seen->most_roots = sc_root_steps > seen->most_roots ? sc_root_steps : seen->most_roots;
}

/* Any crack, any opening, each step from another state. Both ways end at the same place, to a few
 * roundings of a place that may lie metres beyond the blade. */
static void random_steps(sc_model *model, int count, const char *title, work *quick, work *scanned)
{
    const int32_t falls = model->release_falls;
    const float halved = model->moving_blades == 1 ? 0.5f : 1.0f;
    for (int k = 0; k < count; k++) {
        sc_crack state = {0.0f, 0, k % 300, k % 7 - 3}, other;
        sc_step_output out, wanted;
        bench_place at = bench_random(&seed, &state.crack);
        at.opening = 0.2f + halved * (at.opening - 0.2f);
        other = state;
        count_step(model, &state, at, falls ? quick : scanned, &out);
        model->release_falls = 0;
        count_step(model, &other, at, scanned, &wanted);
        model->release_falls = falls;
        if (falls && model->kappa == 1.0f) { /* ripples: a rounding decides on one more length */
            NEAR(state.crack, other.crack, 2e-7 + 1e-5 * fabs(other.crack), "crack", title);
        }
    }
}

static void check_usual_blades(void)
{
    static bench_room room;
    static const int32_t knots[] = {2, 16, 64, 256};
    work quick = {0, 0, 0, 0}, scanned = {0, 0, 0, 0};
    for (size_t i = 0; i < 4; i++) {
        for (int ripples = 0; ripples < 2; ripples++) {
            const float curvature = i == 0 ? 0.0f : 1.0f;
            const bench_case one = {"usual", knots[i], 64, curvature, 1.5f,
                                    ripples ? 0.7f : 1.0f, 0.6f, 1};
            sc_model model = bench_model(&one, &room);
            CHECK(model.release_falls == 1, one.title);
            random_steps(&model, 2000, one.title, &quick, &scanned);
        }
    }
    printf("usual blades: %ld look-ups at most, %ld steps in intervals\n", quick.most,
           quick.most_roots);
    CHECK(quick.most <= USUAL_LOOKUPS, "usual blades");
    CHECK(scanned.most <= MOST_SCANNED, "usual blades");
}

/* From hollow to bulging, from air to steel, with and without an end. */
static void check_any_blades(void)
{
    static bench_room room;
    static const int32_t knots[] = {2, 9, 16, 64, 256};
    work quick = {0, 0, 0, 0}, scanned = {0, 0, 0, 0};
    for (int i = 0; i < 1000; i++) {
        const int32_t edge_knots = knots[i % 5];
        const bench_case one = {"any blade", edge_knots, knots[1 + i % 4],
                                edge_knots == 2 ? 0.0f : between(-2.0f, 2.0f), between(0.5f, 6.0f),
                                i % 2 ? between(0.3f, 0.99f) : 1.0f,
                                powf(10.0f, between(-3.0f, 2.0f)), 1};
        sc_model model = bench_model(&one, &room);
        model.moving_blades = 1 + i % 2;
        model.tip_station = i % 3 ? model.tip_station : INFINITY;
        model.release_falls = sc_model_release_falls(&model);
        random_steps(&model, 40, one.title, &quick, &scanned);
    }
    printf("any blades: %ld look-ups at most, %ld of %ld steps above %d; scanned %ld at most\n",
           quick.most, quick.above_usual, quick.steps, USUAL_LOOKUPS, scanned.most);
    CHECK(quick.steps > 30000, "any blades");
    CHECK(quick.most <= MOST_LOOKUPS, "any blades");
    CHECK(100 * quick.above_usual <= quick.steps, "any blades");
    CHECK(quick.most_roots <= quick.most * ROOT_STEPS_PER_LOOKUP, "any blades");
    CHECK(scanned.most <= MOST_SCANNED, "any blades");
}

/* Behind a nick the edge leans back where the blade is turned far enough: refused there alone. */
static void check_that_it_leans(sc_model *model, const char *title)
{
    sc_crack state = {0.0f, 0, 0, 0};
    sc_step_output out;
    sc_model_edge_slopes(model);
    CHECK(model->flattest < -0.2f && model->steepest > 0.2f, title);
    sc_model_step(model, &state, 0.4f, -0.1f, -0.03f, &out);
    CHECK(!(out.flags & SC_STEP_INVALID), title);
    sc_model_step(model, &state, 3.0f, -0.1f, -0.03f, &out);
    CHECK((out.flags & SC_STEP_INVALID) != 0 && out.torque == 0.0f, title);
}

/* A nick in the edge: the release rises behind it, so that the first place must be scanned for. */
static void check_a_nick(void)
{
    static bench_room room;
    const bench_case one = {"a nick", 151, 64, 0.0f, 1.5f, 1.0f, 0.6f, 0};
    sc_model model = bench_model(&one, &room);
    work quick = {0, 0, 0, 0}, scanned = {0, 0, 0, 0};
    CHECK(sc_model_release_falls(&model) == 1, one.title);
    for (int32_t i = 0; i < one.edge_knots; i++) {
        const float away = (room.x[0][i] - 0.035f) / 0.002f;
        const float depth = -6e-4f * expf(-away * away);
        room.y[0][i] += depth;
        room.slope[0][i] -= 2.0f * away / 0.002f * depth;
    }
    model.release_falls = sc_model_release_falls(&model);
    CHECK(model.release_falls == 0, one.title);
    check_that_it_leans(&model, one.title);
    random_steps(&model, 2000, one.title, &quick, &scanned);
    CHECK(quick.steps == 0 && scanned.most <= MOST_SCANNED, one.title);
    model.fracture_energy = 0.0f;
    CHECK(sc_model_release_falls(&model) == 1, one.title); /* nothing is cut */
}

/* The crack of blades that stand still does not creep. */
static void check_rest(void)
{
    static bench_room room;
    const bench_case one = {"rest", 64, 64, 1.0f, 1.5f, 1.0f, 0.6f, 0};
    const sc_model model = bench_model(&one, &room);
    sc_crack state = {0.0f, 0, 0, 0};
    sc_step_output out;
    for (int32_t k = 0; k < 300; k++) {
        const bench_place at = bench_stroke(k, 400);
        sc_model_step(&model, &state, at.opening, at.rate, at.advance, &out);
        const float torque = out.torque;
        sc_model_step(&model, &state, at.opening, 0.0f, at.advance, &out);
        const float crack = state.crack;
        for (int i = 0; i < 300; i++) {
            sc_model_step(&model, &state, at.opening, 0.0f, at.advance, &out);
        }
        NEAR(state.crack, crack, 0.0, "crack", one.title);
        NEAR(out.torque, torque, 5e-4 * torque, "torque", one.title);
    }
}

/* Cubics that rise everywhere, those with an inflection without slope among them. */
static void check_shares(void)
{
    double worst = 0.0;
    long most = 0;
    for (int i = 0; i < 20000; i++) {
        const float whole = powf(10.0f, between(-6.0f, 3.0f));
        float first = between(0.0f, 3.0f), last = between(0.0f, 3.0f);
        if (i % 10 == 0) {
            first = i % 20 ? 0.0f : 3.0f;
            last = i % 20 ? 3.0f : 0.0f;
        }
        const float third = first + last - 2.0f, second = 1.0f - first - third;
        const float share = i % 3 ? between(0.0f, 1.0f) : powf(10.0f, between(-6.0f, 0.0f));
        sc_root_steps = 0;
        const double t = sc_share_of_rise(first * whole, second * whole, third * whole, share * whole);
        const double risen = t * ((double)first + t * ((double)second + t * (double)third));
        worst = fmax(worst, fabs(risen - (double)share));
        most = sc_root_steps > most ? sc_root_steps : most;
        CHECK(t >= 0.0 && t <= 1.0, "share of rise");
    }
    printf("share of rise: off by %.1e of the whole, %ld steps at most\n", worst, most);
    CHECK(worst < 1e-6, "share of rise");
    CHECK(most <= ROOT_STEPS_PER_LOOKUP, "share of rise");
}

/* Look-up and inverse undo each other, whatever they look at first. */
static void check_inverse(void)
{
    static bench_room room;
    const bench_case one = {"inverse", 2, 200, 0.0f, 2.5f, 1.0f, 0.6f, 0};
    const sc_model model = bench_model(&one, &room);
    for (int i = 0; i < 4000; i++) {
        const float x = between(1e-5f, 2.5e-3f);
        sc_place at = {i % 400 - 100, 0.0f, 0.0f, 0.0f, 0.0f}, back = at;
        sc_table_look(&model.response, x, &at);
        NEAR(at.y, sc_table_at(&model.response, x, NULL), 0.0, "value", one.title);
        NEAR(at.area, sc_table_area(&model.response, x), 0.0, "area", one.title);
        sc_table_inverse(&model.response, at.y, &back);
        NEAR(back.x, x, 1e-6 * x + 1e-9, "inverse", one.title);
        NEAR(back.area, at.area, 1e-5 * at.area + 1e-12, "area", one.title);
        NEAR(back.slope, at.slope, 1e-4 * at.slope + 1e-3, "slope", one.title);
    }
}

int main(void)
{
    check_shares();
    check_inverse();
    check_usual_blades();
    check_any_blades();
    check_a_nick();
    check_rest();
    return checks_done("bound on a step");
}
