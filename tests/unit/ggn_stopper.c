/* The stopping rule on made-up evidence: cadence, gate, passes, guard, and that asking twice changes nothing. */
#include <math.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "model/stopper.h"
#include "support/splitmix.h"

struct show {
    double noise, logit, tail999, gini;
    int has_tail, asked; /* how often the network was */
};

static double noise(void *data) { return ((struct show *)data)->noise; }

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
    const struct ggn_evidence e = {show, noise, logit, tail, NULL};
    int look = ggn_stopper_ask(rule, s, spp);
    if (look)
        ggn_stopper_decide(rule, s, &e);
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

/* 2^63 samples and more fit a uint64_t, but no double and no schedule: what it says is never in the past. */
static void it_asks_again_later_however_many_samples_there_are(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    static const uint64_t many[] = {UINT64_C(1) << 53, 1000000000000000000u, UINT64_C(1) << 63, UINT64_MAX - 1, UINT64_MAX};
    (void)state;
    for (size_t i = 0; i < sizeof many / sizeof *many; i++) {
        struct ggn_stopper s = {0};
        struct show show = {.noise = 0.01, .logit = 5};
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
                               .regular = 3,
                               .asked_spp = 23,
                               .leapt = 1,
                               .verdict = {.next_spp = 24, .p = 1, .predicted_spp = 0, .noise = (double)NAN}},
                       bad = good;
    (void)state;
    assert_true(ggn_stopper_valid(&rule, &good));
#define BAD(change) (bad = good, bad.change, assert_false(ggn_stopper_valid(&rule, &bad)))
    BAD(spp[1] = 10);
    BAD(spp[0] = 0);
    BAD(used = 4);
    BAD(regular = 4);
    BAD(leapt = 2);
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
    int used, regular, passes, leapt, stop, too_early;
    double p, predicted, noise;
};

static double next_level(const struct ggn_policy *p, double spp)
{
    double next = p->ratio > 1.001 ? floor(spp * p->ratio + 0.5) : spp + p->step_spp;
    return next > spp + 1 ? next : spp + 1;
}

static void oracle_schedule(const struct ggn_stop_rule *rule, struct oracle *o, double opens)
{
    double n = (double)o->asked, next = next_level(&rule->policy, n);
    if (opens > 0 && rule->policy.ratio > 1.001) {
        double leap = opens / 2;
        for (int i = 1; i < rule->window; i++)
            leap /= rule->policy.ratio;
        leap = leap < 4 * n ? leap : 4 * n;
        o->leapt = leap > 1.5 * next;
        next = o->leapt ? leap : next;
    }
    next = next > rule->policy.first_spp ? next : rule->policy.first_spp;
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
            o->p = o->predicted = o->noise = (double)NAN;
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
    o->regular = o->leapt ? 1 : o->regular + 1 < o->used ? o->regular + 1 : o->used;
    o->leapt = o->stop = o->too_early = 0;
    o->p = o->predicted = (double)NAN;
    o->noise = o->used > 1 ? show->noise : (double)NAN;
    if (p->gate_noise > 0 && o->noise > p->gate_noise) {
        o->passes = 0;
        o->predicted = (double)spp * (o->noise / p->gate_noise) * (o->noise / p->gate_noise);
        oracle_schedule(rule, o, o->predicted);
        return 1;
    }
    o->too_early = o->regular < rule->window;
    if (!o->too_early) {
        o->p = isfinite(show->logit) ? 1 / (1 + exp(-(p->scale * show->logit + p->shift))) : 1;
        o->passes = o->p < p->threshold ? o->passes + 1 : 0;
        int held =
            (p->tail999 > 0 && show->tail999 > p->tail999) || (p->gini > 0 && show->gini > p->gini && show->tail999 > 0.2);
        o->stop = o->passes >= p->passes && !(held && show->has_tail);
    }
    if (o->stop)
        o->predicted = (double)spp;
    else
        oracle_schedule(rule, o, 0);
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

    assert_true(s->asked_spp == o->asked && (int)s->used == o->used && (int)s->regular == o->regular);
    assert_true((int)s->passes == o->passes && (int)s->leapt == o->leapt &&
                !memcmp(s->spp, o->spp, s->used * sizeof *s->spp));
    assert_true((int)v->stop == o->stop && (int)v->too_early == o->too_early && (v->stop || v->next_spp == o->next));
    if (!close_to(v->p, o->p) || !close_to(v->predicted_spp, o->predicted) || !close_to(v->noise, o->noise))
        fail_msg("at %llu: p %g for %g, predicted %g for %g, noise %g for %g", (unsigned long long)o->asked, v->p, o->p,
                 v->predicted_spp, o->predicted, v->noise, o->noise);
    assert_true(ggn_stopper_valid(rule, s));
}

/* Policies and blocks of all kinds, asked at the level that was wanted, or one beside it, or half way, or again. */
static void any_history_is_that_of_the_words(void **state)
{
    int stops = 0, leaps = 0, held = 0;

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
        p->gate_noise = draw() < 0.3 ? 0 : 0.5;
        p->slope = draw() < 0.3 ? 0 : 1 + draw();
        p->tail999 = draw() < 0.5 ? 0 : 1;
        p->gini = draw() < 0.5 ? 0 : 0.5;
        struct ggn_stopper s = {0};
        struct oracle o = {.next = (uint64_t)p->first_spp};
        for (int k = 0; k < 25 && !s.verdict.stop; k++) {
            struct show show = {.noise = draw() < 0.3 ? 0.5 : 4 * draw() * draw(),
                                .logit = draw() < 0.05 ? (double)INFINITY : 4 * draw() - 3,
                                .tail999 = draw() < 0.1 ? 1 : 1.5 * draw() * draw(),
                                .gini = draw() < 0.1 ? 0.5 : draw(),
                                .has_tail = draw() < 0.7};
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
            leaps += looked && o.leapt;
            held += looked && !o.stop && !o.too_early && o.passes >= p->passes;
        }
    }
    assert_true(stops > 300 && leaps > 300 && held > 300);
    (void)state;
}

/* Numbers of samples that no counter holds, and each way in which a stopper can be impossible. */
static void far_and_damaged(void **state)
{
    struct ggn_stop_rule rule = make_rule();
    struct show noisy = {.noise = 1e12, .logit = 5};
    struct ggn_stopper s = {0}, good = {.spp = {10, 15, 23}, .used = 3, .regular = 3, .leapt = 1, .asked_spp = 23};
    good.verdict.stop = 1;

    rule.policy.gate_noise = 1;
    assert_true(ask(&rule, &s, 10, &noisy));
    assert_true(ask(&rule, &s, UINT64_C(900000000000000000), &noisy));
    assert_true(s.verdict.next_spp == UINT64_C(1000000000000000000));
    assert_true(ggn_stopper_valid(&rule, &good));
    struct ggn_stopper bad = good;
    bad.leapt = 2;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.verdict.stop = 2;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.regular = 4;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.spp[0] = 0;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.spp[2] = 15;
    assert_false(ggn_stopper_valid(&rule, &bad));
    bad = good;
    bad.used = 2; /* the third is none of the window's */
    bad.regular = 2;
    bad.spp[2] = 0;
    assert_true(ggn_stopper_valid(&rule, &bad));
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_asks_again_later_however_many_samples_there_are),
        cmocka_unit_test(levels_are_too_early_until_a_window_is_full),
        cmocka_unit_test(a_guard_holds_and_leaves_the_passes),
        cmocka_unit_test(a_gate_spares_the_network_forgets_passes_and_leaps),
        cmocka_unit_test(noise_between_two_passes_begins_anew),
        cmocka_unit_test(a_damaged_stopper_is_told),
        cmocka_unit_test(any_history_is_that_of_the_words),
        cmocka_unit_test(far_and_damaged),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
