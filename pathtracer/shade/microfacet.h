/*
 * GGX (Trowbridge–Reitz) microfacets: Walter et al. 2007 with the height-correlated Smith term (Heitz 2014), written so that
 * nothing divides by a cosine that may vanish. alpha_x, alpha_y > 0.
 */
#ifndef PT_SHADE_MICROFACET_H
#define PT_SHADE_MICROFACET_H

#include "scene/vec.h"
#include "shade/warp.h"

/* Below this roughness an interface is treated as a mirror. */
#define PT_ALPHA_SMOOTH 1e-3f

/* Roughness of a scene file → alpha. */
static inline float pt_roughness_to_alpha(float roughness) { return sqrtf(fmaxf(roughness, 0.0f)); }

/* Density of normals m, per unit projected area. */
static inline float pt_ggx_d(pt_vec3 m, float ax, float ay)
{
    float sx = m.x / ax, sy = m.y / ay, s = sx * sx + sy * sy + m.z * m.z;
    return 1.0f / (PT_PI * ax * ay * s * s);
}

/* sqrt(z² + (αx x)² + (αy y)²): |z| (1 + 2Λ) */
static inline float pt_ggx_stretch(pt_vec3 w, float ax, float ay)
{
    float x = ax * w.x, y = ay * w.y;
    return sqrtf(w.z * w.z + x * x + y * y);
}

/* G2(wo, wi) / (|cos o| |cos i|), G2 = 1 / (1 + Λo + Λi) */
static inline float pt_ggx_g2_over_cos(pt_vec3 wo, pt_vec3 wi, float ax, float ay)
{
    float d = fabsf(wo.z) * pt_ggx_stretch(wi, ax, ay) + fabsf(wi.z) * pt_ggx_stretch(wo, ax, ay);
    return d > 0.0f ? 2.0f / d : 0.0f;
}

/* G2 / G1(wo): what is left of a sampled visible normal's weight. */
static inline float pt_ggx_g2_over_g1(pt_vec3 wo, pt_vec3 wi, float ax, float ay)
{
    float zo = fabsf(wo.z), zi = fabsf(wi.z), so = pt_ggx_stretch(wo, ax, ay), si = pt_ggx_stretch(wi, ax, ay);
    float d = zo * si + zi * so;
    return d > 0.0f ? zi * (zo + so) / d : 0.0f;
}

/* Density of the normals visible from wo: D G1 |wo·m| / |cos o|. */
static inline float pt_ggx_visible_pdf(pt_vec3 wo, pt_vec3 m, float ax, float ay)
{
    return 2.0f * pt_ggx_d(m, ax, ay) * fabsf(v3_dot(wo, m)) / (fabsf(wo.z) + pt_ggx_stretch(wo, ax, ay));
}

/* A normal visible from wo (either side), with m.z > 0. Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
 * Caps". */
static inline pt_vec3 pt_ggx_sample_visible(pt_vec3 wo, float ax, float ay, float u0, float u1)
{
    pt_vec3 w = wo.z < 0.0f ? v3_neg(wo) : wo;
    w = v3_norm(v3(ax * w.x, ay * w.y, w.z));
    float z = (1.0f - u1) * (1.0f + w.z) - w.z, r = sqrtf(fmaxf(0.0f, 1.0f - z * z)), s, c;
    pt_sincos_turn(u0, &s, &c);
    pt_vec3 h = v3(r * c + w.x, r * s + w.y, z + w.z);
    return v3_norm(v3(ax * h.x, ay * h.y, fmaxf(1e-12f, h.z)));
}

#endif
