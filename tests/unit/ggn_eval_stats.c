/* Statistics of ggn: small cases worked by hand; tables of thresholds. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"

#include "data/thresholds.h"
#include "sight/stats.h"

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
    double auc;
    ggn_stats_auc(score, label, 4, &auc, NULL);
    assert_near(auc, 0.75, 1e-12);
    ggn_stats_auc(tied, label, 4, &auc, NULL);
    assert_near(auc, 0.5, 1e-12);
    ggn_stats_auc(score, all, 4, &auc, NULL);
    assert_true(isnan(auc));
}

static int parse(const char *text, struct ggn_thresholds *t, struct base_err *err)
{
    char *copy = malloc(strlen(text) + 1);
    strcpy(copy, text);
    int rc = ggn_thresholds_parse_csv("x.csv", copy, strlen(copy), t, err);
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
    assert_near(ggn_thresholds_of(&t, "a")->spp[1], 2.5, 0);
    assert_near(ggn_thresholds_of(&t, "b")->spp[0], 7, 0);
    assert_null(ggn_thresholds_of(&t, "c"));
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
        cmocka_unit_test(quantiles),
        cmocka_unit_test(roc),
        cmocka_unit_test(csv),
    };
    return cmocka_run_group_tests_name("eval_stats", tests, NULL, NULL);
}
