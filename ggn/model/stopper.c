#include "model/stopper.h"

#include <math.h>
#include <string.h>

static uint64_t to_spp(double spp) { return spp >= 1e18 ? UINT64_C(1000000000000000000) : (uint64_t)spp; }

/* Asks at so many samples, but later than now; 2^64 - 1 samples make that 0: when the host likes. */
static void ask_at(struct ggn_stopper *s, uint64_t spp)
{
    s->verdict.next_spp = spp > s->asked_spp ? spp : s->asked_spp + 1;
}

static int due(const struct ggn_policy *p, const struct ggn_stopper *s, uint64_t spp)
{
    if ((double)spp < p->first_spp)
        return 0;
    if (!s->used)
        return 1;
    double last = (double)s->spp[s->used - 1];
    return (double)spp >= last + 0.5 * (ggn_policy_next(p, last) - last);
}

static void push(const struct ggn_stop_rule *rule, struct ggn_stopper *s, uint64_t spp)
{
    if (s->used == (uint32_t)rule->window) {
        memmove(s->spp, s->spp + 1, (size_t)(rule->window - 1) * sizeof s->spp[0]);
        s->used--;
    }
    s->spp[s->used++] = spp;
    s->regular = s->leapt ? 1 : s->regular < s->used ? s->regular + 1 : s->used;
    s->leapt = 0;
}

int ggn_stopper_ask(const struct ggn_stop_rule *rule, struct ggn_stopper *s, uint64_t spp)
{
    const struct ggn_verdict nothing = {.p = (double)NAN, .predicted_spp = (double)NAN, .noise = (double)NAN};

    if (spp && s->asked_spp == spp)
        return 0;
    s->asked_spp = spp;
    if (due(&rule->policy, s, spp)) {
        s->verdict = nothing;
        push(rule, s, spp);
        return 1;
    }
    if (!s->used) {
        s->verdict = nothing;
        s->verdict.too_early = 1;
        ask_at(s, to_spp(rule->policy.first_spp));
    } else if (!s->verdict.stop) {
        ask_at(s, s->verdict.next_spp);
    }
    return 0;
}

/* Goes on at the next level or, while the gate says that the block is plainly noisy, at the first level of the window that
 * will end where it expects to open: half of that, because the estimate is noisy itself, and at most fourfold. */
static void schedule(const struct ggn_stop_rule *rule, struct ggn_stopper *s, double gate_opens)
{
    const struct ggn_policy *p = &rule->policy;
    double spp = (double)s->asked_spp, next = ggn_policy_next(p, spp);

    if (gate_opens > 0 && p->ratio > 1.001) {
        double leap = fmin(0.5 * gate_opens / pow(p->ratio, rule->window - 1), 4 * spp);
        s->leapt = leap > 1.5 * next;
        next = s->leapt ? leap : next;
    }
    ask_at(s, to_spp(ceil(fmax(next, p->first_spp))));
    if (rule->spp_max > s->asked_spp && s->verdict.next_spp > rule->spp_max)
        s->verdict.next_spp = rule->spp_max;
}

int ggn_stopper_pass(struct ggn_stopper *s, int passes, int below)
{
    s->passes = below ? s->passes + 1 : 0;
    return s->passes >= (uint32_t)passes;
}

static int is_held(const struct ggn_policy *p, const struct ggn_evidence *e)
{
    double tail999, gini;

    return (p->tail999 > 0 || p->gini > 0) && e->tail(e->data, &tail999, &gini) && ggn_policy_tail_holds(p, tail999, gini);
}

void ggn_stopper_decide(const struct ggn_stop_rule *rule, struct ggn_stopper *s, const struct ggn_evidence *e)
{
    const struct ggn_policy *p = &rule->policy;
    struct ggn_verdict *v = &s->verdict;
    double spp = (double)s->asked_spp;

    v->noise = s->used > 1 ? e->noise(e->data) : (double)NAN;
    if (p->gate_noise > 0 && v->noise > p->gate_noise) {
        double ratio = v->noise / p->gate_noise;
        s->passes = 0;
        v->predicted_spp = spp * ratio * ratio; /* the error of a mean falls as 1/√spp */
        schedule(rule, s, v->predicted_spp);
        return;
    }
    if (s->regular < (uint32_t)rule->window) {
        v->too_early = 1;
        schedule(rule, s, 0);
        return;
    }
    v->p = ggn_policy_p(p, e->logit(e->data));
    if (ggn_stopper_pass(s, p->passes, v->p < p->threshold) && !is_held(p, e)) {
        v->stop = 1;
        v->predicted_spp = spp;
        return;
    }
    schedule(rule, s, 0);
    v->predicted_spp = fmax(ggn_policy_predict(p, v->p, p->threshold, spp), (double)v->next_spp);
}

static int unknown_or_positive(double value) { return isnan(value) || (value >= 0 && isfinite(value)); }

/* Only the last check can have said it, and stops are about samples that were taken. */
static int verdict_valid(const struct ggn_stopper *s)
{
    const struct ggn_verdict *v = &s->verdict;

    if (v->stop ? !s->used || v->stop > 1 || v->too_early : v->next_spp && v->next_spp <= s->asked_spp)
        return 0;
    return unknown_or_positive(v->predicted_spp) && unknown_or_positive(v->noise) && unknown_or_positive(v->p) &&
           !(v->p > 1);
}

int ggn_stopper_valid(const struct ggn_stop_rule *rule, const struct ggn_stopper *s)
{
    if (s->used > (uint32_t)rule->window || s->regular > s->used || s->leapt > 1 || !verdict_valid(s))
        return 0;
    if (s->used && s->spp[s->used - 1] > s->asked_spp)
        return 0;
    for (uint32_t i = 0; i < s->used; i++)
        if (!s->spp[i] || (i && s->spp[i] <= s->spp[i - 1]))
            return 0;
    return 1;
}
