#define _GNU_SOURCE /* memmem */
#include "data/import.h"

#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/bytes.h"
#include "base/colour.h"
#include "base/files.h"
#include "data/labels.h"
#include "picture/read.h"
#include "sequence/manifest.h"
#include "sequence/tail.h"

struct level {
    uint32_t spp;
    char file[256], half[256]; /* half: the mean of the first half of the samples; "": none */
};

struct view {
    char dir[4096], prefix[GGN_VIEW_NAME];
    const char *ending;   /* of all files, static */
    int n, has_halves;    /* has_halves: in files of their own, or as a layer of each level's */
    int pictures;         /* halves included */
    struct level *levels; /* owns; rising */
};

static const char HALF[] = "half"; /* behind a file's name, or the layer */
/* Those behind the first READ name pictures that are not read: what light their numbers are is not known. */
enum { READ = 5 };
static const char *const endings[] = {".png", ".exr", ".jpg", ".jpeg", ".rawls", ".tif", ".tiff",
                                      ".hdr", ".pfm", ".bmp", ".tga",  ".webp",  NULL};

/* Of a picture's name; NULL: it is none's. */
static const char *const *ending_of(const char *name)
{
    const char *dot = strrchr(name, '.');
    const char *const *e = endings;
    while (*e && (!dot || strcasecmp(dot, *e) != 0))
        e++;
    return *e ? e : NULL;
}

/* NAME_00020.png -> length of NAME, samples, whether it is NAME_half; 0: no level has such a name. Between name and number
 * stands '_', '-' or '.'. */
static size_t split_name(const char *name, uint32_t *spp, int *is_half, const char **ending)
{
    const char *const *found = ending_of(name);
    const char *dot = strrchr(name, '.'), *digits = dot;
    if (!found)
        return 0;
    while (digits > name && isdigit((unsigned char)digits[-1]))
        digits--;
    if (digits == dot || dot - digits > 9 || digits - name < 2 || !strchr("_-.", digits[-1]))
        return 0;
    *spp = (uint32_t)strtoul(digits, NULL, 10);
    *ending = *found;
    size_t length = (size_t)(digits - 1 - name);
    const size_t half = sizeof HALF - 1;
    *is_half = length > half + 1 && !memcmp(name + length - half, HALF, half) && strchr("_-.", name[length - half - 1]);
    return *spp > 0 ? length - (*is_half ? half + 1 : 0) : 0;
}

static int compare_levels(const void *a, const void *b)
{
    uint32_t x = ((const struct level *)a)->spp, y = ((const struct level *)b)->spp;
    return (x > y) - (x < y);
}

/* The level of so many samples; a new one where there is none. NULL: out of memory. */
static struct level *find_level(struct view *v, uint32_t spp)
{
    for (int i = 0; i < v->n; i++)
        if (v->levels[i].spp == spp)
            return &v->levels[i];
    struct level *levels = realloc(v->levels, (size_t)(v->n + 1) * sizeof *levels);
    if (!levels)
        return NULL;
    v->levels = levels;
    levels[v->n] = (struct level){.spp = spp};
    return &levels[v->n++];
}

/* Names of one sequence among those of a folder. */
struct series {
    char prefix[GGN_VIEW_NAME];
    int pictures;
};

/* The series of each name of a level; *largest among equals is that which came first. Returns how many there are, or
 * BASE_ENOMEM. */
static int list_series(struct dirent **entries, int n, struct series **out, int *largest)
{
    struct series *list = malloc((size_t)(n + 1) * sizeof *list);
    int count = 0, is_half;
    const char *ending;
    uint32_t spp;
    if (!list)
        return BASE_ENOMEM;
    for (int i = 0; i < n; i++) {
        const char *name = entries[i]->d_name;
        const size_t length = split_name(name, &spp, &is_half, &ending);
        int k = 0;
        if (length == 0 || length >= GGN_VIEW_NAME)
            continue;
        while (k < count && !(strncmp(list[k].prefix, name, length) == 0 && list[k].prefix[length] == '\0'))
            k++;
        if (k == count) {
            list[count] = (struct series){0};
            memcpy(list[count++].prefix, name, length);
        }
        list[k].pictures++;
    }
    *largest = 0;
    for (int k = 1; k < count; k++)
        *largest = list[k].pictures > list[*largest].pictures ? k : *largest;
    *out = list;
    return count;
}

static int is_visible(const struct dirent *e) { return e->d_name[0] != '.'; }

static int add_file(struct view *v, const char *name, struct base_err *err)
{
    uint32_t spp;
    int is_half;
    const char *ending;
    const size_t length = split_name(name, &spp, &is_half, &ending);
    if (length == 0 || strncmp(v->prefix, name, length) != 0 || v->prefix[length] != '\0')
        return 0;
    if (strlen(name) >= sizeof v->levels->file)
        return base_fail(err, BASE_EINVAL, "%s/%s: the name is too long", v->dir, name);
    if (ending_of(name) - endings >= READ)
        return base_fail(err, BASE_EINVAL, "%s/%s: such pictures are not read (expected .exr, .png, .jpg or .rawls)", v->dir,
                         name);
    if (v->ending && v->ending != ending)
        return base_fail(err, BASE_EINVAL, "%s/%s: the sequence '%s' has %s files, too", v->dir, name, v->prefix, v->ending);
    v->ending = ending;
    struct level *level = find_level(v, spp);
    if (!level)
        return base_fail_nomem(err, v->dir);
    char *file = is_half ? level->half : level->file;
    if (file[0])
        return base_fail(err, BASE_EINVAL, "%s: two images for %u spp, '%s' and '%s'", v->dir, spp, file, name);
    strcpy(file, name);
    return 0;
}

/* The folder's one sequence. Single pictures of other names are none; a second sequence might be what was meant. In order
 * of name, so that the first file that is wrong is the same on every file system. */
static int scan(const char *dir, struct view *v, struct base_err *err)
{
    struct dirent **entries;
    struct series *series = NULL;
    int rc = 0, largest, n = scandir(dir, &entries, is_visible, alphasort);
    snprintf(v->dir, sizeof v->dir, "%s", dir);
    if (n < 0)
        return base_fail(err, BASE_EIO, "%s: %s", dir, strerror(errno));
    const int count = list_series(entries, n, &series, &largest);
    if (count < 0)
        rc = base_fail_nomem(err, dir);
    else if (count > 0) {
        v->pictures = series[largest].pictures;
        snprintf(v->prefix, sizeof v->prefix, "%s", series[largest].prefix);
    }
    for (int k = 0; k < count && !rc; k++)
        if (k != largest && (series[k].pictures > 1 || v->pictures == 1))
            rc = base_fail(err, BASE_EINVAL, "%s: pictures of '%s' and of '%s' (expected those of one view)", dir, v->prefix,
                           series[k].prefix);
    for (int i = 0; i < n; i++) {
        if (!rc)
            rc = add_file(v, entries[i]->d_name, err);
        free(entries[i]);
    }
    free(entries);
    free(series);
    if (v->n > 0)
        qsort(v->levels, (size_t)v->n, sizeof *v->levels, compare_levels);
    return rc;
}

int ggn_import_pictures(const char *dir)
{
    struct view v = {0};
    scan(dir, &v, NULL);
    free(v.levels);
    return v.pictures;
}

int ggn_import_looks_numbered(const char *dir)
{
    struct dirent **entries;
    int found = 0, n = scandir(dir, &entries, is_visible, NULL);
    for (int i = 0; i < n; i++) {
        const char *name = entries[i]->d_name;
        found += ending_of(name) && strcspn(name, "0123456789") < (size_t)(strrchr(name, '.') - name);
        free(entries[i]);
    }
    if (n >= 0)
        free(entries);
    return found > 1;
}

/* Samples of the first level that an evenly spaced sequence lacks: most steps are the smallest one, and the others are
 * multiples of it. 0: none, or the levels follow another rule. */
static uint32_t missing_level(const struct view *v)
{
    uint32_t step = UINT32_MAX, missing = 0;
    int even = 0, multiples = 0;
    for (int i = 1; i < v->n; i++)
        if (v->levels[i].spp - v->levels[i - 1].spp < step)
            step = v->levels[i].spp - v->levels[i - 1].spp;
    for (int i = 1; i < v->n; i++) {
        const uint32_t here = v->levels[i].spp - v->levels[i - 1].spp;
        even += here == step;
        multiples += here % step == 0;
        missing = !missing && here != step ? v->levels[i - 1].spp + step : missing;
    }
    return 2 * even > v->n - 1 && multiples == v->n - 1 ? missing : 0;
}

static int check_levels(const struct view *v, int allow_gaps, struct base_err *err)
{
    int halves = 0;
    if (v->n < 2 || v->n > SEQ_MAX_RECORDS - 1)
        return base_fail(err, BASE_EINVAL, "%s: %d levels (at least 2 are needed)", v->dir, v->n);
    for (int i = 0; i < v->n; i++) {
        if (!v->levels[i].file[0])
            return base_fail(err, BASE_EINVAL, "%s/%s: a half without the image of all %u samples", v->dir,
                             v->levels[i].half, v->levels[i].spp);
        halves += v->levels[i].half[0] != '\0';
    }
    if (halves && halves < v->n)
        return base_fail(err, BASE_EINVAL, "%s: %d of %d levels have a half; all or none are needed", v->dir, halves, v->n);
    if (v->levels[0].spp < 2 && halves)
        return base_fail(err, BASE_EINVAL, "%s: the half of one sample", v->dir);
    const uint32_t missing = allow_gaps ? 0 : missing_level(v);
    return missing ? base_fail(err, BASE_EINVAL, "%s: the level at %u spp is missing (--allow-gaps takes what is there)",
                               v->dir, missing)
                   : 0;
}

int ggn_import_check(const char *dir, const struct ggn_import_options *o, struct base_err *err)
{
    struct view v = {0};
    int rc = scan(dir, &v, err);
    if (!rc)
        rc = check_levels(&v, o->allow_gaps, err);
    free(v.levels);
    return rc;
}

void ggn_import_scene(const char *view, char *scene, size_t room)
{
    const char *cut = NULL;
    for (const char *p = view; (p = strstr(p, "view")) != NULL; p++)
        if (p > view && (p[-1] == '-' || p[-1] == '_') && isdigit((unsigned char)p[4]))
            cut = p - 1;
    snprintf(scene, room, "%.*s", cut ? (int)(cut - view) : (int)strlen(view), view);
}

int ggn_rawls_parse(const char *path, const char *data, size_t size, struct pic_image *image, struct base_err *err)
{
    static const char head[] = "IHDR\n12\n", comments[] = "\nCOMMENTS\n", mark[] = "\nDATA\n";
    const size_t fixed = sizeof head - 1 + 12 + sizeof comments - 1;
    if (size < fixed || memcmp(data, head, sizeof head - 1) != 0 || memcmp(data + 20, comments, sizeof comments - 1) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a rawls image", path);
    const uint8_t *start = (const uint8_t *)data;
    uint32_t width = base_get_u32(start + 8), height = base_get_u32(start + 12), channels = base_get_u32(start + 16);
    if (width < 1 || height < 1 || width > PIC_MAX_SIDE || height > PIC_MAX_SIDE ||
        (size_t)width * height > PIC_MAX_PIXELS || (channels != 1 && channels != 3))
        return base_fail(err, BASE_EINVAL, "%s: %ux%u with %u channels cannot be used", path, width, height, channels);
    const char *end = data + size, *p = memmem(data + fixed - 1, size - fixed + 1, mark, sizeof mark - 1);
    /* the line with the size says nothing new */
    p = p ? memchr(p + sizeof mark - 1, '\n', (size_t)(end - p) - (sizeof mark - 1)) : NULL;
    size_t row = (size_t)width * channels * 4 + 1;
    if (!p || (size_t)(end - (p + 1)) < row * height - 1)
        return base_fail(err, BASE_EINVAL, "%s: truncated", path);
    float *out = malloc((size_t)width * height * 3 * sizeof *out);
    if (!out)
        return base_fail_nomem(err, path);
    float *to = out;
    p++;
    for (uint32_t y = 0; y < height; y++, p++)
        for (uint32_t x = 0; x < width; x++, p += 4 * channels)
            for (uint32_t c = 0; c < 3; c++) {
                *to = base_f32_of_bits(base_get_u32((const uint8_t *)(p + 4 * (channels == 3 ? c : 0))));
                if (!isfinite(*to++)) {
                    free(out);
                    return base_fail(err, BASE_EINVAL, "%s: pixel %u,%u is not finite", path, x, y);
                }
            }
    *image = (struct pic_image){.width = (int)width, .height = (int)height, .channels = 3, .is_float_file = 1, .f32 = out};
    return 0;
}

static int read_rawls(const char *path, struct pic_image *image, struct base_err *err)
{
    char *data;
    size_t size;
    int rc = base_file_read(path, (size_t)1 << 31, &data, &size, err);
    if (rc)
        return rc;
    rc = ggn_rawls_parse(path, data, size, image, err);
    free(data);
    return rc;
}

static int check_finite(const char *path, const struct pic_image *p, struct base_err *err)
{
    const size_t n = p->f32 ? 3 * (size_t)p->width * (size_t)p->height : 0;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(p->f32[i]))
            return base_fail(err, BASE_EINVAL, "%s: pixel %zu,%zu is not finite", path, i / 3 % (size_t)p->width,
                             i / 3 / (size_t)p->width);
    return 0;
}

/* Codes and, from files of light, linear values. layer: those of the first half of the samples in the same file, without
 * codes; NULL: the picture. */
static int read_picture(const struct view *v, const char *file, const char *layer, struct pic_image *p, struct base_err *err)
{
    char path[4400];
    snprintf(path, sizeof path, "%s/%s", v->dir, file);
    int rc = layer                              ? pic_read_layer(path, layer, p, err)
             : strcmp(v->ending, ".rawls") == 0 ? read_rawls(path, p, err)
                                                : pic_read_light(path, p, err);
    if (rc)
        return rc;
    rc = layer || p->u8 ? 0 : pic_encode(path, p, err);
    if (!rc)
        rc = check_finite(path, p, err);
    if (rc)
        pic_release(p);
    return rc;
}

/* The level's image and, with v->has_halves, the half of its samples. */
struct pair {
    struct pic_image all, half;
};

static void pair_release(struct pair *p)
{
    pic_release(&p->all);
    pic_release(&p->half);
}

/* p: zeroed. */
static int read_pair(const struct view *v, const struct level *level, struct pair *p, struct base_err *err)
{
    const int own_file = level->half[0] != '\0';
    int rc = read_picture(v, level->file, NULL, &p->all, err);
    if (!rc && v->has_halves)
        rc = read_picture(v, own_file ? level->half : level->file, own_file ? NULL : HALF, &p->half, err);
    if (!rc && v->has_halves && (p->half.width != p->all.width || p->half.height != p->all.height))
        rc = base_fail(err, BASE_EINVAL, "%s/%s: %dx%d, its half has %dx%d", v->dir, level->file, p->all.width,
                       p->all.height, p->half.width, p->half.height);
    if (rc)
        pair_release(p);
    return rc;
}

static int has_half_layer(const struct view *v, const struct level *level)
{
    struct pic_image half = {0};
    char path[4400];
    snprintf(path, sizeof path, "%s/%s", v->dir, level->file);
    int has = !pic_read_layer(path, HALF, &half, NULL);
    pic_release(&half);
    return has;
}

/* In files of their own, or in those of all levels: where the first has one, reading the others will tell. */
static int find_halves(struct view *v, struct base_err *err)
{
    const int is_exr = !strcmp(v->ending, ".exr");
    v->has_halves = v->levels[0].half[0] || (is_exr && has_half_layer(v, &v->levels[0]));
    for (int i = 1; i < v->n && is_exr && !v->has_halves; i++)
        if (has_half_layer(v, &v->levels[i]))
            return base_fail(err, BASE_EINVAL, "%s: '%s' has a half, '%s' has none; all or none are needed", v->dir,
                             v->levels[i].file, v->levels[0].file);
    return 0;
}

/* The pixels that EXR store are the same ones of their pictures. */
static int check_windows(const struct view *v, struct base_err *err)
{
    struct pic_window first = {0}, here;
    for (int i = 0; i < 2 * v->n; i++) {
        const char *file = i % 2 ? v->levels[i / 2].half : v->levels[i / 2].file;
        char path[4400];
        snprintf(path, sizeof path, "%s/%s", v->dir, file);
        if (!*file || pic_read_header(path, &here, NULL, 0, NULL) != 0)
            continue; /* reading the pixels says why */
        if (!first.width)
            first = here;
        if (here.x0 != first.x0 || here.y0 != first.y0)
            return base_fail(err, BASE_EINVAL, "%s: its data window begins at %d,%d, that of '%s' at %d,%d", path, here.x0,
                             here.y0, v->levels[0].file, first.x0, first.y0);
    }
    return 0;
}

/* Work on one row of blocks: all its builders fill level by level, so that each image is read once per row. */
struct row {
    int columns, block, y0, has_halves;
    struct seq_builder *builders; /* [columns] */
    uint8_t *display;             /* [3][block^2] */
    double *mean, *first, *half;  /* the same, linear: of all samples, of the first half, half their difference */
    double *none, *scratch;       /* [block^2] */
};

static double value_of(const struct pic_image *p, size_t at)
{
    return p->f32 ? (double)p->f32[at] : base_srgb_eotf(p->u8[at] / 255.0);
}

/* D = (A - B) / 2 where A is the mean of the first h of n samples, B that of the others. */
static double difference(double all, double first, double n, double h) { return 0.5 * n / (n - h) * (first - all); }

static void cut_block(const struct row *row, const struct pair *p, int x0, uint32_t spp)
{
    const size_t pixels = (size_t)row->block * (size_t)row->block;
    for (int y = 0; y < row->block; y++)
        for (int x = 0; x < row->block; x++)
            for (size_t c = 0; c < 3; c++) {
                size_t from = ((size_t)(row->y0 + y) * (size_t)p->all.width + (size_t)(x0 + x)) * 3 + c;
                size_t to = c * pixels + (size_t)y * (size_t)row->block + (size_t)x;
                row->display[to] = p->all.u8[from];
                if (p->all.f32 || row->has_halves)
                    row->mean[to] = value_of(&p->all, from);
                if (!row->has_halves)
                    continue;
                row->first[to] = value_of(&p->half, from);
                row->half[to] = difference(row->mean[to], row->first[to], spp, spp / 2);
            }
}

static int add_picture(struct row *row, const struct pair *p, uint32_t spp, int full, int is_reference, struct base_err *err)
{
    /* what is known without the samples' squares: errors by the half buffer, its tail */
    static const int known[] = {SEQ_DAMMERTZ, SEQ_HALF_UNSETTLED, SEQ_TAIL999, SEQ_GINI};
    enum { KNOWN = sizeof known / sizeof known[0] };
    struct seq_stat all[SEQ_STATISTICS], stats[KNOWN];
    int rc = 0;
    for (int c = 0; c < row->columns && !rc; c++) {
        cut_block(row, p, c * row->block, spp);
        struct seq_frame f = {.spp = spp, .is_reference = is_reference, .display = row->display};
        f.mean = p->all.f32 || row->has_halves ? row->mean : NULL;
        if (row->has_halves) {
            f.half = row->half;
            f.half_spp = spp / 2;
            f.full = full;
            seq_statistics(row->mean, row->first, row->half, row->none, (size_t)row->block * (size_t)row->block, spp,
                           row->scratch, all);
            for (int i = 0; i < KNOWN; i++)
                stats[i] = all[known[i]];
            f.stats = stats;
            f.n_stats = KNOWN;
        }
        rc = seq_builder_add(&row->builders[c], &f, err);
    }
    return rc;
}

static int fill_row(const struct view *v, const struct seq_manifest *m, struct row *row, const struct ggn_import_options *o,
                    int base, struct base_err *err)
{
    int rc = 0, full = 0; /* full: the level from which others are simulated */
    while (full + 1 < v->n && v->levels[full].spp < 320)
        full++;
    for (int i = 0; i < v->n && !rc; i++) {
        struct pair p = {0};
        rc = read_pair(v, &v->levels[i], &p, err);
        if (rc)
            return rc;
        if ((uint32_t)p.all.width != m->width || (uint32_t)p.all.height != m->height)
            rc = base_fail(err, BASE_EINVAL, "%s/%s: %dx%d, the other levels are %ux%u", v->dir, v->levels[i].file,
                           p.all.width, p.all.height, m->width, m->height);
        if (!rc)
            rc = add_picture(row, &p, v->levels[i].spp, i == full, 0, err);
        if (!rc && i + 1 == v->n && m->reference_spp)
            rc = add_picture(row, &p, v->levels[i].spp, 0, 1, err);
        pair_release(&p);
        if (o->progress)
            o->progress(o->data, v->prefix, base + i + 1, (int)(m->height / m->block) * v->n);
    }
    return rc;
}

static int import_row(const struct view *v, const char *out, struct seq_manifest *m, int index,
                      const struct ggn_import_options *o, struct base_err *err)
{
    const uint32_t block = m->block, columns = m->width / block;
    const size_t pixels = (size_t)block * block;
    struct row row = {.columns = (int)columns,
                      .block = (int)block,
                      .y0 = index * (int)block,
                      .has_halves = v->has_halves,
                      .builders = calloc(columns, sizeof *row.builders),
                      .display = malloc(3 * pixels),
                      .mean = calloc(11 * pixels, sizeof *row.mean)};
    int rc = row.builders && row.display && row.mean ? 0 : base_fail_nomem(err, v->dir);
    if (!rc) {
        row.first = row.mean + 3 * pixels;
        row.half = row.first + 3 * pixels;
        row.none = row.half + 3 * pixels;
        row.scratch = row.none + pixels;
    }
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
    free(row.builders);
    free(row.display);
    free(row.mean); /* one allocation of all doubles */
    return rc;
}

static int init_manifest(const struct view *v, const struct ggn_import_options *o, struct seq_manifest *m,
                         struct base_err *err)
{
    struct pic_image first;
    int rc = read_picture(v, v->levels[0].file, NULL, &first, err);
    if (rc)
        return rc;
    *m = (struct seq_manifest){.width = (uint32_t)first.width,
                               .height = (uint32_t)first.height,
                               .block = (uint32_t)o->block,
                               .reference_spp = v->has_halves ? 0 : v->levels[v->n - 1].spp,
                               .reference_independent = v->has_halves,
                               .n_levels = (uint32_t)v->n};
    pic_release(&first);
    ggn_import_scene(v->prefix, m->scene, sizeof m->scene);
    snprintf(m->source, sizeof m->source, "%.255s", v->prefix);
    snprintf(m->renderer, sizeof m->renderer, "imported");
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
    const struct ggn_view *row = t ? ggn_thresholds_of(t, v->prefix) : NULL;
    if (t && !row)
        row = ggn_thresholds_of(t, base_file_name(v->dir));
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

int ggn_import_view(const char *dir, const char *out, const struct ggn_import_options *o, int *labelled,
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
        rc = find_halves(&v, err);
    if (!rc && !strcmp(v.ending, ".exr"))
        rc = check_windows(&v, err);
    if (!rc)
        rc = init_manifest(&v, o, &m, err);
    int made = 0;
    if (!rc)
        rc = base_make_folder(out, &made, err);
    if (!rc)
        rc = take_over(out, &m, err);
    /* the manifest after each row: what it lists the next run need not make */
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
