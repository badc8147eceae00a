/*
 * From a material and a place on a surface to numbers: the closure pt_bsdf and the shading frame it lives in.
 *
 * `fx` is the kernel's compile-time effect set: what a scene does not use is not in the code. Pure, thread-safe.
 */
#ifndef PT_SHADE_MATERIAL_H
#define PT_SHADE_MATERIAL_H

#include "base/err.h"
#include "scene/scene.h"
#include "shade/bsdf.h"
#include "shade/fresnel.h"
#include "shade/microfacet.h"
#include "shade/texture.h"

/* A place on a surface. Normals are unit and on the side that pbrt calls outside, whatever side the ray comes from. */
struct pt_surface {
    float u, v;          /* texture coordinates */
    pt_vec3 n_geometric;
    pt_vec3 n_shading;
    pt_vec3 dpdu, dpdv;  /* need only be set when pt_material_needs_tangents */
};

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

static inline int pt_material_is_anisotropic(const struct pt_material *m)
{
    return m->roughness_u.texture != m->roughness_v.texture || m->roughness_u.value.x != m->roughness_v.value.x ||
           m->base_roughness_u.texture != m->base_roughness_v.texture ||
           m->base_roughness_u.value.x != m->base_roughness_v.value.x;
}

/* Whether pt_material_frame reads dpdu and dpdv. */
static inline int pt_material_needs_tangents(pt_effects fx, const struct pt_material *m)
{
    if ((fx & PT_FX_BUMP) && (m->bump >= 0 || m->normal_map >= 0))
        return 1;
    return (fx & PT_FX_GLOSSY) && pt_material_is_anisotropic(m);
}

/* Shading frame; its n stays on the side of n_geometric, its s follows dpdu where that matters. */
static inline struct pt_frame pt_material_frame(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                                const struct pt_surface *s)
{
    if (!pt_material_needs_tangents(fx, m))
        return pt_frame_from_normal(s->n_shading);
    pt_vec3 n = s->n_shading;
    if ((fx & PT_FX_BUMP) && (m->bump >= 0 || m->normal_map >= 0))
        n = pt_material_bumped_normal(scene, m, s);
    pt_vec3 tangent = v3_madd(s->dpdu, -v3_dot(s->dpdu, n), n);
    float len2 = v3_dot(tangent, tangent);
    if (!(len2 > 1e-16f * v3_dot(s->dpdu, s->dpdu) && isfinite(len2)))
        return pt_frame_from_normal(n);
    tangent = v3_scale(tangent, 1.0f / sqrtf(len2));
    return (struct pt_frame){tangent, v3_cross(n, tangent), n};
}

static inline pt_vec3 pt_clamp_unit(pt_vec3 c)
{
    return v3(fminf(fmaxf(c.x, 0.0f), 1.0f), fminf(fmaxf(c.y, 0.0f), 1.0f), fminf(fmaxf(c.z, 0.0f), 1.0f));
}

/* Reflectance-like input; constants were clamped by pt_materials_build. */
static inline pt_vec3 pt_material_colour(pt_effects fx, const struct pt_scene *scene, const struct pt_input *in,
                                         const struct pt_surface *s)
{
    if ((fx & PT_FX_TEXTURE) && in->texture >= 0)
        return pt_clamp_unit(pt_texture_eval(scene, in->texture, s->u, s->v));
    return in->value;
}

/* Roughness pair → alphas; both 0 when pbrt-v4 would call the surface effectively smooth. */
static inline void pt_material_alpha(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                     const struct pt_input *ru, const struct pt_input *rv, const struct pt_surface *s,
                                     float *alpha_x, float *alpha_y)
{
    float x = pt_input_float(fx, scene, ru, s->u, s->v), y = pt_input_float(fx, scene, rv, s->u, s->v);
    if (m->remap_roughness) {
        x = pt_roughness_to_alpha(x);
        y = pt_roughness_to_alpha(y);
    }
    int smooth = !(fmaxf(x, y) >= PT_ALPHA_SMOOTH);
    *alpha_x = smooth ? 0.0f : fminf(fmaxf(x, 1e-4f), 1.0f);
    *alpha_y = smooth ? 0.0f : fminf(fmaxf(y, 1e-4f), 1.0f);
}

static inline void pt_material_metal(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                     const struct pt_surface *s, float outside, struct pt_bsdf *b)
{
    if (m->conductor_by_colour) {
        pt_vec3 r = pt_material_colour(fx, scene, &m->reflectance, s);
        b->eta_rgb = v3_splat(1.0f);
        b->k_rgb = v3(pt_conductor_k_from_reflectance(r.x), pt_conductor_k_from_reflectance(r.y),
                      pt_conductor_k_from_reflectance(r.z));
    } else {
        b->eta_rgb = pt_input_rgb(fx, scene, &m->eta_rgb, s->u, s->v);
        b->k_rgb = pt_input_rgb(fx, scene, &m->k_rgb, s->u, s->v);
    }
    b->eta_rgb = v3_scale(b->eta_rgb, 1.0f / outside);
    b->k_rgb = v3_scale(b->k_rgb, 1.0f / outside);
}

/* Fills the fields of *b that its kind uses, from *m, which is neither MIX nor INTERFACE. */
static inline void pt_material_bsdf(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                    const struct pt_surface *s, struct pt_bsdf *b)
{
    const pt_effects special = PT_FX_SPECULAR | PT_FX_GLOSSY | PT_FX_TRANSMISSION | PT_FX_COATED;
    b->kind = PT_BSDF_DIFFUSE;
    if (!(fx & special) || m->kind == PT_MATERIAL_DIFFUSE) {
        b->reflectance = pt_material_colour(fx, scene, &m->reflectance, s);
        return;
    }
    b->kind = m->kind;
    b->eta = m->eta;
    if (m->kind == PT_MATERIAL_DIFFUSE_TRANSMISSION) {
        b->reflectance = pt_material_colour(fx, scene, &m->reflectance, s);
        b->transmittance = pt_material_colour(fx, scene, &m->transmittance, s);
        return;
    }
    pt_material_alpha(fx, scene, m, &m->roughness_u, &m->roughness_v, s, &b->alpha_x, &b->alpha_y);
    if (m->kind == PT_MATERIAL_CONDUCTOR)
        pt_material_metal(fx, scene, m, s, 1.0f, b);
    if ((fx & PT_FX_COATED) && (m->kind == PT_MATERIAL_COATED_DIFFUSE || m->kind == PT_MATERIAL_COATED_CONDUCTOR)) {
        b->thickness = fmaxf(0.0f, pt_input_float(fx, scene, &m->thickness, s->u, s->v));
        b->g = pt_input_float(fx, scene, &m->g, s->u, s->v);
        b->albedo = pt_material_colour(fx, scene, &m->albedo, s);
        b->coat_table = m->coat_table;
        b->walk_key = 0; /* for the caller to set */
        if (m->kind == PT_MATERIAL_COATED_DIFFUSE) {
            b->reflectance = pt_material_colour(fx, scene, &m->reflectance, s);
        } else {
            pt_material_metal(fx, scene, m, s, m->eta, b);
            pt_material_alpha(fx, scene, m, &m->base_roughness_u, &m->base_roughness_v, s, &b->base_alpha_x,
                              &b->base_alpha_y);
        }
    }
}

#endif
