/* Methods that stand for people: the model observer, and thresholds from a file. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "data/thresholds.h"
#include "eval/method.h"
#include "observer/curve.h"
#include "observer/observer.h"

static const double FIRST_SPP = 16.0; /* the criterion's default */

/* The criterion's error at spp, between cases in log-log, beyond them as at the nearest. */
static double error_at(const struct ggn_observer *o, const struct ggn_eval_set *s, const double *seen,
                       const struct ggn_eval_block *b, double spp)
{
    size_t i = b->first;
    while (i + 2 < b->end && s->spp[i + 1] < spp)
        i++;
    size_t k = i + 1 < b->end ? i + 1 : i;
    size_t pixels = (size_t)s->images.width * (size_t)s->images.height;
    double one = ggn_observer_error(o, seen[i], pixels);
    double other = ggn_observer_error(o, seen[k], pixels);
    return ggn_curve_between(s->spp[i], one, s->spp[k], other, spp);
}

double ggn_method_law_stop(const struct ggn_observer *o, const struct ggn_eval_set *s, const double *seen,
                           const struct ggn_eval_block *b, double stop_error, const double *correction, double first_spp,
                           double growth, double *asked)
{
    double spp = fmax(first_spp, s->spp[b->first]), checks = 1.0;
    size_t i = b->first;
    for (; spp < b->cap; checks += 1.0) {
        while (i + 1 < b->end && s->spp[i + 1] <= spp)
            i++;
        double ratio = error_at(o, s, seen, b, spp) / stop_error * (correction ? exp2(correction[i]) : 1.0);
        if (ratio <= 1.0)
            break;
        double next = ggn_observer_next(spp, spp * ratio * ratio, growth);
        spp = ceil(correction && i + 1 < b->end ? fmin(next, s->spp[i + 1]) : next);
    }
    if (asked)
        *asked = checks;
    return fmin(spp, b->cap);
}

int ggn_method_observer_of(const char *path, const struct ggn_eval_set *s, const struct ggn_eval_block *block,
                           struct ggn_observer *o, struct base_err *err)
{
    *o = ggn_observer_default;
    return path ? ggn_observer_read(path, s->images.data.views[block->view].name, o, err) : 0;
}

int ggn_method_observer(struct ggn_method *m, const struct ggn_eval_set *s, const char *path, int halves, double visible,
                        double growth, int *available, struct base_err *err)
{
    int rc = ggn_method_init(m, s, halves ? "observer" : "observer, no halves", 1, err), view = -1;
    const double *seen = halves ? s->visible : s->visible_means;
    struct ggn_observer o = ggn_observer_default;
    size_t pixels = (size_t)s->images.width * (size_t)s->images.height;
    *available = 1;
    if (!rc && !(m->asked = malloc((size_t)s->n_blocks * sizeof *m->asked)))
        rc = base_fail_nomem(err, "observer");
    for (int b = 0; b < s->n_blocks && !rc; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->view != view)
            rc = ggn_method_observer_of(path, s, block, &o, err);
        view = block->view;
        for (size_t i = block->first; i < block->end; i++) {
            m->score[i] = isnan(seen[i]) ? (double)NAN : ggn_observer_p_noisy(&o, ggn_observer_error(&o, seen[i], pixels));
            *available &= !isnan(seen[i]);
        }
        m->stop[b] = block->cap;
        if (*available)
            m->stop[b] = ggn_method_law_stop(&o, s, seen, block, ggn_observer_error_at(&o, visible), NULL, FIRST_SPP, growth,
                                             &m->asked[b]);
    }
    if (rc) {
        ggn_method_release(m);
        return rc;
    }
    m->cut = visible;
    return 0;
}

int ggn_method_thresholds(struct ggn_method *m, const struct ggn_eval_set *s, const char *path, enum ggn_split split,
                          int *available, struct base_err *err)
{
    struct ggn_thresholds t = {0};
    int rc = ggn_thresholds_read(path, 200, &t, err);
    if (!rc)
        rc = ggn_method_init(m, s, base_file_name(path), 0, err);
    *available = 1;
    for (int b = 0; b < s->n_blocks && !rc; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        const struct ggn_dataset_view *v = &s->images.data.views[block->view];
        const struct ggn_view *row = ggn_thresholds_of(&t, v->name);
        uint32_t id = v->manifest.blocks[block->index].id;
        m->stop[b] = block->cap;
        *available &= row || block->split != split;
        if (row && (id >= (uint32_t)row->n || (uint32_t)row->n != ggn_dataset_tiles(v)))
            rc = base_fail(err, BASE_EINVAL, "%s: '%s' has %d thresholds, %s has %u blocks", path, row->name, row->n, v->dir,
                           ggn_dataset_tiles(v));
        else if (row && row->spp[id] > 0)
            m->stop[b] =
                fmin(block->split == GGN_SPLIT_PEOPLE ? ggn_observer_from_study(row->spp[id]) : row->spp[id], block->cap);
    }
    if (rc && m->stop)
        ggn_method_release(m);
    ggn_thresholds_release(&t);
    return rc;
}
