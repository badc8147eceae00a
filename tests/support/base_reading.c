#include "base_reading.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

enum { GROWTH = 8, TRIES = 3 };

/* 1 where reading is linear and 2 where it is quadratic; at most 1.14 was seen. */
static const double EXPONENT_MAX = 1.45;

/* The least thread seconds of `rounds` readings of an input of `items`, its bytes to *size; negative if it was refused. */
static double reading_s(const struct base_reading *r, size_t items, int rounds, size_t *size)
{
    char *input = r->make(items, size);
    double least = -1;
    for (int i = 0; i < rounds && input; i++) {
        char *copy = malloc(*size + 1);
        if (!copy)
            break;
        memcpy(copy, input, *size);
        copy[*size] = '\0';
        double s = r->read_s(copy, *size, items);
        if (s < 0) {
            least = s;
            break;
        }
        if (least < 0 || s < least)
            least = s;
    }
    free(input);
    return least;
}

/* The exponent of time against bytes from the smallest input to that of GROWTH times the items. Measured again while it is too
 * large, as other work on the machine only makes it larger. Negative if an input was refused. */
static double exponent_of(const struct base_reading *r)
{
    double least = HUGE_VAL;
    for (int i = 0; i < TRIES && least > EXPONENT_MAX; i++) {
        size_t bytes[2];
        double small = reading_s(r, r->items, 5, &bytes[0]), large = reading_s(r, GROWTH * r->items, 3, &bytes[1]);
        if (small <= 0 || large <= 0)
            return -1;
        least = fmin(least, fmax(0, log(large / small) / log((double)bytes[1] / (double)bytes[0])));
    }
    return least;
}

int base_reading_check(const struct base_reading *readings, size_t count)
{
    int failed = 0;
    for (size_t i = 0; i < count; i++) {
        double e = exponent_of(&readings[i]);
        printf("%s: %s %.2f\n", readings[i].name, e < 0 ? "refused," : "time grows with the size to the power", e);
        failed |= e < 0 || e > EXPONENT_MAX;
    }
    return failed;
}

int base_reading_table(const struct base_reading *readings, size_t count, double limit_s)
{
    for (size_t i = 0; i < count; i++) {
        double s = 0;
        for (size_t items = readings[i].items; 2 * s < limit_s && (!readings[i].most || items <= readings[i].most); items *= 2) {
            size_t size;
            s = reading_s(&readings[i], items, 3, &size);
            if (s < 0) {
                fprintf(stderr, "%s: refused with %zu items\n", readings[i].name, items);
                return 1;
            }
            printf("%s;%zu;%zu;%.9f\n", readings[i].name, items, size, s);
            fflush(stdout);
        }
    }
    return 0;
}
