#include "support/ggn_noise.h"

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <setjmp.h>
#include <cmocka.h>

#include "data/labels.h"
#include "sequence/manifest.h"
#include "sight/preprocess.h"

uint32_t ggn_noise_hash(uint32_t k, uint32_t s)
{
    uint32_t h = k + s * 0x9E3779B9u;
    h ^= h >> 16;
    h *= 0x7feb352du;
    h ^= h >> 15;
    h *= 0x846ca68bu;
    return h ^ h >> 16;
}

double ggn_noise_gauss(uint32_t k, uint32_t s)
{
    double u = (ggn_noise_hash(k, s) + 0.5) / 4294967296.0, v = (ggn_noise_hash(k, s + 7919) + 0.5) / 4294967296.0;
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586 * v);
}

static double truth(const struct ggn_noise *n, uint32_t pixel, uint32_t c)
{
    uint32_t x = pixel % n->width, y = pixel / n->width;
    return 0.4 + 0.1 * c + 0.1 * sin(0.05 * x + 0.04 * y) + n->texture * ((ggn_noise_hash(pixel, 99) & 1) ? 1.0 : -1.0);
}

/* The film of one block: sums of the two halves. */
struct film {
    double *sum[2]; /* [3P] */
    uint32_t spp;
};

static void add_samples(struct film *f, const struct ggn_noise *n, uint32_t spp, uint32_t salt)
{
    uint32_t pixels = n->width * n->height;
    double more = 0.5 * (spp - f->spp);
    for (uint32_t p = 0; p < pixels; p++)
        for (uint32_t side = 0; side < 2; side++) {
            double noise = n->sigma * sqrt(more) * ggn_noise_gauss(p, n->seed * 1000 + salt + side * 5);
            for (uint32_t c = 0; c < 3; c++)
                f->sum[side][c * pixels + p] += more * truth(n, p, c) + noise;
        }
    f->spp = spp;
}

static void add_frame(struct seq_builder *w, const struct film *f, const struct ggn_noise *n, int is_reference, int full)
{
    uint32_t values = 3 * n->width * n->height, pixels = values / 3;
    double *mean = malloc(values * sizeof *mean), *half = malloc(values * sizeof *half);
    uint8_t *display = malloc(values);
    double dammertz = 0.0, rse = 0.0;
    assert_true(mean && half && display);
    for (uint32_t i = 0; i < values; i++) {
        mean[i] = (f->sum[0][i] + f->sum[1][i]) / f->spp;
        half[i] = (f->sum[0][i] - f->sum[1][i]) / f->spp;
        display[i] = ggn_preprocess(mean[i], NULL, NULL);
    }
    for (uint32_t p = 0; p < pixels; p++) {
        double total = mean[p] + mean[pixels + p] + mean[2 * pixels + p];
        dammertz += 3.0 * fabs(half[p]) / sqrt(fmax(total, 1e-3)) / pixels;
        rse += n->sigma * n->sigma / f->spp / fmax(total * total / 9.0, 4e-4) / pixels;
    }
    struct seq_stat stats[] = {
        {"dammertz", dammertz},        {"half_unsettled", 0.0},    {"rse", sqrt(rse)},
        {"rse_unsettled", 0.0},        {"seconds", 1e-3 * f->spp}, {"tail999", n->tail / sqrt(f->spp)},
        {"gini", 0.3 + 0.1 * n->sigma}};
    struct seq_frame frame = {.spp = f->spp,
                              .half_spp = f->spp / 2,
                              .is_reference = is_reference,
                              .full = full,
                              .display = display,
                              .mean = mean,
                              .half = is_reference ? NULL : half,
                              .stats = stats,
                              .n_stats = is_reference    ? 0
                                         : n->tail > 0.0 ? 7
                                                         : 5};
    assert_int_equal(seq_builder_add(w, &frame, NULL), 0);
    free(display);
    free(half);
    free(mean);
}

static void build(struct seq_builder *w, const struct ggn_noise *n, int32_t x0, uint32_t id)
{
    uint32_t values = 3 * n->width * n->height;
    struct film film = {.sum = {calloc(values, sizeof(double)), calloc(values, sizeof(double))}};
    int full_done = 0;
    assert_true(film.sum[0] && film.sum[1]);
    assert_int_equal(seq_builder_init(w, n->width, n->height, x0, 0, id, n->seed, NULL), 0);
    for (uint32_t i = 0; i < n->n_levels; i++) {
        int full = !full_done && (n->levels[i] >= 320 || i + 1 == n->n_levels);
        full_done |= full;
        add_samples(&film, n, n->levels[i], 10 * i);
        add_frame(w, &film, n, 0, full);
    }
    if (n->reference_spp > 0) {
        memset(film.sum[0], 0, values * sizeof(double));
        memset(film.sum[1], 0, values * sizeof(double));
        film.spp = 0;
        add_samples(&film, n, n->reference_spp, 777);
        add_frame(w, &film, n, 1, 1);
    }
    free(film.sum[0]);
    free(film.sum[1]);
}

struct seq_block ggn_noise_block(const struct ggn_noise *noise)
{
    struct seq_builder w;
    struct seq_block b;
    uint32_t crc;
    char path[] = "/tmp/ggn_noise.XXXXXX";
    build(&w, noise, 0, noise->seed);
    close(mkstemp(path));
    assert_int_equal(seq_builder_write(&w, path, &crc, NULL), 0);
    assert_int_equal(seq_block_read(path, &b, NULL), 0);
    unlink(path);
    seq_builder_release(&w);
    return b;
}

void ggn_noise_view(const char *dir, const char *scene, const struct ggn_noise *noise, const double *sigma, int n,
                    double samples_per_variance)
{
    struct seq_manifest_block *entries = calloc((size_t)n, sizeof *entries);
    struct ggn_label *labels = calloc((size_t)n, sizeof *labels);
    struct ggn_noise one = *noise;
    char path[1024];
    uint32_t *levels = malloc(noise->n_levels * sizeof *levels);
    assert_true(entries && labels && levels);
    memcpy(levels, noise->levels, noise->n_levels * sizeof *levels);
    struct seq_manifest m = {.width = noise->width * (uint32_t)n,
                             .height = noise->height,
                             .block = noise->width,
                             .reference_spp = noise->reference_spp,
                             .reference_independent = 1,
                             .n_levels = noise->n_levels,
                             .levels = levels,
                             .n_blocks = (uint32_t)n,
                             .blocks = entries};
    struct ggn_labels l = {
        .source = "observer", .cap = levels[noise->n_levels - 1], .spread = 0.25, .n = (uint32_t)n, .labels = labels};
    snprintf(m.scene, sizeof m.scene, "%s", scene);
    mkdir(dir, 0777);
    for (int i = 0; i < n; i++) {
        struct seq_builder w;
        struct seq_manifest_block *e = &entries[i];
        *e = (struct seq_manifest_block){.id = (uint32_t)i,
                                         .x0 = (uint32_t)i * noise->width,
                                         .x1 = (uint32_t)(i + 1) * noise->width,
                                         .y1 = noise->height};
        one.sigma = sigma[i];
        one.seed = noise->seed * 100 + (uint32_t)i;
        build(&w, &one, (int32_t)e->x0, e->id);
        snprintf(e->file, sizeof e->file, "block-%05d.lseq", i);
        snprintf(path, sizeof path, "%s/%s", dir, e->file);
        assert_int_equal(seq_builder_write(&w, path, &e->crc32, NULL), 0);
        e->bytes = w.size;
        seq_builder_release(&w);
        double t = samples_per_variance * sigma[i] * sigma[i];
        labels[i] = (struct ggn_label){(uint32_t)i, fmin(t, l.cap), t >= l.cap};
    }
    assert_int_equal(seq_manifest_write(dir, &m, NULL), 0);
    assert_int_equal(ggn_labels_write(dir, &l, 1, NULL), 0);
    free(levels);
    free(labels);
    free(entries);
}
