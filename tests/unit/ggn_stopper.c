/* The stopping rule on made-up evidence: cadence, gate, passes, guard, and that asking twice changes nothing. */
#include <math.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "model/stopper.h"

struct show {
    double noise, logit, tail999, gini;
    int has_tail, asked; /* how often the network was */
};

static double noise(void *data)
{
    return ((struct show *)data)->noise;
}

static double logit(void *data)
{
    struct show *s = data;
    s->asked++;
    return s->logit;
}

static int tail(void *data, double *tail999, double *gini)
{
    const struct show *s = data;
    *tail999 = s->tail999;
    *gini = s->gini;
    return s->has_tail;
}

enum { WINDOW = 3 };

static struct ggn_stop_rule make_rule(void)
{
    struct ggn_stop_rule r = {.policy = ggn_policy_default(), .window = WINDOW};
    r.policy.first_spp = 10;
    r.policy.ratio = 1.5;
    r.policy.passes = 2;
    r.policy.threshold = 0.5;
    return r;
}

/* Asks and judges; returns whether it was looked at. */
static int ask(const struct ggn_stop_rule *rule, struct ggn_stopper *s, uint64_t spp, struct show *show)
{
    const struct ggn_evidence e = {show, noise, logit, tail};
    int look = ggn_stopper_ask(rule, s, spp);
    if (look)
        ggn_stopper_judge(rule, s, &e);
    return look;
}

static void levels_are_too_early_until_a_window_is_full(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper s = {0};
    struct show clean = {.noise = 0.01, .logit = -5};
    (void)state;
    assert_false(ask(&rule, &s, 4, &clean));
    assert_true(s.verdict.too_early && s.verdict.next_spp == 10);
    assert_true(ask(&rule, &s, 10, &clean));
    assert_true(s.verdict.too_early && s.verdict.next_spp == 15 && isnan(s.verdict.noise));
    assert_false(ask(&rule, &s, 12, &clean)); /* less than half a step */
    assert_true(s.verdict.next_spp == 15 && s.used == 1);
    assert_true(ask(&rule, &s, 15, &clean));
    assert_true(s.verdict.too_early && s.verdict.noise == 0.01);
    assert_int_equal(clean.asked, 0);
    assert_true(ask(&rule, &s, 23, &clean));
    assert_true(!s.verdict.too_early && !s.verdict.stop && s.passes == 1 && s.verdict.p < 0.01);
    struct ggn_stopper before = s;
    assert_false(ask(&rule, &s, 23, &clean)); /* the same question leaves no trace */
    assert_memory_equal(&before, &s, sizeof s);
    assert_true(ask(&rule, &s, 35, &clean));
    assert_true(s.verdict.stop && s.verdict.predicted_spp == 35);
    assert_int_equal(clean.asked, 2);
    assert_true(ggn_stopper_valid(&rule, &s));
}

static void fill(const struct ggn_stop_rule *rule, struct ggn_stopper *s, struct show *show)
{
    for (int i = 0; i < WINDOW; i++)
        assert_true(ask(rule, s, i ? s->verdict.next_spp : 10, show));
}

static void a_guard_holds_and_leaves_the_passes(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper s = {0};
    struct show show = {.noise = 0.01, .logit = -5, .tail999 = 4, .has_tail = 1};
    (void)state;
    rule.policy.tail999 = 3;
    fill(&rule, &s, &show);
    ask(&rule, &s, s.verdict.next_spp, &show);
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(!s.verdict.stop && s.passes == 3);
    show.tail999 = 2;
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(s.verdict.stop); /* at once: three passes were counted */
    /* where the statistics are not known nothing is held */
    memset(&s, 0, sizeof s);
    show.tail999 = 4;
    show.has_tail = 0;
    fill(&rule, &s, &show);
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(s.verdict.stop);
}

static void a_gate_spares_the_network_forgets_passes_and_leaps(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper s = {0};
    struct show show = {.noise = 0.01, .logit = -5};
    (void)state;
    rule.policy.gate_noise = 0.02;
    fill(&rule, &s, &show);
    assert_int_equal(s.passes, 1);
    show.noise = 0.08;
    uint64_t spp = s.verdict.next_spp;
    ask(&rule, &s, spp, &show);
    assert_true(isnan(s.verdict.p) && s.passes == 0 && show.asked == 1);
    assert_true(s.verdict.predicted_spp == 16.0 * (double)spp);
    /* half of that, at the first level of the window that ends there: 16 / 2 / 1.5^2, at most 4 */
    assert_int_equal(s.verdict.next_spp, (uint64_t)ceil((double)spp * 8 / 2.25));
    show.noise = 0.01;
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(s.verdict.too_early && s.regular == 1); /* the window has a gap that the network never saw */
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(s.verdict.too_early && show.asked == 1);
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_int_equal(show.asked, 2);
}

static void noise_between_two_passes_begins_anew(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper s = {0};
    struct show show = {.noise = 0.01, .logit = -5};
    (void)state;
    fill(&rule, &s, &show);
    show.logit = NAN; /* weights that overflow must not look converged */
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(s.passes == 0 && s.verdict.p == 1);
    show.logit = -5;
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_false(s.verdict.stop);
    ask(&rule, &s, s.verdict.next_spp, &show);
    assert_true(s.verdict.stop);
}

static void nobody_is_sent_beyond_the_limit(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper s = {0};
    struct show show = {.noise = 0.01, .logit = 5};
    (void)state;
    rule.spp_max = 30;
    fill(&rule, &s, &show);
    assert_int_equal(s.verdict.next_spp, 30);
    ask(&rule, &s, 30, &show);
    assert_true(!s.verdict.stop && s.verdict.next_spp == 45); /* the host ends it */
}

static void a_damaged_stopper_is_told(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper good = {.spp = {10, 15, 23}, .used = 3, .regular = 3}, bad = good;
    (void)state;
    assert_true(ggn_stopper_valid(&rule, &good));
    bad.spp[1] = 10;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.used = 4;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.regular = 5;
    assert_false(ggn_stopper_valid(&rule, &bad));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_are_too_early_until_a_window_is_full),
        cmocka_unit_test(a_guard_holds_and_leaves_the_passes),
        cmocka_unit_test(a_gate_spares_the_network_forgets_passes_and_leaps),
        cmocka_unit_test(noise_between_two_passes_begins_anew),
        cmocka_unit_test(nobody_is_sent_beyond_the_limit),
        cmocka_unit_test(a_damaged_stopper_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
