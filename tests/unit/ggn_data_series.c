/* Series of levels, their windows, and what training sees of them. */
#include <math.h>
#include <stdio.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_transcript.h"
#include "data/series.h"
#include "data/windows.h"

/* Two sums of codes, one with weights by place: a code elsewhere changes it. */
static void print_codes(FILE *f, const char *what, const uint8_t *codes, size_t n)
{
    double sum = 0, placed = 0, weights = 0;
    for (size_t i = 0; codes && i < n; i++) {
        sum += codes[i];
        placed += codes[i] * (double)(i % 97);
        weights += (double)(i % 97);
    }
    if (codes)
        fprintf(f, " %s %.2f %.2f", what, sum / (double)n, placed / weights);
}

static void print_series(FILE *f, const struct ggn_series_set *set)
{
    const size_t values = ggn_series_set_values(set);
    fprintf(f, "%d chains of %d scenes, %dx%d, first %g, ratio %.9g, step %g; %d %d to train\n", set->n, set->data.n_scenes,
            set->width, set->height, set->first_spp, set->ratio, set->step_spp,
            ggn_series_set_count(set, GGN_SPLIT_TRAIN, 0), ggn_series_set_count(set, GGN_SPLIT_TRAIN, 1));
    for (int i = 0; i < set->n; i++) {
        const struct ggn_level_series *c = &set->series[i];
        fprintf(f, "%d: view %d scene %d %s block %u%s%s, label %d %g %d %g;", i, c->view, c->scene,
                ggn_split_names[c->split], c->block, c->synthetic ? " synthetic" : "", c->simulated ? " simulated" : "",
                c->has_label, c->label.threshold, c->label.censored, c->spread);
        print_codes(f, "reference", c->reference, values);
        fputc('\n', f);
        for (int k = 0; k < c->n_levels; k += 1 + (i % 3)) {
            fprintf(f, "  %g:", c->spp[k]);
            print_codes(f, "noisy", c->noisy + values * (size_t)k, values);
            if (set->noise_maps && c->has_noise_map[k])
                print_codes(f, "picture", c->noise_map + values / 3 * (size_t)k, values / 3);
            fputc('\n', f);
        }
    }
}

static void chains_are_as_they_were(void **state)
{
    static const struct ggn_series_set_options options[] = {
        {.dir = "tests/data/recorded", .with_test = 1, .noise_maps = 1, .measures = 1},
        {.dir = "tests/data/recorded", .ratio = 2},
        {.dir = "tests/data/recorded", .split = {.validation = "one", .test = "two,three"}, .with_test = 1},
        {.dir = "tests/data/recorded", .split = {.validation = "one,two", .test = "three"}},
        {.dir = "tests/data/recorded", .split = {.validation = "two,one", .test = "three,one"}},
        {.dir = "tests/data/recorded", .split = {.test = "one-view0"}},
        {.dir = "tests/data/recorded", .split.validation = "one,none"},
        {.dir = "tests/data/train-demo", .split.validation = "scene1", .noise_maps = 1, .measures = 1, .ratio = 3},
        {.dir = "tests/data/recorded/train/one-view1"}};
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        struct ggn_series_set set;
        struct base_err err = {0};
        fprintf(f, "> options %zu\n", i);
        if (ggn_series_set_load(&set, &options[i], &err)) {
            fprintf(f, "%s\n", err.text);
            continue;
        }
        print_series(f, &set);
        ggn_series_set_release(&set);
    }
    for (int how = 0; how < 4; how++) {
        struct ggn_series_set set;
        const struct ggn_series_set_options o = {
            .dir = "tests/data/recorded", .with_test = 1, .noise_maps = how != 1, .measures = 1};
        assert_int_equal(ggn_series_set_load(&set, &o, NULL), 0);
        fprintf(f, "> %s\n",
                how == 0   ? "synthetic"
                : how == 1 ? "extended"
                : how == 2 ? "simulated, 1.9"
                           : "synthetic, linear");
        set.ratio = how == 3 ? 0 : set.ratio;
        if (how == 0 || how == 3)
            assert_int_equal(ggn_series_set_add_synthetic(&set, 2, 5, NULL), 0);
        else if (how == 1)
            assert_int_equal(ggn_series_set_extend(&set, 0, 6, NULL), 0);
        else
            assert_int_equal(ggn_series_set_simulate(&set, 1.9, 7, NULL), 0);
        print_series(f, &set);
        ggn_series_set_release(&set);
    }
    transcript_end(&t, "data-chains");
}

/* Bad input, not a lack of memory. */
static void too_many_blocks_are_refused(void **state)
{
    struct ggn_series_set set = {0};
    struct base_err err = {0};
    (void)state;
    for (int i = 0; i < 65536; i++)
        assert_int_equal(ggn_series_set_append(&set, &err), 0);
    assert_int_equal(ggn_series_set_append(&set, &err), BASE_EINVAL);
    assert_string_equal(err.text, "more than 65536 blocks");
    ggn_series_set_release(&set);
}

static void print_windows(FILE *f, const struct ggn_series_set *set, const struct ggn_window_options *o)
{
    struct ggn_windows w;
    assert_int_equal(ggn_windows_create(&w, set, o, NULL), 0);
    fprintf(f, "%s, %d images%s%s%s: %d windows\n", ggn_split_names[o->split], o->length, o->soft ? ", soft" : "",
            o->synthetic ? ", synthetic" : "", o->label_first ? ", first" : "", w.n);
    for (int i = 0; i < w.n; i++)
        fprintf(f, " %d.%d:%d %.4f %.4f%s", w.list[i].series, w.list[i].last, w.list[i].noisy, w.list[i].label,
                w.list[i].octave, i % 6 == 5 || i + 1 == w.n ? "\n" : "");
    for (int i = 0; i <= set->n; i++)
        fprintf(f, "%s%d", i ? " " : "first: ", w.first[i]);
    fputs("\ndrawn:", f);
    for (int i = 0; i < 40 && w.n; i++)
        fprintf(f, " %d", ggn_windows_draw(&w, (uint64_t)(i / 8) << (i % 2 ? 33 : 0), i % 8, 3));
    fputc('\n', f);
    ggn_windows_release(&w);
}

/* Planes by their mean and their mean weighted by place. */
static void print_planes(FILE *f, const char *what, const float *v, size_t n)
{
    double sum = 0, placed = 0;
    for (size_t i = 0; i < n; i++) {
        sum += (double)v[i];
        placed += (double)v[i] * sin((double)i);
    }
    fprintf(f, " %s %.4f %.3f", what, sum / (double)n, placed);
}

static void windows_are_as_they_were(void **state)
{
    enum { SIDE = 16, P = SIDE * SIDE };
    static float planes[3 * 4 * P], other[3 * P];
    static uint16_t denoised[64 * 3 * P];
    const struct ggn_series_set_options o = {.dir = "tests/data/recorded", .noise_maps = 1, .measures = 1};
    struct ggn_series_set set;
    struct transcript t;
    FILE *f = transcript_begin(&t);
    (void)state;
    assert_int_equal(ggn_series_set_load(&set, &o, NULL), 0);
    assert_int_equal(ggn_series_set_add_synthetic(&set, 1, 5, NULL), 0);
    for (int i = 0; i < 8; i++)
        print_windows(f, &set,
                      &(struct ggn_window_options){.split = i & 1 ? GGN_SPLIT_VALIDATION : GGN_SPLIT_TRAIN,
                                                   .length = i < 6 ? 4 : 9,
                                                   .soft = i & 2,
                                                   .synthetic = i & 4,
                                                   .label_first = i == 5});
    for (int i = 0; i < 12; i++) {
        struct ggn_augment a = ggn_augment_draw(
            (uint64_t)i << (i % 3 * 16), i % 4, 9,
            &(struct ggn_augment_options){.flips = i < 9, .square = i < 7, .jitter = i < 11 ? 0.6 : 0, .noise_map = 0.5});
        fprintf(f, "augment %d%d%d %d %.5f %.5f %.5f\n", a.flip_x, a.flip_y, a.transpose, a.blind, (double)a.gain[0],
                (double)a.gain[1], (double)a.gain[2]);
    }
    struct ggn_level_series *c = &set.series[2];
    for (size_t i = 0; i < (size_t)c->n_levels * 3 * P; i++)
        denoised[i] = (uint16_t)(c->noisy[i] * 250u + i % 257u);
    c->denoised = denoised;
    for (int i = 0; i < 16; i++) {
        struct ggn_augment a = {.flip_x = i & 1,
                                .flip_y = i >> 1 & 1,
                                .transpose = i >> 2 & 1,
                                .gain = {i < 8 ? 1 : 1.3f, 1, i < 8 ? 1 : 0.8f},
                                .blind = i == 15};
        fprintf(f, "planes %d:", i);
        ggn_window_planes(c, 5, 4, SIDE, SIDE, 0, &a, i < 4 ? 0 : 8, planes);
        print_planes(f, "noisy", planes, 12 * P);
        ggn_window_planes(c, 5, 4, SIDE, SIDE, 1, &a, i < 4 ? 8 : 0, planes);
        print_planes(f, "denoised", planes, 12 * P);
        if (ggn_noise_map_plane(c, 5, SIDE, SIDE, &a, planes))
            print_planes(f, "picture", planes, P);
        ggn_crop_planes(c, 3, SIDE, SIDE, 2, 3, 10, i >> 2 & 1 ? 10 : 7, &a, planes, other);
        print_planes(f, "crop", planes, 3 * 70);
        print_planes(f, "of reference", other, 3 * 70);
        fputc('\n', f);
    }
    c->denoised = NULL;
    ggn_series_set_release(&set);
    transcript_end(&t, "data-windows");
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(chains_are_as_they_were), cmocka_unit_test(windows_are_as_they_were),
                                       cmocka_unit_test(too_many_blocks_are_refused)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
