#include "cli/replay.h"

#include <cjson/cJSON.h>

#include "baselines/learned.h"

static int load_models(struct ggn_replay *r, struct ggn_eval_options *o, int least_window, struct base_err *err)
{
    int longest = least_window, rc = 0;
    for (int i = 0; i < r->o->n_models && !rc; i++) {
        rc = ggn_model_load(r->o->models[i], &r->model[i], err);
        if (rc)
            break;
        const struct ggn_hyper *h = &r->model[i]->hyper;
        r->learned[i] = cJSON_GetObjectItemCaseSensitive(r->model[i]->provenance, "data");
        longest = h->window > longest ? h->window : longest;
        o->noise_maps |= h->noise_map && h->reach > 0;
        o->measures |= h->reach > 0;
    }
    if (r->o->n_models > 0)
        o->window = longest;
    return rc;
}

int ggn_replay_open(struct ggn_replay *r, struct ggn_eval_options *options, int least_window, struct base_err *err)
{
    const char *files[3 * GGN_REPLAY_FILES + 1];
    int n = 0;
    options->dir = r->o->data;
    options->quality = !r->o->no_quality;
    options->recorded = r->o->recorded;
    options->without_halves = r->o->no_halves;
    options->ratio = r->o->ratio;
    options->seed = 1;
    r->threads = base_threads_create(r->o->threads, err);
    int rc = r->threads ? load_models(r, options, least_window, err) : err->code;
    if (rc)
        return rc;
    for (int i = 0; i < r->o->n_models; i++)
        files[n++] = r->o->models[i];
    for (int i = 0; i < r->o->n_thresholds; i++)
        files[n++] = r->o->thresholds[i];
    for (int i = 0; i < r->o->n_baselines; i++)
        files[n++] = r->o->baselines[i];
    if (r->o->observer)
        files[n++] = r->o->observer;
    options->split.learned = r->learned;
    options->split.n_learned = r->o->n_models;
    options->files = files;
    options->n_files = n;
    return ggn_eval_set_load(&r->set, options, r->threads, &r->skipped, err);
}

void ggn_replay_close(struct ggn_replay *r)
{
    ggn_eval_set_release(&r->set);
    for (int i = 0; i < r->o->n_models; i++)
        ggn_model_destroy(r->model[i]);
    base_threads_destroy(r->threads);
}

int ggn_replay_policy(const struct ggn_replay *r, int model, struct ggn_policy *policy, struct base_err *err)
{
    int rc = ggn_policy_of(r->model[model], policy, err);
    if (!rc)
        r->adjust(r->command, policy);
    return rc;
}

int ggn_replay_model(const struct ggn_replay *r, int model, const char *name, enum ggn_precision precision,
                     struct ggn_method *m, struct base_err *err)
{
    struct ggn_policy policy;
    int rc = ggn_replay_policy(r, model, &policy, err);
    return rc ? rc
              : ggn_eval_trained(m, &r->set, r->model[model], &policy, name, precision, r->o->observer, r->threads, err);
}

int ggn_replay_baseline(const struct ggn_replay *r, int baseline, struct ggn_method *m, int *kind, struct base_err *err)
{
    struct ggn_baseline b;
    struct ggn_feature_set features = {0};
    int rc = ggn_baseline_load(&b, r->o->baselines[baseline], GGN_BASELINES, err);
    if (rc)
        return rc;
    *kind = (int)b.kind;
    r->adjust(r->command, &b.policy);
    if (b.window > r->set.window)
        rc = base_fail(err, BASE_EINVAL, "%s: it judges %d images, windows here have %d (ggn evaluate --window)",
                       r->o->baselines[baseline], b.window, r->set.window);
    if (!rc)
        rc = ggn_feature_set_make(&features, &b, &r->set, r->threads, err);
    if (!rc)
        rc = ggn_method_baseline(m, &r->set, &b, &features, r->threads, err);
    ggn_feature_set_release(&features);
    ggn_baseline_release(&b);
    return rc;
}

int ggn_replay_thresholds(const struct ggn_replay *r, int file, enum ggn_split split, struct ggn_method *m,
                          struct base_err *err)
{
    int available, rc = ggn_method_thresholds(m, &r->set, r->o->thresholds[file], split, &available, err);
    if (rc || available)
        return rc;
    ggn_method_release(m);
    return base_fail(err, BASE_EINVAL, "%s: not all views of the split '%s' are in it", r->o->thresholds[file],
                     ggn_split_names[split]);
}
