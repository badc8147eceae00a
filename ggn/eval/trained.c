#include "eval/trained.h"

#include <math.h>
#include <stdlib.h>

#include "data/replay.h"
#include "eval/viewer.h"

struct run {
    const struct ggn_eval_set *set;
    struct ggn_stop_rule rule;
    struct ggn_method *method;
    struct ggn_viewer *viewers; /* [workers] */
};

static int judge_block(void *data, int index, int worker, struct base_err *err)
{
    const struct run *r = data;
    const struct ggn_eval_block *b = &r->set->blocks[index];
    const struct ggn_level_series *c = &r->set->images.series[b->series];
    const int skipped = r->set->window - 1;
    struct ggn_stop_rule open = r->rule;
    struct ggn_seen *seen = malloc((size_t)c->n_levels * sizeof *seen);

    if (!seen)
        return base_fail_nomem(err, r->method->name);
    ggn_viewer_turn(&r->viewers[worker], c);
    open.policy.gate_noise = 0;
    ggn_replay(&r->set->images, c, &open, ggn_viewer_logit, &r->viewers[worker], seen);
    for (int i = skipped; i < c->n_levels; i++)
        r->method->score[b->first + (size_t)(i - skipped)] = seen[i].p;
    ggn_replay(&r->set->images, c, &r->rule, ggn_viewer_logit, &r->viewers[worker], seen);
    for (int i = skipped; i < c->n_levels; i++) {
        r->method->verdict[b->first + (size_t)(i - skipped)] = seen[i].p;
        r->method->own_guard[b->first + (size_t)(i - skipped)] = seen[i].is_held;
    }
    free(seen);
    return 0;
}

static int init_method(struct ggn_method *m, const struct ggn_eval_set *s, const char *name, const struct ggn_policy *p,
                       struct base_err *err)
{
    int rc = ggn_method_init(m, s, name, 1, err);

    if (rc)
        return rc;
    m->verdict = malloc(s->n * sizeof *m->verdict);
    m->own_guard = malloc(s->n * sizeof *m->own_guard);
    if (!m->verdict || !m->own_guard) {
        ggn_method_release(m);
        return base_fail_nomem(err, name);
    }
    m->guard = m->own_guard;
    m->cut = p->threshold;
    m->passes = p->passes;
    return 0;
}

int ggn_eval_trained(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model,
                     const struct ggn_policy *policy, const char *name, enum ggn_precision precision,
                     struct base_threads *threads, struct base_err *err)
{
    int workers = base_threads_count(threads), made = 0, window = model->hyper.window;
    struct run r = {.set = s, .method = m, .rule = {.policy = *policy, .window = window}};

    if (window < 2 || window > GGN_WINDOW_MAX)
        return base_fail(err, BASE_EINVAL, "%s: windows of %d images; evaluation takes 2 to %d", name, window,
                         GGN_WINDOW_MAX);
    int rc = init_method(m, s, name, policy, err);
    if (rc)
        return rc;
    r.viewers = calloc((size_t)workers, sizeof *r.viewers);
    if (!r.viewers)
        rc = base_fail_nomem(err, name);
    for (; made < workers && !rc; made += !rc)
        rc = ggn_viewer_init(&r.viewers[made], model, precision, &s->images, err);
    const struct ggn_eval_values made_by_block[] = {{m->score, sizeof *m->score, NULL},
                                                    {m->verdict, sizeof *m->verdict, NULL},
                                                    {m->own_guard, sizeof *m->own_guard, NULL}};
    if (!rc)
        rc = ggn_eval_each_block(s, threads, judge_block, &r, made_by_block, 3, err);
    for (int i = 0; i < made; i++)
        ggn_viewer_release(&r.viewers[i]);
    free(r.viewers);
    if (!rc)
        ggn_method_run(m, s);
    else
        ggn_method_release(m);
    return rc;
}
