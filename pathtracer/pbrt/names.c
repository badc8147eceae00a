#define _GNU_SOURCE /* tdestroy */
#include "pbrt/names.h"

#include <search.h>
#include <stdlib.h>
#include <string.h>

#include "base/err.h"

struct named {
    const char *name; /* in `text` */
    int32_t value;
    char text[];
};

/* Both begin with their name. */
static int by_name(const void *a, const void *b) { return strcmp(*(const char *const *)a, *(const char *const *)b); }

static struct named *find(const struct pt_names *names, const char *name)
{
    struct named *const *node = tfind(&name, &names->tree, by_name);
    return node ? *node : NULL;
}

int32_t pt_names_get(const struct pt_names *names, const char *name)
{
    const struct named *e = find(names, name);
    return e ? e->value : -1;
}

int pt_names_set(struct pt_names *names, const char *name, int32_t value)
{
    struct named *e = find(names, name);
    if (e) {
        e->value = value;
        return 0;
    }
    const size_t bytes = strlen(name) + 1;
    e = malloc(sizeof *e + bytes);
    if (!e)
        return BASE_ENOMEM;
    e->name = memcpy(e->text, name, bytes);
    e->value = value;
    if (!tsearch(e, &names->tree, by_name)) {
        free(e);
        return BASE_ENOMEM;
    }
    return 0;
}

void pt_names_release(struct pt_names *names)
{
    tdestroy(names->tree, free);
    names->tree = NULL;
}

const void *pt_row_named(const void *rows, size_t count, size_t size, const char *name)
{
    return lfind(&name, rows, &count, size, by_name);
}
