#include "data/replay.h"

#include <math.h>
#include <string.h>

#include "model/window.h"
#include "sequence/simulate.h"

/* The rule at one level. */
struct look {
    const struct ggn_series_set *set;
    const struct ggn_level_series *series;
    double (*logit)(void *data, const int *levels);
    void *data;
    const double *law;
    int now;                         /* the level asked about */
    int level[GGN_WINDOW_MAX], used; /* of the window's images, oldest first */
};

static double window_noise(void *data)
{
    const struct look *l = data;
    const size_t values = ggn_series_set_values(l->set);
    const int first = l->level[0], last = l->level[l->used - 1];

    return ggn_window_noise(l->series->noisy + values * (size_t)first, l->series->noisy + values * (size_t)last, values,
                            l->series->spp[first], l->series->spp[last]);
}

static double window_logit(void *data)
{
    const struct look *l = data;

    return l->logit(l->data, l->level);
}

static double law(void *data)
{
    const struct look *l = data;

    return l->law[l->now];
}

/* Noise falls by the square root of the samples, its shape stays. */
static int tail_statistics(void *data, double *tail999, double *gini)
{
    const struct look *l = data;
    const struct ggn_level_series *c = l->series;
    const int last = l->level[l->used - 1];
    int k = last;

    while (k > 0 && c->tail999 && isnan(c->tail999[k]))
        k--;
    if (!c->tail999 || isnan(c->tail999[k]))
        return 0;
    *tail999 = c->tail999[k] * seq_noise_scale(c->spp[k], c->spp[last]);
    *gini = c->gini[k];
    return 1;
}

static int is_check(const struct ggn_stop_rule *rule, const struct ggn_stopper *s, const struct ggn_level_series *c, int i)
{
    double next = s->used ? (double)s->verdict.next_spp : rule->policy.first_spp;

    return c->spp[i] >= next || i + 1 == c->n_levels || next - c->spp[i] <= c->spp[i + 1] - next;
}

void ggn_replay(const struct ggn_series_set *set, const struct ggn_level_series *c, const struct ggn_stop_rule *rule,
                double (*logit)(void *data, const int *levels), void *data, const double *law_of, struct ggn_seen *seen)
{
    struct look look = {.set = set, .series = c, .logit = logit, .data = data, .law = law_of};
    const struct ggn_evidence evidence = {&look, window_noise, window_logit, tail_statistics, law};
    struct ggn_stop_rule endless = *rule;
    struct ggn_stopper s = {0};
    double tail999, gini;

    endless.policy.threshold = 0;
    for (int i = 0; i < c->n_levels; i++) {
        seen[i] = (struct ggn_seen){.p = (double)NAN};
        const int what = is_check(rule, &s, c, i) ? ggn_stopper_ask(&endless, &s, (uint64_t)c->spp[i]) : GGN_LOOK_NONE;
        if (what == GGN_LOOK_NONE)
            continue;
        if (what == GGN_LOOK_IMAGE && look.used == rule->window)
            memmove(look.level, look.level + 1, (size_t)--look.used * sizeof look.level[0]);
        if (what == GGN_LOOK_IMAGE)
            look.level[look.used++] = i;
        look.now = i;
        ggn_stopper_decide(&endless, &s, &evidence);
        seen[i].p = isnan(s.verdict.p) && !s.verdict.too_early ? INFINITY : s.verdict.p;
        seen[i].correction = s.correction;
        seen[i].is_held = tail_statistics(&look, &tail999, &gini) && ggn_policy_tail_holds(&rule->policy, tail999, gini);
    }
}

int ggn_replay_stop(const struct ggn_seen *seen, int n_levels, const struct ggn_policy *policy, double threshold)
{
    struct ggn_stopper s = {0};

    for (int i = 0; i < n_levels; i++)
        if (!isnan(seen[i].p) && ggn_stopper_pass(&s, policy->passes, seen[i].p < threshold) && !seen[i].is_held)
            return i;
    return -1;
}
