/* Diffuse reflection and diffuse transmission. Both sides of a surface behave alike. */
#ifndef PT_SHADE_BSDF_DIFFUSE_TRANSMISSION_H
#define PT_SHADE_BSDF_DIFFUSE_TRANSMISSION_H

#include "shade/inputs.h"
#include "shade/warp.h"

static const struct pt_bsdf_read pt_diffuse_transmission_reads[] = {
    PT_READ_INTO(reflectance, COLOUR, "reflectance", 0.25),
    PT_READ_INTO(transmittance, COLOUR, "transmittance", 0.25),
    PT_READ(SCALE, "scale", 1),
    {0}};

static inline void pt_diffuse_transmission_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                                   const struct pt_surface *s, struct pt_bsdf *b)
{
    b->reflectance = pt_material_colour(fx, scene, &m->reflectance, s);
    b->transmittance = pt_material_colour(fx, scene, &m->transmittance, s);
}

static inline int pt_diffuse_transmission_has_smooth(const struct pt_bsdf *b)
{
    (void)b;
    return 1;
}

static inline pt_vec3 pt_diffuse_transmission_albedo(const struct pt_bsdf *b, pt_vec3 wo)
{
    (void)wo;
    return v3_add(b->reflectance, b->transmittance);
}

/* Chance of reflecting rather than transmitting; 0 for a black surface. */
static inline float pt_diffuse_transmission_choice(const struct pt_bsdf *b)
{
    float r = v3_max(b->reflectance), t = v3_max(b->transmittance);
    return r + t > 0.0f ? r / (r + t) : 0.0f;
}

static inline pt_vec3 pt_diffuse_transmission_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi,
                                                   float *pdf_solid)
{
    (void)fx;
    float pr = pt_diffuse_transmission_choice(b), cosine = fabsf(wi.z) * PT_INV_PI;
    int reflected = wo.z * wi.z > 0.0f;
    *pdf_solid = cosine * (reflected ? pr : 1.0f - pr);
    return v3_scale(reflected ? b->reflectance : b->transmittance, cosine);
}

static inline int pt_diffuse_transmission_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0,
                                                 float u1, struct pt_bsdf_sample *out)
{
    (void)fx;
    float pr = pt_diffuse_transmission_choice(b);
    int reflected = u_lobe < pr;
    float p = reflected ? pr : 1.0f - pr;
    pt_vec3 wi = pt_sample_cosine(u0, u1), colour = reflected ? b->reflectance : b->transmittance;
    if (v3_is_black(colour))
        return 0;
    out->pdf_solid = wi.z * PT_INV_PI * p;
    wi.z = copysignf(wi.z, reflected ? wo.z : -wo.z);
    out->wi = wi;
    out->weight = v3_scale(colour, 1.0f / p);
    out->flags = reflected ? 0 : PT_SCATTER_TRANSMIT;
    return 1;
}

#endif
