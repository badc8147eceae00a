/*
 * Metal: mirror (alpha 0) or GGX microfacets, with the Fresnel reflectance of a complex index.
 */
#ifndef PT_SHADE_BSDF_CONDUCTOR_H
#define PT_SHADE_BSDF_CONDUCTOR_H

#include "shade/inputs.h"

static const struct pt_bsdf_read pt_conductor_reads[] = {PT_READ(ROUGHNESS, "", 0), PT_READ(METAL, "", 0), {0}};

static inline void pt_conductor_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                        const struct pt_surface *s, struct pt_bsdf *b)
{
    pt_material_alpha(fx, scene, m, &m->roughness_u, &m->roughness_v, s, &b->alpha_x, &b->alpha_y);
    pt_material_metal(fx, scene, m, s, 1.0f, b);
}

static inline int pt_conductor_has_smooth(const struct pt_bsdf *b) { return b->alpha_x > 0.0f; }

static inline pt_vec3 pt_conductor_albedo(const struct pt_bsdf *b, pt_vec3 wo)
{
    return pt_fresnel_conductor_rgb(fabsf(wo.z), b->eta_rgb, b->k_rgb);
}

static inline pt_vec3 pt_conductor_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, float *pdf_solid)
{
    *pdf_solid = 0.0f;
    float ax = b->alpha_x, ay = b->alpha_y;
    if (!(fx & PT_FX_GLOSSY) || ax == 0.0f || !(wo.z * wi.z > 0.0f))
        return v3_splat(0.0f);
    pt_vec3 m = v3_add(wo, wi);
    float len2 = v3_dot(m, m);
    if (!(len2 > 0.0f))
        return v3_splat(0.0f);
    m = v3_scale(m, 1.0f / sqrtf(len2));
    float cos_d = fabsf(v3_dot(wo, m)), d = pt_ggx_d(m, ax, ay);
    /* Walter et al. 2007, eq. 20; the pdf is the visible normals' over the Jacobian 4 |wo·m| of reflection */
    *pdf_solid = 0.5f * d / (fabsf(wo.z) + pt_ggx_stretch(wo, ax, ay));
    float f = 0.25f * d * pt_ggx_g2_over_cos(wo, wi, ax, ay) * fabsf(wi.z);
    return v3_scale(pt_fresnel_conductor_rgb(cos_d, b->eta_rgb, b->k_rgb), f);
}

static inline int pt_conductor_sample_smooth(const struct pt_bsdf *b, pt_vec3 wo, struct pt_bsdf_sample *out)
{
    out->wi = v3(-wo.x, -wo.y, wo.z);
    out->weight = pt_fresnel_conductor_rgb(fabsf(wo.z), b->eta_rgb, b->k_rgb);
    out->pdf_solid = 1.0f;
    out->flags = PT_SCATTER_DELTA;
    return wo.z != 0.0f;
}

static inline int pt_conductor_sample_rough(const struct pt_bsdf *b, pt_vec3 wo, float u0, float u1,
                                            struct pt_bsdf_sample *out)
{
    float ax = b->alpha_x, ay = b->alpha_y;
    pt_vec3 m = pt_ggx_sample_visible(wo, ax, ay, u0, u1);
    float om = v3_dot(wo, m);
    pt_vec3 wi = v3_sub(v3_scale(m, 2.0f * om), wo);
    if (!(wo.z * wi.z > 0.0f))
        return 0;
    out->wi = v3_norm(wi);
    out->weight =
        v3_scale(pt_fresnel_conductor_rgb(fabsf(om), b->eta_rgb, b->k_rgb), pt_ggx_g2_over_g1(wo, out->wi, ax, ay));
    out->pdf_solid = 0.5f * pt_ggx_d(m, ax, ay) / (fabsf(wo.z) + pt_ggx_stretch(wo, ax, ay));
    return 1;
}

static inline int pt_conductor_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                      struct pt_bsdf_sample *out)
{
    (void)u_lobe;
    if ((fx & PT_FX_GLOSSY) && b->alpha_x > 0.0f)
        return pt_conductor_sample_rough(b, wo, u0, u1, out);
    return pt_conductor_sample_smooth(b, wo, out);
}

#endif
