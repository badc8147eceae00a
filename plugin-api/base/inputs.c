#include "base/inputs.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <zlib.h>

#include "base/files.h"

/* Where `path` is or belongs. */
static size_t place_of(const struct base_inputs *inputs, const char *path)
{
    size_t low = 0, high = inputs->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (strcmp(inputs->paths[middle], path) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static int insert(struct base_inputs *inputs, const char *path, struct base_err *err)
{
    size_t at = place_of(inputs, path);
    if (at < inputs->count && !strcmp(inputs->paths[at], path))
        return 0;
    if (inputs->count == inputs->room) {
        size_t room = 2 * inputs->room + 16;
        char **paths = realloc(inputs->paths, room * sizeof *paths);
        if (!paths)
            return base_fail_nomem(err, path);
        inputs->paths = paths;
        inputs->room = room;
    }
    char *copy = strdup(path);
    if (!copy)
        return base_fail_nomem(err, path);
    memmove(inputs->paths + at + 1, inputs->paths + at, (inputs->count++ - at) * sizeof *inputs->paths);
    inputs->paths[at] = copy;
    return 0;
}

int base_inputs_add(struct base_inputs *inputs, const char *path, struct base_err *err)
{
    pthread_mutex_lock(&inputs->lock);
    int rc = insert(inputs, path, err);
    pthread_mutex_unlock(&inputs->lock);
    return rc;
}

int base_inputs_crc32(const struct base_inputs *inputs, uint32_t *crc, struct base_err *err)
{
    static const size_t piece = 1 << 16;
    unsigned char *bytes = malloc(piece);
    int rc = bytes ? 0 : base_fail_nomem(err, "checksum");
    *crc = 0;
    for (size_t i = 0; i < inputs->count && !rc; i++) {
        FILE *f = NULL;
        rc = base_file_open(inputs->paths[i], &f, err);
        if (rc)
            break;
        for (size_t n; (n = fread(bytes, 1, piece, f)) > 0;)
            *crc = (uint32_t)crc32_z(*crc, bytes, n);
        if (ferror(f))
            rc = base_fail(err, BASE_EIO, "%s: read error", inputs->paths[i]);
        fclose(f);
    }
    free(bytes);
    return rc;
}

int base_inputs_protect(const struct base_inputs *inputs, const char *output, struct base_err *err)
{
    struct stat out, in;
    if (!output || stat(output, &out) != 0)
        return 0;
    for (size_t i = 0; i < inputs->count; i++)
        if (stat(inputs->paths[i], &in) == 0 && in.st_dev == out.st_dev && in.st_ino == out.st_ino)
            return base_fail(err, BASE_EINVAL, "%s: this is an input (%s), it would be overwritten", output,
                             inputs->paths[i]);
    return 0;
}

void base_inputs_release(struct base_inputs *inputs)
{
    for (size_t i = 0; i < inputs->count; i++)
        free(inputs->paths[i]);
    free(inputs->paths);
    inputs->paths = NULL;
    inputs->count = inputs->room = 0;
}
