/* Whole frames: looks at all blocks, as a criterion is shown them. */
#include "render/sequence.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/colour.h"
#include "base/files.h"
#include "render/checkpoint.h"
#include "sequence/recording.h"

/* Samples of a block that goes on past its stop, from one look to the next. */
static const double PAST_STOP = 1.19;
/* Seconds between two checkpoints of the film. */
static const double SAVE_S = 60.0;

struct recorder {
    const struct pt_sequence_config *config;
    const struct pt_scene *scene;
    pt_kernel *kernel;
    struct base_threads *threads;
    struct lull_host_criterion *criterion;
    const struct pt_render_hooks *outer;
    struct pt_render_hooks hooks;
    struct seq_recording m; /* owns */
    struct base_lock lock;  /* of the folder */

    enum seq_part part;            /* what is being recorded … */
    int reference;                 /* … of two, from 0 */
    uint32_t looks;                /* files of it */
    struct base_identity identity; /* of its state, owns */
    char state[4096];              /* where that is now; "": nowhere */
    double saved_s;
};

/* --- a look --------------------------------------------------------------------------------------------------------- */

struct source {
    const struct pt_film *film;
    const struct lull_host_block *block;
};

/* What a criterion makes of the sums of a pixel, in the form of FORMAT.md. */
static void estimate(const struct source *s, enum seq_plane_number plane, size_t i, double v[3])
{
    const struct pt_film *f = s->film;
    const uint64_t spp = s->block->spp, half_spp = pt_film_half_spp(spp);
    const double n = (double)spp, h = (double)half_spp,
                 kept = spp > f->dropped[i] ? 1.0 / (double)(spp - f->dropped[i]) : 0.0;
    const double *sum = plane == SEQ_PLANE_ALBEDO ? f->albedo : f->normal;
    double mean[3], half[3];
    pt_film_mean(f, i, spp, mean);
    if (plane == SEQ_PLANE_HALF || plane == SEQ_PLANE_REST)
        pt_film_half_mean(f, i, half_spp, half);
    switch (plane) {
    case SEQ_PLANE_MOMENT2: {
        const double y = base_luminance(mean[0], mean[1], mean[2]);
        v[0] = f->moment2[i] * kept - y * y;
        break;
    }
    case SEQ_PLANE_DEPTH: v[0] = f->depth[i]; break;
    case SEQ_PLANE_DROPPED: v[0] = f->dropped[i]; break;
    case SEQ_PLANE_DROPPED_HALF: v[0] = f->dropped_half[i]; break;
    default:
        for (size_t c = 0; c < 3; c++)
            v[c] = plane == SEQ_PLANE_COLOR  ? mean[c]
                   : plane == SEQ_PLANE_HALF ? half[c]
                   : plane != SEQ_PLANE_REST ? sum[3 * i + c] * (1.0 / n)
                   : half[c] == mean[c]      ? half[c]
                                             : (n * mean[c] - h * half[c]) / (n - h);
    }
}

static void fill(void *data, enum seq_plane_number plane, float *out)
{
    const struct source *s = data;
    const struct lull_host_block *b = s->block;
    const size_t width = (size_t)(b->x1 - b->x0), pixels = width * (size_t)(b->y1 - b->y0);
    const size_t channels = seq_plane_channels((uint32_t)plane);
    for (size_t i = 0; i < pixels; i++) {
        double v[3] = {0};
        estimate(s, plane, pt_film_index(s->film, b->x0 + (int)(i % width), b->y0 + (int)(i / width)), v);
        for (size_t c = 0; c < channels; c++)
            out[c * pixels + i] = (float)v[c];
    }
}

static void add_number(struct seq_stat *list, uint32_t *count, const char *name, double value)
{
    if (!isfinite(value))
        return;
    struct seq_stat *s = &list[(*count)++];
    *s = (struct seq_stat){.value = value};
    strcpy(s->name, name);
}

/* What was asked and answered about a block; decision NULL: nobody was. */
static uint32_t list_answer(const struct lull_host_block *b, const struct lull_decision *d, struct seq_stat *out)
{
    uint32_t n = 0;
    add_number(out, &n, "seconds", b->thread_s);
    if (b->dropped > 0)
        add_number(out, &n, "dropped", (double)b->dropped);
    if (!d)
        return n;
    add_number(out, &n, "action", d->action);
    add_number(out, &n, "flags", d->flags);
    add_number(out, &n, "next_spp", (double)d->next_spp);
    add_number(out, &n, "error", d->error);
    add_number(out, &n, "p_noisy", d->p_noisy);
    add_number(out, &n, "predicted_spp", d->predicted_spp);
    return n;
}

/* A block that is asked about again has its planes in an earlier look. */
static int add_block(const struct recorder *r, struct seq_builder *file, const struct pt_render *render, uint32_t index,
                     const struct lull_decision *d, int again, struct base_err *err)
{
    const struct lull_host_block *b = &render->blocks->list[index];
    struct source source = {&render->film, b};
    struct seq_stat stats[8];
    uint32_t planes = r->part == SEQ_PART_REFERENCE ? 1u << SEQ_PLANE_COLOR : r->m.planes;
    if (planes >> SEQ_PLANE_HALF & 1 && b->half_spp > 0 && b->half_spp < b->spp) /* the mean follows from both */
        planes = (planes & ~(1u << SEQ_PLANE_COLOR)) | 1u << SEQ_PLANE_REST;
    if (b->dropped > 0)
        planes |= 1u << SEQ_PLANE_DROPPED | (planes >> SEQ_PLANE_HALF & 1) << SEQ_PLANE_DROPPED_HALF;
    const struct seq_record record = {.kind = r->part == SEQ_PART_REFERENCE ? SEQ_REFERENCE
                                              : r->part == SEQ_PART_BEYOND  ? SEQ_BEYOND
                                                                            : SEQ_LEVEL,
                                      .spp = (uint32_t)b->spp,
                                      .half_spp = planes >> SEQ_PLANE_HALF & 1 ? (uint32_t)b->half_spp : 0,
                                      .block = index,
                                      .x0 = b->x0,
                                      .y0 = b->y0,
                                      .width = (uint32_t)(b->x1 - b->x0),
                                      .height = (uint32_t)(b->y1 - b->y0),
                                      .n_stats = list_answer(b, d, stats)};
    return seq_look_add(file, &record, stats, again ? 0 : planes, fill, &source, err);
}

/* Writes a file and lists it. */
static int finish_look(struct recorder *r, struct seq_builder *file, struct base_err *err)
{
    struct seq_recording_file entry = {.part = r->part, .bytes = file->size};
    char path[4096];
    if (r->part == SEQ_PART_REFERENCE)
        snprintf(entry.name, sizeof entry.name, "reference-%d.lseq", r->reference + 1);
    else
        snprintf(entry.name, sizeof entry.name, "%s-%05u.lseq", r->part == SEQ_PART_LOOKS ? "look" : "beyond", r->looks + 1);
    if (file->size > SEQ_MAX_FILE)
        return base_fail(err, BASE_EINVAL, "%s: a look of more than 1 GiB: render a smaller picture", entry.name);
    int rc = base_file_join(path, r->config->directory, entry.name, err);
    if (!rc)
        rc = seq_builder_write(file, path, &entry.crc32, err);
    if (!rc)
        rc = seq_recording_add(&r->m, &entry, err);
    if (!rc)
        rc = seq_recording_write(r->config->directory, &r->m, err);
    r->looks += !rc;
    return rc;
}

/* Blocks work.due[0 … count) as they are. answered: with work.decisions; noted: these are noted already. */
static int put_look(struct recorder *r, const struct pt_render *render, uint32_t count, int answered, int noted,
                    struct base_err *err)
{
    const struct seq_manifest *m = &r->m.of;
    struct seq_builder file;
    int rc = seq_look_open(&file, m->width, m->height, r->looks + 1, render->config.integrator.seed, err);
    if (rc)
        return rc;
    for (uint32_t k = 0; k < count && !rc; k++) {
        const uint32_t i = render->work.due[k];
        const struct lull_host_block *b = &render->blocks->list[i];
        rc = add_block(r, &file, render, i, answered ? &render->work.decisions[k] : NULL,
                       !noted && b->asked && b->asked_spp == b->spp, err);
    }
    if (!rc)
        rc = finish_look(r, &file, err);
    seq_builder_release(&file);
    return rc;
}

static int looked(void *data, struct pt_render *render, uint32_t count, struct base_err *err)
{
    return put_look(data, render, count, 1, 0, err);
}

/* --- the film in between -------------------------------------------------------------------------------------------- */

static int state_path(const struct recorder *r, char path[4096], struct base_err *err)
{
    char name[64];
    snprintf(name, sizeof name, "state-%d-%05u.ckp", (int)r->part + r->reference, r->looks);
    return base_file_join(path, r->config->directory, name, err);
}

/* The name says how many looks there are, so that a state never belongs to other ones. */
static int save(struct recorder *r, const struct pt_render *render, struct base_err *err)
{
    char path[4096];
    int rc = state_path(r, path, err);
    if (!rc)
        rc = pt_checkpoint_save(path, render, &r->identity, err);
    if (rc)
        return rc;
    if (r->state[0] != '\0' && strcmp(r->state, path) != 0)
        unlink(r->state);
    strcpy(r->state, path);
    r->saved_s = base_clock_wall_s();
    return 0;
}

static int suspend(void *data, struct pt_render *render, struct base_err *err) { return save(data, render, err); }

static int after_slice(void *data, struct pt_render *render, struct base_err *err)
{
    struct recorder *r = data;
    const int rc = r->outer->slice ? r->outer->slice(r->outer->data, render, err) : 0;
    return !rc && base_clock_wall_s() >= r->saved_s + SAVE_S ? save(r, render, err) : rc;
}

/* Files of the part in hand, of which the first `keep` stay in the list. */
static void drop_files(struct recorder *r, uint32_t keep)
{
    uint32_t seen = 0, n = 0;
    for (uint32_t i = 0; i < r->m.n_files; i++) {
        const struct seq_recording_file *f = &r->m.files[i];
        char name[64];
        snprintf(name, sizeof name, "reference-%d.lseq", r->reference + 1);
        const int ours = f->part == r->part && (r->part != SEQ_PART_REFERENCE || strcmp(f->name, name) == 0);
        if (!ours || seen++ < keep)
            r->m.files[n++] = *f;
    }
    r->m.n_files = n;
}

/* The latest state of the part whose looks are all there; without one it begins anew. */
static int load(struct recorder *r, struct pt_render *render, struct base_err *err)
{
    uint32_t files = 0;
    struct stat st;
    int rc = 0;
    for (uint32_t i = 0; i < r->m.n_files; i++)
        files += r->m.files[i].part == r->part;
    r->state[0] = '\0';
    for (r->looks = r->part == SEQ_PART_REFERENCE ? 0 : files;; r->looks--) {
        char path[4096];
        if ((rc = state_path(r, path, err)) != 0)
            return rc;
        if (stat(path, &st) == 0) {
            rc = pt_checkpoint_load(path, render, &r->identity, err);
            strcpy(r->state, path);
            break;
        }
        if (r->looks == 0)
            break;
    }
    drop_files(r, r->looks);
    return rc;
}

/* --- parts ---------------------------------------------------------------------------------------------------------- */

static struct pt_render_config config_of(const struct recorder *r)
{
    struct pt_render_config c = r->config->render;
    const int refers = r->part == SEQ_PART_REFERENCE, in_step = r->m.of.n_levels > 0;
    c.time_budget_s = 0.0;
    c.max_check_overhead = 0.0;
    c.mask = NULL;
    if (refers || in_step) {
        c.uniform = 1;
        c.max_seam = 0.0;
        c.spp_max = refers ? r->config->reference_spp : r->m.of.levels[r->m.of.n_levels - 1];
        c.spp_min = c.spp_min < c.spp_max ? c.spp_min : c.spp_max;
    }
    if (refers)
        c.integrator.seed = pt_sequence_reference_seed(c.integrator.seed, r->reference);
    else {
        static const struct {
            uint32_t film, plane;
        } map[] = {{PT_FILM_HALF, SEQ_PLANE_HALF},
                   {PT_FILM_MOMENT2, SEQ_PLANE_MOMENT2},
                   {PT_FILM_ALBEDO, SEQ_PLANE_ALBEDO},
                   {PT_FILM_NORMAL, SEQ_PLANE_NORMAL},
                   {PT_FILM_DEPTH, SEQ_PLANE_DEPTH}};
        for (size_t i = 0; i < sizeof map / sizeof map[0]; i++)
            c.planes |= r->m.planes >> map[i].plane & 1 ? map[i].film : 0;
    }
    return c;
}

static int advance(struct recorder *r, struct pt_render *render, uint64_t spp, int *stopped, struct base_err *err)
{
    const int rc = pt_render_advance(render, spp, &r->hooks, stopped, err);
    return !rc && *stopped ? save(r, render, err) : rc;
}

/* All blocks at the same levels. */
static int record_ladder(struct recorder *r, struct pt_render *render, int *stopped, struct base_err *err)
{
    int rc = 0;
    while (r->looks < r->m.of.n_levels && !rc) {
        rc = advance(r, render, r->m.of.levels[r->looks], stopped, err);
        if (rc || *stopped)
            break;
        const uint32_t n = pt_render_judge(render, &r->hooks);
        rc = put_look(r, render, n, render->criterion != NULL, 1, err);
    }
    return rc;
}

/* Each block where its criterion asks for it, until that stops it. */
static int record_render(struct recorder *r, struct pt_render *render, int *stopped, struct base_err *err)
{
    enum pt_render_outcome outcome;
    int rc = pt_render_run(render, &r->hooks, &outcome, err);
    if (!rc && outcome == PT_RENDER_LOST)
        rc = base_fail(err, BASE_EIO, "the recording is not finished: the same command goes on");
    *stopped = outcome == PT_RENDER_INTERRUPTED;
    return rc;
}

/* Stopped blocks with more samples, and what the criterion says then. */
static int record_beyond(struct recorder *r, struct pt_render *render, int *stopped, struct base_err *err)
{
    int rc = 0;
    for (;;) {
        uint32_t active = 0;
        for (uint32_t i = 0; i < render->blocks->count; i++) {
            struct lull_host_block *b = &render->blocks->list[i];
            const int is_new = !b->asked || b->asked_spp != b->spp; /* of a wave that was interrupted */
            b->reason = LULL_REASON_NONE;
            if (!is_new)
                b->next_spp = (uint64_t)fmin(ceil(PAST_STOP * (double)b->spp), (double)render->blocks->spp_max);
            active += is_new || b->spp < b->next_spp;
        }
        if (active == 0)
            return 0;
        rc = advance(r, render, 0, stopped, err);
        if (rc || *stopped)
            return rc;
        const uint32_t n = pt_render_judge(render, &r->hooks);
        if ((rc = put_look(r, render, n, 1, 1, err)) != 0)
            return rc;
    }
}

static int record_reference(struct recorder *r, struct pt_render *render, int *stopped, struct base_err *err)
{
    const int rc = advance(r, render, r->config->reference_spp, stopped, err);
    if (rc || *stopped)
        return rc;
    return put_look(r, render, pt_render_judge(render, &r->hooks), 0, 1, err);
}

static int record_part(struct recorder *r, struct pt_render *render, int *stopped, struct base_err *err)
{
    switch (r->part) {
    case SEQ_PART_REFERENCE: return record_reference(r, render, stopped, err);
    case SEQ_PART_BEYOND: return record_beyond(r, render, stopped, err);
    default: return (r->m.of.n_levels > 0 ? record_ladder : record_render)(r, render, stopped, err);
    }
}

/* The part is whole; what goes on past the stops begins with its film. */
static int finish_part(struct recorder *r, const struct pt_render *render, struct base_err *err)
{
    char done[4096];
    int rc = 0;
    strcpy(done, r->state);
    if (r->part == SEQ_PART_LOOKS && r->config->past_stops) {
        r->part = SEQ_PART_BEYOND;
        r->looks = 0;
        r->state[0] = '\0';
        rc = save(r, render, err);
        r->part = SEQ_PART_LOOKS;
    }
    if (r->part != SEQ_PART_REFERENCE || r->reference + 1 == SEQ_REFERENCES)
        r->m.finished |= 1u << r->part;
    if (!rc)
        rc = seq_recording_write(r->config->directory, &r->m, err);
    if (!rc && done[0] != '\0')
        unlink(done);
    return rc;
}

static int run(struct recorder *r, int *stopped, struct base_err *err)
{
    const struct pt_render_config c = config_of(r);
    struct lull_host_criterion *criterion = r->part == SEQ_PART_REFERENCE ? NULL : r->criterion;
    struct pt_render *render = NULL;
    base_identity_release(&r->identity);
    r->identity = (struct base_identity){0};
    seq_recording_identity(&r->m, &r->identity);
    base_identity_add(&r->identity, "reference", "%d", r->part == SEQ_PART_REFERENCE ? r->reference + 1 : 0);
    int rc = base_identity_check(&r->identity, err);
    if (!rc)
        rc = pt_render_create(&c, r->scene, r->kernel, r->threads, criterion, &render, err);
    if (!rc)
        rc = load(r, render, err);
    r->saved_s = base_clock_wall_s();
    if (!rc)
        rc = record_part(r, render, stopped, err);
    if (!rc && !*stopped)
        rc = finish_part(r, render, err);
    if (!rc && !*stopped && render->totals->dropped > 0)
        base_log_say(r->outer->log, "%llu samples were not finite and were dropped; the looks count them",
                     (unsigned long long)render->totals->dropped);
    pt_render_destroy(render);
    return rc;
}

/* --- the folder ----------------------------------------------------------------------------------------------------- */

static int describe_criterion(struct recorder *r, struct base_err *err)
{
    const struct pt_sequence_config *c = r->config;
    const struct lull_criterion *t = lull_host_table(r->criterion);
    struct seq_recording *m = &r->m;
    size_t used = 0;
    snprintf(m->spec, sizeof m->spec, "%s", c->criterion);
    snprintf(m->criterion, sizeof m->criterion, "%s", t->id);
    snprintf(m->version, sizeof m->version, "%s", t->version);
    for (uint32_t i = 0; i < t->param_count; i++) {
        const struct lull_param *p = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        const char *value = lull_host_parameter(t, p->name, c->pairs, c->pair_count, NULL);
        if (!value)
            continue;
        const int n = snprintf(m->parameters + used, sizeof m->parameters - used, "%s=%s\n", p->name, value);
        if (strchr(value, '\n') || n >= (int)(sizeof m->parameters - used))
            return base_fail(err, BASE_EINVAL, "-p %s: a recording has no room for this value", p->name);
        used += (size_t)n;
    }
    /* what it reads is recorded, or it could not be asked again */
    m->planes |= pt_host_planes_of(pt_host_film_planes(lull_host_needs(r->criterion))) << SEQ_PLANE_COLOR;
    return 0;
}

static int describe_blocks(struct recorder *r, struct base_err *err)
{
    const struct pt_render_config c = config_of(r);
    struct seq_manifest *m = &r->m.of;
    struct pt_render *render = NULL;
    int rc = pt_render_create(&c, r->scene, r->kernel, r->threads, r->criterion, &render, err);
    if (rc)
        return rc;
    m->blocks = calloc(render->blocks->count, sizeof *m->blocks);
    if (m->blocks)
        m->n_blocks = render->blocks->count;
    else
        rc = base_fail_nomem(err, "blocks");
    for (uint32_t i = 0; i < m->n_blocks; i++) {
        const struct lull_host_block *b = &render->blocks->list[i];
        m->blocks[i] = (struct seq_manifest_block){
            .id = i, .x0 = (uint32_t)b->x0, .y0 = (uint32_t)b->y0, .x1 = (uint32_t)b->x1, .y1 = (uint32_t)b->y1};
    }
    pt_render_destroy(render);
    return rc;
}

static int describe(struct recorder *r, struct base_err *err)
{
    const struct pt_sequence_config *c = r->config;
    struct seq_recording *m = &r->m;
    int rc = 0;
    pt_sequence_describe(c, r->scene, &m->of);
    if (c->levels) {
        m->of.levels = calloc(PT_SEQUENCE_MAX_LEVELS, sizeof *m->of.levels);
        if (!m->of.levels)
            return base_fail_nomem(err, "levels");
        if ((rc = pt_sequence_levels(c->levels, m->of.levels, err)) < 0)
            return rc;
        m->of.n_levels = (uint32_t)rc;
    }
    m->planes = c->planes | 1u << SEQ_PLANE_COLOR;
    if (r->criterion && (rc = describe_criterion(r, err)) != 0)
        return rc;
    const struct pt_render_config render = config_of(r);
    const double clamp = (double)render.integrator.max_component;
    m->frame = (struct seq_recording_frame){.flags = pt_render_flags(&render),
                                            .transfer = "srgb",
                                            .exposure = 1.0,
                                            .sample_clamp = isfinite(clamp) ? clamp : 0.0,
                                            .max_seam = render.max_seam,
                                            .spp_min = c->render.spp_min,
                                            .spp_max = c->render.spp_max};
    if (m->of.n_levels > 0 && m->frame.spp_max < render.spp_max) /* levels may go further than a render */
        m->frame.spp_max = render.spp_max;
    memcpy(m->frame.rgb_to_xyz, (const double[9])BASE_RGB_TO_XYZ, sizeof m->frame.rgb_to_xyz);
    return describe_blocks(r, err);
}

/* Takes over what an earlier run has finished. */
static int resume(struct recorder *r, struct base_err *err)
{
    struct base_identity ours = {0}, theirs = {0};
    struct seq_recording old;
    struct stat st;
    char path[4096];
    int rc = base_file_join(path, r->config->directory, "manifest.json", err);
    if (rc || (stat(path, &st) != 0 && errno == ENOENT))
        return rc;
    if ((rc = seq_recording_read(r->config->directory, &old, err)) != 0)
        return rc;
    seq_recording_identity(&r->m, &ours);
    seq_recording_identity(&old, &theirs);
    rc = pt_sequence_same(&ours, &theirs, path, err);
    for (uint32_t i = 0; i < old.n_files && !rc; i++) {
        struct seq_look look;
        rc = seq_recording_read_look(r->config->directory, &old, i, &look, err); /* damaged, it could not be made again */
        if (!rc)
            seq_look_release(&look);
        if (!rc)
            rc = seq_recording_add(&r->m, &old.files[i], err);
    }
    r->m.finished = old.finished;
    base_identity_release(&ours);
    base_identity_release(&theirs);
    seq_recording_release(&old);
    return rc;
}

static int has_reference(const struct recorder *r)
{
    char name[64];
    int found = 0;
    snprintf(name, sizeof name, "reference-%d.lseq", r->reference + 1);
    for (uint32_t i = 0; i < r->m.n_files; i++)
        found |= r->m.files[i].part == SEQ_PART_REFERENCE && strcmp(r->m.files[i].name, name) == 0;
    return found;
}

static int record_all(struct recorder *r, int *stopped, struct base_err *err)
{
    const double start_s = base_clock_wall_s();
    const int wanted[] = {1, r->config->past_stops, r->config->reference_spp > 0};
    int rc = seq_recording_write(r->config->directory, &r->m, err);
    for (int p = SEQ_PART_LOOKS; p <= SEQ_PART_REFERENCE && !rc && !*stopped; p++) {
        const int runs = p == SEQ_PART_REFERENCE ? SEQ_REFERENCES : 1;
        r->part = (enum seq_part)p;
        for (r->reference = 0; r->reference < runs && wanted[p] && !(r->m.finished >> p & 1) && !rc && !*stopped;
             r->reference++)
            if (p != SEQ_PART_REFERENCE || !has_reference(r))
                rc = run(r, stopped, err);
        r->reference = 0;
    }
    if (rc || *stopped)
        return rc;
    double bytes = 0;
    for (uint32_t i = 0; i < r->m.n_files; i++)
        bytes += (double)r->m.files[i].bytes;
    base_log_note(r->outer->log, "%u files, %.1f MB, %.0f s", r->m.n_files, bytes / 1e6, base_clock_wall_s() - start_s);
    return 0;
}

int pt_sequence_record_frame(const struct pt_sequence_config *config, const struct pt_scene *scene, pt_kernel *kernel,
                             struct base_threads *threads, struct lull_host_criterion *criterion,
                             const struct pt_render_hooks *hooks, int *was_interrupted, struct base_err *err)
{
    struct recorder *r = calloc(1, sizeof *r); /* large */
    if (!r)
        return base_fail_nomem(err, "recording");
    *r = (struct recorder){
        .config = config, .scene = scene, .kernel = kernel, .threads = threads, .criterion = criterion, .outer = hooks};
    r->hooks = (struct pt_render_hooks){.slice = after_slice,
                                        .interrupted = hooks->interrupted,
                                        .suspend = suspend,
                                        .looked = looked,
                                        .log = hooks->log,
                                        .data = r};
    *was_interrupted = 0;
    int rc = describe(r, err);
    if (!rc)
        rc = base_make_folder(config->directory, NULL, err);
    if (!rc)
        rc = base_lock_folder(&r->lock, config->directory, err);
    if (!rc)
        rc = resume(r, err);
    if (!rc)
        rc = record_all(r, was_interrupted, err);
    base_lock_release(&r->lock);
    base_identity_release(&r->identity);
    seq_recording_release(&r->m);
    free(r);
    return rc;
}
