/*
 * Lambertian reflection. Both sides of a surface behave alike.
 */
#ifndef PT_SHADE_BSDF_DIFFUSE_H
#define PT_SHADE_BSDF_DIFFUSE_H

#include "shade/inputs.h"
#include "shade/warp.h"

static const struct pt_bsdf_read pt_diffuse_reads[] = {
    PT_READ_INTO(reflectance, COLOUR, "reflectance", 0.5), PT_READ(UNSUPPORTED, "sigma", 0), {0}};

static inline void pt_diffuse_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                      const struct pt_surface *s, struct pt_bsdf *b)
{
    b->reflectance = pt_material_colour(fx, scene, &m->reflectance, s);
}

static inline int pt_diffuse_has_smooth(const struct pt_bsdf *b)
{
    (void)b;
    return 1;
}

static inline pt_vec3 pt_diffuse_albedo(const struct pt_bsdf *b, pt_vec3 wo)
{
    (void)wo;
    return b->reflectance;
}

static inline pt_vec3 pt_diffuse_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, float *pdf_solid)
{
    (void)fx;
    float pdf = wo.z * wi.z > 0.0f ? fabsf(wi.z) * PT_INV_PI : 0.0f;
    *pdf_solid = pdf;
    return v3_scale(b->reflectance, pdf);
}

static inline int pt_diffuse_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                    struct pt_bsdf_sample *out)
{
    (void)fx;
    (void)u_lobe;
    pt_vec3 wi = pt_sample_cosine(u0, u1);
    out->pdf_solid = wi.z * PT_INV_PI;
    wi.z = copysignf(wi.z, wo.z);
    out->wi = wi;
    out->weight = b->reflectance;
    return 1;
}

#endif
