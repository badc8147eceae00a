#include "model/stopper.h"

#include <math.h>
#include <string.h>

#include "sight/measure.h"

static uint64_t to_spp(double spp) { return spp >= 1e18 ? UINT64_C(1000000000000000000) : (uint64_t)spp; }

/* Asks at so many samples, but later than now; 2^64 - 1 samples make that 0: when the host likes. */
static void ask_at(struct ggn_stopper *s, uint64_t spp)
{
    s->verdict.next_spp = spp > s->asked_spp ? spp : s->asked_spp + 1;
}

/* Of a step between images: nearer than that to the last one, the two would hardly differ. Looks that are judged anyway
 * can leave the window as it was trained. */
static const double NEARER = 0.5, NEARER_WITH_LAW = 0.75;

/* The samples from which an image may join the window. */
static double joins_at(const struct ggn_stop_rule *rule, const struct ggn_stopper *s)
{
    double last = (double)s->spp[s->used - 1];
    return last + (rule->reach > 0 ? NEARER_WITH_LAW : NEARER) * (ggn_policy_next(&rule->policy, last) - last);
}

int ggn_stopper_ask(const struct ggn_stop_rule *rule, struct ggn_stopper *s, uint64_t spp)
{
    const struct ggn_verdict nothing = {.p = (double)NAN, .predicted_spp = (double)NAN, .noise = (double)NAN};
    if (spp && s->asked_spp == spp)
        return GGN_LOOK_NONE;
    s->asked_spp = spp;
    if ((double)spp >= rule->policy.first_spp && (!s->used || (double)spp >= joins_at(rule, s))) {
        s->verdict = nothing;
        if (s->used == (uint32_t)rule->window) {
            s->used--;
            memmove(s->spp, s->spp + 1, s->used * sizeof s->spp[0]);
        }
        s->spp[s->used++] = spp;
        return GGN_LOOK_IMAGE;
    }
    if (rule->reach > 0 && s->used && !s->verdict.stop) {
        s->verdict = nothing;
        return GGN_LOOK_BETWEEN;
    }
    if (!s->used) {
        s->verdict = nothing;
        s->verdict.too_early = 1;
        ask_at(s, to_spp(rule->policy.first_spp));
    } else if (!s->verdict.stop) {
        ask_at(s, s->verdict.next_spp);
    }
    return GGN_LOOK_NONE;
}

int ggn_stopper_pass(struct ggn_stopper *s, int passes, int below)
{
    s->passes = below ? s->passes + 1 : 0;
    return s->passes >= (uint32_t)passes;
}

/* Judges the newest check by its logit. Whether the block stops. */
static int stops(const struct ggn_stop_rule *rule, struct ggn_stopper *s, double logit)
{
    const struct ggn_policy *p = &rule->policy;
    struct ggn_verdict *v = &s->verdict;
    v->p = ggn_policy_p(p, logit);
    if (!ggn_stopper_pass(s, p->passes, v->p < p->threshold))
        return 0;
    v->stop = 1;
    v->predicted_spp = (double)s->asked_spp;
    return 1;
}

static const double LEAST_STEP = 1.04; /* between looks, as a share of the samples */

/* Logits beyond this are certain: no network in reach changes them into a doubt. */
static const double CERTAIN = 12;

/* The residual model's logit; NaN: the law does not know. */
static double by_law(const struct ggn_stop_rule *rule, struct ggn_stopper *s, const struct ggn_evidence *e)
{
    const struct ggn_policy *p = &rule->policy;
    double law = e->law(e->data);
    if (isnan(law) || s->used < (uint32_t)rule->window || fabs(p->scale * law + p->shift) > CERTAIN)
        s->correction = 0;
    else if (s->spp[s->used - 1] == s->asked_spp)
        s->correction = ggn_residual_correction(e->logit(e->data), rule->reach);
    return law + s->correction;
}

static void decide_by_law(const struct ggn_stop_rule *rule, struct ggn_stopper *s, const struct ggn_evidence *e)
{
    const struct ggn_policy *p = &rule->policy;
    struct ggn_verdict *v = &s->verdict;
    double spp = (double)s->asked_spp, logit = by_law(rule, s, e), joins = joins_at(rule, s);
    double next = ggn_policy_next(p, (double)s->spp[s->used - 1]);
    if (isnan(logit)) {
        v->too_early = 1;
        ask_at(s, to_spp(ceil(next)));
        return;
    }
    v->noise = exp2(logit - s->correction);
    if (stops(rule, s, logit))
        return;
    double stops_at = (log(p->threshold / (1 - p->threshold)) - p->shift) / p->scale;
    double predicted = spp * fmax(exp2(fmin(2 * (logit - stops_at), 20)), LEAST_STEP); /* noise falls as 1/sqrt(spp) */
    next = predicted < joins ? predicted : fmin(fmax(predicted, joins), next);
    ask_at(s, to_spp(ceil(next)));
    v->predicted_spp = fmax(predicted, (double)v->next_spp);
}

void ggn_stopper_decide(const struct ggn_stop_rule *rule, struct ggn_stopper *s, const struct ggn_evidence *e)
{
    const struct ggn_policy *p = &rule->policy;
    struct ggn_verdict *v = &s->verdict;
    const double spp = (double)s->asked_spp;
    if (rule->reach > 0) {
        decide_by_law(rule, s, e);
        return;
    }
    v->too_early = s->used < (uint32_t)rule->window;
    if (!v->too_early && stops(rule, s, e->logit(e->data)))
        return;
    /* goes on at the next level */
    ask_at(s, to_spp(ceil(ggn_policy_next(p, spp))));
    if (!v->too_early)
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
    if (s->used > (uint32_t)rule->window || !verdict_valid(s))
        return 0;
    if (s->used && s->spp[s->used - 1] > s->asked_spp)
        return 0;
    if (!(fabs(s->correction) <= rule->reach))
        return 0;
    for (uint32_t i = 0; i < s->used; i++)
        if (!s->spp[i] || (i && s->spp[i] <= s->spp[i - 1]))
            return 0;
    return 1;
}
