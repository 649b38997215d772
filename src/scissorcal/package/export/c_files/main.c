/* Steps the exported package: a closing stroke, or the states that it reads.
 *
 *   stroke      a closing stroke of 400 steps over the openings of the package
 *   stroke -    a step for each line "opening rate advance" (rad, rad/s, m) of the standard input;
 *               a line "crack X" puts the crack tip there (m), on a fresh sheet
 *
 * Prints for each step the inputs, torque [N m], force along the cut [N], crack tip [m] and flags; then
 * torque, force and crack as hexadecimal numbers, which hold every bit. */
#include "scissorcal_package.h"

#include <stdio.h>
#include <string.h>

enum { STEPS = 400, LONGEST_LINE = 256 };

static const float STROKE_RATE = -0.5f; /* rad/s */

static void step(sc_crack *state, float opening, float rate, float advance)
{
    sc_step_output out;
    sc_model_step(&scissorcal_package, state, opening, rate, advance, &out);
    printf("%.9g %.9g %.9g %.9g %.9g %.9g %lu %a %a %a\n", (double)opening, (double)rate,
           (double)advance, (double)out.torque, (double)out.force, (double)state->crack,
           (unsigned long)out.flags, (double)out.torque, (double)out.force, (double)state->crack);
}

static void stroke(sc_crack *state)
{
    const float from = scissorcal_package.opening_max;
    const float span = from - scissorcal_package.opening_min;
    const float advance = -scissorcal_package.contact_min;
    for (int i = 0; i <= STEPS; i++) {
        step(state, from - span * ((float)i / (float)STEPS), STROKE_RATE, advance);
    }
}

/* The number of the first line that is neither a state nor a crack; 0 where there is none. */
static long read_states(sc_crack *state)
{
    char line[LONGEST_LINE];
    for (long number = 1; fgets(line, sizeof line, stdin) != NULL; number++) {
        float place, opening, rate, advance;
        if (sscanf(line, "crack %f", &place) == 1) {
            memset(state, 0, sizeof *state);
            state->crack = place;
        } else if (sscanf(line, "%f %f %f", &opening, &rate, &advance) == 3) {
            step(state, opening, rate, advance);
        } else {
            return number;
        }
    }
    return 0;
}

int main(int count, char **words)
{
    sc_crack state;
    memset(&state, 0, sizeof state);
    if (!sc_model_is_sound(&scissorcal_package)) {
        fprintf(stderr, "the tables are not sound: export the package again\n");
        return 1;
    }
    printf("# opening rate advance torque force crack flags torque force crack\n");
    if (count == 1) {
        stroke(&state);
        return 0;
    }
    if (count != 2 || strcmp(words[1], "-") != 0) {
        fprintf(stderr, "use: %s, or %s - with lines \"opening rate advance\"\n", words[0], words[0]);
        return 2;
    }
    const long wrong = read_states(&state);
    if (wrong) {
        fprintf(stderr, "line %ld has neither \"opening rate advance\" nor \"crack X\"\n", wrong);
        return 2;
    }
    return 0;
}
