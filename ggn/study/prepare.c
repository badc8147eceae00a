#include "study/prepare.h"

#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files.h"
#include "picture/read.h"
#include "sequence/manifest.h"
#include "study/plan.h"
#include "study/stimuli.h"
#include "study/token.h"
#include "picture/png.h"

static int make_dir(const char *path, struct base_err *err)
{
    if (mkdir(path, 0777) != 0 && errno != EEXIST)
        return base_fail(err, BASE_EIO, "%s: %s", path, strerror(errno));
    return 0;
}

/* DIR/stimuli/vVIEW/NAME.png; path has room for 4096 bytes. */
static int picture_path(char *path, const char *dir, int view, const char *name, struct base_err *err)
{
    int n = snprintf(path, 4096, "%s/stimuli/v%d/%s.png", dir, view, name);
    return n > 0 && n < 4096 ? 0 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
}

static int write_block(const char *dir, int view, const struct ggn_study_block *b, const char *what, const uint8_t *rgb,
                       struct base_err *err)
{
    char name[64], path[4096];
    snprintf(name, sizeof name, "b%u-%s", b->id, what);
    int rc = picture_path(path, dir, view, name, err);
    return !rc ? pic_write_png(path, (int)(b->x1 - b->x0), (int)(b->y1 - b->y0), 3, rgb, err) : rc;
}

/* Whether a level of so many samples is taken after those that the block has. */
static int takes(const struct ggn_study_request_views *q, const struct ggn_study_block *b, double spp)
{
    double last = b->n_levels > 0 ? b->levels[b->n_levels - 1] : 0.0;
    return spp >= q->spp_min && spp <= q->spp_max && b->n_levels < GGN_STUDY_MAX_LEVELS &&
           (last == 0.0 || log2(spp / last) >= 0.999 * q->spacing);
}

static int enough_levels(const char *dir, const struct ggn_study_block *b, struct base_err *err)
{
    if (b->n_levels >= 3)
        return 0;
    return base_fail(err, BASE_EINVAL,
                     "%s: block %u has %d levels to show; record more, or halves, or widen --spp-min and --spp-max", dir,
                     b->id, b->n_levels);
}

/* *out: a copy of rgb[n] (malloc) with noise that nobody misses, for catch trials: uniform, up to 48 codes either way. A
 * linear congruence does for noise that is only looked at (Numerical Recipes). */
static int make_heavy(const uint8_t *rgb, size_t n, uint8_t **out, struct base_err *err)
{
    uint32_t state = 1;
    *out = malloc(n);
    if (!*out)
        return base_fail_nomem(err, "picture of a catch trial");
    for (size_t i = 0; i < n; i++) {
        state = state * 1664525u + 1013904223u;
        int v = rgb[i] + (int)(state >> 16) % 97 - 48;
        (*out)[i] = (uint8_t)(v < 0 ? 0 : v > 255 ? 255 : v);
    }
    return 0;
}

/* What a block is compared with, and what its catch trials show. */
static int write_reference(const char *dir, int view, const struct ggn_study_block *b, const uint8_t *rgb,
                           struct base_err *err)
{
    uint8_t *noisy;
    int rc = write_block(dir, view, b, "reference", rgb, err);
    if (!rc)
        rc = make_heavy(rgb, 3 * (size_t)(b->x1 - b->x0) * (b->y1 - b->y0), &noisy, err);
    if (rc)
        return rc;
    rc = write_block(dir, view, b, "heavy", noisy, err);
    free(noisy);
    return rc;
}

/* --- recorded sequences --- */

struct work {
    const struct ggn_study_request_views *request;
    const char *folder;
    const struct seq_manifest *manifest;
    int view;
    struct ggn_study_block *blocks; /* [n_blocks] */
    int *rc;
    struct base_err *errs;
};

static int make_levels(const struct work *w, struct ggn_study_block *b, struct ggn_stimuli *s, uint8_t *rgb,
                       struct base_err *err)
{
    char what[32];
    int rc = write_reference(w->request->dir, w->view, b, s->converged, err);
    b->levels = malloc((size_t)s->n * sizeof *b->levels);
    if (!b->levels)
        return base_fail_nomem(err, w->folder);
    for (int i = 0; i < s->n && !rc; i++) {
        double spp = round(s->spp[i]);
        if (!takes(w->request, b, spp))
            continue;
        rc = ggn_stimuli_make(s, i, rgb, err);
        snprintf(what, sizeof what, "%.0f", spp);
        if (!rc)
            rc = write_block(w->request->dir, w->view, b, what, rgb, err);
        b->levels[b->n_levels++] = (uint32_t)spp;
    }
    return !rc ? enough_levels(w->folder, b, err) : rc;
}

static void work_block(void *data, long i, int worker)
{
    struct work *w = data;
    const struct seq_manifest_block *m = &w->manifest->blocks[i];
    struct ggn_study_block *b = &w->blocks[i];
    struct seq_block block;
    struct ggn_stimuli stimuli;
    struct base_err *err = &w->errs[i];
    (void)worker;
    *b = (struct ggn_study_block){.id = m->id, .x0 = m->x0, .y0 = m->y0, .x1 = m->x1, .y1 = m->y1};
    w->rc[i] = seq_manifest_read_block(w->folder, w->manifest, (uint32_t)i, &block, err);
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
    uint32_t x = ((const struct ggn_study_block *)a)->id, y = ((const struct ggn_study_block *)b)->id;
    return (x > y) - (x < y);
}

static int prepare_sequence(const struct ggn_study_request_views *q, int index, struct ggn_study_view *view,
                            struct base_threads *threads, struct base_err *err)
{
    struct seq_manifest m = {0};
    int rc = seq_manifest_read(q->views[index], &m, err);
    if (!rc && (m.n_blocks < 1 || m.n_blocks > GGN_STUDY_MAX_BLOCKS))
        rc = base_fail(err, BASE_EINVAL, "%s: %u finished blocks, wanted 1 … %d", q->views[index], m.n_blocks,
                       GGN_STUDY_MAX_BLOCKS);
    if (rc) {
        seq_manifest_release(&m);
        return rc;
    }
    view->width = m.width;
    view->height = m.height;
    view->blocks = calloc(m.n_blocks, sizeof *view->blocks);
    struct work w = {.request = q,
                     .folder = q->views[index],
                     .manifest = &m,
                     .view = index,
                     .blocks = view->blocks,
                     .rc = calloc(m.n_blocks, sizeof *w.rc),
                     .errs = calloc(m.n_blocks, sizeof *w.errs)};
    if (!view->blocks || !w.rc || !w.errs) {
        rc = base_fail_nomem(err, w.folder);
    } else {
        view->n_blocks = (int)m.n_blocks;
        base_threads_for(threads, view->n_blocks, work_block, &w);
        qsort(view->blocks, m.n_blocks, sizeof *view->blocks, by_id);
    }
    for (uint32_t i = 0; i < m.n_blocks && !rc; i++)
        if (w.rc[i] != 0)
            rc = base_fail(err, w.rc[i], "%.400s", w.errs[i].text);
    free(w.rc);
    free(w.errs);
    seq_manifest_release(&m);
    return rc;
}

/* --- folders of pictures --- */

struct picture {
    char name[256];            /* the file's */
    char stem[GGN_STUDY_NAME]; /* without its extension */
    double spp;                /* the digits at the end of the stem; 0 without any */
};

static int by_spp(const void *a, const void *b)
{
    const struct picture *x = a, *y = b;
    int order = (x->spp > y->spp) - (x->spp < y->spp);
    return order ? order : strcmp(x->name, y->name);
}

static int list_pictures(const char *folder, struct picture **pictures, int *n, struct base_err *err)
{
    enum { MAX = 4096 };
    struct picture *list = malloc(MAX * sizeof *list);
    DIR *d = list ? opendir(folder) : NULL;
    int count = 0;
    if (!d) {
        int rc = list ? base_fail(err, BASE_EINVAL, "%s: %s", folder, strerror(errno)) : base_fail_nomem(err, folder);
        free(list);
        return rc;
    }
    for (struct dirent *e; (e = readdir(d)) != NULL && count < MAX;) {
        const char *dot = strrchr(e->d_name, '.');
        struct picture *p = &list[count];
        if (!dot || e->d_name[0] == '.' || (size_t)(dot - e->d_name) >= sizeof p->stem)
            continue;
        snprintf(p->name, sizeof p->name, "%s", e->d_name);
        snprintf(p->stem, sizeof p->stem, "%.*s", (int)(dot - e->d_name), e->d_name);
        const char *digits = p->stem + strlen(p->stem);
        while (digits > p->stem && digits[-1] >= '0' && digits[-1] <= '9')
            digits--;
        p->spp = strtod(*digits ? digits : "0", NULL);
        count++;
    }
    closedir(d);
    qsort(list, (size_t)count, sizeof *list, by_spp);
    *pictures = list;
    *n = count;
    return 0;
}

static int read_picture(const char *folder, const char *name, const struct ggn_study_view *view, struct pic_image *image,
                        struct base_err *err)
{
    char path[4096];
    int rc = base_file_join(path, folder, name, err);
    if (!rc)
        rc = pic_read_display(path, image, err);
    if (!rc && view->width && ((uint32_t)image->width != view->width || (uint32_t)image->height != view->height)) {
        rc = base_fail(err, BASE_EINVAL, "%s: %dx%d pixels, the reference has %ux%u", path, image->width, image->height,
                       view->width, view->height);
        pic_release(image);
    }
    return rc;
}

/* The picture called reference; its size becomes the view's. */
static int read_reference(const char *folder, const struct picture *list, int n, struct ggn_study_view *view,
                          struct pic_image *image, struct base_err *err)
{
    for (int i = 0; i < n; i++)
        if (strcmp(list[i].stem, "reference") == 0) {
            int rc = read_picture(folder, list[i].name, view, image, err);
            view->width = !rc ? (uint32_t)image->width : 0;
            view->height = !rc ? (uint32_t)image->height : 0;
            return rc;
        }
    return base_fail(err, BASE_EINVAL, "%s: neither manifest.json nor a picture called reference in it", folder);
}

/* The picture cut into blocks; what NULL: it is the reference. */
static int write_crops(const struct ggn_study_request_views *q, int index, const struct ggn_study_view *view,
                       const char *what, const struct pic_image *image, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < view->n_blocks && !rc; i++) {
        const struct ggn_study_block *b = &view->blocks[i];
        size_t w = b->x1 - b->x0, h = b->y1 - b->y0;
        uint8_t *rgb = malloc(3 * w * h);
        if (!rgb)
            return base_fail_nomem(err, q->views[index]);
        for (size_t y = 0; y < h; y++)
            memcpy(rgb + 3 * w * y, image->u8 + 3 * ((b->y0 + y) * view->width + b->x0), 3 * w);
        rc = what ? write_block(q->dir, index, b, what, rgb, err) : write_reference(q->dir, index, b, rgb, err);
        free(rgb);
    }
    return rc;
}

static int cut_blocks(const struct ggn_study_request_views *q, struct ggn_study_view *view, int levels, struct base_err *err)
{
    uint32_t size = (uint32_t)q->block, columns = (view->width + size - 1) / size, rows = (view->height + size - 1) / size;
    if ((uint64_t)columns * rows > GGN_STUDY_MAX_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s: %u blocks of %u pixels; --block makes them larger", view->name,
                         columns * rows, size);
    view->blocks = calloc((size_t)columns * rows, sizeof *view->blocks);
    if (!view->blocks)
        return base_fail_nomem(err, view->name);
    for (uint32_t i = 0; i < columns * rows; i++) {
        uint32_t x0 = i % columns * size, y0 = i / columns * size;
        struct ggn_study_block *b = &view->blocks[view->n_blocks++];
        *b = (struct ggn_study_block){.id = i,
                                      .x0 = x0,
                                      .y0 = y0,
                                      .x1 = x0 + size < view->width ? x0 + size : view->width,
                                      .y1 = y0 + size < view->height ? y0 + size : view->height,
                                      .levels = malloc(((size_t)levels + 1) * sizeof *b->levels)};
        if (!b->levels)
            return base_fail_nomem(err, view->name);
    }
    return 0;
}

static int prepare_levels(const struct ggn_study_request_views *q, int index, const struct picture *list, int n,
                          const struct pic_image *reference, struct ggn_study_view *view, struct base_err *err)
{
    char what[32];
    const char *folder = q->views[index];
    int rc = cut_blocks(q, view, n, err);
    if (!rc)
        rc = write_crops(q, index, view, NULL, reference, err);
    for (int i = 0; i < n && !rc; i++) {
        struct pic_image image;
        if (list[i].spp < 1.0 || !takes(q, &view->blocks[0], list[i].spp))
            continue;
        rc = read_picture(folder, list[i].name, view, &image, err);
        if (rc)
            break;
        snprintf(what, sizeof what, "%.0f", list[i].spp);
        rc = write_crops(q, index, view, what, &image, err);
        pic_release(&image);
        for (int b = 0; b < view->n_blocks; b++)
            view->blocks[b].levels[view->blocks[b].n_levels++] = (uint32_t)list[i].spp;
    }
    return !rc ? enough_levels(folder, &view->blocks[0], err) : rc;
}

/* The first view says which conditions there are, the others must have the same. */
static int know_condition(struct ggn_study *s, int index, const char *name, const char *folder, struct base_err *err)
{
    if (!ggn_study_plain_name(name))
        return base_fail(err, BASE_EINVAL, "%s/%s: name pictures with letters, digits, '.', '_' and '-'", folder, name);
    for (int i = 0; i < s->n_conditions; i++)
        if (strcmp(s->conditions[i], name) == 0)
            return 0;
    if (index > 0 || s->n_conditions == GGN_STUDY_MAX_CONDITIONS)
        return base_fail(err, BASE_EINVAL, "%s: '%s' is not a picture that every view has, or there are too many", folder,
                         name);
    char(*more)[GGN_STUDY_NAME] = realloc(s->conditions, ((size_t)s->n_conditions + 1) * sizeof *more);
    if (!more)
        return base_fail_nomem(err, folder);
    s->conditions = more;
    strcpy(more[s->n_conditions++], name);
    return 0;
}

static int prepare_conditions(const struct ggn_study_request_views *q, int index, const struct picture *list, int n,
                              const struct pic_image *reference, struct ggn_study *s, struct base_err *err)
{
    char path[4096];
    const char *folder = q->views[index];
    uint8_t *noisy = NULL;
    int found = 0, rc = picture_path(path, q->dir, index, "reference", err);
    if (!rc)
        rc = pic_write_png(path, reference->width, reference->height, 3, reference->u8, err);
    if (!rc)
        rc = picture_path(path, q->dir, index, "heavy", err);
    if (!rc)
        rc = make_heavy(reference->u8, 3 * (size_t)reference->width * (size_t)reference->height, &noisy, err);
    if (!rc)
        rc = pic_write_png(path, reference->width, reference->height, 3, noisy, err);
    free(noisy);
    for (int i = 0; i < n && !rc; i++) {
        struct pic_image image;
        if (strcmp(list[i].stem, "reference") == 0 || strcmp(list[i].stem, "heavy") == 0)
            continue;
        rc = know_condition(s, index, list[i].stem, folder, err);
        if (!rc)
            rc = picture_path(path, q->dir, index, list[i].stem, err);
        if (!rc)
            rc = read_picture(folder, list[i].name, &s->views[index], &image, err);
        if (rc)
            break;
        rc = pic_write_png(path, image.width, image.height, 3, image.u8, err);
        pic_release(&image);
        found++;
    }
    if (!rc && (found == 0 || found != s->n_conditions))
        rc = base_fail(err, BASE_EINVAL, "%s: %d pictures beside the reference, wanted the same in every view", folder,
                       found);
    return rc;
}

static int prepare_folder(const struct ggn_study_request_views *q, int index, struct ggn_study *s, struct base_err *err)
{
    struct picture *list = NULL;
    struct pic_image reference;
    struct ggn_study_view *view = &s->views[index];
    int n = 0, rc = list_pictures(q->views[index], &list, &n, err);
    if (rc)
        return rc;
    rc = read_reference(q->views[index], list, n, view, &reference, err);
    if (!rc) {
        rc = s->task == GGN_STUDY_VALIDATION ? prepare_conditions(q, index, list, n, &reference, s, err)
                                             : prepare_levels(q, index, list, n, &reference, view, err);
        pic_release(&reference);
    }
    free(list);
    return rc;
}

/* --- the study --- */

static int prepare_view(const struct ggn_study_request_views *q, int index, struct ggn_study *s,
                        struct base_threads *threads, struct base_err *err)
{
    char path[4096], folder[64];
    struct ggn_study_view *view = &s->views[index];
    size_t n = strlen(q->views[index]);
    while (n > 1 && q->views[index][n - 1] == '/')
        n--;
    size_t start = n;
    while (start > 0 && q->views[index][start - 1] != '/')
        start--;
    snprintf(view->name, sizeof view->name, "%.*s", (int)(n - start), q->views[index] + start);
    if (!ggn_study_plain_name(view->name) || ggn_study_find_view(s, view->name) != index)
        return base_fail(err, BASE_EINVAL,
                         "%s: a view's folder needs a name of its own of letters, digits, '.', '_' and '-'",
                         q->views[index]);
    snprintf(folder, sizeof folder, "stimuli/v%d", index);
    int rc = base_file_join(path, q->views[index], "reference.png", err);
    if (!rc)
        rc = ggn_study_protect(q->dir, path, err);
    if (!rc)
        rc = base_file_join(path, q->dir, folder, err);
    if (!rc)
        rc = make_dir(path, err);
    if (!rc)
        rc = base_file_join(path, q->views[index], "manifest.json", err);
    if (rc)
        return rc;
    if (access(path, F_OK) != 0)
        return prepare_folder(q, index, s, err);
    if (s->task == GGN_STUDY_VALIDATION)
        return base_fail(err, BASE_EINVAL,
                         "%s: a validation takes folders of pictures; `ggn reconstruct` makes them from a sequence",
                         q->views[index]);
    return prepare_sequence(q, index, view, threads, err);
}

static int copy_texts(const struct ggn_study_request_views *q, struct base_err *err)
{
    char path[4096], *text = NULL;
    size_t size;
    int rc = base_file_join(path, q->page_dir, "texts.en.json", err);
    if (!rc)
        rc = base_file_read(path, 1 << 20, &text, &size, err);
    if (!rc)
        rc = base_file_join(path, q->dir, "texts.json", err);
    if (!rc && size > 0 && text[size - 1] == '\n')
        text[size - 1] = '\0';
    if (!rc)
        rc = base_file_write_line(path, text, err);
    free(text);
    return rc;
}

int ggn_study_prepare(const struct ggn_study_request_views *q, struct ggn_study *s, struct base_threads *threads,
                      struct base_err *err)
{
    char path[4096];
    int rc = make_dir(q->dir, err);
    if (!rc)
        rc = base_file_join(path, q->dir, "study.json", err);
    if (!rc && access(path, F_OK) == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: there is a study already", q->dir);
    if (!rc)
        rc = base_file_join(path, q->dir, "texts.json", err);
    if (!rc && access(path, F_OK) == 0)
        rc = base_fail(err, BASE_EINVAL, "%s: is there and would be replaced; move it away, and back after init", path);
    if (!rc)
        rc = base_file_join(path, q->dir, "stimuli", err);
    if (!rc)
        rc = make_dir(path, err);
    if (!rc)
        rc = ggn_study_token(s->id, 32, err);
    s->views = calloc((size_t)q->n_views, sizeof *s->views);
    if (!rc && !s->views)
        rc = base_fail_nomem(err, q->dir);
    for (int i = 0; i < q->n_views && !rc; i++) {
        s->n_views = i + 1;
        rc = prepare_view(q, i, s, threads, err);
    }
    if (!rc && ggn_study_plan_count(s) > GGN_STUDY_MAX_TRIALS)
        rc = base_fail(err, BASE_EINVAL, "more than %d trials for one person: take fewer views, trials or repeats",
                       GGN_STUDY_MAX_TRIALS);
    if (!rc)
        rc = copy_texts(q, err);
    return !rc ? ggn_study_write(q->dir, s, err) : rc;
}
