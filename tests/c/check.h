/* CHECK counts what does not hold and goes on, so that one run shows everything that is wrong. */
#ifndef CHECK_H
#define CHECK_H

#include "sinew.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define CHECK(condition)                                                       \
    do {                                                                       \
        if (!(condition)) {                                                    \
            failures++;                                                        \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
        }                                                                      \
    } while (0)

/* |value - expected| within an absolute error; never true of NaN. */
#define CHECK_NEAR(value, expected, error)                                     \
    do {                                                                       \
        const double v_ = (value), e_ = (expected);                            \
        if (!(fabs(v_ - e_) <= (error))) {                                     \
            failures++;                                                        \
            fprintf(stderr, "%s:%d: %s is %.9g, expected %.9g within %.3g\n", __FILE__, __LINE__, #value, v_, e_, \
                    (double)(error));                                          \
        }                                                                      \
    } while (0)

/* What the test cannot go on without. */
#define MUST(call) must((call), #call, __FILE__, __LINE__)
static inline void must(sinew_status status, const char *call, const char *file, int line)
{
    char message[512];
    if (status == SINEW_STATUS_OK)
        return;
    sinew_last_error(message, sizeof message);
    fprintf(stderr, "%s:%d: %s: %s: %s\n", file, line, call, sinew_status_name(status), message);
    exit(2);
}

static inline int checked(const char *what)
{
    if (failures == 0)
        printf("%s\n", what);
    else
        fprintf(stderr, "%d checks failed\n", failures);
    return failures != 0;
}

#endif
