/* A view from a recorded sequence (plugin-api/sequence). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/threads.h"
#include "data/shown_files.h"
#include "data/shown_source.h"
#include "data/stimuli.h"
#include "sequence/manifest.h"

struct work {
    const struct ggn_shown_request *request;
    const char *folder;
    const struct seq_manifest *manifest;
    const uint32_t *chosen; /* [n_blocks]; indices in the manifest */
    int view;
    struct ggn_shown_block *blocks; /* [n_blocks] */
    int *rc;
    struct base_err *errs;
};

static int make_levels(const struct work *w, struct ggn_shown_block *b, struct ggn_stimuli *s, uint8_t *rgb,
                       struct base_err *err)
{
    char what[32];
    int rc = ggn_shown_write_reference(w->request->dir, w->view, b, 1, s->converged, err);
    b->levels = malloc((size_t)s->n * sizeof *b->levels);
    if (!b->levels)
        return base_fail_nomem(err, w->folder);
    for (int i = 0; i < s->n && !rc; i++) {
        double spp = round(s->spp[i]);
        if (!ggn_shown_takes_level(w->request, b, spp))
            continue;
        rc = ggn_stimuli_make(s, i, rgb, err);
        snprintf(what, sizeof what, "%.0f", spp);
        if (!rc)
            rc = ggn_shown_write_block(w->request->dir, w->view, b, what, 1, rgb, err);
        b->levels[b->n_levels++] = (uint32_t)spp;
    }
    return !rc ? ggn_shown_enough_levels(w->folder, b, err) : rc;
}

static void work_block(void *data, long i, int worker)
{
    struct work *w = data;
    const struct seq_manifest_block *m = &w->manifest->blocks[w->chosen[i]];
    struct ggn_shown_block *b = &w->blocks[i];
    struct seq_block block;
    struct ggn_stimuli stimuli;
    struct base_err *err = &w->errs[i];
    (void)worker;
    *b = (struct ggn_shown_block){.id = m->id, .x0 = m->x0, .y0 = m->y0, .x1 = m->x1, .y1 = m->y1};
    w->rc[i] = seq_manifest_read_block(w->folder, w->manifest, w->chosen[i], &block, err);
    if (w->rc[i] != 0)
        return;
    uint8_t *rgb = malloc(3 * (size_t)block.width * block.height);
    w->rc[i] =
        rgb ? ggn_stimuli_init(&stimuli, &block, w->manifest->reference_independent, err) : base_fail_nomem(err, w->folder);
    if (w->rc[i] == 0) {
        w->rc[i] = make_levels(w, b, &stimuli, rgb, err);
        ggn_stimuli_release(&stimuli);
    }
    free(rgb);
    seq_block_release(&block);
}

static int by_id(const void *a, const void *b)
{
    uint32_t x = ((const struct ggn_shown_block *)a)->id, y = ((const struct ggn_shown_block *)b)->id;
    return (x > y) - (x < y);
}

int ggn_shown_sequence(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                       struct ggn_shown_view *view, struct base_threads *threads, struct base_err *err)
{
    struct seq_manifest m = {0};
    int rc = seq_manifest_read(source->folder, &m, err);
    if (!rc && (m.n_blocks < 1 || m.n_blocks > GGN_SHOWN_MAX_BLOCKS))
        rc = base_fail(err, BASE_EINVAL, "%s: %u finished blocks, wanted 1 … %d", source->folder, m.n_blocks,
                       GGN_SHOWN_MAX_BLOCKS);
    if (rc) {
        seq_manifest_release(&m);
        return rc;
    }
    uint32_t *chosen = malloc(m.n_blocks * sizeof *chosen);
    view->width = m.width;
    view->height = m.height;
    view->blocks = calloc(m.n_blocks, sizeof *view->blocks);
    struct work w = {.request = q,
                     .folder = source->folder,
                     .manifest = &m,
                     .chosen = chosen,
                     .view = index,
                     .blocks = view->blocks,
                     .rc = calloc(m.n_blocks, sizeof *w.rc),
                     .errs = calloc(m.n_blocks, sizeof *w.errs)};
    /* Blocks are read on all threads, so each has its own error; the first by number counts. */
    if (!view->blocks || !chosen || !w.rc || !w.errs) {
        rc = base_fail_nomem(err, w.folder);
    } else {
        for (uint32_t i = 0; i < m.n_blocks; i++)
            if (ggn_shown_source_has(source, m.blocks[i].id))
                chosen[view->n_blocks++] = i;
        base_threads_for(threads, view->n_blocks, work_block, &w);
        rc = ggn_shown_source_check(source, view, err);
        qsort(view->blocks, (size_t)view->n_blocks, sizeof *view->blocks, by_id);
    }
    for (int i = 0; i < view->n_blocks && !rc; i++)
        if (w.rc[i] != 0)
            rc = base_fail(err, w.rc[i], "%.400s", w.errs[i].text);
    free(chosen);
    free(w.rc);
    free(w.errs);
    seq_manifest_release(&m);
    return rc;
}
