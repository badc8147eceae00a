/* What is fitted to the answers of a trained network: calibration, threshold, slopes, limits. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdlib.h>

#include "ggn_seqgen.h"
#include "train/fit_policy.h"
#include "data/windows.h"
#include "nn/hash.h"

static void platt_recovers_the_scale(void **state)
{
    enum { N = 4000 };
    static double logit[N], label[N];
    struct ggn_policy policy = ggn_policy_default();

    for (int i = 0; i < N; i++) {
        logit[i] = 12 * ggn_hash_unit((uint32_t)i, 1) - 6;
        label[i] = ggn_hash_unit((uint32_t)i, 2) < 1 / (1 + exp(-(0.5 * logit[i] - 1)));
    }
    ggn_calibrate_platt(logit, label, N, &policy);
    assert_true(fabs(policy.scale - 0.5) < 0.06);
    assert_true(fabs(policy.shift + 1) < 0.15);
    /* one class says nothing */
    struct ggn_policy same = ggn_policy_default();
    for (int i = 0; i < N; i++)
        label[i] = 1;
    ggn_calibrate_platt(logit, label, N, &same);
    assert_true(same.scale == 1 && same.shift == 0);
    (void)state;
}

/* A judge whose logit crosses 0 at the true threshold: no early stop at t = 0.5, and the chosen t stops none early. */
static void the_threshold_respects_the_early_rate(void **state)
{
    struct ggn_series_set set;
    struct ggn_windows w;
    struct ggn_window_options o = {.split = GGN_SPLIT_TRAIN, .length = 6};
    struct ggn_policy policy = ggn_policy_default();
    struct ggn_stopping at, chosen;
    struct base_err err = {0};

    seqgen_load(&set, 0);
    assert_int_equal(ggn_windows_create(&w, &set, &o, &err), 0);
    double *logit = malloc((size_t)w.n * sizeof *logit);
    for (int i = 0; i < w.n; i++)
        logit[i] = -6 * w.list[i].octave;
    policy.first_spp = set.first_spp;
    policy.ratio = set.ratio;
    struct ggn_checks checks;
    assert_int_equal(ggn_checks_create(&checks, &w, logit, &policy, &err), 0);
    at = ggn_calibrate_stopping(&checks, 0.5);
    assert_int_equal(at.blocks, 9);
    assert_true(at.early_rate == 0 && at.samples_ratio >= 1);
    chosen = ggn_calibrate_threshold(&checks, 0, &policy.threshold);
    assert_true(chosen.early_rate == 0);
    assert_true(policy.threshold > 0.05 && policy.threshold < 0.9);
    double slope = ggn_calibrate_slope(&w, logit, &policy);
    assert_true(fabs(slope - 6) < 1e-6);
    ggn_checks_release(&checks);
    free(logit);
    ggn_windows_release(&w);
    ggn_series_set_release(&set);
    (void)state;
}

/* Where the derivatives of −log likelihood + (a − 1)²/2 + b²/200 are zero, in few cases too, where the prior counts. */
static void platt_is_at_the_minimum(void **state)
{
    for (uint32_t n = 2; n < 60; n += 7) {
        double logit[64], label[64], ga, gb;
        struct ggn_policy p = ggn_policy_default();
        for (uint32_t i = 0; i < n; i++) {
            logit[i] = 9 * ggn_hash_unit(i, n) - 3;
            label[i] = i < 2 ? i : ggn_hash_unit(i, n + 1) < 0.3 ? 1 - (logit[i] > 1) : logit[i] > 1;
        }
        ggn_calibrate_platt(logit, label, (int)n, &p);
        ga = p.scale - 1;
        gb = p.shift / 100;
        for (uint32_t i = 0; i < n; i++) {
            double d = 1 / (1 + exp(-(p.scale * logit[i] + p.shift))) - label[i];
            ga += d * logit[i];
            gb += d;
        }
        if (!(fabs(ga) < 1e-8 && fabs(gb) < 1e-8))
            fail_msg("%u cases: derivatives %g and %g at %g, %g", n, ga, gb, p.scale, p.shift);
    }
    /* half a case of each class is the least that says something */
    static const double half[] = {0.5, 0, 0.0}, less[] = {0.49, 0, 0}, all[] = {1, 1, 0.51}, enough[] = {1, 1, 0.5};
    static const double z[] = {2, -2, -1}, inverted[] = {-50, 50, 40};
    static const double first[] = {1, 0, 0};
    struct ggn_policy p = ggn_policy_default();
    ggn_calibrate_platt(z, less, 3, &p);
    assert_true(p.scale == 1 && p.shift == 0);
    ggn_calibrate_platt(z, all, 3, &p);
    assert_true(p.scale == 1 && p.shift == 0);
    ggn_calibrate_platt(inverted, first, 3, &p); /* a network that says the opposite is not turned round */
    assert_true(p.scale == 1 && p.shift == 0);
    ggn_calibrate_platt(z, half, 3, &p);
    assert_true(p.scale != 1 && p.shift != 0);
    p = ggn_policy_default();
    ggn_calibrate_platt(z, enough, 3, &p);
    assert_true(p.scale != 1 && p.shift != 0);
    (void)state;
}

/* The regression of the calibrated logit on octaves, of windows within one of them. */
static void slopes(void **state)
{
    enum { N = 40 };
    struct ggn_window list[N];
    struct ggn_windows w = {.n = N, .list = list};
    struct ggn_policy p = {.scale = 2, .shift = 5};
    double logit[N], mean_x = 0, mean_y = 0, xy = 0, xx = 0;
    int n = 0;

    for (uint32_t i = 0; i < N; i++) {
        list[i] = (struct ggn_window){.octave = i < 2 ? 1 - 2.0 * i : 5 * ggn_hash_unit(i, 1) - 2.5};
        logit[i] = -3 * list[i].octave + ggn_hash_unit(i, 2) + (fabs(list[i].octave) > 1 ? 100 : 0);
        if (fabs(list[i].octave) <= 1) {
            mean_x += list[i].octave;
            mean_y += 2 * logit[i] + 5;
            n++;
        }
    }
    mean_x /= n;
    mean_y /= n;
    for (int i = 0; i < N; i++)
        if (fabs(list[i].octave) <= 1) {
            xy += (list[i].octave - mean_x) * (2 * logit[i] + 5 - mean_y);
            xx += (list[i].octave - mean_x) * (list[i].octave - mean_x);
        }
    assert_true(fabs(ggn_calibrate_slope(&w, logit, &p) + xy / xx) < 1e-9);
    for (int i = 0; i < N; i++)
        logit[i] = -logit[i];
    assert_true(ggn_calibrate_slope(&w, logit, &p) == 0); /* more samples, more noise: nothing to predict from */
    w.n = 1;
    assert_true(ggn_calibrate_slope(&w, logit, &p) == 0);
    (void)state;
}

/* Three blocks with made-up p, and one without windows: every figure by hand. */
static void stopping_by_hand(void **state)
{
    static double spp[] = {10, 20, 40, 80};
    struct ggn_level_series series[4];
    /* the third stops at no level at 0.5; the second never */
    struct ggn_seen seen[16] = {{.p = 0.9}, {.p = 0.4}, {.p = 0.3}, {.p = 0.05}, {.p = 0.6}, {.p = 0.6},
                                {.p = 0.7}, {.p = 0.6}, {.p = 0},   {.p = 0},    {.p = 0},   {.p = 0},
                                {.p = 0.6}, {.p = 0.6}, {.p = 0.2}, {.p = 0.1}};
    static const double truth[] = {25, 200, 30, 30};
    int first[] = {0, 1, 2, 2, 3};
    double error[4];
    struct ggn_stopping got;

    for (int c = 0; c < 4; c++)
        series[c] = (struct ggn_level_series){.n_levels = 4, .spp = spp, .label.threshold = truth[c]};
    struct ggn_series_set set = {.n = 4, .series = series};
    struct ggn_windows w = {.set = &set, .n = 3, .first = first};
    struct ggn_checks checks = {.windows = &w, .policy = ggn_policy_default(), .seen = seen, .error = error};
    got = ggn_calibrate_stopping(&checks, 0.5);
    /* stops at 20, 200 (past the end, seen until its threshold) and 40: log2 0.322 (not early at 0.8 of it), 0, 0.415 */
    assert_int_equal(got.blocks, 3);
    assert_true(got.early_rate == 0 && fabs(got.samples_ratio - 260.0 / 255) < 1e-12);
    assert_true(fabs(got.median_abs_log2 - log2(25.0 / 20)) < 1e-12);
    assert_true(fabs(got.mean_abs_log2 - (log2(25.0 / 20) + log2(40.0 / 30)) / 3) < 1e-12);
    series[0].label.threshold = 25.1; /* now 20 is early */
    series[1].label.threshold = 50;   /* and the end of the recording late */
    got = ggn_calibrate_stopping(&checks, 0.5);
    assert_true(got.early_rate == 1.0 / 3 && fabs(got.samples_ratio - 140.0 / 105.1) < 1e-12);
    checks.policy.passes = 2;
    got = ggn_calibrate_stopping(&checks, 0.5); /* 40, never, 80 */
    assert_true(got.early_rate == 0 && fabs(got.samples_ratio - 200.0 / 105.1) < 1e-12);
    /* one pass below 0.5 is right for the first and too early for none of the others: the best that is allowed */
    series[0].label.threshold = 20;
    series[1].label.threshold = 80;
    series[3].label.threshold = 40;
    struct ggn_policy p = ggn_policy_default();
    checks.policy.passes = 1;
    got = ggn_calibrate_threshold(&checks, 0, &p.threshold);
    assert_true(p.threshold == 0.41 && got.mean_abs_log2 == 0 && got.samples_ratio == 1); /* p < t, not p <= t */
    series[0].label.threshold = 50; /* 40 is four fifths of it, which is not early */
    got = ggn_calibrate_threshold(&checks, 0, &p.threshold);
    assert_true(p.threshold == 0.31 && fabs(got.mean_abs_log2 - log2(1.25) / 3) < 1e-12);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(platt_recovers_the_scale), cmocka_unit_test(the_threshold_respects_the_early_rate),
        cmocka_unit_test(platt_is_at_the_minimum),  cmocka_unit_test(slopes),
        cmocka_unit_test(stopping_by_hand),
    };
    return cmocka_run_group_tests(tests, seqgen_make, seqgen_remove);
}
