#include "sight/view_name.h"

#include <string.h>

static int length_without_part(const char *name)
{
    static const char part[] = "_part6";
    const size_t length = strlen(name), n = sizeof part - 1;
    return (int)(length > n && strcmp(name + length - n, part) == 0 ? length - n : length);
}

int ggn_view_is(const char *name, const char *other)
{
    const int n = length_without_part(name);
    return n == length_without_part(other) && strncmp(name, other, (size_t)n) == 0;
}
