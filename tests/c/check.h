/* Checks that count and go on, so that one run shows every failure. */
#ifndef TEST_CHECK_H
#define TEST_CHECK_H

#include <math.h>
#include <stdio.h>

static int checks_made;
static int checks_failed;

static inline void check_that(int holds, const char *what, const char *title, int line)
{
    checks_made++;
    if (!holds) {
        checks_failed++;
        fprintf(stderr, "line %d, %s: %s does not hold\n", line, title, what);
    }
}

static inline void check_near(double got, double wanted, double allowed, const char *what,
                              const char *title, int line)
{
    checks_made++;
    if (!(fabs(got - wanted) <= allowed)) {
        checks_failed++;
        fprintf(stderr, "line %d, %s: %s is %.9g, wanted %.9g +- %.2g\n", line, title, what, got,
                wanted, allowed);
    }
}

#define CHECK(holds, title) check_that((holds) != 0, #holds, title, __LINE__)
#define NEAR(got, wanted, allowed, what, title) \
    check_near(got, wanted, allowed, what, title, __LINE__)

static inline int checks_done(const char *name)
{
    printf("%s: %d checks, %d failed\n", name, checks_made, checks_failed);
    return checks_failed == 0 && checks_made > 0 ? 0 : 1;
}

#endif
