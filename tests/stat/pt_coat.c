/*
 * The factored coated-diffuse model against the random walk it replaces, and the walk against closed forms.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "pt_bsdf_cases.h"

enum { SEED = 4711, WALKS = 40000 };

/* Agreement asked of the albedo below the interface, relative, plus three standard errors of the walk. */
static const double tolerance = 0.015;

static void compare_albedo(float alpha, float eta, float r, float mu)
{
    struct pt_bsdf b = bsdf_coated_diffuse(alpha, eta, r, 0.01f);
    b.reflectance = v3_splat(r);
    struct pt_rng rng = pt_rng_make(SEED);
    pt_vec3 wo = case_direction(mu);
    double factored = 0.0, walk = 0.0, walk2 = 0.0;
    float base_o, base_i, spec, factor = pt_coat_base_factor(&b).x * PT_PI;
    pt_coat_split(&b, mu, &base_o, &spec);
    for (int i = 0; i < WALKS; i++) {
        pt_vec3 wi = pt_sample_cosine(((float)i + 0.5f) / (float)WALKS, pt_rng_float(&rng));
        pt_coat_split(&b, wi.z, &base_i, &spec);
        factored += (double)(factor * base_o * base_i);
        double w = (double)(pt_layer_walk_eval(&b, wo, wi, &rng).x * PT_PI);
        walk += w;
        walk2 += w * w;
    }
    factored /= WALKS;
    walk /= WALKS;
    double error = sqrt(fmax(0.0, walk2 / WALKS - walk * walk) / WALKS);
    if (fabs(factored - walk) > tolerance * walk + 3.0 * error)
        fail_msg("alpha %g eta %g R %g cos %g: factored %g, walk %g ± %g", (double)alpha, (double)eta, (double)r, (double)mu,
                 factored, walk, error);
}

static void factored_coating_agrees_with_the_walk(void **state)
{
    (void)state;
    const float alphas[] = {0.0f, 0.1f, 0.4f, 1.0f}, etas[] = {1.3f, 1.5f}, rs[] = {0.2f, 0.9f}, mus[] = {1.0f, 0.5f, 0.1f};
    for (int a = 0; a < 4; a++)
        for (int e = 0; e < 2; e++)
            for (int r = 0; r < 2; r++)
                for (int m = 0; m < 3; m++)
                    compare_albedo(alphas[a], etas[e], rs[r], mus[m]);
}

/* f at one pair of directions, mean over walk keys. */
static double mean_f(struct pt_bsdf b, pt_vec3 wo, pt_vec3 wi, int keys, double *error)
{
    double sum = 0.0, sum2 = 0.0;
    for (int k = 0; k < keys; k++) {
        float pdf;
        b.walk_key = (uint32_t)k;
        double f = (double)pt_bsdf_eval(PT_FX_ALL, &b, wo, wi, &pdf).x;
        sum += f;
        sum2 += f * f;
    }
    *error = sqrt(fmax(0.0, sum2 / keys - sum * sum / keys / keys) / keys);
    return sum / keys;
}

/* More or fewer interactions than by default: the sum of the base's reflections against the walk. */
static void depth_of_the_layer(void **state)
{
    (void)state;
    static const int events[] = {2, 4, 40};
    double before = 0.0;
    for (int i = 0; i < 3; i++) {
        struct pt_bsdf b = bsdf_coated_diffuse(0.3f, 1.5f, 1.0f, 0.05f), walked;
        b.more_events = events[i] - PT_LAYER_EVENTS;
        walked = b;
        walked.coat_table = NULL;
        pt_vec3 wo = case_direction(0.8f), wi = v3_norm(v3(0.2f, 0.5f, 0.6f));
        double e0, e1, c = mean_f(b, wo, wi, 1, &e0), f = mean_f(walked, wo, wi, 100000, &e1);
        if (fabs(c - f) > 0.01 * c + 4.0 * e1)
            fail_msg("%d events: factored %g, walk %g ± %g", events[i], c, f, e1);
        assert_true(c > 1.1 * before);
        before = c;
    }
}

/* A layer with a faint scattering albedo is nearly a clear one: the two code paths meet. */
static void clear_and_scattering_layers_meet(void **state)
{
    (void)state;
    const float alphas[] = {0.0f, 0.3f};
    for (int a = 0; a < 2; a++) {
        struct pt_bsdf clear = bsdf_coated_diffuse(alphas[a], 1.5f, 0.6f, 0.2f);
        struct pt_bsdf faint = bsdf_scattering_coat(alphas[a], 1e-6f, 0.2f, 0.0f);
        faint.reflectance = clear.reflectance;
        pt_vec3 wo = case_direction(0.8f), wi = v3_norm(v3(0.2f, 0.5f, 0.6f));
        double e0, e1, c = mean_f(clear, wo, wi, 1, &e0), f = mean_f(faint, wo, wi, 100000, &e1);
        if (fabs(c - f) > 0.01 * c + 4.0 * e1)
            fail_msg("alpha %g: clear %g, faint %g ± %g", (double)alphas[a], c, f, e1);
    }
}

/* Smooth interface, rough metal, no second bounce: f = T T f_metal(refracted) / η². The walk must lie above it by no more than
 * the light that the interface sends back, T T F_internal of the order of 5 %. */
static void coated_metal_starts_from_its_first_bounce(void **state)
{
    (void)state;
    struct pt_bsdf b = bsdf_coated_conductor(0.0f, 0.1f);
    b.thickness = 0.0f;
    struct pt_bsdf metal = pt_layer_base(&b);
    pt_vec3 wo = case_direction(0.9f), wi = v3_norm(v3(-0.2f, 0.3f, 0.9f));
    float cos_o, cos_i, pdf, fo = pt_fresnel_dielectric_t(wo.z, b.eta, &cos_o),
                             fi = pt_fresnel_dielectric_t(wi.z, b.eta, &cos_i);
    pt_vec3 inner_o = v3(wo.x / b.eta, wo.y / b.eta, cos_o), inner_i = v3(wi.x / b.eta, wi.y / b.eta, cos_i);
    double first = (double)((1.0f - fo) * (1.0f - fi) / (b.eta * b.eta) *
                            pt_conductor_eval(PT_FX_ALL, &metal, inner_o, inner_i, &pdf).x / inner_i.z * wi.z);
    double error, f = mean_f(b, wo, wi, 100000, &error);
    if (!(f > first - 4.0 * error && f < 1.12 * first + 4.0 * error))
        fail_msg("first bounce %g, walk %g ± %g", first, f, error);
}

/* The closed-form mirror against the sum of its first terms, and its limits. */
static void coated_mirror_is_bounded(void **state)
{
    (void)state;
    struct pt_bsdf b = bsdf_coated_conductor(0.0f, 0.0f);
    b.thickness = 0.0f;
    b.eta_rgb = v3_splat(0.0f); /* lossless metal: everything comes back but the truncated tail */
    b.k_rgb = v3_splat(1.0f);
    for (float mu = 1.0f; mu > 0.05f; mu -= 0.1f) {
        float r = pt_fresnel_dielectric(mu, b.eta), a = pt_coated_mirror(&b, mu).x;
        float tail = (1.0f - r) * powf(r, 5.0f);
        assert_true(fabsf(a + tail - 1.0f) < 1e-4f);
    }
}

/* Rows of a table for textured roughness agree with tables made for one roughness. */
static void blended_rows_agree_with_single_ones(void **state)
{
    (void)state;
    static float many[PT_COAT_HEADER + PT_COAT_TEXTURED_ROWS * PT_COAT_ROW], one[PT_COAT_HEADER + 2 * PT_COAT_ROW];
    pt_coat_table_build(many, PT_COAT_TEXTURED_ROWS, 1.5f, 0.01f, 0.0f, 1.0f);
    assert_int_equal(pt_coat_table_floats(PT_COAT_TEXTURED_ROWS), sizeof many / sizeof many[0]);
    for (float alpha = 0.02f; alpha <= 1.0f; alpha *= 1.7f) {
        pt_coat_table_build(one, 1, 1.5f, 0.01f, alpha, alpha);
        for (float mu = 1.0f; mu > 0.1f; mu -= 0.11f) {
            float a, s, a1, s1;
            pt_coat_lookup(many, alpha, mu, &a, &s);
            pt_coat_lookup(one, alpha, mu, &a1, &s1);
            assert_true(fabsf(a - a1) < 0.02f && fabsf(s - s1) < 0.02f);
        }
        assert_true(fabsf(pt_coat_internal(many, alpha) - pt_coat_internal(one, alpha)) < 0.02f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(factored_coating_agrees_with_the_walk),
        cmocka_unit_test(depth_of_the_layer),
        cmocka_unit_test(clear_and_scattering_layers_meet),
        cmocka_unit_test(coated_metal_starts_from_its_first_bounce),
        cmocka_unit_test(coated_mirror_is_bounded),
        cmocka_unit_test(blended_rows_agree_with_single_ones),
    };
    print_message("seed %d\n", SEED);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
