/* A view from a recorded sequence (plugin-api/sequence). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "data/each.h"
#include "data/shown_parts.h"
#include "data/stimuli.h"
#include "sequence/manifest.h"

struct work {
    const struct ggn_shown_request *request;
    const char *folder;
    const struct seq_manifest *manifest;
    const uint32_t *chosen; /* [n_blocks]; indices in the manifest */
    int view;
    struct ggn_shown_block *blocks; /* [n_blocks] */
};

static int make_levels(const struct work *w, struct ggn_shown_block *b, struct ggn_stimuli *s, uint8_t *rgb,
                       struct base_err *err)
{
    const int width = (int)(b->x1 - b->x0), height = (int)(b->y1 - b->y0);
    char what[32];
    int rc = ggn_shown_write_reference(w->request, w->view, b, width, height, s->converged, err);
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
            rc = ggn_shown_write(w->request, w->view, b, what, width, height, rgb, err);
        b->levels[b->n_levels++] = (uint32_t)spp;
    }
    return !rc ? ggn_shown_enough_levels(w->folder, b, err) : rc;
}

static int work_block(void *data, long i, int worker, struct base_err *err)
{
    const struct work *w = data;
    struct seq_block block;
    struct ggn_stimuli stimuli;
    (void)worker;
    int rc = seq_manifest_read_block(w->folder, w->manifest, w->chosen[i], &block, err);
    if (rc)
        return rc;
    uint8_t *rgb = malloc(3 * (size_t)block.width * block.height);
    rc = rgb ? ggn_stimuli_init(&stimuli, &block, w->manifest->reference_independent, err) : base_fail_nomem(err, w->folder);
    if (!rc) {
        rc = make_levels(w, &w->blocks[i], &stimuli, rgb, err);
        ggn_stimuli_release(&stimuli);
    }
    free(rgb);
    seq_block_release(&block);
    return rc;
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
    struct work w = {q, source->folder, &m, chosen, index, view->blocks};
    if (!view->blocks || !chosen)
        rc = base_fail_nomem(err, w.folder);
    for (uint32_t i = 0; i < m.n_blocks && !rc; i++) {
        const struct seq_manifest_block *b = &m.blocks[i];
        if (!ggn_shown_source_has(source, b->id))
            continue;
        chosen[view->n_blocks] = i;
        view->blocks[view->n_blocks++] =
            (struct ggn_shown_block){.id = b->id, .x0 = b->x0, .y0 = b->y0, .x1 = b->x1, .y1 = b->y1};
    }
    if (!rc)
        rc = ggn_shown_source_check(source, view, err);
    if (!rc)
        rc = ggn_each(threads, view->n_blocks, work_block, &w, w.folder, err);
    if (!rc)
        qsort(view->blocks, (size_t)view->n_blocks, sizeof *view->blocks, by_id);
    free(chosen);
    seq_manifest_release(&m);
    return rc;
}
