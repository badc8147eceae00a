/*
 * The trainer's parts: synthetic levels, windows and their labels, folding, calibration. `--write-demo DIR` makes the data set of
 * `make train-demo` instead.
 */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/files.h"
#include "ggn_noise.h"
#include "ggn_seqgen.h"
#include "sequence/manifest.h"
#include "sequence/simulate.h"
#include "nn/exec.h"
#include "train/fit_policy.h"
#include "train/session.h"
#include "train/start.h"
#include "data/windows.h"
#include "nn/hash.h"

static char dir[64];

static void load(struct ggn_series_set *set, double ratio)
{
    struct ggn_series_set_options o = {.dir = dir, .ratio = ratio};
    struct base_err err = {0};

    if (ggn_series_set_load(set, &o, &err))
        fail_msg("%s", err.text);
}

static void splits_and_levels(void **state)
{
    struct ggn_series_set set, thin;

    load(&set, 0);
    assert_int_equal(set.n, 12);
    assert_int_equal(ggn_series_set_count(&set, GGN_SPLIT_TRAIN, 1), 9);
    assert_int_equal(ggn_series_set_count(&set, GGN_SPLIT_VALIDATION, 1), 3);
    assert_int_equal(set.n_scenes, 4);
    assert_int_equal(set.series[0].n_levels, 14);
    assert_true(fabs(set.ratio - 1.35) < 0.02);
    load(&thin, 1.7);
    assert_int_equal(thin.series[0].n_levels, 7);
    ggn_series_set_release(&set);
    ggn_series_set_release(&thin);
    (void)state;
}

/* Noise of a synthetic level against the reference: as large as that of a rendered level at the same samples. */
static void synthetic_noise_has_the_variance_of_rendered_noise(void **state)
{
    struct ggn_series_set set;
    struct base_err err = {0};
    double ratio_sum = 0;
    int compared = 0;

    load(&set, 0);
    assert_int_equal(ggn_series_set_add_synthetic(&set, 1, 3, &err), 0);
    assert_int_equal(set.n, 21);
    size_t values = ggn_series_set_values(&set);
    for (int i = 12; i < set.n; i++) {
        const struct ggn_level_series *c = &set.series[i], *measured = NULL;
        for (int k = 0; k < 12; k++)
            if (set.series[k].view == c->view && set.series[k].block == c->block)
                measured = &set.series[k];
        assert_non_null(measured);
        assert_true(c->synthetic && c->label.threshold == measured->label.threshold);
        double e[2] = {0, 0};
        for (size_t v = 0; v < values; v++) {
            double r = measured->noisy[4 * values + v] - c->reference[v], s = c->noisy[4 * values + v] - c->reference[v];
            e[0] += r * r * measured->spp[4];
            e[1] += s * s * c->spp[4];
        }
        ratio_sum += e[1] / e[0];
        compared++;
    }
    assert_true(fabs(ratio_sum / compared - 1) < 0.1);
    ggn_series_set_release(&set);
    (void)state;
}

/* Continued levels: rising, and their noise goes on falling as 1/n. */
static void extended_levels_continue_the_recording(void **state)
{
    struct ggn_series_set set;
    struct base_err err = {0};
    double sum = 0;
    int extended = 0;

    load(&set, 0);
    size_t values = ggn_series_set_values(&set);
    for (int i = 0; i < set.n; i++)
        set.series[i].label.threshold = i ? 400 : 30;
    assert_int_equal(ggn_series_set_extend(&set, 3, &err), 0);
    assert_int_equal(set.series[0].n_levels, 14);
    for (int i = 1; i < set.n; i++) {
        const struct ggn_level_series *c = &set.series[i];
        assert_true(c->n_levels > 17 && c->spp[14] > c->spp[13] && c->spp[c->n_levels - 1] > 1800);
        assert_true(isnan(c->tail999[14]));
        double e[2] = {0, 0};
        for (size_t v = 0; v < values; v++) {
            /* a level and the next share samples: so do their errors */
            double a = c->noisy[13 * values + v] - c->noisy[12 * values + v],
                   b = c->noisy[14 * values + v] - c->noisy[13 * values + v];
            e[0] += a * a / (1 / c->spp[12] - 1 / c->spp[13]);
            e[1] += b * b / (1 / c->spp[13] - 1 / c->spp[14]);
        }
        sum += e[1] / e[0];
        extended++;
    }
    assert_true(fabs(sum / extended - 1) < 0.2);
    ggn_series_set_release(&set);
    (void)state;
}

/* Levels made anew: evenly spaced from the first to the end of what is looked at, reference or not, their noise against the
 * mean of the halves as large as the samples say. */
static void simulated_levels_lie_as_far_apart_as_asked(void **state)
{
    struct ggn_series_set set;
    struct base_err err = {0};
    const double wanted[] = {1.05, 1.5};

    for (int t = 0; t < 2; t++) {
        load(&set, 0);
        const double first = set.series[0].spp[0];
        const size_t values = ggn_series_set_values(&set);
        assert_int_equal(ggn_series_set_simulate(&set, wanted[t], 3, &err), 0);
        for (int i = 0; i < set.n; i++) {
            const struct ggn_level_series *c = &set.series[i];
            const int end = c->n_levels - 1;
            double low = 0, high = 0;
            int half = 0;
            assert_true(c->simulated && c->spp[0] == first && c->spp[end] <= SEQ_SIMULATED_CAP &&
                        c->spp[end] * wanted[t] > SEQ_SIMULATED_CAP && isnan(c->tail999[0]));
            for (int k = 1; k < end; k++)
                assert_true(c->spp[k] == fmax(c->spp[k - 1] + 1, floor(c->spp[k - 1] * wanted[t] + 0.5)));
            while (c->spp[half] < 100)
                half++;
            for (size_t v = 0; v < values; v++) {
                double a = c->noisy[v] - c->noisy[(size_t)end * values + v];
                double b = c->noisy[(size_t)half * values + v] - c->noisy[(size_t)end * values + v];
                low += a * a * c->spp[0];
                high += b * b * c->spp[half];
            }
            assert_true(fabs(high / low - 1) < 0.35); /* eight bits, and noise that is cut off at black and white */
        }
        assert_true(set.ratio == wanted[t] && set.step_spp == 0);
        ggn_series_set_release(&set);
    }
    (void)state;
}

static void windows_are_labelled_by_their_last_image(void **state)
{
    struct ggn_series_set set;
    struct ggn_windows w, published;
    struct ggn_window_options o = {.split = GGN_SPLIT_TRAIN, .length = 6, .soft = 1};
    struct base_err err = {0};
    int drawn[2] = {0, 0};

    load(&set, 0);
    assert_int_equal(ggn_windows_create(&w, &set, &o, &err), 0);
    o.label_first = 1;
    assert_int_equal(ggn_windows_create(&published, &set, &o, &err), 0);
    assert_int_equal(w.n, 9 * (14 - 5));
    int later = 0;
    for (int i = 0; i < w.n; i++) {
        const struct ggn_level_series *c = &set.series[w.list[i].series];
        assert_int_equal(w.list[i].noisy, c->spp[w.list[i].last] < c->label.threshold);
        assert_true(fabs(w.list[i].label - w.list[i].noisy) <= 0.5);
        later += published.list[i].noisy && !w.list[i].noisy;
    }
    assert_true(later > 0);
    for (int i = 0; i < 400; i++) {
        int a = ggn_windows_draw(&w, (uint64_t)i, i % 16, 7);
        assert_int_equal(a, ggn_windows_draw(&w, (uint64_t)i, i % 16, 7));
        assert_in_range(a, 0, w.n - 1);
        assert_int_equal(set.series[w.list[a].series].split, GGN_SPLIT_TRAIN);
        drawn[w.list[a].noisy]++;
    }
    assert_true(drawn[0] > 120 && drawn[1] > 120);
    ggn_windows_release(&w);
    ggn_windows_release(&published);
    ggn_series_set_release(&set);
    (void)state;
}

/* --- noise maps --- */

static int code(double linear)
{
    double v = linear > 0 ? linear < 1 ? linear : 1 : 0;
    return (int)floor(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055) + 0.5);
}

/* The noise map of level k of a recorded block by its definition, from the halves of record `from`. */
static void compare_picture(const struct ggn_series_set *set, const struct ggn_level_series *c, int k,
                            const struct seq_block *b, const struct seq_record *r, const struct seq_record *from)
{
    const size_t pixels = ggn_series_set_values(set) / 3;
    float *mean = malloc(4 * pixels * sizeof *mean), *d = mean + 3 * pixels;
    struct base_err err = {0};

    assert_int_equal(seq_mean(b, r, mean, &err), 0);
    assert_int_equal(seq_half_luminance(b, from, d, &err), 0);
    const double n = from->spp, h = from->half_spp, even = 2 * sqrt(h * (n - h)) / n; /* 1 for equal halves */
    assert_int_equal(c->has_noise_map[k], h > 0);
    int largest = 0;
    for (size_t p = 0; p < pixels && h > 0; p++) {
        double y =
            0.2126729 * (double)mean[p] + 0.7151522 * (double)mean[pixels + p] + 0.0721750 * (double)mean[2 * pixels + p];
        int want = abs(code(y + even * sqrt(n / r->spp) * (double)d[p]) - code(y)),
            got = c->noise_map[(size_t)k * pixels + p];
        assert_true(abs(got - want) <= 1); /* a value between two codes may be rounded either way */
        largest = want > largest ? want : largest;
    }
    assert_true(largest > 1 || h == 0);
    free(mean);
}

/* From a level's own halves where it has them, else from those of the full level. */
static void pictures_of_recorded_levels(void **state)
{
    char own[] = "/tmp/ggn_pictures.XXXXXX", view[64];
    static const uint32_t levels[] = {1, 3, 16, 64}; /* half of them, rounded down, in the first half: 0 of 1, 1 of 3 */
    const struct ggn_noise noise = {.width = 20, .height = 16, .levels = levels, .n_levels = 4, .sigma = 0.3, .seed = 4};
    const double sigma[] = {0.3};
    const char *const dirs[] = {own, dir};
    struct base_err err = {0};

    assert_non_null(mkdtemp(own));
    snprintf(view, sizeof view, "%s/view", own);
    ggn_noise_view(view, "view", &noise, sigma, 1, 100);
    for (int which = 0; which < 2; which++) {
        struct ggn_series_set_options o = {.dir = dirs[which], .noise_maps = 1};
        struct ggn_series_set set;
        struct seq_block b;
        if (ggn_series_set_load(&set, &o, &err))
            fail_msg("%s", err.text);
        const struct ggn_level_series *c = &set.series[0];
        const struct ggn_dataset_view *v = &set.data.views[c->view];
        assert_int_equal(seq_manifest_read_block(v->dir, &v->manifest, 0, &b, &err), 0);
        int full = 0, with = 0;
        for (int k = 0; k < c->n_levels; k++) {
            full = seq_has(&b.levels[k], SEQ_PLANE_HALF_F16) ? k : full;
            with += seq_has(&b.levels[k], SEQ_PLANE_HALF_F16) || seq_has(&b.levels[k], SEQ_PLANE_HALF_LOG);
        }
        assert_int_equal(with, which == 0 ? c->n_levels : 1);
        for (int k = 0; k < c->n_levels; k++)
            compare_picture(&set, c, k, &b, &b.levels[k], &b.levels[which == 0 ? k : full]);
        seq_block_release(&b);
        ggn_series_set_release(&set);
    }
    struct ggn_series_set_options o = {.dir = own};
    struct ggn_series_set set;
    assert_int_equal(ggn_series_set_load(&set, &o, &err), 0);
    assert_null(set.series[0].noise_map);
    struct ggn_augment none = ggn_augment_none();
    assert_int_equal(ggn_noise_map_plane(&set.series[0], 1, set.width, set.height, &none, NULL), 0);
    ggn_series_set_release(&set);
    (void)state;
}

/* Levels that were never rendered have pictures as strong as those of rendered levels at the same samples. */
static void pictures_of_made_levels(void **state)
{
    struct ggn_series_set_options o = {.dir = dir, .noise_maps = 1, .mean_for_reference = 1};
    struct ggn_series_set set;
    struct base_err err = {0};
    double sum[2] = {0, 0};

    if (ggn_series_set_load(&set, &o, &err))
        fail_msg("%s", err.text);
    for (int i = 0; i < set.n; i++)
        set.series[i].label.threshold = 400;
    assert_int_equal(ggn_series_set_add_synthetic(&set, 1, 3, &err), 0);
    assert_int_equal(ggn_series_set_extend(&set, 3, &err), 0);
    const size_t pixels = ggn_series_set_values(&set) / 3;
    for (int i = 0; i < set.n; i++) {
        const struct ggn_level_series *c = &set.series[i];
        for (int k = 2; k < c->n_levels; k++) {
            double mean = 0;
            assert_true(c->has_noise_map[k]);
            for (size_t p = 0; p < pixels; p++)
                mean += c->noise_map[(size_t)k * pixels + p] / (double)pixels;
            if (c->spp[k] < 100) /* codes of more than one, so that rounding matters little */
                sum[c->synthetic] += mean * sqrt(c->spp[k]) / (c->synthetic ? 9 : 12);
        }
    }
    if (fabs(sum[1] / sum[0] - 1) > 0.15)
        fail_msg("made %g, rendered %g", sum[1], sum[0]);
    ggn_series_set_release(&set);
    (void)state;
}

/* Flips and gains as of the images, and nothing for the share of samples that goes without. */
static void pictures_are_augmented_with_their_window(void **state)
{
    struct ggn_series_set_options o = {.dir = dir, .noise_maps = 1};
    struct ggn_series_set set;
    struct base_err err = {0};
    struct ggn_augment a = {.flip_x = 1, .flip_y = 1, .gain = {2, 2, 2}};
    const struct ggn_augment_options half = {.noise_map = 0.5}, all = {.flips = 1, .noise_map = 1};
    int blind = 0, flips = 0;

    assert_int_equal(ggn_series_set_load(&set, &o, &err), 0);
    const struct ggn_level_series *c = &set.series[0];
    const size_t pixels = ggn_series_set_values(&set) / 3;
    float *plane = malloc(pixels * sizeof *plane);
    assert_int_equal(ggn_noise_map_plane(c, 3, set.width, set.height, &a, plane), 1);
    for (size_t p = 0; p < pixels; p++) /* (2^(1/2.4) codes of 16/255 each) */
        assert_float_equal(plane[pixels - 1 - p], 1.334840 * 16 / 255 * c->noise_map[3 * pixels + p], 1e-4);
    a.blind = 1;
    assert_int_equal(ggn_noise_map_plane(c, 3, set.width, set.height, &a, plane), 0);
    for (int i = 0; i < 1000; i++) {
        struct ggn_augment without = ggn_augment_draw((uint64_t)i, 1, 5, &half),
                           with = ggn_augment_draw((uint64_t)i, 1, 5, &all);
        assert_false(with.blind || without.flip_x || without.flip_y || without.transpose || with.transpose);
        blind += without.blind;
        flips += with.flip_x;
    }
    assert_in_range(blind, 430, 570);
    assert_in_range(flips, 430, 570);
    free(plane);
    ggn_series_set_release(&set);
    (void)state;
}

/* All eight symmetries, the same for noisy images and reference of a crop that is the whole block. */
static void augmentation_moves_whole_windows(void **state)
{
    struct ggn_series_set set;

    load(&set, 0);
    const struct ggn_level_series *c = &set.series[0];
    size_t values = ggn_series_set_values(&set), pixels = values / 3;
    float *window = malloc(2 * values * sizeof *window), *crop = malloc(2 * values * sizeof *crop);
    double sum[8] = {0};
    for (int k = 0; k < 8; k++) {
        struct ggn_augment a = ggn_augment_none();
        a.flip_x = k & 1;
        a.flip_y = k >> 1 & 1;
        a.transpose = k >> 2;
        ggn_window_planes(c, 3, 2, set.width, set.height, 0, &a, 0, window);
        for (size_t i = 0; i < pixels; i++)
            sum[k] += (double)window[i] * (double)i;
        for (int m = 0; m < k; m++)
            assert_true(fabs(sum[k] - sum[m]) > 1e-6);
        /* a flip undone by reading backwards */
        if (k == 3)
            for (size_t i = 0; i < pixels; i++)
                assert_float_equal(window[values + pixels - 1 - i], c->noisy[3 * values + i] / 255.0F, 1e-6);
        ggn_crop_planes(c, 3, set.width, set.height, 0, 0, set.width, set.height, &a, crop, crop + values);
    }
    struct ggn_augment none = ggn_augment_none();
    ggn_window_planes(c, 3, 2, set.width, set.height, 0, &none, 8, window);
    for (size_t i = 0; i < values; i++)
        assert_float_equal(window[i], 8 * ((float)c->noisy[2 * values + i] - (float)c->noisy[3 * values + i]) / 255, 1e-4);
    free(window);
    free(crop);
    ggn_series_set_release(&set);
    (void)state;
}

/* The generator on differences and the folded one on plain images give the same map. */
static void folding_keeps_the_function(void **state)
{
    struct ggn_hyper hyper = {
        .preset = GGN_PRESET_LULL, .height = 32, .width = 32, .window = 3, .k_r = 3, .k_m = 3, .k_d = 2};
    struct ggn_graph *g = malloc(sizeof *g);
    struct base_err err = {0};
    float out[2][32 * 32], before[1];

    assert_int_equal(ggn_network_build(g, GGN_NET_M, &hyper, &err), 0);
    struct ggn_weights *w = ggn_weights_create(g, NULL, 0, &err);
    struct ggn_exec *e = ggn_exec_create(g, NULL, 1, 0, NULL, &err);
    ggn_weights_init(w, GGN_INIT_HE, 5);
    before[0] = w->params[10];
    for (int fold = 0; fold < 2; fold++) {
        if (fold)
            ggn_train_fold(g, w->params, 3, 8);
        ggn_weights_pack(w, NULL);
        for (int k = 0; k < 9; k++)
            for (int y = 0; y < 32; y++)
                for (int x = 0; x < 32; x++) {
                    double v = ggn_hash_unit((uint32_t)(y * 32 + x), (uint32_t)k);
                    double newest = ggn_hash_unit((uint32_t)(y * 32 + x), (uint32_t)(6 + k % 3));
                    ggn_exec_plane(e, 0, 0, k)[y * g->value[0].row + x] = (float)(fold || k > 5 ? v : 8 * (v - newest));
                }
        ggn_exec_forward(e, w, 1, GGN_EVAL);
        for (int y = 0; y < 32; y++)
            memcpy(out[fold] + 32 * y, ggn_exec_plane(e, g->n_values - 1, 0, 0) + y * g->value[g->n_values - 1].row,
                   32 * sizeof(float));
    }
    for (int i = 0; i < 32 * 32; i++)
        assert_float_equal(out[0][i], out[1][i], 1e-4);
    ggn_train_unfold(g, w->params, 3, 8);
    assert_float_equal(w->params[10], before[0], 1e-5);
    ggn_exec_destroy(e);
    ggn_weights_destroy(w);
    free(g);
    (void)state;
}

/* The denoiser begins as sigmoid(4·(x − 1/2)), up to what the random channels add. */
static void the_denoiser_begins_near_its_input(void **state)
{
    struct ggn_hyper hyper = {
        .preset = GGN_PRESET_LULL, .height = 32, .width = 32, .window = 6, .k_r = 8, .k_m = 3, .k_d = 2};
    struct ggn_graph *g = malloc(sizeof *g);
    struct base_err err = {0};
    double error = 0;

    assert_int_equal(ggn_network_build(g, GGN_NET_R, &hyper, &err), 0);
    struct ggn_weights *w = ggn_weights_create(g, NULL, 0, &err);
    struct ggn_exec *e = ggn_exec_create(g, NULL, 1, 0, NULL, &err);
    ggn_weights_init(w, GGN_INIT_HE, 5);
    ggn_train_identity(g, w->params);
    ggn_weights_pack(w, NULL);
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < 3; k++)
            for (int y = 0; y < 32; y++)
                for (int x = 0; x < 32; x++) {
                    double v = ggn_hash_unit((uint32_t)(y * 32 + x), (uint32_t)k);
                    if (!pass)
                        ggn_exec_plane(e, 0, 0, k)[y * g->value[0].row + x] = (float)v;
                    else
                        error +=
                            fabs((double)ggn_exec_plane(e, g->n_values - 1, 0, k)[y * g->value[g->n_values - 1].row + x] -
                                 1 / (1 + exp(2 - 4 * v))) /
                            (3 * 32 * 32);
                }
        if (!pass)
            ggn_exec_forward(e, w, 1, GGN_EVAL);
    }
    assert_true(error < 0.06);
    ggn_exec_destroy(e);
    ggn_weights_destroy(w);
    free(g);
    (void)state;
}

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

/* A judge whose logit crosses 0 at the true threshold: no early stop at t = 0.5, and the chosen t stops none early. Two passes
 * cost a check more, and are chosen where a single low logit long before the threshold would stop the block. */
static void the_threshold_respects_the_early_rate(void **state)
{
    struct ggn_series_set set;
    struct ggn_windows w;
    struct ggn_window_options o = {.split = GGN_SPLIT_TRAIN, .length = 6};
    struct ggn_policy policy = ggn_policy_default();
    struct ggn_stopping at, chosen;
    struct base_err err = {0};

    load(&set, 0);
    assert_int_equal(ggn_windows_create(&w, &set, &o, &err), 0);
    double *logit = malloc((size_t)w.n * sizeof *logit);
    for (int i = 0; i < w.n; i++)
        logit[i] = -6 * w.list[i].octave;
    policy.passes = 1;
    policy.first_spp = set.first_spp;
    policy.ratio = set.ratio;
    struct ggn_checks checks;
    assert_int_equal(ggn_checks_create(&checks, &w, logit, &policy, &err), 0);
    assert_int_equal(ggn_calibrate_stopping(&checks, 1, 0.5, &at, &err), 0);
    assert_int_equal(at.blocks, 9);
    assert_true(at.early_rate == 0 && at.samples_ratio >= 1);
    assert_int_equal(ggn_calibrate_threshold(&checks, 0, &policy, &chosen, &err), 0);
    assert_true(chosen.early_rate == 0 && policy.passes == 1);
    assert_true(policy.threshold > 0.05 && policy.threshold < 0.9);
    double slope = ggn_calibrate_slope(&w, logit, &policy);
    assert_true(fabs(slope - 6) < 1e-6);
    double near = chosen.mean_abs_log2;
    assert_int_equal(ggn_calibrate_stopping(&checks, 2, policy.threshold, &at, &err), 0);
    assert_true(at.samples_ratio > 1.05 * chosen.samples_ratio);
    /* the first window of every block is as clean as any */
    ggn_checks_release(&checks);
    for (int c = 0; c < set.n; c++)
        if (w.first[c + 1] > w.first[c])
            logit[w.first[c]] = -30;
    assert_int_equal(ggn_checks_create(&checks, &w, logit, &policy, &err), 0);
    assert_int_equal(ggn_calibrate_threshold(&checks, 0, &policy, &chosen, &err), 0);
    assert_true(chosen.early_rate == 0 && policy.passes == 2 && chosen.mean_abs_log2 > near);
    ggn_checks_release(&checks);
    /* a guard that no level satisfies lets nothing stop, a gate that spares the network everywhere neither */
    for (int c = 0; c < set.n; c++)
        for (int i = 0; i < set.series[c].n_levels; i++)
            set.series[c].tail999[i] = set.series[c].gini[i] = 0.5;
    for (int k = 0; k < 2; k++) {
        struct ggn_policy held = policy;
        *(k ? &held.gate_noise : &held.tail999) = 1e-12;
        assert_int_equal(ggn_checks_create(&checks, &w, logit, &held, &err), 0);
        struct ggn_stopping none;
        assert_int_equal(ggn_calibrate_stopping(&checks, 2, 0.99, &none, &err), 0);
        assert_true(none.samples_ratio > at.samples_ratio && none.early_rate == 0);
        ggn_checks_release(&checks);
    }
    free(logit);
    ggn_windows_release(&w);
    ggn_series_set_release(&set);
    (void)state;
}

/* --- numbers of a plan, and what is fitted: closed forms ------------------------------------------------------------------ */

/* Every number of both presets' plans, in the order of the struct. */
static void default_plans(void **state)
{
    static const struct {
        double ratio;
        int window, k[3], crop, batch_r, batch, steps, epochs, epoch_steps, patience;
        double lr, difference;
        int soft, flips;
        double jitter;
        int synthetic, extend;
    } want[] = {{0, 6, {16, 20, 64}, 0, 16, 64, 0, 30, 0, 0, 2e-4, 0, 0, 0, 0, 0, 0},
                {1.1, 6, {8, 10, 32}, 96, 16, 16, 2000, 30, 100, 8, 1e-3, 8, 1, 1, 0.3, 1, 1}};

    for (int preset = 0; preset < 2; preset++) {
        const struct ggn_train_plan p = ggn_train_plan_default((enum ggn_preset)preset);
        assert_true(p.preset == (enum ggn_preset)preset && p.data.ratio == want[preset].ratio && !p.data.dir);
        assert_true(!p.out && !p.init && !p.resume && !p.job && !p.progress && !p.interrupted);
        assert_true(p.window == want[preset].window && p.k_r == want[preset].k[0] && p.k_m == want[preset].k[1]);
        assert_true(p.k_d == want[preset].k[2] && p.crop == want[preset].crop && p.batch_r == want[preset].batch_r);
        assert_true(p.batch == want[preset].batch && p.steps == want[preset].steps && p.steps_r == p.steps);
        assert_true(p.epochs == want[preset].epochs && p.epoch_steps == want[preset].epoch_steps);
        assert_true(p.patience == want[preset].patience && p.lr == want[preset].lr && p.lr_r == p.lr);
        assert_true(p.difference == want[preset].difference && p.soft_labels == want[preset].soft);
        assert_true(p.flips == want[preset].flips && p.jitter == want[preset].jitter && p.noise_map == 0 && p.average == 0);
        assert_true(p.synthetic == want[preset].synthetic && p.extend == want[preset].extend && p.seed == 1);
        assert_true(p.validation_windows == 400 && p.early_rate == 0.02 && p.threads == 0);
        const struct ggn_train_options o = ggn_train_options_default((enum ggn_preset)preset);
        assert_true(o.parts == GGN_TRAIN_ALL && o.batch == want[preset].batch && o.beta1 == 0.5 && o.beta2 == 0.999);
        assert_true(o.eps == 1e-8 && o.clip == preset && o.explode == 1e6 && o.dropout == 1);
        assert_true(o.seed == 1 && o.bf16 == 0);
        for (int net = 0; net < GGN_NETS; net++) {
            assert_true(o.lr[net] == 2e-4);
            assert_int_equal(o.init[net], preset ? GGN_INIT_HE : net == GGN_NET_D ? GGN_INIT_GAN : GGN_INIT_PAPER);
        }
    }
    (void)state;
}

/* A ramp of a fiftieth of the steps, twenty at least, times half a cosine from 1 to a fiftieth; a half for each divergence. */
static void learning_rates(void **state)
{
    static const double steps[] = {0, 10, 1000, 5000};

    for (int k = 0; k < 4; k++)
        for (double step = 0; step <= steps[k]; step += steps[k] / 10 + (steps[k] == 0)) {
            struct ggn_session s = {.progress.divergences = k};
            double t = steps[k] > 0 ? floor(step) / steps[k] : 0,
                   ramp = fmin(1, (floor(step) + 1) / fmax(20, steps[k] / 50));
            double want = 3 * ramp * (0.02 + 0.98 * (0.5 + 0.5 * cos(3.141592653589793 * t))) / pow(2, k);
            double got = ggn_session_lr(&s, 3, (uint64_t)step, (uint64_t)steps[k]);
            if (!(fabs(got - want) <= 1e-12))
                fail_msg("step %g of %g: %.15g, not %.15g", step, steps[k], got, want);
        }
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
    struct ggn_seen seen[16] = {{.p = 0.9},
                                {.p = 0.4},
                                {.p = 0.3},
                                {.p = 0.05},
                                {.p = 0.6},
                                {.p = 0.6},
                                {.p = 0.7},
                                {.p = 0.6},
                                {.p = 0},
                                {.p = 0},
                                {.p = 0},
                                {.p = 0},
                                {.p = 0.4, .is_held = 1},
                                {.p = 0.6},
                                {.p = 0.2},
                                {.p = 0.1}};
    static const double truth[] = {25, 200, 30, 30};
    int first[] = {0, 1, 2, 2, 3};
    struct ggn_stopping got;
    struct base_err err = {0};

    for (int c = 0; c < 4; c++)
        series[c] = (struct ggn_level_series){.n_levels = 4, .spp = spp, .label.threshold = truth[c]};
    struct ggn_series_set set = {.n = 4, .series = series};
    struct ggn_windows w = {.set = &set, .n = 3, .first = first};
    struct ggn_checks checks = {.windows = &w, .policy = ggn_policy_default(), .seen = seen};
    assert_int_equal(ggn_calibrate_stopping(&checks, 1, 0.5, &got, &err), 0);
    /* stops at 20, 200 (past the end, seen until its threshold) and 40: log2 0.322 (not early at 0.8 of it), 0, 0.415 */
    assert_int_equal(got.blocks, 3);
    assert_true(got.early_rate == 0 && fabs(got.samples_ratio - 260.0 / 255) < 1e-12);
    assert_true(fabs(got.median_abs_log2 - log2(25.0 / 20)) < 1e-12);
    assert_true(fabs(got.mean_abs_log2 - (log2(25.0 / 20) + log2(40.0 / 30)) / 3) < 1e-12);
    series[0].label.threshold = 25.1; /* now 20 is early */
    series[1].label.threshold = 50;   /* and the end of the recording late */
    assert_int_equal(ggn_calibrate_stopping(&checks, 1, 0.5, &got, &err), 0);
    assert_true(got.early_rate == 1.0 / 3 && fabs(got.samples_ratio - 140.0 / 105.1) < 1e-12);
    assert_int_equal(ggn_calibrate_stopping(&checks, 2, 0.5, &got, &err), 0); /* 40, never, 80 */
    assert_true(got.early_rate == 0 && fabs(got.samples_ratio - 200.0 / 105.1) < 1e-12);
    /* one pass below 0.5 is right for the first and too early for none of the others: the best that is allowed */
    series[0].label.threshold = 20;
    series[1].label.threshold = 80;
    series[3].label.threshold = 40;
    struct ggn_policy p = ggn_policy_default();
    assert_int_equal(ggn_calibrate_threshold(&checks, 0, &p, &got, &err), 0);
    assert_true(p.threshold == 0.41 && p.passes == 1 && got.mean_abs_log2 == 0 &&
                got.samples_ratio == 1); /* p < t, not p <= t */
    series[0].label.threshold = 50;      /* 40 is four fifths of it, which is not early; 20, better for two passes, is */
    assert_int_equal(ggn_calibrate_threshold(&checks, 0, &p, &got, &err), 0);
    assert_true(p.threshold == 0.31 && p.passes == 1 && fabs(got.mean_abs_log2 - log2(1.25) / 3) < 1e-12);
    (void)state;
}

/* The largest values of windows that count, each with its margin; what the policy has already is kept where it is larger. */
static void limits_by_brute_force(void **state)
{
    struct ggn_series_set set;
    struct ggn_windows w;
    struct ggn_window_options o = {.split = GGN_SPLIT_TRAIN, .length = 4};
    struct ggn_policy got = {.tail999 = 0.01}, kept = {.gate_noise = 7, .tail999 = 8, .gini = 1.5};
    struct base_err err = {0};
    double gate = 0, tail = 0.01, gini = 0;

    load(&set, 0);
    assert_int_equal(ggn_windows_create(&w, &set, &o, &err), 0);
    const size_t values = ggn_series_set_values(&set);
    for (int c = 0; c < set.n; c++)
        for (int k = 0; k < set.series[c].n_levels; k++) {
            uint32_t at = (uint32_t)(100 * c + k);
            set.series[c].synthetic = c == 1;
            set.series[c].tail999[k] = at % 5 == 1 ? (double)NAN : ggn_hash_unit(at, 1);
            set.series[c].gini[k] = at % 7 == 2 ? (double)NAN : 0.9 * ggn_hash_unit(at, 2);
        }
    for (int i = 0; i < w.n; i++) {
        const struct ggn_level_series *c = &set.series[w.list[i].series];
        const int last = w.list[i].last;
        double octave = log2(c->spp[last] / c->label.threshold), square = 0;
        if (c->synthetic || octave < log2(0.8))
            continue;
        for (size_t v = 0; v < values; v++) {
            double d = (c->noisy[(size_t)(last - 3) * values + v] - c->noisy[(size_t)last * values + v]) / 255.0;
            square += d * d / (double)values;
        }
        gate = fmax(gate, 1.1 * sqrt(square / (c->spp[last] / c->spp[last - 3] - 1)));
        if (octave < 0 || isnan(c->tail999[last]) || isnan(c->gini[last]))
            continue;
        tail = fmax(tail, 1.5 * c->tail999[last]);
        gini = fmax(gini, 1 - 0.75 * (1 - c->gini[last]));
    }
    ggn_calibrate_limits(&w, &got);
    assert_true(gate > 0 && tail > 1 && gini > 0.8);
    assert_true(fabs(got.gate_noise / gate - 1) < 1e-12 && got.tail999 == tail && fabs(got.gini - gini) < 1e-12);
    ggn_calibrate_limits(&w, &kept);
    assert_true(kept.gate_noise == 7 && kept.tail999 == 8 && kept.gini == 1.5);
    for (int c = 0; c < set.n; c++)
        set.series[c].synthetic = 0; /* who owns its reference */
    ggn_windows_release(&w);
    ggn_series_set_release(&set);
    (void)state;
}

static void learning_curves(void **state)
{
    char path[] = "/tmp/ggn_curves.XXXXXX", *text;
    struct ggn_log log = {0};
    struct base_err err = {0};
    size_t size;

    assert_true(close(mkstemp(path)) == 0);
    for (int i = 0; i < 9; i++) {
        struct ggn_log_row r = {.phase = i > 6,
                                .step = 10 * i,
                                .loss = 1.0 / (i + 1),
                                .accuracy = (double)NAN,
                                .validation_loss = i + 0.5,
                                .validation_accuracy = 0.25,
                                .validation_auc = 0.75,
                                .lr = 1e-3,
                                .seconds = 0.06 * i};
        *(i % 3 ? &r.validation_auc : &r.lr) = (double)NAN;
        assert_int_equal(ggn_log_add(&log, &r, &err), 0);
    }
    assert_int_equal(ggn_log_write_csv(&log, path, &err), 0);
    assert_int_equal(base_file_read(path, 1 << 16, &text, &size, &err), 0);
    assert_string_equal(text,
                        "phase,step,loss,accuracy,validation_loss,validation_accuracy,validation_auc,learning_rate,seconds\n"
                        "denoiser,0,1,,0.5,0.25,0.75,,0.0\n"
                        "denoiser,10,0.5,,1.5,0.25,,0.001,0.1\n"
                        "denoiser,20,0.333333333,,2.5,0.25,,0.001,0.1\n"
                        "denoiser,30,0.25,,3.5,0.25,0.75,,0.2\n"
                        "denoiser,40,0.2,,4.5,0.25,,0.001,0.2\n"
                        "denoiser,50,0.166666667,,5.5,0.25,,0.001,0.3\n"
                        "denoiser,60,0.142857143,,6.5,0.25,0.75,,0.4\n"
                        "judge,70,0.125,,7.5,0.25,,0.001,0.4\n"
                        "judge,80,0.111111111,,8.5,0.25,,0.001,0.5\n");
    free(text);
    ggn_log_release(&log);
    assert_true(log.n == 0 && !log.rows);
    unlink(path);
    (void)state;
}

static int make_data(void **state)
{
    struct seqgen g = seqgen_default();
    struct base_err err = {0};

    snprintf(dir, sizeof dir, "/tmp/ggn_train.%ld", (long)getpid());
    (void)state;
    return seqgen_write(dir, &g, &err);
}

static int remove_data(void **state)
{
    char command[128];

    snprintf(command, sizeof command, "rm -r %s", dir);
    (void)state;
    return system(command);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splits_and_levels),
        cmocka_unit_test(synthetic_noise_has_the_variance_of_rendered_noise),
        cmocka_unit_test(extended_levels_continue_the_recording),
        cmocka_unit_test(simulated_levels_lie_as_far_apart_as_asked),
        cmocka_unit_test(windows_are_labelled_by_their_last_image),
        cmocka_unit_test(augmentation_moves_whole_windows),
        cmocka_unit_test(pictures_of_recorded_levels),
        cmocka_unit_test(pictures_of_made_levels),
        cmocka_unit_test(pictures_are_augmented_with_their_window),
        cmocka_unit_test(folding_keeps_the_function),
        cmocka_unit_test(the_denoiser_begins_near_its_input),
        cmocka_unit_test(platt_recovers_the_scale),
        cmocka_unit_test(the_threshold_respects_the_early_rate),
        cmocka_unit_test(default_plans),
        cmocka_unit_test(learning_rates),
        cmocka_unit_test(platt_is_at_the_minimum),
        cmocka_unit_test(slopes),
        cmocka_unit_test(stopping_by_hand),
        cmocka_unit_test(limits_by_brute_force),
        cmocka_unit_test(learning_curves),
    };

    if (argc == 3 && !strcmp(argv[1], "--write-demo")) {
        struct seqgen g = seqgen_default();
        struct base_err err = {0};
        if (seqgen_write(argv[2], &g, &err))
            fprintf(stderr, "%s\n", err.text);
        return err.code != 0;
    }
    return cmocka_run_group_tests(tests, make_data, remove_data);
}
