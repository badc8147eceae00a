#include "render/criterion.h"

#include <lull/loader.h>

#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/colour.h"

struct pt_criterion {
    const struct lull_criterion *table;
    struct lull_instance *instance; /* owns */
    struct lull_host host;
    struct lull_requirements needs;
    struct base_threads *threads;
    void (*warn)(void *data, const char *line);
    void *warn_data;
    struct lull_plane planes[LULL_PLANE_COUNT];
    struct lull_block *all;  /* owns; [blocks] state of every block */
    struct lull_block *due;  /* owns; [blocks] scratch of evaluate */
    struct lull_rect *rects; /* owns; [blocks] */
    uint32_t *spp;           /* owns; [film pixels] per-pixel SPP and WEIGHT, only when the criterion requires one */
    double begin_s;
    int open;
};

/* --- services for the criterion ------------------------------------------------------------------------------------- */

static void host_log(const struct lull_host *host, int32_t level, const char *text)
{
    const struct pt_criterion *c = host->context;
    if (!c->warn || level > LULL_LOG_WARNING)
        return;
    char line[600];
    snprintf(line, sizeof line, "criterion %s: %s", c->table->id, text);
    c->warn(c->warn_data, line);
}

struct job {
    lull_task_fn fn;
    void *arg;
    uint64_t first;
};

static void run_task(void *data, long i, int worker)
{
    const struct job *job = data;
    job->fn(job->arg, job->first + (uint64_t)i, (uint32_t)worker);
}

static int32_t host_parallel_for(const struct lull_host *host, uint64_t count, lull_task_fn fn, void *arg)
{
    const struct pt_criterion *c = host->context;
    struct job job = {.fn = fn, .arg = arg};
    for (; job.first < count;) {
        uint64_t n = count - job.first < LONG_MAX / 2 ? count - job.first : LONG_MAX / 2;
        if (c->threads)
            base_threads_for(c->threads, (long)n, run_task, &job);
        else
            for (uint64_t i = 0; i < n; i++)
                run_task(&job, (long)i, 0);
        job.first += n;
    }
    return LULL_OK;
}

/* --- finding -------------------------------------------------------------------------------------------------------- */

struct teller {
    void (*warn)(void *data, const char *line);
    void *data;
};

static void tell(void *context, int32_t level, const char *text)
{
    const struct teller *t = context;
    if (t->warn && level <= LULL_LOG_WARNING)
        t->warn(t->data, text);
}

static int from_lull(int32_t code)
{
    return code == LULL_E_MEMORY ? BASE_ENOMEM : BASE_EINVAL;
}

int pt_criterion_create(const char *spec, const struct lull_pair *pairs, uint32_t pair_count, struct base_threads *threads,
                        void (*warn)(void *data, const char *line), void *warn_data, struct pt_criterion **out,
                        struct base_err *err)
{
    struct teller teller = {warn, warn_data};
    struct lull_search search = {.log = tell, .log_context = &teller};
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_found *found = malloc(sizeof *found);
    if (!found)
        return base_fail_nomem(err, "criterion");
    int32_t code = lull_open(&search, spec, found, &e);
    const struct lull_criterion *table = found->criterion;
    free(found);
    if (code != LULL_OK)
        return base_fail(err, from_lull(code), "%s", e.message);
    return pt_criterion_create_table(table, pairs, pair_count, threads, warn, warn_data, out, err);
}

int pt_criterion_create_table(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                              struct base_threads *threads, void (*warn)(void *data, const char *line), void *warn_data,
                              struct pt_criterion **out, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct pt_criterion *c = calloc(1, sizeof *c);
    if (!c)
        return base_fail_nomem(err, "criterion");
    c->table = table;
    c->threads = threads;
    c->warn = warn;
    c->warn_data = warn_data;
    c->host = (struct lull_host){.struct_size = sizeof c->host, .api_minor = LULL_API_MINOR, .context = c,
                                 .name = "lull pathtracer 1.0",
                                 .max_workers = threads ? (uint32_t)base_threads_count(threads) : 1,
                                 .log = host_log, .parallel_for = host_parallel_for};
    int32_t code = table->create(&c->host, pairs, pair_count, sizeof *pairs, &c->instance, &e);
    if (code == LULL_OK) {
        c->needs.struct_size = sizeof c->needs;
        code = table->requirements(c->instance, &c->needs, &e);
    }
    if (code != LULL_OK) {
        base_fail(err, from_lull(code), "criterion %s: %s", table->id, e.message);
        pt_criterion_destroy(c);
        return from_lull(code);
    }
    *out = c;
    return 0;
}

void pt_criterion_destroy(struct pt_criterion *c)
{
    if (!c)
        return;
    if (c->instance) {
        if (c->open)
            c->table->end_frame(c->instance);
        c->table->destroy(c->instance);
    }
    free(c->all);
    free(c->due);
    free(c->rects);
    free(c->spp);
    free(c);
}

const struct lull_criterion *pt_criterion_table(const struct pt_criterion *c)
{
    return c->table;
}

const struct lull_requirements *pt_criterion_requirements(const struct pt_criterion *c)
{
    return &c->needs;
}

uint32_t pt_criterion_film_planes(const struct pt_criterion *c)
{
    static const struct {
        int abi;
        uint32_t film;
    } map[] = {{LULL_PLANE_HALF, PT_FILM_HALF},     {LULL_PLANE_MOMENT2, PT_FILM_MOMENT2},
               {LULL_PLANE_ALBEDO, PT_FILM_ALBEDO}, {LULL_PLANE_NORMAL, PT_FILM_NORMAL},
               {LULL_PLANE_DEPTH, PT_FILM_DEPTH}};
    uint32_t planes = PT_FILM_COLOR;
    for (size_t i = 0; i < sizeof map / sizeof map[0]; i++)
        if (c->needs.planes_used & LULL_PLANE_BIT(map[i].abi))
            planes |= map[i].film;
    return planes;
}

/* --- the frame ------------------------------------------------------------------------------------------------------ */

static struct lull_plane plane_f64(const double *data, const struct pt_film *film, uint32_t channels, int32_t normaliser)
{
    int64_t pixel = (int64_t)(channels * sizeof(double));
    return (struct lull_plane){.data = data, .stride_x = pixel, .stride_y = pixel * (film->x1 - film->x0),
                               .stride_c = (int64_t)sizeof(double), .scale = 1.0, .type = LULL_TYPE_F64,
                               .normaliser = normaliser, .channels = channels};
}

/* Describes the film's arrays; returns the mask of the planes that are there. */
static uint32_t describe_planes(struct pt_criterion *c, const struct pt_film *film)
{
    struct lull_plane *p = c->planes;
    memset(p, 0, sizeof c->planes);
    p[LULL_PLANE_COLOR] = plane_f64(film->color, film, 3, LULL_NORM_SPP);
    p[LULL_PLANE_HALF] = plane_f64(film->half, film, 3, LULL_NORM_HALF_SPP);
    p[LULL_PLANE_MOMENT2] = plane_f64(film->moment2, film, 1, LULL_NORM_SPP);
    p[LULL_PLANE_ALBEDO] = plane_f64(film->albedo, film, 3, LULL_NORM_SPP);
    p[LULL_PLANE_NORMAL] = plane_f64(film->normal, film, 3, LULL_NORM_SPP);
    p[LULL_PLANE_DEPTH] = plane_f64(film->depth, film, 1, LULL_NORM_ONE);
    if (c->spp) {
        struct lull_plane counts = {.data = c->spp, .stride_x = sizeof *c->spp,
                                    .stride_y = (int64_t)sizeof *c->spp * (film->x1 - film->x0), .stride_c = sizeof *c->spp,
                                    .scale = 1.0, .type = LULL_TYPE_U32, .normaliser = LULL_NORM_ONE, .channels = 1};
        p[LULL_PLANE_WEIGHT] = counts;
        p[LULL_PLANE_SPP] = counts;
    }
    uint32_t mask = 0;
    for (int i = 0; i < LULL_PLANE_COUNT; i++) {
        if (p[i].data)
            mask |= LULL_PLANE_BIT(i);
        else
            p[i] = (struct lull_plane){0};
    }
    return mask;
}

static int allocate_frame(struct pt_criterion *c, const struct pt_blocks *blocks, const struct pt_film *film,
                          struct base_err *err)
{
    free(c->all);
    free(c->due);
    free(c->rects);
    free(c->spp);
    c->spp = NULL;
    c->all = calloc(blocks->count, sizeof *c->all);
    c->due = calloc(blocks->count, sizeof *c->due);
    c->rects = calloc(blocks->count, sizeof *c->rects);
    int counts = (c->needs.planes_required & (LULL_PLANE_BIT(LULL_PLANE_SPP) | LULL_PLANE_BIT(LULL_PLANE_WEIGHT))) != 0;
    if (counts)
        c->spp = calloc(film->pixels, sizeof *c->spp);
    if (!c->all || !c->due || !c->rects || (counts && !c->spp))
        return base_fail_nomem(err, "blocks of the criterion");
    return 0;
}

int pt_criterion_begin(struct pt_criterion *c, const struct pt_criterion_frame *frame, const struct pt_blocks *blocks,
                       const struct pt_film *film, struct base_err *err)
{
    const struct lull_requirements *needs = &c->needs;
    if (!(needs->flags & LULL_REQ_FLEXIBLE) && needs->block_width > 0 && needs->block_height > 0 &&
        ((int)needs->block_width != blocks->block_width || (int)needs->block_height != blocks->block_height))
        return base_fail(err, BASE_EINVAL, "criterion %s judges blocks of %ux%u pixels only: use --block %ux%u", c->table->id,
                       needs->block_width, needs->block_height, needs->block_width, needs->block_height);
    int rc = allocate_frame(c, blocks, film, err);
    if (rc)
        return rc;
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct pt_block *b = &blocks->list[i];
        c->rects[i] = (struct lull_rect){b->x0, b->y0, b->x1, b->y1};
    }
    struct lull_frame f = {
        .struct_size = sizeof f,
        .flags = (frame->deterministic ? LULL_FRAME_DETERMINISTIC : 0) | (frame->independent ? LULL_FRAME_INDEPENDENT : 0) |
                 (c->open ? LULL_FRAME_RESTART : 0),
        .width = (uint32_t)frame->width,
        .height = (uint32_t)frame->height,
        .blocks = c->rects,
        .block_count = blocks->count,
        .block_stride = sizeof c->rects[0],
        .planes = describe_planes(c, film),
        .transfer = LULL_TRANSFER_SRGB,
        .exposure = 1.0,
        .sample_clamp = frame->sample_clamp,
        .time_budget_s = frame->time_budget_s,
        .spp_min = frame->spp_min,
        .spp_max = frame->spp_max,
        .seed = frame->seed,
        .rgb_to_xyz = BASE_RGB_TO_XYZ,
    };
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = c->table->begin_frame(c->instance, &f, &e);
    if (code != LULL_OK)
        return base_fail(err, from_lull(code), "criterion %s: %s", c->table->id, e.message);
    c->open = 1;
    c->begin_s = base_clock_wall_s();
    return 0;
}

static void fill_counts(struct pt_criterion *c, const struct pt_film *film, const struct pt_blocks *blocks)
{
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct pt_block *b = &blocks->list[i];
        for (int y = b->y0; y < b->y1; y++)
            for (int x = b->x0; x < b->x1; x++)
                c->spp[pt_film_index(film, x, y)] = (uint32_t)b->spp;
    }
}

static struct lull_block block_state(const struct pt_block *b, uint32_t index, int has_half)
{
    return (struct lull_block){.id = index, .flags = b->reason != PT_REASON_NONE ? LULL_BLOCK_STOPPED : 0, .x0 = b->x0,
                               .y0 = b->y0, .x1 = b->x1, .y1 = b->y1, .spp = b->spp,
                               .half_spp = has_half ? pt_film_half_spp(b->spp) : 0, .thread_s = b->thread_s};
}

int pt_criterion_evaluate(struct pt_criterion *c, struct pt_film *film, const struct pt_blocks *blocks, const uint32_t *due,
                          uint32_t count, const uint8_t *final, struct lull_decision *decisions, struct base_err *err)
{
    int rc = 0, has_half = film->half != NULL;
    struct pt_film_patch patch = {0};
    const struct lull_decision preset = {.action = LULL_CONTINUE, .p_noisy = NAN, .predicted_spp = NAN, .error = NAN};

    for (uint32_t i = 0; i < blocks->count; i++)
        c->all[i] = block_state(&blocks->list[i], i, has_half);
    for (uint32_t k = 0; k < count; k++) {
        decisions[k] = preset;
        c->due[k] = c->all[due[k]];
        if (final[k])
            c->due[k].flags |= LULL_BLOCK_FINAL;
    }
    for (uint32_t i = 0; i < blocks->count && !rc; i++) {
        const struct pt_block *b = &blocks->list[i];
        if (b->dropped > 0)
            rc = pt_film_patch(film, b->x0, b->y0, b->x1, b->y1, b->spp, &patch, err);
    }
    if (rc)
        goto out;
    if (c->spp)
        fill_counts(c, film, blocks);
    struct lull_view view = {.struct_size = sizeof view, .x0 = film->x0, .y0 = film->y0, .x1 = film->x1, .y1 = film->y1,
                             .planes = c->planes, .plane_count = LULL_PLANE_COUNT, .plane_stride = sizeof c->planes[0],
                             .all = c->all, .all_count = blocks->count, .all_stride = sizeof c->all[0],
                             .elapsed_s = base_clock_wall_s() - c->begin_s};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = c->table->evaluate(c->instance, &view, c->due, sizeof c->due[0], decisions, sizeof *decisions, count, &e);
    if (code != LULL_OK) {
        for (uint32_t k = 0; k < count; k++)
            decisions[k] = preset;
        rc = base_fail(err, from_lull(code), "criterion %s: %s", c->table->id, e.message);
    }
out:
    pt_film_unpatch(film, &patch);
    return rc;
}

/* --- state ---------------------------------------------------------------------------------------------------------- */

struct bytes {
    unsigned char *data;
    size_t used, room;
};

static int32_t write_bytes(const struct lull_writer *writer, const void *data, uint64_t size)
{
    struct bytes *b = writer->context;
    if (size > SIZE_MAX / 4 - b->used)
        return LULL_E_MEMORY;
    if (b->used + size > b->room) {
        size_t room = (b->used + (size_t)size) * 2;
        unsigned char *grown = realloc(b->data, room);
        if (!grown)
            return LULL_E_MEMORY;
        b->data = grown;
        b->room = room;
    }
    if (size > 0)
        memcpy(b->data + b->used, data, (size_t)size);
    b->used += (size_t)size;
    return LULL_OK;
}

struct const_bytes {
    const unsigned char *data;
    size_t at, size;
};

static int32_t read_bytes(const struct lull_reader *reader, void *data, uint64_t size)
{
    struct const_bytes *b = reader->context;
    if (size > b->size - b->at)
        return LULL_E_IO;
    if (size > 0)
        memcpy(data, b->data + b->at, (size_t)size);
    b->at += (size_t)size;
    return LULL_OK;
}

static const struct lull_state *state_extension(const struct pt_criterion *c)
{
    return c->table->get_extension ? c->table->get_extension(LULL_EXT_STATE) : NULL;
}

int pt_criterion_save(const struct pt_criterion *c, unsigned char **data, size_t *size, struct base_err *err)
{
    const struct lull_state *state = state_extension(c);
    struct bytes b = {0};
    if (state) {
        struct lull_writer writer = {.struct_size = sizeof writer, .context = &b, .write = write_bytes};
        struct lull_error e = {.struct_size = sizeof e};
        int32_t code = state->save(c->instance, &writer, &e);
        if (code != LULL_OK) {
            free(b.data);
            return base_fail(err, from_lull(code), "criterion %s: cannot save its state: %s", c->table->id, e.message);
        }
    }
    *data = b.data;
    *size = b.used;
    return 0;
}

int pt_criterion_load(struct pt_criterion *c, const unsigned char *data, size_t size, struct base_err *err)
{
    const struct lull_state *state = state_extension(c);
    if (!state)
        return size == 0 ? 0 : base_fail(err, BASE_EINVAL, "criterion %s keeps no state, but the checkpoint has one", c->table->id);
    struct const_bytes b = {.data = data, .size = size};
    struct lull_reader reader = {.struct_size = sizeof reader, .context = &b, .read = read_bytes};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = state->load(c->instance, &reader, &e);
    if (code != LULL_OK)
        return base_fail(err, from_lull(code), "criterion %s: cannot load its state: %s", c->table->id, e.message);
    if (b.at != size)
        return base_fail(err, BASE_EINVAL, "criterion %s: %zu bytes of its state were left over", c->table->id, size - b.at);
    return 0;
}

/* --- listing -------------------------------------------------------------------------------------------------------- */

struct listing {
    FILE *out;
    int count;
};

static int32_t list_one(void *context, const struct lull_found *found)
{
    struct listing *l = context;
    const struct lull_criterion *t = found->criterion;
    fprintf(l->out, "%s %s - %s\n", t->id, t->version, t->name);
    for (const char *line = t->description; *line != '\0';) {
        int n = (int)strcspn(line, "\n");
        fprintf(l->out, "    %.*s\n", n, line);
        line += n + (line[n] != '\0');
    }
    fprintf(l->out, "    from %s\n", found->path);
    for (uint32_t i = 0; i < t->param_count; i++) {
        const struct lull_param *p = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        fprintf(l->out, "    -p %s=%s  %s", p->name, p->default_value ? p->default_value : "?", p->help);
        if (p->type == LULL_PARAM_INT || p->type == LULL_PARAM_FLOAT)
            fprintf(l->out, " [%g to %g]", p->min, p->max);
        else if (p->type == LULL_PARAM_CHOICE)
            fprintf(l->out, " [%s]", p->choices);
        fprintf(l->out, "\n");
    }
    l->count++;
    return LULL_OK;
}

int pt_criterion_list(FILE *out, void (*warn)(void *data, const char *line), void *warn_data)
{
    struct teller teller = {warn, warn_data};
    struct lull_search search = {.log = tell, .log_context = &teller};
    struct listing listing = {.out = out};
    lull_list(&search, list_one, &listing);
    return listing.count;
}
