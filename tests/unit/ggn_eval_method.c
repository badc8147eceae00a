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

/* A method of these scores, [cases]. */
static int made_up(struct ggn_method *m, const double *score)
{
    int rc = ggn_method_init(m, &set, "made up", 1, NULL);
    if (!rc)
        memcpy(m->score, score, set.n * sizeof *score);
    return rc;
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
    assert_int_equal(made_up(&m, score), 0);
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
    assert_near(m.stop[3], 80, 0); /* two passes: 40 and 80 */
    ggn_method_release(&m);
    policy.ratio = 4; /* 20, 80, 320, 1280 */
    assert_int_equal(ggn_eval_trained(&m, &set, model, &policy, "empty", GGN_PRECISION_F32, NULL, threads, &err), 0);
    const struct ggn_eval_block *b = &set.blocks[0];
    for (size_t i = b->first; i < b->end; i++)
        assert_int_equal(isnan(m.score[i]), !(set.spp[i] == 80 || set.spp[i] == 320 || set.spp[i] == 1280));
    assert_near(m.stop[3], 320, 0);
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

/* Where a block stops by a cut and a limit of the guard, and what that costs a split. */
static void cost(const struct ggn_method *m, enum ggn_split split, double cut, double limit, double *early, double *samples)
{
    int n = 0;
    *early = *samples = 0;
    for (int b = 0; b < set.n_blocks; b++) {
        const struct ggn_eval_block *block = &set.blocks[b];
        double stop = block->cap;
        for (size_t i = block->first; i < block->end && block->split == split; i++)
            if (m->score[i] < cut && !(m->guard && m->guard[i] > limit)) {
                stop = set.spp[i];
                break;
            }
        if (block->split != split)
            continue;
        n++;
        *samples += stop;
        *early += stop < 0.8 * block->label.threshold;
    }
    *early /= n;
}

/* No other cut between two scores does better, whatever share of early stops is allowed. */
static void tuned_cuts_are_the_best(void **state)
{
    (void)state;
    static const double limits[] = {0.0, 1e-4, 1e-3, 1e-2, INFINITY};
    static double score[3 * BLOCKS * (LEVELS - WINDOW + 1)], guard[3 * BLOCKS * (LEVELS - WINDOW + 1)];
    for (int k = 0; k < 12; k++) {
        double rate = (double)(k % 6) / 5.0, best_early = INFINITY, best_samples = INFINITY, early, samples;
        struct ggn_method m;
        for (size_t i = 0; i < set.n; i++) { /* falling, with slips; and a guard that now and then holds */
            score[i] = 100.0 / set.spp[i] * exp(1.5 * ggn_noise_gauss((uint32_t)i, (uint32_t)k));
            guard[i] = 3e-4 * exp(3.0 * ggn_noise_gauss((uint32_t)i, (uint32_t)k + 100)) * 100.0 / set.spp[i];
        }
        assert_int_equal(made_up(&m, score), 0);
        m.guard = k % 3 ? guard : NULL;
        assert_int_equal(ggn_method_tune(&m, &set, GGN_SPLIT_VALIDATION, rate, NULL), 0);
        for (size_t i = 0; i <= set.n; i++)
            for (int g = m.guard ? 0 : 4; g < 5; g++) {
                cost(&m, GGN_SPLIT_VALIDATION, i < set.n ? score[i] : INFINITY, limits[g], &early, &samples);
                int fits = early <= rate, fitted = best_early <= rate;
                if (fits > fitted || (fits == fitted && (fits ? samples < best_samples : early < best_early))) {
                    best_early = early;
                    best_samples = samples;
                }
            }
        cost(&m, GGN_SPLIT_VALIDATION, m.cut, m.guard_limit, &early, &samples);
        assert_true(best_early <= rate ? early <= rate : early == best_early);
        if (best_early <= rate)
            assert_near(samples, best_samples, 0);
        double run = 0;
        for (int b = 0; b < set.n_blocks; b++)
            run += set.blocks[b].split == GGN_SPLIT_VALIDATION ? m.stop[b] : 0.0;
        assert_near(run, samples, 0);
        ggn_method_release(&m);
    }
}

/* Every figure of a method once more from its definition. */
static void figures(void **state)
{
    (void)state;
    struct ggn_method m;
    struct ggn_method_metrics f;
    assert_int_equal(made_up(&m, set.rse), 0);
    m.cut = 0.06;
    ggn_method_run(&m, &set);
    for (int b = 0; b < set.n_blocks; b++) /* time is no multiple of samples */
        for (size_t i = set.blocks[b].first; i < set.blocks[b].end; i++)
            set.seconds[i] *= 1.0 + b;
    assert_int_equal(ggn_method_measure(&m, &set, GGN_SPLIT_TEST, &f, NULL), 0);
    double needed = 0, spent = 0, time = 0, early = 0, flip = 0, ssim = 0, worst = 0, least = 1, right = 0, cases = 0,
           pairs = 0, won = 0;
    for (int b = 10; b < 15; b++) {
        const struct ggn_eval_block *block = &set.blocks[b];
        size_t at = block->first;
        while (at + 1 < block->end && set.rse[at] >= m.cut)
            at++;
        assert_near(m.stop[b], set.spp[at], 0);
        needed += block->label.threshold;
        spent += set.spp[at];
        time += set.seconds[at];
        early += set.spp[at] < 0.8 * block->label.threshold;
        flip += set.flip[at] / BLOCKS;
        ssim += set.ssim[at] / BLOCKS;
        worst = fmax(worst, set.flip[at]);
        least = fmin(least, set.ssim[at]);
        for (size_t i = block->first; i < block->end; i++)
            if (set.noisy[i] >= 0) {
                cases++;
                right += (set.rse[i] >= m.cut) == set.noisy[i];
                for (size_t k = set.blocks[10].first; k < set.blocks[14].end && set.noisy[i] == 1; k++)
                    if (set.noisy[k] == 0) {
                        pairs++;
                        won += set.rse[i] > set.rse[k] ? 1.0 : set.rse[i] == set.rse[k] ? 0.5 : 0.0;
                    }
            }
    }
    assert_true(f.blocks == BLOCKS && f.scenes == 1 && f.cases == (size_t)cases);
    assert_near(f.accuracy, right / cases, 1e-12);
    assert_near(f.auc, won / pairs, 1e-12);
    assert_near(f.auc_scene_mean, f.auc, 1e-12);
    assert_near(f.early_stop_rate, early / BLOCKS, 1e-12);
    assert_near(f.samples_ratio, spent / needed, 1e-12);
    assert_near(f.flip_mean, flip, 1e-12);
    assert_near(f.ssim_mean, ssim, 1e-12);
    assert_near(f.flip_worst, worst, 0);
    assert_near(f.ssim_worst, least, 0);
    /* the first count at which all blocks, and at all counts after it, are as good as the worst at its stop */
    size_t k = LEVELS - WINDOW;
    for (int good = 1; good && k > 0; k -= (size_t)good)
        for (int b = 10; b < 15; b++)
            good &= set.flip[set.blocks[b].first + k - 1] <= worst;
    double uniform = 0, uniform_time = 0;
    for (int b = 10; b < 15; b++) {
        uniform += set.spp[set.blocks[b].first + k];
        uniform_time += set.seconds[set.blocks[b].first + k];
    }
    assert_near(f.uniform_spp, set.spp[set.blocks[10].first + k], 0);
    assert_near(f.samples_vs_uniform, spent / uniform, 1e-12);
    assert_near(f.time_vs_uniform, time / uniform_time, 1e-12);
    assert_true(fabs(f.time_vs_uniform - f.samples_vs_uniform) > 1e-3);
    for (int b = 0; b < set.n_blocks; b++)
        for (size_t i = set.blocks[b].first; i < set.blocks[b].end; i++)
            set.seconds[i] /= 1.0 + b;
    ggn_method_release(&m);
}

/* The scale of the criterion halfbuf: √(area of the block / area of the picture), of blocks that are not square. */
static void errors_of_the_criteria(void **state)
{
    (void)state;
    struct ggn_method halfbuf, variance;
    int available;
    assert_int_equal(ggn_method_halfbuf(&halfbuf, &set, &available, NULL), 0);
    assert_int_equal(ggn_method_variance(&variance, &set, &available, NULL), 0);
    for (size_t i = 0; i < set.n; i++) {
        assert_near(halfbuf.score[i], set.dammertz[i] / sqrt(BLOCKS), 1e-12);
        assert_near(variance.score[i], set.rse[i], 0);
    }
    assert_true(halfbuf.guard == set.half_unsettled && variance.guard == set.rse_unsettled);
    ggn_method_release(&halfbuf);
    ggn_method_release(&variance);
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
    struct ggn_eval_options o = {.dir = dir, .window = WINDOW, .seed = 3};
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
        cmocka_unit_test(informed_scores),
        cmocka_unit_test(fixed_stops),
        cmocka_unit_test(decisions),
        cmocka_unit_test(continued),
        cmocka_unit_test(network),
        cmocka_unit_test(one_class),
        cmocka_unit_test(tuned_cuts_are_the_best),
        cmocka_unit_test(figures),
        cmocka_unit_test(errors_of_the_criteria),
        cmocka_unit_test(beyond_the_recording),
    };
    return cmocka_run_group_tests_name("eval_method", tests, setup, teardown);
}
