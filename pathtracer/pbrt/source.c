#include "pbrt/source.h"

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <zlib.h>

#include "base/files.h"

static const size_t max_file_bytes = INT_MAX; /* so that a line number always fits */

struct unpacked {
    char *bytes; /* owns; one byte more than room */
    size_t size, room;
};

/* Whether another member begins there. */
static int has_member(const z_stream *z) { return z->avail_in >= 2 && z->next_in[0] == 0x1f && z->next_in[1] == 0x8b; }

/* All members from z->next_in on: they are one text (RFC 1952, 2.2); bgzip, pigz and cat make such files. */
static int unpack(const char *name, z_stream *z, struct unpacked *out, struct base_err *err)
{
    for (int status = Z_OK; status != Z_STREAM_END;) {
        if (out->size == out->room) {
            char *bigger = out->room < max_file_bytes ? realloc(out->bytes, out->room * 2 + 1) : NULL;
            if (!bigger)
                return base_fail(err, BASE_EINVAL, "%s: unpacks to more than %zu bytes", name, out->room);
            out->bytes = bigger;
            out->room *= 2;
        }
        size_t space = out->room - out->size < 1u << 30 ? out->room - out->size : 1u << 30;
        z->next_out = (Bytef *)out->bytes + out->size;
        z->avail_out = (uInt)space;
        status = inflate(z, Z_NO_FLUSH);
        out->size += space - z->avail_out;
        if (status == Z_STREAM_END && has_member(z))
            status = inflateReset(z);
        else if (status != Z_OK && status != Z_STREAM_END)
            return base_fail(err, BASE_EINVAL, "%s: damaged or truncated gzip file", name);
    }
    /* Zeros may fill up a block. Anything else would be lost. */
    for (uInt i = 0; i < z->avail_in; i++)
        if (z->next_in[i] != 0)
            return base_fail(err, BASE_EINVAL,
                             "%s: %u bytes behind its last gzip member are no member (expected none, or zeros)", name,
                             z->avail_in);
    return 0;
}

int pt_source_unpack(const char *name, const char *packed, size_t packed_size, char **bytes, size_t *size,
                     struct base_err *err)
{
    if (packed_size > max_file_bytes)
        return base_fail(err, BASE_EINVAL, "%s: more than %zu bytes", name, max_file_bytes);
    struct unpacked out = {.room = packed_size < 1u << 20 ? 4u << 20 : packed_size * 4};
    z_stream z = {.next_in = (Bytef *)(uintptr_t)packed, .avail_in = (uInt)packed_size};
    out.bytes = malloc(out.room + 1);
    if (!out.bytes || inflateInit2(&z, 15 + 16) != Z_OK) { /* 16: gzip framing */
        free(out.bytes);
        return base_fail_nomem(err, name);
    }
    int rc = unpack(name, &z, &out, err);
    inflateEnd(&z);
    if (rc) {
        free(out.bytes);
        return rc;
    }
    out.bytes[out.size] = '\0';
    *bytes = out.bytes;
    *size = out.size;
    return 0;
}

static int note_file(void *data, const char *path, struct base_err *err)
{
    return data ? base_inputs_add(data, path, err) : 0;
}

static int read_file(void *data, const char *path, char **bytes, size_t *size, struct base_err *err)
{
    char *packed = NULL;
    size_t n = 0;
    int rc = note_file(data, path, err);
    if (!rc && !base_file_has_ending(path, "gz"))
        return base_file_read(path, max_file_bytes, bytes, size, err);
    if (!rc)
        rc = base_file_read(path, max_file_bytes, &packed, &n, err);
    if (!rc)
        rc = pt_source_unpack(path, packed, n, bytes, size, err);
    free(packed);
    return rc;
}

struct pt_source pt_source_files(struct base_inputs *inputs) { return (struct pt_source){read_file, note_file, inputs, 1}; }
