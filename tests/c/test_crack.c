/* The walk of a crack against its twin's answers; arrays have their exact sizes on the heap, so that
 * the sanitizers see every read beyond an end. */
#include "arrays.h"
#include "check.h"
#include "sc_crack.h"

#include <stdlib.h>

static sc_curve curve_of(const json *object, const char *key)
{
    const json *one = json_get(object, key);
    sc_curve curve = {(int32_t)json_get(one, "value")->size, json_number(one, "first"),
                      json_number(one, "step"), doubles(one, "value"), doubles(one, "slope")};
    return curve;
}

static sc_crack_law law_of(const json *one)
{
    sc_crack_law law;
    law.edge = curve_of(one, "edge");
    law.response = curve_of(one, "response");
    law.energy = curve_of(one, "energy");
    law.moving_blades = json_number(one, "moving_blades");
    law.upper_face = json_number(one, "upper_face");
    law.eq4 = (int32_t)json_number(one, "eq4");
    law.fracture = (int32_t)json_number(one, "fracture");
    law.kappa = json_number(one, "kappa");
    law.damping = 0.0;
    law.tick_s = json_number(one, "tick_s");
    law.tough_size = (int32_t)json_get(one, "tough")->size;
    law.tough_first = 0.0;
    law.tough_step = json_number(one, "tough_step");
    law.tough = doubles(one, "tough");
    return law;
}

static void check_array(const json *one, const char *key, const double *got, double tolerance)
{
    const json *wanted = json_get(one, key);
    double largest = 1e-12;
    for (size_t i = 0; i < wanted->size; i++)
        largest = fmax(largest, fabs(wanted->items[i].number));
    for (size_t i = 0; i < wanted->size; i++)
        NEAR(got[i], wanted->items[i].number, tolerance * largest, key, json_text(one, "title"));
}

static void check_case(const json *one, double tolerance)
{
    const char *title = json_text(one, "title");
    sc_crack_law law = law_of(one);
    double *opening = doubles(one, "opening"), *advance = doubles(one, "advance");
    const size_t count = json_get(one, "opening")->size;
    size_t each = sizeof(double);
    double *torque = room((count - 1) * each), *push = room((count - 1) * each);
    double *place = room(count * each);
    sc_crack_books books = {0.0, 0.0, 0.0, 0};
    sc_crack_walk(&law, opening, advance, (int32_t)count, torque, push, place, &books);
    check_array(one, "torque", torque, tolerance);
    check_array(one, "push", push, tolerance);
    check_array(one, "place", place, tolerance);
    NEAR(books.lost, json_number(one, "lost"), tolerance * fabs(books.lost), "lost", title);
    NEAR(books.stored, json_number(one, "stored"), tolerance * fabs(books.stored), "stored", title);
    CHECK(books.jumps == (int32_t)json_number(one, "jumps"), title);

    /* Nonsense in, an end all the same; a single sample has no tick. */
    sc_crack_books single = {0.0, 0.0, 0.0, 0};
    sc_crack_walk(&law, opening, advance, 1, torque, push, place, &single);
    CHECK(place[0] == 0.0 && single.jumps == 0, title);
    opening[count / 2] = NAN;
    advance[count / 3] = HUGE_VAL;
    sc_crack_walk(&law, opening, advance, (int32_t)count, torque, push, place, &books);
    CHECK(books.jumps >= 0, title);
    free_arrays();
}

int main(int argc, char **argv)
{
    json vectors = json_load(argc > 1 ? argv[1] : "../golden", "crack.json");
    const json *cases = json_get(&vectors, "cases");
    for (size_t i = 0; i < cases->size; i++)
        check_case(&cases->items[i], json_number(&vectors, "tolerance"));
    json_free(&vectors);
    return checks_done("crack");
}
