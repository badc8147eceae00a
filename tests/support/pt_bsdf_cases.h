/*
 * The scattering models that the statistical tests run over, each with several parameters.
 */
#ifndef PT_BSDF_CASES_H
#define PT_BSDF_CASES_H

#include "sample/rng.h"
#include "shade/bsdf_dispatch.h"
#include "support/pt_sphere.h"

struct bsdf_case {
    const char *name;
    struct pt_bsdf b;
};

enum { COAT_FLOATS = PT_COAT_HEADER + PT_COAT_ROW };
enum { COAT_TABLES = 16 };

/* Tables of the coated cases, made on first use; tests are single-threaded. */
static inline const float *case_table(float eta, float alpha, float thickness)
{
    static float tables[COAT_TABLES][COAT_FLOATS];
    static struct {
        float eta, alpha, thickness;
    } keys[COAT_TABLES];
    static int count;
    for (int i = 0; i < count; i++)
        if (keys[i].eta == eta && keys[i].alpha == alpha && keys[i].thickness == thickness)
            return tables[i];
    if (count == COAT_TABLES)
        return NULL;
    pt_coat_table_build(tables[count], 1, eta, thickness, alpha, alpha);
    keys[count].eta = eta;
    keys[count].alpha = alpha;
    keys[count].thickness = thickness;
    return tables[count++];
}

static inline struct pt_bsdf bsdf_diffuse(float r)
{
    return (struct pt_bsdf){.kind = PT_BSDF_DIFFUSE, .reflectance = v3(r, 0.5f * r, 0.25f * r)};
}
static inline struct pt_bsdf bsdf_conductor(float ax, float ay)
{
    /* gold, roughly */
    return (struct pt_bsdf){.kind = PT_BSDF_CONDUCTOR,
                            .alpha_x = ax,
                            .alpha_y = ay,
                            .eta_rgb = v3(0.14f, 0.37f, 1.44f),
                            .k_rgb = v3(3.98f, 2.39f, 1.60f)};
}
/* Reflects everything. */
static inline struct pt_bsdf bsdf_lossless_conductor(float alpha)
{
    return (struct pt_bsdf){.kind = PT_BSDF_CONDUCTOR, .alpha_x = alpha, .alpha_y = alpha, .k_rgb = v3_splat(1.0f)};
}
static inline struct pt_bsdf bsdf_dielectric(float ax, float ay, float eta)
{
    return (struct pt_bsdf){.kind = PT_BSDF_DIELECTRIC, .alpha_x = ax, .alpha_y = ay, .eta = eta};
}
static inline struct pt_bsdf bsdf_thin(float eta) { return (struct pt_bsdf){.kind = PT_BSDF_THIN_DIELECTRIC, .eta = eta}; }
static inline struct pt_bsdf bsdf_diffuse_transmission(float r, float t)
{
    return (struct pt_bsdf){
        .kind = PT_BSDF_DIFFUSE_TRANSMISSION, .reflectance = v3(r, 0.5f * r, r), .transmittance = v3_splat(t)};
}
static inline struct pt_bsdf bsdf_coated_diffuse(float alpha, float eta, float r, float thickness)
{
    return (struct pt_bsdf){.kind = PT_BSDF_COATED_DIFFUSE,
                            .alpha_x = alpha,
                            .alpha_y = alpha,
                            .eta = eta,
                            .reflectance = v3(r, 0.5f * r, 0.1f * r),
                            .thickness = thickness,
                            .coat_table = case_table(eta, alpha, thickness)};
}
static inline struct pt_bsdf bsdf_coated_conductor(float alpha, float base_alpha)
{
    struct pt_bsdf b = bsdf_conductor(alpha, alpha);
    b.kind = PT_BSDF_COATED_CONDUCTOR;
    b.eta = 1.5f;
    b.base_alpha_x = b.base_alpha_y = base_alpha;
    b.thickness = 0.01f;
    return b;
}
static inline struct pt_bsdf bsdf_scattering_coat(float alpha, float albedo, float thickness, float g)
{
    struct pt_bsdf b = bsdf_coated_diffuse(alpha, 1.5f, 0.5f, thickness);
    b.albedo = v3_splat(albedo);
    b.g = g;
    return b;
}

enum { CASES_MAX = 32 };

/* Fills c[CASES_MAX]; how many. A model without a row here fails stat/pt_bsdf.c. */
static inline int all_cases(struct bsdf_case *c)
{
    int n = 0;
#define CASE(...) c[n++] = (struct bsdf_case){#__VA_ARGS__, __VA_ARGS__}
    CASE(bsdf_diffuse(0.8f));
    CASE(bsdf_diffuse_transmission(0.3f, 0.6f));
    CASE(bsdf_diffuse_transmission(0.0f, 0.6f));
    CASE(bsdf_conductor(0.15f, 0.15f));
    CASE(bsdf_conductor(0.5f, 0.5f));
    CASE(bsdf_conductor(1.0f, 1.0f));
    CASE(bsdf_conductor(0.15f, 0.6f));
    CASE(bsdf_conductor(0.0f, 0.0f));
    CASE(bsdf_lossless_conductor(0.3f));
    CASE(bsdf_dielectric(0.2f, 0.2f, 1.5f));
    CASE(bsdf_dielectric(0.7f, 0.3f, 1.33f));
    CASE(bsdf_dielectric(0.4f, 0.4f, 0.7f));
    CASE(bsdf_dielectric(0.3f, 0.3f, 1.0f));
    CASE(bsdf_dielectric(0.0f, 0.0f, 1.5f));
    CASE(bsdf_dielectric(0.0f, 0.0f, 0.6f));
    CASE(bsdf_thin(1.5f));
    CASE(bsdf_coated_diffuse(0.0f, 1.5f, 0.8f, 0.01f));
    CASE(bsdf_coated_diffuse(0.2f, 1.5f, 0.8f, 0.01f));
    CASE(bsdf_coated_diffuse(0.8f, 1.9f, 0.3f, 0.0f));
    CASE(bsdf_coated_conductor(0.0f, 0.2f));
    CASE(bsdf_coated_conductor(0.3f, 0.2f));
    CASE(bsdf_coated_conductor(0.3f, 0.0f));
    CASE(bsdf_coated_conductor(0.0f, 0.0f));
    CASE(bsdf_scattering_coat(0.2f, 0.9f, 0.5f, 0.3f));
#undef CASE
    return n;
}

/* Coatings that only the walk can evaluate: their value is one estimate of many. */
static inline int bsdf_is_walked(const struct pt_bsdf *b)
{
    return b->kind == PT_BSDF_COATED_CONDUCTOR || (b->kind == PT_BSDF_COATED_DIFFUSE && !v3_is_black(b->albedo));
}

/* Unit vector with cosine mu, not in a coordinate plane. */
static inline pt_vec3 case_direction(float mu)
{
    float r = sqrtf(fmaxf(0.0f, 1.0f - mu * mu));
    return v3(r * 0.8f, r * -0.6f, mu);
}

#endif
