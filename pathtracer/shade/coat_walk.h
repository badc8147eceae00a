/*
 * Coatings without a factored solution: over metal, or scattering light inside the layer. The value is one estimate by the
 * walk of coat_layer.h from a stream keyed by (walk_key, wo, wi): a function of its arguments whose mean over walk_key is
 * the layered BSDF. A direction is drawn by following light through the layer, so its weight has no peaks; the density of
 * such a walk has no closed form, and pdf_solid is that of lobes fitted to it: the interface's reflection, the metal seen
 * through the interface, a cosine lobe for what bounced in between. Weights of multiple importance sampling need only that
 * both strategies use the same function, so the result is unbiased; weight · pdf is not f.
 *
 * Mirror-like interface over mirror-like metal is a delta whose weight is summed in closed form.
 */
#ifndef PT_SHADE_COAT_WALK_H
#define PT_SHADE_COAT_WALK_H

#include <string.h>

#include "shade/coat_layer.h"

/* What both coated models read of the layer between interface and base. */
#define PT_COAT_READS \
    PT_READ_INTO(thickness, NUMBER, "thickness", 0.01), PT_READ_INTO(g, ASYMMETRY, "g", 0), \
        PT_READ_INTO(albedo, COLOUR, "albedo", 0), PT_READ_INTO(max_depth, NUMBER, "maxdepth", 0), \
        PT_READ(IGNORED, "nsamples", 0)

static inline void pt_coat_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                   const struct pt_surface *s, struct pt_bsdf *b)
{
    pt_material_alpha(fx, scene, m, &m->roughness_u, &m->roughness_v, s, &b->alpha_x, &b->alpha_y);
    b->eta = m->eta;
    b->thickness = fmaxf(0.0f, pt_input_float(fx, scene, &m->thickness, s->u, s->v));
    const float most = (float)PT_PHASE_G_MAX; /* textures may say anything */
    b->g = fminf(most, fmaxf(-most, pt_input_float(fx, scene, &m->g, s->u, s->v)));
    b->albedo = pt_material_colour(fx, scene, &m->albedo, s);
    b->coat_table = m->coat_table;
    b->more_events = 0;
    if (m->max_depth.value.x > 0.0f) /* what meets the base leaves through the interface: even numbers */
        b->more_events = 2 * (int32_t)ceilf(0.5f * fminf(m->max_depth.value.x, 1e3f)) - PT_LAYER_EVENTS;
    b->walk_key = 0; /* for the caller to set */
}

/* Probabilities and roughness of the three lobes. */
struct pt_coat_lobes {
    float interface, metal, cosine; /* sum to 1 */
    float metal_x, metal_y;         /* GGX alpha of the metal as it looks from outside; 0 = none */
};

static inline struct pt_coat_lobes pt_coat_lobes(const struct pt_bsdf *b, float mu)
{
    float r = pt_fresnel_dielectric(mu, b->eta), t = (1.0f - r) * (1.0f - r);
    struct pt_coat_lobes l = {0};
    if (b->kind == PT_BSDF_COATED_CONDUCTOR) {
        /* Small slopes: the metal's are magnified by refraction, those of the two crossings enter with (η - 1)/2 each. */
        float bend = 0.5f * (b->eta - 1.0f) * (b->eta - 1.0f), eta2 = b->eta * b->eta;
        l.metal_x = fminf(1.0f, sqrtf(eta2 * b->base_alpha_x * b->base_alpha_x + bend * b->alpha_x * b->alpha_x));
        l.metal_y = fminf(1.0f, sqrtf(eta2 * b->base_alpha_y * b->base_alpha_y + bend * b->alpha_y * b->alpha_y));
        l.metal = 0.85f * t * v3_max(pt_fresnel_conductor_rgb(mu, b->eta_rgb, b->k_rgb));
        l.cosine = 0.15f * t;
    } else {
        l.cosine = t * fmaxf(v3_max(b->reflectance), v3_max(b->albedo));
    }
    l.interface = r;
    float sum = l.interface + l.metal + l.cosine, scale = sum > 0.0f ? 1.0f / sum : 0.0f;
    l.interface *= scale;
    l.metal *= scale;
    l.cosine = fmaxf(0.0f, 1.0f - l.interface - l.metal);
    return l;
}

static inline struct pt_rng pt_coat_stream(const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi)
{
    float values[6] = {wo.x, wo.y, wo.z, wi.x, wi.y, wi.z};
    uint64_t key = b->walk_key;
    for (int i = 0; i < 6; i += 2) {
        uint32_t bits[2];
        memcpy(bits, values + i, sizeof bits);
        key = pt_hash64(key ^ ((uint64_t)bits[0] << 32 | bits[1])) + 0x9e3779b97f4a7c15u;
    }
    return pt_rng_make(key);
}

static inline int pt_coat_walk_is_delta(const struct pt_bsdf *b)
{
    return b->kind == PT_BSDF_COATED_CONDUCTOR && pt_dielectric_is_smooth(b) && b->base_alpha_x == 0.0f &&
           v3_is_black(b->albedo);
}

/* wo.z, wi.z > 0 */
static inline float pt_coat_walk_pdf(const struct pt_bsdf *b, const struct pt_coat_lobes *l, pt_vec3 wo, pt_vec3 wi,
                                     pt_vec3 m)
{
    float pdf = l->cosine * wi.z * PT_INV_PI;
    if (!pt_dielectric_is_smooth(b))
        pdf +=
            l->interface * 0.5f * pt_ggx_d(m, b->alpha_x, b->alpha_y) / (wo.z + pt_ggx_stretch(wo, b->alpha_x, b->alpha_y));
    if (l->metal_x > 0.0f)
        pdf += l->metal * 0.5f * pt_ggx_d(m, l->metal_x, l->metal_y) / (wo.z + pt_ggx_stretch(wo, l->metal_x, l->metal_y));
    return pdf;
}

__attribute__((noinline, unused)) static pt_vec3 pt_coat_walk_eval(const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi,
                                                                   float *pdf_solid)
{
    *pdf_solid = 0.0f;
    if (!(wo.z * wi.z > 0.0f) || pt_coat_walk_is_delta(b))
        return v3_splat(0.0f);
    struct pt_rng rng = pt_coat_stream(b, wo, wi);
    if (wo.z < 0.0f) {
        wo = v3_neg(wo);
        wi = v3_neg(wi);
    }
    struct pt_coat_lobes l = pt_coat_lobes(b, wo.z);
    pt_vec3 m = v3_norm(v3_add(wo, wi)), f = pt_layer_walk_eval(b, wo, wi, &rng);
    *pdf_solid = pt_coat_walk_pdf(b, &l, wo, wi, m);
    if (!pt_dielectric_is_smooth(b)) {
        float d = pt_ggx_d(m, b->alpha_x, b->alpha_y), fresnel = pt_fresnel_dielectric(v3_dot(wo, m), b->eta);
        f = v3_add(f, v3_splat(0.25f * d * fresnel * pt_ggx_g2_over_cos(wo, wi, b->alpha_x, b->alpha_y)));
    }
    return v3_scale(f, wi.z);
}

/* Reflectance of a smooth interface over smooth metal: F + T² Rc e² Σ_{n<N} (F Rc e²)^n with e the layer's transmittance. */
static inline pt_vec3 pt_coated_mirror(const struct pt_bsdf *b, float mu)
{
    float cos_t, r = pt_fresnel_dielectric_t(mu, b->eta, &cos_t);
    if (!(cos_t > 0.0f))
        return v3_splat(r);
    float e2 = expf(-2.0f * b->thickness / cos_t), t2 = (1.0f - r) * (1.0f - r);
    pt_vec3 once = v3_scale(pt_fresnel_conductor_rgb(cos_t, b->eta_rgb, b->k_rgb), e2), sum = v3_splat(0.0f), term = once;
    for (int n = 0; n < pt_layer_bounces(b); n++) {
        sum = v3_add(sum, term);
        term = v3_scale(v3_mul(term, once), r);
    }
    return v3_madd(v3_splat(r), t2, sum);
}

__attribute__((noinline, unused)) static int pt_coat_walk_sample(const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0,
                                                                 float u1, struct pt_bsdf_sample *out)
{
    if (wo.z == 0.0f)
        return 0;
    float side = wo.z < 0.0f ? -1.0f : 1.0f;
    pt_vec3 w = v3_scale(wo, side), wi;
    out->flags = PT_SCATTER_DELTA;
    out->wi = v3(-wo.x, -wo.y, wo.z);
    if (pt_coat_walk_is_delta(b)) {
        out->weight = pt_coated_mirror(b, w.z);
        out->pdf_solid = 1.0f;
        return 1;
    }
    struct pt_rng rng = pt_coat_stream(b, w, v3(u_lobe, u0, u1));
    int what = pt_layer_walk_sample(b, w, u_lobe, u0, u1, &rng, &wi, &out->weight);
    if (!what)
        return 0;
    if (what == 1 && pt_dielectric_is_smooth(b)) {
        out->pdf_solid = pt_fresnel_dielectric(w.z, b->eta);
        return 1;
    }
    struct pt_coat_lobes l = pt_coat_lobes(b, w.z);
    out->flags = 0;
    out->wi = v3_scale(wi, side);
    out->pdf_solid = pt_coat_walk_pdf(b, &l, w, wi, v3_norm(v3_add(w, wi)));
    return out->pdf_solid > 0.0f;
}

#endif
