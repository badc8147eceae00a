#include "pt_memory_source.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

static int read_single(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    const struct pt_source_single *single = data;
    if (strcmp(path, single->path) != 0)
        return base_fail(err, BASE_EIO, "%s: No such file or directory", path);
    char *copy = malloc(single->size + 1);
    if (!copy)
        return base_fail_nomem(err, path);
    if (single->size > 0)
        memcpy(copy, single->text, single->size);
    copy[single->size] = '\0';
    *bytes = copy;
    *size = single->size;
    return 0;
}

struct pt_source pt_source_from_memory(const struct pt_source_single *single)
{
    return (struct pt_source){read_single, NULL, (void *)(uintptr_t)single, 0};
}
