#include "data/sequence.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <zlib.h>

#include "base/colour.h"
#include "base/files.h"
#include "data/image.h"

enum { FILE_HEADER = 64, RECORD_HEADER = 32, STAT_BYTES = GGN_SEQ_NAME + 8, PLANE_HEADER = 16, KIND_LEVEL = 1, KIND_REFERENCE = 2 };
enum { MAX_FILE = 1 << 30 };
static const char magic[9] = "LULLSEQ1";

static uint32_t get32(const uint8_t *p)
{
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static uint64_t get64(const uint8_t *p)
{
    return get32(p) | (uint64_t)get32(p + 4) << 32;
}

static void put32(uint8_t *p, uint32_t v)
{
    for (int i = 0; i < 4; i++)
        p[i] = (uint8_t)(v >> 8 * i);
}

static void put64(uint8_t *p, uint64_t v)
{
    put32(p, (uint32_t)v);
    put32(p + 4, (uint32_t)(v >> 32));
}

static uint32_t crc_of(const uint8_t *p, size_t n)
{
    return (uint32_t)crc32_z(0, p, n);
}

/* --- reading --- */

static int parse_stats(const char *path, const uint8_t *p, struct ggn_seq_record *r, struct base_err *err)
{
    for (uint32_t i = 0; i < r->n_stats; i++, p += STAT_BYTES) {
        struct ggn_seq_stat *s = &r->stats[i];
        uint64_t bits = get64(p + GGN_SEQ_NAME);
        memcpy(s->name, p, GGN_SEQ_NAME);
        memcpy(&s->value, &bits, sizeof s->value);
        if (!memchr(s->name, 0, GGN_SEQ_NAME) || !isfinite(s->value))
            return base_fail(err, BASE_EINVAL, "%s: %u spp: statistic %u is not usable", path, r->spp, i);
    }
    return 0;
}

static int parse_planes(const char *path, const struct ggn_seq_block *b, const uint8_t *p, const uint8_t *end,
                        struct ggn_seq_record *r, struct base_err *err)
{
    uint32_t seen = 0;
    for (uint32_t i = 0; i < r->n_planes; i++) {
        struct ggn_seq_plane *s = &r->planes[i];
        if (end - p < PLANE_HEADER)
            return base_fail(err, BASE_EINVAL, "%s: %u spp: plane %u is cut short", path, r->spp, i);
        *s = (struct ggn_seq_plane){get32(p), get32(p + 4), get32(p + 8), get32(p + 12), p + PLANE_HEADER};
        p += PLANE_HEADER;
        if ((size_t)(end - p) < s->stored_bytes)
            return base_fail(err, BASE_EINVAL, "%s: %u spp: plane %u is cut short", path, r->spp, i);
        p += s->stored_bytes;
        size_t want = ggn_plane_raw_bytes(s->plane, b->width, b->height);
        if (want == 0)
            continue;
        if (s->raw_bytes != want || (s->filter & ~ggn_plane_filters(s->plane)) != 0 || (seen & 1u << s->plane) != 0)
            return base_fail(err, BASE_EINVAL, "%s: %u spp: plane %u has the wrong size, filter or number", path, r->spp, i);
        seen |= 1u << s->plane;
    }
    if (p != end)
        return base_fail(err, BASE_EINVAL, "%s: %u spp: bytes after the last plane", path, r->spp);
    if ((seen & 1u << GGN_PLANE_DISPLAY) == 0)
        return base_fail(err, BASE_EINVAL, "%s: %u spp: no display image", path, r->spp);
    return 0;
}

/* One record at *at, which is moved past it. */
static int parse_record(const char *path, struct ggn_seq_block *b, uint32_t index, uint32_t count, size_t *at, struct base_err *err)
{
    const uint8_t *p = b->bytes + *at;
    if (b->size - *at < RECORD_HEADER)
        return base_fail(err, BASE_EINVAL, "%s: truncated: %u of %u images", path, index, count);
    uint32_t kind = get32(p), payload = get32(p + 20);
    if (crc_of(p, 28) != get32(p + 28))
        return base_fail(err, BASE_EINVAL, "%s: header of image %u is damaged (CRC)", path, index);
    if (b->size - *at - RECORD_HEADER < payload)
        return base_fail(err, BASE_EINVAL, "%s: truncated: %u of %u images", path, index, count);
    struct ggn_seq_record *r = &b->levels[index];
    *r = (struct ggn_seq_record){.spp = get32(p + 4), .half_spp = get32(p + 8), .n_stats = get32(p + 12), .n_planes = get32(p + 16)};
    p += RECORD_HEADER;
    if (crc_of(p, payload) != get32(p - 8))
        return base_fail(err, BASE_EINVAL, "%s: image at %u spp is damaged (CRC)", path, r->spp);
    if ((kind != KIND_LEVEL && kind != KIND_REFERENCE) || (kind == KIND_REFERENCE && index + 1 != count) || r->spp == 0 ||
        r->half_spp > r->spp || r->n_stats > GGN_SEQ_MAX_STATS || r->n_planes < 1 || r->n_planes > GGN_SEQ_MAX_PLANES ||
        (size_t)r->n_stats * STAT_BYTES > payload) {
        r->n_stats = 0;
        return base_fail(err, BASE_EINVAL, "%s: header of image %u makes no sense", path, index);
    }
    if (kind == KIND_LEVEL && index > 0 && r->spp <= b->levels[index - 1].spp)
        return base_fail(err, BASE_EINVAL, "%s: levels do not rise: %u spp after %u", path, r->spp, b->levels[index - 1].spp);
    if (r->n_stats > 0) {
        r->stats = malloc(r->n_stats * sizeof *r->stats);
        if (!r->stats)
            return base_fail_nomem(err, path);
    }
    int rc = parse_stats(path, p, r, err);
    if (!rc)
        rc = parse_planes(path, b, p + (size_t)r->n_stats * STAT_BYTES, p + payload, r, err);
    if (kind == KIND_REFERENCE)
        b->reference = r;
    *at += RECORD_HEADER + (size_t)payload;
    return rc;
}

static int parse_header(const char *path, const uint8_t *p, size_t size, struct ggn_seq_block *b, uint32_t *count, struct base_err *err)
{
    if (size < FILE_HEADER || memcmp(p, magic, 8) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a block sequence", path);
    if (get32(p + 8) != 1 || get32(p + 12) != FILE_HEADER)
        return base_fail(err, BASE_EINVAL, "%s: version %u of the format is not known", path, get32(p + 8));
    if (crc_of(p, 60) != get32(p + 60))
        return base_fail(err, BASE_EINVAL, "%s: the header is damaged (CRC)", path);
    *b = (struct ggn_seq_block){.width = get32(p + 16), .height = get32(p + 20), .x0 = (int32_t)get32(p + 24),
                                .y0 = (int32_t)get32(p + 28), .id = get32(p + 32), .seed = get64(p + 40)};
    *count = get32(p + 36);
    if (b->width < 1 || b->width > GGN_SEQ_MAX_SIDE || b->height < 1 || b->height > GGN_SEQ_MAX_SIDE || *count < 1 ||
        *count > GGN_SEQ_MAX_RECORDS)
        return base_fail(err, BASE_EINVAL, "%s: a block of %ux%u pixels with %u images", path, b->width, b->height, *count);
    /* Each image takes at least its header: a short file must not make a long table. */
    if (*count > (size - FILE_HEADER) / RECORD_HEADER)
        return base_fail(err, BASE_EINVAL, "%s: truncated: room for fewer than %u images", path, *count);
    return 0;
}

int ggn_seq_block_parse(const char *path, uint8_t *bytes, size_t size, struct ggn_seq_block *block, struct base_err *err)
{
    struct ggn_seq_block b;
    uint32_t count = 0;
    int rc = parse_header(path, bytes, size, &b, &count, err);
    if (rc)
        return rc;
    b.bytes = bytes;
    b.size = size;
    b.levels = calloc(count, sizeof *b.levels);
    if (!b.levels)
        return base_fail_nomem(err, path);
    size_t at = FILE_HEADER;
    for (uint32_t i = 0; i < count && !rc; i++)
        rc = parse_record(path, &b, i, count, &at, err);
    b.n_levels = b.reference ? count - 1 : count;
    if (!rc && at != size)
        rc = base_fail(err, BASE_EINVAL, "%s: bytes after the last image", path);
    if (!rc && b.n_levels == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: a reference but no level", path);
    if (rc) {
        b.bytes = NULL;
        b.n_levels = count;
        b.reference = NULL;
        ggn_seq_block_release(&b);
        return rc;
    }
    *block = b;
    return 0;
}

int ggn_seq_block_read(const char *path, struct ggn_seq_block *block, struct base_err *err)
{
    char *bytes;
    size_t size;
    int rc = base_file_read(path, MAX_FILE, &bytes, &size, err);
    if (rc)
        return rc;
    rc = ggn_seq_block_parse(path, (uint8_t *)bytes, size, block, err);
    if (rc)
        free(bytes);
    return rc;
}

void ggn_seq_block_release(struct ggn_seq_block *block)
{
    uint32_t count = block->n_levels + (block->reference != NULL);
    for (uint32_t i = 0; i < count; i++)
        free(block->levels[i].stats);
    free(block->levels);
    free(block->bytes);
    *block = (struct ggn_seq_block){0};
}

static const struct ggn_seq_plane *find_plane(const struct ggn_seq_record *r, enum ggn_plane plane)
{
    for (uint32_t i = 0; i < r->n_planes; i++)
        if (r->planes[i].plane == (uint32_t)plane)
            return &r->planes[i];
    return NULL;
}

int ggn_seq_has(const struct ggn_seq_record *r, enum ggn_plane plane)
{
    return find_plane(r, plane) != NULL;
}

double ggn_seq_stat(const struct ggn_seq_record *r, const char *name)
{
    for (uint32_t i = 0; i < r->n_stats; i++)
        if (strcmp(r->stats[i].name, name) == 0)
            return r->stats[i].value;
    return (double)NAN;
}

const struct ggn_seq_record *ggn_seq_level(const struct ggn_seq_block *b, uint32_t spp)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (b->levels[i].spp == spp)
            return &b->levels[i];
    return NULL;
}

/* Inflates a plane and undoes its filters. raw has the plane's raw size. */
static int load_plane(const struct ggn_seq_block *b, const struct ggn_seq_record *r, enum ggn_plane plane, uint8_t *raw, struct base_err *err)
{
    const struct ggn_seq_plane *s = find_plane(r, plane);
    if (!s)
        return base_fail(err, BASE_EINVAL, "block %u at %u spp: plane %d is missing", b->id, r->spp, (int)plane);
    uLongf got = s->raw_bytes;
    uLong used = s->stored_bytes;
    if (uncompress2(raw, &got, s->stored, &used) != Z_OK || got != s->raw_bytes || used != s->stored_bytes)
        return base_fail(err, BASE_EINVAL, "block %u at %u spp: plane %d does not inflate", b->id, r->spp, (int)plane);
    return ggn_plane_unfilter(s->plane, s->filter, raw, b->width, b->height, err);
}

/* As load_plane, into memory of its own. NULL on failure. */
static uint8_t *load_plane_new(const struct ggn_seq_block *b, const struct ggn_seq_record *r, enum ggn_plane plane, int *rc, struct base_err *err)
{
    uint8_t *raw = malloc(ggn_plane_raw_bytes((uint32_t)plane, b->width, b->height));
    *rc = raw == NULL ? base_fail_nomem(err, "plane") : load_plane(b, r, plane, raw, err);
    if (!*rc)
        return raw;
    free(raw);
    return NULL;
}

int ggn_seq_display_planar(const struct ggn_seq_block *b, const struct ggn_seq_record *r, uint8_t *rgb, struct base_err *err)
{
    return load_plane(b, r, GGN_PLANE_DISPLAY, rgb, err);
}

int ggn_seq_display(const struct ggn_seq_block *b, const struct ggn_seq_record *r, uint8_t *rgb, struct base_err *err)
{
    int rc;
    size_t pixels = (size_t)b->width * b->height;
    uint8_t *planar = load_plane_new(b, r, GGN_PLANE_DISPLAY, &rc, err);
    if (!planar)
        return rc;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * i + c] = planar[c * pixels + i];
    free(planar);
    return 0;
}

static int load_f16(const struct ggn_seq_block *b, const struct ggn_seq_record *r, enum ggn_plane plane, float *out, struct base_err *err)
{
    int rc;
    size_t n = 3 * (size_t)b->width * b->height;
    uint8_t *raw = load_plane_new(b, r, plane, &rc, err);
    if (!raw)
        return rc;
    for (size_t i = 0; i < n && !rc; i++) {
        out[i] = ggn_half_to_float((uint16_t)(raw[2 * i] | raw[2 * i + 1] << 8));
        if (!isfinite(out[i]))
            rc = base_fail(err, BASE_EINVAL, "block %u at %u spp: a pixel is not finite", b->id, r->spp);
    }
    free(raw);
    return rc;
}

int ggn_seq_mean(const struct ggn_seq_block *b, const struct ggn_seq_record *r, float *rgb, struct base_err *err)
{
    int rc;
    size_t n = 3 * (size_t)b->width * b->height;
    if (ggn_seq_has(r, GGN_PLANE_MEAN_F16))
        return load_f16(b, r, GGN_PLANE_MEAN_F16, rgb, err);
    uint8_t *fine = NULL, *display = load_plane_new(b, r, GGN_PLANE_DISPLAY, &rc, err);
    if (!display)
        return rc;
    if (ggn_seq_has(r, GGN_PLANE_FINE)) {
        fine = load_plane_new(b, r, GGN_PLANE_FINE, &rc, err);
        if (!fine)
            goto out;
    }
    float table[256][8];
    for (int d = 0; d < 256; d++)
        for (int q = 0; q < 8; q++)
            table[d][q] = fine ? (float)ggn_fine_decode((uint8_t)d, (uint8_t)q) : ggn_srgb_table()[d];
    for (size_t i = 0; i < n; i++) {
        uint8_t q = fine ? fine[i] : 0;
        rgb[i] = q < 8 ? table[display[i]][q] : (float)ggn_fine_decode(display[i], q);
    }
out:
    free(fine);
    free(display);
    return rc;
}

int ggn_seq_half(const struct ggn_seq_block *b, const struct ggn_seq_record *r, float *rgb, struct base_err *err)
{
    return load_f16(b, r, GGN_PLANE_HALF_F16, rgb, err);
}

int ggn_seq_half_luminance(const struct ggn_seq_block *b, const struct ggn_seq_record *r, float *y, struct base_err *err)
{
    int rc;
    size_t pixels = (size_t)b->width * b->height;
    if (!ggn_seq_has(r, GGN_PLANE_HALF_F16)) {
        uint8_t *code = load_plane_new(b, r, GGN_PLANE_HALF_LOG, &rc, err);
        if (!code)
            return rc;
        float table[256];
        for (int i = 0; i < 256; i++)
            table[i] = (float)ggn_halflog_decode((uint8_t)i);
        for (size_t i = 0; i < pixels; i++)
            y[i] = table[code[i]];
        free(code);
        return 0;
    }
    float *rgb = malloc(3 * pixels * sizeof *rgb);
    if (!rgb)
        return base_fail_nomem(err, "half buffer");
    rc = load_f16(b, r, GGN_PLANE_HALF_F16, rgb, err);
    for (size_t i = 0; i < pixels && !rc; i++)
        y[i] = (float)base_luminance((double)rgb[i], (double)rgb[pixels + i], (double)rgb[2 * pixels + i]);
    free(rgb);
    return rc;
}

/* --- writing --- */

static int make_room(struct ggn_seq_builder *w, size_t more, struct base_err *err)
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

int ggn_seq_builder_init(struct ggn_seq_builder *w, uint32_t width, uint32_t height, int32_t x0, int32_t y0, uint32_t id,
                         uint64_t seed, struct base_err *err)
{
    if (width < 1 || width > GGN_SEQ_MAX_SIDE || height < 1 || height > GGN_SEQ_MAX_SIDE)
        return base_fail(err, BASE_EINVAL, "a block of %ux%u pixels", width, height);
    *w = (struct ggn_seq_builder){.width = width, .height = height};
    int rc = make_room(w, FILE_HEADER, err);
    if (rc)
        return rc;
    uint8_t *p = w->bytes;
    memset(p, 0, FILE_HEADER);
    memcpy(p, magic, 8);
    put32(p + 8, 1);
    put32(p + 12, FILE_HEADER);
    put32(p + 16, width);
    put32(p + 20, height);
    put32(p + 24, (uint32_t)x0);
    put32(p + 28, (uint32_t)y0);
    put32(p + 32, id);
    put64(p + 40, seed);
    w->size = FILE_HEADER;
    return 0;
}

void ggn_seq_builder_release(struct ggn_seq_builder *w)
{
    free(w->bytes);
    *w = (struct ggn_seq_builder){0};
}

/* Filters raw in place, deflates it to the end of the builder. */
static int add_plane(struct ggn_seq_builder *w, enum ggn_plane plane, uint32_t filter, uint8_t *raw, struct base_err *err)
{
    size_t raw_bytes = ggn_plane_raw_bytes((uint32_t)plane, w->width, w->height);
    uLongf stored = compressBound(raw_bytes);
    int rc = make_room(w, PLANE_HEADER + stored, err);
    if (!rc)
        rc = ggn_plane_filter((uint32_t)plane, filter, raw, w->width, w->height, err);
    if (rc)
        return rc;
    if (compress2(w->bytes + w->size + PLANE_HEADER, &stored, raw, raw_bytes, 6) != Z_OK)
        return base_fail_nomem(err, "zlib");
    uint8_t *p = w->bytes + w->size;
    put32(p, (uint32_t)plane);
    put32(p + 4, filter);
    put32(p + 8, (uint32_t)raw_bytes);
    put32(p + 12, (uint32_t)stored);
    w->size += PLANE_HEADER + stored;
    return 0;
}

/* Each fills raw [6P] from the frame. */
static void code_f16(const float *from, size_t n, uint8_t *raw)
{
    for (size_t i = 0; i < n; i++) {
        uint16_t h = ggn_half_from_float(from[i]);
        raw[2 * i] = (uint8_t)h;
        raw[2 * i + 1] = (uint8_t)(h >> 8);
    }
}

static void code_fine(const struct ggn_seq_frame *f, size_t n, uint8_t *raw)
{
    for (size_t i = 0; i < n; i++)
        raw[i] = ggn_fine_encode(f->display[i], (double)f->mean[i]);
}

static void code_halflog(const float *half, size_t pixels, uint8_t *raw)
{
    for (size_t i = 0; i < pixels; i++)
        raw[i] = ggn_halflog_encode(base_luminance((double)half[i], (double)half[pixels + i], (double)half[2 * pixels + i]));
}

static int add_planes(struct ggn_seq_builder *w, const struct ggn_seq_frame *f, uint8_t *raw, uint32_t *count, struct base_err *err)
{
    size_t pixels = (size_t)w->width * w->height;
    int full = f->full || f->is_reference;
    memcpy(raw, f->display, 3 * pixels);
    int rc = add_plane(w, GGN_PLANE_DISPLAY, GGN_FILTER_AVERAGE | GGN_FILTER_GREEN, raw, err);
    *count = 1;
    if (!rc && f->mean) {
        if (full)
            code_f16(f->mean, 3 * pixels, raw);
        else
            code_fine(f, 3 * pixels, raw);
        rc = add_plane(w, full ? GGN_PLANE_MEAN_F16 : GGN_PLANE_FINE, full ? GGN_FILTER_SHUFFLE : 0, raw, err);
        ++*count;
    }
    if (!rc && f->half) {
        if (full)
            code_f16(f->half, 3 * pixels, raw);
        else
            code_halflog(f->half, pixels, raw);
        rc = add_plane(w, full ? GGN_PLANE_HALF_F16 : GGN_PLANE_HALF_LOG, full ? GGN_FILTER_SHUFFLE : 0, raw, err);
        ++*count;
    }
    return rc;
}

int ggn_seq_builder_add(struct ggn_seq_builder *w, const struct ggn_seq_frame *f, struct base_err *err)
{
    if (w->has_reference || w->n_records >= GGN_SEQ_MAX_RECORDS || f->n_stats > GGN_SEQ_MAX_STATS || f->spp == 0)
        return base_fail(err, BASE_EINVAL, "image at %u spp cannot be added to the sequence", f->spp);
    size_t start = w->size, stats = (size_t)f->n_stats * STAT_BYTES;
    uint8_t *raw = malloc(6 * (size_t)w->width * w->height);
    if (!raw)
        return base_fail_nomem(err, "plane");
    int rc = make_room(w, RECORD_HEADER + stats, err);
    if (rc)
        goto out;
    for (uint32_t i = 0; i < f->n_stats; i++) {
        uint8_t *p = w->bytes + start + RECORD_HEADER + i * STAT_BYTES;
        uint64_t bits;
        memset(p, 0, GGN_SEQ_NAME);
        memcpy(p, f->stats[i].name, strnlen(f->stats[i].name, GGN_SEQ_NAME - 1));
        memcpy(&bits, &f->stats[i].value, sizeof bits);
        put64(p + GGN_SEQ_NAME, bits);
    }
    w->size += RECORD_HEADER + stats;
    uint32_t planes;
    rc = add_planes(w, f, raw, &planes, err);
    if (rc) {
        w->size = start;
        goto out;
    }
    uint8_t *p = w->bytes + start;
    size_t payload = w->size - start - RECORD_HEADER;
    put32(p, f->is_reference ? KIND_REFERENCE : KIND_LEVEL);
    put32(p + 4, f->spp);
    put32(p + 8, f->half_spp);
    put32(p + 12, f->n_stats);
    put32(p + 16, planes);
    put32(p + 20, (uint32_t)payload);
    put32(p + 24, crc_of(p + RECORD_HEADER, payload));
    put32(p + 28, crc_of(p, 28));
    w->n_records++;
    w->has_reference = f->is_reference != 0;
out:
    free(raw);
    return rc;
}

int ggn_seq_builder_write(struct ggn_seq_builder *w, const char *path, uint32_t *crc, struct base_err *err)
{
    put32(w->bytes + 36, w->n_records);
    put32(w->bytes + 60, crc_of(w->bytes, 60));
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fwrite(w->bytes, 1, w->size, out.file);
    *crc = crc_of(w->bytes, w->size);
    return base_file_commit(&out, err);
}
