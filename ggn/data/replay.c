#include "data/replay.h"

#include <math.h>
#include <string.h>

/* The rule at one level. */
struct look {
    double (*logit)(void *data, const int *levels);
    void *data;
    const double *law;
    int now;                         /* the level asked about */
    int level[GGN_WINDOW_MAX], used; /* of the window's images, oldest first */
};

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

static int is_check(const struct ggn_stop_rule *rule, const struct ggn_stopper *s, const struct ggn_level_series *c, int i)
{
    double next = s->used ? (double)s->verdict.next_spp : rule->policy.first_spp;
    return c->spp[i] >= next || i + 1 == c->n_levels || next - c->spp[i] <= c->spp[i + 1] - next;
}

void ggn_replay(const struct ggn_level_series *c, const struct ggn_stop_rule *rule,
                double (*logit)(void *data, const int *levels), void *data, const double *law_of, struct ggn_seen *seen)
{
    struct look look = {.logit = logit, .data = data, .law = law_of};
    const struct ggn_evidence evidence = {&look, window_logit, law};
    struct ggn_stop_rule endless = *rule;
    struct ggn_stopper s = {0};
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
        seen[i].p = s.verdict.p;
        seen[i].correction = s.correction;
    }
}

int ggn_replay_stop(const struct ggn_seen *seen, int n_levels, int passes, double threshold)
{
    struct ggn_stopper s = {0};
    for (int i = 0; i < n_levels; i++)
        if (!isnan(seen[i].p) && ggn_stopper_pass(&s, passes, seen[i].p < threshold))
            return i;
    return -1;
}
