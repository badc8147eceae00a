#include "base/list.h"

#include <stdlib.h>

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
