#include "sequence/builder.h"

#include <stdlib.h>
#include <string.h>

#include "base/bytes.h"
#include "base/colour.h"
#include "base/files.h"
#include "sequence/layout.h"

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
    memcpy(p, SEQ_MAGIC, 8);
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
    uint8_t *p = w->bytes + start;
    size_t payload = w->size - start - SEQ_RECORD_HEADER;
    base_put_u32(p, f->is_reference ? SEQ_KIND_REFERENCE : SEQ_KIND_LEVEL);
    base_put_u32(p + 4, f->spp);
    base_put_u32(p + 8, f->half_spp);
    base_put_u32(p + 12, f->n_stats);
    base_put_u32(p + 16, planes);
    base_put_u32(p + 20, (uint32_t)payload);
    base_put_u32(p + 24, seq_crc(p + SEQ_RECORD_HEADER, payload));
    base_put_u32(p + 28, seq_crc(p, 28));
    w->n_records++;
    w->has_reference = f->is_reference != 0;
out:
    free(raw);
    return rc;
}

int seq_builder_write(struct seq_builder *w, const char *path, uint32_t *crc, struct base_err *err)
{
    base_put_u32(w->bytes + 36, w->n_records);
    base_put_u32(w->bytes + 60, seq_crc(w->bytes, 60));
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fwrite(w->bytes, 1, w->size, out.file);
    *crc = seq_crc(w->bytes, w->size);
    return base_file_commit(&out, err);
}
