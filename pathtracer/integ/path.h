/*
 * One path of the kernel, from vertex to vertex; integ/run.h traces its rays, many paths together.
 *
 * Unidirectional path tracing with next-event estimation and multiple importance sampling (power heuristic; Veach 1997,
 * §9.2), Russian roulette on the throughput without refraction's radiance scaling, participating media, interfaces and
 * alpha. Every number drawn has its own dimension (sample/sampler.h), and code for an absent effect would only have tested
 * data that is not there: so all kernels that cover a scene return the same bits.
 *
 * `fx` is a compile-time constant wherever it appears; `trace` is a constant NULL but in the tracing kernel.
 */
#ifndef PT_INTEG_PATH_H
#define PT_INTEG_PATH_H

#include "integ/borders.h"
#include "integ/contact.h"
#include "integ/integrator.h"
#include "integ/lanes.h"
#include "integ/surface.h"
#include "integ/trace.h"
#include "sample/sampler.h"
#include "shade/bsdf_dispatch.h"
#include "shade/camera.h"
#include "shade/light_select.h"
#include "shade/medium.h"
#include "shade/phase_function.h"

#define PT_KERNEL_INLINE static inline __attribute__((always_inline))

/* Shadow rays end this share before their target, which is already off its surface: 32 roundings of the distance, for what
 * lies in the plane of a lamp. */
#define PT_SHADOW_END 0.999998f

/* Rays may go on behind what they meet. */
#define PT_FX_THROUGH (PT_FX_ALPHA | PT_FX_INTERFACE)
/* What comes next may be known without a ray. */
#define PT_FX_LOOKED (PT_FX_THROUGH | PT_FX_CONTACT)

/* A path between perfect mirrors loses nothing and would never end when the depth is unlimited: beyond this many bounces
 * roulette takes some of them whatever they carry. */
#define PT_PATH_LONG 1000
#define PT_KEEP_LONG 0.99f

/* What a light adds if nothing is in between. It is worked out before the shadow ray is traced, together with the path's
 * next direction: two independent chains of arithmetic then overlap, where a query between them would make the second
 * wait. */
struct pt_light_plan {
    struct pt_light_sample light;
    pt_vec3 add; /* to the path's radiance; black: no shadow ray needed */
    pt_vec3 origin;
    int32_t medium; /* the shadow ray starts in it */
};

struct pt_path {
    const struct pt_scene *scene;
    const struct pt_integrator *settings;
    struct pt_trace *trace;
    struct pt_sampler sampler;
    const float *u; /* borrows: number of dimension d of this vertex at [d · PT_RUN], of those in PT_VERTEX_DIMS */
    struct pt_ray ray;
    pt_vec3 throughput, radiance;
    struct pt_receiver prev; /* last vertex, and … */
    float pdf_prev;  /* … density of the direction taken there; 0: no other strategy could have found what comes next;
                      * below 0: it went through an opaque surface, so that no lamp shines on that from there */
    float eta_scale; /* undoes in the roulette what refraction did to the throughput */
    int32_t medium;  /* the ray is in it, -1 = vacuum */
    int32_t depth;   /* bounces so far */
    uint32_t rays;
    struct pt_hit hit;          /* what the ray has met first */
    struct pt_passed *passed;   /* borrows; what it has passed through, with PT_FX_THROUGH only */
    struct pt_contact *contact; /* borrows; the surfaces where it is, with PT_FX_CONTACT only */
    float t_medium;             /* the ray is in its medium from here on */
    int32_t looked;             /* `hit` is already known */
    struct pt_light_plan plan;  /* of the last vertex */
    struct pt_path_result *out; /* borrows */
};

/* The dimensions of a vertex that most paths read, worked out for all paths of a run at once. */
#define PT_VERTEX_DIMS(fx) \
    ((struct pt_lane_dims){1u << PT_DIM_BSDF | 1u << PT_DIM_LIGHT, \
                           1u << PT_DIM_LIGHT_PICK | ((fx)&PT_FX_BSDF ? 1u << PT_DIM_BSDF_LOBE : 0u), \
                           1u << PT_DIM_ROULETTE})

PT_KERNEL_INLINE float pt_path_1d(const struct pt_path *path, int dim) { return path->u[dim * PT_RUN]; }
PT_KERNEL_INLINE struct pt_sample2 pt_path_2d(const struct pt_path *path, int dim)
{
    return (struct pt_sample2){path->u[dim * PT_RUN], path->u[(dim + 1) * PT_RUN]};
}

PT_KERNEL_INLINE int32_t pt_medium_towards(const struct pt_place *at, pt_vec3 w, int32_t current)
{
    if (at->shape->medium_in == at->shape->medium_out)
        return current;
    return v3_dot(w, at->s.n_geometric) > 0.0f ? at->shape->medium_out : at->shape->medium_in;
}

/* Whether the ray passes through this hit by chance (alpha). */
PT_KERNEL_INLINE int pt_passes_alpha(const struct pt_scene *scene, const struct pt_ray *ray, const struct pt_hit *hit,
                                     struct pt_rng *rng)
{
    const struct pt_shape *shape = &scene->shapes[hit->shape];
    if (!shape->has_alpha)
        return 0;
    struct pt_place at;
    pt_place_at_hit(PT_FX_ALL, scene, ray, hit, &at);
    float alpha = pt_shape_alpha(scene, shape, at.s.u, at.s.v);
    return alpha < 1.0f && (alpha <= 0.0f || pt_rng_float(rng) >= alpha);
}

/* What becomes of a ray that meets a surface. */
enum pt_passage { PT_PASSAGE_NONE, PT_PASSAGE_FREE, PT_PASSAGE_BORDER /* through, and into the medium behind */ };

PT_KERNEL_INLINE enum pt_passage pt_passage_at(pt_effects fx, const struct pt_scene *scene, const struct pt_ray *ray,
                                               const struct pt_hit *hit, struct pt_rng *rng)
{
    const struct pt_shape *shape = &scene->shapes[hit->shape];
    int by_chance = (fx & PT_FX_ALPHA) && pt_passes_alpha(scene, ray, hit, rng);
    if (!by_chance && !((fx & PT_FX_INTERFACE) && scene->materials[shape->material].kind == PT_MATERIAL_INTERFACE))
        return PT_PASSAGE_NONE;
    if (!(fx & PT_FX_MEDIA) || shape->medium_in == shape->medium_out || (by_chance && !shape->has_opacity))
        return PT_PASSAGE_FREE;
    return PT_PASSAGE_BORDER;
}

/* What a path's ray has met. */
enum pt_found { PT_FOUND_NOTHING, PT_FOUND_SURFACE, PT_FOUND_BORDER /* a surface that lets it into another medium */ };

/* The path's next ray. */
PT_KERNEL_INLINE void pt_path_turn(pt_effects fx, struct pt_path *path, pt_vec3 origin, pt_vec3 direction)
{
    path->ray = (struct pt_ray){origin, direction, 0.0f, INFINITY, path->ray.time};
    path->t_medium = 0.0f;
    path->looked = 0;
    if (fx & PT_FX_LOOKED)
        path->passed->count = 0;
    if (fx & PT_FX_CONTACT)
        path->contact->count = 0;
}

/* The path's ray goes on towards w from the surface of its list that it is at, whose place is `at`: its hit is the next one
 * of the list. 0: there is none, and the ray has left the list. */
PT_KERNEL_INLINE int pt_path_turn_in_contact(pt_effects fx, struct pt_path *path, pt_vec3 p, pt_vec3 w)
{
    struct pt_contact *contact = path->contact;
    int32_t count = contact->count, next = contact->at + contact->step;
    if (next < 0 || next >= count) {
        pt_path_turn(fx, path, pt_contact_origin(path->scene, contact, p, contact->step, w), w);
        return 0;
    }
    struct pt_place there;
    pt_contact_place(path->scene, contact, next, &there);
    pt_path_turn(fx, path, there.p, w);
    contact->count = count;
    contact->at = next;
    contact->turned = 1;
    path->hit = contact->hits[next];
    path->hit.t = 0.0f;
    path->looked = 1;
    return 1;
}

/* The path's ray goes on behind its hit, a surface of its list. */
PT_KERNEL_INLINE void pt_path_pass_in_contact(pt_effects fx, struct pt_path *path)
{
    struct pt_contact *contact = path->contact;
    if (contact->turned) {
        if (!pt_path_turn_in_contact(fx, path, path->ray.origin, path->ray.direction)) {
            path->rays++;
            pt_accel_intersect(path->scene, &path->ray, &path->hit);
        }
    } else if (++contact->at < contact->count) {
        path->hit = contact->hits[contact->at];
    } else {
        path->hit = contact->beyond;
        contact->count = 0;
    }
}

/* The path's ray goes on behind its hit. */
PT_KERNEL_INLINE void pt_path_pass(pt_effects fx, struct pt_path *path)
{
    if ((fx & PT_FX_CONTACT) && path->contact->count) {
        pt_path_pass_in_contact(fx, path);
        return;
    }
    pt_ray_pass(&path->ray, path->passed, &path->hit);
    path->rays++;
    pt_accel_intersect_behind(path->scene, &path->ray, path->passed, &path->hit);
}

/* What else is at the place of the path's hit. */
PT_KERNEL_INLINE void pt_path_gather(pt_effects fx, struct pt_path *path)
{
    if ((fx & PT_FX_CONTACT) && !path->contact->count && pt_contact_at(path->scene, &path->ray, &path->hit))
        path->rays += pt_contact_gather(path->scene, path->medium, &path->ray, path->passed, &path->hit, path->contact);
}

/* What the path met that counts: goes on behind what it passes through. */
PT_KERNEL_INLINE enum pt_found pt_path_found(pt_effects fx, struct pt_path *path, struct pt_rng *rng)
{
    path->rays += !((fx & PT_FX_LOOKED) && path->looked);
    if (!(fx & PT_FX_THROUGH) && path->hit.shape >= 0)
        pt_path_gather(fx, path);
    while ((fx & PT_FX_THROUGH) && path->hit.shape >= 0) {
        pt_path_gather(fx, path);
        enum pt_passage passage = pt_passage_at(fx, path->scene, &path->ray, &path->hit, rng);
        if (passage == PT_PASSAGE_BORDER)
            return PT_FOUND_BORDER;
        if (passage == PT_PASSAGE_NONE)
            break;
        pt_path_pass(fx, path);
    }
    return path->hit.shape >= 0 ? PT_FOUND_SURFACE : PT_FOUND_NOTHING;
}

/* Takes the path through the border that it has met. PT_FOUND_SURFACE: at the same place is a surface that it does not pass
 * through, which it has met in the medium before the border. Else PT_FOUND_BORDER. */
PT_KERNEL_INLINE enum pt_found pt_path_cross_border(pt_effects fx, struct pt_path *path, struct pt_rng *rng)
{
    struct pt_borders borders = {.count = 0};
    struct pt_place at;
    pt_place_at_hit(fx, path->scene, &path->ray, &path->hit, &at);
    if ((fx & PT_FX_CONTACT) && path->contact->count) {
        path->medium = pt_medium_towards(&at, path->ray.direction, path->medium);
        path->t_medium = path->hit.t;
        pt_path_pass(fx, path);
        path->looked = 1;
        return PT_FOUND_BORDER;
    }
    pt_borders_add(&borders, &at, path->ray.direction, path->hit.t);
    for (;;) {
        pt_path_pass(fx, path);
        if (path->hit.shape < 0)
            break;
        pt_place_at_hit(fx, path->scene, &path->ray, &path->hit, &at);
        if (!pt_borders_at(&borders, &at, path->ray.direction, path->hit.t))
            break;
        enum pt_passage passage = pt_passage_at(fx, path->scene, &path->ray, &path->hit, rng);
        if (passage == PT_PASSAGE_NONE)
            return PT_FOUND_SURFACE;
        if (passage == PT_PASSAGE_BORDER)
            pt_borders_add(&borders, &at, path->ray.direction, path->hit.t);
    }
    path->medium = pt_borders_cross(&borders, path->medium);
    path->t_medium = borders.t;
    path->looked = 1;
    return PT_FOUND_BORDER;
}

/* Of a medium that fills the whole shadow ray; direction unnormalised, its length in `length`. */
PT_KERNEL_INLINE pt_vec3 pt_path_medium_transmittance(const struct pt_path *path, const struct pt_ray *ray, float length,
                                                      int32_t medium)
{
    struct pt_rng rng = pt_sampler_stream(&path->sampler, PT_DIM_SHADOW);
    return pt_medium_transmittance(&path->scene->media[medium], ray->origin, v3_scale(ray->direction, 1.0f / length),
                                   ray->t_max * length, &rng);
}

/* What gets through a shadow ray that may cross alpha masks and interfaces; direction unnormalised, its length in
 * `length`. */
PT_KERNEL_INLINE pt_vec3 pt_path_transmittance(pt_effects fx, struct pt_path *path, struct pt_ray *ray, float length,
                                               int32_t medium)
{
    const struct pt_scene *scene = path->scene;
    struct pt_rng rng = pt_sampler_stream(&path->sampler, PT_DIM_SHADOW);
    pt_vec3 through = v3_splat(1.0f), unit = v3_scale(ray->direction, 1.0f / length);
    struct pt_passed passed;
    struct pt_borders borders = {.count = 0};
    float start = ray->t_min;
    for (passed.count = 0;;) {
        struct pt_hit hit;
        struct pt_place at;
        path->rays++;
        int found =
            passed.count ? pt_accel_intersect_behind(scene, ray, &passed, &hit) : pt_accel_intersect(scene, ray, &hit);
        enum pt_passage passage = found ? pt_passage_at(fx, scene, ray, &hit, &rng) : PT_PASSAGE_BORDER;
        if (passage == PT_PASSAGE_NONE)
            return v3_splat(0.0f);
        /* A medium ends at a border or at the light. Borders at one place are crossed together, once the ray meets something
         * behind them: until then the medium that goes on from `start` is not known. */
        if ((fx & PT_FX_MEDIA) && passage == PT_PASSAGE_BORDER) {
            if (found)
                pt_place_at_hit(fx, scene, ray, &hit, &at);
            if (borders.count && !(found && pt_borders_at(&borders, &at, ray->direction, hit.t)))
                medium = pt_borders_cross(&borders, medium);
            float end = found ? hit.t : ray->t_max;
            if (medium >= 0 && !borders.count)
                through = v3_mul(through,
                                 pt_medium_transmittance(&scene->media[medium], v3_madd(ray->origin, start, ray->direction),
                                                         unit, fmaxf(0.0f, end - start) * length, &rng));
            if (v3_is_black(through))
                return through;
            if (!borders.count)
                start = end;
        }
        if (!found)
            return through;
        if ((fx & PT_FX_MEDIA) && passage == PT_PASSAGE_BORDER)
            pt_borders_add(&borders, &at, ray->direction, hit.t);
        pt_ray_pass(ray, &passed, &hit);
    }
}

/* Power heuristic for the strategy of density p against q, without overflow of the squares. */
PT_KERNEL_INLINE float pt_mis_weight(float p, float q)
{
    float r = q / p;
    return 1.0f / (1.0f + r * r);
}

/* Light towards the last vertex, for its plan; 0: none. */
PT_KERNEL_INLINE int pt_path_sample_light(pt_effects fx, struct pt_path *path, struct pt_sample2 u)
{
    if (path->scene->emitter_count == 0 || path->settings->strategy != PT_STRATEGY_MIS)
        return 0;
    return pt_light_sample(fx, path->scene, &path->prev, pt_path_1d(path, PT_DIM_LIGHT_PICK), u.x, u.y, &path->plan.light);
}

/* `f` is BSDF · cos or the phase function towards the light, `pdf` the density with which it would have sampled that. */
PT_KERNEL_INLINE void pt_path_plan_light(pt_effects fx, struct pt_path *path, pt_vec3 f, float pdf, pt_vec3 origin,
                                         int32_t medium)
{
    struct pt_light_sample *light = &path->plan.light;
    float scale = light->inv_pdf_solid, r = pdf * scale;
    if (fx & PT_FX_ALPHA)
        scale *= pt_place_lamp_alpha(path->scene, light);
    if (!((fx & (PT_FX_DELTA_LIGHT | PT_FX_ALPHA)) && light->delta))
        scale *= 1.0f / (1.0f + r * r); /* power heuristic */
    path->plan.add = v3_mul(v3_scale(v3_mul(f, light->radiance), scale), path->throughput);
    path->plan.origin = origin;
    path->plan.medium = medium;
}

/* The ray that says whether the planned light arrives. */
PT_KERNEL_INLINE struct pt_ray pt_path_shadow_ray(const struct pt_path *path)
{
    const struct pt_light_plan *plan = &path->plan;
    struct pt_ray ray = {plan->origin, plan->light.wi, 0.0f, INFINITY, path->ray.time};
    if (plan->light.finite) {
        ray.direction = v3_sub(plan->light.target, plan->origin);
        ray.t_max = PT_SHADOW_END;
    }
    return ray;
}

/* What the place of the lamp leaves of its light, which has met nothing on its way there: surfaces that touch the lamp may
 * lie before it. */
PT_KERNEL_INLINE int pt_path_lamp_covered(pt_effects fx, const struct pt_path *path, struct pt_rng *rng)
{
    const struct pt_scene *scene = path->scene;
    const struct pt_light *lamp = &scene->lights[path->plan.light.emitter->light];
    if (lamp->kind != PT_LIGHT_AREA || !pt_contact_near(&scene->shapes[lamp->shape], path->plan.light.target))
        return 0;
    struct pt_ray ray = {path->plan.origin, v3_sub(path->plan.light.target, path->plan.origin), 0.5f, INFINITY,
                         path->ray.time};
    struct pt_passed passed = {.count = 0};
    struct pt_hit hit;
    for (int found = pt_accel_intersect(scene, &ray, &hit); found;
         found = pt_accel_intersect_behind(scene, &ray, &passed, &hit)) {
        struct pt_contact contact = {.count = 0};
        if (pt_contact_at(scene, &ray, &hit))
            pt_contact_gather(scene, path->plan.medium, &ray, &passed, &hit, &contact);
        int32_t own = 0;
        while (own < contact.count && contact.hits[own].shape != lamp->shape)
            own++;
        if (own < contact.count) {
            for (int32_t i = 0; i < own; i++)
                if (pt_passage_at(fx, scene, &ray, &contact.hits[i], rng) == PT_PASSAGE_NONE)
                    return 1;
            return 0;
        }
        if (hit.shape == lamp->shape || hit.t > 1.01f)
            return 0;
        if (!contact.count)
            pt_ray_pass(&ray, &passed, &hit);
    }
    return 0;
}

/* Adds the planned light, of which nothing opaque was in the way of `ray`. */
PT_KERNEL_INLINE void pt_path_add_light(pt_effects fx, struct pt_path *path, struct pt_ray *ray)
{
    const struct pt_light_plan *plan = &path->plan;
    pt_vec3 add = plan->add;
    if ((fx & PT_FX_CONTACT) && plan->light.finite) {
        struct pt_rng rng = pt_sampler_stream(&path->sampler, PT_DIM_CONTACT_LAMP);
        if (pt_path_lamp_covered(fx, path, &rng))
            return;
    }
    if (fx & PT_FX_THROUGH)
        add = v3_mul(add, pt_path_transmittance(fx, path, ray, v3_len(ray->direction), plan->medium));
    else if ((fx & PT_FX_MEDIA) && plan->medium >= 0)
        add = v3_mul(add, pt_path_medium_transmittance(path, ray, v3_len(ray->direction), plan->medium));
    if ((fx & PT_FX_ENVIRONMENT) && plan->light.pixel)
        add = v3_mul(add, v3(plan->light.pixel[0], plan->light.pixel[1], plan->light.pixel[2]));
    path->radiance = v3_add(path->radiance, add);
    if (path->trace)
        pt_trace_light(path->trace, plan->light.wi, add);
}

/* Whether the surface `at`, met along `direction` from `prev`, emits that way; *weight gets what of that counts. */
PT_KERNEL_INLINE int pt_emission_weight(pt_effects fx, const struct pt_scene *scene, const struct pt_integrator *settings,
                                        const struct pt_place *at, pt_vec3 direction, float pdf_prev,
                                        const struct pt_receiver *prev, float *weight)
{
    *weight = 1.0f;
    if (pdf_prev < 0.0f)
        return 0;
    if (!scene->lights[at->shape->light].two_sided && !(v3_dot(at->s.n_geometric, direction) < 0.0f))
        return 0;
    if (pdf_prev > 0.0f && settings->strategy == PT_STRATEGY_MIS)
        *weight = pt_mis_weight(
            pdf_prev, pt_light_area_pdf(fx, scene, at->shape, at->primitive, prev, at->p, at->s.n_geometric, direction));
    return 1;
}

/* Emission of the surface that the path has met. */
PT_KERNEL_INLINE void pt_path_add_emission(pt_effects fx, struct pt_path *path, const struct pt_place *at)
{
    float weight;
    if (!pt_emission_weight(fx, path->scene, path->settings, at, path->ray.direction, path->pdf_prev, &path->prev, &weight))
        return;
    pt_vec3 l = v3_scale(v3_mul(path->throughput, path->scene->lights[at->shape->light].emission), weight);
    path->radiance = v3_add(path->radiance, l);
    if (path->trace)
        pt_trace_emission(path->trace, weight, l);
}

PT_KERNEL_INLINE void pt_path_add_environment(struct pt_path *path)
{
    for (int32_t i = 0; i < path->scene->env_light_count; i++) {
        const struct pt_light *light = &path->scene->lights[path->scene->env_lights[i]];
        float weight = 1.0f;
        if (path->pdf_prev != 0.0f && path->settings->strategy == PT_STRATEGY_MIS)
            weight = pt_mis_weight(fabsf(path->pdf_prev),
                                   pt_light_env_pdf(path->scene, light, path->prev.p, path->ray.direction));
        pt_vec3 l = v3_scale(v3_mul(path->throughput, pt_light_env_eval(path->scene, light, path->ray.direction)), weight);
        path->radiance = v3_add(path->radiance, l);
        if (path->trace)
            pt_trace_emission(path->trace, weight, l);
    }
}

/* Russian roulette; 0 when the path ends. */
PT_KERNEL_INLINE int pt_path_survives(struct pt_path *path)
{
    if (path->depth < path->settings->rr_depth)
        return 1;
    float keep = v3_max(path->throughput) * path->eta_scale;
    if (path->depth > PT_PATH_LONG && keep > PT_KEEP_LONG)
        keep = PT_KEEP_LONG;
    if (keep >= 1.0f)
        return 1;
    if (!(pt_path_1d(path, PT_DIM_ROULETTE) < keep))
        return 0;
    path->throughput = v3_scale(path->throughput, 1.0f / keep);
    return 1;
}

PT_KERNEL_INLINE int pt_path_at_max_depth(const struct pt_path *path)
{
    return path->settings->max_depth >= 0 && path->depth >= path->settings->max_depth;
}

/* The way to the next surface through the current medium, from t_start to t_end. 1: the path scattered on the way (its ray
 * is the next one), 0: it reached t_end, -1: it is over. */
PT_KERNEL_INLINE int pt_path_cross_medium(pt_effects fx, struct pt_path *path, float t_start, float t_end)
{
    const struct pt_medium *medium = &path->scene->media[path->medium];
    struct pt_rng rng = pt_sampler_stream(&path->sampler, PT_DIM_MEDIUM);
    struct pt_medium_event event;
    pt_vec3 start = v3_madd(path->ray.origin, t_start, path->ray.direction);
    pt_medium_sample_distance(medium, start, path->ray.direction, fmaxf(0.0f, t_end - t_start), path->throughput, &rng,
                              &event);
    path->radiance = v3_add(path->radiance, v3_mul(path->throughput, event.emitted));
    path->throughput = v3_mul(path->throughput, event.weight);
    if (v3_is_black(path->throughput))
        return -1;
    if (!event.scattered || !(fx & PT_FX_SCATTERING))
        return 0;
    if (pt_path_at_max_depth(path))
        return -1;
    pt_vec3 p = v3_madd(start, event.t, path->ray.direction), wo = v3_neg(path->ray.direction), wi;
    if (path->trace)
        pt_trace_scatter(path->trace, path->medium, p, path->throughput);
    path->prev = (struct pt_receiver){p, v3_splat(0.0f), PT_RECEIVER_VOLUME};
    if (pt_path_sample_light(fx, path, pt_path_2d(path, PT_DIM_LIGHT))) {
        float phase = pt_phase_eval(medium->g, wo, path->plan.light.wi);
        pt_path_plan_light(fx, path, v3_splat(phase), phase, p, path->medium);
    }
    struct pt_sample2 u = pt_sampler_2d(&path->sampler, PT_DIM_PHASE);
    path->pdf_prev = pt_phase_sample(medium->g, wo, u.x, u.y, &wi);
    pt_path_turn(fx, path, p, wi);
    path->depth++;
    return pt_path_survives(path) ? 1 : -1;
}

PT_KERNEL_INLINE void pt_path_aux(pt_effects fx, const struct pt_path *path, const struct pt_bsdf *bsdf, pt_vec3 wo,
                                  const struct pt_frame *frame)
{
    struct pt_path_result *out = path->out;
    if (path->depth == 0) /* on the camera's ray, not where a medium sent it */
        out->depth = path->hit.t + path->scene->camera.before;
    if (!pt_bsdf_has_smooth(fx, bsdf) || !v3_is_black(out->albedo))
        return;
    out->albedo = pt_clamp_unit(pt_bsdf_albedo(fx, bsdf, wo));
    if (v3_is_black(out->normal_world))
        out->normal_world = v3_dot(frame->n, path->ray.direction) > 0.0f ? v3_neg(frame->n) : frame->n;
}

/* Whether the directions wo and wi, away from a surface, are on different sides of it. */
PT_KERNEL_INLINE int pt_path_crosses(const struct pt_place *at, pt_vec3 wo, pt_vec3 wi)
{
    return v3_dot(wo, at->s.n_geometric) * v3_dot(wi, at->s.n_geometric) < 0.0f;
}

/* The next direction: its ray replaces the path's. 0: the path ends. */
PT_KERNEL_INLINE int pt_path_scatter(pt_effects fx, struct pt_path *path, const struct pt_place *at,
                                     const struct pt_frame *frame, const struct pt_bsdf *bsdf, pt_vec3 wo,
                                     struct pt_sample2 u)
{
    struct pt_bsdf_sample next;
    float u_lobe = fx & PT_FX_BSDF ? pt_path_1d(path, PT_DIM_BSDF_LOBE) : 0.0f;
    if (!pt_bsdf_sample(fx, bsdf, wo, u_lobe, u.x, u.y, &next))
        return 0;
    path->throughput = v3_mul(path->throughput, next.weight);
    if (v3_is_black(path->throughput))
        return 0;
    int delta = (fx & PT_FX_BSDF) && (next.flags & PT_SCATTER_DELTA);
    path->pdf_prev = delta ? 0.0f : next.pdf_solid;
    pt_vec3 wi = pt_frame_to_world(frame, next.wi);
    int crosses = pt_path_crosses(at, v3_neg(path->ray.direction), wi);
    if (crosses && !pt_bsdf_transmits(fx, bsdf))
        path->pdf_prev = delta ? -INFINITY : -next.pdf_solid;
    if (fx & PT_FX_TRANSMISSION) {
        float side = pt_bsdf_side_factor(fx, bsdf, wo, next.wi, crosses);
        path->throughput = v3_scale(path->throughput, side);
        path->eta_scale /= next.eta_scale * side;
    }
    if (fx & PT_FX_MEDIA)
        path->medium = pt_medium_towards(at, wi, path->medium);
    if ((fx & PT_FX_CONTACT) && path->contact->count) {
        path->contact->step = pt_contact_step(path->contact, at->s.n_geometric, wi);
        pt_path_turn_in_contact(fx, path, at->p, wi);
    } else {
        pt_path_turn(fx, path, pt_offset_point(at->p, at->s.n_geometric, at->error, wi), wi);
    }
    path->depth++;
    return pt_path_survives(path);
}

/* How a surface gathers light: a model that does not transmit takes it from the side of wo only. */
PT_KERNEL_INLINE struct pt_receiver pt_path_receiver(pt_effects fx, pt_vec3 p, const struct pt_frame *frame,
                                                     const struct pt_bsdf *bsdf, pt_vec3 wo)
{
    int transmits = pt_bsdf_transmits(fx, bsdf);
    return (struct pt_receiver){p, wo.z < 0.0f ? v3_neg(frame->n) : frame->n,
                                transmits ? PT_RECEIVER_BOTH_SIDES : PT_RECEIVER_SURFACE};
}

/* Where a shadow ray towards wi begins, and in which medium. 0: another surface at the same place is in its way. */
PT_KERNEL_INLINE int pt_path_leave(pt_effects fx, const struct pt_path *path, const struct pt_place *at, pt_vec3 wi,
                                   pt_vec3 *origin, int32_t *medium)
{
    const struct pt_contact *contact = path->contact;
    *medium = fx & PT_FX_MEDIA ? pt_medium_towards(at, wi, path->medium) : -1;
    if (!(fx & PT_FX_CONTACT) || !contact->count) {
        *origin = pt_offset_point(at->p, at->s.n_geometric, at->error, wi);
        return 1;
    }
    struct pt_rng rng = pt_sampler_stream(&path->sampler, PT_DIM_CONTACT);
    const int32_t step = pt_contact_step(contact, at->s.n_geometric, wi);
    for (int32_t i = contact->at + step; 0 <= i && i < contact->count; i += step) {
        enum pt_passage passage = pt_passage_at(fx, path->scene, &contact->ray, &contact->hits[i], &rng);
        if (passage == PT_PASSAGE_NONE)
            return 0;
        if (passage == PT_PASSAGE_BORDER) {
            struct pt_place border;
            pt_contact_place(path->scene, contact, i, &border);
            *medium = pt_medium_towards(&border, wi, *medium);
        }
    }
    *origin = pt_contact_origin(path->scene, contact, at->p, step, wi);
    return 1;
}

/* Light and the next direction at a surface. 0: the path ends. */
PT_KERNEL_INLINE int pt_path_bounce(pt_effects fx, struct pt_path *path, const struct pt_place *at)
{
    struct pt_sample2 u_bsdf = pt_path_2d(path, PT_DIM_BSDF), u_light = pt_path_2d(path, PT_DIM_LIGHT);
    float u_mix = fx & PT_FX_MIX ? pt_sampler_1d(&path->sampler, PT_DIM_MIX) : 0.0f;
    const struct pt_material *material = pt_material_resolve(fx, path->scene, at->shape->material, &at->s, u_mix);
    struct pt_frame frame = pt_material_frame(fx, path->scene, material, &at->s);
    struct pt_bsdf bsdf;
    pt_material_bsdf(fx, path->scene, material, &at->s, &bsdf);
    if (fx & PT_FX_COATED)
        bsdf.walk_key = pt_sampler_bits(&path->sampler, PT_DIM_BSDF_WALK);
    pt_vec3 wo_world = v3_neg(path->ray.direction), wo = pt_frame_to_local(&frame, wo_world);
    pt_bsdf_face(fx, &bsdf, wo, v3_dot(wo_world, at->s.n_geometric));
    if (path->settings->want_aux)
        pt_path_aux(fx, path, &bsdf, wo, &frame);
    if (path->trace)
        pt_trace_surface(path->trace, at, &bsdf, path->throughput);

    /* the light before the next direction, which replaces the ray, the medium and the throughput that it needs */
    path->prev = pt_path_receiver(fx, at->p, &frame, &bsdf, wo);
    if (pt_bsdf_has_smooth(fx, &bsdf) && pt_path_sample_light(fx, path, u_light)) {
        const struct pt_light_sample *light = &path->plan.light;
        float pdf;
        pt_vec3 wi = light->wi, wi_local = pt_frame_to_local(&frame, wi);
        pt_vec3 f = pt_bsdf_eval(fx, &bsdf, wo, wi_local, &pdf);
        int crosses = pt_path_crosses(at, wo_world, wi);
        if (crosses && !pt_bsdf_transmits(fx, &bsdf) && (light->finite || light->delta))
            f = v3_splat(0.0f);
        else if (fx & PT_FX_TRANSMISSION)
            f = v3_scale(f, pt_bsdf_side_factor(fx, &bsdf, wo, wi_local, crosses));
        pt_vec3 origin;
        int32_t medium;
        if (pt_path_leave(fx, path, at, wi, &origin, &medium))
            pt_path_plan_light(fx, path, f, pdf, origin, medium);
    }
    return pt_path_scatter(fx, path, at, &frame, &bsdf, wo, u_bsdf);
}

/* The camera's ray through the point (x, y) of the image. Scene, settings, sampler, trace and out are set, no more. */
PT_KERNEL_INLINE void pt_path_start(pt_effects fx, struct pt_path *path, float x, float y)
{
    const struct pt_camera *camera = &path->scene->camera;
    path->throughput = v3_splat(1.0f);
    path->radiance = v3_splat(0.0f);
    path->eta_scale = 1.0f;
    path->pdf_prev = 0.0f;
    path->depth = 0;
    path->rays = 0;
    path->t_medium = 0.0f;
    path->looked = 0;
    if (fx & PT_FX_LOOKED)
        path->passed->count = 0;
    if (fx & PT_FX_CONTACT)
        path->contact->count = 0;
    *path->out = (struct pt_path_result){.depth = INFINITY};
    struct pt_sample2 lens = {0.5f, 0.5f};
    float time = 0.0f;
    if ((fx & PT_FX_DEFOCUS) && camera->lens_radius > 0.0f)
        lens = pt_path_2d(path, PT_DIM_LENS);
    if (fx & PT_FX_MOTION) {
        const float *still = path->scene->still;
        time = (pt_sampler_1d(&path->sampler, PT_DIM_TIME) - still[0]) / (1.0f - still[0] - still[1]);
        time = fminf(1.0f, fmaxf(0.0f, time));
    }
    pt_camera_ray(fx, camera, x, y, lens.x, lens.y, time, &path->ray);
    path->medium = fx & PT_FX_MEDIA ? camera->medium : -1;
    if (path->trace)
        pt_trace_camera(path->trace, &path->ray);
}

/* What happens where the path's ray ends: emission that it met, the light planned there, and the next ray. 0: the path
 * ends. */
PT_KERNEL_INLINE int pt_path_vertex(pt_effects fx, struct pt_path *path)
{
    const struct pt_scene *scene = path->scene;
    struct pt_place at;
    path->plan.add = path->plan.light.target = v3_splat(0.0f);
    struct pt_rng rng = fx & PT_FX_ALPHA ? pt_sampler_stream(&path->sampler, PT_DIM_ALPHA) : (struct pt_rng){0};
    enum pt_found found = pt_path_found(fx, path, &rng);
    if ((fx & PT_FX_MEDIA) && path->medium >= 0) {
        int crossed = pt_path_cross_medium(fx, path, path->t_medium, found != PT_FOUND_NOTHING ? path->hit.t : INFINITY);
        if (crossed != 0)
            return crossed > 0;
    }
    if (found == PT_FOUND_NOTHING) {
        if (fx & PT_FX_ENVIRONMENT)
            pt_path_add_environment(path);
        return 0;
    }
    if ((fx & PT_FX_THROUGH) && found == PT_FOUND_BORDER && pt_path_cross_border(fx, path, &rng) == PT_FOUND_BORDER)
        return 1;
    pt_place_at_hit(fx, scene, &path->ray, &path->hit, &at);
    if (at.shape->light >= 0)
        pt_path_add_emission(fx, path, &at);
    return !pt_path_at_max_depth(path) && pt_path_bounce(fx, path, &at);
}

/* Radiance after the film's exposure, held to the largest that a sample may have. */
PT_KERNEL_INLINE pt_vec3 pt_path_pixel_value(const struct pt_scene *scene, const struct pt_integrator *settings,
                                             pt_vec3 radiance)
{
    pt_vec3 c = v3_scale(radiance, scene->radiance_scale);
    float peak = v3_max(c), limit = settings->max_component;
    return peak > limit && isfinite(peak) ? v3_scale(c, limit / peak) : c;
}

/* The result of a path that is over. */
PT_KERNEL_INLINE void pt_path_end(const struct pt_path *path)
{
    path->out->radiance = pt_path_pixel_value(path->scene, path->settings, path->radiance);
    path->out->rays = path->rays;
    if (path->trace)
        pt_trace_end(path->trace, path->out->radiance);
}

#endif
