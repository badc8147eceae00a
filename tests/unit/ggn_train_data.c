/* What the trainer makes of a data set: levels, recorded and made, windows and their labels, augmentation, noise maps.
 * `--write-demo DIR` makes the data set of `make train-demo` instead. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <string.h>
#include <stdio.h>
#include <stdlib.h>

#include "ggn_noise.h"
#include "ggn_seqgen.h"
#include "sequence/manifest.h"
#include "sequence/simulate.h"
#include "data/windows.h"
#include "sight/curve.h"

static void splits_and_levels(void **state)
{
    struct ggn_series_set set, thin;

    seqgen_load(&set, 0);
    assert_int_equal(set.n, 12);
    assert_int_equal(ggn_series_set_count(&set, GGN_SPLIT_TRAIN, 1), 9);
    assert_int_equal(ggn_series_set_count(&set, GGN_SPLIT_VALIDATION, 1), 3);
    assert_int_equal(set.data.n_scenes, 4);
    assert_int_equal(set.series[0].n_levels, 14);
    assert_true(fabs(set.ratio - 1.35) < 0.02);
    seqgen_load(&thin, 1.7);
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

    seqgen_load(&set, 0);
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

    seqgen_load(&set, 0);
    size_t values = ggn_series_set_values(&set);
    for (int i = 0; i < set.n; i++)
        set.series[i].label.threshold = i ? 400 : 30;
    assert_int_equal(ggn_series_set_extend(&set, 0, 3, &err), 0);
    assert_int_equal(set.series[0].n_levels, 14);
    for (int i = 1; i < set.n; i++) {
        const struct ggn_level_series *c = &set.series[i];
        assert_true(c->n_levels > 17 && c->spp[14] > c->spp[13] && c->spp[c->n_levels - 1] > 1800);
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
    const double wanted[] = {1.02, 1.05, 1.5};

    for (int t = 0; t < 3; t++) {
        seqgen_load(&set, 0);
        const double first = set.series[0].spp[0];
        const size_t values = ggn_series_set_values(&set);
        assert_int_equal(ggn_series_set_simulate(&set, wanted[t], 3, &err), 0);
        for (int i = 0; i < set.n; i++) {
            const struct ggn_level_series *c = &set.series[i];
            const int end = c->n_levels - 1;
            double low = 0, high = 0;
            int half = 0;
            assert_true(c->simulated && c->spp[0] == first && c->spp[end] <= SEQ_SIMULATED_CAP &&
                        c->spp[end] * wanted[t] > SEQ_SIMULATED_CAP &&
                        c->spp[end] <= c->spp[end - 1] * wanted[t] * wanted[t] + 1);
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

    seqgen_load(&set, 0);
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

/* Blocks without a reference, every level measured. */
static void load_measured(struct ggn_series_set *set, char *own)
{
    struct seqgen g = seqgen_default();
    struct base_err err = {0};

    g.side = 40;
    g.scenes = 3;
    g.validation = 1;
    g.reference_spp = 0;
    assert_non_null(mkdtemp(own));
    if (seqgen_write(own, &g, &err))
        fail_msg("%s", err.text);
    struct ggn_series_set_options o = {.dir = own, .noise_maps = 1, .measures = 1, .keep_recorded = 1};
    if (ggn_series_set_load(set, &o, &err))
        fail_msg("%s", err.text);
}

static void remove_all(const char *own)
{
    char command[96];

    snprintf(command, sizeof command, "rm -r %s", own);
    assert_int_equal(system(command), 0);
}

/* A level's measure is what the criterion `observer` sees there, a simulated level's what its label was read from. */
static void measures_are_the_law(void **state)
{
    char own[] = "/tmp/ggn_measures.XXXXXX";
    struct ggn_series_set set;
    struct base_err err = {0};
    int levels = 0, simulated = 0;

    load_measured(&set, own);
    const int recorded = set.n;
    for (int i = 0; i < recorded; i++)
        set.series[i].label.threshold = 400;
    assert_int_equal(ggn_series_set_extend(&set, 0, 3, &err), 0);
    assert_int_equal(set.n, 2 * recorded);
    for (int i = 0; i < set.n; i++) {
        const struct ggn_level_series *c = &set.series[i];
        const struct ggn_dataset_view *v = &set.data.views[c->view];
        struct ggn_curve curve;
        struct seq_block b;
        assert_int_equal(seq_manifest_read_block(v->dir, &v->manifest, seq_manifest_find(&v->manifest, c->block), &b, &err),
                         0);
        assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &curve, &err), 0);
        assert_int_equal(c->synthetic, i >= recorded);
        for (int k = 0; k < c->n_levels; k++) {
            double seen;
            if (!c->synthetic && !seq_has_halves(&b.levels[k])) {
                assert_true(isnan(c->measure[k].visible));
            } else if (!c->synthetic) {
                assert_int_equal(ggn_curve_level(&b, NULL, &b.levels[k], &seen, &err), 0);
                assert_true(fabs(c->measure[k].visible / seen - 1) < 1e-6);
                levels++;
            } else if (c->spp[k] >= b.levels[b.n_levels - 1].spp) { /* between levels a curve is interpolated */
                assert_true(fabs(c->measure[k].visible / ggn_curve_at(&curve, c->spp[k]) - 1) < 0.01);
                simulated++;
            }
        }
        ggn_curve_release(&curve);
        seq_block_release(&b);
    }
    assert_true(levels == recorded && simulated > 5 * recorded);
    ggn_series_set_release(&set);
    remove_all(own);
    (void)state;
}

/* Flips and gains as of the images, and nothing for the share of samples that goes without. */
static void pictures_are_augmented_with_their_window(void **state)
{
    char own[] = "/tmp/ggn_measures.XXXXXX";
    struct ggn_series_set set;
    struct ggn_augment a = {.flip_x = 1, .flip_y = 1, .gain = {2, 2, 2}};
    const struct ggn_augment_options half = {.noise_map = 0.5}, all = {.flips = 1, .noise_map = 1};
    int blind = 0, flips = 0;

    load_measured(&set, own);
    const struct ggn_level_series *c = &set.series[0];
    const size_t pixels = ggn_series_set_values(&set) / 3;
    int k = 0;
    while (k < c->n_levels && !c->has_noise_map[k]) /* a level with half buffers */
        k++;
    assert_true(k < c->n_levels);
    float *plane = malloc(pixels * sizeof *plane);
    assert_int_equal(ggn_noise_map_plane(c, k, set.width, set.height, &a, plane), 1);
    for (size_t p = 0; p < pixels; p++) /* (2^(1/2.4) codes of 16/255 each) */
        assert_float_equal(plane[pixels - 1 - p], 1.334840 * 16 / 255 * c->noise_map[(size_t)k * pixels + p], 1e-4);
    a.blind = 1;
    assert_int_equal(ggn_noise_map_plane(c, k, set.width, set.height, &a, plane), 0);
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
    remove_all(own);
    (void)state;
}

/* All eight symmetries, the same for noisy images and reference of a crop that is the whole block. */
static void augmentation_moves_whole_windows(void **state)
{
    struct ggn_series_set set;

    seqgen_load(&set, 0);
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

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(splits_and_levels),
        cmocka_unit_test(synthetic_noise_has_the_variance_of_rendered_noise),
        cmocka_unit_test(extended_levels_continue_the_recording),
        cmocka_unit_test(measures_are_the_law),
        cmocka_unit_test(simulated_levels_lie_as_far_apart_as_asked),
        cmocka_unit_test(windows_are_labelled_by_their_last_image),
        cmocka_unit_test(augmentation_moves_whole_windows),
        cmocka_unit_test(pictures_are_augmented_with_their_window),
    };
    if (argc == 3 && !strcmp(argv[1], "--write-demo")) {
        struct seqgen g = seqgen_default();
        struct base_err err = {0};
        if (seqgen_write(argv[2], &g, &err))
            fprintf(stderr, "%s\n", err.text);
        return err.code != 0;
    }
    return cmocka_run_group_tests(tests, seqgen_make, seqgen_remove);
}
