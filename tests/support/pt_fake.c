#include "support/pt_fake.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static uint32_t hash(uint32_t v)
{
    v ^= v >> 16;
    v *= 0x7feb352du;
    v ^= v >> 15;
    v *= 0x846ca68bu;
    return v ^ v >> 16;
}

void pt_fake_noise(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                   uint32_t sample, struct pt_path_result *out)
{
    (void)scene;
    for (int i = 0; i < count; i++, x++) {
        float u = (float)(hash(hash(hash(settings->seed + x) + y) + sample) >> 8) * 0x1p-24f;
        out[i] = (struct pt_path_result){.radiance = v3(0.5f + 0.5f * u, 0.25f, (float)x / 1000.0f),
                                         .albedo = v3_splat(0.5f),
                                         .normal_world = v3(0, 0, 1),
                                         .depth = 2.0f,
                                         .rays = 3};
    }
}

void pt_fake_constant(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                      uint32_t sample, struct pt_path_result *out)
{
    pt_fake_noise(scene, settings, x, y, count, sample, out);
    for (int i = 0; i < count; i++)
        out[i].radiance = v3(0.1f, 0.2f, 0.3f);
}

void pt_fake_nan(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                 uint32_t sample, struct pt_path_result *out)
{
    pt_fake_noise(scene, settings, x, y, count, sample, out);
    for (int i = 0; i < count; i++)
        if (x + (uint32_t)i < 8 && sample % 97 == 5)
            out[i].radiance.y = NAN;
}

void pt_fake_all_nan(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, int count,
                     uint32_t sample, struct pt_path_result *out)
{
    pt_fake_noise(scene, settings, x, y, count, sample, out);
    for (int i = 0; i < count; i++)
        if (x + (uint32_t)i < 8)
            out[i].radiance = v3_splat(INFINITY);
}

/* --- criterion ------------------------------------------------------------------------------------------------------ */

enum { MAX_BLOCKS = 64 };

struct lull_instance {
    uint64_t at;
    uint32_t seen[MAX_BLOCKS];
};

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                      struct lull_instance **out, struct lull_error *err)
{
    (void)host;
    (void)err;
    struct lull_instance *i = calloc(1, sizeof *i);
    if (!i)
        return LULL_E_MEMORY;
    i->at = 32;
    for (uint32_t k = 0; k < count; k++)
        i->at =
            strtoull(((const struct lull_pair *)(const void *)((const char *)pairs + (size_t)k * stride))->value, NULL, 10);
    *out = i;
    return LULL_OK;
}

static int32_t requirements(const struct lull_instance *i, struct lull_requirements *req, struct lull_error *err)
{
    (void)i;
    (void)err;
    req->flags = LULL_REQ_FLEXIBLE;
    req->planes_required = req->planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) |
                                              LULL_PLANE_BIT(LULL_PLANE_MOMENT2) | LULL_PLANE_BIT(LULL_PLANE_SPP);
    req->first_spp = 1;
    return LULL_OK;
}

static int32_t begin_frame(struct lull_instance *i, const struct lull_frame *frame, struct lull_error *err)
{
    (void)err;
    memset(i->seen, 0, sizeof i->seen);
    return frame->block_count <= MAX_BLOCKS ? LULL_OK : LULL_E_UNSUPPORTED;
}

static const void *pixel(const struct lull_view *view, int plane, int x, int y)
{
    const struct lull_plane *p = &view->planes[plane];
    return (const char *)p->data + (x - view->x0) * p->stride_x + (y - view->y0) * p->stride_y;
}

/* error: mean of red as the view says it, so that tests see normalisation and dropped samples. */
static double mean_red(const struct lull_view *view, const struct lull_block *b)
{
    const struct lull_plane *p = view->planes;
    double sum = 0.0;
    for (int y = b->y0; y < b->y1; y++)
        for (int x = b->x0; x < b->x1; x++) {
            double red = *(const double *)pixel(view, LULL_PLANE_COLOR, x, y);
            if (p->normaliser == LULL_NORM_WEIGHT)
                red *= (double)b->spp / (double)*(const uint32_t *)pixel(view, LULL_PLANE_WEIGHT, x, y);
            sum += red;
        }
    return sum * p->scale / (double)b->spp / ((b->x1 - b->x0) * (b->y1 - b->y0));
}

static uint64_t column_factor(const struct lull_block *b) { return 1 + (uint64_t)(b->x0 / 16) % 4; }

static int32_t evaluate(struct lull_instance *i, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    (void)err;
    (void)block_stride;
    (void)decision_stride;
    for (uint32_t k = 0; k < count; k++) {
        const struct lull_block *b = &blocks[k];
        i->seen[b->id]++;
        decisions[k].error = mean_red(view, b);
        decisions[k].p_noisy = 1.0 / i->seen[b->id];
        decisions[k].predicted_spp = (double)(i->at * column_factor(b));
        decisions[k].action = b->spp >= i->at * column_factor(b) ? LULL_STOP : LULL_CONTINUE;
    }
    return LULL_OK;
}

static void end_frame(struct lull_instance *i) { (void)i; }

static void destroy(struct lull_instance *i) { free(i); }

static int32_t save(const struct lull_instance *i, const struct lull_writer *writer, struct lull_error *err)
{
    (void)err;
    return writer->write(writer, i->seen, sizeof i->seen);
}

static int32_t load(struct lull_instance *i, const struct lull_reader *reader, struct lull_error *err)
{
    (void)err;
    return reader->read(reader, i->seen, sizeof i->seen);
}

static const void *get_extension(const char *id)
{
    static const struct lull_state state = {.struct_size = sizeof state, .save = save, .load = load};
    return strcmp(id, LULL_EXT_STATE) == 0 ? &state : NULL;
}

const struct lull_criterion *pt_fake_criterion(void)
{
    static const struct lull_param params[] = {{.name = "at", .help = "spp", .default_value = "32", .min = 1, .max = 1e6}};
    static const struct lull_criterion table = {.struct_size = sizeof table,
                                                .id = "fake",
                                                .name = "fake",
                                                .version = "1",
                                                .description = "stops at N",
                                                .params = params,
                                                .param_count = 1,
                                                .param_stride = sizeof params[0],
                                                .thread_level = LULL_THREADS_INSTANCE,
                                                .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
                                                .create = create,
                                                .requirements = requirements,
                                                .begin_frame = begin_frame,
                                                .evaluate = evaluate,
                                                .end_frame = end_frame,
                                                .destroy = destroy,
                                                .get_extension = get_extension};
    return &table;
}

/* --- rendering ------------------------------------------------------------------------------------------------------ */

struct pt_render_config pt_fake_config(void)
{
    return (struct pt_render_config){.width = 60,
                                     .height = 44,
                                     .crop = {0, 0, 60, 44},
                                     .block_width = 16,
                                     .block_height = 16,
                                     .spp_min = 8,
                                     .spp_max = 256,
                                     .integrator = {.seed = 7, .max_component = INFINITY}};
}

struct pt_fake_run pt_fake_render(const struct pt_render_config *config, pt_kernel *kernel, int threads, const char *at)
{
    struct lull_pair pair = {"at", at};
    struct pt_render_hooks hooks = {0};
    struct pt_fake_run run = {0};
    enum pt_render_outcome outcome;
    struct base_err err = {0};
    run.pool = base_threads_create(threads, &err);
    int rc = run.pool ? 0 : BASE_ENOMEM;
    if (!rc && at)
        rc = pt_criterion_create(pt_fake_criterion(), &pair, 1, run.pool, NULL, &run.criterion, &err);
    if (!rc)
        rc = pt_render_create(config, NULL, kernel, run.pool, run.criterion, &run.render, &err);
    if (!rc)
        rc = pt_render_run(run.render, &hooks, &outcome, &err);
    assert_int_equal(rc, 0);
    return run;
}

void pt_fake_release(struct pt_fake_run *run)
{
    pt_render_destroy(run->render);
    lull_host_close(run->criterion);
    base_threads_destroy(run->pool);
    *run = (struct pt_fake_run){0};
}

void pt_fake_assert_same(const struct pt_render *a, const struct pt_render *b)
{
    struct pt_film_array x[PT_FILM_ARRAYS], y[PT_FILM_ARRAYS];
    int n = pt_film_list_arrays(&a->film, 0, a->film.pixels, x);
    assert_int_equal(n, pt_film_list_arrays(&b->film, 0, b->film.pixels, y));
    for (int i = 0; i < n; i++)
        assert_memory_equal(x[i].data, y[i].data, x[i].bytes);
    assert_int_equal(a->blocks->count, b->blocks->count);
    for (uint32_t i = 0; i < a->blocks->count; i++) {
        const struct lull_host_block *p = &a->blocks->list[i], *q = &b->blocks->list[i];
        assert_int_equal(p->spp, q->spp);
        assert_int_equal(p->half_spp, q->half_spp);
        assert_int_equal(p->reason, q->reason);
        assert_int_equal(p->checks, q->checks);
        assert_memory_equal(&p->error, &q->error, sizeof p->error);
        assert_memory_equal(&p->p_noisy, &q->p_noisy, sizeof p->p_noisy);
    }
}
