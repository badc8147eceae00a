#include "pbrt/source.h"

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/files.h"

static const size_t max_file_bytes = INT_MAX; /* so that a line number always fits */

static int unpack(const char *path, char *packed, size_t packed_size, char **bytes, size_t *size, struct base_err *err)
{
    int rc = 0;
    size_t room = packed_size < 1u << 20 ? 4u << 20 : packed_size * 4, n = 0;
    char *out = malloc(room + 1);
    z_stream z = {.next_in = (Bytef *)packed};
    if (!out)
        return base_fail_nomem(err, path);
    if (inflateInit2(&z, 15 + 16) != Z_OK) { /* 16: gzip framing */
        free(out);
        return base_fail_nomem(err, path);
    }
    for (int status = Z_OK; status != Z_STREAM_END;) {
        if (n == room) {
            char *bigger = room < max_file_bytes ? realloc(out, room * 2 + 1) : NULL;
            if (!bigger) {
                rc = base_fail(err, BASE_EINVAL, "%s: unpacks to more than %zu bytes", path, room);
                break;
            }
            out = bigger;
            room *= 2;
        }
        if (z.avail_in == 0) {
            size_t left = packed_size - (size_t)((char *)z.next_in - packed);
            z.avail_in = left < UINT_MAX ? (uInt)left : UINT_MAX;
        }
        size_t space = room - n < 1u << 30 ? room - n : 1u << 30;
        z.next_out = (Bytef *)out + n;
        z.avail_out = (uInt)space;
        status = inflate(&z, Z_NO_FLUSH);
        n += space - z.avail_out;
        if (status != Z_OK && status != Z_STREAM_END) {
            rc = base_fail(err, BASE_EINVAL, "%s: damaged or truncated gzip file", path);
            break;
        }
    }
    inflateEnd(&z);
    if (rc) {
        free(out);
        return rc;
    }
    out[n] = '\0';
    *bytes = out;
    *size = n;
    return 0;
}

static int note_file(void *data, const char *path, struct base_err *err)
{
    return data ? base_inputs_add(data, path, err) : 0;
}

static int read_file(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    char *raw = NULL;
    size_t n = 0, length = strlen(path);
    int rc = note_file(data, path, err);
    if (!rc)
        rc = base_file_read(path, max_file_bytes, &raw, &n, err);
    if (rc || length < 3 || strcmp(path + length - 3, ".gz") != 0) {
        if (!rc) {
            *bytes = raw;
            *size = n;
        }
        return rc;
    }
    rc = unpack(path, raw, n, bytes, size, err);
    free(raw);
    return rc;
}

struct pt_source pt_source_files(struct base_inputs *inputs) { return (struct pt_source){read_file, note_file, inputs, 1}; }

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
