/*
 * Scattering where floats run out: mirrors that are barely rough, light that barely touches the surface, indices that barely
 * differ, total internal reflection. Nothing may become NaN or infinite, energy may not exceed 1, directions stay unit and on
 * the side that their flags say.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "pt_bsdf_cases.h"

enum { SEED = 31337, SAMPLES = 3000 };

static const float alphas[] = {1e-4f, 1e-3f, 0.01f, 0.1f, 0.5f, 1.0f};
static const float cosines[] = {1.0f, 0.7f, 0.1f, 1e-2f, 1e-4f, 1e-6f, -1e-4f, -0.1f, -0.7f, -1.0f};
static const float etas[] = {1.5f, 1.0001f, 0.9999f, 1.0f, 0.66f, 2.4f, 1.0000001f};

static void check(const struct pt_bsdf *b, const char *what, float p0, float p1, float mu)
{
    struct pt_rng rng = pt_rng_make(SEED);
    pt_vec3 wo = case_direction(mu);
    double sum = 0.0;
    for (int i = 0; i < SAMPLES; i++) {
        struct pt_bsdf_sample s;
        float u = pt_rng_float(&rng), u0 = pt_rng_float(&rng), u1 = pt_rng_float(&rng), pdf;
        if (i < 8) { /* the corners of the cube of random numbers too */
            u = i & 1 ? PT_ONE_BELOW : 0.0f;
            u0 = i & 2 ? PT_ONE_BELOW : 0.0f;
            u1 = i & 4 ? PT_ONE_BELOW : 0.0f;
        }
        if (!pt_bsdf_sample(PT_FX_ALL, b, wo, u, u0, u1, &s))
            continue;
        sum += (double)(v3_max(s.weight) / s.eta_scale);
        int transmits = (s.flags & PT_SCATTER_TRANSMIT) != 0, delta = (s.flags & PT_SCATTER_DELTA) != 0;
        int ok = v3_is_finite(s.weight) && v3_is_finite(s.wi) && isfinite(s.pdf_solid) && s.pdf_solid > 0.0f &&
                 s.weight.x >= 0.0f && s.weight.y >= 0.0f && s.weight.z >= 0.0f && isfinite(s.eta_scale) &&
                 fabsf(v3_dot(s.wi, s.wi) - 1.0f) < 1e-3f && (delta || transmits == (wo.z * s.wi.z < 0.0f));
        pt_vec3 f = pt_bsdf_eval(PT_FX_ALL, b, wo, s.wi, &pdf), other = pt_sample_sphere(u0, u1);
        ok = ok && v3_is_finite(f) && isfinite(pdf) && pdf >= 0.0f && f.x >= 0.0f;
        f = pt_bsdf_eval(PT_FX_ALL, b, wo, other, &pdf);
        ok = ok && v3_is_finite(f) && isfinite(pdf) && pdf >= 0.0f && f.x >= 0.0f &&
             v3_is_finite(pt_bsdf_albedo(PT_FX_ALL, b, wo));
        if (!ok)
            fail_msg("%s %g %g, cos %g: wi %g %g %g weight %g pdf %g flags %u; f %g pdf %g", what, (double)p0, (double)p1,
                     (double)mu, (double)s.wi.x, (double)s.wi.y, (double)s.wi.z, (double)s.weight.x, (double)s.pdf_solid,
                     s.flags, (double)f.x, (double)pdf);
    }
    if (sum / SAMPLES > 1.02)
        fail_msg("%s %g %g, cos %g: albedo %g", what, (double)p0, (double)p1, (double)mu, sum / SAMPLES);
}

enum {
    ALPHAS = sizeof alphas / sizeof alphas[0],
    COSINES = sizeof cosines / sizeof cosines[0],
    ETAS = sizeof etas / sizeof etas[0]
};

static void conductors(void **state)
{
    (void)state;
    for (int a = 0; a < ALPHAS; a++)
        for (int b = 0; b < ALPHAS; b++)
            for (int c = 0; c < COSINES; c++) {
                struct pt_bsdf m = bsdf_conductor(alphas[a], alphas[b]);
                check(&m, "conductor", alphas[a], alphas[b], cosines[c]);
            }
}

static void dielectrics(void **state)
{
    (void)state;
    for (int e = 0; e < ETAS; e++)
        for (int c = 0; c < COSINES; c++) {
            struct pt_bsdf smooth = bsdf_dielectric(0.0f, 0.0f, etas[e]), thin = bsdf_thin(etas[e]);
            check(&smooth, "smooth dielectric", 0.0f, etas[e], cosines[c]);
            check(&thin, "thin dielectric", 0.0f, etas[e], cosines[c]);
            for (int a = 0; a < ALPHAS; a++) {
                struct pt_bsdf rough = bsdf_dielectric(alphas[a], alphas[a], etas[e]);
                check(&rough, "rough dielectric", alphas[a], etas[e], cosines[c]);
            }
        }
}

static void coatings(void **state)
{
    (void)state;
    for (int a = 0; a <= ALPHAS; a++)
        for (int e = 0; e < 2; e++) {
            float alpha = a < ALPHAS ? alphas[a] : 0.0f, eta = e ? 1.0f : 1.5f;
            for (int c = 0; c < COSINES; c++) {
                struct pt_bsdf b = bsdf_coated_diffuse(alpha, eta, 1.0f, 0.01f), m = bsdf_coated_conductor(alpha, 0.0f);
                check(&b, "coated diffuse", alpha, eta, cosines[c]);
                m.eta = eta;
                check(&m, "coated mirror", alpha, eta, cosines[c]);
                m.base_alpha_x = m.base_alpha_y = 0.2f;
                check(&m, "coated metal", alpha, eta, cosines[c]);
            }
        }
}

static void index_matched_glass_is_invisible(void **state)
{
    (void)state;
    for (int c = 0; c < COSINES; c++)
        for (int rough = 0; rough < 2; rough++) {
            struct pt_bsdf b = bsdf_dielectric(rough ? 0.5f : 0.0f, rough ? 0.5f : 0.0f, 1.0f);
            struct pt_bsdf_sample s = {0};
            pt_vec3 wo = case_direction(cosines[c]);
            assert_int_equal(pt_bsdf_sample(PT_FX_ALL, &b, wo, 0.0f, 0.3f, 0.7f, &s), 1);
            assert_true(s.flags == (PT_SCATTER_DELTA | PT_SCATTER_TRANSMIT) && s.weight.x == 1.0f);
            assert_true(fabsf(s.wi.x + wo.x) + fabsf(s.wi.y + wo.y) + fabsf(s.wi.z + wo.z) < 1e-3f);
        }
}

static void total_internal_reflection_reflects_all(void **state)
{
    (void)state;
    struct pt_bsdf b = bsdf_dielectric(0.0f, 0.0f, 1.5f);
    for (float mu = -1e-4f; mu > -0.74f; mu -= 0.01f) { /* the critical cosine is -0.745 */
        struct pt_bsdf_sample s = {0};
        assert_int_equal(pt_bsdf_sample(PT_FX_ALL, &b, case_direction(mu), PT_ONE_BELOW, 0.0f, 0.0f, &s), 1);
        assert_true(s.flags == PT_SCATTER_DELTA && s.weight.x == 1.0f && s.pdf_solid == 1.0f && s.wi.z == mu);
    }
}

/* Exactly along the surface there is nothing to sample. */
static void along_the_surface_nothing_is_sampled(void **state)
{
    (void)state;
    struct pt_bsdf all[] = {bsdf_conductor(0.0f, 0.0f),
                            bsdf_conductor(0.3f, 0.3f),
                            bsdf_dielectric(0.0f, 0.0f, 1.5f),
                            bsdf_thin(1.5f),
                            bsdf_coated_diffuse(0.0f, 1.5f, 1.0f, 0.01f),
                            bsdf_coated_diffuse(0.3f, 1.5f, 1.0f, 0.01f),
                            bsdf_coated_conductor(0.0f, 0.0f),
                            bsdf_coated_conductor(0.3f, 0.2f)};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        struct pt_bsdf_sample s = {0};
        if (pt_bsdf_sample(PT_FX_ALL, &all[i], v3(0.6f, 0.8f, 0.0f), 0.4f, 0.3f, 0.7f, &s))
            fail_msg("model %zu is sampled", i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(conductors),
        cmocka_unit_test(dielectrics),
        cmocka_unit_test(coatings),
        cmocka_unit_test(index_matched_glass_is_invisible),
        cmocka_unit_test(total_internal_reflection_reflects_all),
        cmocka_unit_test(along_the_surface_nothing_is_sampled),
    };
    print_message("seed %d\n", SEED);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
