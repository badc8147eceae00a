/*
 * A run of paths: neighbouring pixels of a row, vertex by vertex together. One source, compiled once per effect set by the
 * files kernel_*.c.
 *
 * Rays go to the acceleration structure in packets, and what the hits need from memory is fetched for all of them before the
 * first is looked at: while one path would wait, others are worked on. Paths are in the order of their pixels throughout. Of
 * two surfaces at the very same distance the other rays of a packet may decide which is met: the bytes of an image depend on
 * the runs that rows are cut into (render/farm.c), never on thread or time.
 */
#ifndef PT_INTEG_RUN_H
#define PT_INTEG_RUN_H

#include "integ/fetch.h"
#include "integ/kernel_sets.h"
#include "integ/run_lanes.h"

/* Where the paths' rays end that is not known yet. Camera rays keep together, those of later vertices do not. */
PT_KERNEL_INLINE void pt_run_intersect(pt_effects fx, struct pt_path *const *live, int count, int coherent)
{
    const struct pt_ray *rays[PT_RUN];
    struct pt_hit *hits[PT_RUN];
    int n = 0;
    for (int i = 0; i < count; i++) {
        if ((fx & PT_FX_LOOKED) && live[i]->looked)
            continue;
        rays[n] = &live[i]->ray;
        hits[n++] = &live[i]->hit;
    }
    pt_accel_intersect_many(live[0]->scene, rays, n, coherent, hits);
    pt_fetch_hits(fx, live[0]->scene, hits, n);
}

/* Adds to each path what its last vertex planned, if it arrives. */
PT_KERNEL_INLINE void pt_run_lights(pt_effects fx, struct pt_path *const *live, int count)
{
    struct pt_ray shadow[PT_RUN];
    const struct pt_ray *rays[PT_RUN];
    struct pt_path *asked[PT_RUN];
    uint8_t occluded[PT_RUN] = {0};
    const int through = (fx & PT_FX_THROUGH) != 0; /* a hit says little: rays go one by one */
    int n = 0;
    for (int i = 0; i < count; i++)
        if (!v3_is_black(live[i]->plan.add)) {
            asked[n] = live[i];
            shadow[n] = pt_path_shadow_ray(live[i]);
            rays[n] = &shadow[n];
            n++;
        }
    if (!through)
        pt_accel_occluded_many(live[0]->scene, rays, n, occluded);
    for (int k = 0; k < n; k++) {
        asked[k]->rays += !through;
        if (!occluded[k])
            pt_path_add_light(fx, asked[k], &shadow[k]);
    }
}

/* Sets the paths' numbers for a vertex. */
PT_KERNEL_INLINE void pt_run_numbers(pt_effects fx, struct pt_path *const *live, int count, uint32_t vertex,
                                     struct pt_lane_keys *keys, float (*u)[PT_RUN])
{
    for (int i = 0; i < count; i++) {
        keys->pixel_key[i] = live[i]->sampler.pixel_key;
        keys->path_key[i] = live[i]->sampler.path_key;
        pt_sampler_block(&live[i]->sampler, vertex);
        live[i]->u = &u[0][i];
    }
    pt_lanes_best()->numbers(keys, count, vertex, PT_VERTEX_DIMS(fx), u);
}

/* The first rays of all paths, which are samples `sample` of pixels (x, y), (x + 1, y), … */
PT_KERNEL_INLINE void pt_run_start(pt_effects fx, const struct pt_scene *scene, const struct pt_integrator *settings,
                                   uint32_t x, uint32_t y, uint32_t sample, struct pt_path *paths, int count,
                                   struct pt_lane_keys *keys, float (*u)[PT_RUN])
{
    const int sobol = settings->sampler == PT_SAMPLER_SOBOL;
    float dx[PT_RUN], dy[PT_RUN];
    for (int i = 0; i < count; i++) {
        struct pt_sampler *s = &paths[i].sampler;
        *s = pt_sampler_make(sobol, settings->seed, x + (uint32_t)i, y, sample);
        keys->index_reversed = s->index_reversed; /* the same of all */
        keys->pixel_key[i] = s->pixel_key;
        keys->path_key[i] = s->path_key;
        paths[i].u = &u[0][i];
    }
    keys->sobol = sobol;
    const int lens = (fx & PT_FX_DEFOCUS) && scene->camera.lens_radius > 0.0f;
    pt_lanes_best()->numbers(keys, count, 0,
                             (struct pt_lane_dims){.pairs = 1u << PT_DIM_PIXEL | (lens ? 1u << PT_DIM_LENS : 0u)}, u);
    pt_filter_sample(settings, count, u[PT_DIM_PIXEL], u[PT_DIM_PIXEL + 1], dx, dy);
    for (int i = 0; i < count; i++)
        pt_path_start(fx, &paths[i], (float)(x + (uint32_t)i) + 0.5f + dx[i], (float)y + 0.5f + dy[i]);
}

/* Whether pt_run_sample_lanes covers it. */
PT_KERNEL_INLINE int pt_run_in_lanes(pt_effects fx, const struct pt_integrator *settings)
{
    return !(fx & ~(pt_effects)PT_FX_SET_DIFFUSE) && settings->strategy == PT_STRATEGY_MIS && !settings->want_aux;
}

PT_KERNEL_INLINE void pt_run_sample(pt_effects fx, const struct pt_scene *scene, const struct pt_integrator *settings,
                                    uint32_t x, uint32_t y, int count, uint32_t sample, struct pt_trace *trace,
                                    struct pt_path_result *out)
{
    struct pt_path paths[PT_RUN], *live[PT_RUN]; /* no initialiser: it would clear them all for each run */
    struct pt_passed passed[PT_RUN];
    struct pt_contact contacts[PT_RUN];
    struct pt_lane_keys keys;
    _Alignas(64) float u[PT_DIMS_PER_VERTEX][PT_RUN];
    for (int i = 0; i < count; i++) {
        live[i] = &paths[i];
        paths[i].scene = scene;
        paths[i].settings = settings;
        paths[i].trace = trace;
        paths[i].passed = &passed[i];
        paths[i].contact = &contacts[i];
        paths[i].out = &out[i];
    }
    pt_run_start(fx, scene, settings, x, y, sample, paths, count, &keys, u);
    int n = count;
    for (uint32_t vertex = 1; n > 0; vertex++) {
        uint8_t alive[PT_RUN];
        pt_run_intersect(fx, live, n, vertex == 1);
        pt_run_numbers(fx, live, n, vertex, &keys, u);
        for (int i = 0; i < n; i++)
            alive[i] = (uint8_t)pt_path_vertex(fx, live[i]);
        pt_run_lights(fx, live, n);
        int left = 0;
        for (int i = 0; i < n; i++)
            if (alive[i])
                live[left++] = live[i];
        n = left;
    }
    for (int i = 0; i < count; i++)
        pt_path_end(&paths[i]);
}

/* The whole of a file kernel_NAME.c: the kernel of the list PT_KERNELS (kernel_sets.h) for its effect set. */
#define PT_KERNEL_DEFINE(name, set) \
    void pt_kernel_##name(const struct pt_scene *scene, const struct pt_integrator *settings, uint32_t x, uint32_t y, \
                          int count, uint32_t sample, struct pt_path_result *out) \
    { \
        if (pt_run_in_lanes(set, settings)) \
            pt_run_sample_lanes(set, scene, settings, x, y, count, sample, out); \
        else \
            pt_run_sample(set, scene, settings, x, y, count, sample, NULL, out); \
    }

#endif
