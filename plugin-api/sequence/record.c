#include "sequence/record.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/bytes.h"
#include "base/files.h"

enum { MAX_SIDE = 1 << 15, MAX_BLOCK_SIDE = 4096, MAX_LEVELS = 4096, MAX_BLOCKS = 1 << 20 };
static const char MAGIC[] = "LULLSEQ1";

static uint32_t crc_of(const uint8_t *bytes, size_t size) { return (uint32_t)crc32_z(0, bytes, size); }

static double value_of(const uint8_t *stat)
{
    const uint64_t bits = base_get_u64(stat + SEQ_NAME);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

int seq_source_open(const char *path, const uint8_t *p, size_t size, uint32_t version, struct seq_source *out,
                    struct base_err *err)
{
    if (size < SEQ_FILE_HEADER || memcmp(p, MAGIC, 8) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a block sequence", path);
    const uint32_t found = base_get_u32(p + 8);
    if (found != version && (found == 1 || found == 2))
        return base_fail(err, BASE_EINVAL, "%s: %s (version %u of the format), expected %s", path,
                         found == 1 ? "a block alone" : "a look at a whole frame", found,
                         found == 1 ? "a look at a whole frame" : "a block alone");
    if (found != version || base_get_u32(p + 12) != SEQ_FILE_HEADER)
        return base_fail(err, BASE_EINVAL, "%s: version %u of the format is not known", path, found);
    if (crc_of(p, 60) != base_get_u32(p + 60))
        return base_fail(err, BASE_EINVAL, "%s: the header is damaged (CRC)", path);
    struct seq_source s = {.path = path,
                           .bytes = p,
                           .size = size,
                           .version = version,
                           .width = base_get_u32(p + 16),
                           .height = base_get_u32(p + 20),
                           .x0 = (int32_t)base_get_u32(p + 24),
                           .y0 = (int32_t)base_get_u32(p + 28),
                           .id = base_get_u32(p + 32),
                           .count = base_get_u32(p + 36),
                           .seed = base_get_u64(p + 40)};
    const uint32_t side = version == 1 ? MAX_BLOCK_SIDE : MAX_SIDE, most = version == 1 ? MAX_LEVELS : MAX_BLOCKS;
    if (s.width < 1 || s.width > side || s.height < 1 || s.height > side || s.count < 1 || s.count > most)
        return base_fail(err, BASE_EINVAL, "%s: %s of %ux%u pixels with %u images", path,
                         version == 1 ? "a block" : "a picture", s.width, s.height, s.count);
    /* Each image takes at least its header: a short file must not make a long table. */
    if (s.count > (size - SEQ_FILE_HEADER) / (version == 1 ? SEQ_RECORD_HEADER : SEQ_LOOK_HEADER))
        return base_fail(err, BASE_EINVAL, "%s: truncated: room for fewer than %u images", path, s.count);
    *out = s;
    return 0;
}

static int check_stats(const char *path, const struct seq_record *r, struct base_err *err)
{
    const uint8_t *p = r->stats;
    for (uint32_t i = 0; i < r->n_stats; i++, p += SEQ_STAT_BYTES)
        if (!memchr(p, 0, SEQ_NAME) || !isfinite(value_of(p)))
            return base_fail(err, BASE_EINVAL, "%s: %u spp: statistic %u is not usable", path, r->spp, i);
    return 0;
}

static int parse_planes(const char *path, const uint8_t *p, const uint8_t *end, struct seq_record *r, struct base_err *err)
{
    uint32_t seen = 0;
    for (uint32_t i = 0; i < r->n_planes; i++) {
        struct seq_plane *s = &r->planes[i];
        if (end - p < SEQ_PLANE_HEADER)
            return base_fail(err, BASE_EINVAL, "%s: %u spp: plane %u is cut short", path, r->spp, i);
        *s = (struct seq_plane){.plane = base_get_u32(p),
                                .filter = base_get_u32(p + 4),
                                .raw_bytes = base_get_u32(p + 8),
                                .stored_bytes = base_get_u32(p + 12),
                                .stored = p + SEQ_PLANE_HEADER};
        p += SEQ_PLANE_HEADER;
        if ((size_t)(end - p) < s->stored_bytes)
            return base_fail(err, BASE_EINVAL, "%s: %u spp: plane %u is cut short", path, r->spp, i);
        p += s->stored_bytes;
        size_t want = seq_plane_raw_bytes(s->plane, r->width, r->height);
        if (want == 0)
            continue;
        if (s->raw_bytes != want || (s->filter & ~seq_plane_filters(s->plane)) != 0 || (seen & 1u << s->plane) != 0)
            return base_fail(err, BASE_EINVAL, "%s: %u spp: plane %u has the wrong size, filter or number", path, r->spp, i);
        seen |= 1u << s->plane;
    }
    if (p != end)
        return base_fail(err, BASE_EINVAL, "%s: %u spp: bytes after the last plane", path, r->spp);
    return 0;
}

/* Which block it is of, and whether that lies in the picture. */
static int parse_place(const struct seq_source *in, const uint8_t *p, struct seq_record *r)
{
    const int64_t x0 = (int32_t)base_get_u32(p + 32), y0 = (int32_t)base_get_u32(p + 36);
    const int64_t x1 = (int32_t)base_get_u32(p + 40), y1 = (int32_t)base_get_u32(p + 44);
    if (x0 < 0 || x0 >= x1 || x1 > in->width || y0 < 0 || y0 >= y1 || y1 > in->height || x1 - x0 > MAX_BLOCK_SIDE ||
        y1 - y0 > MAX_BLOCK_SIDE)
        return 0;
    r->block = base_get_u32(p + 28);
    r->x0 = (int32_t)x0, r->y0 = (int32_t)y0;
    r->width = (uint32_t)(x1 - x0), r->height = (uint32_t)(y1 - y0);
    return 1;
}

int seq_record_parse(const struct seq_source *in, uint32_t index, size_t *at, struct seq_record *r, struct base_err *err)
{
    const uint8_t *p = in->bytes + *at;
    const size_t header = in->version == 1 ? SEQ_RECORD_HEADER : SEQ_LOOK_HEADER, left = in->size - *at;
    if (left < header)
        return base_fail(err, BASE_EINVAL, "%s: truncated: %u of %u images", in->path, index, in->count);
    const uint32_t kind = base_get_u32(p), payload = base_get_u32(p + 20);
    /* Sums come first: what follows may only be trusted to be what was written. */
    if (crc_of(p, header - 4) != base_get_u32(p + header - 4))
        return base_fail(err, BASE_EINVAL, "%s: header of image %u is damaged (CRC)", in->path, index);
    if (left - header < payload)
        return base_fail(err, BASE_EINVAL, "%s: truncated: %u of %u images", in->path, index, in->count);
    *r = (struct seq_record){.kind = (enum seq_kind)kind,
                             .spp = base_get_u32(p + 4),
                             .half_spp = base_get_u32(p + 8),
                             .block = in->id,
                             .x0 = in->x0,
                             .y0 = in->y0,
                             .width = in->width,
                             .height = in->height,
                             .n_stats = base_get_u32(p + 12),
                             .n_planes = base_get_u32(p + 16),
                             .stats = p + header};
    if (crc_of(r->stats, payload) != base_get_u32(p + 24))
        return base_fail(err, BASE_EINVAL, "%s: image at %u spp is damaged (CRC)", in->path, r->spp);
    if (kind < SEQ_LEVEL || kind > (in->version == 1 ? SEQ_REFERENCE : SEQ_BEYOND) || r->spp == 0 || r->half_spp > r->spp ||
        r->n_stats > SEQ_MAX_STATS || (in->version == 1 && r->n_planes < 1) || r->n_planes > SEQ_MAX_PLANES ||
        (size_t)r->n_stats * SEQ_STAT_BYTES > payload || (in->version > 1 && !parse_place(in, p, r)))
        return base_fail(err, BASE_EINVAL, "%s: header of image %u makes no sense", in->path, index);
    *at += header + payload;
    const int rc = check_stats(in->path, r, err);
    return rc ? rc : parse_planes(in->path, r->stats + (size_t)r->n_stats * SEQ_STAT_BYTES, r->stats + payload, r, err);
}

/* NULL: the record has no such plane. */
static const struct seq_plane *find_plane(const struct seq_record *r, enum seq_plane_number plane)
{
    for (uint32_t i = 0; i < r->n_planes; i++)
        if (r->planes[i].plane == (uint32_t)plane)
            return &r->planes[i];
    return NULL;
}

int seq_has(const struct seq_record *r, enum seq_plane_number plane) { return find_plane(r, plane) != NULL; }

double seq_stat(const struct seq_record *r, const char *name)
{
    const uint8_t *p = r->stats;
    for (uint32_t i = 0; i < r->n_stats; i++, p += SEQ_STAT_BYTES)
        if (strcmp((const char *)p, name) == 0)
            return value_of(p);
    return (double)NAN;
}

int seq_inflate(const struct seq_record *r, enum seq_plane_number plane, uint8_t *raw, struct base_err *err)
{
    const struct seq_plane *s = find_plane(r, plane);
    if (!s)
        return base_fail(err, BASE_EINVAL, "block %u at %u spp: plane %d is missing", r->block, r->spp, (int)plane);
    uLongf got = s->raw_bytes;
    uLong used = s->stored_bytes;
    if (uncompress2(raw, &got, s->stored, &used) != Z_OK || got != s->raw_bytes || used != s->stored_bytes)
        return base_fail(err, BASE_EINVAL, "block %u at %u spp: plane %d does not inflate", r->block, r->spp, (int)plane);
    return seq_plane_filter(s->plane, s->filter, raw, r->width, r->height, 1, err);
}

int seq_shown(const struct seq_record *r, enum seq_plane_number plane, float *out, struct base_err *err)
{
    const size_t values = seq_plane_channels((uint32_t)plane) * (size_t)r->width * r->height;
    if (values == 0)
        return base_fail(err, BASE_EINVAL, "plane %d is none of looks", (int)plane);
    uint8_t *raw = malloc(values * sizeof *out);
    int rc = raw ? seq_inflate(r, plane, raw, err) : base_fail_nomem(err, "plane");
    for (size_t i = 0; i < values && !rc; i++)
        out[i] = base_f32_of_bits(base_get_u32(raw + sizeof *out * i));
    free(raw);
    return rc;
}

static int make_room(struct seq_builder *w, size_t more, struct base_err *err)
{
    if (w->room - w->size >= more)
        return 0;
    size_t room = 2 * w->room + more;
    uint8_t *bytes = realloc(w->bytes, room);
    if (!bytes)
        return base_fail_nomem(err, "block sequence");
    w->bytes = bytes;
    w->room = room;
    return 0;
}

int seq_builder_open(struct seq_builder *w, const struct seq_source *what, struct base_err *err)
{
    const uint32_t side = what->version == 1 ? MAX_BLOCK_SIDE : MAX_SIDE;
    if (what->width < 1 || what->width > side || what->height < 1 || what->height > side)
        return base_fail(err, BASE_EINVAL, "%s of %ux%u pixels", what->version == 1 ? "a block" : "a picture", what->width,
                         what->height);
    *w = (struct seq_builder){.width = what->width, .height = what->height};
    int rc = make_room(w, SEQ_FILE_HEADER, err);
    if (rc)
        return rc;
    uint8_t *p = w->bytes;
    memset(p, 0, SEQ_FILE_HEADER);
    memcpy(p, MAGIC, 8);
    base_put_u32(p + 8, what->version);
    base_put_u32(p + 12, SEQ_FILE_HEADER);
    base_put_u32(p + 16, what->width);
    base_put_u32(p + 20, what->height);
    base_put_u32(p + 24, (uint32_t)what->x0);
    base_put_u32(p + 28, (uint32_t)what->y0);
    base_put_u32(p + 32, what->id);
    base_put_u64(p + 40, what->seed);
    w->size = SEQ_FILE_HEADER;
    return 0;
}

int seq_record_begin(struct seq_builder *w, size_t header, const struct seq_stat *stats, uint32_t n_stats, size_t *start,
                     struct base_err *err)
{
    const size_t bytes = header + (size_t)n_stats * SEQ_STAT_BYTES;
    const int rc = make_room(w, bytes, err);
    if (rc)
        return rc;
    uint8_t *p = w->bytes + w->size;
    memset(p, 0, bytes);
    p += header;
    for (uint32_t i = 0; i < n_stats; i++, p += SEQ_STAT_BYTES) {
        uint64_t bits;
        memcpy(p, stats[i].name, strnlen(stats[i].name, SEQ_NAME - 1));
        memcpy(&bits, &stats[i].value, sizeof bits);
        base_put_u64(p + SEQ_NAME, bits);
    }
    *start = w->size;
    w->size += bytes;
    return 0;
}

int seq_record_add(struct seq_builder *w, enum seq_plane_number plane, uint32_t filter, uint8_t *raw, uint32_t width,
                   uint32_t height, struct base_err *err)
{
    /* Noise in floats hardly compresses: the fastest level does, to 2 % of the size of level 6. */
    const int level = seq_plane_channels((uint32_t)plane) ? 1 : 6;
    size_t raw_bytes = seq_plane_raw_bytes((uint32_t)plane, width, height);
    uLongf stored = compressBound(raw_bytes);
    int rc = make_room(w, SEQ_PLANE_HEADER + stored, err);
    if (!rc)
        rc = seq_plane_filter((uint32_t)plane, filter, raw, width, height, 0, err);
    if (rc)
        return rc;
    if (compress2(w->bytes + w->size + SEQ_PLANE_HEADER, &stored, raw, raw_bytes, level) != Z_OK)
        return base_fail_nomem(err, "zlib");
    uint8_t *p = w->bytes + w->size;
    base_put_u32(p, (uint32_t)plane);
    base_put_u32(p + 4, filter);
    base_put_u32(p + 8, (uint32_t)raw_bytes);
    base_put_u32(p + 12, (uint32_t)stored);
    w->size += SEQ_PLANE_HEADER + stored;
    return 0;
}

void seq_record_end(struct seq_builder *w, size_t start, size_t header, const struct seq_record *r)
{
    uint8_t *p = w->bytes + start;
    const size_t payload = w->size - start - header;
    base_put_u32(p, (uint32_t)r->kind);
    base_put_u32(p + 4, r->spp);
    base_put_u32(p + 8, r->half_spp);
    base_put_u32(p + 12, r->n_stats);
    base_put_u32(p + 16, r->n_planes);
    base_put_u32(p + 20, (uint32_t)payload);
    base_put_u32(p + 24, crc_of(p + header, payload));
    if (header == SEQ_LOOK_HEADER) {
        base_put_u32(p + 28, r->block);
        base_put_u32(p + 32, (uint32_t)r->x0);
        base_put_u32(p + 36, (uint32_t)r->y0);
        base_put_u32(p + 40, (uint32_t)r->x0 + r->width);
        base_put_u32(p + 44, (uint32_t)r->y0 + r->height);
    }
    base_put_u32(p + header - 4, crc_of(p, header - 4));
    w->n_records++;
    w->has_reference = r->kind == SEQ_REFERENCE;
}

int seq_builder_write(struct seq_builder *w, const char *path, uint32_t *crc, struct base_err *err)
{
    base_put_u32(w->bytes + 36, w->n_records);
    base_put_u32(w->bytes + 60, crc_of(w->bytes, 60));
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fwrite(w->bytes, 1, w->size, out.file);
    *crc = crc_of(w->bytes, w->size);
    return base_file_commit(&out, err);
}

void seq_builder_release(struct seq_builder *w)
{
    free(w->bytes);
    *w = (struct seq_builder){0};
}
