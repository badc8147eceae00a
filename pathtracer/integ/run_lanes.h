/*
 * A run of paths between diffuse surfaces lit by triangles, side by side: what integ/run.h does path by path is here done
 * array by array, the arithmetic in vectors (integ/lanes.h), with the same bits. What takes another course from path to path
 * (hits, emission, selection of emitters) stays a loop over single paths.
 */
#ifndef PT_INTEG_RUN_LANES_H
#define PT_INTEG_RUN_LANES_H

#include "integ/fetch.h"
#include "integ/path.h"

struct pt_lane_run {
    const struct pt_scene *scene;
    const struct pt_integrator *settings;
    struct pt_path_result *out; /* [PT_RUN] by `pixel` */
    struct pt_lane_keys keys;   /* paths that end leave all arrays: the others move up, in their order */
    int32_t pixel[PT_RUN];
    struct pt_lane_paths paths;
    struct pt_lane_hits at;
    struct pt_hit hits[PT_RUN];
    _Alignas(64) float u[PT_DIMS_PER_VERTEX][PT_RUN];
};

static inline struct pt_ray_lanes pt_lane_rays(const struct pt_lane_vec3 *origin, const struct pt_lane_vec3 *direction,
                                               float t_min, float t_max)
{
    return (struct pt_ray_lanes){
        {origin->x, origin->y, origin->z}, {direction->x, direction->y, direction->z}, t_min, t_max};
}

PT_KERNEL_INLINE void pt_lane_start(pt_effects fx, struct pt_lane_run *run, uint32_t x, uint32_t y, uint32_t sample,
                                    int count)
{
    const struct pt_integrator *settings = run->settings;
    float dx[PT_RUN], dy[PT_RUN];
    run->keys.sobol = settings->sampler == PT_SAMPLER_SOBOL;
    for (int i = 0; i < count; i++) {
        struct pt_sampler s = pt_sampler_make(run->keys.sobol, settings->seed, x + (uint32_t)i, y, sample);
        run->keys.index_reversed = s.index_reversed; /* the same of all */
        run->keys.pixel_key[i] = s.pixel_key;
        run->keys.path_key[i] = s.path_key;
        run->pixel[i] = i;
        run->paths.pdf_prev[i] = 0.0f;
        run->out[i] = (struct pt_path_result){.depth = INFINITY};
        pt_lane_put(&run->paths.throughput, i, v3_splat(1.0f));
    }
    pt_lanes_best()->numbers(&run->keys, count, 0, (struct pt_lane_dims){.pairs = 1u << PT_DIM_PIXEL}, run->u);
    pt_filter_sample(settings, count, run->u[PT_DIM_PIXEL], run->u[PT_DIM_PIXEL + 1], dx, dy);
    for (int i = 0; i < count; i++) {
        struct pt_ray ray;
        pt_camera_ray(fx, &run->scene->camera, (float)(x + (uint32_t)i) + 0.5f + dx[i], (float)y + 0.5f + dy[i], 0.5f, 0.5f,
                      0.0f, &ray);
        pt_lane_put(&run->paths.origin, i, ray.origin);
        pt_lane_put(&run->paths.direction, i, ray.direction);
    }
}

/* Adds what the surface emits that path i has met. */
PT_KERNEL_INLINE void pt_lane_emission(pt_effects fx, struct pt_lane_run *run, int i, const struct pt_place *at)
{
    struct pt_path_result *out = &run->out[run->pixel[i]];
    const struct pt_receiver prev = {pt_lane_get(&run->paths.prev_p, i), pt_lane_get(&run->paths.prev_n, i),
                                     PT_RECEIVER_SURFACE};
    float weight;
    if (pt_emission_weight(fx, run->scene, run->settings, at, pt_lane_get(&run->paths.direction, i), run->paths.pdf_prev[i],
                           &prev, &weight))
        out->radiance = v3_add(
            out->radiance,
            v3_scale(v3_mul(pt_lane_get(&run->paths.throughput, i), run->scene->lights[at->shape->light].emission), weight));
}

/* Path i becomes path k <= i: all but its ray's origin and what the last vertex left for the next. */
static inline void pt_lane_move(struct pt_lane_run *run, int i, int k)
{
    run->keys.pixel_key[k] = run->keys.pixel_key[i];
    run->keys.path_key[k] = run->keys.path_key[i];
    run->pixel[k] = run->pixel[i];
    pt_lane_put(&run->paths.throughput, k, pt_lane_get(&run->paths.throughput, i));
    pt_lane_put(&run->paths.direction, k, pt_lane_get(&run->paths.direction, i));
}

/* From hits to places; paths that end here go. How many are left. */
PT_KERNEL_INLINE int pt_lane_places(pt_effects fx, struct pt_lane_run *run, int count, int last)
{
    int left = 0;
    for (int i = 0; i < count; i++) {
        run->out[run->pixel[i]].rays++;
        if (run->hits[i].shape < 0)
            continue;
        struct pt_place at;
        pt_place_at_hit(fx, run->scene, NULL, &run->hits[i], &at);
        if (at.shape->light >= 0)
            pt_lane_emission(fx, run, i, &at);
        if (last)
            continue;
        pt_lane_move(run, i, left);
        pt_lane_put(&run->at.p, left, at.p);
        pt_lane_put(&run->at.error, left, at.error);
        pt_lane_put(&run->at.n_geometric, left, at.s.n_geometric);
        pt_lane_put(&run->at.n_shading, left, at.s.n_shading);
        pt_lane_put(&run->at.reflectance, left, run->scene->materials[at.shape->material].reflectance.value);
        left++;
    }
    return left;
}

/* The emitter that path i samples, NULL: none; *by_tree as in struct pt_lane_hits. */
static inline const struct pt_emitter *pt_lane_pick(const struct pt_lane_run *run, int i, float *by_tree)
{
    const float u = run->u[PT_DIM_LIGHT_PICK][i];
    *by_tree = 1.0f;
    if (run->scene->emitter_count == 0)
        return NULL;
    if (!run->scene->light_tree) /* wherever path i is */
        return pt_light_pick_by_power(run->scene, u);
    pt_vec3 n = pt_lane_get(&run->at.n_shading, i);
    struct pt_receiver at = {pt_lane_get(&run->at.p, i), n, PT_RECEIVER_SURFACE};
    if (v3_dot(v3_neg(pt_lane_get(&run->paths.direction, i)), n) < 0.0f)
        at.n = v3_neg(n);
    return pt_light_pick(run->scene, &at, u, by_tree);
}

static inline void pt_lane_emitters(struct pt_lane_run *run, int count)
{
    struct pt_lane_hits *at = &run->at;
    for (int i = 0; i < count; i++) {
        const struct pt_emitter *e = pt_lane_pick(run, i, &at->by_tree[i]);
        at->area_over_pmf[i] = 0.0f;
        at->two_sided[i] = 0;
        if (!e)
            continue;
        at->area_over_pmf[i] = e->area_over_pmf;
        at->two_sided[i] = run->scene->lights[e->light].two_sided;
        pt_lane_put(&at->p0, i, e->p0);
        pt_lane_put(&at->e1, i, e->e1);
        pt_lane_put(&at->e2, i, e->e2);
        pt_lane_put(&at->n, i, e->n);
        pt_lane_put(&at->side, i, e->side);
        pt_lane_put(&at->emission, i, run->scene->lights[e->light].emission);
    }
}

/* Adds the planned light that arrives. */
static inline void pt_lane_lights(struct pt_lane_run *run, int count)
{
    struct pt_lane_paths *paths = &run->paths;
    uint8_t occluded[PT_RUN];
    int32_t asked[PT_RUN];
    int n = 0;
    for (int i = 0; i < count; i++) {
        pt_vec3 add = pt_lane_get(&paths->shadow_add, i);
        if (v3_is_black(add))
            continue;
        asked[n] = run->pixel[i];
        pt_lane_put(&paths->shadow_add, n, add);
        pt_lane_put(&paths->shadow_origin, n, pt_lane_get(&paths->shadow_origin, i));
        pt_lane_put(&paths->shadow_direction, n, pt_lane_get(&paths->shadow_direction, i));
        n++;
    }
    struct pt_ray_lanes rays = pt_lane_rays(&paths->shadow_origin, &paths->shadow_direction, 0.0f, PT_SHADOW_END);
    pt_accel_occluded_lanes(run->scene, &rays, n, occluded);
    for (int i = 0; i < n; i++) {
        struct pt_path_result *out = &run->out[asked[i]];
        out->rays++;
        if (!occluded[i])
            out->radiance = v3_add(out->radiance, pt_lane_get(&paths->shadow_add, i));
    }
}

/* Those that go on move up. How many there are. */
static inline int pt_lane_survivors(struct pt_lane_run *run, int count)
{
    struct pt_lane_paths *paths = &run->paths;
    int left = 0;
    for (int i = 0; i < count; i++) {
        if (!paths->alive[i])
            continue;
        pt_lane_move(run, i, left);
        pt_lane_put(&paths->origin, left, pt_lane_get(&paths->origin, i));
        pt_lane_put(&paths->prev_p, left, pt_lane_get(&paths->prev_p, i));
        pt_lane_put(&paths->prev_n, left, pt_lane_get(&paths->prev_n, i));
        paths->pdf_prev[left] = paths->pdf_prev[i];
        left++;
    }
    return left;
}

/* pt_run_sample (run.h) for an effect set within PT_FX_SET_DIFFUSE, next-event estimation, no auxiliary planes. */
PT_KERNEL_INLINE void pt_run_sample_lanes(pt_effects fx, const struct pt_scene *scene, const struct pt_integrator *settings,
                                          uint32_t x, uint32_t y, int count, uint32_t sample, struct pt_path_result *out)
{
    struct pt_lane_run run; /* no initialiser: it would clear it for each run */
    struct pt_hit *hits[PT_RUN];
    for (int i = 0; i < count; i++)
        hits[i] = &run.hits[i];
    run.scene = scene;
    run.settings = settings;
    run.out = out;
    pt_lane_start(fx, &run, x, y, sample, count);
    int n = count;
    for (int vertex = 1; n > 0; vertex++) {
        const float t_min = vertex == 1 ? PT_RAY_OFF_START : 0.0f; /* of the camera's rays */
        struct pt_ray_lanes rays = pt_lane_rays(&run.paths.origin, &run.paths.direction, t_min, INFINITY);
        pt_accel_intersect_lanes(scene, &rays, n, vertex == 1, hits);
        pt_fetch_hits(fx, scene, hits, n);
        n = pt_lane_places(fx, &run, n, settings->max_depth >= 0 && vertex > settings->max_depth);
        pt_lanes_best()->numbers(&run.keys, n, (uint32_t)vertex, PT_VERTEX_DIMS(fx), run.u);
        pt_lane_emitters(&run, n);
        pt_lanes_best()->bounce(&run.at, run.u, n, vertex >= settings->rr_depth,
                                vertex > PT_PATH_LONG ? PT_KEEP_LONG : INFINITY, &run.paths);
        pt_lane_lights(&run, n);
        n = pt_lane_survivors(&run, n);
    }
    for (int i = 0; i < count; i++)
        out[i].radiance = pt_path_pixel_value(scene, settings, out[i].radiance);
}

#endif
