/* Features of the published baselines: the golden figures of ggn-network.md, and inputs that must not give NaN. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"

#include "baselines/features.h"
#include "model/golden.h"

enum { W = 200, P = W * W };
static uint8_t rgb[3 * P];
static double l[P], scratch[GGN_FEATURE_SCRATCH * P];

static int setup(void **state)
{
    (void)state;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < P; i++)
            rgb[c * P + i] = (uint8_t)floor(255.0 * ggn_golden_pixel(0, 0, c, i / W, i % W) + 0.5);
    ggn_lightness(rgb, P, l);
    return 0;
}

static void svd_entropy(void **state)
{
    (void)state;
    double h[100], sum = 0.0;
    assert_int_equal(ggn_svd_entropy_count(W, W), 100);
    assert_int_equal(ggn_svd_entropy(l, W, W, 0, 20, h, NULL), 0);
    assert_near(h[0], 0.033944384, 1e-8);
    assert_near(h[1], 0.032175379, 1e-8);
    assert_near(h[99], 0.177310094, 1e-8);
    for (int i = 0; i < 100; i++)
        sum += h[i];
    assert_near(sum / 100, 0.112037071, 1e-8);
    assert_int_equal(ggn_svd_entropy(l, W, W, 5, 20, h, NULL), 0);
    sum = 0.0;
    for (int i = 0; i < 100; i++)
        sum += h[i];
    assert_near(h[0], 0.813464817, 1e-8);
    assert_near(h[99], 0.830205007, 1e-8);
    assert_near(sum / 100, 0.827861021, 1e-8);
}

static void attributes(void **state)
{
    (void)state;
    double a[GGN_ATTRIBUTES];
    static const struct { int index; double mean, deviation; } golden[] = {
        {0, 8.824568150, 5.850814836}, {3, 7.920462968, 5.261391390}, {9, 9.200309384, 6.720253924}, {10, 7.952331544, 5.181926634}};
    assert_int_equal(ggn_attributes(l, W, W, scratch, a, NULL), 0);
    for (size_t i = 0; i < 4; i++) { /* box 3; Gaussian 3 with sigma 1; median 5; Wiener 3 */
        assert_near(a[2 * golden[i].index], golden[i].mean, 1e-6);
        assert_near(a[2 * golden[i].index + 1], golden[i].deviation, 1e-6);
    }
    for (int i = 0; i < GGN_ATTRIBUTES; i++)
        assert_true(isfinite(a[i]) && a[i] > 0.0);
}

/* Constant, rank-deficient and black images have no noise: zeros, never NaN. */
static void degenerate(void **state)
{
    (void)state;
    static double flat[P];
    double h[100], a[GGN_ATTRIBUTES], mask[GGN_MASK_FEATURES];
    for (int kind = 0; kind < 3; kind++) {
        for (int i = 0; i < P; i++)
            flat[i] = kind == 0 ? 0.0 : kind == 1 ? 50.0 : (double)(i % W) / 4.0; /* black, grey, rank one */
        assert_int_equal(ggn_svd_entropy(flat, W, W, 0, 20, h, NULL), 0);
        for (int i = 0; i < 100; i++)
            assert_near(h[i], 0.0, 1e-12);
        ggn_svd_entropy(flat, W, W, 5, 20, h, NULL);
        double most = 0.0;
        for (int i = 0; i < 100; i++)
            most = fmax(most, h[i]);
        printf("# figure rank: entropy up to %.2g\n", most);
        for (int i = 0; i < 100; i++)
            assert_near(h[i], 0.0, 0.0);
        assert_int_equal(ggn_attributes(flat, W, W, scratch, a, NULL), 0);
        assert_int_equal(ggn_noise_mask(flat, W, W, scratch, mask, NULL), 0);
        for (int i = 0; i < GGN_ATTRIBUTES; i++)
            assert_true(isfinite(a[i]));
        for (int i = 0; i < GGN_MASK_FEATURES; i++)
            assert_true(isfinite(mask[i]));
    }
    assert_int_equal(ggn_svd_entropy(flat, 19, W, 0, 20, h, NULL), BASE_EINVAL);
    assert_int_equal(ggn_attributes(flat, 2, 2, scratch, a, NULL), BASE_EINVAL);
    assert_int_equal(ggn_noise_mask(flat, 7, 9, scratch, mask, NULL), BASE_EINVAL);
}

/* More noise, larger features. */
static void monotone(void **state)
{
    (void)state;
    static double soft[P];
    double a[GGN_ATTRIBUTES], b[GGN_ATTRIBUTES], ma[GGN_MASK_FEATURES], mb[GGN_MASK_FEATURES];
    for (int i = 0; i < P; i++)
        soft[i] = 50.0 + 0.25 * (l[i] - 50.0);
    ggn_attributes(l, W, W, scratch, a, NULL);
    ggn_attributes(soft, W, W, scratch, b, NULL);
    for (int i = 0; i < GGN_ATTRIBUTES; i++)
        assert_true(b[i] < a[i]);
    ggn_noise_mask(l, W, W, scratch, ma, NULL);
    ggn_noise_mask(soft, W, W, scratch, mb, NULL);
    for (int i = 0; i < GGN_MASK_FEATURES / 2; i++)
        assert_near(mb[i], 0.25 * ma[i], 1e-9);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(svd_entropy), cmocka_unit_test(attributes), cmocka_unit_test(degenerate), cmocka_unit_test(monotone)};
    return cmocka_run_group_tests_name("baseline_features", tests, setup, NULL);
}
