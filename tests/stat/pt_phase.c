/* The phase function: samples follow it, it integrates to 1, its mean cosine is g. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "sample/rng.h"
#include "pt_chi2.h"
#include "shade/phase_function.h"

enum { SEED = 77, SAMPLES = 400000 };

static const double significance = 0.01;

struct phase {
    float g;
    pt_vec3 wo;
};
static float phase_pdf(const void *data, pt_vec3 wi)
{
    const struct phase *p = data;
    return pt_phase_eval(p->g, p->wo, wi);
}

static void samples_follow_the_phase_function(void **state)
{
    (void)state;
    const float gs[] = {-0.9f, -0.3f, 0.0f, 1e-4f, 0.05f, 0.6f, 0.9f};
    enum { N = sizeof gs / sizeof gs[0] };
    double limit = 1.0 - pow(1.0 - significance, 1.0 / N);
    static struct chi2 c;
    for (int i = 0; i < N; i++) {
        struct phase data = {gs[i], v3_norm(v3(0.3f, -0.5f, 0.2f))};
        struct pt_rng rng = pt_rng_make((uint64_t)(SEED + i));
        double cosine = 0.0;
        c = (struct chi2){.samples = SAMPLES};
        chi2_expect(&c, phase_pdf, &data);
        for (int s = 0; s < SAMPLES; s++) {
            pt_vec3 wi;
            float u0 = pt_rng_float(&rng), u1 = pt_rng_float(&rng), pdf = pt_phase_sample(gs[i], data.wo, u0, u1, &wi);
            assert_true(fabsf(pdf - pt_phase_eval(gs[i], data.wo, wi)) <= 1e-4f * pdf);
            assert_true(fabsf(v3_dot(wi, wi) - 1.0f) < 1e-4f);
            c.observed[chi2_cell(wi)] += 1.0;
            cosine -= (double)v3_dot(wi, data.wo);
        }
        double p = chi2_p_value(&c), mass = chi2_mass(&c);
        if (p < limit || fabs(mass - 1.0) > 2e-3 || fabs(cosine / SAMPLES - (double)gs[i]) > 5.0 / sqrt(SAMPLES))
            fail_msg("g %g: p %g, integral %g, mean cosine %g", (double)gs[i], p, mass, cosine / SAMPLES);
    }
}

static void extreme_asymmetry_stays_finite(void **state)
{
    (void)state;
    const float gs[] = {-1.0f, -0.999f, 0.999f, 1.0f, 5.0f};
    for (int i = 0; i < 5; i++)
        for (int k = 0; k <= 100; k++) {
            pt_vec3 wi, wo = v3(0.0f, 0.0f, k & 1 ? -1.0f : 1.0f);
            float u = fminf((float)k / 100.0f, PT_ONE_BELOW), pdf = pt_phase_sample(gs[i], wo, u, u, &wi);
            assert_true(isfinite(pdf) && pdf > 0.0f && v3_is_finite(wi));
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_follow_the_phase_function),
        cmocka_unit_test(extreme_asymmetry_stays_finite),
    };
    print_message("seed %d\n", SEED);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
