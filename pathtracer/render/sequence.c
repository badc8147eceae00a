#include "render/sequence.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/files.h"
#include "base/list.h"
#include "base/text.h"
#include "base/version.h"
#include "sequence/manifest.h"
#include "sequence/simulate.h"
#include "sequence/tail.h"
#include "scene/scene.h"

/* Seeds of levels and references differ in these bits: no sample is shared, and the reference of one seed is not the input
 * of the next. */
static const uint32_t REFERENCE_SEED_BITS[] = {0x5bd1e995u, 0x9e3779b1u};
/* The one level whose pixels are kept as half floats, from which other sample counts can be simulated. */
enum { FULL_LEVEL_SPP = 320 };

int pt_sequence_levels(const char *text, uint32_t spp[PT_SEQUENCE_MAX_LEVELS], struct base_err *err)
{
    char kind[16], end;
    double first, last, step;
    int geometric;
    if (text[strcspn(text, " \t\n\v\f\r")] != '\0' || /* sscanf passes over blanks */
        sscanf(text, "%15[a-z]:%lf:%lf:%lf%c", kind, &first, &last, &step, &end) != 4 ||
        (!(geometric = strcmp(kind, "geometric") == 0) && strcmp(kind, "linear") != 0))
        return base_fail(err, BASE_EINVAL, "--levels %s: expected geometric:FIRST:LAST:RATIO or linear:FIRST:LAST:STEP",
                         text);
    if (!(first >= 1.0 && last >= first && last <= 1e9) || !(geometric ? step >= 1.001 : step >= 1.0))
        return base_fail(err, BASE_EINVAL, "--levels %s: expected 1 <= FIRST <= LAST, RATIO >= 1.001, STEP >= 1", text);
    const int room = PT_SEQUENCE_MAX_LEVELS - 1, n = seq_levels(first, last, step, geometric, spp, room);
    return n <= room ? n : base_fail(err, BASE_EINVAL, "--levels %s: more than %d levels", text, room);
}

int pt_sequence_choose(const char *text, uint8_t *chosen, uint32_t count, struct base_err *err)
{
    unsigned long first, last;
    const char *at = text;
    do {
        at = base_list_next(at, &first, &last, NULL);
        if (!at)
            return base_fail(err, BASE_EINVAL, "--blocks %s: expected a list like 0,3,8-11", text);
        if (first > last || last >= count)
            return base_fail(err, BASE_EINVAL, "--blocks %s: blocks are 0 to %u here", text, count - 1);
        memset(chosen + first, 1, last - first + 1);
    } while (*at != '\0');
    return 0;
}

struct recorder {
    uint64_t dropped; /* samples of the block in hand that were not finite */
    const struct pt_sequence_config *config;
    const struct pt_scene *scene;
    pt_kernel *kernel;
    struct base_threads *threads;
    struct lull_host_criterion *criterion;
    const struct pt_render_hooks *hooks;
    struct seq_manifest manifest;                         /* owns; room for every block of the grid */
    struct lull_host_frame *whole;                        /* owns; the grid of the whole image */
    const struct lull_host_blocks *grid;                  /* of it */
    struct base_lock lock;                                /* of the folder */
    uint8_t *chosen;                                      /* owns; [grid.count] */
    double *mean, *half, *difference, *moment2, *scratch; /* one block, planar; mean owns all */
};

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
    base_view_name(c->scene_path, scene, room);
    char *dash = strstr(scene, "-view");
    if (dash && dash != scene) {
        snprintf(view, room, "%s", dash + 1);
        *dash = '\0';
    }
}

uint32_t pt_sequence_reference_seed(uint32_t seed, int index) { return seed ^ REFERENCE_SEED_BITS[index]; }

void pt_sequence_describe(const struct pt_sequence_config *c, const struct pt_scene *scene, struct seq_manifest *m)
{
    const struct pt_integrator *i = &c->render.integrator;
    name_view(c, m->scene, m->camera, sizeof m->scene);
    snprintf(m->source, sizeof m->source, "%s", c->scene_path);
    snprintf(m->renderer, sizeof m->renderer,
             "lull-render " BASE_VERSION ", %s sampler, %s, filter %s %g, max depth %d, clamp %g%s",
             pt_sampler_words[i->sampler], pt_strategy_words[i->strategy], pt_filter_words[i->filter], (double)i->filter_x,
             i->max_depth, (double)i->max_component, scene->light_tree ? ", light hierarchy" : "");
    m->source_crc32 = c->scene_crc;
    m->inputs_crc32 = c->inputs_crc;
    m->has_look_at = c->view.has_look_at;
    if (m->has_look_at)
        memcpy(m->look_at, c->view.look_at_world, sizeof m->look_at);
    m->fov_deg = fmax(c->view.fov_deg, 0.0);
    m->width = (uint32_t)c->render.width;
    m->height = (uint32_t)c->render.height;
    m->seed = i->seed;
    m->reference_seed = pt_sequence_reference_seed(i->seed, 0);
    m->reference_spp = (uint32_t)c->reference_spp;
    m->reference_independent = 1;
}

int pt_sequence_same(const struct base_identity *ours, const struct base_identity *theirs, const char *path,
                     struct base_err *err)
{
    static const struct base_identity_words words = {": begun with", ": begun without", "this render"};
    struct base_err why = {0};
    int rc = base_identity_check(ours, err);
    if (!rc)
        rc = base_identity_check(theirs, err);
    if (!rc && base_identity_compare(ours, theirs->text, theirs->size, path, &words, NULL, &why) != 0)
        rc = base_fail(err, why.code, "%s; use another folder", why.text);
    return rc;
}

static int compare(const struct recorder *r, const char *path, const struct seq_manifest *old, struct base_err *err)
{
    struct base_identity ours = {0}, theirs = {0};
    seq_manifest_identity(&r->manifest, &ours);
    seq_manifest_identity(old, &theirs);
    const int rc = pt_sequence_same(&ours, &theirs, path, err);
    base_identity_release(&ours);
    base_identity_release(&theirs);
    return rc;
}

/* Takes over the finished blocks of an earlier run and unmarks them. */
static int resume(struct recorder *r, struct base_err *err)
{
    struct seq_manifest old;
    struct stat st;
    char path[4096];
    int rc = base_file_join(path, r->config->directory, "manifest.json", err);
    if (rc || (stat(path, &st) != 0 && errno == ENOENT))
        return rc;
    if ((rc = seq_manifest_read(r->config->directory, &old, err)) != 0)
        return rc;
    if (old.inputs_crc32 == 0) /* recorded before it was noted */
        old.inputs_crc32 = r->manifest.inputs_crc32;
    rc = compare(r, path, &old, err);
    for (uint32_t i = 0; i < old.n_blocks && !rc; i++) {
        struct seq_block b;
        if (old.blocks[i].id >= r->grid->count || seq_manifest_read_block(r->config->directory, &old, i, &b, NULL) != 0)
            continue; /* missing or damaged: it is made again */
        seq_block_release(&b);
        r->manifest.blocks[r->manifest.n_blocks++] = old.blocks[i];
        r->chosen[old.blocks[i].id] = 0;
    }
    seq_manifest_release(&old);
    return rc;
}

static int open_block(const struct recorder *r, const struct lull_host_block *b, int reference, struct pt_render **out,
                      struct base_err *err)
{
    struct pt_render_config c = r->config->render;
    memcpy(c.crop, (const int[]){b->x0, b->y0, b->x1, b->y1}, sizeof c.crop);
    c.spp_min = c.spp_max = reference ? r->config->reference_spp : r->manifest.levels[r->manifest.n_levels - 1];
    c.uniform = 1;
    c.time_budget_s = 0.0;
    c.max_seam = 0.0;
    c.mask = NULL;
    c.planes = PT_FILM_HALF | PT_FILM_MOMENT2;
    c.integrator.seed = (uint32_t)(reference ? r->manifest.reference_seed : r->manifest.seed);
    return pt_render_create(&c, r->scene, r->kernel, r->threads, reference ? NULL : r->criterion, out, err);
}

/* Estimates of the block's film: mean, mean of half A, D = (A - B) / 2, second moment. */
static void read_film(struct recorder *r, const struct pt_film *f, uint64_t spp)
{
    uint64_t half_spp = pt_film_half_spp(spp);
    for (size_t i = 0; i < f->pixels; i++) {
        double mean[3], a[3], n = (double)(spp - f->dropped[i]);
        double n_b = (double)(spp - half_spp) - (double)(f->dropped[i] - f->dropped_half[i]);
        int both = half_spp > f->dropped_half[i] && n_b > 0.0;
        pt_film_mean(f, i, spp, mean);
        pt_film_half_mean(f, i, half_spp, a);
        for (size_t c = 0; c < 3; c++) {
            r->mean[c * f->pixels + i] = mean[c];
            r->half[c * f->pixels + i] = a[c];
            r->difference[c * f->pixels + i] = both ? (a[c] - (f->color[3 * i + c] - f->half[3 * i + c]) / n_b) / 2.0 : 0.0;
        }
        r->moment2[i] = n > 0.0 ? f->moment2[i] / n : 0.0;
    }
}

static void add_statistic(struct seq_stat *list, uint32_t *count, const char *name, double value)
{
    if (!isfinite(value) || strlen(name) >= sizeof list[0].name)
        return;
    struct seq_stat *s = &list[(*count)++];
    *s = (struct seq_stat){.value = value};
    strcpy(s->name, name);
}

static int put_level(struct recorder *r, struct seq_builder *file, const struct pt_render *render, int reference, int full,
                     struct base_err *err)
{
    const struct lull_host_block *b = &render->blocks->list[0];
    struct seq_stat found[SEQ_STATISTICS], stats[SEQ_STATISTICS + 2];
    uint32_t n = 0;
    read_film(r, &render->film, b->spp);
    if (!reference) {
        seq_statistics(r->mean, r->half, r->difference, r->moment2, render->film.pixels, b->spp, r->scratch, found);
        for (int i = 0; i < SEQ_STATISTICS; i++)
            add_statistic(stats, &n, found[i].name, found[i].value);
    }
    add_statistic(stats, &n, "seconds", b->thread_s);
    if (render->criterion) {
        char name[64];
        snprintf(name, sizeof name, "%.50s.error", lull_host_table(render->criterion)->id);
        add_statistic(stats, &n, name, b->error);
    }
    const struct seq_frame frame = {.spp = (uint32_t)b->spp,
                                    .half_spp = (uint32_t)pt_film_half_spp(b->spp),
                                    .is_reference = reference,
                                    .full = full,
                                    .mean = r->mean,
                                    .half = r->difference,
                                    .stats = stats,
                                    .n_stats = n};
    return seq_builder_add(file, &frame, err);
}

/* The block at all levels, one of them in full; or its reference, which is one level. */
static int record(struct recorder *r, struct seq_builder *file, const struct lull_host_block *b, int reference, int *stopped,
                  struct base_err *err)
{
    const uint32_t levels = reference ? 1 : r->manifest.n_levels;
    struct pt_render *render = NULL;
    int full_done = 0;
    int rc = open_block(r, b, reference, &render, err);
    for (uint32_t k = 0; k < levels && !rc; k++) {
        const uint64_t spp = reference ? r->config->reference_spp : r->manifest.levels[k];
        int full = !full_done && (spp >= FULL_LEVEL_SPP || k + 1 == levels);
        rc = pt_render_advance(render, spp, r->hooks, stopped, err);
        if (rc || *stopped)
            break;
        pt_render_judge(render, r->hooks);
        rc = put_level(r, file, render, reference, full, err);
        full_done |= full;
    }
    if (render)
        r->dropped += render->totals->dropped;
    pt_render_destroy(render);
    return rc;
}

/* Writes the block's file and lists it. */
static int finish_block(struct recorder *r, struct seq_builder *file, const struct lull_host_block *b, double seconds,
                        struct base_err *err)
{
    char path[4096];
    struct seq_manifest_block entry = {.id = b->id,
                                       .x0 = (uint32_t)b->x0,
                                       .y0 = (uint32_t)b->y0,
                                       .x1 = (uint32_t)b->x1,
                                       .y1 = (uint32_t)b->y1,
                                       .bytes = file->size,
                                       .seconds = seconds,
                                       .dropped = r->dropped};
    snprintf(entry.file, sizeof entry.file, "block-%05u.lseq", b->id);
    int rc = base_file_join(path, r->config->directory, entry.file, err);
    if (!rc)
        rc = seq_builder_write(file, path, &entry.crc32, err);
    if (rc)
        return rc;
    r->manifest.blocks[r->manifest.n_blocks++] = entry;
    return seq_manifest_write(r->config->directory, &r->manifest, err);
}

static int record_block(struct recorder *r, const struct lull_host_block *b, int *stopped, struct base_err *err)
{
    struct seq_builder file;
    double start_s = base_clock_wall_s();
    r->dropped = 0;
    int rc = seq_builder_init(&file, (uint32_t)(b->x1 - b->x0), (uint32_t)(b->y1 - b->y0), b->x0, b->y0, b->id,
                              r->manifest.seed, err);
    if (rc)
        return rc;
    rc = record(r, &file, b, 0, stopped, err);
    if (!rc && !*stopped && r->config->reference_spp > 0)
        rc = record(r, &file, b, 1, stopped, err);
    if (!rc && !*stopped)
        rc = finish_block(r, &file, b, base_clock_wall_s() - start_s, err);
    seq_builder_release(&file);
    return rc;
}

static int lay_grid(struct recorder *r, struct base_err *err)
{
    const struct pt_render_config *c = &r->config->render;
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_host_config grid = {.struct_size = sizeof grid,
                                    .flags = LULL_HOST_UNIFORM,
                                    .width = (uint32_t)c->width,
                                    .height = (uint32_t)c->height,
                                    .block_width = (uint32_t)c->block_width,
                                    .block_height = (uint32_t)c->block_height,
                                    .spp_min = 1,
                                    .spp_max = 1};
    int rc = pt_host_result(lull_host_begin(&grid, NULL, &r->whole, &e), &e, err);
    if (!rc)
        r->grid = lull_host_blocks_of(r->whole);
    return rc;
}

/* What can refuse the recording comes before the folder, and its lock before the look at what an earlier run left there. */
static int prepare(struct recorder *r, struct base_err *err)
{
    const struct pt_render_config *c = &r->config->render;
    if (c->block_width != c->block_height)
        return base_fail(err, BASE_EINVAL, "--sequence records square blocks: --block N");
    r->manifest.levels = calloc(PT_SEQUENCE_MAX_LEVELS, sizeof *r->manifest.levels);
    if (!r->manifest.levels)
        return base_fail_nomem(err, "levels");
    int levels =
        pt_sequence_levels(r->config->levels ? r->config->levels : "geometric:20:10000:1.15", r->manifest.levels, err);
    if (levels < 0)
        return levels;
    r->manifest.n_levels = (uint32_t)levels;
    int rc = lay_grid(r, err);
    if (rc)
        return rc;
    size_t pixels = (size_t)c->block_width * (size_t)c->block_height;
    r->chosen = calloc(r->grid->count, 1);
    r->manifest.blocks = calloc(r->grid->count, sizeof *r->manifest.blocks);
    r->mean = calloc(pixels, (3 * 3 + 2) * sizeof(double));
    if (!r->chosen || !r->manifest.blocks || !r->mean)
        return base_fail_nomem(err, "sequence");
    r->half = r->mean + 3 * pixels;
    r->difference = r->half + 3 * pixels;
    r->moment2 = r->difference + 3 * pixels;
    r->scratch = r->moment2 + pixels;
    if (!r->config->blocks)
        memset(r->chosen, 1, r->grid->count);
    else if ((rc = pt_sequence_choose(r->config->blocks, r->chosen, r->grid->count, err)) != 0)
        return rc;
    pt_sequence_describe(r->config, r->scene, &r->manifest);
    r->manifest.block = (uint32_t)c->block_width;
    rc = base_make_folder(r->config->directory, NULL, err);
    if (!rc)
        rc = base_lock_folder(&r->lock, r->config->directory, err);
    return rc ? rc : resume(r, err);
}

static void recorder_release(struct recorder *r)
{
    base_lock_release(&r->lock);
    seq_manifest_release(&r->manifest);
    lull_host_end(r->whole);
    free(r->chosen);
    free(r->mean);
}

static int record_chosen(struct recorder *r, int *stopped, struct base_err *err)
{
    uint32_t todo = 0, done = 0;
    double start_s = base_clock_wall_s();
    for (uint32_t i = 0; i < r->grid->count; i++)
        todo += r->chosen[i];
    int rc = seq_manifest_write(r->config->directory, &r->manifest, err);
    for (uint32_t i = 0; i < r->grid->count && !rc && !*stopped; i++) {
        if (!r->chosen[i])
            continue;
        rc = record_block(r, &r->grid->list[i], stopped, err);
        if (rc || *stopped)
            continue;
        if (r->dropped > 0)
            base_log_say(r->hooks->log, "block %u: %llu samples were not finite and were dropped; manifest.json counts them",
                         i, (unsigned long long)r->dropped);
        double each_s = (base_clock_wall_s() - start_s) / ++done;
        base_log_note(r->hooks->log, "block %u recorded, %u of %u, %.1f s each, %.0f s left", i, done, todo, each_s,
                      each_s * (todo - done));
    }
    return rc;
}

int pt_sequence_record(const struct pt_sequence_config *config, const struct pt_scene *scene, pt_kernel *kernel,
                       struct base_threads *threads, struct lull_host_criterion *criterion,
                       const struct pt_render_hooks *hooks, int *was_interrupted, struct base_err *err)
{
    struct recorder r = {
        .config = config, .scene = scene, .kernel = kernel, .threads = threads, .criterion = criterion, .hooks = hooks};
    *was_interrupted = 0;
    int rc = prepare(&r, err);
    if (!rc)
        rc = record_chosen(&r, was_interrupted, err);
    recorder_release(&r);
    return rc;
}
