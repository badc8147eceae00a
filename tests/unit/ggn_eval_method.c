/* Evaluation on made-up sequences whose thresholds are known: good scores look good, trivial ones do not, censoring is honoured. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "eval/method.h"
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
        struct ggn_noise n = {24, 20, levels, LEVELS, 2000, 0, 0, (uint32_t)v + 1, 0};
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
    struct ggn_eval_options o = {.data = {.dir = root}, .window = WINDOW, .quality = 1, .recorded = 1};
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
    assert_near(set.spp[b->first], 40, 0);    /* the first window ends at the second level */
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

/* A method of these scores, [cases]. */
static int made_up(struct ggn_method *m, const double *score)
{
    int rc = ggn_method_init(m, &set, "made up", 0, NULL);
    if (!rc)
        memcpy(m->score, score, set.n * sizeof *score);
    return rc;
}

/* Blocks go on with the samples of their reference; one whose threshold is only known to lie beyond the recording does not. */
static void continued(void **state)
{
    (void)state;
    struct ggn_eval_options o = {.data = {.dir = root}, .window = WINDOW, .quality = 1, .seed = 3};
    struct ggn_eval_set more, again;
    struct base_err err = {0};
    int skipped;
    if (ggn_eval_set_load(&more, &o, threads, &skipped, &err) != 0 ||
        ggn_eval_set_load(&again, &o, threads, &skipped, &err) != 0)
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
            assert_true(more.dammertz[b->first + i] < more.dammertz[b->first + i - 1] &&
                        more.flip[b->first + i] < more.flip[b->first + i - 1]);
    }
    for (size_t i = 0; i < more.n; i++)
        assert_true(more.flip[i] == again.flip[i]);
    ggn_eval_set_release(&more);
    ggn_eval_set_release(&again);
}

/* A model without weights says sigmoid(shift) of every window; its policy decides which levels it looks at. */
static void network(void **state)
{
    (void)state;
    struct ggn_hyper hyper = {GGN_PRESET_LULL, 20, 24, WINDOW, 2, 2, 2, 0, 0, 0};
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
    if (ggn_eval_trained(&m, &set, model, &policy, "empty", GGN_PRECISION_F32, NULL, threads, &err) != 0)
        fail_msg("%s", err.text);
    for (size_t i = 0; i < set.n; i++)
        assert_near(m.score[i], 1.0 / (1.0 + exp(1.0)), 1e-6);
    assert_true(m.passes == 2 && m.cut == 0.5);
    ggn_method_release(&m);
    policy.ratio = 4; /* 20, 80, 320, 1280 */
    assert_int_equal(ggn_eval_trained(&m, &set, model, &policy, "empty", GGN_PRECISION_F32, NULL, threads, &err), 0);
    const struct ggn_eval_block *b = &set.blocks[0];
    for (size_t i = b->first; i < b->end; i++)
        assert_int_equal(isnan(m.score[i]), !(set.spp[i] == 80 || set.spp[i] == 320 || set.spp[i] == 1280));
    ggn_method_release(&m);
    ggn_model_destroy(model);
}

static double stop_by_hand(const struct ggn_method *m, const struct ggn_eval_block *block, double cut)
{
    size_t i = block->first;
    for (int row = 0; i < block->end; i++)
        if (!isnan(m->score[i]) && (row = m->score[i] < cut ? row + 1 : 0) == m->passes)
            return set.spp[i];
    return block->cap;
}

/* What a cut costs a split. */
static void cost(const struct ggn_method *m, enum ggn_split split, double cut, double *early, double *samples)
{
    double needed = 0;
    int n = 0;
    *early = *samples = 0;
    for (int b = 0; b < set.n_blocks; b++) {
        const struct ggn_eval_block *block = &set.blocks[b];
        if (block->split != split)
            continue;
        const double stop = stop_by_hand(m, block, cut);
        n++;
        *samples += stop;
        needed += block->label.threshold;
        *early += stop < 0.8 * block->label.threshold;
    }
    *early /= n;
    *samples /= needed;
}

/* No other cut between two scores does better, whatever share of early stops is allowed; and the figures are of that cut. */
static void tuned_cuts_are_the_best(void **state)
{
    (void)state;
    static double score[3 * BLOCKS * (LEVELS - WINDOW + 1)];
    for (int k = 0; k < 12; k++) {
        double rate = (double)(k % 6) / 5.0, best_early = INFINITY, best_samples = INFINITY, early, samples;
        struct ggn_method_figures f;
        struct ggn_method m;
        for (size_t i = 0; i < set.n; i++) /* falling, with slips, and not judged everywhere */
            score[i] = i % 7 == 3 ? (double)NAN : 100.0 / set.spp[i] * exp(1.5 * ggn_noise_gauss((uint32_t)i, (uint32_t)k));
        assert_int_equal(made_up(&m, score), 0);
        m.passes = 1 + k % 2;
        assert_int_equal(ggn_method_tune(&m, &set, GGN_SPLIT_VALIDATION, rate, NULL), 0);
        for (size_t i = 0; i <= set.n; i++) {
            if (i < set.n && isnan(score[i]))
                continue;
            cost(&m, GGN_SPLIT_VALIDATION, i < set.n ? score[i] : INFINITY, &early, &samples);
            int fits = early <= rate, fitted = best_early <= rate;
            if (fits > fitted || (fits == fitted && (fits ? samples < best_samples : early < best_early))) {
                best_early = early;
                best_samples = samples;
            }
        }
        cost(&m, GGN_SPLIT_VALIDATION, m.cut, &early, &samples);
        assert_true(best_early <= rate ? early <= rate : early == best_early);
        if (best_early <= rate)
            assert_near(samples, best_samples, 0);
        assert_int_equal(ggn_method_measure(&m, &set, GGN_SPLIT_VALIDATION, &f, NULL), 0);
        assert_true(f.blocks == BLOCKS && f.scenes == 1 && f.early_stop_rate == early && f.samples_ratio == samples);
        ggn_method_release(&m);
    }
}

/* The area under the curve from its definition: windows that show noise against those that do not. */
static void area(void **state)
{
    (void)state;
    struct ggn_method m;
    struct ggn_method_figures f;
    double pairs = 0, won = 0, cases = 0;
    assert_int_equal(made_up(&m, set.rse), 0);
    m.cut = 0.06;
    assert_int_equal(ggn_method_measure(&m, &set, GGN_SPLIT_TEST, &f, NULL), 0);
    for (size_t i = set.blocks[10].first; i < set.blocks[14].end; i++) {
        cases += set.noisy[i] >= 0;
        for (size_t k = set.blocks[10].first; k < set.blocks[14].end && set.noisy[i] == 1; k++)
            if (set.noisy[k] == 0) {
                pairs++;
                won += set.rse[i] > set.rse[k] ? 1.0 : set.rse[i] == set.rse[k] ? 0.5 : 0.0;
            }
    }
    assert_true(f.windows == (size_t)cases);
    assert_near(f.auc, won / pairs, 1e-12);
    ggn_method_release(&m);
}

static void refused(void **state)
{
    (void)state;
    struct ggn_eval_options o = {.data = {.dir = root}, .window = LEVELS + 1, .recorded = 1};
    struct base_err err = {0};
    struct ggn_eval_set none;
    struct ggn_method m;
    int skipped;
    assert_int_equal(ggn_eval_set_load(&none, &o, threads, &skipped, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "a window needs 8"));
    assert_int_equal(made_up(&m, set.rse), 0);
    assert_int_equal(ggn_method_tune(&m, &set, GGN_SPLIT_NONE, 0.05, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "nothing to tune on in the split 'none'"));
    ggn_method_release(&m);
}

/* Beyond the recording noise falls with the root of the samples, time rises with them; what the guard counts is counted anew. */
static void beyond_the_recording(void **state)
{
    (void)state;
    char dir[64], view[128];
    const double sigma[2] = {5, 4};
    struct ggn_noise n = {24, 20, levels, LEVELS, 4000, 0, 0, 9, 0};
    snprintf(dir, sizeof dir, "%s.more", root);
    snprintf(view, sizeof view, "%s/view", dir);
    assert_int_equal(mkdir(dir, 0777), 0);
    ggn_noise_view(view, "view", &n, sigma, 2, 40.0);
    struct ggn_eval_options o = {.data = {.dir = dir}, .window = WINDOW, .seed = 3};
    struct ggn_eval_set more;
    struct base_err err = {0};
    int skipped;
    if (ggn_eval_set_load(&more, &o, threads, &skipped, &err) != 0)
        fail_msg("%s", err.text);
    double shares = 0, last_relmse = 0;
    for (int b = 0; b < 2; b++) {
        const struct ggn_eval_block *block = &more.blocks[b];
        const struct ggn_dataset_view *v = &more.images.data.views[0];
        const size_t known = block->first + LEVELS - WINDOW; /* the case of the last recorded level */
        static float mean[3 * 24 * 20], d[24 * 20];
        struct seq_block p;
        assert_true(block->end > known + 1);
        assert_int_equal(seq_manifest_read_block(v->dir, &v->manifest, block->index, &p, &err), 0);
        assert_int_equal(seq_mean(&p, &p.levels[LEVELS - 1], mean, &err), 0);
        assert_int_equal(seq_half_luminance(&p, &p.levels[LEVELS - 1], d, &err), 0);
        for (size_t i = known + 1; i < block->end; i++) {
            double by = more.spp[known] / more.spp[i], unsettled = 0;
            assert_near(more.dammertz[i], more.dammertz[known] * sqrt(by), 1e-9 * more.dammertz[known]);
            assert_near(more.rse[i], more.rse[known] * sqrt(by), 1e-9 * more.rse[known]);
            assert_near(more.seconds[i], more.seconds[known] / by, 1e-9 * more.seconds[i]);
            assert_near(more.relmse[i], more.relmse[known] * by, 1e-9 * more.relmse[known]);
            for (size_t k = 0; k < 24 * 20; k++) {
                double y = 0.2126 * (double)mean[k] + 0.7152 * (double)mean[480 + k] + 0.0722 * (double)mean[960 + k];
                unsettled += fabs((double)d[k]) * sqrt(by) > 0.5 * fmax(fabs(y), 0.02);
            }
            assert_near(more.half_unsettled[i], unsettled / 480, 1.5 / 480); /* a pixel may lie on the edge */
            shares += more.half_unsettled[i];
        }
        last_relmse = more.relmse[known];
        seq_block_release(&p);
    }
    assert_true(shares > 0.02 && last_relmse > 0);
    ggn_eval_set_release(&more);
    snprintf(view, sizeof view, "rm -rf %s", dir);
    assert_int_equal(system(view), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cases),
        cmocka_unit_test(continued),
        cmocka_unit_test(network),
        cmocka_unit_test(tuned_cuts_are_the_best),
        cmocka_unit_test(area),
        cmocka_unit_test(refused),
        cmocka_unit_test(beyond_the_recording),
    };
    return cmocka_run_group_tests_name("eval_method", tests, setup, teardown);
}
