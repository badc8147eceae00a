#include "eval/trained.h"

#include <math.h>
#include <stdlib.h>

#include "data/each.h"
#include "data/replay.h"
#include "eval/viewer.h"

struct run {
    const struct ggn_eval_set *set;
    struct ggn_stop_rule rule;
    struct ggn_method *method;
    struct ggn_viewer *viewers;           /* [workers] */
    const struct ggn_observer *observers; /* [views] */
};

/* log2 of the law's error: at cases as the set says, at the levels before them as they were measured. [n_levels] */
static void list_law(const struct run *r, const struct ggn_eval_block *b, double *law)
{
    const struct ggn_level_series *c = &r->set->images.series[b->series];
    const size_t pixels = (size_t)r->set->images.width * (size_t)r->set->images.height;
    const int skipped = r->set->window - 1;

    for (int i = 0; i < c->n_levels; i++) {
        double seen = i < skipped ? c->measure[i].visible : r->set->law[b->first + (size_t)(i - skipped)];
        law[i] = ggn_measure_octaves(ggn_observer_error(&r->observers[b->view], seen, pixels));
    }
}

static int judge_block(void *data, long index, int worker, struct base_err *err)
{
    const struct run *r = data;
    const struct ggn_eval_block *b = &r->set->blocks[index];
    const struct ggn_level_series *c = &r->set->images.series[b->series];
    const int skipped = r->set->window - 1, by_law = r->rule.reach > 0;
    const size_t levels = (size_t)c->n_levels;
    struct ggn_viewer *viewer = &r->viewers[worker];
    struct ggn_seen *seen = malloc(levels * sizeof *seen);
    double *law = by_law ? malloc(levels * sizeof *law) : NULL;
    int rc = !seen || (by_law && !law) ? base_fail_nomem(err, r->method->name) : 0;

    if (!rc && by_law)
        list_law(r, b, law);
    if (!rc) {
        ggn_viewer_turn(viewer, c);
        viewer->law = law;
        ggn_replay(c, &r->rule, ggn_viewer_logit, viewer, law, seen);
    }
    for (int i = skipped; i < c->n_levels && !rc; i++) {
        const size_t k = b->first + (size_t)(i - skipped);
        r->method->score[k] = seen[i].p;
        if (by_law)
            r->method->correction[k] = i > skipped && isnan(seen[i].p) ? r->method->correction[k - 1] : seen[i].correction;
    }
    free(law);
    free(seen);
    return rc;
}

static int check_halves(const struct ggn_eval_set *s, const char *name, struct base_err *err)
{
    for (int b = 0; b < s->n_blocks; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            if (isnan(s->visible[i]))
                return base_fail(err, BASE_EINVAL, "%s: %s has levels without half buffers, which residual models need",
                                 name, s->images.data.views[s->blocks[b].view].dir);
    return 0;
}

int ggn_eval_trained(struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_model *model,
                     const struct ggn_policy *policy, const char *name, enum ggn_precision precision,
                     const struct ggn_observer *observers, struct base_threads *threads, struct base_err *err)
{
    int workers = base_threads_count(threads), made = 0, window = model->hyper.window;
    struct run r = {.set = s,
                    .method = m,
                    .rule = {.policy = *policy, .window = window, .reach = model->hyper.reach},
                    .observers = observers};

    if (window < 2 || window > GGN_WINDOW_MAX)
        return base_fail(err, BASE_EINVAL, "%s: windows of %d images; evaluation takes 2 to %d", name, window,
                         GGN_WINDOW_MAX);
    int rc = ggn_method_init(m, s, name, r.rule.reach > 0, err);
    if (rc)
        return rc;
    m->cut = policy->threshold;
    m->passes = policy->passes;
    r.viewers = calloc((size_t)workers, sizeof *r.viewers);
    if (!r.viewers)
        rc = base_fail_nomem(err, name);
    for (; made < workers && !rc; made += !rc)
        rc = ggn_viewer_init(&r.viewers[made], model, precision, &s->images, err);
    if (!rc && r.rule.reach > 0)
        rc = check_halves(s, name, err);
    if (!rc)
        rc = ggn_each(threads, s->n_blocks, judge_block, &r, "evaluation", err);
    for (int i = 0; i < made; i++)
        ggn_viewer_release(&r.viewers[i]);
    free(r.viewers);
    if (rc)
        ggn_method_release(m);
    return rc;
}
