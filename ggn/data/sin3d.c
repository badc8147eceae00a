#include "data/sin3d.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/files.h"
#include "data/labels.h"
#include "picture/read.h"
#include "sequence/builder.h"
#include "sequence/manifest.h"
#include "data/rawls.h"

struct level {
    uint32_t spp;
    char file[256];
};

struct view {
    char dir[4096], prefix[GGN_VIEW_NAME];
    int n, is_rawls;
    struct level *levels; /* owns; rising */
};

/* NAME_00020.png -> prefix length and spp; 0 if the name is of another form. */
static size_t split_name(const char *name, uint32_t *spp, int *is_rawls)
{
    const char *dot = strrchr(name, '.');
    if (!dot || (strcmp(dot, ".png") != 0 && strcmp(dot, ".rawls") != 0))
        return 0;
    const char *digits = dot;
    while (digits > name && isdigit((unsigned char)digits[-1]))
        digits--;
    if (digits == dot || dot - digits > 9 || digits - name < 2 || digits[-1] != '_')
        return 0;
    *spp = (uint32_t)strtoul(digits, NULL, 10);
    *is_rawls = dot[1] == 'r';
    return *spp > 0 ? (size_t)(digits - 1 - name) : 0;
}

static int compare_levels(const void *a, const void *b)
{
    uint32_t x = ((const struct level *)a)->spp, y = ((const struct level *)b)->spp;
    return (x > y) - (x < y);
}

static int add_level(struct view *v, const char *name, struct base_err *err)
{
    uint32_t spp;
    int is_rawls;
    size_t length = split_name(name, &spp, &is_rawls);
    if (length == 0)
        return 0;
    if (length >= sizeof v->prefix || strlen(name) >= sizeof v->levels->file)
        return base_fail(err, BASE_EINVAL, "%s/%s: the name is too long", v->dir, name);
    if (v->n == 0) {
        memcpy(v->prefix, name, length);
        v->is_rawls = is_rawls;
    } else if (strncmp(v->prefix, name, length) != 0 || v->prefix[length] != '\0' || v->is_rawls != is_rawls) {
        return base_fail(err, BASE_EINVAL, "%s: '%s' does not belong to the sequence '%s'", v->dir, name, v->prefix);
    }
    struct level *levels = realloc(v->levels, (size_t)(v->n + 1) * sizeof *levels);
    if (!levels)
        return base_fail_nomem(err, v->dir);
    v->levels = levels;
    levels[v->n].spp = spp;
    strcpy(levels[v->n++].file, name);
    return 0;
}

static int scan(const char *dir, struct view *v, struct base_err *err)
{
    snprintf(v->dir, sizeof v->dir, "%s", dir);
    DIR *d = opendir(dir);
    if (!d)
        return base_fail(err, BASE_EIO, "%s: %s", dir, strerror(errno));
    int rc = 0;
    for (const struct dirent *e; !rc && (e = readdir(d));)
        rc = add_level(v, e->d_name, err);
    closedir(d);
    if (v->n > 0)
        qsort(v->levels, (size_t)v->n, sizeof *v->levels, compare_levels);
    return rc;
}

static int check_levels(const struct view *v, int allow_gaps, struct base_err *err)
{
    if (v->n < 2 || v->n > SEQ_MAX_RECORDS - 1)
        return base_fail(err, BASE_EINVAL, "%s: %d levels (at least 2 are needed)", v->dir, v->n);
    uint32_t step = v->levels[1].spp - v->levels[0].spp;
    for (int i = 1; i < v->n; i++) {
        uint32_t want = v->levels[i - 1].spp + step;
        if (v->levels[i].spp == v->levels[i - 1].spp)
            return base_fail(err, BASE_EINVAL, "%s: two images for %u spp", v->dir, v->levels[i].spp);
        if (v->levels[i].spp != want && !allow_gaps)
            return base_fail(err, BASE_EINVAL, "%s: the level at %u spp is missing (--allow-gaps takes what is there)",
                             v->dir, v->levels[i].spp < want ? v->levels[i].spp : want);
    }
    return 0;
}

int ggn_sin3d_is_view(const char *dir)
{
    struct view v = {0};
    int ok = scan(dir, &v, NULL) == 0 && v.n > 0;
    free(v.levels);
    return ok;
}

void ggn_sin3d_scene(const char *view, char *scene, size_t room)
{
    const char *cut = NULL;
    for (const char *p = view; (p = strstr(p, "view")) != NULL; p++)
        if (p > view && (p[-1] == '-' || p[-1] == '_') && isdigit((unsigned char)p[4]))
            cut = p - 1;
    snprintf(scene, room, "%.*s", cut ? (int)(cut - view) : (int)strlen(view), view);
}

/* One level: codes and, from files of floats, linear values. */
static int read_picture(const struct view *v, const struct level *level, struct pic_image *p, struct base_err *err)
{
    char path[4400];
    snprintf(path, sizeof path, "%s/%s", v->dir, level->file);
    if (!v->is_rawls)
        return pic_read_display(path, p, err);
    int rc = ggn_rawls_read(path, p, err);
    if (!rc && (rc = pic_encode(path, p, err)) != 0)
        pic_release(p);
    return rc;
}

/* Work on one row of blocks: all its builders fill level by level, so that each image is read once per row. */
struct row {
    int columns, block, y0;
    struct seq_builder *builders; /* [columns] */
    uint8_t *display;             /* [3][block^2] */
    double *mean;
};

static void cut_block(const struct pic_image *p, int x0, int y0, int block, uint8_t *display, double *mean)
{
    size_t pixels = (size_t)block * (size_t)block;
    for (int y = 0; y < block; y++)
        for (int x = 0; x < block; x++)
            for (size_t c = 0; c < 3; c++) {
                size_t from = ((size_t)(y0 + y) * (size_t)p->width + (size_t)(x0 + x)) * 3 + c;
                size_t to = c * pixels + (size_t)y * (size_t)block + (size_t)x;
                display[to] = p->u8[from];
                if (p->f32)
                    mean[to] = (double)p->f32[from];
            }
}

static int add_picture(struct row *row, const struct pic_image *p, uint32_t spp, int is_reference, struct base_err *err)
{
    int rc = 0;
    for (int c = 0; c < row->columns && !rc; c++) {
        cut_block(p, c * row->block, row->y0, row->block, row->display, row->mean);
        struct seq_frame f = {
            .spp = spp, .is_reference = is_reference, .display = row->display, .mean = p->f32 ? row->mean : NULL};
        rc = seq_builder_add(&row->builders[c], &f, err);
    }
    return rc;
}

static int fill_row(const struct view *v, const struct seq_manifest *m, struct row *row, const struct ggn_sin3d_options *o,
                    int base, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < v->n && !rc; i++) {
        struct pic_image p;
        rc = read_picture(v, &v->levels[i], &p, err);
        if (rc)
            return rc;
        if ((uint32_t)p.width != m->width || (uint32_t)p.height != m->height)
            rc = base_fail(err, BASE_EINVAL, "%s/%s: %dx%d, the other levels are %ux%u", v->dir, v->levels[i].file, p.width,
                           p.height, m->width, m->height);
        if (!rc)
            rc = add_picture(row, &p, v->levels[i].spp, 0, err);
        if (!rc && i + 1 == v->n)
            rc = add_picture(row, &p, v->levels[i].spp, 1, err);
        pic_release(&p);
        if (o->progress)
            o->progress(o->data, v->prefix, base + i + 1, (int)(m->height / m->block) * v->n);
    }
    return rc;
}

static int import_row(const struct view *v, const char *out, struct seq_manifest *m, int index,
                      const struct ggn_sin3d_options *o, struct base_err *err)
{
    uint32_t block = m->block;
    struct row row = {.columns = (int)(m->width / block), .block = (int)block, .y0 = index * (int)block};
    size_t pixels = (size_t)block * block;
    int rc = 0;
    row.builders = calloc((size_t)row.columns, sizeof *row.builders);
    row.display = malloc(3 * pixels);
    row.mean = malloc(3 * pixels * sizeof *row.mean);
    if (!row.builders || !row.display || !row.mean)
        rc = base_fail_nomem(err, v->dir);
    for (int c = 0; c < row.columns && !rc; c++)
        rc = seq_builder_init(&row.builders[c], block, block, c * (int)block, row.y0, (uint32_t)(index * row.columns + c), 0,
                              err);
    if (!rc)
        rc = fill_row(v, m, &row, o, index * v->n, err);
    for (int c = 0; c < row.columns && !rc; c++) {
        uint32_t x0 = (uint32_t)c * block, y0 = (uint32_t)row.y0;
        struct seq_manifest_block *b = &m->blocks[m->n_blocks];
        char path[4200];
        *b = (struct seq_manifest_block){
            .id = (uint32_t)(index * row.columns + c), .x0 = x0, .y0 = y0, .x1 = x0 + block, .y1 = y0 + block};
        snprintf(b->file, sizeof b->file, "block-%05u.lseq", b->id);
        snprintf(path, sizeof path, "%s/%s", out, b->file);
        rc = seq_builder_write(&row.builders[c], path, &b->crc32, err);
        b->bytes = row.builders[c].size;
        m->n_blocks += !rc;
    }
    for (int c = 0; c < row.columns && row.builders; c++)
        seq_builder_release(&row.builders[c]);
    free(row.mean);
    free(row.display);
    free(row.builders);
    return rc;
}

static int init_manifest(const struct view *v, const struct ggn_sin3d_options *o, struct seq_manifest *m,
                         struct base_err *err)
{
    struct pic_image first;
    int rc = read_picture(v, &v->levels[0], &first, err);
    if (rc)
        return rc;
    *m = (struct seq_manifest){.width = (uint32_t)first.width,
                               .height = (uint32_t)first.height,
                               .block = (uint32_t)o->block,
                               .reference_spp = v->levels[v->n - 1].spp,
                               .reference_independent = 0,
                               .n_levels = (uint32_t)v->n};
    pic_release(&first);
    ggn_sin3d_scene(v->prefix, m->scene, sizeof m->scene);
    snprintf(m->source, sizeof m->source, "%.255s", v->prefix);
    snprintf(m->renderer, sizeof m->renderer, "SIN3D (imported)");
    if (m->width % m->block != 0 || m->height % m->block != 0)
        return base_fail(err, BASE_EINVAL, "%s: %ux%u is not a multiple of the block of %u", v->dir, m->width, m->height,
                         m->block);
    size_t blocks = (size_t)(m->width / m->block) * (m->height / m->block);
    m->levels = malloc((size_t)v->n * sizeof *m->levels);
    m->blocks = malloc(blocks * sizeof *m->blocks);
    if (!m->levels || !m->blocks)
        return base_fail_nomem(err, v->dir);
    for (int i = 0; i < v->n; i++)
        m->levels[i] = v->levels[i].spp;
    return 0;
}

/* Takes over the blocks of an earlier run with the same images. Whole rows only. */
static int take_over(const char *out, struct seq_manifest *m, struct base_err *err)
{
    struct seq_manifest old;
    char path[4200];
    struct stat st;
    snprintf(path, sizeof path, "%s/manifest.json", out);
    if (stat(path, &st) != 0)
        return 0;
    int rc = seq_manifest_read(out, &old, err);
    if (rc)
        return rc;
    uint32_t columns = m->width / m->block, most = columns * (m->height / m->block);
    if (old.width != m->width || old.height != m->height || old.block != m->block || strcmp(old.source, m->source) != 0 ||
        old.n_levels != m->n_levels || memcmp(old.levels, m->levels, m->n_levels * sizeof *m->levels) != 0)
        rc = base_fail(err, BASE_EINVAL, "%s: holds another sequence already", out);
    else if (old.n_blocks <= most) {
        m->n_blocks = old.n_blocks / columns * columns;
        memcpy(m->blocks, old.blocks, m->n_blocks * sizeof *m->blocks);
    }
    seq_manifest_release(&old);
    return rc;
}

static int attach_thresholds(const struct view *v, const char *out, const struct seq_manifest *m,
                             const struct ggn_thresholds *t, int *labelled, struct base_err *err)
{
    char with_part[GGN_VIEW_NAME + 8];
    snprintf(with_part, sizeof with_part, "%s_part6", v->prefix);
    const struct ggn_view *row = !t ? NULL : ggn_thresholds_find(t, with_part);
    if (t && !row)
        row = ggn_thresholds_find(t, v->prefix);
    if (t && !row)
        row = ggn_thresholds_find(t, base_file_name(v->dir));
    *labelled = row != NULL;
    if (!row)
        return 0;
    struct ggn_labels labels;
    struct base_err why = {0};
    int rc = ggn_thresholds_label(row, m, &labels, &why);
    if (rc)
        return base_fail(err, why.code, "%s: %s", v->dir, why.text);
    rc = ggn_labels_write(out, &labels, 0, err);
    ggn_labels_release(&labels);
    return rc;
}

int ggn_sin3d_import_view(const char *dir, const char *out, const struct ggn_sin3d_options *o, int *labelled,
                          struct base_err *err)
{
    struct view v = {0};
    struct seq_manifest m = {0};
    int rc = strlen(dir) < sizeof v.dir && strlen(out) < 4096
                 ? scan(dir, &v, err)
                 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
    if (!rc)
        rc = check_levels(&v, o->allow_gaps, err);
    if (!rc)
        rc = init_manifest(&v, o, &m, err);
    int made = !rc && mkdir(out, 0777) == 0;
    if (!rc && !made && errno != EEXIST)
        rc = base_fail(err, BASE_EIO, "%s: %s", out, strerror(errno));
    if (!rc)
        rc = take_over(out, &m, err);
    for (uint32_t row = !rc ? m.n_blocks / (m.width / m.block) : 0; !rc && row < m.height / m.block; row++) {
        rc = import_row(&v, out, &m, (int)row, o, err);
        if (!rc)
            rc = seq_manifest_write(out, &m, err);
    }
    if (!rc)
        rc = attach_thresholds(&v, out, &m, o->thresholds, labelled, err);
    if (rc && made)
        rmdir(out); /* goes only if it is empty */
    seq_manifest_release(&m);
    free(v.levels);
    return rc;
}
