/* The statistics of `lull-study report` against published values, closed forms and data whose answer is known. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "study/summary.h"

#define NEAR(a, b, by) assert_true(fabs((a) - (b)) <= (by))

static void quantiles_are_those_of_the_tables(void **state)
{
    (void)state;
    NEAR(ggn_study_normal(1.959963985), 0.975, 1e-9);
    NEAR(ggn_study_normal_quantile(0.975), 1.959963985, 1e-8);
    NEAR(ggn_study_normal_quantile(0.5), 0.0, 1e-12);
    NEAR(ggn_study_t975(1), 12.7062, 1e-4);
    NEAR(ggn_study_t975(10), 2.2281, 1e-4);
    NEAR(ggn_study_t975(40), 2.0211, 2e-3);
    NEAR(ggn_study_t975(1000), 1.9623, 1e-3);
    NEAR(ggn_study_t975(2), 4.3027, 1e-4);
    NEAR(ggn_study_t975(30), 2.0423, 1e-4);
    NEAR(ggn_study_t975(31), 1.959964 + (pow(1.959964, 3) + 1.959964) / 124.0, 1e-5);
    NEAR(ggn_study_normal(-1.0), 0.158655254, 1e-9);
    NEAR(ggn_study_normal_quantile(0.001), -3.090232306, 1e-8);
    NEAR(ggn_study_normal_quantile(0.0), -7.941345326, 1e-6);    /* of 1e-15 */
    NEAR(ggn_study_normal_quantile(1.0), 7.941345326, 0.1);      /* 1 - 1e-15 is rounded */
    NEAR(ggn_study_p_correct(5.0, 6.0, 0.5), 0.988624934, 1e-8); /* half and half of 0.977249868 */
}

static void wilson_is_wilson(void **state)
{
    double lo, hi;
    (void)state;
    ggn_study_wilson(8, 10, &lo, &hi); /* Agresti & Coull 1998's kind of example, by hand */
    NEAR(lo, 0.4902, 5e-4);
    NEAR(hi, 0.9433, 5e-4);
    ggn_study_wilson(0, 10, &lo, &hi);
    NEAR(lo, 0.0, 0.0);
    NEAR(hi, 0.2775, 5e-4);
    ggn_study_wilson(10, 10, &lo, &hi);
    NEAR(lo, 0.7225, 5e-4);
    NEAR(hi, 1.0, 0.0);
    ggn_study_wilson(1, 10, &lo, &hi);
    NEAR(lo, 0.0179, 5e-4);
    NEAR(hi, 0.4042, 5e-4);
    ggn_study_wilson(50, 100, &lo, &hi);
    NEAR(lo + hi, 1.0, 1e-12);
}

enum { LEVELS = 13, EACH = 40 };

/* EACH choices per level at exactly the expected share, half with the noise first; bias moves the shares apart. */
static int expected_choices(struct ggn_study_choice *c, double t, double spread, double bias)
{
    int n = 0;
    for (int l = 0; l < LEVELS; l++)
        for (int first = 0; first < 2; first++) {
            double x = 4.0 + 0.5 * l, d = ggn_study_normal_quantile(ggn_study_p_correct(x, t, spread));
            int correct = (int)lround(EACH / 2 * ggn_study_normal(first ? d + bias : d - bias));
            for (int i = 0; i < EACH / 2; i++)
                c[n++] = (struct ggn_study_choice){x, first, i < correct};
        }
    return n;
}

static void a_curve_comes_back(void **state)
{
    static const struct {
        double t, spread, bias;
    } cases[] = {{7.0, 0.5, 0.0}, {6.3, 0.33, 0.0}, {8.1, 0.75, 0.0}, {7.0, 0.5, 0.8}, {7.0, 0.5, -0.4}};
    struct ggn_study_choice c[LEVELS * EACH];
    struct base_err err = {0};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct ggn_study_curve curve = {
            .choices = c, .n = expected_choices(c, cases[i].t, cases[i].spread, cases[i].bias), .x_min = 4, .x_max = 10};
        assert_int_equal(ggn_study_psychometric(&curve, 1, &err), 0);
        const struct ggn_study_estimate *e = &curve.estimate;
        NEAR(e->t, cases[i].t, 0.12);
        assert_true(e->lo < cases[i].t && cases[i].t < e->hi && e->hi - e->lo < 0.8);
        NEAR(log2(e->spread / cases[i].spread), 0.0, 0.7);
        assert_int_equal(e->trials, LEVELS * EACH);
    }
}

static void blocks_help_each_other(void **state)
{
    struct ggn_study_choice c[9][LEVELS * EACH];
    struct ggn_study_curve curves[9], alone;
    struct base_err err = {0};
    (void)state;
    for (int i = 0; i < 9; i++) {
        int n = expected_choices(c[i], 7.0, 0.33, 0.8), kept = 0;
        for (int k = i; k < n; k += 17)
            c[i][kept++] = c[i][k];
        curves[i] = (struct ggn_study_curve){.choices = c[i], .n = kept, .x_min = 4, .x_max = 10};
    }
    alone = curves[0];
    assert_int_equal(ggn_study_psychometric(&alone, 1, &err) | ggn_study_psychometric(curves, 9, &err), 0);
    assert_true(curves[0].estimate.hi - curves[0].estimate.lo < alone.estimate.hi - alone.estimate.lo);
}

/* The model once more, all of it at once: a person's spread and habits (prior), each block's own spread given the person's, a
 * threshold on a grid of 1/12 octave; the posterior of each block's threshold with everything else summed over. */
enum { SPREADS = 7, HABITS = 20, GRID = 200, JOINT = 3 };
static const double joint_spread[SPREADS] = {0.15, 0.22, 0.33, 0.5, 0.75, 1.1, 1.6};

static double joint_likelihood(const struct ggn_study_curve *c, double t, double spread, int habit)
{
    static const double lapses[4] = {0.0, 0.03, 0.08, 0.2}, biases[5] = {-0.8, -0.4, 0.0, 0.4, 0.8};
    double all = 1, lapse = lapses[habit % 4], bias = biases[habit / 4];
    for (int i = 0; i < c->n; i++) {
        double d = ggn_study_normal_quantile(ggn_study_p_correct(c->choices[i].x, t, spread));
        double p = fmin(0.5 * lapse + (1 - lapse) * ggn_study_normal(c->choices[i].first ? d + bias : d - bias), 1 - 1e-9);
        all *= c->choices[i].correct ? p : 1 - p;
    }
    return all;
}

static double joint_prior(int s, int h)
{
    static const double of_spread[SPREADS] = {0.05, 0.1, 0.2, 0.3, 0.2, 0.1, 0.05}, of_lapse[4] = {0.4, 0.4, 0.15, 0.05},
                        of_bias[5] = {0.06, 0.24, 0.4, 0.24, 0.06};
    return of_spread[s] * of_lapse[h % 4] * of_bias[h / 4];
}

static double joint_given(int b, int s) /* a block's spread, given the person's */
{
    int neighbours = s == 0 || s == SPREADS - 1 ? 1 : 2;
    return b == s ? 0.8 : abs(b - s) == 1 ? 0.2 / neighbours : 0;
}

/* Where a distribution over cells with these n + 1 edges reaches q, evenly spread within a cell. */
static double reached(const double *w, const double *edge, int n, double q)
{
    double sum = 0, below = 0;
    for (int i = 0; i < n; i++)
        sum += w[i];
    for (int i = 0; i < n; i++) {
        if (below + w[i] / sum >= q)
            return edge[i] + (edge[i + 1] - edge[i]) * (q - below) * sum / w[i];
        below += w[i] / sum;
    }
    return edge[n];
}

/* Edges half the way between neighbours, in octaves; the outer cells are as wide on either side of their spread. */
static void spread_edges(double edge[SPREADS + 1])
{
    for (int s = 1; s < SPREADS; s++)
        edge[s] = 0.5 * (log2(joint_spread[s - 1]) + log2(joint_spread[s]));
    edge[0] = 2 * log2(joint_spread[0]) - edge[1];
    edge[SPREADS] = 2 * log2(joint_spread[SPREADS - 1]) - edge[SPREADS - 1];
}

static void assert_quantiles(const struct ggn_study_estimate *e, const double *of_t, int n, const double of_s[SPREADS])
{
    static const double q[3] = {0.5, 0.025, 0.975};
    const double t[3] = {e->t, e->lo, e->hi}, s[3] = {e->spread, e->spread_lo, e->spread_hi};
    double edge[GRID + 1], edge_s[SPREADS + 1];
    for (int i = 0; i <= n; i++)
        edge[i] = 2.0 + (i - 0.5) / 12.0;
    spread_edges(edge_s);
    for (int k = 0; k < 3; k++) {
        NEAR(t[k], reached(of_t, edge, n, q[k]), 2e-3); /* as for the standard error */
        NEAR(log2(s[k]), reached(of_s, edge_s, SPREADS, q[k]), 5e-3);
    }
}

static void estimates_are_those_of_the_joint_posterior(void **state)
{
    static const double threshold[JOINT] = {5.5, 7, 8.2};
    static struct ggn_study_choice choices[JOINT][14];
    static double likelihood[JOINT][GRID][SPREADS][HABITS], evidence[JOINT][SPREADS][HABITS];
    struct ggn_study_curve c[JOINT];
    int n = (int)ceil((10.0 - 4.0 + 4.0) * 12) + 1;
    (void)state;
    for (int b = 0; b < JOINT; b++) {
        for (int i = 0; i < 14; i++) { /* around the threshold, with slips */
            double x = threshold[b] - 1.5 + 0.25 * i;
            choices[b][i] =
                (struct ggn_study_choice){x, (i + b) % 2, x < threshold[b] + (i % 3 == b ? 0.9 : -0.4) || i % 5 == 0};
        }
        c[b] = (struct ggn_study_curve){choices[b], 14, 4.0, 10.0, {0}};
        for (int i = 0; i < n; i++)
            for (int s = 0; s < SPREADS; s++)
                for (int h = 0; h < HABITS; h++)
                    likelihood[b][i][s][h] = joint_likelihood(&c[b], 2.0 + i / 12.0, joint_spread[s], h);
        memset(evidence[b], 0, sizeof evidence[b]);
        for (int s = 0; s < SPREADS; s++)
            for (int h = 0; h < HABITS; h++)
                for (int own = 0; own < SPREADS; own++)
                    for (int i = 0; i < n; i++)
                        evidence[b][s][h] += joint_given(own, s) * likelihood[b][i][own][h];
    }
    assert_int_equal(ggn_study_psychometric(c, JOINT, NULL), 0);
    for (int b = 0; b < JOINT; b++) {
        double w[GRID] = {0}, of_s[SPREADS] = {0}, sum = 0, mean = 0, var = 0, below = 0;
        for (int i = 0; i < n; i++)
            for (int s = 0; s < SPREADS; s++)
                for (int h = 0; h < HABITS; h++) {
                    double others = joint_prior(s, h), mine = 0;
                    for (int k = 0; k < JOINT; k++)
                        others *= k == b ? 1 : evidence[k][s][h];
                    for (int own = 0; own < SPREADS; own++) {
                        mine += joint_given(own, s) * likelihood[b][i][own][h];
                        of_s[own] += others * joint_given(own, s) * likelihood[b][i][own][h];
                    }
                    w[i] += others * mine;
                }
        for (int i = 0; i < n; i++)
            sum += w[i];
        for (int i = 0; i < n; i++)
            mean += w[i] / sum * (2.0 + i / 12.0);
        for (int i = 0; i < n; i++) {
            var += w[i] / sum * pow(2.0 + i / 12.0 - mean, 2);
            below += 2.0 + (i + 0.5) / 12.0 <= c[b].estimate.t ? w[i] / sum : 0;
        }
        NEAR(c[b].estimate.se, sqrt(var), 1e-3); /* the product's d comes from a table */
        assert_quantiles(&c[b].estimate, w, n, of_s);
        assert_true(below <= 0.5 &&
                    below > 0.5 - 1.05 * w[(int)((c[b].estimate.t - 2.0) * 12 + 0.5)] / sum); /* the median's cell */
    }
}

static void slips_in_catch_trials_are_lapses(void **state)
{
    struct ggn_study_choice c[LEVELS * EACH + 6];
    struct base_err err = {0};
    (void)state;
    int n = expected_choices(c, 7.0, 0.5, 0.0);
    for (int i = 0; i < 6; i++)
        c[n++] = (struct ggn_study_choice){GGN_STUDY_PLAIN, i & 1, i < 3};
    struct ggn_study_curve curve = {.choices = c, .n = n, .x_min = 4, .x_max = 10};
    assert_int_equal(ggn_study_psychometric(&curve, 1, &err), 0);
    NEAR(curve.estimate.t, 7.0, 0.25);
    NEAR(curve.estimate.spread, 0.5, 0.3);
}

static void guessing_tells_nothing(void **state)
{
    struct ggn_study_choice c[200];
    struct ggn_study_curve curve = {.choices = c, .n = 200, .x_min = 4, .x_max = 10};
    struct base_err err = {0};
    (void)state;
    for (int i = 0; i < 200; i++)
        c[i] = (struct ggn_study_choice){4.0 + 0.5 * (i % LEVELS), i & 1, (i / 2) & 1};
    assert_int_equal(ggn_study_psychometric(&curve, 1, &err), 0);
    assert_true(curve.estimate.lo < 4.0); /* below every level: nothing was ever seen */
}

/* People over one view: settings[person][block] in octaves, one choice of words for excluded. */
static void people_of(struct ggn_study_people *p, const struct ggn_study *s, int n, const double *settings,
                      struct ggn_study_result *results, struct ggn_study_estimate *cells)
{
    static int first[2];
    first[1] = s->views[0].n_blocks;
    *p = (struct ggn_study_people){.study = s, .first = first, .n_cells = first[1], .n = n, .results = results};
    for (int i = 0; i < n; i++) {
        results[i] = (struct ggn_study_result){.cells = cells + i * first[1]};
        for (int b = 0; b < first[1]; b++)
            results[i].cells[b] =
                (struct ggn_study_estimate){.trials = 2, .t = settings[i * first[1] + b], .lo = 1, .hi = 2, .spread = 0.5};
    }
}

static uint32_t levels[] = {16, 1024};
static struct ggn_study_block blocks[] = {
    {0, 0, 0, 8, 8, 2, levels}, {1, 8, 0, 16, 8, 2, levels}, {2, 16, 0, 24, 8, 2, levels}, {3, 24, 0, 32, 8, 2, levels}};
static struct ggn_study_view view = {.name = "v", .width = 32, .height = 8, .n_blocks = 4, .blocks = blocks};

static void thresholds_are_means_over_people_that_count(void **state)
{
    const struct ggn_study s = {.task = GGN_STUDY_ADJUSTMENT, .n_views = 1, .views = &view};
    static const double settings[] = {5, 6, 7, 11, 6, 7, 8, 9, 7, 8, 9, 12, 0, 0, 0, 0};
    struct ggn_study_result results[4];
    struct ggn_study_estimate cells[16];
    struct ggn_study_threshold t[4];
    struct ggn_study_people p;
    (void)state;
    people_of(&p, &s, 4, settings, results, cells);
    strcpy(results[3].excluded, "because");
    ggn_study_thresholds(&p, t);
    NEAR(t[0].t, 6.0, 1e-12);
    NEAR(t[0].hi - t[0].t, 4.3027 / sqrt(3.0), 1e-4); /* standard deviation 1, three people */
    assert_int_equal(t[0].people, 3);
    NEAR(t[3].t, (10.0 + 9.0 + 10.0) / 3.0, 1e-12); /* none beyond the highest level, 2^10 */
    assert_int_equal(t[3].at_cap, 2);
    p.n = 1;
    ggn_study_thresholds(&p, t);
    NEAR(t[0].lo, 1.0, 0.0); /* one person: their own interval */
}

static void the_noise_ceiling_is_between_people(void **state)
{
    const struct ggn_study s = {.task = GGN_STUDY_ADJUSTMENT, .n_views = 1, .views = &view};
    static const double same[] = {5, 6, 7, 8, 6, 7, 8, 9, 4, 5, 6, 7}, other[] = {5, 6, 7, 8, 8, 7, 6, 5};
    struct ggn_study_result results[3];
    struct ggn_study_estimate cells[12];
    struct ggn_study_ceiling c;
    struct ggn_study_people p;
    struct base_err err = {0};
    (void)state;
    people_of(&p, &s, 3, same, results, cells);
    assert_int_equal(ggn_study_ceiling(&p, &c, &err), 0);
    assert_true(c.people == 3 && c.blocks == 4);
    NEAR(c.pearson_lower, 1.0, 1e-12);
    NEAR(c.spearman_upper, 1.0, 1e-12);
    NEAR(c.median_abs_log2_lower, (0.0 + 1.5 + 1.5) / 3.0, 1e-12); /* against the mean of the other two */
    NEAR(c.median_abs_log2_upper, (0.0 + 1.0 + 1.0) / 3.0, 1e-12);
    people_of(&p, &s, 2, other, results, cells);
    assert_int_equal(ggn_study_ceiling(&p, &c, &err), 0);
    NEAR(c.pearson_lower, -1.0, 1e-12);
    p.n = 1;
    assert_int_equal(ggn_study_ceiling(&p, &c, &err), 0);
    assert_true(c.people == 0 && isnan(c.pearson_lower));
}

static void judgements_are_shares(void **state)
{
    char conditions[1][GGN_STUDY_NAME] = {"a"};
    const struct ggn_study s = {
        .task = GGN_STUDY_VALIDATION, .n_views = 1, .views = &view, .n_conditions = 1, .conditions = conditions};
    struct ggn_study_judgement all[2][5];
    struct ggn_study_result results[2] = {{.judgements = all[0], .n_judgements = 5},
                                          {.judgements = all[1], .n_judgements = 5}};
    struct ggn_study_people p = {.study = &s, .n = 2, .results = results};
    (void)state;
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 5; k++) /* the first says same always, the second never; the last is a catch trial */
            all[i][k] = (struct ggn_study_judgement){0, k < 4 ? 0 : -1, i == 0, i == 0 ? 5 : 2};
    struct ggn_study_share share = ggn_study_share(&p, -1, 0);
    assert_true(share.n == 8 && share.same == 4);
    NEAR(share.rating, 3.5, 1e-12);
    NEAR(ggn_study_icc(&p, 0), 1.0, 1e-12); /* all of the variance is between people */
    NEAR(ggn_study_share(&p, 0, -1).share, 0.5, 0.0);
    strcpy(results[1].excluded, "because");
    assert_int_equal(ggn_study_share(&p, -1, 0).n, 4);
    assert_true(isnan(ggn_study_icc(&p, 0)));
}

static void power_is_the_textbook_formula(void **state)
{
    (void)state;
    assert_int_equal(ggn_study_people_needed(0.7, 0.1, 1, 0.0), 354); /* 7.849 · (0.21 + 0.24) / 0.01 = 353.2 */
    assert_int_equal(ggn_study_people_needed(0.7, 0.1, 10, 0.0), 36);
    assert_int_equal(ggn_study_people_needed(0.7, 0.1, 10, 1.0), 354); /* more of the same person tells nothing more */
    assert_int_equal(ggn_study_people_needed(0.05, 0.1, 1, 0.0), ggn_study_people_needed(0.15, 0.1, 1, 0.0));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quantiles_are_those_of_the_tables),
        cmocka_unit_test(wilson_is_wilson),
        cmocka_unit_test(a_curve_comes_back),
        cmocka_unit_test(blocks_help_each_other),
        cmocka_unit_test(estimates_are_those_of_the_joint_posterior),
        cmocka_unit_test(slips_in_catch_trials_are_lapses),
        cmocka_unit_test(guessing_tells_nothing),
        cmocka_unit_test(thresholds_are_means_over_people_that_count),
        cmocka_unit_test(the_noise_ceiling_is_between_people),
        cmocka_unit_test(judgements_are_shares),
        cmocka_unit_test(power_is_the_textbook_formula),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
