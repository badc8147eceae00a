/* The phase function: samples follow it, it integrates to 1, its mean cosine is g. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "base/pi.h"
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

/* As far as 1 - |g| is float's: 4e-4 of it; an angle has its 2e-7 where the peak is 1e-4 wide. */
static const double PEAK_ERROR = 0.02;

/* Henyey and Greenstein 1941 in double, by what is left of 1 - cos from the direction that g prefers. */
static double henyey_greenstein(double a, double away)
{
    return (1 - a * a) / (4 * BASE_PI * pow((1 - a) * (1 - a) + 2 * a * away, 1.5));
}

static double away_from(pt_vec3 peak, pt_vec3 wi)
{
    double x = (double)wi.x - (double)peak.x, y = (double)wi.y - (double)peak.y, z = (double)wi.z - (double)peak.z;
    return 0.5 * (x * x + y * y + z * z);
}

/* Up to the largest g that a scene may name, values and samples are those of the closed form. */
static void strong_asymmetry_keeps_its_peak(void **state)
{
    (void)state;
    const float gs[] = {0.5f, 0.99f, 0.999f, 0.9995f, 0.9999f};
    const pt_vec3 wo = v3_norm(v3(0.3f, -0.5f, 0.2f));
    for (int i = 0; i < 10; i++) {
        const float g = i & 1 ? -gs[i / 2] : gs[i / 2];
        const double a = (double)fabsf(g);
        const pt_vec3 peak = g > 0 ? v3_neg(wo) : wo;
        for (int k = 1; k < 64; k++) {
            /* u: the share of samples closer to the peak; whence q, and 1 - cos by the inverse of their distribution */
            double u = k / 64.0, q = (1 - a * a) / (1 + a - 2 * a * u), away = (q - 1 + a) * (q + 1 - a) / (2 * a);
            pt_vec3 wi;
            float pdf = pt_phase_sample(g, wo, g > 0 ? (float)u : (float)(1 - u), (float)k / 64.0f, &wi);
            double want = henyey_greenstein(a, away), at = away_from(peak, wi);
            if (!(fabs((double)pdf - want) < PEAK_ERROR * want) || !(fabs(at - away) < PEAK_ERROR * away))
                fail_msg("g %g, u %g: pdf %g, not %g; 1 - cos %g, not %g", (double)g, u, (double)pdf, want, at, away);
        }
        for (int k = 0; k <= 100; k++) {
            pt_vec3 wi;
            float end = fminf((float)k / 100.0f, PT_ONE_BELOW), pdf = pt_phase_sample(g, wo, end, end, &wi);
            assert_true(isfinite(pdf) && pdf > 0.0f && v3_is_finite(wi));
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(samples_follow_the_phase_function),
        cmocka_unit_test(strong_asymmetry_keeps_its_peak),
    };
    print_message("seed %d\n", SEED);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
