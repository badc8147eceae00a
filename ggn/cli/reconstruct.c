/* `ggn reconstruct SEQUENCE`: the picture in which each block is taken at its threshold or stop. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/options.h"
#include "cli/commands.h"
#include "picture/image.h"
#include "data/labels.h"
#include "sequence/manifest.h"
#include "data/thresholds.h"
#include "sight/flip.h"
#include "picture/png.h"

struct options {
    const char *dir, *stops, *view, *out, *reference;
    int json;
};

static const char *const pictures[] = {"png", NULL}; /* endings */
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"stops", 's', "FILE", TO(stops), .input = BASE_FILE,
     .help = "stops or thresholds per block: CSV, report JSON or EXR stop map (the sequence's labels)"},
    {"view", 'v', "NAME", TO(view), .help = "row of the CSV"},
    {"output", 'o', "OUT.png", TO(out), .needed = 1, .output = BASE_FILE, .words = pictures, .help = "the picture (needed)"},
    {"reference", 'r', "REF.png", TO(reference), .output = BASE_FILE, .words = pictures, .help = "write the reference too"},
    {"json", 'j', NULL, TO(json), .help = "print the figures as JSON"},
    {0}};

struct picture {
    uint8_t *taken, *reference; /* own; [height][width][3] */
    double samples, worst_flip;
    int blocks, beyond; /* beyond: stops after the last level, which was taken instead */
    uint32_t worst_block;
};

/* The first level that is not below spp, or the last one. */
static const struct seq_record *level_at(const struct seq_block *b, double spp, int *beyond)
{
    for (uint32_t i = 0; i < b->n_levels; i++)
        if (b->levels[i].spp >= spp)
            return &b->levels[i];
    *beyond += 1;
    return &b->levels[b->n_levels - 1];
}

/* rgb: room for the block's pixels, which are pasted into the image. */
static int paste(uint8_t *image, const struct seq_manifest *m, const struct seq_block *b, const struct seq_record *r,
                 uint8_t *rgb, struct base_err *err)
{
    int rc = seq_display(b, r, rgb, err);
    for (uint32_t y = 0; y < b->height && !rc; y++)
        memcpy(image + 3 * (((size_t)b->y0 + y) * m->width + (size_t)b->x0), rgb + 3 * (size_t)y * b->width,
               3 * (size_t)b->width);
    return rc;
}

static int take_block(struct picture *p, const struct seq_manifest *m, const struct seq_block *b, double spp,
                      struct base_err *err)
{
    size_t values = 3 * (size_t)b->width * b->height;
    uint8_t *rgb = malloc(2 * values);
    struct ggn_flip_stats flip = {0};
    if (!rgb)
        return base_fail_nomem(err, "picture");
    const struct seq_record *r = level_at(b, spp, &p->beyond);
    int rc = paste(p->taken, m, b, r, rgb, err);
    if (!rc && b->reference) {
        rc = paste(p->reference, m, b, b->reference, rgb + values, err);
        if (!rc)
            rc = ggn_flip(rgb + values, rgb, (int)b->width, (int)b->height, GGN_FLIP_PPD, NULL, &flip, err);
    }
    if (!rc && flip.mean > p->worst_flip) {
        p->worst_flip = flip.mean;
        p->worst_block = b->id;
    }
    free(rgb);
    p->samples += (double)r->spp;
    p->blocks++;
    return rc;
}

/* Where block `id` stops: from the file of stops or from the labels; NaN if neither knows. */
static double stop_of(const struct ggn_view *stops, const struct ggn_labels *labels, uint32_t id)
{
    if (stops)
        return id < (uint32_t)stops->n ? stops->spp[id] : (double)NAN;
    const struct ggn_label *l = ggn_labels_find(labels, id);
    return l ? l->threshold : (double)NAN;
}

static int build(const struct options *o, const struct seq_manifest *m, const struct ggn_view *stops,
                 const struct ggn_labels *labels, struct picture *p, struct base_err *err)
{
    size_t pixels = (size_t)m->width * m->height;
    int rc = 0;
    if (pixels > PIC_MAX_PIXELS)
        return base_fail(err, BASE_EINVAL, "%s: %ux%u is too large", o->dir, m->width, m->height);
    p->taken = calloc(3, pixels);
    p->reference = calloc(3, pixels);
    if (!p->taken || !p->reference)
        return base_fail_nomem(err, "picture");
    for (uint32_t i = 0; i < m->n_blocks && !rc; i++) {
        struct seq_block b;
        double spp = stop_of(stops, labels, m->blocks[i].id);
        if (isnan(spp))
            return base_fail(err, BASE_EINVAL, "%s: block %u has no stop", o->dir, m->blocks[i].id);
        rc = seq_manifest_read_block(o->dir, m, i, &b, err);
        if (rc)
            break;
        rc = take_block(p, m, &b, spp, err);
        seq_block_release(&b);
    }
    if (!rc && m->n_blocks == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: no finished block in it", o->dir);
    if (!rc)
        rc = pic_write_png(o->out, (int)m->width, (int)m->height, 3, p->taken, err);
    if (!rc && o->reference)
        rc = pic_write_png(o->reference, (int)m->width, (int)m->height, 3, p->reference, err);
    return rc;
}

static int report(const struct options *o, const struct seq_manifest *m, const struct picture *p, struct base_err *err)
{
    struct ggn_flip_stats flip;
    double mean_spp = p->samples / p->blocks;
    if (!m->reference_spp) { /* nothing to compare with */
        if (o->json)
            printf("{\"blocks\": %d, \"mean_spp\": %.2f, \"beyond_last_level\": %d}\n", p->blocks, mean_spp, p->beyond);
        else
            printf("%d blocks, %.1f samples per pixel on average; no reference to compare with%s\n", p->blocks, mean_spp,
                   p->beyond > 0 ? "; some stops lie beyond the last level" : "");
        return 0;
    }
    int rc = ggn_flip(p->reference, p->taken, (int)m->width, (int)m->height, GGN_FLIP_PPD, NULL, &flip, err);
    if (rc)
        return rc;
    if (o->json)
        printf("{\"blocks\": %d, \"mean_spp\": %.2f, \"flip_mean\": %.6f, \"flip_max\": %.6f, \"worst_block\": %u, "
               "\"worst_block_flip\": %.6f, "
               "\"beyond_last_level\": %d}\n",
               p->blocks, mean_spp, flip.mean, flip.max, p->worst_block, p->worst_flip, p->beyond);
    else
        printf("%d blocks, %.1f samples per pixel on average; FLIP mean %.4f, worst block %u with %.4f%s\n", p->blocks,
               mean_spp, flip.mean, p->worst_block, p->worst_flip,
               p->beyond > 0 ? "; some stops lie beyond the last level" : "");
    return 0;
}

int ggn_cmd_reconstruct(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {.list = list,
                                                .args_doc = "SEQUENCE",
                                                .args_min = 1,
                                                .args_max = 1,
                                                .args = offsetof(struct options, dir),
                                                .doc = "Builds the picture in which each block is taken at its threshold "
                                                       "(the first recorded level that is not below it), "
                                                       "for looking at and for figures of quality."};
    struct options o = {0};
    struct seq_manifest m = {0};
    struct ggn_labels labels = {0};
    struct ggn_thresholds stops = {0};
    struct picture p = {0};
    const struct ggn_view *view = NULL;
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc)
        rc = seq_manifest_read(o.dir, &m, err);
    if (!rc && !o.stops)
        rc = ggn_labels_read(o.dir, &labels, err);
    if (!rc && o.stops) {
        rc = ggn_thresholds_read(o.stops, (int[2]){(int)m.block, (int)m.block}, &stops, err);
        view = rc ? NULL : o.view ? ggn_thresholds_of(&stops, o.view) : stops.n == 1 ? &stops.views[0] : NULL;
        if (!rc && !view)
            rc = base_fail(err, BASE_EINVAL, "%s: %s", o.stops,
                           o.view ? "no such view" : "several views: --view NAME chooses one");
        const uint32_t tiles = (m.width + m.block - 1) / m.block * ((m.height + m.block - 1) / m.block);
        if (!rc && (uint32_t)view->n > tiles)
            rc = base_fail(err, BASE_EINVAL, "%s: stops of %d blocks, %s has %u", o.stops, view->n, o.dir, tiles);
    }
    if (!rc && o.reference && !m.reference_spp)
        rc = base_fail(err, BASE_EINVAL, "%s: it was recorded without a reference", o.dir);
    if (!rc)
        rc = build(&o, &m, view, &labels, &p, err);
    if (!rc)
        rc = report(&o, &m, &p, err);
    free(p.taken);
    free(p.reference);
    ggn_thresholds_release(&stops);
    ggn_labels_release(&labels);
    seq_manifest_release(&m);
    return rc;
}
