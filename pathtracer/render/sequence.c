#include "render/sequence.h"

#include <zlib.h>

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/files.h"
#include "base/version.h"
#include "render/blockstats.h"
#include "base/json.h"
#include "render/lseq.h"

/* Seeds of levels and reference differ in these bits: no sample is shared, and the reference of one seed is not the input of
 * the next. */
static const uint32_t REFERENCE_SEED_BITS = 0x5bd1e995u;
/* The one level whose pixels are kept as half floats, from which other sample counts can be simulated. */
enum { FULL_LEVEL_SPP = 320 };

/* --- settings ------------------------------------------------------------------------------------------------------- */

int pt_sequence_levels(const char *text, uint32_t spp[PT_SEQUENCE_MAX_LEVELS], struct base_err *err)
{
    char kind[16], end;
    double first, last, step;
    int geometric, n = 0;
    if (sscanf(text, "%15[a-z]:%lf:%lf:%lf%c", kind, &first, &last, &step, &end) != 4 ||
        (!(geometric = strcmp(kind, "geometric") == 0) && strcmp(kind, "linear") != 0))
        return base_fail(err, BASE_EINVAL, "--levels %s: expected geometric:FIRST:LAST:RATIO or linear:FIRST:LAST:STEP", text);
    if (!(first >= 1.0 && last >= first && last <= 1e9) || !(geometric ? step >= 1.001 : step >= 1.0))
        return base_fail(err, BASE_EINVAL, "--levels %s: expected 1 <= FIRST <= LAST, RATIO >= 1.001, STEP >= 1", text);
    for (double at = first; at <= last * (1.0 + 1e-9); at = geometric ? at * step : at + step) {
        uint32_t level = (uint32_t)lround(at);
        if (n > 0 && level <= spp[n - 1])
            continue;
        if (n >= PT_SEQUENCE_MAX_LEVELS - 1)
            return base_fail(err, BASE_EINVAL, "--levels %s: more than %d levels", text, PT_SEQUENCE_MAX_LEVELS - 1);
        spp[n++] = level;
    }
    if (spp[n - 1] < (uint32_t)last)
        spp[n++] = (uint32_t)last;
    return n;
}

int pt_sequence_choose(const char *text, uint8_t *chosen, uint32_t count, struct base_err *err)
{
    for (const char *p = text;;) {
        char *end;
        unsigned long first = strtoul(p, &end, 10), last = first;
        if (end == p || *p < '0' || *p > '9')
            break;
        if (*end == '-') {
            p = end + 1;
            last = strtoul(p, &end, 10);
            if (end == p || *p < '0' || *p > '9')
                break;
        }
        if (first > last || last >= count)
            return base_fail(err, BASE_EINVAL, "--blocks %s: blocks are 0 to %u here", text, count - 1);
        memset(chosen + first, 1, last - first + 1);
        if (*end == '\0')
            return 0;
        if (*end != ',')
            break;
        p = end + 1;
    }
    return base_fail(err, BASE_EINVAL, "--blocks %s: expected a list like 0,3,8-11", text);
}

struct recorder {
    const struct pt_sequence_config *config;
    const struct pt_scene *scene;
    pt_kernel *kernel;
    struct base_threads *threads;
    struct pt_criterion *criterion;
    struct pt_render_hooks hooks;
    cJSON *manifest;            /* owns */
    struct pt_blocks grid;      /* owns; of the whole image */
    uint8_t *chosen;            /* owns; [grid.count] */
    uint32_t *levels;           /* owns */
    int level_count;
    uint32_t seed, reference_seed;
    double *mean, *half, *difference, *moment2, *scratch; /* own; one block */
};

/* --- manifest ------------------------------------------------------------------------------------------------------- */

/* Scene and view by name: "kitchen-view2.pbrt" is view2 of kitchen. */
static void name_view(const struct pt_sequence_config *c, char *scene, char *view, size_t room)
{
    const char *text = c->name, *slash;
    snprintf(view, room, "view0");
    if (text) {
        slash = strchr(text, '/');
        if (slash)
            snprintf(view, room, "%s", slash + 1);
        snprintf(scene, room, "%.*s", slash ? (int)(slash - text) : (int)strlen(text), text);
        return;
    }
    slash = strrchr(c->scene_path, '/');
    text = slash ? slash + 1 : c->scene_path;
    snprintf(scene, room, "%s", text);
    char *dot = strrchr(scene, '.');
    if (dot && dot != scene)
        *dot = '\0';
    char *dash = strstr(scene, "-view");
    if (dash && dash != scene) {
        snprintf(view, room, "%s", dash + 1);
        *dash = '\0';
    }
}

/* NULL when out of memory. */
static cJSON *new_manifest(const struct recorder *r)
{
    static const char *const samplers[] = {"independent", "sobol"}, *const filters[] = {"box", "triangle", "gaussian"};
    const struct pt_sequence_config *c = r->config;
    const struct pt_integrator *i = &c->render.integrator;
    char scene[256], view[256], crc[16], renderer[256];
    name_view(c, scene, view, sizeof scene);
    snprintf(crc, sizeof crc, "%08x", c->scene_crc);
    snprintf(renderer, sizeof renderer, "lull pathtracer " BASE_VERSION ", %s sampler, %s, filter %s %g, max depth %d, clamp %g",
             samplers[i->sampler], i->strategy == PT_STRATEGY_MIS ? "path" : "bsdf-only", filters[i->filter],
             (double)i->filter_x, i->max_depth, (double)i->max_component);
    int failed = 0;
    cJSON *m = cJSON_CreateObject();
    base_json_text(m, "format", "lull-sequence", &failed);
    base_json_number(m, "version", 1, &failed);
    base_json_text(m, "scene", scene, &failed);
    base_json_text(m, "source", c->scene_path, &failed);
    base_json_text(m, "source_crc32", crc, &failed);
    base_json_text(m, "camera", view, &failed);
    if (c->view.has_look_at) {
        cJSON *look_at = base_json_array(m, "look_at", &failed);
        for (int k = 0; k < 9; k++)
            base_json_number(look_at, NULL, c->view.look_at_world[k], &failed);
    }
    if (c->view.fov_deg > 0)
        base_json_number(m, "fov", c->view.fov_deg, &failed);
    base_json_text(m, "renderer", renderer, &failed);
    base_json_number(m, "width", c->render.width, &failed);
    base_json_number(m, "height", c->render.height, &failed);
    base_json_number(m, "block", c->render.block_width, &failed);
    base_json_number(m, "seed", r->seed, &failed);
    base_json_number(m, "reference_seed", r->reference_seed, &failed);
    base_json_number(m, "reference_spp", (double)c->reference_spp, &failed);
    cJSON *levels = base_json_array(m, "levels", &failed);
    for (int k = 0; k < r->level_count; k++)
        base_json_number(levels, NULL, r->levels[k], &failed);
    base_json_array(m, "blocks", &failed);
    if (failed) {
        cJSON_Delete(m);
        m = NULL;
    }
    return m;
}

static int path_in(const struct recorder *r, const char *name, char *path, size_t room, struct base_err *err)
{
    int n = snprintf(path, room, "%s/%s", r->config->directory, name);
    return n > 0 && (size_t)n < room ? 0 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", r->config->directory);
}

static int write_manifest(const struct recorder *r, struct base_err *err)
{
    char path[4096];
    int rc = path_in(r, "manifest.json", path, sizeof path, err);
    return !rc ? base_json_write(path, r->manifest, 0, err) : rc;
}

static int begun_with_another(const char *path, const char *member, struct base_err *err)
{
    return base_fail(err, BASE_EINVAL, "%s: this sequence was begun with another %s; use another folder", path, member);
}

/* The members up to `levels` must be those of this run; `source` may differ, its CRC decides. */
static int same_settings(const struct recorder *r, const char *path, const cJSON *old, struct base_err *err)
{
    static const char *const optional[] = {"look_at", "fov"};
    for (size_t i = 0; i < sizeof optional / sizeof optional[0]; i++)
        if (cJSON_HasObjectItem(old, optional[i]) && !cJSON_HasObjectItem(r->manifest, optional[i]))
            return begun_with_another(path, optional[i], err);
    for (const cJSON *m = r->manifest->child; m != NULL; m = m->next) {
        if (strcmp(m->string, "blocks") == 0 || strcmp(m->string, "source") == 0)
            continue;
        if (!cJSON_Compare(m, cJSON_GetObjectItemCaseSensitive(old, m->string), 1))
            return begun_with_another(path, m->string, err);
    }
    return 0;
}

/* Is the listed file there, as long and with the CRC that the manifest says? */
static int file_is_whole(const struct recorder *r, const cJSON *entry)
{
    const cJSON *name = cJSON_GetObjectItemCaseSensitive(entry, "file"), *crc = cJSON_GetObjectItemCaseSensitive(entry, "crc32");
    char path[4096], found[16];
    char *data = NULL;
    size_t size = 0;
    if (!cJSON_IsString(name) || !cJSON_IsString(crc) || strchr(name->valuestring, '/') ||
        path_in(r, name->valuestring, path, sizeof path, NULL) != 0 ||
        base_file_read(path, (size_t)1 << 30, &data, &size, NULL) != 0)
        return 0;
    snprintf(found, sizeof found, "%08x", (unsigned)crc32_z(crc32_z(0, NULL, 0), (const unsigned char *)data, size));
    free(data);
    return strcmp(found, crc->valuestring) == 0;
}

/* Takes over the finished blocks of an earlier run and unmarks them. */
static int resume(struct recorder *r, struct base_err *err)
{
    char path[4096];
    char *text = NULL;
    size_t size = 0;
    struct stat st;
    int rc = path_in(r, "manifest.json", path, sizeof path, err);
    if (rc || (stat(path, &st) != 0 && errno == ENOENT))
        return rc;
    if ((rc = base_file_read(path, (size_t)1 << 26, &text, &size, err)) != 0)
        return rc;
    cJSON *old = cJSON_Parse(text);
    free(text);
    if (!old)
        return base_fail(err, BASE_EINVAL, "%s: not a manifest (JSON expected)", path);
    rc = same_settings(r, path, old, err);
    const cJSON *entry;
    cJSON *blocks = cJSON_GetObjectItemCaseSensitive(r->manifest, "blocks");
    if (!rc) {
        cJSON_ArrayForEach(entry, cJSON_GetObjectItemCaseSensitive(old, "blocks"))
        {
            const cJSON *id = cJSON_GetObjectItemCaseSensitive(entry, "id");
            if (!cJSON_IsNumber(id) || id->valuedouble < 0.0 || id->valuedouble >= r->grid.count || !file_is_whole(r, entry))
                continue;
            cJSON *copy = cJSON_Duplicate(entry, 1);
            if (!copy) {
                rc = base_fail_nomem(err, path);
                break;
            }
            cJSON_AddItemToArray(blocks, copy);
            r->chosen[(uint32_t)id->valuedouble] = 0;
        }
    }
    cJSON_Delete(old);
    return rc;
}

static int add_to_manifest(struct recorder *r, const struct pt_block *b, const char *file, uint64_t bytes, uint32_t crc,
                           double seconds, struct base_err *err)
{
    char text[16];
    int failed = 0;
    snprintf(text, sizeof text, "%08x", crc);
    cJSON *o = base_json_object(cJSON_GetObjectItemCaseSensitive(r->manifest, "blocks"), NULL, &failed);
    base_json_number(o, "id", b->id, &failed);
    base_json_number(o, "x0", b->x0, &failed);
    base_json_number(o, "y0", b->y0, &failed);
    base_json_number(o, "x1", b->x1, &failed);
    base_json_number(o, "y1", b->y1, &failed);
    base_json_text(o, "file", file, &failed);
    base_json_number(o, "bytes", (double)bytes, &failed);
    base_json_text(o, "crc32", text, &failed);
    base_json_number(o, "seconds", seconds, &failed);
    return failed ? base_fail_nomem(err, file) : write_manifest(r, err);
}

/* --- one block ------------------------------------------------------------------------------------------------------ */

static int open_block(const struct recorder *r, const struct pt_block *b, int reference, struct pt_render **out,
                      struct base_err *err)
{
    struct pt_render_config c = r->config->render;
    int crop[4] = {b->x0, b->y0, b->x1, b->y1};
    struct pt_criterion *criterion = reference ? NULL : r->criterion;
    memcpy(c.crop, crop, sizeof crop);
    c.spp_min = c.spp_max = reference ? r->config->reference_spp : r->levels[r->level_count - 1];
    c.uniform = 1;
    c.time_budget_s = 0.0;
    c.max_seam = 0.0;
    c.planes = PT_FILM_HALF | PT_FILM_MOMENT2;
    c.integrator.seed = reference ? r->reference_seed : r->seed;
    return pt_render_create(&c, r->scene, r->kernel, r->threads, criterion, out, err);
}

/* Estimates of the block's film: mean, mean of half A, D = (A - B) / 2, second moment. */
static void read_film(struct recorder *r, const struct pt_film *f, uint64_t spp)
{
    uint64_t half_spp = pt_film_half_spp(spp);
    for (size_t i = 0; i < f->pixels; i++) {
        double *a = r->half + 3 * i;
        double n = (double)(spp - f->dropped[i]);
        double n_b = (double)(spp - half_spp) - (double)(f->dropped[i] - f->dropped_half[i]);
        pt_film_mean(f, i, spp, r->mean + 3 * i);
        pt_film_half_mean(f, i, half_spp, a);
        for (size_t c = 0; c < 3; c++) {
            int both = half_spp > f->dropped_half[i] && n_b > 0.0;
            r->difference[3 * i + c] = both ? (a[c] - (f->color[3 * i + c] - f->half[3 * i + c]) / n_b) / 2.0 : 0.0;
        }
        r->moment2[i] = n > 0.0 ? f->moment2[i] / n : 0.0;
    }
}

static void add_statistic(struct pt_lseq_statistic *list, uint32_t *count, const char *name, double value)
{
    if (!isfinite(value) || strlen(name) >= sizeof list[0].name)
        return;
    struct pt_lseq_statistic *s = &list[(*count)++];
    memset(s, 0, sizeof *s);
    strcpy(s->name, name);
    s->value = value;
}

static int put_level(struct recorder *r, struct pt_lseq *file, const struct pt_render *render, uint32_t kind, int full,
                     struct base_err *err)
{
    const struct pt_block *b = &render->blocks.list[0];
    struct pt_lseq_statistic statistics[8];
    struct pt_block_stats s;
    uint32_t n = 0;
    read_film(r, &render->film, b->spp);
    if (kind == PT_LSEQ_LEVEL) {
        pt_block_stats(r->mean, r->half, r->difference, r->moment2, render->film.pixels, b->spp, r->scratch, &s);
        add_statistic(statistics, &n, "dammertz", s.dammertz);
        add_statistic(statistics, &n, "half_unsettled", s.half_unsettled);
        add_statistic(statistics, &n, "rse", s.rse);
        add_statistic(statistics, &n, "rse_unsettled", s.rse_unsettled);
        add_statistic(statistics, &n, "tail999", s.tail999);
        add_statistic(statistics, &n, "gini", s.gini);
    }
    add_statistic(statistics, &n, "seconds", b->thread_s);
    if (render->criterion) {
        char name[64];
        snprintf(name, sizeof name, "%.50s.error", render->criterion->table->id);
        add_statistic(statistics, &n, name, b->error);
    }
    struct pt_lseq_record record = {.kind = kind, .form = full ? PT_LSEQ_FULL : PT_LSEQ_COMPACT, .spp = (uint32_t)b->spp,
                                    .half_spp = (uint32_t)pt_film_half_spp(b->spp), .mean = r->mean,
                                    .difference = r->difference, .statistic_count = n, .statistics = statistics};
    return pt_lseq_put(file, &record, err);
}

static int record_levels(struct recorder *r, struct pt_lseq *file, const struct pt_block *b, int *stopped, struct base_err *err)
{
    struct pt_render *render = NULL;
    int full_done = 0;
    int rc = open_block(r, b, 0, &render, err);
    for (int k = 0; k < r->level_count && !rc; k++) {
        int full = !full_done && (r->levels[k] >= FULL_LEVEL_SPP || k == r->level_count - 1);
        rc = pt_render_advance(render, r->levels[k], &r->hooks, stopped, err);
        if (rc || *stopped)
            break;
        pt_render_judge(render, &r->hooks);
        rc = put_level(r, file, render, PT_LSEQ_LEVEL, full, err);
        full_done |= full;
    }
    pt_render_destroy(render);
    return rc;
}

static int record_reference(struct recorder *r, struct pt_lseq *file, const struct pt_block *b, int *stopped, struct base_err *err)
{
    struct pt_render *render = NULL;
    if (r->config->reference_spp == 0)
        return 0;
    int rc = open_block(r, b, 1, &render, err);
    if (!rc)
        rc = pt_render_advance(render, r->config->reference_spp, &r->hooks, stopped, err);
    if (!rc && !*stopped)
        rc = put_level(r, file, render, PT_LSEQ_REFERENCE, 1, err);
    pt_render_destroy(render);
    return rc;
}

static int record_block(struct recorder *r, const struct pt_block *b, int *stopped, struct base_err *err)
{
    char name[64], path[4096];
    struct pt_lseq file;
    double start_s = base_clock_wall_s();
    snprintf(name, sizeof name, "block-%05u.lseq", b->id);
    int rc = path_in(r, name, path, sizeof path, err);
    if (rc)
        return rc;
    uint32_t records = (uint32_t)r->level_count + (r->config->reference_spp > 0 ? 1 : 0);
    rc = pt_lseq_begin(&file, path, (uint32_t)(b->x1 - b->x0), (uint32_t)(b->y1 - b->y0), b->x0, b->y0, b->id, records, r->seed,
                       err);
    if (rc)
        return rc;
    rc = record_levels(r, &file, b, stopped, err);
    if (!rc && !*stopped)
        rc = record_reference(r, &file, b, stopped, err);
    if (rc || *stopped) {
        pt_lseq_abort(&file);
        return rc;
    }
    if ((rc = pt_lseq_commit(&file, err)) != 0)
        return rc;
    return add_to_manifest(r, b, name, file.bytes, file.crc, base_clock_wall_s() - start_s, err);
}

/* --- all blocks ----------------------------------------------------------------------------------------------------- */

static int prepare(struct recorder *r, struct base_err *err)
{
    const struct pt_render_config *c = &r->config->render;
    const int whole[4] = {0, 0, c->width, c->height};
    if (c->block_width != c->block_height)
        return base_fail(err, BASE_EINVAL, "--sequence records square blocks: --block N");
    r->levels = calloc(PT_SEQUENCE_MAX_LEVELS, sizeof *r->levels);
    if (!r->levels)
        return base_fail_nomem(err, "levels");
    r->level_count = pt_sequence_levels(r->config->levels ? r->config->levels : "geometric:20:10000:1.15", r->levels, err);
    if (r->level_count < 0)
        return r->level_count;
    int rc = pt_blocks_init(&r->grid, c->width, c->height, c->block_width, c->block_height, whole, 0, err);
    if (rc)
        return rc;
    size_t pixels = (size_t)c->block_width * (size_t)c->block_height;
    r->chosen = calloc(r->grid.count, 1);
    r->mean = calloc(pixels, 3 * sizeof(double));
    r->half = calloc(pixels, 3 * sizeof(double));
    r->difference = calloc(pixels, 3 * sizeof(double));
    r->moment2 = calloc(pixels, sizeof(double));
    r->scratch = calloc(pixels, sizeof(double));
    if (!r->chosen || !r->mean || !r->half || !r->difference || !r->moment2 || !r->scratch)
        return base_fail_nomem(err, "sequence");
    if (!r->config->blocks)
        memset(r->chosen, 1, r->grid.count);
    else if ((rc = pt_sequence_choose(r->config->blocks, r->chosen, r->grid.count, err)) != 0)
        return rc;
    r->seed = c->integrator.seed;
    r->reference_seed = r->seed ^ REFERENCE_SEED_BITS;
    if (!(r->manifest = new_manifest(r)))
        return base_fail_nomem(err, "manifest");
    if (mkdir(r->config->directory, 0777) != 0 && errno != EEXIST)
        return base_fail(err, BASE_EINVAL, "%s: %s", r->config->directory, strerror(errno));
    return resume(r, err);
}

static void recorder_release(struct recorder *r)
{
    cJSON_Delete(r->manifest);
    pt_blocks_release(&r->grid);
    free(r->chosen);
    free(r->levels);
    free(r->mean);
    free(r->half);
    free(r->difference);
    free(r->moment2);
    free(r->scratch);
}

static int record_chosen(struct recorder *r, int *stopped, struct base_err *err)
{
    uint32_t todo = 0, done = 0;
    double start_s = base_clock_wall_s();
    for (uint32_t i = 0; i < r->grid.count; i++)
        todo += r->chosen[i];
    int rc = write_manifest(r, err);
    for (uint32_t i = 0; i < r->grid.count && !rc && !*stopped; i++) {
        if (!r->chosen[i])
            continue;
        rc = record_block(r, &r->grid.list[i], stopped, err);
        if (rc || *stopped || r->config->quiet)
            continue;
        char line[128];
        double each_s = (base_clock_wall_s() - start_s) / ++done;
        snprintf(line, sizeof line, "block %u recorded, %u of %u, %.1f s each, %.0f s left", i, done, todo, each_s,
                 each_s * (todo - done));
        r->hooks.warn(r->hooks.data, line);
    }
    return rc;
}

int pt_sequence_record(const struct pt_sequence_config *config, const struct pt_scene *scene, pt_kernel *kernel,
                       struct base_threads *threads, struct pt_criterion *criterion, int (*interrupted)(void *data),
                       void (*say)(void *data, const char *line), void *data, int *was_interrupted, struct base_err *err)
{
    struct recorder r = {.config = config, .scene = scene, .kernel = kernel, .threads = threads, .criterion = criterion,
                         .hooks = {.slice = config->slice, .interrupted = interrupted, .warn = say, .data = data}};
    *was_interrupted = 0;
    int rc = prepare(&r, err);
    if (!rc)
        rc = record_chosen(&r, was_interrupted, err);
    recorder_release(&r);
    return rc;
}
