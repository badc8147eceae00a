/* The stopping rule on made-up evidence: cadence, passes, and that asking twice changes nothing. */
#include <math.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "model/stopper.h"
#include "support/splitmix.h"

struct show {
    double logit;
    int asked; /* how often the network was */
};

static double logit(void *data)
{
    struct show *s = data;
    s->asked++;
    return s->logit;
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
    const struct ggn_evidence e = {show, logit, NULL};
    int look = ggn_stopper_ask(rule, s, spp);
    if (look)
        ggn_stopper_decide(rule, s, &e);
    return look;
}

static void levels_are_too_early_until_a_window_is_full(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper s = {0};
    struct show clean = {.logit = -5};
    (void)state;
    assert_false(ask(&rule, &s, 4, &clean));
    assert_true(s.verdict.too_early && s.verdict.next_spp == 10);
    assert_true(ask(&rule, &s, 10, &clean));
    assert_true(s.verdict.too_early && s.verdict.next_spp == 15 && isnan(s.verdict.noise));
    assert_false(ask(&rule, &s, 12, &clean)); /* less than half a step */
    assert_true(s.verdict.next_spp == 15 && s.used == 1);
    assert_true(ask(&rule, &s, 15, &clean));
    assert_true(s.verdict.too_early && isnan(s.verdict.p));
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

static void noise_between_two_passes_begins_anew(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper s = {0};
    struct show show = {.logit = -5};
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

/* 2^63 samples and more fit a uint64_t, but no double and no schedule: what it says is never in the past. */
static void it_asks_again_later_however_many_samples_there_are(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    static const uint64_t many[] = {UINT64_C(1) << 53, 1000000000000000000u, UINT64_C(1) << 63, UINT64_MAX - 1, UINT64_MAX};
    (void)state;
    for (size_t i = 0; i < sizeof many / sizeof *many; i++) {
        struct ggn_stopper s = {0};
        struct show show = {.logit = 5};
        ask(&rule, &s, 10, &show);
        ask(&rule, &s, many[i], &show);
        assert_true(s.verdict.next_spp > many[i] || (s.verdict.next_spp == 0 && many[i] == UINT64_MAX));
        assert_true(ggn_stopper_valid(&rule, &s));
    }
}

static void a_damaged_stopper_is_told(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct ggn_stopper good = {.spp = {10, 15, 23},
                               .used = 3,
                               .asked_spp = 23,
                               .verdict = {.next_spp = 24, .p = 1, .predicted_spp = 0, .noise = (double)NAN}},
                       bad = good;
    (void)state;
    assert_true(ggn_stopper_valid(&rule, &good));
#define BAD(change) (bad = good, bad.change, assert_false(ggn_stopper_valid(&rule, &bad)))
    BAD(spp[1] = 10);
    BAD(spp[0] = 0);
    BAD(used = 4);
    BAD(asked_spp = 22);
    BAD(verdict.next_spp = 23);
    BAD(verdict.p = 1.0000001);
    BAD(verdict.p = -1e-9);
    BAD(verdict.predicted_spp = -1e98);
    BAD(verdict.predicted_spp = (double)INFINITY);
    BAD(verdict.noise = -1e-9);
    BAD(verdict.noise = (double)INFINITY);
    good.verdict = (struct ggn_verdict){.stop = 1, .p = 0, .predicted_spp = (double)NAN, .noise = 2};
    assert_true(ggn_stopper_valid(&rule, &good));
    BAD(verdict.stop = 2);
    BAD(verdict.too_early = 1);
    bad = (struct ggn_stopper){.verdict = {.stop = 1}};
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad.verdict.stop = 0; /* never asked */
    assert_true(ggn_stopper_valid(&rule, &bad));
}

/* --- the rule again, from its words --------------------------------------------------------------------------------------- */

struct oracle {
    uint64_t asked, spp[GGN_WINDOW_MAX], next;
    int used, passes, stop, too_early;
    double p, predicted;
};

static double next_level(const struct ggn_policy *p, double spp)
{
    double next = p->ratio > 1.001 ? floor(spp * p->ratio + 0.5) : spp + p->step_spp;
    return next > spp + 1 ? next : spp + 1;
}

static void oracle_schedule(const struct ggn_stop_rule *rule, struct oracle *o)
{
    double next = next_level(&rule->policy, (double)o->asked);
    o->next = next >= 1e18 ? UINT64_C(1000000000000000000) : (uint64_t)ceil(next);
}

/* One question; whether the image was looked at. */
static int oracle_ask(const struct ggn_stop_rule *rule, struct oracle *o, uint64_t spp, const struct show *show)
{
    const struct ggn_policy *p = &rule->policy;
    const double last = o->used ? (double)o->spp[o->used - 1] : 0;

    if (spp && o->asked == spp)
        return 0;
    o->asked = spp;
    if ((double)spp < p->first_spp || (o->used && (double)spp < last + (next_level(p, last) - last) / 2)) {
        if (!o->used) {
            o->stop = 0;
            o->p = o->predicted = (double)NAN;
            o->too_early = 1;
            o->next = (uint64_t)fmax(p->first_spp, (double)spp + 1);
        } else if (!o->stop && o->next <= spp) {
            o->next = spp + 1;
        }
        return 0;
    }
    if (o->used == rule->window)
        memmove(o->spp, o->spp + 1, (size_t)--o->used * sizeof o->spp[0]);
    o->spp[o->used++] = spp;
    o->stop = 0;
    o->p = o->predicted = (double)NAN;
    o->too_early = o->used < rule->window;
    if (!o->too_early) {
        o->p = isfinite(show->logit) ? 1 / (1 + exp(-(p->scale * show->logit + p->shift))) : 1;
        o->passes = o->p < p->threshold ? o->passes + 1 : 0;
        o->stop = o->passes >= p->passes;
    }
    if (o->stop)
        o->predicted = (double)spp;
    else
        oracle_schedule(rule, o);
    if (!o->stop && !o->too_early) {
        double above = log(o->p / (1 - o->p)) - log(p->threshold / (1 - p->threshold));
        o->predicted = p->slope > 0 && above > 0 ? (double)spp * exp2(above / p->slope) : (double)spp;
        o->predicted = p->slope > 0 ? fmax(o->predicted, (double)o->next) : (double)o->next;
    }
    return 1;
}

static double draw(void)
{
    static uint64_t state = 7;
    return splitmix_uniform(&state);
}

static int close_to(double a, double b) { return isnan(a) ? isnan(b) : fabs(a - b) <= 1e-9 * fmax(1, fabs(b)); }

static void same(const struct ggn_stop_rule *rule, const struct ggn_stopper *s, const struct oracle *o)
{
    const struct ggn_verdict *v = &s->verdict;

    assert_true(s->asked_spp == o->asked && (int)s->used == o->used);
    assert_true((int)s->passes == o->passes && !memcmp(s->spp, o->spp, s->used * sizeof *s->spp));
    assert_true((int)v->stop == o->stop && (int)v->too_early == o->too_early && (v->stop || v->next_spp == o->next));
    assert_true(isnan(v->noise));
    if (!close_to(v->p, o->p) || !close_to(v->predicted_spp, o->predicted))
        fail_msg("at %llu: p %g for %g, predicted %g for %g", (unsigned long long)o->asked, v->p, o->p, v->predicted_spp,
                 o->predicted);
    assert_true(ggn_stopper_valid(rule, s));
}

/* Policies and blocks of all kinds, asked at the level that was wanted, or one beside it, or half way, or again. */
static void any_history_is_that_of_the_words(void **state)
{
    int stops = 0;

    for (int run = 0; run < 3000; run++) {
        struct ggn_stop_rule rule = {.policy = ggn_policy_default(), .window = 1 + (int)(5 * draw())};
        struct ggn_policy *p = &rule.policy;
        p->first_spp = 1 + floor(20 * draw());
        p->ratio = draw() < 0.2 ? 1.001 : draw() < 0.1 ? 1.002 : 1 + draw();
        p->step_spp = 1 + floor(9 * draw());
        p->scale = 0.5 + draw();
        p->shift = draw() - 0.5;
        p->threshold = 0.3 + 0.4 * draw();
        p->passes = 1 + (int)(3 * draw());
        p->slope = draw() < 0.3 ? 0 : 1 + draw();
        struct ggn_stopper s = {0};
        struct oracle o = {.next = (uint64_t)p->first_spp};
        for (int k = 0; k < 25 && !s.verdict.stop; k++) {
            struct show show = {.logit = draw() < 0.05 ? (double)INFINITY : 4 * draw() - 3};
            double how = draw(), last = s.used ? (double)s.spp[s.used - 1] : 0;
            uint64_t spp = how < 0.6   ? o.next
                           : how < 0.7 ? o.next + 1
                           : how < 0.8 ? s.asked_spp
                                       : (uint64_t)ceil((last + (double)o.next) / 2);
            spp = spp > s.asked_spp ? spp : s.asked_spp;
            int looked = ask(&rule, &s, spp, &show);
            assert_int_equal(looked, oracle_ask(&rule, &o, spp, &show));
            same(&rule, &s, &o);
            stops += looked && o.stop;
        }
    }
    assert_true(stops > 300);
    (void)state;
}

/* Numbers of samples that no counter holds, and each way in which a stopper can be impossible. */
static void far_and_damaged(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct show noisy = {.logit = 5};
    struct ggn_stopper s = {0}, good = {.spp = {10, 15, 23}, .used = 3, .asked_spp = 23};
    good.verdict.stop = 1;

    assert_true(ask(&rule, &s, 10, &noisy));
    assert_true(ask(&rule, &s, UINT64_C(900000000000000000), &noisy));
    assert_true(s.verdict.next_spp == UINT64_C(1000000000000000000));
    assert_true(ggn_stopper_valid(&rule, &good));
    struct ggn_stopper bad = good;
    bad.verdict.stop = 2;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.spp[0] = 0;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.spp[2] = 15;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.used = 2; /* the third is none of the window's */
    bad.spp[2] = 0;
    assert_true(ggn_stopper_valid(&rule, &bad));
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_asks_again_later_however_many_samples_there_are),
        cmocka_unit_test(levels_are_too_early_until_a_window_is_full),
        cmocka_unit_test(noise_between_two_passes_begins_anew),
        cmocka_unit_test(a_damaged_stopper_is_told),
        cmocka_unit_test(any_history_is_that_of_the_words),
        cmocka_unit_test(far_and_damaged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
