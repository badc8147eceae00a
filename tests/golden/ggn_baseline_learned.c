/* What the baselines learn from recorded scenes: scores, calibration, cut and stops. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/approve.h"
#include "support/ggn_noise.h"

#include "baselines/learned.h"

/* Where a row of scores below the cut ends first, else the last level. */
static double stop_of(const struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_eval_block *b)
{
    int row = 0;
    for (size_t i = b->first; i < b->end; i++) {
        row = m->score[i] < m->cut ? row + 1 : 0;
        if (row >= m->passes)
            return s->spp[i];
    }
    return b->cap;
}

static void put_method(FILE *f, const struct ggn_method *m, const struct ggn_baseline *b, const struct ggn_eval_set *s)
{
    const struct ggn_policy *p = &b->policy;
    fprintf(f, "> %s: passes %d; first %g ratio %g step %g, %d vectors\n", m->name, m->passes, p->first_spp, p->ratio,
            p->step_spp, b->svm.n_support);
    if (!b->lstm) /* in two epochs an LSTM learns nothing that could be told apart */
        fprintf(f, "cut %.5g scale %.4f shift %.4f threshold %.5g\n", m->cut, p->scale, p->shift, p->threshold);
    for (int k = 0; k < s->n_blocks; k++) {
        fprintf(f, "block %d", k);
        if (!b->lstm)
            fprintf(f, " stops at %g", stop_of(m, s, &s->blocks[k]));
        fputc(':', f);
        for (size_t i = s->blocks[k].first; i < s->blocks[k].end; i++)
            fprintf(f, " %.4f", m->score[i]);
        fputc('\n', f);
    }
}

/* All three on two scenes for training, one for validation: scores of every case, calibration, cadence, cut and stops as recorded; what a
 * look is made of, and what cannot be learned. */
static void learned_from_scenes(void **state)
{
    (void)state;
    static const uint32_t levels[] = {4, 8, 16, 32, 64, 128, 256, 512};
    static const double sigma[3][3] = {{0.2, 0.45, 0.8}, {0.3, 0.6, 0.9}, {0.25, 0.5, 0.7}};
    char root[] = "/tmp/ggn_learned.XXXXXX", path[96], *text;
    struct base_threads *threads = base_threads_create(2, NULL);
    struct ggn_eval_set set;
    struct base_err err = {0};
    size_t size;
    int skipped;
    FILE *report = open_memstream(&text, &size);
    assert_non_null(mkdtemp(root));
    for (uint32_t v = 0; v < 3; v++) {
        const struct ggn_noise n = {24, 22, levels, 8, 1024, 0, 0.02, v + 1, 0};
        char scene[8] = {(char)('a' + v), 0};
        snprintf(path, sizeof path, "%s/%s", root, scene);
        ggn_noise_view(path, scene, &n, sigma[v], 3, 200);
    }
    snprintf(path, sizeof path, "%s/split.json", root);
    FILE *f = fopen(path, "w");
    fputs("{\"train\": [\"a\", \"c\"], \"validation\": [\"b\"], \"test\": []}", f);
    fclose(f);
    const struct ggn_eval_options o = {.data = {.dir = root}, .window = 3, .recorded = 1};
    if (ggn_eval_set_load(&set, &o, threads, &skipped, &err))
        fail_msg("%s", err.text);
    for (int kind = 0; kind < GGN_BASELINES; kind++)
        for (int split = GGN_SPLIT_TRAIN; split <= GGN_SPLIT_TEST; split++) {
            struct ggn_method m;
            struct ggn_baseline b;
            char want[96];
            int rc =
                ggn_method_learned(&m, &b, &set, (enum ggn_baseline_kind)kind, (enum ggn_split)split, 0.2, 2, threads, &err);
            snprintf(want, sizeof want, "%s: the split 'test' lacks one of the classes", ggn_baseline_titles[kind]);
            assert_int_equal(rc, split == GGN_SPLIT_TEST ? BASE_EINVAL : 0);
            if (rc) {
                assert_string_equal(err.text, want);
                assert_true(!b.lstm && !b.svm.values);
                continue;
            }
            assert_true(b.policy.threshold == fmin(m.cut, 1) && b.window == (kind ? 1 : 3));
            put_method(report, &m, &b, &set);
            ggn_method_release(&m);
            ggn_baseline_release(&b);
        }
    fclose(report);
    approve_text("tests/golden/ggn_baseline_learned.txt", text);
    free(text);
    ggn_eval_set_release(&set);
    base_threads_destroy(threads);
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", root);
    assert_int_equal(system(command), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(learned_from_scenes)};
    return cmocka_run_group_tests_name("baseline_learned", tests, NULL, NULL);
}
