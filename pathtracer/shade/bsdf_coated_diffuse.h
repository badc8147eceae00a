/*
 * Diffuse base under a dielectric coating. A layer that scatters light is left to the walk (coat_walk.h); for a clear one,
 * because the base forgets directions, the layered solution factors exactly:
 *     f = f_interface + A(μo) A(μi) R S / (π η²),   S = Σ_{n<N} (R Fi)^n
 * with A(μ) the flux that reaches the base from direction cosine μ (refraction and the layer's extinction exp(-t/|cos|),
 * unit coefficient, on the way) and Fi the flux that the interface returns to the base from diffuse light below it. Rough
 * interfaces have A, Fi and the albedo of f_interface tabulated (coat_table.h); smooth ones need Fi only. N = 5 base bounces
 * is what pbrt-v4's walk of depth 10 admits. A textured thickness has no table: it is left to the walk, too.
 *
 * Known difference: pbrt-v4 weighs its two ways out of a rough interface by densities of different events (direction inside
 * given outside, and the reverse), which sum to more than 1 and brighten light at grazing incidence: 2 % at 25°, 9 % at 72°
 * for alpha 0.1, not reciprocally. This model is the unbiased, reciprocal solution (tests/stat/pt_coat.c).
 */
#ifndef PT_SHADE_BSDF_COATED_DIFFUSE_H
#define PT_SHADE_BSDF_COATED_DIFFUSE_H

#include "shade/coat_table.h"
#include "shade/coat_walk.h"

static const struct pt_bsdf_read pt_coated_diffuse_reads[] = {PT_READ_INTO(reflectance, COLOUR, "reflectance", 0.5),
                                                              PT_READ(ROUGHNESS, "", 0),
                                                              PT_READ(INDEX, "eta", 1.5),
                                                              PT_COAT_READS,
                                                              {0}};

static inline void pt_coated_diffuse_closure(pt_effects fx, const struct pt_scene *scene, const struct pt_material *m,
                                             const struct pt_surface *s, struct pt_bsdf *b)
{
    pt_coat_closure(fx, scene, m, s, b);
    b->reflectance = pt_material_colour(fx, scene, &m->reflectance, s);
}

static inline int pt_coated_diffuse_has_smooth(const struct pt_bsdf *b)
{
    (void)b;
    return 1;
}

/* What the coating does to light of cosine mu > 0: *base gets A(mu), *spec the albedo of the interface's reflection. */
static inline void pt_coat_split(const struct pt_bsdf *b, float mu, float *base, float *spec)
{
    if (!pt_dielectric_is_smooth(b)) {
        pt_coat_lookup(b->coat_table, pt_coat_alpha(b->alpha_x, b->alpha_y), mu, base, spec);
        return;
    }
    float cos_t, r = pt_fresnel_dielectric_t(mu, b->eta, &cos_t);
    *spec = r;
    *base = cos_t > 0.0f ? (1.0f - r) * expf(-b->thickness / cos_t) : 0.0f;
}

/* Σ_{k<n} q^k, q in [0, 1] */
static inline float pt_coat_sum(float q, int n) { return q < 1.0f ? (1.0f - powf(q, (float)n)) / (1.0f - q) : (float)n; }

/* R S / (π η²) per channel */
static inline pt_vec3 pt_coat_base_factor(const struct pt_bsdf *b)
{
    float fi = pt_coat_internal(b->coat_table, pt_coat_alpha(b->alpha_x, b->alpha_y));
    float norm = PT_INV_PI / (b->eta * b->eta);
    pt_vec3 r = b->reflectance, q = v3_scale(r, fi);
    pt_vec3 one = v3_splat(1.0f), s = v3_add(one, v3_mul(q, v3_add(one, q)));
    pt_vec3 q3 = v3_mul(q, v3_mul(q, q));
    s = v3_add(s, v3_mul(q3, v3_add(one, q))); /* 1 + q + q² + q³ + q⁴ */
    if (b->more_events)
        s = v3(pt_coat_sum(q.x, pt_layer_bounces(b)), pt_coat_sum(q.y, pt_layer_bounces(b)),
               pt_coat_sum(q.z, pt_layer_bounces(b)));
    return v3_scale(v3_mul(r, s), norm);
}

/* Chance of sampling the interface's reflection. */
static inline float pt_coat_choice(float spec, float base, pt_vec3 factor)
{
    /* 2∫A μ dμ is near (1 - spec at normal incidence): 0.95 is close enough for a choice */
    float d = base * 0.95f * PT_PI * v3_luminance(factor);
    return spec + d > 0.0f ? spec / (spec + d) : 0.0f;
}

static inline pt_vec3 pt_coat_clear_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi, float *pdf_solid)
{
    *pdf_solid = 0.0f;
    if (!(wo.z * wi.z > 0.0f))
        return v3_splat(0.0f);
    if (wo.z < 0.0f) { /* both faces are coated alike */
        wo = v3_neg(wo);
        wi = v3_neg(wi);
    }
    float base_o, spec_o, base_i, spec_i;
    pt_coat_split(b, wo.z, &base_o, &spec_o);
    pt_coat_split(b, wi.z, &base_i, &spec_i);
    pt_vec3 factor = pt_coat_base_factor(b);
    float p = pt_coat_choice(spec_o, base_o, factor), pdf_spec = 0.0f;
    pt_vec3 f = v3_scale(factor, base_o * base_i * wi.z);
    if ((fx & PT_FX_GLOSSY) && !pt_dielectric_is_smooth(b)) {
        pt_vec3 m = v3_norm(v3_add(wo, wi));
        float ax = b->alpha_x, ay = b->alpha_y, d = pt_ggx_d(m, ax, ay);
        float fresnel = pt_fresnel_dielectric(v3_dot(wo, m), b->eta);
        pdf_spec = 0.5f * d / (wo.z + pt_ggx_stretch(wo, ax, ay));
        f = v3_add(f, v3_splat(0.25f * d * fresnel * pt_ggx_g2_over_cos(wo, wi, ax, ay) * wi.z));
    }
    *pdf_solid = p * pdf_spec + (1.0f - p) * wi.z * PT_INV_PI;
    return f;
}

/* One of the two lobes by chance, weighed by the density of both: they overlap. */
static inline int pt_coat_clear_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0, float u1,
                                       struct pt_bsdf_sample *out)
{
    if (wo.z == 0.0f)
        return 0;
    float side = wo.z < 0.0f ? -1.0f : 1.0f, base, spec;
    pt_vec3 w = v3_scale(wo, side), wi;
    pt_coat_split(b, w.z, &base, &spec);
    float p = pt_coat_choice(spec, base, pt_coat_base_factor(b));
    int rough = !pt_dielectric_is_smooth(b);
    if (u_lobe < p) {
        if (!((fx & PT_FX_GLOSSY) && rough)) {
            out->wi = v3(-wo.x, -wo.y, wo.z);
            out->weight = v3_splat(spec / p);
            out->pdf_solid = p;
            out->flags = PT_SCATTER_DELTA;
            return 1;
        }
        pt_vec3 m = pt_ggx_sample_visible(w, b->alpha_x, b->alpha_y, u0, u1);
        wi = v3_norm(v3_sub(v3_scale(m, 2.0f * v3_dot(w, m)), w));
        if (!(wi.z > 0.0f))
            return 0;
    } else {
        wi = pt_sample_cosine(u0, u1);
    }
    pt_vec3 f = pt_coat_clear_eval(fx, b, w, wi, &out->pdf_solid);
    out->wi = v3_scale(wi, side);
    out->weight = v3_scale(f, 1.0f / out->pdf_solid);
    return out->pdf_solid > 0.0f;
}

static inline int pt_coat_is_factored(const struct pt_bsdf *b) { return b->coat_table && v3_is_black(b->albedo); }

static inline pt_vec3 pt_coated_diffuse_albedo(const struct pt_bsdf *b, pt_vec3 wo)
{
    float base, spec = pt_fresnel_dielectric(fabsf(wo.z), b->eta);
    if (!b->coat_table)
        return v3_madd(v3_splat(spec), (1.0f - spec) * (1.0f - spec), b->reflectance);
    pt_coat_split(b, fabsf(wo.z), &base, &spec);
    return v3_madd(v3_splat(spec), 0.95f * PT_PI * base, pt_coat_base_factor(b));
}

static inline pt_vec3 pt_coated_diffuse_eval(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, pt_vec3 wi,
                                             float *pdf_solid)
{
    return pt_coat_is_factored(b) ? pt_coat_clear_eval(fx, b, wo, wi, pdf_solid) : pt_coat_walk_eval(b, wo, wi, pdf_solid);
}

static inline int pt_coated_diffuse_sample(pt_effects fx, const struct pt_bsdf *b, pt_vec3 wo, float u_lobe, float u0,
                                           float u1, struct pt_bsdf_sample *out)
{
    return pt_coat_is_factored(b) ? pt_coat_clear_sample(fx, b, wo, u_lobe, u0, u1, out)
                                  : pt_coat_walk_sample(b, wo, u_lobe, u0, u1, out);
}

#endif
