#include "base_reading.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { GROWTH = 8 };

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

int base_reading_check(const struct base_reading *readings, size_t count)
{
    int failed = 0;
    for (size_t i = 0; i < count; i++)
        for (size_t items = readings[i].items; items <= GROWTH * readings[i].items; items *= GROWTH) {
            size_t size;
            int refused = reading_s(&readings[i], items, 1, &size) < 0;
            if (refused)
                printf("%s: refused with %zu items\n", readings[i].name, items);
            failed |= refused;
        }
    return failed;
}

int base_reading_table(const struct base_reading *readings, size_t count, double limit_s)
{
    for (size_t i = 0; i < count; i++) {
        double s = 0;
        for (size_t items = readings[i].items; 2 * s < limit_s && (!readings[i].most || items <= readings[i].most);
             items *= 2) {
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
