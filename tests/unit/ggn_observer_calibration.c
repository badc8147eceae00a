/* The model observer's calibration: on made-up people, parameter files, trials, and what is refused. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/approve.h"
#include "support/ggn_near.h"
#include "support/ggn_noise.h"
#include "support/ggn_observer_block.h"

#include "base/files.h"
#include "train/calibrate.h"
#include "train/views.h"
#include "sight/visibility.h"

/* --- calibration --- */

enum { VIEWS = 3, BLOCKS = 6 };

/* Views of made-up blocks, quiet and busy ones, and people who are an observer of the family. */
static void make_views(const char *dir, const struct ggn_observer *person, struct ggn_dataset *data, struct ggn_view *human)
{
    static const uint32_t few[] = {64, 384};
    for (int v = 0; v < VIEWS; v++) {
        char view[128], scene[24];
        double sigma[BLOCKS];
        struct ggn_noise n = {W, H, few, 2, 0, 0.0, 0.05 * v, (uint32_t)v + 1, 0};
        for (int i = 0; i < BLOCKS; i++)
            sigma[i] = (0.2 + 0.08 * i) * (1.0 + v);
        snprintf(view, sizeof view, "%s/view%d", dir, v);
        snprintf(scene, sizeof scene, "scene%d", v);
        ggn_noise_view(view, scene, &n, sigma, BLOCKS, 1.0);
    }
    assert_int_equal(ggn_dataset_open(dir, data, NULL), 0);
    assert_int_equal(data->n, VIEWS);
    struct base_threads *threads = base_threads_create(2, NULL);
    for (int v = 0; v < VIEWS; v++) {
        struct ggn_labels l;
        assert_int_equal(ggn_view_label(person, &data->views[v], GGN_FROM_HALVES, threads, &l, NULL), 0);
        human[v] = (struct ggn_view){.n = BLOCKS, .spp = malloc(BLOCKS * sizeof(double))};
        for (int i = 0; i < BLOCKS; i++)
            human[v].spp[i] = ggn_observer_to_study(l.labels[i].threshold);
        ggn_labels_release(&l);
    }
    base_threads_destroy(threads);
}

/* Halves against really recorded levels, of a quiet block, one that is noisy up to the last level, and one with texture. */
static void checks(void **state)
{
    (void)state;
    static const uint32_t few[] = {16, 32, 64, 128, 256, 512};
    static const double sigma[] = {0.15, 2.5, 0.5};
    char dir[] = "/tmp/ggn_checks.XXXXXX", view[64], command[80], *report;
    struct ggn_noise n = {40, 32, few, 6, 2048, 0.0, 0.02, 5, 0};
    struct ggn_dataset data;
    struct ggn_check found[3];
    struct ggn_labels l;
    struct base_err err = {0};
    size_t size;
    FILE *f = open_memstream(&report, &size);
    assert_non_null(mkdtemp(dir));
    snprintf(view, sizeof view, "%s/view", dir);
    ggn_noise_view(view, "scene", &n, sigma, 3, 1.0);
    assert_int_equal(ggn_dataset_open(dir, &data, NULL), 0);
    struct base_threads *threads = base_threads_create(2, NULL);
    assert_int_equal(ggn_view_check(&ggn_observer_default, &data.views[0], threads, found, &err), 0);
    for (int i = 0; i < 3; i++)
        fprintf(f, "block %u: halves %.6g recorded %.6g beyond %d curve %.6g\n", found[i].id, found[i].halves,
                found[i].recorded, found[i].beyond, found[i].curve);
    assert_int_equal(ggn_view_label(&ggn_observer_default, &data.views[0], GGN_FROM_LEVELS, threads, &l, &err), 0);
    fprintf(f, "%s, cap %g, spread %g\n", l.detail, l.cap, l.spread);
    for (uint32_t i = 0; i < l.n; i++)
        fprintf(f, "block %u: %.6g censored %d\n", l.labels[i].id, l.labels[i].threshold, l.labels[i].censored);
    fclose(f);
    approve_text("tests/unit/ggn_observer_checks.txt", report);
    free(report);
    ggn_labels_release(&l);
    base_threads_destroy(threads);
    ggn_dataset_release(&data);
    snprintf(command, sizeof command, "rm -r %s", dir);
    assert_int_equal(system(command), 0);
}

/* All that is written about a calibration, and about the labels of a view, as recorded. */
static void record(const char *path, const struct ggn_dataset_view *view, const struct ggn_calibration *c,
                   struct base_threads *threads)
{
    struct base_err err = {0};
    struct ggn_labels l;
    char *text, *report;
    size_t size;
    assert_int_equal(base_file_read(path, 1 << 20, &text, &size, &err), 0);
    FILE *f = open_memstream(&report, &size);
    fputs(text, f);
    free(text);
    for (int i = 0; i < c->n_blocks; i++)
        fprintf(f, "view %d block %u: people %.6g, the others' observer %.6g\n", c->blocks[i].view, c->blocks[i].id,
                c->blocks[i].human, c->blocks[i].predicted);
    assert_int_equal(ggn_view_label(&c->observer, view, GGN_FROM_HALVES, threads, &l, &err), 0);
    fprintf(f, "%s: %s, cap %g, spread %g\n", l.source, l.detail, l.cap, l.spread);
    for (uint32_t i = 0; i < l.n; i++)
        fprintf(f, "block %u: %.6g censored %d\n", l.labels[i].id, l.labels[i].threshold, l.labels[i].censored);
    ggn_labels_release(&l);
    fclose(f);
    approve_text("tests/unit/ggn_observer_calibration.txt", report);
    free(report);
}

static void calibration(void **state)
{
    (void)state;
    char dir[] = "/tmp/ggn_observer.XXXXXX", path[64], command[200];
    const struct ggn_observer person = {0.4, 0.3};
    struct ggn_dataset data;
    struct ggn_view human[VIEWS];
    struct ggn_calibration_input inputs[VIEWS];
    struct ggn_calibration c;
    struct ggn_observer back;
    struct base_err err = {0};
    assert_non_null(mkdtemp(dir));
    make_views(dir, &person, &data, human);
    for (int v = 0; v < VIEWS; v++)
        inputs[v] = (struct ggn_calibration_input){&data.views[v], &human[v]};
    struct base_threads *threads = base_threads_create(2, NULL);
    if (ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, &err) != 0)
        fail_msg("%s", err.text);
    assert_true(c.n_views == VIEWS && c.n_blocks == VIEWS * BLOCKS && c.views[1].blocks == BLOCKS);
    assert_near(c.observer.level, person.level, 0.01);
    for (int v = 0; v < VIEWS; v++)
        assert_true(c.views[v].median_abs_log2 < 0.05 && c.views[v].spearman > 0.9 && c.views[v].share_below == 0.0);
    /* A view whose people see more than the others' is wrong by what they see more, and the others are no worse for it. */
    ggn_calibration_release(&c);
    for (int i = 0; i < BLOCKS; i++)
        human[2].spp[i] *= 2.0;
    human[2].spp[5] = 12000; /* people look no further than 10,000: no point of a fit, and no error beyond */
    assert_int_equal(ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, &err), 0);
    assert_near(c.views[2].median_log2, -1.0, 0.1);
    c.views[2].level *= 1.5; /* so that it can be told from the others' */
    snprintf(path, sizeof path, "%s/observer.json", dir);
    assert_int_equal(ggn_calibration_write(path, &c, &err), 0);
    record(path, &data.views[1], &c, threads);
    assert_int_equal(ggn_observer_read(path, NULL, &back, &err), 0);
    assert_near(back.level, c.observer.level, 1e-9);
    assert_near(back.spread, c.observer.spread, 1e-9);
    assert_int_equal(ggn_observer_read(path, "view2", &back, &err), 0);
    assert_near(back.level, c.views[2].level, 1e-9);
    assert_true(fabs(back.level - c.observer.level) > 0.01);
    assert_int_equal(ggn_observer_read(path, "view9", &back, &err), 0); /* no part of the fit */
    assert_near(back.level, c.observer.level, 1e-9);
    ggn_calibration_release(&c);
    assert_int_equal(ggn_calibrate(inputs, 1, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "calibration leaves one view out: it needs at least 2 views, there is 1");
    for (int i = 0; i < BLOCKS; i++) /* one block below the cap in each of two views is enough, none in one is not */
        human[0].spp[i] = human[1].spp[i] = i < 1 ? human[1].spp[i] : 10000;
    assert_int_equal(ggn_calibrate(inputs, 2, GGN_FROM_HALVES, threads, &c, &err), 0);
    ggn_calibration_release(&c);
    human[0].spp[0] = 10000;
    assert_int_equal(ggn_calibrate(inputs, 2, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "calibration needs a noisy block with a threshold below 10000 in the other views");
    human[1].spp[3] = 0;
    assert_int_equal(ggn_calibrate(inputs, 2, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    snprintf(command, sizeof command, "%s/view1: block 3 has no threshold in ''", dir);
    assert_string_equal(err.text, command);
    human[1].n = BLOCKS - 1;
    assert_int_equal(ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    snprintf(command, sizeof command, "'' has 5 thresholds, %s/view1 has 6 blocks of 96 pixels", dir);
    assert_string_equal(err.text, command);
    base_threads_destroy(threads);
    for (int v = 0; v < VIEWS; v++)
        free(human[v].spp);
    ggn_dataset_release(&data);
    snprintf(command, sizeof command, "rm -r %s", dir);
    assert_int_equal(system(command), 0);
}

/* The people of three views see from 0.3, mostly 0.4 and 0.5 on: without the third, most see from 0.3 on; with it, 0.4 is the
 * nearest to all. */
static void left_out(void **state)
{
    (void)state;
    char dir[] = "/tmp/ggn_observer.XXXXXX", command[64];
    const struct ggn_observer people[] = {{0.3, 0.3}, {0.4, 0.3}, {0.5, 0.3}};
    struct ggn_dataset data;
    struct ggn_view human[VIEWS];
    struct ggn_calibration_input inputs[VIEWS];
    struct ggn_calibration c;
    assert_non_null(mkdtemp(dir));
    make_views(dir, &people[0], &data, human);
    struct base_threads *threads = base_threads_create(2, NULL);
    for (int v = 0; v < VIEWS; v++) {
        struct ggn_labels l;
        assert_int_equal(ggn_view_label(&people[v], &data.views[v], GGN_FROM_HALVES, threads, &l, NULL), 0);
        for (int i = v == 1 ? 1 : 0; i < BLOCKS; i++)
            human[v].spp[i] = ggn_observer_to_study(l.labels[i].threshold);
        ggn_labels_release(&l);
        inputs[v] = (struct ggn_calibration_input){&data.views[v], &human[v]};
    }
    assert_int_equal(ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, NULL), 0);
    assert_near(c.views[2].level, 0.3, 0.01);
    assert_near(c.observer.level, 0.4, 0.01);
    ggn_calibration_release(&c);
    base_threads_destroy(threads);
    for (int v = 0; v < VIEWS; v++)
        free(human[v].spp);
    ggn_dataset_release(&data);
    snprintf(command, sizeof command, "rm -r %s", dir);
    assert_int_equal(system(command), 0);
}

static void parameters(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_observer.XXXXXX";
    struct ggn_observer o;
    struct base_err err = {0};
    FILE *f = fdopen(mkstemp(path), "w");
    fputs("{\"level\": 0.3}", f);
    fclose(f);
    assert_int_equal(ggn_observer_read(path, NULL, &o, &err), BASE_EINVAL);
    unlink(path);
}

/* The file beside the code says what the code has built in. */
static void built_in(void **state)
{
    (void)state;
    struct ggn_observer o;
    struct base_err err = {0};
    if (ggn_observer_read("ggn/sight/observer.json", NULL, &o, &err) != 0)
        fail_msg("%s", err.text);
    assert_near(o.level, ggn_observer_default.level, 1e-6);
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

/* Whole lines of what cannot be judged. */
static void refusals(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct ggn_curve c;
    struct seq_block b = make_block(0.3, 0.0, 7, 0);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 1, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "block 7 has no reference: record one, or use --source halves");
    for (uint32_t l = 0; l < b.n_levels; l++)
        for (uint32_t p = 0; p < b.levels[l].n_planes; p++)
            if (b.levels[l].planes[p].plane == SEQ_PLANE_HALF_F16)
                b.levels[l].n_planes = p;
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text,
                        "block 7 has no full level with a half-buffer difference: record one, or use --source levels");
    seq_block_release(&b);
}

/* Parameters at their limits, and a fit that leaves a view out. */
static void parameter_files(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int good;
    } files[] = {
        {"{\"level\":1e-6,\"spread\":1e-3}", 1},
        {"{\"level\":1e3,\"spread\":10}", 1},
        {"{\"level\":9e-7,\"spread\":1}", 0},
        {"{\"level\":1001,\"spread\":1}", 0},
        {"{\"level\":1,\"spread\":9e-4}", 0},
        {"{\"level\":1,\"spread\":10.1}", 0},
        {"{\"level\":\"1\",\"spread\":1}", 0},
        {"[]", 0},
        {"{\"level\":1,\"spread\":1,\"each_view_left_out\":[{\"name\":\"a\",\"level\":2},{\"name\":\"b\",\"level\":5}]}",
         2}};
    char path[] = "/tmp/ggn_parameters.XXXXXX", want[160];
    struct base_err err = {0};
    struct ggn_observer o;
    assert_true(close(mkstemp(path)) == 0);
    snprintf(want, sizeof want, "%s: level or spread is missing or out of range (ggn label --calibrate writes them)", path);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        o = (struct ggn_observer){7, 7};
        FILE *f = fopen(path, "w");
        fputs(files[i].text, f);
        fclose(f);
        assert_int_equal(ggn_observer_read(path, files[i].good == 2 ? "b" : "a", &o, &err), files[i].good ? 0 : BASE_EINVAL);
        if (!files[i].good)
            assert_string_equal(err.text, want);
        assert_true(files[i].good ? o.level != 7 : o.level == 7 && o.spread == 7);
        assert_true(files[i].good != 2 || (o.level == 5 && o.spread == 1));
    }
    FILE *f = fopen(path, "w"); /* another law's numbers */
    fputs("{\"level\":1,\"exponent\":0.5,\"spread\":1}", f);
    fclose(f);
    assert_int_equal(ggn_observer_read(path, NULL, &o, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "an observer with two fitted numbers"));
    unlink(path);
}

/* The most likely spread of the grid, by the definition; lines that are no trial. */
static void trials_by_hand(void **state)
{
    (void)state;
    static const char text[] =
        "\xef\xbb\xbf" /* no number, but no part of the first one */
        "0.0;1.0;1\n\n0.0;2.0;1\n0.0;3.0;0\n255.0;4.0;1\n255.0;6.0;0\r\n0;2;0 \t\n256;1;1\n-1;1;1\n1;0;1\n1;1e6;1\n"
        "1;5;2\n1;5;0.5\n1;5\n1,5,1\n1;5;1;\n3;999999;0";
    static const struct {
        int block;
        double level;
        int seen;
    } good[] = {{0, 1, 1}, {0, 2, 1}, {0, 3, 0}, {255, 4, 1}, {255, 6, 0}, {0, 2, 0}, {3, 999999, 0}};
    char path[] = "/tmp/ggn_trials.XXXXXX", want[64];
    double spread = 0, likely = -INFINITY, wanted = 0;
    int blocks, n, skipped;
    struct base_err err = {0};
    FILE *f = fdopen(mkstemp(path), "w");
    fputs(text, f);
    fclose(f);
    assert_int_equal(ggn_trials_spread(path, &spread, &blocks, &n, &skipped, &err), 0);
    assert_true(blocks == 3 && n == 7 && skipped == 9);
    for (double s = 0.05; s < 3; s *= 1.05) {
        double total = 0;
        for (int k = 0; k < 3; k++) {
            const int block = (const int[]){0, 255, 3}[k];
            double best = -INFINITY;
            for (int at = 0; at <= 200; at++) {
                double sum = 0;
                for (int i = 0; i < 7; i++) {
                    double p = 0.01 + 0.49 * erfc((log2(20 * good[i].level) - (4 + 0.05 * at)) / s / sqrt(2));
                    sum += good[i].block == block ? log(good[i].seen ? p : 1 - p) : 0;
                }
                best = fmax(best, sum);
            }
            total += best;
        }
        if (total > likely) {
            likely = total;
            wanted = s;
        }
    }
    assert_near(spread, wanted, 1e-9);
    f = fopen(path, "w");
    fputs("nothing\n", f);
    fclose(f);
    assert_int_equal(ggn_trials_spread(path, &spread, &blocks, &n, &skipped, &err), BASE_EINVAL);
    snprintf(want, sizeof want, "%s: no trials in it", path);
    assert_string_equal(err.text, want);
    assert_true(blocks == 0 && n == 0 && skipped == 1);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(calibration),     cmocka_unit_test(left_out),       cmocka_unit_test(parameters),
        cmocka_unit_test(built_in),        cmocka_unit_test(trials),         cmocka_unit_test(refusals),
        cmocka_unit_test(parameter_files), cmocka_unit_test(trials_by_hand), cmocka_unit_test(checks),
    };
    return cmocka_run_group_tests_name("observer calibration", tests, NULL, NULL);
}
