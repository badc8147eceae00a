/*
 * A boundary between two media: smooth, or GGX microfacets (Walter et al. 2007). wo.z > 0 is outside; b->eta = inside /
 * outside.
 */
#ifndef PT_SHADE_BSDF_DIELECTRIC_H
#define PT_SHADE_BSDF_DIELECTRIC_H

#include "shade/inputs.h"

/* Indices closer than this bend light by less than float resolves at the roughness of a lobe: passed straight on. */
#define PT_ETA_MATCHED 5e-4f

static inline int pt_dielectric_is_smooth(const struct pt_bsdf *b)
{
    return b->alpha_x == 0.0f || fabsf(b->eta - 1.0f) < PT_ETA_MATCHED;
}

static const struct pt_bsdf_read pt_dielectric_reads[] = {PT_READ(ROUGHNESS, "", 0), PT_READ(INDEX, "eta", 1.5), {0}};

static inline void pt_dielectric_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                         const struct pt_surface *s, struct pt_bsdf *b)
{
    pt_material_alpha(fx, scene, m, &m->roughness_u, &m->roughness_v, s, &b->alpha_x, &b->alpha_y);
    b->eta = m->eta;
}

static inline int pt_dielectric_has_smooth(const struct pt_bsdf *b) { return !pt_dielectric_is_smooth(b); }

static inline pt_vec3 pt_dielectric_albedo(const struct pt_bsdf *b, pt_vec3 wo)
{
    (void)b;
    (void)wo;
    return v3_splat(1.0f);
}

static inline int pt_dielectric_sample_smooth(const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, struct pt_bsdf_sample *out)
{
    float cos_t, r = pt_fresnel_dielectric_t(wo.z, b->eta, &cos_t);
    if (wo.z == 0.0f)
        return 0;
    if (u_lobe < r) {
        out->wi = v3(-wo.x, -wo.y, wo.z);
        out->weight = v3_splat(1.0f);
        out->pdf_solid = r;
        out->flags = PT_SCATTER_DELTA;
        return 1;
    }
    float inv_etap = wo.z < 0.0f ? b->eta : 1.0f / b->eta;
    out->wi = v3(-wo.x * inv_etap, -wo.y * inv_etap, copysignf(cos_t, -wo.z));
    out->weight = v3_splat(inv_etap * inv_etap);
    out->pdf_solid = 1.0f - r;
    out->eta_scale = inv_etap * inv_etap;
    out->flags = PT_SCATTER_DELTA | PT_SCATTER_TRANSMIT;
    return 1;
}

/* f |cos θi| and pdf of the rough interface; the visible normals are sampled, then F chooses reflection or refraction. */
static inline pt_vec3 pt_dielectric_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, float *pdf_solid)
{
    *pdf_solid = 0.0f;
    if (!(fx & PT_FX_GLOSSY) || pt_dielectric_is_smooth(b) || wo.z == 0.0f || wi.z == 0.0f)
        return v3_splat(0.0f);
    float ax = b->alpha_x, ay = b->alpha_y;
    int reflected = wo.z * wi.z > 0.0f;
    float etap = reflected ? 1.0f : wo.z > 0.0f ? b->eta : 1.0f / b->eta;
    pt_vec3 m = v3_madd(wo, etap, wi); /* Walter et al., eq. 13 and 16 */
    float len2 = v3_dot(m, m);
    if (!(len2 > 0.0f))
        return v3_splat(0.0f);
    m = v3_scale(m, copysignf(1.0f / sqrtf(len2), m.z));
    float om = v3_dot(wo, m), im = v3_dot(wi, m);
    if (om * wo.z <= 0.0f || im * wi.z <= 0.0f) /* seen from behind */
        return v3_splat(0.0f);
    float d = pt_ggx_d(m, ax, ay), fresnel = pt_fresnel_dielectric(om, b->eta);
    float g = pt_ggx_g2_over_cos(wo, wi, ax, ay) * fabsf(wi.z), visible = fabsf(wo.z) + pt_ggx_stretch(wo, ax, ay);
    if (reflected) {
        *pdf_solid = 0.5f * d * fresnel / visible;
        return v3_splat(0.25f * d * g * fresnel);
    }
    float denom = im + om / etap;
    float jacobian = fabsf(im) / (denom * denom); /* dωm/dωi, eq. 17 */
    *pdf_solid = 2.0f * d * fabsf(om) / visible * jacobian * (1.0f - fresnel);
    /* eq. 21; radiance shrinks by 1/etap² */
    return v3_splat(d * g * fabsf(om) * jacobian * (1.0f - fresnel) / (etap * etap));
}

/* With the density of pt_dielectric_eval: a visible normal, then Fresnel chooses. */
static inline int pt_dielectric_sample_rough(const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                             struct pt_bsdf_sample *out)
{
    float ax = b->alpha_x, ay = b->alpha_y;
    if (wo.z == 0.0f)
        return 0;
    pt_vec3 m = pt_ggx_sample_visible(wo, ax, ay, u0, u1); /* m.z > 0: the sign of om is that of wo.z */
    float om = v3_dot(wo, m), cos_t, fresnel = pt_fresnel_dielectric_t(om, b->eta, &cos_t);
    float visible = fabsf(wo.z) + pt_ggx_stretch(wo, ax, ay), d = pt_ggx_d(m, ax, ay);
    if (u_lobe < fresnel) {
        out->wi = v3_norm(v3_sub(v3_scale(m, 2.0f * om), wo));
        if (!(wo.z * out->wi.z > 0.0f))
            return 0;
        out->pdf_solid = 0.5f * d * fresnel / visible;
        out->weight = v3_splat(pt_ggx_g2_over_g1(wo, out->wi, ax, ay));
        return 1;
    }
    float inv_etap = wo.z < 0.0f ? b->eta : 1.0f / b->eta;
    float im = copysignf(cos_t, -om);
    out->wi = v3_norm(v3_madd(v3_scale(wo, -inv_etap), om * inv_etap + im, m));
    if (!(wo.z * out->wi.z < 0.0f))
        return 0;
    float denom = im + om * inv_etap;
    float jacobian = fabsf(im) / fmaxf(denom * denom, 1e-20f);
    out->pdf_solid = 2.0f * d * fabsf(om) / visible * jacobian * (1.0f - fresnel);
    out->weight = v3_splat(pt_ggx_g2_over_g1(wo, out->wi, ax, ay) * inv_etap * inv_etap);
    out->eta_scale = inv_etap * inv_etap;
    out->flags = PT_SCATTER_TRANSMIT;
    return out->pdf_solid > 0.0f;
}

static inline int pt_dielectric_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                       struct pt_bsdf_sample *out)
{
    if ((fx & PT_FX_GLOSSY) && !pt_dielectric_is_smooth(b))
        return pt_dielectric_sample_rough(b, wo, u_lobe, u0, u1, out);
    return pt_dielectric_sample_smooth(b, wo, u_lobe, out);
}

#endif
