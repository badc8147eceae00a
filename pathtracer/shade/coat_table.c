#include "shade/coat_table.h"

#include "shade/bsdf_dielectric.h"

enum { DIRECTION_SAMPLES = 512, INTERNAL_STRATA = 48, INTERNAL_SAMPLES = 128 };

/* Low-discrepancy pairs: Roberts' R2 sequence (additive recurrence on the plastic number). */
static void pair(int i, float *u0, float *u1)
{
    double a = 0.5 + 0.7548776662466927 * i, b = 0.5 + 0.5698402909980532 * i;
    *u0 = fminf((float)(a - floor(a)), 0.99999994f);
    *u1 = fminf((float)(b - floor(b)), 0.99999994f);
}

static float extinction(float thickness, float cosine)
{
    float c = fabsf(cosine);
    return c > 0.0f ? expf(-thickness / c) : 0.0f;
}

/* Reflected and transmitted flux for light from direction cosine mu (outside > 0, inside < 0); the parts inside the layer are
 * attenuated. The whole Fresnel split is taken at each normal, so only normals are sampled. */
static void albedo(float eta, float alpha, float thickness, float mu, int samples, double *reflected, double *transmitted)
{
    struct pt_bsdf b = {.kind = PT_BSDF_DIELECTRIC, .alpha_x = alpha, .alpha_y = alpha, .eta = eta};
    pt_vec3 wo = v3(sqrtf(fmaxf(0.0f, 1.0f - mu * mu)), 0.0f, mu);
    float inv_etap = mu < 0.0f ? eta : 1.0f / eta;
    int smooth = pt_dielectric_is_smooth(&b);
    double sum_r = 0.0, sum_t = 0.0;
    for (int i = 0, n = smooth ? 1 : samples; i < n; i++) {
        float u0, u1, cos_t;
        pair(i, &u0, &u1);
        pt_vec3 m = smooth ? v3(0.0f, 0.0f, 1.0f) : pt_ggx_sample_visible(wo, alpha, alpha, u0, u1);
        float om = v3_dot(wo, m), r = pt_fresnel_dielectric_t(om, eta, &cos_t);
        pt_vec3 refl = v3_sub(v3_scale(m, 2.0f * om), wo);
        pt_vec3 refr = v3_madd(v3_scale(wo, -inv_etap), om * inv_etap - copysignf(cos_t, om), m);
        if (refl.z * mu > 0.0f)
            sum_r += (double)(r * (smooth ? 1.0f : pt_ggx_g2_over_g1(wo, refl, alpha, alpha)) *
                              (mu < 0.0f ? extinction(thickness, refl.z) : 1.0f));
        if (r < 1.0f && refr.z * mu < 0.0f)
            sum_t += (double)((1.0f - r) * (smooth ? 1.0f : pt_ggx_g2_over_g1(wo, refr, alpha, alpha)) *
                              (mu > 0.0f ? extinction(thickness, refr.z) : 1.0f));
    }
    *reflected = sum_r / (smooth ? 1 : samples);
    *transmitted = sum_t / (smooth ? 1 : samples);
}

static void build_row(float *row, float eta, float alpha, float thickness)
{
    double internal = 0.0, r, t;
    for (int i = 0; i < INTERNAL_STRATA; i++) { /* uniform in cos²: the cosine-weighted mean */
        float mu = sqrtf(((float)i + 0.5f) / (float)INTERNAL_STRATA);
        albedo(eta, alpha, thickness, -mu, INTERNAL_SAMPLES, &r, &t);
        internal += r * (double)extinction(thickness, mu) / INTERNAL_STRATA;
    }
    row[0] = (float)internal;
    for (int i = 0; i < PT_COAT_NODES; i++) {
        float x = fmaxf((float)i / (float)(PT_COAT_NODES - 1), 1e-3f);
        albedo(eta, alpha, thickness, x * x, DIRECTION_SAMPLES, &r, &t);
        row[1 + i] = (float)t;
        row[1 + PT_COAT_NODES + i] = (float)r;
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
        build_row(table + PT_COAT_HEADER + i * PT_COAT_ROW, eta, x * x, thickness);
    }
}
