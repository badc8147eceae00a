/* The functions of struct pt_lanes for one instruction set; lanes_NAME.c includes this with PT_LANES_NAME defined. Loops
 * without branches over arrays, which the compiler turns into vectors. */
#include "integ/lanes.h"
#include "sample/sampler.h"
#include "shade/bsdf_diffuse.h"
#include "shade/light_area.h"

#define PT_LANES_JOIN(a, b) a##b
#define PT_LANES_TABLE(name) PT_LANES_JOIN(pt_lanes_, name)

static void sobol_pair(const struct pt_lane_keys *keys, int count, uint32_t dim, float *restrict x, float *restrict y)
{
    struct pt_sampler s = {.index_reversed = keys->index_reversed};
    for (int i = 0; i < count; i++) {
        s.pixel_key = keys->pixel_key[i];
        struct pt_sample2 u = pt_sobol_pair(&s, dim);
        x[i] = u.x;
        y[i] = u.y;
    }
}

static void sobol_single(const struct pt_lane_keys *keys, int count, uint32_t dim, float *restrict x)
{
    struct pt_sampler s = {.index_reversed = keys->index_reversed};
    for (int i = 0; i < count; i++) {
        s.pixel_key = keys->pixel_key[i];
        x[i] = pt_sobol_pair(&s, dim).x;
    }
}

static void hashed(const struct pt_lane_keys *keys, int count, uint32_t dim, float *restrict x)
{
    struct pt_sampler s = {0};
    for (int i = 0; i < count; i++) {
        s.path_key = keys->path_key[i];
        x[i] = pt_bits_to_float(pt_sampler_bits(&s, dim));
    }
}

static void numbers(const struct pt_lane_keys *keys, int count, uint32_t block, struct pt_lane_dims dims, float (*u)[PT_RUN])
{
    const uint32_t base = block * PT_DIMS_PER_VERTEX;
    const int sobol = keys->sobol && block < PT_SOBOL_BLOCKS;
    for (uint32_t d = 0; d < PT_DIMS_PER_VERTEX; d++) {
        const uint32_t pair = dims.pairs >> d & 1, single = dims.singles >> d & 1;
        if (sobol && pair) {
            sobol_pair(keys, count, base + d, u[d], u[d + 1]);
        } else if (sobol && single) {
            sobol_single(keys, count, base + d, u[d]);
        } else if (pair | single | (dims.bits >> d & 1)) {
            hashed(keys, count, base + d, u[d]);
            if (pair)
                hashed(keys, count, base + d + 1, u[d + 1]);
        }
    }
}

/* pt_path_crosses, of the direction wi behind the ray that is still in `paths`. */
static inline int crosses(const struct pt_lane_hits *restrict hits, const struct pt_lane_paths *restrict paths, int i,
                          pt_vec3 wi)
{
    pt_vec3 n = pt_lane_get(&hits->n_geometric, i);
    return -v3_dot(pt_lane_get(&paths->direction, i), n) * v3_dot(wi, n) < 0.0f;
}

/* What light adds, and the ray that says whether it arrives: pt_path_plan_light and pt_path_shadow_ray. */
static void plan_lights(const struct pt_lane_hits *restrict hits, const float *restrict u0, const float *restrict u1,
                        int count, struct pt_lane_paths *restrict paths)
{
    for (int i = 0; i < count; i++) {
        pt_vec3 p = pt_lane_get(&hits->p, i), n_shading = pt_lane_get(&hits->n_shading, i);
        struct pt_frame frame = pt_frame_from_normal(n_shading);
        pt_vec3 wo = pt_frame_to_local(&frame, v3_neg(pt_lane_get(&paths->direction, i)));
        struct pt_emitter e = {.p0 = pt_lane_get(&hits->p0, i),
                               .e1 = pt_lane_get(&hits->e1, i),
                               .e2 = pt_lane_get(&hits->e2, i),
                               .n = pt_lane_get(&hits->n, i),
                               .side = pt_lane_get(&hits->side, i),
                               .area_over_pmf = hits->area_over_pmf[i]};
        struct pt_light_sample light;
        int lit = pt_light_triangle_towards(&e, hits->two_sided[i], p, u0[i], u1[i], &light);
        struct pt_bsdf bsdf = {.reflectance = pt_lane_get(&hits->reflectance, i)};
        lit &= !crosses(hits, paths, i, light.wi);
        float pdf, scale = light.inv_pdf_solid * hits->by_tree[i];
        pt_vec3 f = pt_diffuse_eval(0, &bsdf, wo, pt_frame_to_local(&frame, light.wi), &pdf);
        float r = pdf * scale;
        scale *= 1.0f / (1.0f + r * r);
        pt_vec3 add =
            v3_mul(v3_scale(v3_mul(f, pt_lane_get(&hits->emission, i)), scale), pt_lane_get(&paths->throughput, i));
        pt_vec3 origin = pt_offset_point(p, pt_lane_get(&hits->n_geometric, i), pt_lane_get(&hits->error, i), light.wi);
        pt_lane_put(&paths->shadow_add, i, (pt_vec3){lit ? add.x : 0.0f, lit ? add.y : 0.0f, lit ? add.z : 0.0f});
        pt_lane_put(&paths->shadow_origin, i, origin);
        pt_lane_put(&paths->shadow_direction, i, v3_sub(light.target, origin));
    }
}

/* The next ray, and who is left to follow it: pt_path_scatter, pt_path_receiver and pt_path_survives. */
static void scatter(const struct pt_lane_hits *restrict hits, const float *restrict u0, const float *restrict u1,
                    const float *restrict u_roulette, int count, int roulette, float keep_most,
                    struct pt_lane_paths *restrict paths)
{
    for (int i = 0; i < count; i++) {
        pt_vec3 p = pt_lane_get(&hits->p, i), n_shading = pt_lane_get(&hits->n_shading, i);
        struct pt_frame frame = pt_frame_from_normal(n_shading);
        pt_vec3 wo = pt_frame_to_local(&frame, v3_neg(pt_lane_get(&paths->direction, i)));
        struct pt_bsdf bsdf = {.reflectance = pt_lane_get(&hits->reflectance, i)};
        struct pt_bsdf_sample next;
        pt_diffuse_sample(0, &bsdf, wo, 0.0f, u0[i], u1[i], &next);
        pt_vec3 wi = pt_frame_to_world(&frame, next.wi),
                throughput = v3_mul(pt_lane_get(&paths->throughput, i), next.weight);
        float pdf = crosses(hits, paths, i, wi) ? -next.pdf_solid : next.pdf_solid;
        float keep = v3_max(throughput);
        keep = keep > keep_most ? keep_most : keep;
        int certain = (keep >= 1.0f) | !roulette, some = !v3_is_black(throughput);
        float kept = certain ? 1.0f : 1.0f / keep;
        paths->alive[i] = some & (certain | (u_roulette[i] < keep));
        pt_lane_put(&paths->throughput, i, v3_scale(throughput, kept));
        pt_lane_put(&paths->origin, i,
                    pt_offset_point(p, pt_lane_get(&hits->n_geometric, i), pt_lane_get(&hits->error, i), wi));
        pt_lane_put(&paths->direction, i, wi);
        paths->pdf_prev[i] = pdf;
        float side = wo.z < 0.0f ? -1.0f : 1.0f;
        pt_lane_put(&paths->prev_p, i, p);
        pt_lane_put(&paths->prev_n, i, v3_scale(n_shading, side));
    }
}

static void bounce(const struct pt_lane_hits *hits, float (*u)[PT_RUN], int count, int roulette, float keep_most,
                   struct pt_lane_paths *paths)
{
    plan_lights(hits, u[PT_DIM_LIGHT], u[PT_DIM_LIGHT + 1], count, paths);
    scatter(hits, u[PT_DIM_BSDF], u[PT_DIM_BSDF + 1], u[PT_DIM_ROULETTE], count, roulette, keep_most, paths);
}

extern const struct pt_lanes PT_LANES_TABLE(PT_LANES_NAME);
const struct pt_lanes PT_LANES_TABLE(PT_LANES_NAME) = {numbers, bounce};
