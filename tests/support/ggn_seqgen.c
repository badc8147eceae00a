#include "base/colour.h"
#include "ggn_seqgen.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "data/labels.h"
#include "sequence/manifest.h"
#include "sight/preprocess.h"
#include "nn/hash.h"

enum { MAX_LEVELS = 64 };

struct seqgen seqgen_default(void)
{
    return (struct seqgen){.side = 40,
                           .scenes = 4,
                           .validation = 1,
                           .blocks = 3,
                           .first = 10,
                           .ratio = 1.35,
                           .levels = 14,
                           .reference_spp = 4096,
                           .tau = 0.012,
                           .seed = 4};
}

struct pixels {
    size_t n;             /* 3·side² */
    float *clean, *sigma; /* linear; standard deviation of one sample */
    float *sum, *half;    /* of the samples so far, of the first half of each step */
    double *mean, *difference;
    uint8_t *display;
};

static int pixels_init(struct pixels *p, int side)
{
    float **const parts[] = {&p->clean, &p->sigma, &p->sum, &p->half};

    p->n = 3 * (size_t)side * (size_t)side;
    float *all = calloc(4 * p->n, sizeof *all);
    p->mean = calloc(2 * p->n, sizeof *p->mean);
    p->difference = p->mean ? p->mean + p->n : NULL;
    p->display = malloc(p->n);
    for (size_t i = 0; i < 4; i++)
        *parts[i] = all ? all + i * p->n : NULL;
    return all && p->mean && p->display;
}

static void pixels_release(struct pixels *p)
{
    free(p->clean);
    free(p->mean);
    free(p->display);
}

/* Two waves over a ramp in the scene's colour; noise grows towards one corner, differently in each block. */
static void paint(const struct seqgen *g, struct pixels *p, int scene, int block)
{
    uint32_t seed = ggn_hash((uint32_t)(scene * 16 + block), g->seed);
    double level = 0.15 + 0.5 * ggn_hash_unit(1, seed), wave = 0.02 + 0.5 * ggn_hash_unit(2, seed);
    double fx = 0.1 + ggn_hash_unit(3, seed), fy = 0.1 + ggn_hash_unit(4, seed);
    double noise = 0.1 * exp2(2 * ggn_hash_unit(5, seed));
    size_t plane = p->n / 3;

    for (size_t i = 0; i < p->n; i++) {
        double x = (double)(i % plane % (size_t)g->side), y = (double)(i % plane / (size_t)g->side);
        double tint = 0.6 + 0.4 * ggn_hash_unit((uint32_t)(i / plane) + 10, seed);
        double v = level * tint * (1 + wave * sin(fx * x + fy * y) + 0.3 * (x - y) / g->side);
        p->clean[i] = (float)fmax(v, 0.01);
        p->sigma[i] = (float)(noise * sqrt(fmax(v, 0.01)) * (0.5 + (x + y) / (2.0 * g->side)));
    }
    memset(p->sum, 0, p->n * sizeof *p->sum);
    memset(p->half, 0, p->n * sizeof *p->half);
}

/* About normal: the sum of four uniforms, scaled. */
static double normal(uint32_t k, uint32_t seed)
{
    double sum = -2;

    for (uint32_t i = 0; i < 4; i++)
        sum += ggn_hash_unit(4 * k + i, seed);
    return sum * sqrt(3);
}

/* Adds `count` samples, half of them to half A; the pixel's channels share half of their noise. */
static void accumulate(struct pixels *p, double count, uint32_t seed)
{
    size_t plane = p->n / 3;

    for (size_t i = 0; i < p->n; i++)
        for (uint32_t side = 0; side < 2; side++) {
            double z =
                0.7071 * (normal((uint32_t)(i % plane), seed + side) + normal((uint32_t)(i + plane), seed + 7 + side));
            float s = (float)(0.5 * count * (double)p->clean[i] + sqrt(0.5 * count) * (double)p->sigma[i] * z);
            p->sum[i] += s;
            p->half[i] += side ? 0 : s;
        }
}

static void develop(struct pixels *p, double spp)
{
    for (size_t i = 0; i < p->n; i++) {
        p->mean[i] = (double)p->sum[i] / spp;
        p->difference[i] = (double)p->half[i] / (0.5 * spp) - p->mean[i];
        p->display[i] = ggn_preprocess(p->mean[i], NULL, NULL);
    }
}

/* Samples at which the display noise falls to tau: its variance per sample, from finite differences of the transfer curve. */
static double threshold_of(const struct seqgen *g, const struct pixels *p)
{
    double sum = 0;

    for (size_t i = 0; i < p->n; i++) {
        double x = (double)p->clean[i], slope = (base_srgb_oetf(x + 1e-4) - base_srgb_oetf(x - 1e-4)) / 2e-4;
        sum += (double)p->sigma[i] * (double)p->sigma[i] * slope * slope;
    }
    return fmax(sum / (double)p->n / (g->tau * g->tau), 1);
}

static int write_block(const struct seqgen *g, struct pixels *p, const char *dir, int scene, int block,
                       struct seq_manifest_block *b, const uint32_t *levels, struct base_err *err)
{
    struct seq_builder w;
    char path[4200];
    uint32_t seed = ggn_hash((uint32_t)(1000 * scene + block), g->seed + 1), done = 0;
    int full = 0,
        rc = seq_builder_init(&w, (uint32_t)g->side, (uint32_t)g->side, block * g->side, 0, (uint32_t)block, g->seed, err);

    for (int i = 0; !rc && i < g->levels; i++) {
        accumulate(p, levels[i] - done, ggn_hash((uint32_t)i, seed));
        done = levels[i];
        develop(p, done);
        int is_full = !full && (done >= 320 || i == g->levels - 1);
        struct seq_frame frame = {.spp = done,
                                  .half_spp = done / 2,
                                  .full = is_full,
                                  .display = p->display,
                                  .mean = is_full ? p->mean : NULL,
                                  .half = is_full ? p->difference : NULL};
        full |= is_full;
        rc = seq_builder_add(&w, &frame, err);
    }
    if (!rc && g->reference_spp) {
        memset(p->sum, 0, p->n * sizeof *p->sum);
        memset(p->half, 0, p->n * sizeof *p->half);
        accumulate(p, g->reference_spp, ggn_hash(99, seed));
        develop(p, g->reference_spp);
        struct seq_frame frame = {
            .spp = g->reference_spp, .is_reference = 1, .full = 1, .display = p->display, .mean = p->mean};
        rc = seq_builder_add(&w, &frame, err);
    }
    *b = (struct seq_manifest_block){.id = (uint32_t)block,
                                     .x0 = (uint32_t)(block * g->side),
                                     .x1 = (uint32_t)((block + 1) * g->side),
                                     .y1 = (uint32_t)g->side,
                                     .bytes = w.size};
    snprintf(b->file, sizeof b->file, "block-%05d.lseq", block);
    snprintf(path, sizeof path, "%s/%s", dir, b->file);
    if (!rc)
        rc = seq_builder_write(&w, path, &b->crc32, err);
    b->bytes = w.size;
    seq_builder_release(&w);
    return rc;
}

static int write_scene(const struct seqgen *g, struct pixels *p, const char *dir, int scene, struct base_err *err)
{
    uint32_t levels[MAX_LEVELS];
    struct seq_manifest_block blocks[64];
    struct ggn_label label[64];
    struct seq_manifest m = {.width = (uint32_t)(g->side * g->blocks),
                             .height = (uint32_t)g->side,
                             .block = (uint32_t)g->side,
                             .seed = g->seed,
                             .reference_seed = g->seed + 1,
                             .reference_spp = g->reference_spp,
                             .reference_independent = 1,
                             .n_levels = (uint32_t)g->levels,
                             .n_blocks = (uint32_t)g->blocks,
                             .levels = levels,
                             .blocks = blocks};
    struct ggn_labels labels = {.source = "observer",
                                .detail = "generated: noise below a fixed rms",
                                .cap = 0,
                                .spread = 0.15,
                                .n = (uint32_t)g->blocks,
                                .labels = label};
    int rc = 0;

    snprintf(m.scene, sizeof m.scene, "scene%d", scene);
    snprintf(m.source, sizeof m.source, "generated");
    snprintf(m.camera, sizeof m.camera, "view0");
    snprintf(m.renderer, sizeof m.renderer, "tests/support/ggn_seqgen.c");
    for (int i = 0; i < g->levels; i++)
        levels[i] = (uint32_t)(2 * floor(g->first * pow(g->ratio, i) / 2 + 0.5));
    for (int b = 0; !rc && b < g->blocks; b++) {
        paint(g, p, scene, b);
        double t = threshold_of(g, p), cap = levels[g->levels - 1];
        label[b] = (struct ggn_label){.id = (uint32_t)b, .threshold = fmin(t, cap), .censored = t >= cap};
        rc = write_block(g, p, dir, scene, b, &blocks[b], levels, err);
    }
    labels.cap = levels[g->levels - 1];
    if (!rc)
        rc = ggn_labels_write(dir, &labels, 1, err);
    return rc ? rc : seq_manifest_write(dir, &m, err);
}

int seqgen_write(const char *dir, const struct seqgen *g, struct base_err *err)
{
    struct pixels p = {0};
    struct base_file_out out;
    char path[4096];
    int rc = pixels_init(&p, g->side) && g->levels <= MAX_LEVELS && g->blocks <= 64 ? 0 : base_fail_nomem(err, dir);

    mkdir(dir, 0777);
    for (int s = 0; !rc && s < g->scenes; s++) {
        snprintf(path, sizeof path, "%s/scene%d", dir, s);
        mkdir(path, 0777);
        rc = write_scene(g, &p, path, s, err);
    }
    pixels_release(&p);
    if (rc)
        return rc;
    snprintf(path, sizeof path, "%s/split.json", dir);
    rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    static const char *const names[] = {"train", "validation", "test"};
    const int end[] = {g->scenes - g->validation - g->test, g->scenes - g->test, g->scenes};
    for (int k = 0, s = 0; k < 3; k++) {
        fprintf(out.file, "%s\"%s\": [", k ? ", " : "{ ", names[k]);
        for (int first = s; s < end[k]; s++)
            fprintf(out.file, "%s\"scene%d\"", s > first ? ", " : "", s);
        fputs("]", out.file);
    }
    fputs(" }\n", out.file);
    return base_file_commit(&out, err);
}

/* --- of a group of tests --- */

char seqgen_dir[64];

int seqgen_make(void **state)
{
    struct seqgen g = seqgen_default();
    struct base_err err = {0};

    snprintf(seqgen_dir, sizeof seqgen_dir, "/tmp/ggn_train.%ld", (long)getpid());
    (void)state;
    return seqgen_write(seqgen_dir, &g, &err);
}

int seqgen_remove(void **state)
{
    char command[128];

    snprintf(command, sizeof command, "rm -r %s", seqgen_dir);
    (void)state;
    return system(command);
}

void seqgen_load(struct ggn_series_set *set, double ratio)
{
    struct ggn_series_set_options o = {.dir = seqgen_dir, .ratio = ratio};
    struct base_err err = {0};

    if (ggn_series_set_load(set, &o, &err))
        fail_msg("%s", err.text);
}
