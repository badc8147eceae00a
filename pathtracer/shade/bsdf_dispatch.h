/*
 * The functions on struct pt_bsdf that the kernel calls: each forwards to the model's header.
 *
 * `fx` is a compile-time constant there. A model is reached only if the effects it needs are in fx:
 *   diffuse none · conductor SPECULAR (alpha 0) or GLOSSY · dielectric TRANSMISSION, and GLOSSY when rough · thin dielectric
 *   and diffuse transmission TRANSMISSION · coated COATED, and GLOSSY when its interface or metal is rough
 * pt_bsdf_effects says which those are for given numbers.
 */
#ifndef PT_SHADE_BSDF_DISPATCH_H
#define PT_SHADE_BSDF_DISPATCH_H

#include "shade/bsdf.h"
#include "shade/bsdf_coated.h"
#include "shade/bsdf_coated_walk.h"
#include "shade/bsdf_conductor.h"
#include "shade/bsdf_dielectric.h"
#include "shade/bsdf_diffuse.h"

#define PT_FX_BSDF (PT_FX_SPECULAR | PT_FX_GLOSSY | PT_FX_TRANSMISSION | PT_FX_COATED)

static inline pt_effects pt_alpha_effects(float alpha) { return alpha > 0.0f ? PT_FX_GLOSSY : PT_FX_SPECULAR; }

/* Effects that evaluating *b needs; alphas of 0 count as smooth. */
static inline pt_effects pt_bsdf_effects(const struct pt_bsdf *b)
{
    switch (b->kind) {
    case PT_BSDF_CONDUCTOR:
        return pt_alpha_effects(b->alpha_x);
    case PT_BSDF_DIELECTRIC:
        return PT_FX_TRANSMISSION | pt_alpha_effects(b->alpha_x);
    case PT_BSDF_THIN_DIELECTRIC:
        return PT_FX_TRANSMISSION | PT_FX_SPECULAR;
    case PT_BSDF_DIFFUSE_TRANSMISSION:
        return PT_FX_TRANSMISSION;
    case PT_BSDF_COATED_DIFFUSE:
        return PT_FX_COATED | pt_alpha_effects(b->alpha_x);
    case PT_BSDF_COATED_CONDUCTOR:
        return PT_FX_COATED | pt_alpha_effects(b->alpha_x) | pt_alpha_effects(b->base_alpha_x);
    default:
        return 0;
    }
}

/* Whether any part of *b is not a delta distribution: next-event estimation is of no use when it returns 0. */
static inline int pt_bsdf_has_smooth(pt_effects fx, const struct pt_bsdf *b)
{
    if (!(fx & (PT_FX_SPECULAR | PT_FX_TRANSMISSION | PT_FX_COATED)))
        return 1;
    switch (b->kind) {
    case PT_BSDF_CONDUCTOR:
        return b->alpha_x > 0.0f;
    case PT_BSDF_DIELECTRIC:
        return !pt_dielectric_is_smooth(b);
    case PT_BSDF_THIN_DIELECTRIC:
        return 0;
    case PT_BSDF_COATED_CONDUCTOR:
        return !pt_coated_walk_is_delta(b);
    default:
        return 1;
    }
}

/* Coatings that only the walk can evaluate. */
static inline int pt_bsdf_is_walked(const struct pt_bsdf *b)
{
    return b->kind == PT_BSDF_COATED_CONDUCTOR || (b->kind == PT_BSDF_COATED_DIFFUSE && !v3_is_black(b->albedo));
}

/* f(wo, wi) |cos θi|, without delta parts; *pdf_solid gets the density with which pt_bsdf_sample returns wi. */
static inline pt_vec3 pt_bsdf_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, float *pdf_solid)
{
    if (!(fx & PT_FX_BSDF) || b->kind == PT_BSDF_DIFFUSE)
        return pt_diffuse_eval(b, wo, wi, pdf_solid);
    if ((fx & PT_FX_GLOSSY) && b->kind == PT_BSDF_CONDUCTOR)
        return pt_conductor_eval(b, wo, wi, pdf_solid);
    if ((fx & PT_FX_COATED) && pt_bsdf_is_walked(b))
        return pt_coated_walk_eval(b, wo, wi, pdf_solid);
    if ((fx & PT_FX_COATED) && b->kind == PT_BSDF_COATED_DIFFUSE)
        return pt_coated_diffuse_eval(fx, b, wo, wi, pdf_solid);
    if ((fx & PT_FX_TRANSMISSION) && (fx & PT_FX_GLOSSY) && b->kind == PT_BSDF_DIELECTRIC)
        return pt_dielectric_eval(b, wo, wi, pdf_solid);
    if ((fx & PT_FX_TRANSMISSION) && b->kind == PT_BSDF_DIFFUSE_TRANSMISSION)
        return pt_diffuse_transmission_eval(b, wo, wi, pdf_solid);
    *pdf_solid = 0.0f;
    return v3_splat(0.0f);
}

/* Draws wi; u_lobe, u0, u1 in [0, 1). 0: the path ends here (absorbed), *out undefined. */
static inline int pt_bsdf_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                 struct pt_bsdf_sample *out)
{
    if (!(fx & PT_FX_BSDF) || b->kind == PT_BSDF_DIFFUSE)
        return pt_diffuse_sample(b, wo, u0, u1, out);
    if ((fx & (PT_FX_SPECULAR | PT_FX_GLOSSY)) && b->kind == PT_BSDF_CONDUCTOR) {
        if ((fx & PT_FX_GLOSSY) && b->alpha_x > 0.0f)
            return pt_conductor_sample_rough(b, wo, u0, u1, out);
        return pt_conductor_sample_smooth(b, wo, out);
    }
    if ((fx & PT_FX_COATED) && pt_bsdf_is_walked(b))
        return pt_coated_walk_sample(b, wo, u_lobe, u0, u1, out);
    if ((fx & PT_FX_COATED) && b->kind == PT_BSDF_COATED_DIFFUSE)
        return pt_coated_diffuse_sample(fx, b, wo, u_lobe, u0, u1, out);
    if ((fx & PT_FX_TRANSMISSION) && b->kind == PT_BSDF_DIELECTRIC) {
        if ((fx & PT_FX_GLOSSY) && !pt_dielectric_is_smooth(b))
            return pt_dielectric_sample_rough(b, wo, u_lobe, u0, u1, out);
        return pt_dielectric_sample_smooth(b, wo, u_lobe, out);
    }
    if ((fx & PT_FX_TRANSMISSION) && b->kind == PT_BSDF_DIFFUSE_TRANSMISSION)
        return pt_diffuse_transmission_sample(b, wo, u_lobe, u0, u1, out);
    if ((fx & PT_FX_TRANSMISSION) && b->kind == PT_BSDF_THIN_DIELECTRIC)
        return pt_thin_dielectric_sample(b, wo, u_lobe, out);
    return 0;
}

/* Directional-hemispherical reflectance, roughly: for the albedo plane of the image, not for transport. */
static inline pt_vec3 pt_bsdf_albedo(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo)
{
    float mu = fabsf(wo.z);
    if (!(fx & PT_FX_BSDF) || b->kind == PT_BSDF_DIFFUSE)
        return b->reflectance;
    if (b->kind == PT_BSDF_CONDUCTOR)
        return pt_fresnel_conductor_rgb(mu, b->eta_rgb, b->k_rgb);
    if ((fx & PT_FX_COATED) && b->kind == PT_BSDF_COATED_DIFFUSE) {
        float base, spec;
        pt_coat_split(b, mu, &base, &spec);
        return v3_madd(v3_splat(spec), 0.95f * PT_PI * base, pt_coat_base_factor(b));
    }
    if ((fx & PT_FX_COATED) && b->kind == PT_BSDF_COATED_CONDUCTOR) {
        float r = pt_fresnel_dielectric(mu, b->eta);
        return v3_madd(v3_splat(r), (1.0f - r) * (1.0f - r), pt_fresnel_conductor_rgb(mu, b->eta_rgb, b->k_rgb));
    }
    if (b->kind == PT_BSDF_DIFFUSE_TRANSMISSION)
        return v3_add(b->reflectance, b->transmittance);
    return v3_splat(1.0f);
}

#endif
