/* Spectra to RGB: white stays white, black bodies have their known colours, metals their known reflectance. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <math.h>
#include <string.h>

#include <cmocka.h>

#include "pbrt/spectra.h"

/* The analytic curves are within 1 % of the tabulated ones in chromaticity (Wyman et al. 2013, table 1). */
static const double curve_tolerance = 0.006;

static void chromaticity(pt_vec3 c, double *x, double *y)
{
    double X = 0.4124564 * (double)c.x + 0.3575761 * (double)c.y + 0.1804375 * (double)c.z;
    double Y = 0.2126729 * (double)c.x + 0.7151522 * (double)c.y + 0.0721750 * (double)c.z;
    double Z = 0.0193339 * (double)c.x + 0.1191920 * (double)c.y + 0.9503041 * (double)c.z;
    *x = X / (X + Y + Z);
    *y = Y / (X + Y + Z);
}

static void white_reflectance(void **state)
{
    (void)state;
    struct pt_spd spd;
    for (int i = 0; i <= 4; i++) {
        pt_spd_constant(i / 4.0, &spd);
        pt_vec3 c = pt_spd_reflectance_rgb(&spd);
        assert_true(fabsf(c.x - (float)i / 4) < 1e-5f && fabsf(c.y - (float)i / 4) < 1e-5f &&
                    fabsf(c.z - (float)i / 4) < 1e-5f);
    }
    const double red[] = {600, 0, 610, 1};
    pt_spd_from_pairs(red, 2, 1, &spd);
    pt_vec3 c = pt_spd_reflectance_rgb(&spd);
    assert_true(c.x > 0.7f && c.y < 0.1f && c.z < 0.05f);
}

/* Planckian locus: CIE 15 / Wyszecki and Stiles. */
static void black_bodies(void **state)
{
    (void)state;
    static const double known[][3] = {
        {2856, 0.4476, 0.4074}, {4000, 0.3805, 0.3768}, {6500, 0.3135, 0.3237}, {10000, 0.2807, 0.2884}};
    for (int i = 0; i < 4; i++) {
        struct pt_spd spd;
        double x, y;
        pt_spd_blackbody(known[i][0], &spd);
        chromaticity(pt_spd_emission_rgb(&spd), &x, &y);
        assert_true(fabs(x - known[i][1]) < curve_tolerance && fabs(y - known[i][2]) < curve_tolerance);
        for (int k = 0; k < PT_SPD_COUNT; k++)
            assert_true(spd.v[k] > 0 && spd.v[k] <= 1.0 + 1e-12);
    }
}

static float fresnel(float n, float k) { return ((n - 1) * (n - 1) + k * k) / ((n + 1) * (n + 1) + k * k); }

/* Reflectances at normal incidence as tables of metals give them: silver is white, gold and copper are not. */
static void metals(void **state)
{
    (void)state;
    struct pt_spd eta, k;
    pt_vec3 n, kk;
    static const char *const names[][2] = {{"metal-Ag-eta", "metal-Ag-k"},
                                           {"metal-Au-eta", "metal-Au-k"},
                                           {"metal-Cu-eta", "metal-Cu-k"},
                                           {"metal-Al-eta", "metal-Al-k"}};
    static const float r[][3] = {
        {0.97f, 0.96f, 0.93f}, {0.9999f, 0.78f, 0.33f}, {0.955f, 0.64f, 0.54f}, {0.91f, 0.92f, 0.92f}};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(pt_spd_named(names[i][0], &eta), 1);
        assert_int_equal(pt_spd_named(names[i][1], &k), 1);
        pt_spd_conductor_rgb(&eta, &k, &n, &kk);
        const float f[3] = {fresnel(n.x, kk.x), fresnel(n.y, kk.y), fresnel(n.z, kk.z)};
        for (int c = 0; c < 3; c++)
            if (fabsf(f[c] - r[i][c]) > 0.035f)
                fail_msg("%s channel %d: %g, expected about %g", names[i][0], c, (double)f[c], (double)r[i][c]);
    }
    assert_int_equal(pt_spd_named("metal-Xx-eta", &eta), 0);
    assert_int_equal(pt_spd_named("metal-Cu-foo", &eta), 0);
    assert_int_equal(pt_spd_named("metal-", &eta), 0);
}

/* Oxides absorb nothing: where the reflectance is below what the mean index alone gives, k is 0 and the index follows from it. */
static void what_absorbs_nothing(void **state)
{
    (void)state;
    struct pt_spd eta, k;
    pt_vec3 n, kk;
    assert_true(pt_spd_named("metal-MgO-eta", &eta) && pt_spd_named("metal-MgO-k", &k));
    for (int i = 0; i < PT_SPD_COUNT; i++)
        assert_true(k.v[i] == 0 && eta.v[i] > 1.7 && eta.v[i] < 1.8);
    pt_spd_conductor_rgb(&eta, &k, &n, &kk);
    assert_true(kk.x == 0 && kk.y == 0 && kk.z < 0.05f);
    const float root = (n.x - 1) / (n.x + 1);
    struct pt_spd f0;
    for (int i = 0; i < PT_SPD_COUNT; i++)
        f0.v[i] = pow((eta.v[i] - 1) / (eta.v[i] + 1), 2);
    assert_true(fabsf(root * root - pt_spd_reflectance_rgb(&f0).x) < 1e-6f);
    assert_true(pt_spd_named("metal-TiO2-eta", &eta) && fabs(eta.v[42] - 2.6124) < 1e-4); /* Devore at 590 nm */
}

static void lists(void **state)
{
    (void)state;
    const double pairs[] = {400, 1, 500, 3};
    struct pt_spd spd;
    pt_spd_from_pairs(pairs, 2, 0, &spd);
    assert_true(spd.v[0] == 0 && spd.v[3] == 0 && fabs(spd.v[14] - 2) < 1e-12 && spd.v[25] == 0);
    assert_true(fabs(spd.v[4] - 0.5 * 1.025) < 1e-12 && fabs(spd.v[24] - 0.5 * 2.975) < 1e-12); /* half of their steps */
    pt_spd_from_pairs(pairs, 2, 1, &spd);
    assert_true(spd.v[0] == 1 && spd.v[PT_SPD_COUNT - 1] == 3);
    const double one[] = {550, 7};
    pt_spd_from_pairs(one, 1, 1, &spd);
    assert_true(spd.v[0] == 7 && spd.v[80] == 7);
}

/* A laser, a discharge lamp: what lies between the steps of a spectrum counts by its area. */
static void narrow_lines_keep_their_light(void **state)
{
    (void)state;
    for (double nm = 500; nm < 505; nm += 0.37)
        for (double width = 0.01; width < 30; width *= 2) {
            const double line[] = {nm - width, 0, nm, 7, nm + width, 0};
            struct pt_spd spd;
            double area = 0, moment = 0;
            pt_spd_from_pairs(line, 3, 0, &spd);
            for (int i = 0; i < PT_SPD_COUNT; i++) {
                area += spd.v[i] * PT_SPD_STEP_NM;
                moment += spd.v[i] * PT_SPD_STEP_NM * (PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM);
            }
            assert_true(fabs(area - 7 * width) < 1e-9);
            assert_true(fabs(moment / area - nm) < 0.5 * PT_SPD_STEP_NM); /* it is where it was, to a step */
        }
}

static void colour_spaces(void **state)
{
    (void)state;
    for (int space = 0; space < 4; space++) {
        pt_vec3 white = pt_colour_to_rec709(space, v3_splat(1));
        assert_true(fabsf(white.x - 1) < 1e-3f && fabsf(white.y - 1) < 1e-3f && fabsf(white.z - 1) < 1e-3f);
    }
    assert_int_equal(pt_colour_space_named("rec2020"), PT_COLOUR_REC2020);
    assert_int_equal(pt_colour_space_named("cmyk"), -1);
    pt_vec3 a;
    assert_int_equal(pt_illuminant_named("stdillum-D65", &a), 1);
    assert_true(fabsf(v3_luminance(a) - 1) < 1e-3f && fabsf(a.x - 1) < 0.01f && fabsf(a.z - 1) < 0.01f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(white_reflectance),
                                       cmocka_unit_test(black_bodies),
                                       cmocka_unit_test(metals),
                                       cmocka_unit_test(lists),
                                       cmocka_unit_test(narrow_lines_keep_their_light),
                                       cmocka_unit_test(what_absorbs_nothing),
                                       cmocka_unit_test(colour_spaces)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
