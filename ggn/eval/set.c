#include "eval/set.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "nn/loss.h"
#include "observer/flip.h"

void ggn_eval_set_release(struct ggn_eval_set *s)
{
    free(s->blocks);
    free(s->spp); /* one allocation for all columns of doubles */
    free(s->noisy);
    *s = (struct ggn_eval_set){0};
}

static int scene_index(const struct ggn_dataset *d, int view)
{
    for (int i = 0; i < view; i++)
        if (strcmp(d->views[i].manifest.scene, d->views[view].manifest.scene) == 0)
            return i;
    return view;
}

/* Lists the labelled blocks and counts the cases. */
static int list_blocks(struct ggn_eval_set *s, int *skipped, struct ggn_err *err)
{
    size_t room = 1;
    *skipped = 0;
    for (int v = 0; v < s->data->n; v++)
        room += s->data->views[v].manifest.n_blocks;
    s->blocks = malloc(room * sizeof *s->blocks);
    if (s->blocks == NULL)
        return ggn_fail_nomem(err, "evaluation");
    for (int v = 0; v < s->data->n; v++) {
        const struct ggn_dataset_view *view = &s->data->views[v];
        const struct ggn_manifest *m = &view->manifest;
        *skipped += !view->has_labels;
        for (uint32_t i = 0; i < m->n_blocks && view->has_labels; i++) {
            const struct ggn_label *label = ggn_labels_find(&view->labels, m->blocks[i].id);
            if (label == NULL)
                continue;
            if (m->n_levels < (uint32_t)s->window)
                return ggn_fail(err, GGN_EINVAL, "%s: %u level%s, a window needs %d", view->dir, m->n_levels, m->n_levels == 1 ? "" : "s", s->window);
            size_t cases = m->n_levels - (uint32_t)s->window + 1;
            s->blocks[s->n_blocks++] = (struct ggn_eval_block){.view = v, .scene = scene_index(s->data, v), .index = i, .split = view->split,
                                                               .label = *label, .cap = m->levels[m->n_levels - 1], .first = s->n, .end = s->n + cases};
            s->n += cases;
        }
    }
    if (s->n_blocks == 0)
        return ggn_fail(err, GGN_EINVAL, "no labelled block in the data (run ggn label first)");
    return GGN_OK;
}

static int make_columns(struct ggn_eval_set *s, struct ggn_err *err)
{
    enum { COLUMNS = 8 };
    double **columns[COLUMNS] = {&s->spp, &s->seconds, &s->dammertz, &s->half_unsettled, &s->rse, &s->rse_unsettled, &s->flip, &s->ssim};
    double *all = malloc(COLUMNS * s->n * sizeof *all);
    s->noisy = malloc(s->n);
    s->spp = all;
    if (all == NULL || s->noisy == NULL)
        return ggn_fail_nomem(err, "evaluation");
    for (size_t c = 0; c < COLUMNS; c++) {
        *columns[c] = all + c * s->n;
        for (size_t i = 0; i < s->n; i++)
            all[c * s->n + i] = (double)NAN;
    }
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        const struct ggn_manifest *m = &s->data->views[block->view].manifest;
        for (size_t i = block->first; i < block->end; i++) {
            s->spp[i] = m->levels[i - block->first + (size_t)s->window - 1];
            s->noisy[i] = (signed char)ggn_label_noisy(&block->label, s->spp[i]);
        }
    }
    return GGN_OK;
}

/* --- blocks in parallel --- */

struct each {
    const struct ggn_eval_set *set;
    int (*fn)(void *, int, const struct ggn_seq_block *, int, struct ggn_err *);
    void *data;
    int *rc;
    struct ggn_err *errs;
};

static void each_block(void *data, long i, int worker)
{
    struct each *e = data;
    const struct ggn_eval_block *b = &e->set->blocks[i];
    const struct ggn_dataset_view *view = &e->set->data->views[b->view];
    struct ggn_seq_block pixels;
    e->rc[i] = ggn_manifest_read_block(view->dir, &view->manifest, b->index, &pixels, &e->errs[i]);
    if (e->rc[i] != GGN_OK)
        return;
    e->rc[i] = e->fn(e->data, (int)i, &pixels, worker, &e->errs[i]);
    ggn_seq_block_release(&pixels);
}

int ggn_eval_each_block(const struct ggn_eval_set *set, struct ggn_threads *threads,
                        int (*fn)(void *data, int block, const struct ggn_seq_block *pixels, int worker, struct ggn_err *err), void *data,
                        struct ggn_err *err)
{
    int n = set->n_blocks, rc = GGN_OK;
    struct each e = {.set = set, .fn = fn, .data = data, .rc = calloc((size_t)n, sizeof(int)), .errs = calloc((size_t)n, sizeof(struct ggn_err))};
    if (e.rc == NULL || e.errs == NULL)
        rc = ggn_fail_nomem(err, "evaluation");
    else
        ggn_threads_for(threads, n, each_block, &e);
    for (int i = 0; i < n && rc == GGN_OK; i++)
        if (e.rc[i] != GGN_OK)
            rc = ggn_fail(err, e.rc[i], "%s", e.errs[i].text);
    free(e.rc);
    free(e.errs);
    return rc;
}

/* --- statistics and quality --- */

struct fill {
    struct ggn_eval_set *set;
    int quality;
};

/* SSIM of two display images on [0,1], mean over the channels. */
static double ssim_of(struct ggn_ssim_f32 *ssim, const uint8_t *a, const uint8_t *b, size_t pixels, int width, float *work)
{
    const float *x[3], *y[3];
    for (size_t i = 0; i < 3 * pixels; i++) {
        work[i] = (float)a[i] / 255.0f;
        work[3 * pixels + i] = (float)b[i] / 255.0f;
    }
    for (size_t c = 0; c < 3; c++) {
        x[c] = work + c * pixels;
        y[c] = work + (3 + c) * pixels;
    }
    return ggn_ssim_mean_f32(ssim, x, y, NULL, 3, width, 0.0);
}

static void interleave(const uint8_t *planar, size_t pixels, uint8_t *rgb)
{
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++)
            rgb[3 * i + c] = planar[c * pixels + i];
}

static int measure_quality(struct ggn_eval_set *s, const struct ggn_eval_block *block, const struct ggn_seq_block *p, struct ggn_err *err)
{
    size_t pixels = (size_t)p->width * p->height;
    int w = (int)p->width, h = (int)p->height, rc;
    uint8_t *bytes = malloc(12 * pixels);
    float *work = malloc(6 * pixels * sizeof *work);
    struct ggn_ssim_f32 *ssim = ggn_ssim_create_f32(h, w, NULL, err);
    if (bytes == NULL || work == NULL || ssim == NULL) {
        rc = ggn_fail_nomem(err, "quality");
        goto out;
    }
    uint8_t *reference = bytes, *level = bytes + 3 * pixels, *reference_rgb = bytes + 6 * pixels, *level_rgb = bytes + 9 * pixels;
    rc = ggn_seq_display_planar(p, p->reference, reference, err);
    interleave(reference, pixels, reference_rgb);
    for (size_t i = block->first; i < block->end && rc == GGN_OK; i++) {
        struct ggn_flip_stats flip;
        rc = ggn_seq_display_planar(p, ggn_seq_level(p, (uint32_t)s->spp[i]), level, err);
        if (rc != GGN_OK)
            break;
        interleave(level, pixels, level_rgb);
        rc = ggn_flip(reference_rgb, level_rgb, w, h, GGN_FLIP_PPD, NULL, &flip, err);
        s->flip[i] = flip.mean;
        s->ssim[i] = ssim_of(ssim, level, reference, pixels, w, work);
    }
out:
    ggn_ssim_destroy_f32(ssim);
    free(work);
    free(bytes);
    return rc;
}

static int fill_block(void *data, int index, const struct ggn_seq_block *p, int worker, struct ggn_err *err)
{
    struct fill *f = data;
    struct ggn_eval_set *s = f->set;
    const struct ggn_eval_block *block = &s->blocks[index];
    (void)worker;
    for (size_t i = block->first; i < block->end; i++) {
        const struct ggn_seq_record *r = ggn_seq_level(p, (uint32_t)s->spp[i]);
        s->seconds[i] = ggn_seq_stat(r, "seconds");
        s->dammertz[i] = ggn_seq_stat(r, "dammertz");
        s->half_unsettled[i] = ggn_seq_stat(r, "half_unsettled");
        s->rse[i] = ggn_seq_stat(r, "rse");
        s->rse_unsettled[i] = ggn_seq_stat(r, "rse_unsettled");
    }
    return f->quality && p->reference != NULL ? measure_quality(s, block, p, err) : GGN_OK;
}

int ggn_eval_set_load(struct ggn_eval_set *out, const struct ggn_dataset *data, int window, int quality, struct ggn_threads *threads,
                      int *skipped, struct ggn_err *err)
{
    struct ggn_eval_set s = {.data = data, .window = window, .n_scenes = data->n};
    struct fill f = {&s, quality};
    int rc = list_blocks(&s, skipped, err);
    if (rc == GGN_OK)
        rc = make_columns(&s, err);
    if (rc == GGN_OK)
        rc = ggn_eval_each_block(&s, threads, fill_block, &f, err);
    if (rc != GGN_OK)
        ggn_eval_set_release(&s);
    else
        *out = s;
    return rc;
}
