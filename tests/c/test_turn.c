/* Sine and cosine against the C library's in double precision, and their bits at fixed angles, which
 * every compiler and processor must give. */
#include "check.h"
#include "sc_turn.h"

#include <stdint.h>
#include <string.h>

/* Units in the last place between a float and what it should be. */
static double ulps(float got, double wanted)
{
    int exponent;
    frexp(wanted, &exponent);
    return fabs((double)got - wanted) / ldexp(1.0, exponent - 24);
}

static void test_accuracy(double widest, long count, int near, double allowed, const char *title)
{
    double worst = 0.0;
    for (long i = 0; i <= count; i++) {
        const float angle = (float)(widest * (2.0 * (double)i / (double)count - 1.0));
        const sc_turn turn = sc_turn_of(angle);
        const double sine = sin((double)angle), cosine = cos((double)angle);
        const double off = fmax(fabs((double)turn.sine - sine), fabs((double)turn.cosine - cosine));
        worst = fmax(worst, near ? fmax(ulps(turn.sine, sine), ulps(turn.cosine, cosine)) : off);
    }
    NEAR(worst, 0.0, allowed, "largest error", title);
}

static void test_small(void)
{
    for (float angle = 1e-38f; angle < 0.1f; angle *= 1.01f) {
        CHECK(ulps(sc_turn_of(angle).sine, sin((double)angle)) <= 1.0, "small angles");
    }
    CHECK(sc_turn_of(0.0f).cosine == 1.0f, "the cosine of 0");
}

/* Where the reduction goes from one quarter to the next, where the polynomials meet, and where sine or
 * cosine is 0: ten floats on either side. Both must be as accurate there as elsewhere, so neither jumps. */
static void test_seams(void)
{
    double worst = 0.0, worst_near = 0.0;
    int is_odd = 1;
    for (int eighth = 0; eighth <= 15278; eighth++) { /* 12000 rad */
        float angle = (float)(eighth * 0.78539816339744831);
        for (int i = 0; i < 10; i++) {
            angle = nextafterf(angle, -1.0f);
        }
        for (int i = 0; i <= 20; i++, angle = nextafterf(angle, INFINITY)) {
            const sc_turn turn = sc_turn_of(angle), back = sc_turn_of(-angle);
            const double sine = sin((double)angle), cosine = cos((double)angle);
            worst = fmax(worst, fmax(fabs(turn.sine - sine), fabs(turn.cosine - cosine)));
            if (eighth <= 4) {
                worst_near = fmax(worst_near, fmax(ulps(turn.sine, sine), ulps(turn.cosine, cosine)));
            }
            is_odd = is_odd && back.sine == -turn.sine && back.cosine == turn.cosine;
        }
    }
    NEAR(worst, 0.0, 1.5e-7, "largest error", "seams");
    NEAR(worst_near, 0.0, 1.5, "largest error", "seams up to half a turn, in units of the last place");
    CHECK(is_odd, "the sine is odd and the cosine even, to the bit");
}

static void test_beyond(void)
{
    const float beyond[] = {12001.0f, -1e30f, INFINITY, -INFINITY, NAN};
    for (int i = 0; i < 5; i++) {
        const sc_turn turn = sc_turn_of(beyond[i]);
        CHECK(isnan(turn.sine) && isnan(turn.cosine), "beyond the widest");
    }
}

static void test_bits(void)
{
    /* FNV-1a over 2 000 003 pairs: one number that every platform must give. */
    uint32_t hash = 2166136261u;
    for (int32_t i = -1000001; i <= 1000001; i++) {
        const sc_turn turn = sc_turn_of((float)i * 3.25e-6f);
        uint32_t words[2];
        memcpy(words, &turn, sizeof words);
        hash = (hash ^ words[0]) * 16777619u;
        hash = (hash ^ words[1]) * 16777619u;
    }
    CHECK(hash == 0xe1746679u, "bits of sine and cosine");
}

int main(void)
{
    test_accuracy(3.1415927, 4000000, 1, 1.5, "half a turn, in units of the last place");
    test_accuracy(12000.0, 4000000, 0, 1.5e-7, "the widest angles");
    test_small();
    test_seams();
    test_beyond();
    test_bits();
    return checks_done("turn");
}
