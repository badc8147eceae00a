#include "shade/coat_table.h"

#include "shade/bsdf_dielectric.h"

enum { DIRECTION_SAMPLES = 512, INTERNAL_SAMPLES = 65536 };

/* Roberts' R_d sequences (2018): additive recurrences on the powers of the root of x^(d+1) = x + 1. */
static float recur(int i, double step)
{
    double a = 0.5 + step * i;
    return fminf((float)(a - floor(a)), 0.99999994f);
}

static float extinction(float thickness, float cosine)
{
    float c = fabsf(cosine);
    return c > 0.0f ? expf(-thickness / c) : 0.0f;
}

/* Reflected and transmitted flux for light from direction cosine mu (outside > 0, inside < 0) at the normal drawn by u0, u1;
 * the parts inside the layer are attenuated. Both sides of the Fresnel split are taken, so only normals are sampled. */
static void scatter(const struct pt_bsdf *b, float mu, float u0, float u1, double *reflected, double *transmitted)
{
    pt_vec3 wo = v3(sqrtf(fmaxf(0.0f, 1.0f - mu * mu)), 0.0f, mu);
    float inv_etap = mu < 0.0f ? b->eta : 1.0f / b->eta, ax = b->alpha_x, cos_t;
    int smooth = pt_dielectric_is_smooth(b);
    pt_vec3 m = smooth ? v3(0.0f, 0.0f, 1.0f) : pt_ggx_sample_visible(wo, ax, ax, u0, u1);
    float om = v3_dot(wo, m), r = pt_fresnel_dielectric_t(om, b->eta, &cos_t);
    pt_vec3 refl = v3_sub(v3_scale(m, 2.0f * om), wo);
    pt_vec3 refr = v3_madd(v3_scale(wo, -inv_etap), om * inv_etap - copysignf(cos_t, om), m);
    if (refl.z * mu > 0.0f) {
        float shadowing = smooth ? 1.0f : pt_ggx_g2_over_g1(wo, refl, ax, ax);
        *reflected += (double)(r * shadowing * (mu < 0.0f ? extinction(b->thickness, refl.z) : 1.0f));
    }
    if (r < 1.0f && refr.z * mu < 0.0f) {
        float shadowing = smooth ? 1.0f : pt_ggx_g2_over_g1(wo, refr, ax, ax);
        *transmitted += (double)((1.0f - r) * shadowing * (mu > 0.0f ? extinction(b->thickness, refr.z) : 1.0f));
    }
}

static void build_row(float *row, const struct pt_bsdf *b)
{
    double internal = 0.0, unused = 0.0;
    for (int i = 0; i < INTERNAL_SAMPLES; i++) {
        float mu = sqrtf(fmaxf(recur(i, 0.5497004779019703), 1e-12f)); /* cosine-weighted */
        double r = 0.0;
        scatter(b, -mu, recur(i, 0.8191725133961645), recur(i, 0.6710436067037893), &r, &unused);
        internal += r * (double)extinction(b->thickness, mu);
    }
    row[0] = (float)(internal / INTERNAL_SAMPLES);
    for (int i = 0; i < PT_COAT_NODES; i++) {
        float x = fmaxf((float)i / (float)(PT_COAT_NODES - 1), 1e-3f);
        double r = 0.0, t = 0.0;
        for (int k = 0; k < DIRECTION_SAMPLES; k++)
            scatter(b, x * x, recur(k, 0.7548776662466927), recur(k, 0.5698402909980532), &r, &t);
        row[1 + i] = (float)(t / DIRECTION_SAMPLES);
        row[1 + PT_COAT_NODES + i] = (float)(r / DIRECTION_SAMPLES);
    }
}

void pt_coat_table_build(float *table, int rows, float eta, float thickness, float alpha_min, float alpha_max)
{
    float lo = sqrtf(alpha_min), hi = sqrtf(alpha_max);
    table[0] = (float)rows;
    table[1] = lo;
    table[2] = rows > 1 && hi > lo ? (float)(rows - 1) / (hi - lo) : 0.0f;
    for (int i = 0; i < rows; i++) {
        float x = rows > 1 ? lo + (hi - lo) * (float)i / (float)(rows - 1) : lo;
        struct pt_bsdf b = {.alpha_x = x * x, .alpha_y = x * x, .eta = eta, .thickness = thickness};
        build_row(table + PT_COAT_HEADER + i * PT_COAT_ROW, &b);
    }
}
