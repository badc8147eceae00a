/* A thin slab of glass, which neither bends nor shifts a ray; b->eta = inside / outside. */
#ifndef PT_SHADE_BSDF_THIN_DIELECTRIC_H
#define PT_SHADE_BSDF_THIN_DIELECTRIC_H

#include "shade/inputs.h"

static const struct pt_bsdf_read pt_thin_dielectric_reads[] = {
    PT_READ(INDEX, "eta", 1.5), PT_READ(IGNORED, "roughness uroughness vroughness remaproughness", 0), {0}};

static inline void pt_thin_dielectric_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                              const struct pt_surface *s, struct pt_bsdf *b)
{
    (void)fx;
    (void)scene;
    (void)s;
    b->eta = m->eta;
}

static inline int pt_thin_dielectric_has_smooth(const struct pt_bsdf *b)
{
    (void)b;
    return 0;
}

static inline pt_vec3 pt_thin_dielectric_albedo(const struct pt_bsdf *b, pt_vec3 wo)
{
    (void)b;
    (void)wo;
    return v3_splat(1.0f);
}

static inline pt_vec3 pt_thin_dielectric_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi,
                                              float *pdf_solid)
{
    (void)fx;
    (void)b;
    (void)wo;
    (void)wi;
    *pdf_solid = 0.0f;
    return v3_splat(0.0f);
}

/* Slab of two parallel faces: reflections between them summed, R' = R + T²R/(1 - R²). */
static inline int pt_thin_dielectric_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0,
                                            float u1, struct pt_bsdf_sample *out)
{
    (void)fx;
    (void)u0;
    (void)u1;
    float r = pt_fresnel_dielectric(fabsf(wo.z), b->eta);
    if (r < 1.0f)
        r = 2.0f * r / (1.0f + r);
    int reflected = u_lobe < r;
    out->wi = reflected ? v3(-wo.x, -wo.y, wo.z) : v3_neg(wo);
    out->weight = v3_splat(1.0f);
    out->pdf_solid = reflected ? r : 1.0f - r;
    out->flags = reflected ? PT_SCATTER_DELTA : PT_SCATTER_DELTA | PT_SCATTER_TRANSMIT;
    return wo.z != 0.0f;
}

#endif
