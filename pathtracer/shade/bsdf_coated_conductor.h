/* Metal under a dielectric coating: always the walk (coat_walk.h). */
#ifndef PT_SHADE_BSDF_COATED_CONDUCTOR_H
#define PT_SHADE_BSDF_COATED_CONDUCTOR_H

#include "shade/coat_walk.h"

static const struct pt_bsdf_read pt_coated_conductor_reads[] = {PT_READ(ROUGHNESS, "interface.", 0),
                                                                PT_READ(BASE_ROUGHNESS, "conductor.", 0),
                                                                PT_READ(INDEX, "interface.eta", 1.5),
                                                                PT_READ(METAL, "conductor.", 0),
                                                                PT_COAT_READS,
                                                                {0}};

static inline void pt_coated_conductor_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                               const struct pt_surface *s, struct pt_bsdf *b)
{
    pt_coat_closure(fx, scene, m, s, b);
    pt_material_metal(fx, scene, m, s, m->eta, b);
    pt_material_alpha(fx, scene, m, &m->base_roughness_u, &m->base_roughness_v, s, &b->base_alpha_x, &b->base_alpha_y);
}

static inline int pt_coated_conductor_has_smooth(const struct pt_bsdf *b) { return !pt_coat_walk_is_delta(b); }

static inline pt_vec3 pt_coated_conductor_albedo(const struct pt_bsdf *b, pt_vec3 wo)
{
    float mu = fabsf(wo.z), r = pt_fresnel_dielectric(mu, b->eta);
    return v3_madd(v3_splat(r), (1.0f - r) * (1.0f - r), pt_fresnel_conductor_rgb(mu, b->eta_rgb, b->k_rgb));
}

static inline pt_vec3 pt_coated_conductor_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi,
                                               float *pdf_solid)
{
    (void)fx;
    return pt_coat_walk_eval(b, wo, wi, pdf_solid);
}

static inline int pt_coated_conductor_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0,
                                             float u1, struct pt_bsdf_sample *out)
{
    (void)fx;
    return pt_coat_walk_sample(b, wo, u_lobe, u0, u1, out);
}

#endif
