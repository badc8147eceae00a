#include "sequence/block.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/colour.h"
#include "base/files.h"

/* Record `index` at *at, which is moved past it. */
static int parse_record(const struct seq_source *in, struct seq_block *b, uint32_t index, size_t *at, struct base_err *err)
{
    struct seq_record *r = &b->levels[index];
    int rc = seq_record_parse(in, index, at, r, err);
    if (rc)
        return rc;
    if (r->kind == SEQ_REFERENCE && index + 1 != in->count)
        return base_fail(err, BASE_EINVAL, "%s: header of image %u makes no sense", in->path, index);
    if (r->kind == SEQ_LEVEL && index > 0 && r->spp <= b->levels[index - 1].spp)
        return base_fail(err, BASE_EINVAL, "%s: levels do not rise: %u spp after %u", in->path, r->spp,
                         b->levels[index - 1].spp);
    if (!seq_has(r, SEQ_PLANE_DISPLAY))
        return base_fail(err, BASE_EINVAL, "%s: %u spp: no display image", in->path, r->spp);
    if (r->kind == SEQ_REFERENCE)
        b->reference = r;
    return 0;
}

int seq_block_parse(const char *path, uint8_t *bytes, size_t size, struct seq_block *block, struct base_err *err)
{
    struct seq_source in;
    int rc = seq_source_open(path, bytes, size, 1, &in, err);
    if (rc)
        return rc;
    struct seq_block b = {.width = in.width,
                          .height = in.height,
                          .x0 = in.x0,
                          .y0 = in.y0,
                          .id = in.id,
                          .seed = in.seed,
                          .bytes = bytes,
                          .size = size};
    const uint32_t count = in.count;
    b.levels = calloc(count, sizeof *b.levels);
    if (!b.levels)
        return base_fail_nomem(err, path);
    size_t at = SEQ_FILE_HEADER;
    for (uint32_t i = 0; i < count && !rc; i++)
        rc = parse_record(&in, &b, i, &at, err);
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
    int rc = base_file_read(path, SEQ_MAX_FILE, &bytes, &size, err);
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

int seq_has_halves(const struct seq_record *r) { return seq_has(r, SEQ_PLANE_HALF_LOG) || seq_has(r, SEQ_PLANE_HALF_F16); }

const struct seq_record *seq_full_level(const struct seq_block *b)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (seq_has(&b->levels[i], SEQ_PLANE_HALF_F16))
            return &b->levels[i];
    return NULL;
}

const struct seq_record *seq_level(const struct seq_block *b, uint32_t spp)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (b->levels[i].spp == spp)
            return &b->levels[i];
    return NULL;
}

/* As seq_inflate, into memory that the caller frees; NULL after a failure. */
static int inflate_new(const struct seq_record *r, enum seq_plane_number plane, uint8_t **raw, struct base_err *err)
{
    *raw = malloc(seq_plane_raw_bytes((uint32_t)plane, r->width, r->height));
    int rc = *raw ? seq_inflate(r, plane, *raw, err) : base_fail_nomem(err, "plane");
    if (rc) {
        free(*raw);
        *raw = NULL;
    }
    return rc;
}

int seq_display_planar(const struct seq_block *b, const struct seq_record *r, uint8_t *rgb, struct base_err *err)
{
    (void)b;
    return seq_inflate(r, SEQ_PLANE_DISPLAY, rgb, err);
}

int seq_display(const struct seq_block *b, const struct seq_record *r, uint8_t *rgb, struct base_err *err)
{
    size_t pixels = (size_t)b->width * b->height;
    uint8_t *planar;
    int rc = inflate_new(r, SEQ_PLANE_DISPLAY, &planar, err);
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
    int rc = inflate_new(r, plane, &raw, err);
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
    int rc = inflate_new(r, SEQ_PLANE_DISPLAY, &display, err);
    if (!rc && seq_has(r, SEQ_PLANE_FINE))
        rc = inflate_new(r, SEQ_PLANE_FINE, &fine, err);
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
    int rc = inflate_new(r, SEQ_PLANE_HALF_LOG, &code, err);
    float table[256];
    for (int i = 0; i < 256; i++)
        table[i] = (float)seq_half_log_decode((uint8_t)i);
    for (size_t i = 0; i < (size_t)b->width * b->height && !rc; i++)
        y[i] = table[code[i]];
    free(code);
    return rc;
}

int seq_builder_init(struct seq_builder *w, uint32_t width, uint32_t height, int32_t x0, int32_t y0, uint32_t id,
                     uint64_t seed, struct base_err *err)
{
    const struct seq_source what = {
        .version = 1, .width = width, .height = height, .id = id, .x0 = x0, .y0 = y0, .seed = seed};
    return seq_builder_open(w, &what, err);
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
            rc = seq_record_add(w, planes[i].plane, planes[i].filter, raw, w->width, w->height, err);
            ++*count;
        }
    return rc;
}

int seq_builder_add(struct seq_builder *w, const struct seq_frame *f, struct base_err *err)
{
    if (w->has_reference || w->n_records >= SEQ_MAX_RECORDS || f->n_stats > SEQ_MAX_STATS || f->spp == 0 ||
        !(f->display || f->mean))
        return base_fail(err, BASE_EINVAL, "image at %u spp cannot be added to the sequence", f->spp);
    uint8_t *raw = malloc(6 * (size_t)w->width * w->height);
    if (!raw)
        return base_fail_nomem(err, "plane");
    struct seq_record r = {
        .kind = f->is_reference ? SEQ_REFERENCE : SEQ_LEVEL, .spp = f->spp, .half_spp = f->half_spp, .n_stats = f->n_stats};
    size_t start = w->size;
    int rc = seq_record_begin(w, SEQ_RECORD_HEADER, f->stats, f->n_stats, &start, err);
    if (!rc)
        rc = add_planes(w, f, raw, &r.n_planes, err);
    if (!rc)
        seq_record_end(w, start, SEQ_RECORD_HEADER, &r);
    else
        w->size = start;
    free(raw);
    return rc;
}
