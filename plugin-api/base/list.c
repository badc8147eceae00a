#include "base/list.h"

#include <stdlib.h>
#include <string.h>

#include "base/err.h"

static int is_digit(char c) { return c >= '0' && c <= '9'; }

const char *base_list_next(const char *at, unsigned long *first, unsigned long *last, unsigned long *step)
{
    char *end;
    if (!is_digit(*at))
        return NULL;
    *first = *last = strtoul(at, &end, 10);
    if (*end == '-' && is_digit(end[1]))
        *last = strtoul(end + 1, &end, 10);
    if (step)
        *step = *end == ':' && is_digit(end[1]) ? strtoul(end + 1, &end, 10) : 1;
    if (*end == ',' && end[1] != '\0')
        return end + 1;
    return *end == '\0' ? end : NULL;
}

static int compare_numbers(const void *a, const void *b)
{
    uint32_t x, y;
    memcpy(&x, *(const char *const *)a, sizeof x);
    memcpy(&y, *(const char *const *)b, sizeof y);
    return (x > y) - (x < y);
}

static int compare_texts(const void *a, const void *b) { return strcmp(*(const char *const *)a, *(const char *const *)b); }

static int look(const char *at, size_t stride, size_t count, int (*compare)(const void *, const void *), const char **twice)
{
    const char **order = malloc((count > 0 ? count : 1) * sizeof *order);
    int found = 0;
    if (!order)
        return BASE_ENOMEM;
    for (size_t i = 0; i < count; i++)
        order[i] = at + i * stride;
    qsort(order, count, sizeof *order, compare);
    for (size_t i = 1; i < count && !found; i++)
        if (compare(&order[i - 1], &order[i]) == 0) {
            *twice = order[i];
            found = 1;
        }
    free(order);
    return found;
}

int base_unique_numbers(const uint32_t *at, size_t stride, size_t count, uint32_t *twice)
{
    const char *found;
    int rc = look((const char *)at, stride, count, compare_numbers, &found);
    if (rc == 1)
        memcpy(twice, found, sizeof *twice);
    return rc;
}

int base_unique_texts(const char *at, size_t stride, size_t count, const char **twice)
{
    return look(at, stride, count, compare_texts, twice);
}
