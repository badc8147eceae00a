#include "sequence/look.h"

#include <stdlib.h>

#include "base/bytes.h"
#include "base/files.h"

int seq_look_parse(const char *path, uint8_t *bytes, size_t size, struct seq_look *out, struct base_err *err)
{
    struct seq_source in;
    int rc = seq_source_open(path, bytes, size, 2, &in, err);
    if (rc)
        return rc;
    struct seq_look l = {.width = in.width,
                         .height = in.height,
                         .number = in.id,
                         .seed = in.seed,
                         .count = in.count,
                         .bytes = bytes,
                         .size = size,
                         .records = calloc(in.count, sizeof *l.records)};
    if (!l.records)
        return base_fail_nomem(err, path);
    size_t at = SEQ_FILE_HEADER;
    for (uint32_t i = 0; i < l.count && !rc; i++) {
        rc = seq_record_parse(&in, i, &at, &l.records[i], err);
        if (!rc && i > 0 && l.records[i].block <= l.records[i - 1].block)
            rc = base_fail(err, BASE_EINVAL, "%s: blocks do not rise: %u after %u", path, l.records[i].block,
                           l.records[i - 1].block);
    }
    if (!rc && at != size)
        rc = base_fail(err, BASE_EINVAL, "%s: bytes after the last image", path);
    if (rc)
        free(l.records);
    else
        *out = l;
    return rc;
}

int seq_look_read(const char *path, struct seq_look *look, struct base_err *err)
{
    char *bytes;
    size_t size;
    int rc = base_file_read(path, SEQ_MAX_FILE, &bytes, &size, err);
    if (rc)
        return rc;
    rc = seq_look_parse(path, (uint8_t *)bytes, size, look, err);
    if (rc)
        free(bytes);
    return rc;
}

void seq_look_release(struct seq_look *look)
{
    free(look->records);
    free(look->bytes);
    *look = (struct seq_look){0};
}

int seq_look_open(struct seq_builder *w, uint32_t width, uint32_t height, uint32_t number, uint64_t seed,
                  struct base_err *err)
{
    const struct seq_source what = {.version = 2, .width = width, .height = height, .id = number, .seed = seed};
    return seq_builder_open(w, &what, err);
}

int seq_look_add(struct seq_builder *w, const struct seq_record *given, const struct seq_stat *stats, uint32_t planes,
                 void (*fill)(void *data, enum seq_plane_number plane, float *out), void *data, struct base_err *err)
{
    const size_t most = 3 * (size_t)given->width * given->height;
    struct seq_record r = *given;
    float *values = malloc(most * sizeof *values);
    uint8_t *raw = malloc(most * sizeof *values);
    size_t start = w->size;
    int rc =
        values && raw ? seq_record_begin(w, SEQ_LOOK_HEADER, stats, r.n_stats, &start, err) : base_fail_nomem(err, "plane");
    r.n_planes = 0;
    for (uint32_t p = SEQ_PLANE_COLOR; p < SEQ_PLANES_END && !rc; p++) {
        if (!(planes >> p & 1))
            continue;
        const size_t n = seq_plane_channels(p) * (size_t)r.width * r.height;
        fill(data, (enum seq_plane_number)p, values);
        for (size_t i = 0; i < n; i++)
            base_put_u32(raw + sizeof *values * i, base_f32_bits(values[i]));
        rc = seq_record_add(w, (enum seq_plane_number)p, SEQ_FILTER_SHUFFLE, raw, r.width, r.height, err);
        r.n_planes++;
    }
    if (!rc)
        seq_record_end(w, start, SEQ_LOOK_HEADER, &r);
    else
        w->size = start;
    free(values);
    free(raw);
    return rc;
}
