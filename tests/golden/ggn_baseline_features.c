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

#include "baselines/blas.h"
#include "baselines/features.h"
#include "support/ggn_golden.h"
#include "nn/hash.h"

enum { W = 200, P = W * W };
static uint8_t rgb[3 * P];
static double l[P], scratch[GGN_FEATURE_SCRATCH * P];

static int setup(void **state)
{
    (void)state;
    assert_int_equal(ggn_blas_open(NULL), 0);
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
    assert_int_equal(ggn_svd_entropy(l, W, W, 0, 20, h), 0);
    assert_near(h[0], 0.033944384, 1e-8);
    assert_near(h[1], 0.032175379, 1e-8);
    assert_near(h[99], 0.177310094, 1e-8);
    for (int i = 0; i < 100; i++)
        sum += h[i];
    assert_near(sum / 100, 0.112037071, 1e-8);
    assert_int_equal(ggn_svd_entropy(l, W, W, 5, 20, h), 0);
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
    static const struct {
        int index;
        double mean, deviation;
    } golden[] = {{0, 8.824568150, 5.850814836},
                  {3, 7.920462968, 5.261391390},
                  {9, 9.200309384, 6.720253924},
                  {10, 7.952331544, 5.181926634}};
    ggn_attributes(l, W, W, scratch, a);
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
        assert_int_equal(ggn_svd_entropy(flat, W, W, 0, 20, h), 0);
        for (int i = 0; i < 100; i++)
            assert_near(h[i], 0.0, 1e-12);
        ggn_svd_entropy(flat, W, W, 5, 20, h);
        double most = 0.0;
        for (int i = 0; i < 100; i++)
            most = fmax(most, h[i]);
        printf("# figure rank: entropy up to %.2g\n", most);
        for (int i = 0; i < 100; i++)
            assert_near(h[i], 0.0, 0.0);
        ggn_attributes(flat, W, W, scratch, a);
        ggn_noise_mask(flat, W, W, scratch, mask);
        for (int i = 0; i < GGN_ATTRIBUTES; i++)
            assert_true(isfinite(a[i]));
        for (int i = 0; i < GGN_MASK_FEATURES; i++)
            assert_true(isfinite(mask[i]));
    }
}

/* More noise, larger features. */
static void monotone(void **state)
{
    (void)state;
    static double soft[P];
    double a[GGN_ATTRIBUTES], b[GGN_ATTRIBUTES], ma[GGN_MASK_FEATURES], mb[GGN_MASK_FEATURES];
    for (int i = 0; i < P; i++)
        soft[i] = 50.0 + 0.25 * (l[i] - 50.0);
    ggn_attributes(l, W, W, scratch, a);
    ggn_attributes(soft, W, W, scratch, b);
    for (int i = 0; i < GGN_ATTRIBUTES; i++)
        assert_true(b[i] < a[i]);
    ggn_noise_mask(l, W, W, scratch, ma);
    ggn_noise_mask(soft, W, W, scratch, mb);
    for (int i = 0; i < GGN_MASK_FEATURES / 2; i++)
        assert_near(mb[i], 0.25 * ma[i], 1e-9);
}

/* --- every filter again, pixel by pixel ----------------------------------------------------------------------------------- */

enum { OW = 23, OH = 17, OP = OW * OH };

/* Pixel (x, y): beyond the border the mirror image without the edge itself, or 0. */
static double at(const double *p, int x, int y, int mirror)
{
    if (!mirror && (x < 0 || y < 0 || x >= OW || y >= OH))
        return 0;
    x = abs(x);
    y = abs(y);
    return p[(y < OH ? y : 2 * OH - 2 - y) * OW + (x < OW ? x : 2 * OW - 2 - x)];
}

static int rising(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

enum filter { BOX, GAUSS, MEDIAN };

static void filtered(const double *p, enum filter kind, int r, double sigma, int mirror, double *out)
{
    for (int i = 0; i < OP; i++) {
        double v[25], sum = 0, weights = 0;
        int n = 0;
        for (int dy = -r; dy <= r; dy++)
            for (int dx = -r; dx <= r; dx++) {
                double w = kind == GAUSS ? exp(-(dx * dx + dy * dy) / (2 * sigma * sigma)) : 1;
                v[n] = at(p, i % OW + dx, i / OW + dy, mirror);
                sum += w * v[n++];
                weights += w;
            }
        qsort(v, (size_t)n, sizeof v[0], rising);
        out[i] = kind == MEDIAN ? v[n / 2] : sum / weights;
    }
}

/* mean + (1 - noise / variance) (in - mean) where the variance exceeds the mean variance. */
static void wiener_again(const double *p, int r, double *out)
{
    double square[OP], mean[OP], variance[OP], noise = 0;
    for (int i = 0; i < OP; i++)
        square[i] = p[i] * p[i];
    filtered(p, BOX, r, 0, 0, mean);
    filtered(square, BOX, r, 0, 0, variance);
    for (int i = 0; i < OP; i++) {
        variance[i] -= mean[i] * mean[i];
        noise += variance[i] / OP;
    }
    for (int i = 0; i < OP; i++)
        out[i] = mean[i] + fmax(1 - noise / variance[i], 0) * (p[i] - mean[i]) * (variance[i] > noise);
}

static double soft(double v, double t) { return fabs(v) > t ? v - copysign(t, v) : 0; }

static void haar_again(const double *p, double *out)
{
    static const double sign[4][4] = {{1, 1, 1, 1}, {1, -1, 1, -1}, {1, 1, -1, -1}, {1, -1, -1, 1}};
    double diagonal[OP];
    int n = 0;
    memcpy(out, p, OP * sizeof *out);
    for (int pass = 0; pass < 2; pass++) {
        double t = 0;
        if (pass) {
            qsort(diagonal, (size_t)n, sizeof diagonal[0], rising);
            t = diagonal[n / 2] / 0.6745 * sqrt(2 * log(OP));
        }
        for (int k = 0; k < (OW / 2) * (OH / 2); k++) {
            const int first = k / (OW / 2) * 2 * OW + k % (OW / 2) * 2,
                      places[] = {first, first + 1, first + OW, first + OW + 1};
            double c[4] = {0};
            for (int b = 0; b < 4; b++)
                for (int i = 0; i < 4; i++)
                    c[b] += 0.5 * sign[b][i] * p[places[i]];
            if (!pass)
                diagonal[n++] = fabs(c[3]);
            for (int b = 1; b < 4; b++)
                c[b] = soft(c[b], t);
            for (int i = 0; i < 4 && pass; i++) {
                out[places[i]] = 0;
                for (int b = 0; b < 4; b++)
                    out[places[i]] += 0.5 * sign[b][i] * c[b];
            }
        }
    }
}

static void left_over(const double *p, const double *f, double got[2], const char *what)
{
    double mean = 0, square = 0;
    for (int i = 0; i < OP; i++) {
        mean += fabs(p[i] - f[i]) / OP;
        square += (p[i] - f[i]) * (p[i] - f[i]) / OP;
    }
    if (!(fabs(got[0] - mean) < 1e-9 && fabs(got[1] - sqrt(square - mean * mean)) < 1e-9))
        fail_msg("%s: %.12g, %.12g, not %.12g, %.12g", what, got[0], got[1], mean, sqrt(square - mean * mean));
}

static void cells(const double *p, const double *got)
{
    double smooth[OP];
    filtered(p, GAUSS, 2, 1, 1, smooth);
    for (int cell = 0; cell < 64; cell++) {
        double sum = 0;
        int n = 0;
        for (int i = 0; i < OP; i++)
            if (i % OW >= cell % 8 * OW / 8 && i % OW < (cell % 8 + 1) * OW / 8 && i / OW >= cell / 8 * OH / 8 &&
                i / OW < (cell / 8 + 1) * OH / 8) {
                sum += fabs(p[i] - smooth[i]);
                n++;
            }
        assert_near(got[cell], sum / n, 1e-9);
    }
}

/* All 26 attributes and both noise masks of an image of odd size; smooth parts, edges and sparks. */
static void filters_by_definition(void **state)
{
    (void)state;
    double p[OP], f[OP], a[GGN_ATTRIBUTES], mask[GGN_MASK_FEATURES];
    static const double sigmas[] = {0.5, 1, 1.5};
    for (int i = 0; i < OP; i++)
        p[i] = 40 + 8 * sin(0.4 * (i % OW)) * cos(0.3 * (i / OW)) +
               12 * (ggn_hash_unit((uint32_t)i, 1) - 0.5) * (i / OW > 6) + (i % 53 == 0 ? 40 : 0) + (i % OW > 12 ? 15 : 0);
    ggn_attributes(p, OW, OH, scratch, a);
    for (int r = 1; r <= 2; r++) {
        filtered(p, BOX, r, 0, 1, f);
        left_over(p, f, a + 2 * (r - 1), "box");
        for (int s = 0; s < 3; s++) {
            filtered(p, GAUSS, r, sigmas[s], 1, f);
            left_over(p, f, a + 4 + 6 * (r - 1) + 2 * s, "Gaussian");
        }
        filtered(p, MEDIAN, r, 0, 0, f);
        left_over(p, f, a + 16 + 2 * (r - 1), "median");
        wiener_again(p, r, f);
        left_over(p, f, a + 20 + 2 * (r - 1), "Wiener");
    }
    haar_again(p, f);
    left_over(p, f, a + 24, "wavelet");
    ggn_noise_mask(p, OW, OH, scratch, mask);
    cells(p, mask);
    wiener_again(p, 2, f);
    cells(f, mask + 64);
}

/* L of CIELAB by its formula; sub-blocks row by row, each as if it were alone; intervals and sizes at their ends. */
static void lightness_and_order(void **state)
{
    (void)state;
    enum { BW = 65, BH = 45 };
    static double big[BW * BH], one[400];
    double h[6], alone;
    uint8_t codes[3 * 256];
    double got[256];
    for (int i = 0; i < 256; i++) {
        codes[i] = (uint8_t)i;
        codes[256 + i] = (uint8_t)(255 - i);
        codes[512 + i] = (uint8_t)(i / 2);
    }
    ggn_lightness(codes, 256, got);
    for (int i = 0; i < 256; i++) {
        static const double weight[] = {0.212671, 0.715160, 0.072169};
        double y = 0;
        for (int c = 0; c < 3; c++) {
            double v = codes[256 * c + i] / 255.0;
            y += weight[c] * (v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
        }
        assert_near(got[i], y > 0.008856 ? 116 * cbrt(y) - 16 : 116 * (7.787 * y + 16.0 / 116) - 16, 1e-9);
    }
    static const uint8_t dark[] = {3, 12, 28, 3, 12, 28, 3, 12, 28}; /* where L is a line */
    ggn_lightness(dark, 3, got);
    assert_near(got[0], 903.292 * 3 / 255 / 12.92, 1e-3);
    for (int i = 0; i < BW * BH; i++)
        big[i] = 100 * ggn_hash_unit((uint32_t)i, 3);
    assert_int_equal(ggn_svd_entropy_count(BW, BH), 6);
    assert_int_equal(ggn_svd_entropy(big, BW, BH, 2, 18, h), 0);
    for (int k = 0; k < 6; k++) {
        for (int i = 0; i < 400; i++)
            one[i] = big[(k / 3 * 20 + i / 20) * BW + k % 3 * 20 + i % 20];
        assert_int_equal(ggn_svd_entropy(one, 20, 20, 2, 18, &alone), 0);
        assert_true(alone == h[k] && alone > 0 && alone < 1);
    }
    /* a matrix with singular values 20, 10, 10: entropy of 4/6, 1/6, 1/6, over that of twenty equal ones */
    memset(one, 0, sizeof one);
    one[0] = 20;
    one[21] = one[42] = 10;
    assert_int_equal(ggn_svd_entropy(one, 20, 20, 0, 20, h), 0);
    assert_near(h[0], (log(1.5) * 2 / 3 + log(6) / 3) / log(20), 1e-12);
    assert_int_equal(ggn_svd_entropy(one, 20, 20, 1, 3, h), 0);
    assert_near(h[0], 1, 1e-12);
    assert_int_equal(ggn_svd_entropy(one, 20, 20, 18, 20, h), 0);
    assert_near(h[0], 0, 0);
    ggn_attributes(one, 3, 3, scratch, got);
    ggn_noise_mask(one, 8, 8, scratch, got);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(svd_entropy),
                                       cmocka_unit_test(attributes),
                                       cmocka_unit_test(degenerate),
                                       cmocka_unit_test(monotone),
                                       cmocka_unit_test(filters_by_definition),
                                       cmocka_unit_test(lightness_and_order)};
    return cmocka_run_group_tests_name("baseline_features", tests, setup, NULL);
}
