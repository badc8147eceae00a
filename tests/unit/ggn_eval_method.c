/* Evaluation on made-up sequences whose thresholds are known: good scores look good, trivial ones do not, censoring is honoured. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "eval/trained.h"
#include "model/policy.h"

static const uint32_t levels[] = {20, 40, 80, 160, 320, 640, 1280};
enum { LEVELS = 7, WINDOW = 2, BLOCKS = 5 };

static char root[] = "/tmp/ggn_eval.XXXXXX";
static struct ggn_eval_set set;
static struct base_threads *threads;

static void shell(const char *command)
{
    char line[256];
    snprintf(line, sizeof line, "%s %s", command, root);
    assert_int_equal(system(line), 0);
}

/* Three scenes; thresholds 1000 sigma^2 = 50, 110, 230, 550, and one above the cap. */
static int setup(void **state)
{
    (void)state;
    static const char *const names[] = {"a", "b", "c"};
    char dir[128], path[128];
    struct base_err err = {0};
    int skipped;
    if (!mkdtemp(root))
        return -1;
    for (int v = 0; v < 3; v++) {
        double sigma[BLOCKS];
        static const double t[BLOCKS] = {50, 110, 230, 550, 3000};
        struct ggn_noise n = {24, 20, levels, LEVELS, 2000, 0, 0, (uint32_t)v + 1};
        for (int i = 0; i < BLOCKS; i++)
            sigma[i] = sqrt(t[i] / 1000.0 * (1.0 + 0.1 * v));
        snprintf(dir, sizeof dir, "%s/%s", root, names[v]);
        ggn_noise_view(dir, names[v], &n, sigma, BLOCKS, 1000.0);
    }
    snprintf(path, sizeof path, "%s/split.json", root);
    FILE *f = fopen(path, "w");
    fputs("{\"train\": [\"a\"], \"validation\": [\"b\"], \"test\": [\"c\"]}", f);
    fclose(f);
    threads = base_threads_create(2, &err);
    struct ggn_eval_options o = {.dir = root, .window = WINDOW, .quality = 1, .recorded = 1};
    if (!threads || ggn_eval_set_load(&set, &o, threads, &skipped, &err) != 0)
        fail_msg("%s", err.text);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    ggn_eval_set_release(&set);
    base_threads_destroy(threads);
    shell("rm -rf");
    return 0;
}

static void cases(void **state)
{
    (void)state;
    assert_int_equal(set.n_blocks, 3 * BLOCKS);
    assert_int_equal(set.n, 3 * BLOCKS * (LEVELS - WINDOW + 1));
    const struct ggn_eval_block *b = &set.blocks[0];
    assert_near(set.spp[b->first], 40, 0); /* the first window ends at the second level */
    assert_int_equal(set.noisy[b->first], 1); /* threshold 50 */
    assert_int_equal(set.noisy[b->first + 1], 0);
    const struct ggn_eval_block *capped = &set.blocks[4];
    assert_true(capped->label.censored);
    assert_int_equal(set.noisy[capped->end - 2], 1);
    assert_int_equal(set.noisy[capped->end - 1], -1); /* at the cap nothing is known */
    /* Better images with more samples, by either measure. */
    for (size_t i = b->first; i + 1 < b->end; i++)
        assert_true(set.flip[i + 1] < set.flip[i] && set.ssim[i + 1] > set.ssim[i]);
}

static void informed_scores(void **state)
{
    (void)state;
    struct ggn_method spp, halfbuf, variance;
    struct ggn_method_metrics a, b, c;
    int available;
    assert_int_equal(ggn_method_spp(&spp, &set, NULL), 0);
    assert_int_equal(ggn_method_halfbuf(&halfbuf, &set, &available, NULL), 0);
    assert_true(available);
    assert_int_equal(ggn_method_variance(&variance, &set, &available, NULL), 0);
    ggn_method_tune(&spp, &set, GGN_SPLIT_TRAIN, 0.0, NULL);
    ggn_method_tune(&halfbuf, &set, GGN_SPLIT_TRAIN, 0.0, NULL);
    ggn_method_tune(&variance, &set, GGN_SPLIT_TRAIN, 0.0, NULL);
    ggn_method_measure(&spp, &set, GGN_SPLIT_TEST, &a, NULL);
    ggn_method_measure(&halfbuf, &set, GGN_SPLIT_TEST, &b, NULL);
    ggn_method_measure(&variance, &set, GGN_SPLIT_TEST, &c, NULL);
    assert_true(b.auc > 0.99 && c.auc > 0.99 && a.auc < 0.93); /* noise / threshold is the same in all blocks */
    assert_true(b.best_accuracy > a.best_accuracy);
    assert_near(b.early_stop_rate, 0.0, 0.0);
    assert_true(b.samples_ratio < 1.5 && b.samples_ratio > 1.0 && a.samples_ratio > b.samples_ratio);
    assert_true(b.agreement.median_abs_log2 < 1.0); /* levels are an octave apart */
    assert_int_equal(b.censored, 1);
    assert_int_equal(b.agreement.blocks, BLOCKS - 1);
    assert_int_equal(b.cases, BLOCKS * (LEVELS - WINDOW + 1) - 1);
    /* Stopping where noise is equal costs less than uniform sampling that is as good everywhere. */
    assert_true(b.samples_vs_uniform < 0.7 && b.time_vs_uniform < 0.7 && b.flip_worst >= b.flip_mean);
    ggn_method_release(&spp);
    ggn_method_release(&halfbuf);
    ggn_method_release(&variance);
}

static void fixed_stops(void **state)
{
    (void)state;
    struct ggn_method constant, oracle;
    struct ggn_method_metrics m;
    ggn_method_constant(&constant, &set, NULL);
    assert_near(constant.stop[0], 230, 1e-6); /* median of the training scene alone */
    assert_near(constant.stop[14], 230, 1e-6);
    ggn_method_scene_mean(&oracle, &set, NULL);
    assert_near(oracle.stop[5], 1.1 * (50 + 110 + 230 + 550) / 5.0 + 1280 / 5.0, 1e-6);
    assert_true(oracle.is_oracle);
    ggn_method_measure(&constant, &set, GGN_SPLIT_TRAIN, &m, NULL);
    assert_true(isnan(m.auc));
    assert_near(m.early_stop_rate, 0.4, 1e-12); /* 550 and the censored one */
    assert_near(m.agreement.mae, (180 + 120 + 0 + 320) / 4.0, 1e-6);
    ggn_method_release(&constant);
    ggn_method_release(&oracle);
    for (int i = 0; i < BLOCKS; i++)
        set.blocks[i].split = GGN_SPLIT_NONE;
    ggn_method_constant(&constant, &set, NULL);
    assert_near(constant.stop[0], 1.1 * 230, 1e-6); /* without training scenes: of the validation scene */
    ggn_method_release(&constant);
    for (int i = 0; i < BLOCKS; i++)
        set.blocks[i].split = GGN_SPLIT_TRAIN;
}

/* Passes in a row, guards, unjudged cases. */
static void decisions(void **state)
{
    (void)state;
    static double score[3 * BLOCKS * (LEVELS - WINDOW + 1)], guard[3 * BLOCKS * (LEVELS - WINDOW + 1)];
    struct ggn_method m;
    const struct ggn_eval_block *b = &set.blocks[0];
    for (size_t i = 0; i < set.n; i++)
        score[i] = 1.0;
    score[b->first] = 0.2; /* one slip at 40 */
    score[b->first + 1] = 0.9;
    score[b->first + 2] = 0.1;
    score[b->first + 3] = (double)NAN;
    score[b->first + 4] = 0.1;
    assert_int_equal(ggn_method_scores(&m, &set, "made up", score, NULL), 0);
    m.cut = 0.5;
    ggn_method_run(&m, &set);
    assert_near(m.stop[0], 40, 0);
    assert_near(m.stop[1], 1280, 0); /* never stopped: the last level */
    m.passes = 2;
    ggn_method_run(&m, &set);
    assert_near(m.stop[0], 640, 0); /* 160, (320 not judged), 640 */
    m.guard = guard;
    guard[b->first + 2] = 0.01; /* a guard leaves the passes counted so far */
    ggn_method_run(&m, &set);
    assert_near(m.stop[0], 640, 0);
    guard[b->first + 4] = 0.01;
    ggn_method_run(&m, &set);
    assert_near(m.stop[0], 1280, 0);
    m.guard_limit = 0.01;
    ggn_method_run(&m, &set);
    assert_near(m.stop[0], 640, 0);
    ggn_method_release(&m);
}

/* Blocks go on with the samples of their reference; one whose threshold is only known to lie beyond the recording does not. */
static void continued(void **state)
{
    (void)state;
    struct ggn_eval_options o = {.dir = root, .window = WINDOW, .quality = 1, .seed = 3};
    struct ggn_eval_set more, again;
    struct base_err err = {0};
    int skipped;
    if (ggn_eval_set_load(&more, &o, threads, &skipped, &err) != 0 || ggn_eval_set_load(&again, &o, threads, &skipped, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(more.n_blocks, set.n_blocks);
    assert_near(more.blocks[4].cap, 1280, 0);
    assert_true(more.blocks[4].label.censored);
    const struct ggn_eval_block *b = &more.blocks[3], *recorded = &set.blocks[3];
    size_t known = recorded->end - recorded->first;
    assert_true(b->cap > 2000 && b->end - b->first > known && !b->label.censored);
    for (size_t i = 0; i < b->end - b->first; i++) {
        if (i < known)
            assert_near(more.dammertz[b->first + i], set.dammertz[recorded->first + i], 0);
        if (i > 0)
            assert_true(more.dammertz[b->first + i] < more.dammertz[b->first + i - 1] && more.flip[b->first + i] < more.flip[b->first + i - 1]);
    }
    for (size_t i = 0; i < more.n; i++)
        assert_true(more.flip[i] == again.flip[i]);
    ggn_eval_set_release(&more);
    ggn_eval_set_release(&again);
}

/* A model without weights says sigmoid(shift) of every window; its policy decides which levels it looks at and what holds a block back. */
static void network(void **state)
{
    (void)state;
    struct ggn_hyper hyper = {GGN_PRESET_LULL, 20, 24, WINDOW, 2, 2, 2, 0};
    struct base_err err = {0};
    struct ggn_method m;
    struct ggn_model *model = ggn_model_create(&hyper, &err);
    if (!model)
        fail_msg("%s", err.text);
    struct ggn_policy policy = ggn_policy_default();
    policy.first_spp = 20;
    policy.ratio = 2;
    policy.scale = 1;
    policy.shift = -1;
    policy.threshold = 0.5;
    policy.passes = 2;
    policy.gate_noise = policy.tail999 = policy.gini = 0;
    if (ggn_eval_trained(&m, &set, model, &policy, "empty", GGN_PRECISION_F32, threads, &err) != 0)
        fail_msg("%s", err.text);
    for (size_t i = 0; i < set.n; i++)
        assert_near(m.score[i], 1.0 / (1.0 + exp(1.0)), 1e-6);
    assert_near(m.stop[3], 80, 0); /* two passes: 40 and 80 */
    ggn_method_release(&m);
    policy.ratio = 4; /* 20, 80, 320, 1280 */
    assert_int_equal(ggn_eval_trained(&m, &set, model, &policy, "empty", GGN_PRECISION_F32, threads, &err), 0);
    const struct ggn_eval_block *b = &set.blocks[0];
    for (size_t i = b->first; i < b->end; i++)
        assert_int_equal(isnan(m.score[i]), !(set.spp[i] == 80 || set.spp[i] == 320 || set.spp[i] == 1280));
    assert_near(m.stop[3], 320, 0);
    ggn_method_release(&m);
    policy.ratio = 2;
    policy.passes = 1;
    policy.gate_noise = 0.04; /* grey noise of sigma 0.74/sqrt(n) in block 3 of the first scene, 0.22/sqrt(n) in block 0 */
    assert_int_equal(ggn_eval_trained(&m, &set, model, &policy, "empty", GGN_PRECISION_F32, threads, &err), 0);
    assert_true(m.stop[0] < m.stop[3] && m.stop[3] > 80);
    assert_near(m.score[set.blocks[3].first], 1.0 / (1.0 + exp(1.0)), 1e-6); /* asked all the same */
    assert_true(isinf(m.verdict[set.blocks[3].first]));                      /* but not believed */
    ggn_method_release(&m);
    ggn_model_destroy(model);
}

static void one_class(void **state)
{
    (void)state;
    signed char keep[3 * BLOCKS * (LEVELS - WINDOW + 1)];
    struct ggn_method m;
    struct ggn_method_metrics metrics;
    struct base_err err = {0};
    memcpy(keep, set.noisy, set.n);
    for (size_t i = 0; i < set.n; i++)
        set.noisy[i] = 1; /* no negative label at all */
    ggn_method_spp(&m, &set, NULL);
    assert_int_equal(ggn_method_tune(&m, &set, GGN_SPLIT_TRAIN, 0.05, &err), 0);
    assert_int_equal(ggn_method_measure(&m, &set, GGN_SPLIT_TEST, &metrics, &err), 0);
    assert_true(isnan(metrics.auc) && isnan(metrics.auc_scene_mean) && !isnan(metrics.samples_ratio));
    memcpy(set.noisy, keep, set.n);
    assert_int_equal(ggn_method_measure(&m, &set, GGN_SPLIT_NONE, &metrics, &err), BASE_EINVAL);
    ggn_method_release(&m);
    struct ggn_eval_options o = {.dir = root, .window = LEVELS + 1, .recorded = 1};
    struct ggn_eval_set none;
    int skipped;
    assert_int_equal(ggn_eval_set_load(&none, &o, threads, &skipped, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "a window needs 8"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cases), cmocka_unit_test(informed_scores), cmocka_unit_test(fixed_stops), cmocka_unit_test(decisions), cmocka_unit_test(continued), cmocka_unit_test(network),
        cmocka_unit_test(one_class),
    };
    return cmocka_run_group_tests_name("eval_method", tests, setup, teardown);
}
