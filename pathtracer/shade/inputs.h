/*
 * Parameters of materials at a place on a surface: textures looked up, values brought into the range of their model.
 * `fx` is the kernel's compile-time effect set. Pure, thread-safe.
 */
#ifndef PT_SHADE_INPUTS_H
#define PT_SHADE_INPUTS_H

#include "shade/bsdf.h"
#include "shade/fresnel.h"
#include "shade/microfacet.h"
#include "shade/texture.h"

/* A place on a surface. Normals are unit and on the side that pbrt calls outside, whatever side the ray comes from. */
struct pt_surface {
    float u, v; /* texture coordinates */
    pt_vec3 n_geometric;
    pt_vec3 n_shading;
    pt_vec3 dpdu, dpdv; /* need only be set when pt_material_needs_tangents */
};

static inline pt_vec3 pt_clamp_unit(pt_vec3 c) { return v3_least(v3_most(c, v3_splat(0.0f)), v3_splat(1.0f)); }

/* Reflectance-like input; constants were clamped by pt_materials_build. */
static inline pt_vec3 pt_material_colour(pt_effects fx, const struct pt_scene *scene, const struct pt_input *in,
                                         const struct pt_surface *s)
{
    if ((fx & PT_FX_TEXTURE) && in->texture)
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

#endif
