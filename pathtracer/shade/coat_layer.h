/*
 * Random walk between the interface of a coating and its base: the reference solution of the layered model (Guo, Hašan and
 * Zhao 2018, "Position-Free Monte Carlo Simulation for Arbitrary Layered BSDFs", in the form of pbrt-v4: unit extinction in
 * a layer of `thickness` mean free paths, at most PT_LAYER_EVENTS interactions if the scene does not say). One call is one
 * unbiased estimate.
 *
 * The path tracer uses it where no factored solution exists (coated metals, coatings that scatter inside); tests use it as
 * the oracle of the others.
 */
#ifndef PT_SHADE_COAT_LAYER_H
#define PT_SHADE_COAT_LAYER_H

#include "sample/rng.h"
#include "shade/bsdf_conductor.h"
#include "shade/bsdf_dielectric.h"
#include "shade/bsdf_diffuse.h"
#include "shade/phase_function.h"

enum { PT_LAYER_EVENTS = 10, PT_LAYER_ROULETTE = 4 };

struct pt_layer_ray {
    pt_vec3 wi;
    float weight;    /* f |cos| / pdf */
    float pdf_solid; /* 0 for a delta */
};

/* How often light in a clear layer meets the base at most: every other time. */
static inline int pt_layer_bounces(const struct pt_bsdf *b) { return (PT_LAYER_EVENTS + b->more_events) / 2; }

/* Base of the layer as a closure of its own. */
static inline struct pt_bsdf pt_layer_base(const struct pt_bsdf *b)
{
    return (struct pt_bsdf){.kind = b->kind == PT_BSDF_COATED_CONDUCTOR ? PT_BSDF_CONDUCTOR : PT_BSDF_DIFFUSE,
                            .alpha_x = b->base_alpha_x,
                            .alpha_y = b->base_alpha_y,
                            .reflectance = b->reflectance,
                            .eta_rgb = b->eta_rgb,
                            .k_rgb = b->k_rgb};
}

/* Through the interface, given that it transmits; the 1/etap² of radiance is left to the caller. 0: nothing passes. */
static inline int pt_layer_transmit(const struct pt_bsdf *b, pt_vec3 wo, float u0, float u1, struct pt_layer_ray *out)
{
    float cos_t, inv_etap = wo.z < 0.0f ? b->eta : 1.0f / b->eta;
    int smooth = pt_dielectric_is_smooth(b);
    pt_vec3 m = smooth ? v3(0.0f, 0.0f, 1.0f) : pt_ggx_sample_visible(wo, b->alpha_x, b->alpha_y, u0, u1);
    float om = v3_dot(wo, m), r = pt_fresnel_dielectric_t(om, b->eta, &cos_t);
    float im = copysignf(cos_t, -om);
    if (r >= 1.0f)
        return 0;
    out->wi = v3_norm(v3_madd(v3_scale(wo, -inv_etap), om * inv_etap + im, m));
    if (!(wo.z * out->wi.z < 0.0f))
        return 0;
    out->weight = 1.0f - r;
    out->pdf_solid = 0.0f;
    if (!smooth) {
        float denom = im + om * inv_etap;
        out->weight *= pt_ggx_g2_over_g1(wo, out->wi, b->alpha_x, b->alpha_y);
        out->pdf_solid = pt_ggx_visible_pdf(wo, m, b->alpha_x, b->alpha_y) * fabsf(im) / fmaxf(denom * denom, 1e-20f);
    }
    return 1;
}

/* Density with which pt_layer_transmit(b, outside) would find `inside`: what next-event estimation through the interface is
 * weighed against. */
static inline float pt_layer_transmit_pdf(const struct pt_bsdf *b, pt_vec3 outside, pt_vec3 inside)
{
    pt_vec3 m = v3_norm(v3_madd(outside, b->eta, inside));
    if (m.z < 0.0f)
        m = v3_neg(m);
    float om = v3_dot(outside, m), im = v3_dot(inside, m);
    if (om * outside.z <= 0.0f || im * inside.z <= 0.0f)
        return 0.0f;
    float denom = im + om / b->eta;
    return pt_ggx_visible_pdf(outside, m, b->alpha_x, b->alpha_y) * fabsf(im) / fmaxf(denom * denom, 1e-20f);
}

static inline float pt_layer_extinction(float distance, float cosine)
{
    return distance > 0.0f ? expf(-distance / fmaxf(fabsf(cosine), 1e-6f)) : 1.0f;
}

/* Power heuristic with exponent 2; b = 0 gives 1. */
static inline float pt_layer_mis(float a, float b)
{
    float a2 = a * a, b2 = b * b;
    return a2 > 0.0f && isfinite(a2) ? a2 / (a2 + b2) : a > b ? 1.0f : 0.0f;
}

/* Roulette on what a walk still carries; 0 when it ends. */
static inline int pt_layer_survives(pt_vec3 *beta, int depth, struct pt_rng *rng)
{
    float strength = v3_max(*beta);
    if (depth < PT_LAYER_ROULETTE || !(strength < 0.25f))
        return 1;
    if (!(strength > 0.0f) || pt_rng_float(rng) >= strength)
        return 0;
    *beta = v3_scale(*beta, 1.0f / strength);
    return 1;
}

/* State of one walk; the interface lies at z = thickness, the base at 0. */
struct pt_layer_walk {
    const struct pt_bsdf *top; /* eta and alpha of the interface */
    struct pt_bsdf base;
    struct pt_layer_ray exit; /* from the far end: wi refracted into the layer */
    pt_vec3 wi;               /* outside */
    pt_vec3 w, beta, f;       /* current direction (along the walk), throughput, result */
    float z;
    int top_delta;
};

/* Light that leaves by `exit` after scattering at height z with f |cos| = `scattered` and sampling density pdf. */
static inline void pt_layer_connect(struct pt_layer_walk *k, pt_vec3 scattered, float pdf)
{
    float weight = k->top_delta ? 1.0f : pt_layer_mis(k->exit.pdf_solid, pdf);
    float through =
        weight * k->exit.weight / fabsf(k->exit.wi.z) * pt_layer_extinction(k->top->thickness - k->z, k->exit.wi.z);
    k->f = v3_madd(k->f, through, v3_mul(k->beta, scattered));
}

/* The same when the sampled direction k->w happens to refract into wi; pdf is its density, 0 for a delta. */
static inline void pt_layer_escape(struct pt_layer_walk *k, float pdf)
{
    float ignored;
    pt_vec3 f = pt_dielectric_eval(PT_FX_ALL, k->top, v3_neg(k->w), k->wi, &ignored);
    if (v3_is_black(f))
        return;
    float weight = pdf > 0.0f ? pt_layer_mis(pdf, pt_layer_transmit_pdf(k->top, k->wi, v3_neg(k->w))) : 1.0f;
    float through = weight / fabsf(k->wi.z) * pt_layer_extinction(k->top->thickness - k->z, k->w.z);
    k->f = v3_madd(k->f, through, v3_mul(k->beta, f));
}

/* On to where light scatters inside the layer, 1 and the density of its new direction, or to the boundary, if that comes
 * first. */
static inline int pt_layer_travel(struct pt_layer_walk *k, struct pt_rng *rng, float *pdf)
{
    const struct pt_bsdf *b = k->top;
    const float start = k->z;
    k->z = k->w.z > 0.0f ? b->thickness : 0.0f;
    if (v3_is_black(b->albedo)) {
        k->beta = v3_scale(k->beta, pt_layer_extinction(b->thickness, k->w.z));
        return 0;
    }
    float dz = -log1pf(-pt_rng_float(rng)) * fabsf(k->w.z), next = k->w.z > 0.0f ? start + dz : start - dz;
    if (!(next > 0.0f && next < b->thickness))
        return 0;
    k->z = next;
    k->beta = v3_mul(k->beta, b->albedo);
    float u0 = pt_rng_float(rng), u1 = pt_rng_float(rng);
    *pdf = pt_phase_sample(b->g, v3_neg(k->w), u0, u1, &k->w);
    return 1;
}

/* The same, and light that leaves from there. */
static inline int pt_layer_medium(struct pt_layer_walk *k, struct pt_rng *rng)
{
    pt_vec3 wo = v3_neg(k->w);
    float pdf;
    if (!pt_layer_travel(k, rng, &pdf))
        return 0;
    /* exit.wi points down into the layer from outside; the walk has to head the other way */
    float p = pt_phase_eval(k->top->g, wo, v3_neg(k->exit.wi));
    pt_layer_connect(k, v3_splat(p), p);
    if (k->w.z > 0.0f && !k->top_delta)
        pt_layer_escape(k, pdf);
    return 1;
}

/* Reflection off the interface, given that it reflects. */
static inline int pt_layer_at_interface(struct pt_layer_walk *k, struct pt_rng *rng)
{
    const struct pt_bsdf *b = k->top;
    pt_vec3 wo = v3_neg(k->w);
    float u0 = pt_rng_float(rng), u1 = pt_rng_float(rng);
    if (k->top_delta) {
        k->w.z = wo.z;
        k->beta = v3_scale(k->beta, pt_fresnel_dielectric(wo.z, b->eta));
        return 1;
    }
    pt_vec3 m = pt_ggx_sample_visible(wo, b->alpha_x, b->alpha_y, u0, u1);
    float om = v3_dot(wo, m);
    k->w = v3_norm(v3_sub(v3_scale(m, 2.0f * om), wo));
    k->beta = v3_scale(k->beta, pt_fresnel_dielectric(om, b->eta) * pt_ggx_g2_over_g1(wo, k->w, b->alpha_x, b->alpha_y));
    return wo.z * k->w.z > 0.0f;
}

static inline int pt_layer_bounce(const struct pt_bsdf *base, pt_vec3 wo, struct pt_rng *rng, struct pt_bsdf_sample *s)
{
    float u0 = pt_rng_float(rng), u1 = pt_rng_float(rng);
    s->flags = 0;
    if (base->kind != PT_BSDF_CONDUCTOR)
        return pt_diffuse_sample(PT_FX_ALL, base, wo, 0.0f, u0, u1, s);
    return base->alpha_x > 0.0f ? pt_conductor_sample_rough(base, wo, u0, u1, s) : pt_conductor_sample_smooth(base, wo, s);
}

static inline int pt_layer_at_base(struct pt_layer_walk *k, struct pt_rng *rng)
{
    pt_vec3 wo = v3_neg(k->w), to_exit = v3_neg(k->exit.wi);
    struct pt_bsdf_sample s;
    float pdf;
    /* black for a mirror, which nothing can be connected to */
    pt_vec3 f = k->base.kind == PT_BSDF_CONDUCTOR ? pt_conductor_eval(PT_FX_ALL, &k->base, wo, to_exit, &pdf)
                                                  : pt_diffuse_eval(PT_FX_ALL, &k->base, wo, to_exit, &pdf);
    pt_layer_connect(k, f, pdf);
    if (!pt_layer_bounce(&k->base, wo, rng, &s))
        return 0;
    k->beta = v3_mul(k->beta, s.weight);
    k->w = s.wi;
    if (!k->top_delta)
        pt_layer_escape(k, s.flags & PT_SCATTER_DELTA ? 0.0f : s.pdf_solid);
    return 1;
}

/* One estimate of f(wo, wi) of light that reached the base or scattered in the layer; wo.z, wi.z > 0. The interface's own
 * reflection and all delta paths are left out. */
static inline pt_vec3 pt_layer_walk_eval(const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, struct pt_rng *rng)
{
    struct pt_layer_walk k = {.top = b, .base = pt_layer_base(b), .wi = wi, .f = v3_splat(0.0f), .z = b->thickness};
    struct pt_layer_ray enter;
    k.top_delta = pt_dielectric_is_smooth(b);
    float u0 = pt_rng_float(rng), u1 = pt_rng_float(rng), u2 = pt_rng_float(rng), u3 = pt_rng_float(rng);
    if (!pt_layer_transmit(b, wo, u0, u1, &enter) || !pt_layer_transmit(b, wi, u2, u3, &k.exit))
        return k.f;
    k.w = enter.wi;
    k.beta = v3_splat(enter.weight / (b->eta * b->eta));
    for (int depth = 0; depth < PT_LAYER_EVENTS + b->more_events; depth++) {
        if (!pt_layer_survives(&k.beta, depth, rng) || k.w.z == 0.0f)
            break;
        if (pt_layer_medium(&k, rng))
            continue;
        if (!(k.w.z > 0.0f ? pt_layer_at_interface(&k, rng) : pt_layer_at_base(&k, rng)))
            break;
    }
    return k.f;
}

/* Interaction of a sampled walk with the interface: reflected or transmitted by chance. Direction and weight f cos / p. */
static inline int pt_layer_cross(const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1, pt_vec3 *wi,
                                 float *weight, int *transmitted)
{
    int smooth = pt_dielectric_is_smooth(b);
    float cos_t, inv_etap = wo.z < 0.0f ? b->eta : 1.0f / b->eta;
    pt_vec3 m = smooth ? v3(0.0f, 0.0f, 1.0f) : pt_ggx_sample_visible(wo, b->alpha_x, b->alpha_y, u0, u1);
    float om = v3_dot(wo, m), r = pt_fresnel_dielectric_t(om, b->eta, &cos_t);
    *transmitted = !(u_lobe < r);
    *wi = *transmitted ? v3_madd(v3_scale(wo, -inv_etap), om * inv_etap + copysignf(cos_t, -om), m)
                       : v3_sub(v3_scale(m, 2.0f * om), wo);
    *wi = v3_norm(*wi);
    *weight = smooth ? 1.0f : pt_ggx_g2_over_g1(wo, *wi, b->alpha_x, b->alpha_y);
    return *transmitted ? wo.z * wi->z < 0.0f : wo.z * wi->z > 0.0f;
}

/*
 * Follows light from wo (z > 0) through the layer until it leaves: 0 absorbed, 1 reflected by the interface, 2 came from
 * below it. The weight is that of a perfect sample, at most 1 but for roulette: what pt_layer_walk_eval estimates pointwise,
 * this estimates as a whole, without its peaks. The two crossings' (η)² cancel. u_lobe, u0, u1 serve the first crossing.
 */
static inline int pt_layer_walk_sample(const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                       struct pt_rng *rng, pt_vec3 *wi, pt_vec3 *weight)
{
    struct pt_layer_walk k = {.top = b, .base = pt_layer_base(b), .z = b->thickness};
    float factor, pdf;
    int transmitted;
    if (!pt_layer_cross(b, wo, u_lobe, u0, u1, &k.w, &factor, &transmitted))
        return 0;
    *wi = k.w;
    *weight = k.beta = v3_splat(factor);
    if (!transmitted)
        return 1;
    for (int depth = 0; depth < PT_LAYER_EVENTS + b->more_events; depth++) {
        if (!pt_layer_survives(&k.beta, depth, rng) || k.w.z == 0.0f)
            return 0;
        if (pt_layer_travel(&k, rng, &pdf))
            continue;
        if (k.w.z < 0.0f) { /* at the base, else at the interface from below */
            struct pt_bsdf_sample s;
            if (!pt_layer_bounce(&k.base, v3_neg(k.w), rng, &s))
                return 0;
            k.beta = v3_mul(k.beta, s.weight);
            k.w = s.wi;
            continue;
        }
        float v_lobe = pt_rng_float(rng), v0 = pt_rng_float(rng), v1 = pt_rng_float(rng);
        if (!pt_layer_cross(b, v3_neg(k.w), v_lobe, v0, v1, &k.w, &factor, &transmitted))
            return 0;
        *wi = k.w;
        *weight = k.beta = v3_scale(k.beta, factor);
        if (transmitted)
            return 2;
    }
    return 0;
}

#endif
