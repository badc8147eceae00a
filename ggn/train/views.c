#include "train/views.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "data/each.h"
#include "sight/stats.h"

struct work {
    const struct ggn_dataset_view *view;
    enum ggn_curve_source source;
    struct ggn_curve *curves;
};

static int make_curve(void *data, long i, int worker, struct base_err *err)
{
    const struct work *w = data;
    const struct seq_manifest *m = &w->view->manifest;
    struct seq_block b;
    struct base_err why = {0};
    (void)worker;
    int rc = seq_manifest_read_block(w->view->dir, m, (uint32_t)i, &b, &why);
    if (!rc) {
        rc = ggn_curve_make(&b, w->source, m->reference_independent, &w->curves[i], &why);
        seq_block_release(&b);
    }
    return rc ? base_fail(err, rc, "%s: %s", w->view->name, why.text) : 0;
}

int ggn_view_curves(const struct ggn_dataset_view *view, enum ggn_curve_source source, struct base_threads *threads,
                    struct ggn_curve *curves, struct base_err *err)
{
    uint32_t n = view->manifest.n_blocks;
    struct work w = {view, source, curves};
    for (uint32_t i = 0; i < n; i++)
        curves[i] = (struct ggn_curve){0};
    int rc = ggn_each(threads, n, make_curve, &w, view->dir, err);
    for (uint32_t i = 0; i < n && rc; i++)
        ggn_curve_release(&curves[i]);
    return rc;
}

int ggn_view_label(const struct ggn_observer *observer, const struct ggn_dataset_view *view, enum ggn_curve_source source,
                   struct base_threads *threads, struct ggn_labels *out, struct base_err *err)
{
    uint32_t n = view->manifest.n_blocks;
    struct ggn_labels l = {.source = "observer", .spread = observer->spread, .n = n, .labels = malloc(n * sizeof *l.labels)};
    struct ggn_curve *curves = malloc(n * sizeof *curves);
    int rc = !l.labels || !curves ? base_fail_nomem(err, view->dir) : ggn_view_curves(view, source, threads, curves, err);
    for (uint32_t i = 0; i < n && !rc; i++) {
        const struct ggn_curve *c = &curves[i];
        struct ggn_label *label = &l.labels[i];
        label->id = view->manifest.blocks[i].id;
        label->threshold = ggn_curve_threshold(c, observer->level, &label->censored);
        l.cap = fmax(l.cap, c->spp[c->n - 1]);
        ggn_curve_release(&curves[i]);
    }
    free(curves);
    ggn_observer_describe(observer, l.detail, sizeof l.detail);
    size_t used = strlen(l.detail);
    if (source == GGN_FROM_HALVES)
        snprintf(l.detail + used, sizeof l.detail - used, "; from two halves");
    else if (view->manifest.reference_independent)
        snprintf(l.detail + used, sizeof l.detail - used, "; from recorded levels, beyond them two halves");
    else
        snprintf(l.detail + used, sizeof l.detail - used, "; from recorded levels, of which the last is the reference");
    if (rc)
        ggn_labels_release(&l);
    else
        *out = l;
    return rc;
}

/* Visible noise falls as 1/sqrt(spp): twice the logarithm of the ratio is a shift in octaves of samples. Shifts take the
 * place of what is recorded. */
static double curve_shift(struct ggn_curve *recorded, const struct ggn_curve *halves)
{
    size_t n = 0;
    for (int i = 0; i < recorded->recorded; i++)
        if (recorded->visible[i] > 0.0)
            recorded->visible[n++] = 2.0 * log2(ggn_curve_at(halves, recorded->spp[i]) / recorded->visible[i]);
    return ggn_stats_quantile(recorded->visible, n, 0.5);
}

int ggn_view_check(const struct ggn_observer *observer, const struct ggn_dataset_view *view, struct base_threads *threads,
                   struct ggn_check *checks, struct base_err *err)
{
    uint32_t n = view->manifest.n_blocks;
    struct ggn_curve *recorded = calloc(2 * n, sizeof *recorded), *halves = recorded + n;
    int rc = !recorded ? base_fail_nomem(err, view->dir) : ggn_view_curves(view, GGN_FROM_LEVELS, threads, recorded, err);
    if (!rc)
        rc = ggn_view_curves(view, GGN_FROM_HALVES, threads, halves, err);
    for (uint32_t i = 0; i < n && !rc; i++) {
        struct ggn_check *c = &checks[i];
        int censored;
        c->id = view->manifest.blocks[i].id;
        c->halves = ggn_curve_threshold(&halves[i], observer->level, &censored);
        recorded[i].n = recorded[i].recorded;
        c->recorded = ggn_curve_threshold(&recorded[i], observer->level, &c->beyond);
        c->curve = curve_shift(&recorded[i], &halves[i]);
    }
    for (uint32_t i = 0; recorded && i < 2 * n; i++)
        ggn_curve_release(&recorded[i]);
    free(recorded);
    return rc;
}
