/*
 * The material that acts at a place on a surface, and the shading frame its closure lives in (the closure itself:
 * pt_material_bsdf, shade/bsdf_dispatch.h).
 *
 * `fx` is the kernel's compile-time effect set: what a scene does not use is not in the code. Pure, thread-safe.
 */
#ifndef PT_SHADE_MATERIAL_H
#define PT_SHADE_MATERIAL_H

#include "base/err.h"
#include "scene/scene.h"
#include "shade/inputs.h"

/*
 * Makes what materials need before rendering: tables of the coatings, in the scene's arena; constant colours are clamped to
 * what their model allows. Call once, after textures and materials are filled and before effects are final.
 */
int pt_materials_build(struct pt_scene *scene, struct base_err *err);

/* Effects that material `id` needs, those of its textures and of mixed materials included. */
pt_effects pt_material_effects(const struct pt_scene *scene, int32_t id);

/* Normal displaced by the bump texture (Blinn 1978) or read from the normal map of *m. Out of line: rare. */
pt_vec3 pt_material_bumped_normal(const struct pt_scene *scene, const struct pt_material *m, const struct pt_surface *s);

/* The probability that a hit on `shape` counts, in [0, 1]. */
static inline float pt_shape_alpha(const struct pt_scene *scene, const struct pt_shape *shape, float u, float v)
{
    if (!shape->has_alpha)
        return 1.0f;
    return pt_input_float(PT_FX_ALL, scene, &shape->alpha, u, v);
}

/* Material that acts here: follows MIX with the random number u_mix in [0, 1), which is stretched and reused. */
static inline const struct pt_material *pt_material_resolve(pt_effects fx, const struct pt_scene *scene, int32_t id,
                                                            const struct pt_surface *s, float u_mix)
{
    const struct pt_material *m = &scene->materials[id];
    while ((fx & PT_FX_MIX) && m->kind == PT_MATERIAL_MIX) {
        float amount = pt_input_float(fx, scene, &m->mix_amount, s->u, s->v);
        if (u_mix < amount) {
            u_mix = u_mix / amount;
            m = &scene->materials[m->mix_b];
        } else {
            u_mix = amount < 1.0f ? (u_mix - amount) / (1.0f - amount) : 0.0f;
            m = &scene->materials[m->mix_a];
        }
        u_mix = fminf(u_mix, 0.99999994f);
    }
    return m;
}

/* Whether pt_material_frame reads dpdu and dpdv. */
static inline int pt_material_needs_tangents(pt_effects fx, const struct pt_material *m)
{
    if ((fx & PT_FX_BUMP) && (m->bump || m->normal_map))
        return 1;
    return (fx & PT_FX_GLOSSY) &&
           (m->roughness_u.texture != m->roughness_v.texture || m->roughness_u.value.x != m->roughness_v.value.x ||
            m->base_roughness_u.texture != m->base_roughness_v.texture ||
            m->base_roughness_u.value.x != m->base_roughness_v.value.x);
}

/* Shading frame; its n stays on the side of n_geometric, its s follows dpdu where that matters. */
static inline struct pt_frame pt_material_frame(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                                const struct pt_surface *s)
{
    if (!pt_material_needs_tangents(fx, m))
        return pt_frame_from_normal(s->n_shading);
    pt_vec3 n = s->n_shading;
    if ((fx & PT_FX_BUMP) && (m->bump || m->normal_map))
        n = pt_material_bumped_normal(scene, m, s);
    pt_vec3 tangent = v3_madd(s->dpdu, -v3_dot(s->dpdu, n), n);
    float len2 = v3_dot(tangent, tangent);
    if (!(len2 > 1e-16f * v3_dot(s->dpdu, s->dpdu) && isfinite(len2)))
        return pt_frame_from_normal(n);
    tangent = v3_scale(tangent, 1.0f / sqrtf(len2));
    return (struct pt_frame){tangent, v3_cross(n, tangent), n};
}

#endif
