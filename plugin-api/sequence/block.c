#include "sequence/block.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "base/bytes.h"
#include "base/colour.h"
#include "base/files.h"

enum { MAX_FILE = 1 << 30, KIND_LEVEL = 1, KIND_REFERENCE = 2 };
static const char MAGIC[] = "LULLSEQ1";

static uint32_t crc_of(const uint8_t *bytes, size_t size) { return (uint32_t)crc32_z(0, bytes, size); }

static double value_of(const uint8_t *stat)
{
    const uint64_t bits = base_get_u64(stat + SEQ_NAME);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int check_stats(const char *path, const struct seq_record *r, struct base_err *err)
{
    const uint8_t *p = r->stats;
    for (uint32_t i = 0; i < r->n_stats; i++, p += SEQ_STAT_BYTES)
        if (!memchr(p, 0, SEQ_NAME) || !isfinite(value_of(p)))
            return base_fail(err, BASE_EINVAL, "%s: %u spp: statistic %u is not usable", path, r->spp, i);
    return 0;
}

static int parse_planes(const char *path, const struct seq_block *b, const uint8_t *p, const uint8_t *end,
                        struct seq_record *r, struct base_err *err)
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
        size_t want = seq_plane_raw_bytes(s->plane, b->width, b->height);
        if (want == 0)
            continue;
        if (s->raw_bytes != want || (s->filter & ~seq_plane_filters(s->plane)) != 0 || (seen & 1u << s->plane) != 0)
            return base_fail(err, BASE_EINVAL, "%s: %u spp: plane %u has the wrong size, filter or number", path, r->spp, i);
        seen |= 1u << s->plane;
    }
    if (p != end)
        return base_fail(err, BASE_EINVAL, "%s: %u spp: bytes after the last plane", path, r->spp);
    if ((seen & 1u << SEQ_PLANE_DISPLAY) == 0)
        return base_fail(err, BASE_EINVAL, "%s: %u spp: no display image", path, r->spp);
    return 0;
}

/* One record at *at, which is moved past it. */
static int parse_record(const char *path, struct seq_block *b, uint32_t index, uint32_t count, size_t *at,
                        struct base_err *err)
{
    const uint8_t *p = b->bytes + *at;
    if (b->size - *at < SEQ_RECORD_HEADER)
        return base_fail(err, BASE_EINVAL, "%s: truncated: %u of %u images", path, index, count);
    uint32_t kind = base_get_u32(p), payload = base_get_u32(p + 20);
    /* Sums come first: what follows may only be trusted to be what was written. */
    if (crc_of(p, 28) != base_get_u32(p + 28))
        return base_fail(err, BASE_EINVAL, "%s: header of image %u is damaged (CRC)", path, index);
    if (b->size - *at - SEQ_RECORD_HEADER < payload)
        return base_fail(err, BASE_EINVAL, "%s: truncated: %u of %u images", path, index, count);
    struct seq_record *r = &b->levels[index];
    *r = (struct seq_record){.spp = base_get_u32(p + 4),
                             .half_spp = base_get_u32(p + 8),
                             .n_stats = base_get_u32(p + 12),
                             .n_planes = base_get_u32(p + 16),
                             .stats = p + SEQ_RECORD_HEADER};
    p += SEQ_RECORD_HEADER;
    if (crc_of(p, payload) != base_get_u32(p - 8))
        return base_fail(err, BASE_EINVAL, "%s: image at %u spp is damaged (CRC)", path, r->spp);
    if ((kind != KIND_LEVEL && kind != KIND_REFERENCE) || (kind == KIND_REFERENCE && index + 1 != count) || r->spp == 0 ||
        r->half_spp > r->spp || r->n_stats > SEQ_MAX_STATS || r->n_planes < 1 || r->n_planes > SEQ_MAX_PLANES ||
        (size_t)r->n_stats * SEQ_STAT_BYTES > payload)
        return base_fail(err, BASE_EINVAL, "%s: header of image %u makes no sense", path, index);
    if (kind == KIND_LEVEL && index > 0 && r->spp <= b->levels[index - 1].spp)
        return base_fail(err, BASE_EINVAL, "%s: levels do not rise: %u spp after %u", path, r->spp,
                         b->levels[index - 1].spp);
    int rc = check_stats(path, r, err);
    if (!rc)
        rc = parse_planes(path, b, p + (size_t)r->n_stats * SEQ_STAT_BYTES, p + payload, r, err);
    if (kind == KIND_REFERENCE)
        b->reference = r;
    *at += SEQ_RECORD_HEADER + (size_t)payload;
    return rc;
}

static int parse_header(const char *path, const uint8_t *p, size_t size, struct seq_block *b, uint32_t *count,
                        struct base_err *err)
{
    if (size < SEQ_FILE_HEADER || memcmp(p, MAGIC, 8) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a block sequence", path);
    if (base_get_u32(p + 8) != 1 || base_get_u32(p + 12) != SEQ_FILE_HEADER)
        return base_fail(err, BASE_EINVAL, "%s: version %u of the format is not known", path, base_get_u32(p + 8));
    if (crc_of(p, 60) != base_get_u32(p + 60))
        return base_fail(err, BASE_EINVAL, "%s: the header is damaged (CRC)", path);
    *b = (struct seq_block){.width = base_get_u32(p + 16),
                            .height = base_get_u32(p + 20),
                            .x0 = (int32_t)base_get_u32(p + 24),
                            .y0 = (int32_t)base_get_u32(p + 28),
                            .id = base_get_u32(p + 32),
                            .seed = base_get_u64(p + 40)};
    *count = base_get_u32(p + 36);
    if (b->width < 1 || b->width > SEQ_MAX_SIDE || b->height < 1 || b->height > SEQ_MAX_SIDE || *count < 1 ||
        *count > SEQ_MAX_RECORDS)
        return base_fail(err, BASE_EINVAL, "%s: a block of %ux%u pixels with %u images", path, b->width, b->height, *count);
    /* Each image takes at least its header: a short file must not make a long table. */
    if (*count > (size - SEQ_FILE_HEADER) / SEQ_RECORD_HEADER)
        return base_fail(err, BASE_EINVAL, "%s: truncated: room for fewer than %u images", path, *count);
    return 0;
}

int seq_block_parse(const char *path, uint8_t *bytes, size_t size, struct seq_block *block, struct base_err *err)
{
    struct seq_block b;
    uint32_t count = 0;
    int rc = parse_header(path, bytes, size, &b, &count, err);
    if (rc)
        return rc;
    b.bytes = bytes;
    b.size = size;
    b.levels = calloc(count, sizeof *b.levels);
    if (!b.levels)
        return base_fail_nomem(err, path);
    size_t at = SEQ_FILE_HEADER;
    for (uint32_t i = 0; i < count && !rc; i++)
        rc = parse_record(path, &b, i, count, &at, err);
    b.n_levels = b.reference ? count - 1 : count;
    if (!rc && at != size)
        rc = base_fail(err, BASE_EINVAL, "%s: bytes after the last image", path);
    if (!rc && b.n_levels == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: a reference but no level", path);
    if (rc)
        free(b.levels);
    else
        *block = b;
    return rc;
}

int seq_block_read(const char *path, struct seq_block *block, struct base_err *err)
{
    char *bytes;
    size_t size;
    int rc = base_file_read(path, MAX_FILE, &bytes, &size, err);
    if (rc)
        return rc;
    rc = seq_block_parse(path, (uint8_t *)bytes, size, block, err);
    if (rc)
        free(bytes);
    return rc;
}

void seq_block_release(struct seq_block *block)
{
    free(block->levels);
    free(block->bytes);
    *block = (struct seq_block){0};
}

static const struct seq_plane *find_plane(const struct seq_record *r, enum seq_plane_number plane)
{
    for (uint32_t i = 0; i < r->n_planes; i++)
        if (r->planes[i].plane == (uint32_t)plane)
            return &r->planes[i];
    return NULL;
}

int seq_has(const struct seq_record *r, enum seq_plane_number plane) { return find_plane(r, plane) != NULL; }

int seq_has_halves(const struct seq_record *r) { return seq_has(r, SEQ_PLANE_HALF_LOG) || seq_has(r, SEQ_PLANE_HALF_F16); }

const struct seq_record *seq_full_level(const struct seq_block *b)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (seq_has(&b->levels[i], SEQ_PLANE_HALF_F16))
            return &b->levels[i];
    return NULL;
}

double seq_stat(const struct seq_record *r, const char *name)
{
    const uint8_t *p = r->stats;
    for (uint32_t i = 0; i < r->n_stats; i++, p += SEQ_STAT_BYTES)
        if (strcmp((const char *)p, name) == 0)
            return value_of(p);
    return (double)NAN;
}

const struct seq_record *seq_level(const struct seq_block *b, uint32_t spp)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (b->levels[i].spp == spp)
            return &b->levels[i];
    return NULL;
}

/* Inflates a plane and undoes its filters. raw has the plane's raw size. */
static int load_plane(const struct seq_block *b, const struct seq_record *r, enum seq_plane_number plane, uint8_t *raw,
                      struct base_err *err)
{
    const struct seq_plane *s = find_plane(r, plane);
    if (!s)
        return base_fail(err, BASE_EINVAL, "block %u at %u spp: plane %d is missing", b->id, r->spp, (int)plane);
    uLongf got = s->raw_bytes;
    uLong used = s->stored_bytes;
    if (uncompress2(raw, &got, s->stored, &used) != Z_OK || got != s->raw_bytes || used != s->stored_bytes)
        return base_fail(err, BASE_EINVAL, "block %u at %u spp: plane %d does not inflate", b->id, r->spp, (int)plane);
    return seq_plane_filter(s->plane, s->filter, raw, b->width, b->height, 1, err);
}

/* As load_plane, into memory that the caller frees; NULL after a failure. */
static int load_plane_new(const struct seq_block *b, const struct seq_record *r, enum seq_plane_number plane, uint8_t **raw,
                          struct base_err *err)
{
    *raw = malloc(seq_plane_raw_bytes((uint32_t)plane, b->width, b->height));
    int rc = *raw ? load_plane(b, r, plane, *raw, err) : base_fail_nomem(err, "plane");
    if (rc) {
        free(*raw);
        *raw = NULL;
    }
    return rc;
}

int seq_display_planar(const struct seq_block *b, const struct seq_record *r, uint8_t *rgb, struct base_err *err)
{
    return load_plane(b, r, SEQ_PLANE_DISPLAY, rgb, err);
}

int seq_display(const struct seq_block *b, const struct seq_record *r, uint8_t *rgb, struct base_err *err)
{
    size_t pixels = (size_t)b->width * b->height;
    uint8_t *planar;
    int rc = load_plane_new(b, r, SEQ_PLANE_DISPLAY, &planar, err);
    for (size_t i = 0; i < pixels && !rc; i++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * i + c] = planar[c * pixels + i];
    free(planar);
    return rc;
}

static int load_f16(const struct seq_block *b, const struct seq_record *r, enum seq_plane_number plane, float *out,
                    struct base_err *err)
{
    size_t n = 3 * (size_t)b->width * b->height;
    uint8_t *raw;
    int rc = load_plane_new(b, r, plane, &raw, err);
    for (size_t i = 0; i < n && !rc; i++) {
        out[i] = base_f16_to_f32((uint16_t)(raw[2 * i] | raw[2 * i + 1] << 8));
        if (!isfinite(out[i]))
            rc = base_fail(err, BASE_EINVAL, "block %u at %u spp: a pixel is not finite", b->id, r->spp);
    }
    free(raw);
    return rc;
}

int seq_mean(const struct seq_block *b, const struct seq_record *r, float *rgb, struct base_err *err)
{
    size_t n = 3 * (size_t)b->width * b->height;
    if (seq_has(r, SEQ_PLANE_MEAN_F16))
        return load_f16(b, r, SEQ_PLANE_MEAN_F16, rgb, err);
    uint8_t *fine = NULL, *display;
    int rc = load_plane_new(b, r, SEQ_PLANE_DISPLAY, &display, err);
    if (!rc && seq_has(r, SEQ_PLANE_FINE))
        rc = load_plane_new(b, r, SEQ_PLANE_FINE, &fine, err);
    float table[256][8];
    for (int d = 0; d < 256; d++)
        for (int q = 0; q < 8; q++)
            table[d][q] = (float)(fine ? seq_fine_decode((uint8_t)d, (uint8_t)q) : base_srgb_linear[d]);
    for (size_t i = 0; i < n && !rc; i++) {
        uint8_t q = fine ? fine[i] : 0;
        rgb[i] = q < 8 ? table[display[i]][q] : (float)seq_fine_decode(display[i], q);
    }
    free(fine);
    free(display);
    return rc;
}

int seq_half(const struct seq_block *b, const struct seq_record *r, float *rgb, struct base_err *err)
{
    return load_f16(b, r, SEQ_PLANE_HALF_F16, rgb, err);
}

/* Luminance of what `read` gives of a record. */
static int read_luminance(int (*read)(const struct seq_block *, const struct seq_record *, float *, struct base_err *),
                          const struct seq_block *b, const struct seq_record *r, float *y, struct base_err *err)
{
    size_t pixels = (size_t)b->width * b->height;
    float *rgb = malloc(3 * pixels * sizeof *rgb);
    int rc = rgb ? read(b, r, rgb, err) : base_fail_nomem(err, "luminance");
    for (size_t i = 0; i < pixels && !rc; i++)
        y[i] = (float)base_luminance((double)rgb[i], (double)rgb[pixels + i], (double)rgb[2 * pixels + i]);
    free(rgb);
    return rc;
}

int seq_mean_luminance(const struct seq_block *b, const struct seq_record *r, float *y, struct base_err *err)
{
    return read_luminance(seq_mean, b, r, y, err);
}

int seq_half_luminance(const struct seq_block *b, const struct seq_record *r, float *y, struct base_err *err)
{
    if (seq_has(r, SEQ_PLANE_HALF_F16))
        return read_luminance(seq_half, b, r, y, err);
    uint8_t *code;
    int rc = load_plane_new(b, r, SEQ_PLANE_HALF_LOG, &code, err);
    float table[256];
    for (int i = 0; i < 256; i++)
        table[i] = (float)seq_half_log_decode((uint8_t)i);
    for (size_t i = 0; i < (size_t)b->width * b->height && !rc; i++)
        y[i] = table[code[i]];
    free(code);
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

int seq_builder_init(struct seq_builder *w, uint32_t width, uint32_t height, int32_t x0, int32_t y0, uint32_t id,
                     uint64_t seed, struct base_err *err)
{
    if (width < 1 || width > SEQ_MAX_SIDE || height < 1 || height > SEQ_MAX_SIDE)
        return base_fail(err, BASE_EINVAL, "a block of %ux%u pixels", width, height);
    *w = (struct seq_builder){.width = width, .height = height};
    int rc = make_room(w, SEQ_FILE_HEADER, err);
    if (rc)
        return rc;
    uint8_t *p = w->bytes;
    memset(p, 0, SEQ_FILE_HEADER);
    memcpy(p, MAGIC, 8);
    base_put_u32(p + 8, 1);
    base_put_u32(p + 12, SEQ_FILE_HEADER);
    base_put_u32(p + 16, width);
    base_put_u32(p + 20, height);
    base_put_u32(p + 24, (uint32_t)x0);
    base_put_u32(p + 28, (uint32_t)y0);
    base_put_u32(p + 32, id);
    base_put_u64(p + 40, seed);
    w->size = SEQ_FILE_HEADER;
    return 0;
}

void seq_builder_release(struct seq_builder *w)
{
    free(w->bytes);
    *w = (struct seq_builder){0};
}

/* Filters raw in place, deflates it to the end of the builder. */
static int add_plane(struct seq_builder *w, enum seq_plane_number plane, uint32_t filter, uint8_t *raw, struct base_err *err)
{
    size_t raw_bytes = seq_plane_raw_bytes((uint32_t)plane, w->width, w->height);
    uLongf stored = compressBound(raw_bytes);
    int rc = make_room(w, SEQ_PLANE_HEADER + stored, err);
    if (!rc)
        rc = seq_plane_filter((uint32_t)plane, filter, raw, w->width, w->height, 0, err);
    if (rc)
        return rc;
    if (compress2(w->bytes + w->size + SEQ_PLANE_HEADER, &stored, raw, raw_bytes, 6) != Z_OK)
        return base_fail_nomem(err, "zlib");
    uint8_t *p = w->bytes + w->size;
    base_put_u32(p, (uint32_t)plane);
    base_put_u32(p + 4, filter);
    base_put_u32(p + 8, (uint32_t)raw_bytes);
    base_put_u32(p + 12, (uint32_t)stored);
    w->size += SEQ_PLANE_HEADER + stored;
    return 0;
}

/* Fills raw [6P] from planar values. */
static void code_plane(const struct seq_frame *f, enum seq_plane_number plane, size_t pixels, uint8_t *raw)
{
    const double *half = f->half, *light = plane == SEQ_PLANE_HALF_F16 ? half : f->mean;
    for (size_t i = 0; i < (plane == SEQ_PLANE_HALF_LOG ? pixels : 3 * pixels); i++)
        switch (plane) {
        case SEQ_PLANE_DISPLAY: raw[i] = f->display ? f->display[i] : base_srgb_code(f->mean[i]); break;
        case SEQ_PLANE_FINE:
            raw[i] = seq_fine_encode(f->display ? f->display[i] : base_srgb_code(f->mean[i]), f->mean[i]);
            break;
        case SEQ_PLANE_HALF_LOG:
            raw[i] = seq_half_log_encode(base_luminance(half[i], half[pixels + i], half[2 * pixels + i]));
            break;
        default: raw[2 * i] = (uint8_t)seq_half_float(light[i]); raw[2 * i + 1] = (uint8_t)(seq_half_float(light[i]) >> 8);
        }
}

static int add_planes(struct seq_builder *w, const struct seq_frame *f, uint8_t *raw, uint32_t *count, struct base_err *err)
{
    const int full = f->full || f->is_reference;
    const struct {
        int is_there;
        enum seq_plane_number plane;
        uint32_t filter;
    } planes[] = {{1, SEQ_PLANE_DISPLAY, SEQ_FILTER_AVERAGE | SEQ_FILTER_GREEN},
                  {f->mean != NULL, full ? SEQ_PLANE_MEAN_F16 : SEQ_PLANE_FINE, full ? SEQ_FILTER_SHUFFLE : 0},
                  {f->half != NULL, full ? SEQ_PLANE_HALF_F16 : SEQ_PLANE_HALF_LOG, full ? SEQ_FILTER_SHUFFLE : 0}};
    int rc = 0;
    *count = 0;
    for (int i = 0; i < 3 && !rc; i++)
        if (planes[i].is_there) {
            code_plane(f, planes[i].plane, (size_t)w->width * w->height, raw);
            rc = add_plane(w, planes[i].plane, planes[i].filter, raw, err);
            ++*count;
        }
    return rc;
}

/* Statistics in the form of the file. */
static void put_stats(const struct seq_frame *f, uint8_t *p)
{
    for (uint32_t i = 0; i < f->n_stats; i++, p += SEQ_STAT_BYTES) {
        uint64_t bits;
        memset(p, 0, SEQ_NAME);
        memcpy(p, f->stats[i].name, strnlen(f->stats[i].name, SEQ_NAME - 1));
        memcpy(&bits, &f->stats[i].value, sizeof bits);
        base_put_u64(p + SEQ_NAME, bits);
    }
}

int seq_builder_add(struct seq_builder *w, const struct seq_frame *f, struct base_err *err)
{
    if (w->has_reference || w->n_records >= SEQ_MAX_RECORDS || f->n_stats > SEQ_MAX_STATS || f->spp == 0 ||
        !(f->display || f->mean))
        return base_fail(err, BASE_EINVAL, "image at %u spp cannot be added to the sequence", f->spp);
    size_t start = w->size, stats = (size_t)f->n_stats * SEQ_STAT_BYTES;
    uint8_t *raw = malloc(6 * (size_t)w->width * w->height);
    if (!raw)
        return base_fail_nomem(err, "plane");
    int rc = make_room(w, SEQ_RECORD_HEADER + stats, err);
    if (rc)
        goto out;
    put_stats(f, w->bytes + start + SEQ_RECORD_HEADER);
    w->size += SEQ_RECORD_HEADER + stats;
    uint32_t planes;
    rc = add_planes(w, f, raw, &planes, err);
    if (rc) {
        w->size = start;
        goto out;
    }
    /* the header last: it has the size and the checksum of what follows it */
    uint8_t *p = w->bytes + start;
    size_t payload = w->size - start - SEQ_RECORD_HEADER;
    base_put_u32(p, f->is_reference ? KIND_REFERENCE : KIND_LEVEL);
    base_put_u32(p + 4, f->spp);
    base_put_u32(p + 8, f->half_spp);
    base_put_u32(p + 12, f->n_stats);
    base_put_u32(p + 16, planes);
    base_put_u32(p + 20, (uint32_t)payload);
    base_put_u32(p + 24, crc_of(p + SEQ_RECORD_HEADER, payload));
    base_put_u32(p + 28, crc_of(p, 28));
    w->n_records++;
    w->has_reference = f->is_reference != 0;
out:
    free(raw);
    return rc;
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
