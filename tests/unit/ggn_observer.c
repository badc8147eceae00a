/* The model observer: pooling, masking, thresholds from curves, halves against rendered levels, calibration on made-up people. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "observer/calibrate.h"

enum { W = 48, H = 40, P = W * H };

static const uint32_t levels[] = {20, 30, 45, 68, 101, 152, 228, 342, 513, 769, 1153, 1730, 2595, 3892, 5839, 8758};
enum { LEVELS = sizeof levels / sizeof levels[0] };

static struct ggn_seq_block make_block(double sigma, double texture, uint32_t seed, uint32_t reference_spp)
{
    struct ggn_noise n = {W, H, levels, LEVELS, reference_spp, sigma, texture, seed};
    return ggn_noise_block(&n);
}

static const struct ggn_observer lightness = {GGN_MAP_LIGHTNESS, 1.0, 0.2, 5, 99.0, 1.5, 0.25};

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static void pooling(void **state)
{
    (void)state;
    static float map[P], deviation[P], scratch[P], sorted[P];
    for (uint32_t seed = 0; seed < 40; seed++) {
        for (uint32_t i = 0; i < P; i++) {
            map[i] = (float)(ggn_noise_hash(i, seed) % (seed % 4 == 0 ? 3 : 100000));
            deviation[i] = (float)(ggn_noise_hash(i, seed + 1000) % 10);
            sorted[i] = map[i] / (1.0f + 0.25f * deviation[i]);
        }
        qsort(sorted, P, sizeof *sorted, ascending);
        for (double q = 1.0; q <= 100.0; q += 16.5)
            assert_near(ggn_observer_pool(map, deviation, P, 0.25, q, scratch), (double)sorted[(int)ceil(q / 100 * P) - 1], 0);
    }
    assert_near(ggn_observer_pool(map, deviation, 1, 0, 50, scratch), (double)map[0], 0);
}

static void masking(void **state)
{
    (void)state;
    static uint8_t flat[3 * P], checks[3 * P], noisy[3 * P];
    static float map[P], deviation[P];
    memset(flat, 128, sizeof flat);
    ggn_observer_deviation(flat, W, H, 5, deviation, NULL);
    for (int i = 0; i < P; i++)
        assert_near((double)deviation[i], 0, 0.02);
    for (int i = 0; i < P; i++)
        memset(checks + 3 * i, (i % W + i / W) % 2 ? 0 : 255, 3);
    ggn_observer_deviation(checks, W, H, 3, deviation, NULL);
    assert_near((double)deviation[10 * W + 10], 100.0 * sqrt(20.0 / 81.0), 0.1); /* 4 or 5 of 9 pixels at L* = 100 */
    /* A lightness difference of one pixel is spread by the blur, its sum kept. */
    memcpy(noisy, flat, sizeof flat);
    memset(noisy + 3 * (20 * W + 24), 148, 3);
    for (double blur = 0.0; blur < 2.0; blur += 1.0) {
        double sum = 0.0;
        ggn_observer_error_map(GGN_MAP_LIGHTNESS, blur, flat, noisy, W, H, map, NULL);
        for (int i = 0; i < P; i++)
            sum += (double)map[i];
        assert_near(sum, 7.735, 0.01); /* L* of grey 148 less that of 128 */
        assert_true(blur == 0.0 ? sum == (double)map[20 * W + 24] : (double)map[20 * W + 24] < 0.2 * sum);
    }
}

static void thresholds(void **state)
{
    (void)state;
    double spp[] = {100, 200, 400, 800}, falling[] = {8, 4, 2, 1}, bumpy[] = {1, 0.5, 4, 1}, zero[] = {8, 0, 0, 0};
    struct ggn_curve c = {4, spp, falling};
    int censored;
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 400, 1e-9);
    assert_near(ggn_curve_threshold(&c, sqrt(8.0), &censored), 200 * sqrt(2.0), 1e-9);
    assert_false(censored);
    assert_near(ggn_curve_threshold(&c, 0.5, &censored), 800, 0);
    assert_true(censored);
    assert_near(ggn_curve_threshold(&c, 10, &censored), 100, 0);
    assert_false(censored);
    c.score = bumpy; /* below at first, visible again at 400: it must stay below */
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 400 * sqrt(2.0), 1e-9);
    c.score = zero;
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 100 * sqrt(2.0), 1e-9);
    c.score = falling;
    assert_near(ggn_curve_at(&c, 283), 4 * pow(0.5, log2(283.0 / 200)), 1e-9);
    assert_near(ggn_curve_at(&c, 1), 8, 0);
    assert_near(ggn_curve_at(&c, 1e9), 1, 0);
}

static double threshold_of(const struct ggn_seq_block *b, const struct ggn_observer *o, enum ggn_observer_source source)
{
    struct ggn_curve c;
    struct base_err err = {0};
    int censored;
    if (ggn_observer_curve(o, b, source, 1, &c, &err) != 0)
        fail_msg("%s", err.text);
    double t = ggn_curve_threshold(&c, o->tau, &censored);
    assert_false(censored);
    ggn_curve_release(&c);
    return t;
}

/* Noise that is sigma/sqrt(n) crosses a fixed visibility at n ~ sigma^2, from either source; masking lowers it. */
static void scaling(void **state)
{
    (void)state;
    struct ggn_observer o = lightness;
    o.percentile = 80; /* a high one rests on a handful of pixels of so small a block */
    o.tau = 0.8;
    double last = 0.0;
    for (int i = 0; i < 3; i++) {
        double sigma = 0.4 * pow(2.0, i);
        struct ggn_seq_block b = make_block(sigma, 0.0, (uint32_t)i + 1, 2048);
        double rendered = threshold_of(&b, &o, GGN_SOURCE_RENDERED), halves = threshold_of(&b, &o, GGN_SOURCE_HALVES);
        assert_near(log2(halves / rendered), 0.0, 0.4); /* one realisation of noise each, some 150 independent spots */
        if (i > 0)
            assert_near(log2(rendered / last), 2.0, 0.6); /* twice the noise: four times the samples */
        last = rendered;
        ggn_seq_block_release(&b);
    }
    struct ggn_seq_block busy = make_block(1.6, 0.1, 3, 2048);
    assert_true(threshold_of(&busy, &o, GGN_SOURCE_RENDERED) < 0.5 * last);
    ggn_seq_block_release(&busy);
}

/* A reference of few samples must not raise the threshold: its own noise is taken out of the difference. */
static void noisy_reference(void **state)
{
    (void)state;
    struct ggn_observer o = lightness;
    o.masking = 0.0;
    o.percentile = 80;
    o.tau = 0.4;
    struct ggn_seq_block good = make_block(0.9, 0.0, 5, 1000000), poor = make_block(0.9, 0.0, 5, 1024);
    double a = threshold_of(&good, &o, GGN_SOURCE_RENDERED), b = threshold_of(&poor, &o, GGN_SOURCE_RENDERED);
    assert_true(a > 1024);
    assert_near(log2(b / a), 0.0, 0.15);
    ggn_seq_block_release(&good);
    ggn_seq_block_release(&poor);
}

/* Halves without a reference: the mean's own noise must not mask, texture must. */
static void halves_alone(void **state)
{
    (void)state;
    struct ggn_observer o = lightness;
    o.percentile = 80;
    o.tau = 0.6;
    o.masking = 0.3;
    for (int i = 0; i < 2; i++) {
        double texture = 0.06 * i;
        struct ggn_seq_block with = make_block(0.9, texture, 8, 1000000), without = make_block(0.9, texture, 8, 0);
        double a = threshold_of(&with, &o, GGN_SOURCE_HALVES), b = threshold_of(&without, &o, GGN_SOURCE_HALVES);
        assert_near(log2(b / a), 0.0, 0.25); /* 1.4 octaves too low when the noise is left in */
        ggn_seq_block_release(&with);
        ggn_seq_block_release(&without);
    }
}

/* Recorded to 342 spp only, a threshold beyond is found where the full recording puts it. */
static void beyond_the_last_level(void **state)
{
    (void)state;
    struct ggn_observer o = lightness;
    o.percentile = 80;
    o.tau = 0.5;
    struct ggn_noise n = {W, H, levels, LEVELS, 4096, 0.9, 0.0, 6}, few = {W, H, levels, 8, 4096, 0.9, 0.0, 6};
    struct ggn_seq_block all = ggn_noise_block(&n), head = ggn_noise_block(&few);
    double a = threshold_of(&all, &o, GGN_SOURCE_RENDERED), b = threshold_of(&head, &o, GGN_SOURCE_AUTO);
    assert_true(a > 500);
    assert_near(log2(b / a), 0.0, 0.4);
    assert_true(ggn_stimuli_extend(&head, 1) && !ggn_stimuli_extend(&head, 0));
    ggn_seq_block_release(&all);
    ggn_seq_block_release(&head);
}

static void calibration(void **state)
{
    (void)state;
    enum { N = 6 };
    struct ggn_seq_block pixels[N];
    struct ggn_calibration_block blocks[N];
    struct ggn_calibration c;
    struct base_err err = {0};
    /* Made-up people: an observer of the family with a tau of its own. */
    struct ggn_observer person = {GGN_MAP_LIGHTNESS, 1.0, 0.3, 5, 99.0, 2.0, 0.25};
    for (int i = 0; i < N; i++) {
        pixels[i] = make_block(0.2 + 0.08 * i, i % 2 ? 0.06 : 0.0, 20 + (uint32_t)i, 4096);
        blocks[i] = (struct ggn_calibration_block){&pixels[i], 1, threshold_of(&pixels[i], &person, GGN_SOURCE_RENDERED)};
    }
    struct base_threads *threads = base_threads_create(2, NULL);
    if (ggn_observer_calibrate(blocks, N, GGN_SOURCE_RENDERED, threads, &c, &err) != 0)
        fail_msg("%s", err.text);
    assert_true(c.n == N && c.median_abs_log2 < 0.05 && c.nested_mean_abs_log2 < 0.25 && c.loo_mean_abs_log2 < 0.1);
    assert_true(c.observer.masking > 0.0); /* without masking the textured blocks would be wrong */
    /* What was found predicts a block it has not seen. */
    struct ggn_seq_block fresh = make_block(0.45, 0.06, 31, 4096);
    assert_near(log2(threshold_of(&fresh, &c.observer, GGN_SOURCE_RENDERED) / threshold_of(&fresh, &person, GGN_SOURCE_RENDERED)), 0.0, 0.3);
    ggn_seq_block_release(&fresh);
    ggn_calibration_release(&c);
    assert_int_equal(ggn_observer_calibrate(blocks, 2, GGN_SOURCE_RENDERED, threads, &c, &err), BASE_EINVAL);
    base_threads_destroy(threads);
    for (int i = 0; i < N; i++)
        ggn_seq_block_release(&pixels[i]);
}

static void parameters(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_observer.XXXXXX";
    struct ggn_observer o = {GGN_MAP_FLIP, 0.7, 0.1, 9, 95, 0.031, 0.4}, back;
    struct base_err err = {0};
    close(mkstemp(path));
    assert_int_equal(ggn_observer_write(path, &o, "{\"blocks\": 3}", &err), 0);
    if (ggn_observer_read(path, &back, &err) != 0)
        fail_msg("%s", err.text);
    assert_true(back.map == o.map && back.window_px == 9);
    assert_near(back.tau, o.tau, 1e-9);
    assert_near(back.spread, o.spread, 1e-9);
    FILE *f = fopen(path, "w");
    fputs("{\"map\": \"eye\"}", f);
    fclose(f);
    assert_int_equal(ggn_observer_read(path, &back, &err), BASE_EINVAL);
    unlink(path);
}

/* The file beside the code says what the code has built in. */
static void built_in(void **state)
{
    (void)state;
    struct ggn_observer o;
    struct base_err err = {0};
    if (ggn_observer_read("ggn/observer/observer.json", &o, &err) != 0)
        fail_msg("%s", err.text);
    assert_true(o.map == ggn_observer_default.map && o.window_px == ggn_observer_default.window_px);
    assert_near(o.tau, ggn_observer_default.tau, 1e-6);
    assert_near(o.masking, ggn_observer_default.masking, 1e-6);
    assert_near(o.percentile, ggn_observer_default.percentile, 1e-6);
    assert_near(o.spread, ggn_observer_default.spread, 1e-6);
}

static void trials(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_trials.XXXXXX";
    FILE *f = fdopen(mkstemp(path), "w");
    for (uint32_t i = 0; i < 800; i++) { /* four blocks, spread of half an octave */
        double level = 5.0 * exp2(6.0 * (ggn_noise_hash(i, 1) / 4294967296.0));
        double x = log2(20.0 * level), t = 8.5 + 0.4 * (i % 4);
        fprintf(f, "%u.0;%.1f;%d\n", i % 4, level, x + 0.5 * ggn_noise_gauss(i, 3) < t);
    }
    fputs("0.0;1.0;05.0;6.0;1\n0.0;0.0;0\n", f);
    fclose(f);
    double spread;
    int blocks, n, skipped;
    assert_int_equal(ggn_trials_spread(path, &spread, &blocks, &n, &skipped, NULL), 0);
    assert_true(blocks == 4 && n == 800 && skipped == 2);
    assert_near(spread, 0.5, 0.12);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pooling), cmocka_unit_test(masking), cmocka_unit_test(thresholds), cmocka_unit_test(scaling),
        cmocka_unit_test(noisy_reference), cmocka_unit_test(halves_alone), cmocka_unit_test(beyond_the_last_level), cmocka_unit_test(calibration), cmocka_unit_test(parameters), cmocka_unit_test(built_in), cmocka_unit_test(trials),
    };
    return cmocka_run_group_tests_name("observer", tests, NULL, NULL);
}
