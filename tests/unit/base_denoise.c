/*
 * What a denoised picture gains by the noisy one, from two halves, and the blend: against the truth, which is known here, with
 * denoisers whose errors are known.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "denoise/blend.h"
#include "support/splitmix.h"

enum { W = 160, H = 120, N = W * H };

static float a[N], b[N], fa[N], fb[N], maps[5][N], scratch[N], alpha[N], apart[N];
static const struct lull_estimate estimate = {maps[0], maps[1], maps[2], maps[3], maps[4]};
static const float *const gain = maps[0], *const moved = maps[2], *const agreed = maps[3], *const noisy = maps[4];
static uint64_t state;

static double mean(const float *map)
{
    double sum = 0;
    for (int i = 0; i < N; i++)
        sum += (double)map[i] / N;
    return sum;
}

/* Square of the slope of L* at the luminance y, by differences. */
static double unit(double y)
{
    double slope = 116 * (cbrt(y + 1e-6) - cbrt(y - 1e-6)) / 2e-6;
    return slope * slope;
}

/* Halves of a flat picture, a share of the samples in the first; sigma is the deviation of the mean of all. */
static void halves(double truth, double sigma, double share)
{
    state = 7;
    for (int i = 0; i < N; i++) {
        a[i] = (float)(truth + sigma / sqrt(share) * splitmix_gauss(&state));
        b[i] = (float)(truth + sigma / sqrt(1 - share) * splitmix_gauss(&state));
    }
}

static void measure(double share)
{
    struct lull_estimate_in in = {a, b, fa, fb, a, b, share};
    lull_estimate_pixels(&in, N, &estimate);
}

#define assert_within(value, expected, tolerance) \
    do { \
        double got_ = (value), want_ = (expected), most_ = (tolerance); \
        if (!(fabs(got_ - want_) <= most_)) \
            fail_msg("%s = %g, expected %g within %g", #value, got_, want_, most_); \
    } while (0)

/* A denoiser that does nothing keeps the noise, of which the noisy picture takes nothing away. */
static void identity_has_the_noise(void **unused)
{
    (void)unused;
    static const double shares[] = {0.5, 0.25};
    for (int k = 0; k < 2; k++) {
        const double sigma = 0.004, noise = sigma * sigma * unit(0.4);
        halves(0.4, sigma, shares[k]);
        memcpy(fa, a, sizeof a);
        memcpy(fb, b, sizeof b);
        measure(shares[k]);
        assert_within(mean(noisy), noise, 0.03 * noise);
        if (k == 0) {
            assert_within(mean(gain), 0, 0.001 * noise);
            assert_within(mean(moved), 0, 0.001 * noise);
            assert_within(mean(agreed), noise, 0.03 * noise);
        }
    }
}

/* One that always says the same is wrong by its bias, on which the halves agree, however strong the noise. */
static void bias_is_seen_and_noise_is_not(void **unused)
{
    (void)unused;
    static const double biases[] = {0, 0.01, 0.05};
    for (size_t k = 0; k < 3; k++) {
        const double sigma = 0.03, truth = 0.4, bias = biases[k], scale = unit(truth + bias), want = bias * bias * scale;
        halves(truth, sigma, 0.5);
        for (int i = 0; i < N; i++)
            fa[i] = fb[i] = (float)(truth + bias);
        measure(0.5);
        /* (f - b)^2 has the deviation 2 bias s + sqrt(2) s^2 with s = sqrt(2) sigma; three standard errors of the mean */
        const double s = sqrt(2) * sigma, deviation = (2 * bias * s + 1.5 * s * s) * scale;
        assert_within(mean(gain), want, 3 * deviation / sqrt(N));
        assert_within(mean(moved), want + sigma * sigma * scale, 3 * deviation / sqrt(N));
        assert_within(mean(agreed), 0, 0);
    }
}

/* A mean of 2x1 pixels of stripes: known bias, and half the noise is left, which the noisy picture shares. */
static void blur_has_both(void **unused)
{
    (void)unused;
    const double sigma = 0.01, truth = 0.4, stripe = 0.006;
    halves(truth, sigma, 0.5);
    for (int i = 0; i < N; i++) {
        a[i] += (float)(i % 2 ? stripe : -stripe);
        b[i] += (float)(i % 2 ? stripe : -stripe);
    }
    for (int i = 0; i < N; i += 2) {
        fa[i] = fa[i + 1] = 0.5f * (a[i] + a[i + 1]);
        fb[i] = fb[i + 1] = 0.5f * (b[i] + b[i + 1]);
    }
    measure(0.5);
    const double bias = stripe * stripe * unit(truth), noise = sigma * sigma / 2 * unit(truth);
    assert_within(mean(gain), bias, 0.06 * (bias + noise));
    assert_within(mean(moved), bias + noise, 0.06 * (bias + noise));
    assert_within(mean(agreed), noise, 0.06 * noise);
}

static void average(const float *from, float *to)
{
    for (int i = 0; i < N; i++) {
        double sum = 0;
        for (int k = 0; k < 25; k++)
            sum += (double)from[(i / W + k / 5 + H - 2) % H * W + (i % W + k % 5 + W - 2) % W];
        to[i] = (float)(sum / 25);
    }
}

/* A denoiser that averages 5x5 pixels of a flat picture leaves a 25th of the noise, and no share of the noisy picture makes it
 * less: none is kept, although the error is not 0. */
static void averaging_needs_no_noise(void **unused)
{
    (void)unused;
    enum { PICTURES = 32 };
    const double truth = 0.4, sigma = 0.01, square = sigma * sigma * unit(truth);
    double found = 0, kept = 0;
    state = 7;
    for (int k = 0; k < PICTURES; k++) {
        for (int i = 0; i < N; i++) {
            a[i] = (float)(truth + sigma * sqrt(2) * splitmix_gauss(&state));
            b[i] = (float)(truth + sigma * sqrt(2) * splitmix_gauss(&state));
        }
        average(a, fa);
        average(b, fb);
        measure(0.5);
        found += mean(gain) / PICTURES;
        assert_within(mean(agreed), square / 25, 0.1 * square / 25);
        lull_blend_weights(&estimate, W, H, scratch, alpha, apart);
        kept += mean(alpha) / PICTURES;
    }
    assert_within(found, 0, 3 * 3 * square / sqrt(N * PICTURES)); /* a third of what the error is */
    assert_true(kept < 0.015);
}

/* The larger error gets the smaller weight, by the local errors; the estimate's own noise gets none; and no weight leaves
 * [0, 1]. */
static void weights_follow_the_errors(void **unused)
{
    (void)unused;
    const double sigma = 0.01;
    halves(0.4, sigma, 0.5);
    for (int i = 0; i < N; i++)
        fa[i] = fb[i] = i % W < W / 2 ? 0.4f : 0.5f; /* right on the left, ten deviations off on the right */
    measure(0.5);
    lull_blend_weights(&estimate, W, H, scratch, alpha, apart);
    double left = 0, right = 0;
    for (int i = 0; i < N; i++) {
        assert_true(alpha[i] >= 0 && alpha[i] <= 1);
        if (i % W < W / 2 - 15)
            left += alpha[i] / (H * (W / 2.0 - 15));
        else if (i % W >= W / 2 + 15)
            right += alpha[i] / (H * (W / 2.0 - 15));
    }
    assert_true(left < 0.02);
    assert_within(right, 100.0 / 101, 0.005);
}

/* Of two denoised pictures, each right in one half of the frame, the one that is right is taken; where both are the same, none. */
static void the_better_of_two(void **unused)
{
    (void)unused;
    static float xa[N], xb[N];
    const double sigma = 0.01, truth = 0.4, wrong = 0.02;
    halves(truth, sigma, 0.5);
    for (int i = 0; i < N; i++) {
        const int left = i % W<W / 2, below = i / W> H / 2;
        fa[i] = fb[i] = (float)(truth + (below || left ? 0 : wrong));
        xa[i] = xb[i] = (float)(truth + (below || !left ? 0 : wrong));
    }
    const struct lull_estimate_in in = {a, b, fa, fb, xa, xb, 0.5};
    lull_estimate_pixels(&in, N, &estimate);
    lull_blend_shares(&estimate, W, H, scratch, alpha);
    for (int i = 0; i < N; i++) {
        const int x = i % W, y = i / W;
        if (y > H / 2 + 13)
            assert_true(alpha[i] == 0);
        else if (y < H / 2 - 13 && x < W / 2 - 13)
            assert_true(alpha[i] < 0.2f);
        else if (y < H / 2 - 13 && x > W / 2 + 13)
            assert_true(alpha[i] > 0.8f);
    }
    float mixed[] = {1, 2, 3, 4, 5, 6}, by[] = {3, 2, 1, 0, 0, 0};
    static const float shares[] = {0.5f, 0};
    lull_blend_mix(by, shares, 2, mixed);
    static const float want[] = {2, 2, 2, 4, 5, 6};
    for (int i = 0; i < 6; i++)
        assert_true(mixed[i] == want[i]);
}

/* A denoiser that smears a thin line and nothing else: what it is wrong by is far from even, but certain, and the noisy
 * picture is kept there. */
static void a_smeared_line_is_kept(void **unused)
{
    (void)unused;
    const double sigma = 0.01;
    halves(0.4, sigma, 0.5);
    for (int i = 0; i < N; i++) {
        const int line = i % W == W / 2;
        a[i] += line ? 0.2f : 0.0f;
        b[i] += line ? 0.2f : 0.0f;
        fa[i] = fb[i] = 0.4f;
    }
    measure(0.5);
    lull_blend_weights(&estimate, W, H, scratch, alpha, apart);
    for (int y = 15; y < H - 15; y++)
        assert_true(alpha[y * W + W / 2] > 0.9f && alpha[y * W + W / 4] < 0.2f);
}

static void mixture(void **unused)
{
    (void)unused;
    float noise[] = {1, 2, 3, NAN, 4, INFINITY}, denoised[] = {0, 0, 1, 5, 0, 7}, w[] = {0.5f, 0.25f};
    lull_blend(noise, denoised, w, 2, noise);
    static const float want[] = {0.5f, 1, 2, 5, 1, 7};
    for (int i = 0; i < 6; i++)
        assert_true(noise[i] == want[i]);
}

/* Values of 10^6 and more, black, one hot pixel, pictures of one pixel and of one line: finite, and nothing written beside. */
static void extremes(void **unused)
{
    (void)unused;
    static const float values[] = {0, 1e-30f, 1, 1e6f, 1e30f, 3e38f};
    static const int sides[][2] = {{1, 1}, {15, 15}, {1, 40}, {40, 1}};
    for (size_t v = 0; v < 12; v++)
        for (size_t s = 0; s < 4; s++) {
            const int w = sides[s][0], h = sides[s][1], n = w * h;
            for (int i = 0; i < N; i++) {
                a[i] = b[i] = i % 3 ? values[v % 6] : 0;
                fa[i] = fb[i] = v < 6 ? a[i] : 0; /* and a denoiser that sees black */
            }
            a[n / 2] = 3e38f;
            memset(alpha, 7, sizeof alpha);
            struct lull_estimate_in in = {a, b, fa, fb, a, b, 0.5};
            lull_estimate_pixels(&in, (size_t)n, &estimate);
            lull_blend_weights(&estimate, w, h, scratch, alpha, apart);
            for (int i = 0; i < n; i++)
                assert_true(alpha[i] >= 0 && alpha[i] <= 1);
            assert_true(alpha[n] > 1e-35f && alpha[n] < 1e-33f); /* bytes of 7 */
        }
}

/* Adds the mean square error of the blend by `weight`, as crossing its halves with the others finds it, and the true one. */
static void cross(double truth, const float *weight, double sums[2])
{
    for (int i = 0; i < N; i++) {
        const double w = (double)weight[i], x = (double)a[i], y = (double)b[i];
        const double p = w * x + (1 - w) * (double)fa[i], q = w * y + (1 - w) * (double)fb[i], kept = (p + q) / 2;
        sums[0] += (pow(p - y, 2) + pow(q - x, 2) - pow(x - y, 2)) / 2 - pow(p - q, 2) / 4;
        sums[1] += pow(kept - truth, 2);
    }
}

/* A denoiser whose error is somewhat smaller than the noise, in patches of one sign: weights chosen by a pixel's own samples
 * find too little of it, those of its neighbourhood find it. Crossed squares of 16 pictures scatter by 0.02 of the sum. */
static void cross_validated_weights_are_no_flattery(void **unused)
{
    (void)unused;
    enum { PICTURES = 16 };
    static float blind[N], around[2 * N], one[1], rest[2];
    const double truth = 0.4, sigma = 0.02;
    double own[2] = {0}, others[2] = {0};
    state = 7;
    for (int k = 0; k < PICTURES; k++) {
        for (int i = 0; i < N; i++) {
            a[i] = (float)(truth + sigma * sqrt(2) * splitmix_gauss(&state));
            b[i] = (float)(truth + sigma * sqrt(2) * splitmix_gauss(&state));
            fa[i] = fb[i] = (float)(truth + sigma * sin(i % W * 0.4) * sin(i / W * 0.4));
        }
        measure(0.5);
        lull_blend_weights_cross_validated(&estimate, W, H, around, blind);
        lull_blend_weights(&estimate, W, H, scratch, alpha, apart);
        cross(truth, alpha, own);
        cross(truth, blind, others);
    }
    print_message("crossed over true: %.2f by own weights, %.2f cross-validated\n", own[0] / own[1], others[0] / others[1]);
    assert_within(others[0] / others[1], 1, 0.08);
    assert_true(own[0] < 0.9 * own[1]);
    lull_blend_weights_cross_validated(&(struct lull_estimate){one, one, one, one, one}, 1, 1, rest, blind);
    assert_true(blind[0] == 0);
}

/* Where the denoiser is wrong and the noisy picture is kept, its specks are not. */
static void specks_are_left_out(void **unused)
{
    (void)unused;
    const int at = 60 * W + 80;
    halves(0.4, 0.01, 0.5);
    for (int i = 0; i < N; i++)
        fa[i] = fb[i] = 0.43f;
    a[at] = 1.0f;
    measure(0.5);
    lull_blend_weights(&estimate, W, H, scratch, alpha, apart);
    assert_true(alpha[at + 30] > 0.8f && alpha[at] < 0.4f && alpha[at + 1] > 1.5f * alpha[at]);
}

/* A bright pixel in one denoised half, such as a denoiser keeps on an edge, is brought down; what both show is not, and not
 * where the halves are as far apart all around. */
static void specks_of_the_denoised(void **unused)
{
    (void)unused;
    const int at = 60 * W + 80;
    for (int i = 0; i < N; i++)
        a[i] = b[i] = fa[i] = fb[i] = i % W < 80 ? 0.1f : 0.4f;
    fb[at] = 0.9f;                    /* in one half */
    fa[at + 40] = fb[at + 40] = 0.9f; /* in both */
    for (int i = 20 * W; i < 40 * W; i++)
        fa[i] += i % 2 ? 0.02f : -0.02f;
    measure(0.5);
    lull_blend_weights(&estimate, W, H, scratch, alpha, apart);
    for (int i = 0; i < N; i++)
        assert_true(i == at ? apart[i] < 0.45f : apart[i] == 1.0f);
    float bright[] = {0.1f, 0.9f, 0.4f}, dark[] = {0.2f, 0.1f, 0.4f};
    static const float half = 0.5f, want[] = {0.15f, 0.5f, 0.4f};
    lull_blend_despeckle(&half, 1, bright, dark);
    assert_within(dark[0], want[0], 1e-6);
    assert_within(bright[1], want[1], 1e-6);
    assert_true(bright[0] == 0.1f && dark[1] == 0.1f && bright[2] == 0.4f && dark[2] == 0.4f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(identity_has_the_noise),
        cmocka_unit_test(bias_is_seen_and_noise_is_not),
        cmocka_unit_test(blur_has_both),
        cmocka_unit_test(averaging_needs_no_noise),
        cmocka_unit_test(weights_follow_the_errors),
        cmocka_unit_test(the_better_of_two),
        cmocka_unit_test(a_smeared_line_is_kept),
        cmocka_unit_test(mixture),
        cmocka_unit_test(extremes),
        cmocka_unit_test(cross_validated_weights_are_no_flattery),
        cmocka_unit_test(specks_are_left_out),
        cmocka_unit_test(specks_of_the_denoised),
    };
    return cmocka_run_group_tests_name("denoise", tests, NULL, NULL);
}
