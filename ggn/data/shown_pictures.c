/* A view from a folder of pictures: reference, and one for each level or condition; a clip has folders of frames. */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/files.h"
#include "picture/read.h"
#include "data/shown_parts.h"

enum { MAX_ROWS = 16384 }; /* of the picture of a clip: browsers take so many */

struct picture {
    char name[256];            /* the file's, or of a clip the folder's */
    char stem[GGN_SHOWN_NAME]; /* without its extension */
    double number;             /* the digits at the end of the stem: samples per pixel, or which frame; -1 without any */
    int is_clip;
};

struct strip { /* a still, or the frames of a clip */
    int n;
    struct pic_image *frames; /* owns */
    double *numbers;          /* owns */
};

static void release_strip(struct strip *s)
{
    for (int i = 0; i < s->n; i++)
        pic_release(&s->frames[i]);
    free(s->frames);
    free(s->numbers);
    *s = (struct strip){0};
}

static int by_number(const void *a, const void *b)
{
    const struct picture *x = a, *y = b;
    int order = (x->number > y->number) - (x->number < y->number);
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
        struct stat info;
        struct picture *p = &list[count];
        p->is_clip = fstatat(dirfd(d), e->d_name, &info, 0) == 0 && S_ISDIR(info.st_mode);
        const char *dot = p->is_clip ? e->d_name + strlen(e->d_name) : strrchr(e->d_name, '.');
        if (!dot || e->d_name[0] == '.' || (size_t)(dot - e->d_name) >= sizeof p->stem)
            continue;
        snprintf(p->name, sizeof p->name, "%s", e->d_name);
        snprintf(p->stem, sizeof p->stem, "%.*s", (int)(dot - e->d_name), e->d_name);
        const char *digits = p->stem + strlen(p->stem);
        while (digits > p->stem && digits[-1] >= '0' && digits[-1] <= '9')
            digits--;
        p->number = *digits ? strtod(digits, NULL) : -1.0;
        count++;
    }
    closedir(d);
    qsort(list, (size_t)count, sizeof *list, by_number);
    *pictures = list;
    *n = count;
    return 0;
}

/* What a render with --denoise shows as this kind. */
static int read_kind(const char *path, enum ggn_shown_kind kind, struct pic_image *image, struct base_err *err)
{
    struct base_err why = {0};
    struct pic_image weight;
    int rc;
    if (kind == GGN_SHOWN_BLEND) { /* the picture itself, if it is one */
        rc = pic_read_channel(path, "lull.weight.V", &weight, &why);
        if (!rc) {
            pic_release(&weight);
            return pic_read_display(path, image, err);
        }
    } else {
        rc = pic_read_layer(path, ggn_shown_kind_names[kind], image, &why);
        if (!rc && (rc = pic_encode(path, image, &why)) != 0)
            pic_release(image);
    }
    return rc ? base_fail(err, rc, "%s (--kinds shows renders with --denoise)", why.text) : 0;
}

static int read_picture(const char *folder, const char *name, enum ggn_shown_kind kind, const struct ggn_shown_view *view,
                        struct pic_image *image, struct base_err *err)
{
    char path[4096];
    int rc = base_file_join(path, folder, name, err);
    if (!rc)
        rc = kind ? read_kind(path, kind, image, err) : pic_read_display(path, image, err);
    if (!rc && view->width && ((uint32_t)image->width != view->width || (uint32_t)image->height != view->height)) {
        rc = base_fail(err, BASE_EINVAL, "%s: %dx%d pixels, the reference has %ux%u", path, image->width, image->height,
                       view->width, view->height);
        pic_release(image);
    }
    return rc;
}

/* Frames must follow each other evenly, and be those of the reference (NULL: this is it). */
static int check_frames(const char *folder, const struct picture *list, int n, const struct strip *reference,
                        struct base_err *err)
{
    if (n < 2 || n > GGN_SHOWN_MAX_FRAMES)
        return base_fail(err, BASE_EINVAL, "%s: %d frames, wanted 2 … %d", folder, n, GGN_SHOWN_MAX_FRAMES);
    for (int i = 0; i < n; i++)
        if (list[i].is_clip || list[i].number < 0.0)
            return base_fail(err, BASE_EINVAL, "%s/%s: not a picture whose name ends in the number of its frame", folder,
                             list[i].name);
    double step = list[1].number - list[0].number;
    for (int i = 1; i < n && !reference; i++)
        if (list[i].number - list[i - 1].number != step || step <= 0.0)
            return base_fail(err, BASE_EINVAL, "%s: frames are missing between %.0f and %.0f, or one is there twice", folder,
                             list[i - 1].number, list[i].number);
    for (int i = 0; reference && i < reference->n; i++)
        if (i >= n || list[i].number != reference->numbers[i])
            return base_fail(err, BASE_EINVAL, "%s: no frame %.0f, which the reference has", folder, reference->numbers[i]);
    if (reference && n > reference->n)
        return base_fail(err, BASE_EINVAL, "%s: frame %.0f, which the reference does not have", folder,
                         list[reference->n].number);
    return 0;
}

/* The first that is read gives the view its size. */
static int read_frames(const char *folder, const struct picture *list, int n, enum ggn_shown_kind kind,
                       struct ggn_shown_view *view, struct strip *out, struct base_err *err)
{
    struct strip s = {.frames = calloc((size_t)n, sizeof *s.frames), .numbers = malloc((size_t)n * sizeof *s.numbers)};
    int rc = s.frames && s.numbers ? 0 : base_fail_nomem(err, folder);
    while (!rc && s.n < n) {
        struct pic_image *image = &s.frames[s.n];
        rc = read_picture(folder, list[s.n].name, kind, view, image, err);
        if (rc)
            break;
        view->width = (uint32_t)image->width;
        view->height = (uint32_t)image->height;
        s.numbers[s.n] = list[s.n].number;
        s.n++;
    }
    if (rc)
        release_strip(&s);
    else
        *out = s;
    return rc;
}

static int read_strip(const char *folder, const struct picture *p, enum ggn_shown_kind kind, const struct strip *reference,
                      struct ggn_shown_view *view, struct strip *out, struct base_err *err)
{
    char path[4096];
    struct picture *list = NULL;
    int n = 0;
    if (!p->is_clip)
        return read_frames(folder, p, 1, kind, view, out, err);
    int rc = base_file_join(path, folder, p->name, err);
    if (!rc)
        rc = list_pictures(path, &list, &n, err);
    if (!rc)
        rc = check_frames(path, list, n, reference, err);
    if (!rc)
        rc = read_frames(path, list, n, kind, view, out, err);
    free(list);
    return rc;
}

/* The picture, or the folder of frames, called reference. */
static int read_reference(const char *folder, const struct picture *list, int n, struct ggn_shown_view *view,
                          struct strip *out, struct base_err *err)
{
    for (int i = 0; i < n; i++)
        if (strcmp(list[i].stem, "reference") == 0) {
            int rc = read_strip(folder, &list[i], GGN_SHOWN_AS_IS, NULL, view, out, err);
            view->frames = !rc ? out->n : 1;
            return rc;
        }
    return base_fail(err, BASE_EINVAL, "%s: neither manifest.json nor a picture called reference in it", folder);
}

/* The pictures cut into blocks, if the view has any, frames below each other; what NULL: it is the reference. */
static int write_crops(const struct ggn_shown_request *q, int index, const struct ggn_shown_view *view, const char *what,
                       const struct strip *strip, struct base_err *err)
{
    const int width = (int)view->width, height = (int)view->height;
    int rc = view->blocks ? 0 : ggn_shown_write(q, index, NULL, what, width, height, strip->frames[0].u8, err);
    for (int i = 0; i < view->n_blocks && !rc; i++) {
        const struct ggn_shown_block *b = &view->blocks[i];
        size_t w = b->x1 - b->x0, h = b->y1 - b->y0, frames = (size_t)strip->n;
        uint8_t *rgb = malloc(3 * w * h * frames);
        if (!rgb)
            return base_fail_nomem(err, view->name);
        for (size_t y = 0; y < h * frames; y++)
            memcpy(rgb + 3 * w * y, strip->frames[y / h].u8 + 3 * ((b->y0 + y % h) * view->width + b->x0), 3 * w);
        rc = ggn_shown_write(q, index, b, what, (int)w, (int)(h * frames), rgb, err);
        free(rgb);
    }
    return rc;
}

static int cut_blocks(const struct ggn_shown_request *q, const struct ggn_shown_source *source, struct ggn_shown_view *view,
                      int levels, struct base_err *err)
{
    uint32_t size = (uint32_t)q->block, columns = (view->width + size - 1) / size, rows = (view->height + size - 1) / size;
    if ((uint64_t)columns * rows > GGN_SHOWN_MAX_BLOCKS)
        return base_fail(err, BASE_EINVAL, "%s: %u blocks of %u pixels; --block makes them larger", view->name,
                         columns * rows, size);
    if (view->frames > 1 && (uint32_t)view->frames * (size < view->height ? size : view->height) > MAX_ROWS)
        return base_fail(err, BASE_EINVAL,
                         "%s: %d frames of blocks of %u pixels, wanted at most %d rows in all; --block makes "
                         "them smaller",
                         view->name, view->frames, size, MAX_ROWS);
    view->blocks = calloc((size_t)columns * rows, sizeof *view->blocks);
    if (!view->blocks)
        return base_fail_nomem(err, view->name);
    for (uint32_t i = 0; i < columns * rows; i++) {
        uint32_t x0 = i % columns * size, y0 = i / columns * size;
        if (!ggn_shown_source_has(source, i))
            continue;
        struct ggn_shown_block *b = &view->blocks[view->n_blocks++];
        *b = (struct ggn_shown_block){.id = i,
                                      .x0 = x0,
                                      .y0 = y0,
                                      .x1 = x0 + size < view->width ? x0 + size : view->width,
                                      .y1 = y0 + size < view->height ? y0 + size : view->height,
                                      .levels = malloc(((size_t)levels + 1) * sizeof *b->levels)};
        if (!b->levels)
            return base_fail_nomem(err, view->name);
    }
    return ggn_shown_source_check(source, view, err);
}

/* The first view says which conditions there are, the others must have the same. */
static int know_condition(struct ggn_shown *s, int index, const char *name, const char *folder, struct base_err *err)
{
    if (!ggn_shown_plain_name(name))
        return base_fail(err, BASE_EINVAL, "%s/%s: name pictures with letters, digits, '.', '_' and '-'", folder, name);
    for (int i = 0; i < s->n_conditions; i++)
        if (strcmp(s->conditions[i], name) == 0)
            return 0;
    if (index > 0 || s->n_conditions == GGN_SHOWN_MAX_CONDITIONS)
        return base_fail(err, BASE_EINVAL, "%s: '%s' is not a picture that every view has, or there are too many", folder,
                         name);
    char(*more)[GGN_SHOWN_NAME] = realloc(s->conditions, ((size_t)s->n_conditions + 1) * sizeof *more);
    if (!more)
        return base_fail_nomem(err, folder);
    s->conditions = more;
    strcpy(more[s->n_conditions++], name);
    return 0;
}

static int is_condition(const struct picture *p)
{
    return strcmp(p->stem, "reference") != 0 && strcmp(p->stem, "heavy") != 0 && !p->is_clip;
}

/* Whether the level comes after those that the view's blocks have. */
static int is_level(const struct picture *p, const struct ggn_shown_request *q, const struct ggn_shown_view *view)
{
    return p->number >= 1.0 && p->is_clip == (view->frames > 1) && ggn_shown_takes_level(q, &view->blocks[0], p->number);
}

/* A validation shows whole pictures, of each condition; else blocks are shown, of each level. */
static int prepare(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                   const struct picture *list, int n, const struct strip *reference, struct ggn_shown *s,
                   struct base_err *err)
{
    const int whole = q->task == GGN_SHOWN_VALIDATION;
    struct ggn_shown_view *view = &s->views[index];
    int found = 0, rc = whole ? 0 : cut_blocks(q, source, view, n, err);
    if (!rc)
        rc = write_crops(q, index, view, NULL, reference, err);
    for (int i = 0; i < n && !rc; i++) {
        const struct picture *p = &list[i];
        struct strip strip = {0};
        char level[32];
        if (!(whole ? is_condition(p) : is_level(p, q, view)))
            continue;
        rc = whole ? know_condition(s, index, p->stem, source->folder, err) : 0;
        if (!rc)
            rc = read_strip(source->folder, p, view->kind, reference, view, &strip, err);
        if (rc)
            break;
        snprintf(level, sizeof level, "%.0f", p->number);
        rc = write_crops(q, index, view, whole ? p->stem : level, &strip, err);
        release_strip(&strip);
        for (int b = 0; b < view->n_blocks; b++)
            view->blocks[b].levels[view->blocks[b].n_levels++] = (uint32_t)p->number;
        found++;
    }
    if (rc || !whole)
        return rc ? rc : ggn_shown_enough_levels(source->folder, &view->blocks[0], err);
    return found > 0 && found == s->n_conditions
               ? 0
               : base_fail(err, BASE_EINVAL, "%s: %d pictures beside the reference, wanted the same in every view",
                           source->folder, found);
}

int ggn_shown_pictures(const struct ggn_shown_request *q, const struct ggn_shown_source *source, int index,
                       struct ggn_shown *s, struct base_err *err)
{
    struct picture *list = NULL;
    struct strip reference = {0};
    struct ggn_shown_view *view = &s->views[index];
    int n = 0, rc = list_pictures(source->folder, &list, &n, err);
    if (rc)
        return rc;
    rc = read_reference(source->folder, list, n, view, &reference, err);
    if (!rc && view->frames > 1 && q->task != GGN_SHOWN_TWO_INTERVAL)
        rc = base_fail(err, BASE_EINVAL, "%s: clips are shown in two intervals: --task thresholds --method 2ifc",
                       source->folder);
    else if (!rc)
        rc = prepare(q, source, index, list, n, &reference, s, err);
    release_strip(&reference);
    free(list);
    return rc;
}
