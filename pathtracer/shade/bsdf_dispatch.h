/*
 * The functions on struct pt_bsdf that the kernel calls, each a chain over the list of models.
 *
 * `fx` is a compile-time constant there: a model is in the code only if all effects that its line of the list names are in
 * fx.
 */
#ifndef PT_SHADE_BSDF_DISPATCH_H
#define PT_SHADE_BSDF_DISPATCH_H

#include "shade/bsdf_coated_conductor.h"
#include "shade/bsdf_coated_diffuse.h"
#include "shade/bsdf_conductor.h"
#include "shade/bsdf_dielectric.h"
#include "shade/bsdf_diffuse.h"
#include "shade/bsdf_diffuse_transmission.h"
#include "shade/bsdf_thin_dielectric.h"

/* Without any of these all surfaces are diffuse. */
#define PT_FX_BSDF (PT_FX_SPECULAR | PT_FX_GLOSSY | PT_FX_TRANSMISSION | PT_FX_COATED)

#define PT_BSDF_IS(id, needs) (((fx) & (needs)) == (needs) && b->kind == PT_BSDF_##id)

/* Fills the fields of *b that the material's model uses; *m is neither MIX nor INTERFACE. */
static inline void pt_material_bsdf(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                    const struct pt_surface *s, struct pt_bsdf *b)
{
    b->kind = fx & PT_FX_BSDF ? m->kind : PT_BSDF_DIFFUSE;
#define PT_BSDF_CASE(id, name, file_name, words, needs) \
    if (PT_BSDF_IS(id, needs)) { \
        pt_##name##_closure(fx, scene, m, s, b); \
        return; \
    }
    PT_BSDFS(PT_BSDF_CASE)
#undef PT_BSDF_CASE
}

/*
 * Shading normals may see a direction on another side of the interface than it is on. In which medium a ray is says the
 * geometric normal, for glass as for fog: it decides which way round wo meets the index, and that radiance shrinks by etap²
 * where a path crosses the surface, not where it crosses the plane of the shading normal. Along a path these factors cancel,
 * so that no normal makes glass brighter than what is around it.
 */

/* Turns glass over if wo, whose cosine with the geometric normal is `cos_geometric`, is not on the side that wo.z says. To
 * be called once for a closure, before it is evaluated. */
static inline void pt_bsdf_face(pt_effects fx, struct pt_bsdf *b, pt_vec3 wo, float cos_geometric)
{
    if ((fx & PT_FX_TRANSMISSION) && b->kind == PT_BSDF_DIELECTRIC && wo.z * cos_geometric < 0.0f)
        b->eta = 1.0f / b->eta;
}

/* Factor on what pt_bsdf_eval and pt_bsdf_sample say of wi; 1 where the shading normal sees wo and wi on the sides that they
 * are on. `crosses`: these are different ones. */
static inline float pt_bsdf_side_factor(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, int crosses)
{
    int transmits = wo.z * wi.z < 0.0f;
    if (!(fx & PT_FX_TRANSMISSION) || b->kind != PT_BSDF_DIELECTRIC || transmits == crosses)
        return 1.0f;
    float etap = wo.z < 0.0f ? 1.0f / b->eta : b->eta;
    return crosses ? 1.0f / (etap * etap) : etap * etap;
}

/* Whether any part of *b is not a delta distribution: next-event estimation is of no use when it returns 0. */
static inline int pt_bsdf_has_smooth(pt_effects fx, const struct pt_bsdf *b)
{
    if (!(fx & (PT_FX_SPECULAR | PT_FX_TRANSMISSION | PT_FX_COATED)))
        return 1;
#define PT_BSDF_CASE(id, name, file_name, words, needs) \
    if (PT_BSDF_IS(id, needs)) \
        return pt_##name##_has_smooth(b);
    PT_BSDFS(PT_BSDF_CASE)
#undef PT_BSDF_CASE
    return 1;
}

/* Whether light from the side that wo is not on may be scattered towards wo. */
static inline int pt_bsdf_transmits(pt_effects fx, const struct pt_bsdf *b)
{
#define PT_BSDF_CASE(id, name, file_name, words, needs) \
    if (((needs)&PT_FX_TRANSMISSION) && PT_BSDF_IS(id, needs)) \
        return 1;
    PT_BSDFS(PT_BSDF_CASE)
#undef PT_BSDF_CASE
    return 0;
}

/* f(wo, wi) |cos θi|, without delta parts; *pdf_solid gets the density with which pt_bsdf_sample returns wi. */
static inline pt_vec3 pt_bsdf_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, float *pdf_solid)
{
    if (!(fx & PT_FX_BSDF))
        return pt_diffuse_eval(fx, b, wo, wi, pdf_solid);
#define PT_BSDF_CASE(id, name, file_name, words, needs) \
    if (PT_BSDF_IS(id, needs)) \
        return pt_##name##_eval(fx, b, wo, wi, pdf_solid);
    PT_BSDFS(PT_BSDF_CASE)
#undef PT_BSDF_CASE
    *pdf_solid = 0.0f;
    return v3_splat(0.0f);
}

/* Draws wi; u_lobe, u0, u1 in [0, 1). 0: the path ends here (absorbed), *out undefined. */
static inline int pt_bsdf_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                 struct pt_bsdf_sample *out)
{
    out->eta_scale = 1.0f;
    out->flags = 0;
    if (!(fx & PT_FX_BSDF))
        return pt_diffuse_sample(fx, b, wo, u_lobe, u0, u1, out);
#define PT_BSDF_CASE(id, name, file_name, words, needs) \
    if (PT_BSDF_IS(id, needs)) \
        return pt_##name##_sample(fx, b, wo, u_lobe, u0, u1, out);
    PT_BSDFS(PT_BSDF_CASE)
#undef PT_BSDF_CASE
    return 0;
}

/* Directional-hemispherical reflectance, roughly: for the albedo plane of the image, not for transport. */
static inline pt_vec3 pt_bsdf_albedo(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo)
{
    if (!(fx & PT_FX_BSDF))
        return pt_diffuse_albedo(b, wo);
#define PT_BSDF_CASE(id, name, file_name, words, needs) \
    if (PT_BSDF_IS(id, needs)) \
        return pt_##name##_albedo(b, wo);
    PT_BSDFS(PT_BSDF_CASE)
#undef PT_BSDF_CASE
    return v3_splat(1.0f);
}

#endif
