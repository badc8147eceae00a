#include "base_reading.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

enum { GROWTH = 8, TRIES = 3 };

double base_reading_s(const struct base_reading *r, size_t items, int rounds, size_t *size)
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

double base_reading_exponent(const struct base_reading *r, double bound)
{
    double least = HUGE_VAL;
    for (int i = 0; i < TRIES && least > bound; i++) {
        size_t bytes[2];
        double small = base_reading_s(r, r->items, 5, &bytes[0]), large = base_reading_s(r, GROWTH * r->items, 3, &bytes[1]);
        if (small <= 0 || large <= 0)
            return -1;
        least = fmin(least, fmax(0, log(large / small) / log((double)bytes[1] / (double)bytes[0])));
    }
    return least;
}

int base_reading_table(const struct base_reading *readings, size_t count, double limit_s)
{
    for (size_t i = 0; i < count; i++) {
        double s = 0;
        for (size_t items = readings[i].items; 2 * s < limit_s && (!readings[i].most || items <= readings[i].most); items *= 2) {
            size_t size;
            s = base_reading_s(&readings[i], items, 3, &size);
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
