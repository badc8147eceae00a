#include "data/shown.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "base/list.h"
#include "data/each.h"
#include "data/shown_parts.h"
#include "data/stimuli.h"
#include "picture/png.h"
#include "sequence/manifest.h"

const char *const ggn_shown_kind_names[GGN_SHOWN_KINDS + 1] = {"", "noisy", "denoised", "blend", NULL};

void ggn_shown_release(struct ggn_shown *s)
{
    for (int v = 0; v < s->n_views && s->views; v++) {
        for (int b = 0; b < s->views[v].n_blocks && s->views[v].blocks; b++)
            free(s->views[v].blocks[b].levels);
        free(s->views[v].blocks);
    }
    free(s->views);
    free(s->conditions);
    *s = (struct ggn_shown){0};
}

int ggn_shown_plain_name(const char *name)
{
    size_t n = strlen(name);
    if (n == 0 || n >= GGN_SHOWN_NAME || name[0] == '.')
        return 0;
    return strspn(name, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-") == n;
}

static int is_list(const char *at)
{
    unsigned long lo, hi;
    do
        at = base_list_next(at, &lo, &hi, NULL);
    while (at && *at != '\0');
    return at != NULL;
}

/* FOLDER or FOLDER:BLOCKS. */
static int parse_source(const char *text, struct ggn_shown_source *s, struct base_err *err)
{
    const char *colon = strrchr(text, ':');
    size_t n = strlen(text);
    s->blocks = NULL;
    if (colon && is_list(colon + 1)) {
        s->blocks = colon + 1;
        n = (size_t)(colon - text);
    }
    while (n > 1 && text[n - 1] == '/')
        n--;
    if (n >= sizeof s->folder)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", text);
    memcpy(s->folder, text, n);
    s->folder[n] = '\0';
    return 0;
}

int ggn_shown_source_has(const struct ggn_shown_source *s, uint32_t id)
{
    unsigned long lo, hi;
    for (const char *at = s->blocks; at && *at != '\0';)
        if ((at = base_list_next(at, &lo, &hi, NULL)) && id >= lo && id <= hi)
            return 1;
    return !s->blocks;
}

static int has_block(const struct ggn_shown_view *view, unsigned long id)
{
    for (int i = 0; i < view->n_blocks; i++)
        if (view->blocks[i].id == id)
            return 1;
    return 0;
}

int ggn_shown_source_check(const struct ggn_shown_source *s, const struct ggn_shown_view *view, struct base_err *err)
{
    unsigned long lo, hi;
    for (const char *at = s->blocks; at && *at != '\0';)
        if ((at = base_list_next(at, &lo, &hi, NULL)) && (!has_block(view, lo) || !has_block(view, hi)))
            return base_fail(err, BASE_EINVAL, "%s: has no block %lu", s->folder, has_block(view, lo) ? hi : lo);
    return 0;
}

int ggn_shown_takes_level(const struct ggn_shown_request *q, const struct ggn_shown_block *b, double spp)
{
    double last = b->n_levels > 0 ? b->levels[b->n_levels - 1] : 0.0;
    return spp >= q->spp_min && spp <= q->spp_max && b->n_levels < GGN_SHOWN_MAX_LEVELS &&
           (last == 0.0 || log2(spp / last) >= 0.999 * q->spacing);
}

int ggn_shown_enough_levels(const char *dir, const struct ggn_shown_block *b, struct base_err *err)
{
    if (b->n_levels >= 3)
        return 0;
    return base_fail(err, BASE_EINVAL,
                     "%s: block %u has %d levels to show; record more, or halves, or widen --spp-min and --spp-max", dir,
                     b->id, b->n_levels);
}

static int write_picture(const struct ggn_shown_request *q, int view, const struct ggn_shown_block *b, const char *what,
                         int width, int height, const uint8_t *rgb, struct base_err *err)
{
    char path[4096], block[16] = "";
    if (b)
        snprintf(block, sizeof block, "b%u-", b->id);
    int n = snprintf(path, sizeof path, "%s/v%d/%s%s.png", q->dir, view, block, what);
    return n > 0 && n < (int)sizeof path ? pic_write_png(path, width, height, 3, rgb, err)
                                         : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", q->dir);
}

/* Noise that nobody misses: uniform, up to 48 codes either way. A linear congruence does for noise that is only looked at
 * (Numerical Recipes). */
static void make_heavy(const uint8_t *rgb, size_t n, uint8_t *out)
{
    uint32_t state = 1;
    for (size_t i = 0; i < n; i++) {
        state = state * 1664525u + 1013904223u;
        int v = rgb[i] + (int)(state >> 16) % 97 - 48;
        out[i] = (uint8_t)(v < 0 ? 0 : v > 255 ? 255 : v);
    }
}

int ggn_shown_write(const struct ggn_shown_request *q, int view, const struct ggn_shown_block *b, const char *what,
                    int width, int height, const uint8_t *rgb, struct base_err *err)
{
    const size_t n = 3 * (size_t)width * (size_t)height;
    int rc = write_picture(q, view, b, what ? what : "reference", width, height, rgb, err);
    if (rc || what)
        return rc;
    uint8_t *noisy = malloc(n);
    if (!noisy)
        return base_fail_nomem(err, "picture of a catch trial");
    make_heavy(rgb, n, noisy);
    rc = write_picture(q, view, b, "heavy", width, height, noisy, err);
    free(noisy);
    return rc;
}

/* A view from a recorded sequence. */
struct work {
    const struct ggn_shown_request *request;
    const char *folder;
    const struct seq_manifest *manifest;
    int view;
    struct ggn_shown_block *blocks; /* [n_blocks] */
};

static int make_levels(const struct work *w, struct ggn_shown_block *b, struct ggn_stimuli *s, uint8_t *rgb,
                       struct base_err *err)
{
    const int width = (int)(b->x1 - b->x0), height = (int)(b->y1 - b->y0);
    char what[32];
    int rc = ggn_shown_write(w->request, w->view, b, NULL, width, height, s->converged, err);
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
    int rc = seq_manifest_read_block(w->folder, w->manifest, seq_manifest_find(w->manifest, w->blocks[i].id), &block, err);
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

static int make_sequence(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                         struct ggn_shown_view *view, struct base_threads *threads, struct base_err *err)
{
    struct seq_manifest m = {0};
    struct work w = {q, source->folder, &m, index, NULL};
    int rc = seq_manifest_read(source->folder, &m, err);
    if (!rc && (m.n_blocks < 1 || m.n_blocks > GGN_SHOWN_MAX_BLOCKS))
        rc = base_fail(err, BASE_EINVAL, "%s: %u finished blocks, wanted 1 … %d", source->folder, m.n_blocks,
                       GGN_SHOWN_MAX_BLOCKS);
    else if (!rc) {
        view->width = m.width;
        view->height = m.height;
        w.blocks = view->blocks = calloc(m.n_blocks, sizeof *view->blocks);
        rc = w.blocks ? 0 : base_fail_nomem(err, w.folder);
    }
    for (uint32_t i = 0; i < m.n_blocks && !rc; i++) {
        const struct seq_manifest_block *b = &m.blocks[i];
        if (ggn_shown_source_has(source, b->id))
            view->blocks[view->n_blocks++] =
                (struct ggn_shown_block){.id = b->id, .x0 = b->x0, .y0 = b->y0, .x1 = b->x1, .y1 = b->y1};
    }
    if (!rc)
        rc = ggn_shown_source_check(source, view, err);
    if (!rc)
        rc = ggn_each(threads, view->n_blocks, work_block, &w, w.folder, err);
    if (!rc)
        qsort(view->blocks, (size_t)view->n_blocks, sizeof *view->blocks, by_id);
    seq_manifest_release(&m);
    return rc;
}

/* The last part of the folder's path, with the kind behind it. */
static int name_view(struct ggn_shown *s, int index, const char *folder, struct base_err *err)
{
    struct ggn_shown_view *view = &s->views[index];
    int n = snprintf(view->name, sizeof view->name, "%s%s%s", base_file_name(folder), view->kind ? "." : "",
                     ggn_shown_kind_names[view->kind]);
    int named = n < (int)sizeof view->name && ggn_shown_plain_name(view->name);
    for (int i = 0; i < index; i++)
        named = named && strcmp(s->views[i].name, view->name) != 0;
    if (!named)
        return base_fail(err, BASE_EINVAL,
                         "%s: a view's folder needs a name of its own of letters, digits, '.', '_' and '-'", folder);
    return 0;
}

static int make_view(const struct ggn_shown_request *q, const char *text, int index, struct ggn_shown *s,
                     struct base_threads *threads, struct base_err *err)
{
    char path[4096], manifest[4096], folder[32];
    struct ggn_shown_source source;
    int rc = parse_source(text, &source, err);
    if (!rc)
        rc = name_view(s, index, source.folder, err);
    if (!rc)
        rc = base_file_join(path, source.folder, "reference.png", err);
    if (!rc && base_file_is_inside(path, q->dir))
        rc = base_fail(err, BASE_EINVAL, "%s: lies among the pictures that the study shows", path);
    snprintf(folder, sizeof folder, "v%d", index);
    if (!rc)
        rc = base_file_join(path, q->dir, folder, err);
    if (!rc)
        rc = base_make_folder(path, NULL, err);
    if (!rc)
        rc = base_file_join(manifest, source.folder, "manifest.json", err);
    if (rc)
        return rc;
    if (q->task == GGN_SHOWN_VALIDATION && source.blocks)
        return base_fail(err, BASE_EINVAL, "%s: a validation shows whole pictures, not blocks", text);
    if (access(manifest, F_OK) != 0)
        return ggn_shown_pictures(q, &source, index, s, err);
    if (q->task == GGN_SHOWN_VALIDATION)
        return base_fail(err, BASE_EINVAL,
                         "%s: a validation takes folders of pictures; `ggn reconstruct` makes them from a sequence",
                         source.folder);
    if (s->views[index].kind)
        return base_fail(err, BASE_EINVAL,
                         "%s: a sequence has no denoised pictures; --kinds takes folders of renders with "
                         "--denoise",
                         source.folder);
    return make_sequence(q, &source, index, &s->views[index], threads, err);
}

int ggn_shown_make(const struct ggn_shown_request *q, struct ggn_shown *s, struct base_threads *threads,
                   struct base_err *err)
{
    int kinds = q->n_kinds > 0 ? q->n_kinds : 1, n = q->n_views * kinds;
    if (n > GGN_SHOWN_MAX_VIEWS)
        return base_fail(err, BASE_EINVAL, "at most %d views, each kind counted", GGN_SHOWN_MAX_VIEWS);
    int rc = base_make_folder(q->dir, NULL, err);
    if (rc)
        return rc;
    s->views = calloc((size_t)n, sizeof *s->views);
    if (!s->views)
        return base_fail_nomem(err, q->dir);
    for (int i = 0; i < n && !rc; i++) {
        s->n_views = i + 1;
        s->views[i].frames = 1;
        s->views[i].kind = q->n_kinds > 0 ? q->kinds[i % kinds] : GGN_SHOWN_AS_IS;
        rc = make_view(q, q->views[i / kinds], i, s, threads, err);
    }
    return rc;
}
