/* Statistics of evaluation: small cases worked by hand, and the table of published models against people. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"

#include "eval/compare.h"

static void correlations(void **state)
{
    (void)state;
    const double x[] = {1, 2, 3, 4}, y[] = {2, 4, 6, 9}, down[] = {4, 3, 2, 1}, flat[] = {5, 5, 5, 5}, ties[] = {1, 1, 2, 3};
    double rho;
    assert_near(ggn_stats_pearson(x, y, 4), 11.5 / sqrt(5.0 * 26.75), 1e-12);
    assert_near(ggn_stats_pearson(x, down, 4), -1.0, 1e-12);
    assert_true(isnan(ggn_stats_pearson(x, flat, 4)));
    assert_int_equal(ggn_stats_spearman(x, y, 4, &rho, NULL), 0);
    assert_near(rho, 1.0, 1e-12);
    ggn_stats_spearman(x, ties, 4, &rho, NULL); /* ranks 1.5 1.5 3 4 */
    assert_near(rho, 4.5 / sqrt(5.0 * 4.5), 1e-12);
}

static void quantiles(void **state)
{
    (void)state;
    double x[] = {4, 1, 3, 2};
    assert_near(ggn_stats_quantile(x, 4, 0.5), 2.5, 1e-12);
    assert_near(ggn_stats_quantile(x, 4, 0.25), 1.75, 1e-12);
    assert_near(ggn_stats_quantile(x, 4, 1.0), 4.0, 0.0);
    assert_true(isnan(ggn_stats_quantile(x, 0, 0.5)));
}

static void roc(void **state)
{
    (void)state;
    const double score[] = {0.1, 0.4, 0.35, 0.8}, tied[] = {1, 1, 1, 1};
    const unsigned char label[] = {0, 0, 1, 1}, all[] = {1, 1, 1, 1};
    double auc, cut, accuracy;
    ggn_stats_auc(score, label, 4, &auc, NULL);
    assert_near(auc, 0.75, 1e-12);
    ggn_stats_auc(tied, label, 4, &auc, NULL);
    assert_near(auc, 0.5, 1e-12);
    ggn_stats_auc(score, all, 4, &auc, NULL);
    assert_true(isnan(auc));
    ggn_stats_best_cut(score, label, 4, &cut, &accuracy, NULL);
    assert_near(accuracy, 0.75, 1e-12);
    assert_true(cut > 0.1 && cut < 0.35);
    ggn_stats_best_cut(tied, label, 4, &cut, &accuracy, NULL);
    assert_near(accuracy, 0.5, 1e-12);
}

static void agreement(void **state)
{
    (void)state;
    const double truth[] = {100, 1000, 10000, 2000}, model[] = {200, 790, 10000, 1700};
    struct ggn_agreement a;
    struct base_err err = {0};
    assert_int_equal(ggn_stats_agreement(truth, model, 4, 10000, &a, &err), 0);
    assert_int_equal(a.below_cap, 3);
    assert_near(a.mae, 610.0 / 4, 1e-9);
    assert_near(a.mae_below_cap, 610.0 / 3, 1e-9);
    assert_near(a.rmse, 189.80252896102306, 1e-9);       /* sqrt(144100 / 4) */
    assert_near(a.pearson_r, 0.9992308294157498, 1e-12); /* Python's, of the definition */
    assert_near(a.pearson_r_below_cap, 0.9957550460225943, 1e-12);
    assert_near(a.spearman, 1.0, 1e-12);
    assert_near(a.share_below, 0.5, 0);
    assert_near(a.early_stop_rate, 0.25, 0); /* 790 < 800; 1700 > 1600 */
    assert_near(a.samples_ratio, 12690.0 / 13100.0, 1e-12);
    assert_near(a.within_half, 0.75, 0);
    assert_near(a.within_one, 1.0, 0);
    assert_int_equal(ggn_stats_agreement(truth, model, 0, 10000, &a, &err), 0);
    assert_true(a.blocks == 0 && isnan(a.mae) && isnan(a.spearman) && isnan(a.median_log2) && isnan(a.within_one));
}

static void check_model(const char *path, const double want[9])
{
    struct ggn_thresholds people = {0}, model = {0};
    struct ggn_pairing p;
    struct ggn_agreement a;
    struct base_err err = {0};
    if (ggn_thresholds_read("../shared/human/human-thresholds.csv", 200, &people, &err) != 0 ||
        ggn_thresholds_read(path, 200, &model, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(ggn_pairing_init(&p, &people, &model, NULL, &err), 0);
    assert_int_equal(p.n_views, 40);
    assert_int_equal(p.n, 640);
    assert_int_equal(ggn_stats_agreement(p.truth, p.model, p.n, 10000, &a, &err), 0);
    const double got[9] = {a.pearson_r_below_cap, a.pearson_r,     a.spearman, a.mae, a.mae_below_cap, a.rmse,
                           a.share_below,         a.samples_ratio, 0};
    for (int i = 0; i < 8; i++)
        assert_near(got[i], want[i], i >= 3 && i <= 5 ? 0.0501 : 0.0000501);
    ggn_pairing_release(&p);
    ggn_thresholds_release(&people);
    ggn_thresholds_release(&model);
}

static void published_table(void **state)
{
    (void)state;
    FILE *f = fopen("../shared/human/human-thresholds.csv", "r");
    if (!f) {
        print_message("# SKIP ../shared is absent\n");
        skip();
    }
    fclose(f);
    check_model("../shared/human/SVD-Entropy-thresholds.csv",
                (double[9]){0.7083, 0.7666, 0.7766, 1580.8, 1512.9, 2159.2, 0.4438, 0.9373, 0});
    check_model("../shared/human/26-attributes-thresholds.csv",
                (double[9]){0.6187, 0.6862, 0.6995, 1875.3, 1907.4, 2522.4, 0.3750, 1.0667, 0});
}

static int parse(const char *text, struct ggn_thresholds *t, struct base_err *err)
{
    char *copy = malloc(strlen(text) + 1);
    strcpy(copy, text);
    int rc = ggn_thresholds_parse_csv("x.csv", copy, t, err);
    free(copy);
    return rc;
}

static void csv(void **state)
{
    (void)state;
    struct ggn_thresholds t = {0};
    struct base_err err = {0};
    assert_int_equal(parse("# note\na;1;2.5;3;\r\n\nb;7\n", &t, &err), 0);
    assert_int_equal(t.n, 2);
    assert_int_equal(t.views[0].n, 3);
    assert_near(ggn_thresholds_find(&t, "a")->spp[1], 2.5, 0);
    assert_near(ggn_thresholds_find(&t, "b")->spp[0], 7, 0);
    assert_null(ggn_thresholds_find(&t, "c"));
    ggn_thresholds_release(&t);
    static const char *const bad[] = {"",      "a",      "a;",     ";1;",    "a;x;",       "a;1;;",
                                      "a;-1;", "a;nan;", "a;inf;", "a;1 2;", "a;1;\na;2;", "a;0;"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        err = (struct base_err){0};
        if (parse(bad[i], &t, &err) != BASE_EINVAL || err.text[0] == '\0')
            fail_msg("'%s' was accepted", bad[i]);
        assert_int_equal(t.n, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(correlations), cmocka_unit_test(quantiles),       cmocka_unit_test(roc),
        cmocka_unit_test(agreement),    cmocka_unit_test(published_table), cmocka_unit_test(csv),
    };
    return cmocka_run_group_tests_name("eval_stats", tests, NULL, NULL);
}
