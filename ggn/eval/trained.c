#include "eval/method.h"

#include <math.h>
#include <stdlib.h>

#include "data/each.h"
#include "data/replay.h"

struct run {
    const struct ggn_eval_set *set;
    const struct ggn_model *model;
    enum ggn_precision precision;
    struct ggn_stop_rule rule;
    struct ggn_method *method;
    struct viewer *viewers;               /* [workers] */
    const struct ggn_observer *observers; /* [views] */
};

/* The model's view of the windows of one block; one thread at a time. */
struct viewer {
    const struct ggn_series_set *set;      /* borrows */
    struct ggn_inference *inference;       /* owns */
    enum ggn_precision precision;          /* of it */
    uint16_t *denoised;                    /* owns; [window][3][H][W] */
    int holds[GGN_WINDOW_MAX];             /* the level of each, -1: none */
    int window, noise_maps;                /* noise_maps: the model takes those of the set */
    const struct ggn_level_series *series; /* borrows; the block */
    const double *law;                     /* borrows; [levels] of a residual model: log2 of the law's error */
};

static void viewer_release(struct viewer *v)
{
    (v->precision == GGN_PRECISION_F64 ? ggn_inference_destroy_f64 : ggn_inference_destroy)(v->inference);
    free(v->denoised);
}

static int viewer_init(struct viewer *v, const struct run *r, struct base_err *err)
{
    const struct ggn_hyper *h = &r->model->hyper;
    const float *learned[GGN_NETS];
    v->set = &r->set->images;
    v->precision = r->precision;
    v->window = h->window;
    v->noise_maps = v->set->noise_maps && h->noise_map && h->reach > 0;
    v->denoised = malloc((size_t)v->window * ggn_series_set_values(v->set) * sizeof *v->denoised);
    if (v->precision == GGN_PRECISION_F64 && (v->set->width != h->width || v->set->height != h->height))
        return base_fail(err, BASE_EINVAL, "in double precision only blocks of the network's size, %dx%d, are judged",
                         h->width, h->height);
    for (int net = 0; net < GGN_NETS; net++)
        learned[net] = r->model->weights[net]->params;
    v->inference = v->precision == GGN_PRECISION_F64 ? ggn_inference_create_f64(h, r->model->graph, learned, err)
                                                     : ggn_inference_create(r->model, NULL, err);
    if (!v->inference)
        return err->code;
    return v->denoised ? 0 : base_fail_nomem(err, "evaluation");
}

static int is_in(int level, const int *levels, int n)
{
    for (int i = 0; i < n; i++)
        if (levels[i] == level)
            return 1;
    return 0;
}

/* Where a level's denoised image is; one that is not in the window makes room. */
static uint16_t *denoised(struct viewer *v, int level, const int *window)
{
    const size_t values = ggn_series_set_values(v->set);
    const uint8_t *noisy = v->series->noisy + values * (size_t)level;
    int spare = 0;
    for (int i = 0; i < v->window; i++) {
        if (v->holds[i] == level)
            return v->denoised + values * (size_t)i;
        if (!is_in(v->holds[i], window, v->window))
            spare = i;
    }
    uint16_t *out = v->denoised + values * (size_t)spare;
    (v->precision == GGN_PRECISION_F64 ? ggn_inference_denoise_f64 : ggn_inference_denoise)(v->inference, noisy, out,
                                                                                            v->set->width, v->set->height);
    v->holds[spare] = level;
    return out;
}

/* Of the window of these levels, noisiest first. */
static double window_logit(void *data, const int *levels)
{
    struct viewer *v = data;
    const size_t values = ggn_series_set_values(v->set);
    const uint8_t *noisy[GGN_WINDOW_MAX];
    const uint16_t *clean[GGN_WINDOW_MAX];
    struct ggn_measure measures[GGN_WINDOW_MAX];
    double spp[GGN_WINDOW_MAX];
    float scalars[GGN_SCALARS] = {0};
    for (int i = 0; i < v->window; i++) {
        noisy[i] = v->series->noisy + values * (size_t)levels[i];
        clean[i] = denoised(v, levels[i], levels);
        if (v->law)
            measures[i] = v->series->measure[levels[i]];
        spp[i] = v->series->spp[levels[i]];
    }
    const int last = levels[v->window - 1];
    const uint8_t *noise_map =
        v->noise_maps && v->series->has_noise_map[last] ? v->series->noise_map + values / 3 * (size_t)last : NULL;
    if (v->law)
        ggn_measure_scalars(measures, spp, v->window, v->law[last], scalars);
    return (v->precision == GGN_PRECISION_F64 ? ggn_inference_logit_f64 : ggn_inference_logit)(
        v->inference, noisy, clean, noise_map, scalars, v->set->width, v->set->height);
}

static int judge_block(void *data, long index, int worker, struct base_err *err)
{
    const struct run *r = data;
    const struct ggn_eval_block *b = &r->set->blocks[index];
    const struct ggn_level_series *c = &r->set->images.series[b->series];
    const int skipped = r->set->window - 1, by_law = r->rule.reach > 0;
    const size_t levels = (size_t)c->n_levels, pixels = ggn_series_set_values(&r->set->images) / 3;
    struct viewer *viewer = &r->viewers[worker];
    struct ggn_seen *seen = malloc(levels * sizeof *seen);
    double *law = by_law ? malloc(levels * sizeof *law) : NULL;
    int rc = !seen || (by_law && !law) ? base_fail_nomem(err, r->method->name) : 0;
    /* log2 of the law's error: at cases as the set says, at the levels before them as they were measured */
    for (int i = 0; i < c->n_levels && !rc && by_law; i++) {
        double visible = i < skipped ? c->measure[i].visible : r->set->law[b->first + (size_t)(i - skipped)];
        law[i] = ggn_measure_octaves(ggn_observer_error(&r->observers[b->view], visible, pixels));
    }
    if (!rc) {
        viewer->series = c;
        viewer->law = law;
        for (int i = 0; i < viewer->window; i++)
            viewer->holds[i] = -1;
        ggn_replay(c, &r->rule, window_logit, viewer, law, seen);
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
    const int workers = base_threads_count(threads), window = model->hyper.window;
    struct run r = {.set = s,
                    .model = model,
                    .precision = precision,
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
    for (int i = 0; i < workers && !rc; i++)
        rc = viewer_init(&r.viewers[i], &r, err);
    if (!rc && r.rule.reach > 0)
        rc = check_halves(s, name, err);
    if (!rc)
        rc = ggn_each(threads, s->n_blocks, judge_block, &r, "evaluation", err);
    for (int i = 0; r.viewers && i < workers; i++)
        viewer_release(&r.viewers[i]);
    free(r.viewers);
    if (rc)
        ggn_method_release(m);
    return rc;
}
