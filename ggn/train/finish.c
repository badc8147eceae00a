/* The end of a training: calibration and stopping policy on the validation scenes, the model file and its card. */
#include <cjson/cJSON.h>
#include <math.h>
#include <stdlib.h>

#include "base/json.h"
#include "model/policy.h"
#include "sight/observer.h"
#include "train/fit_policy.h"
#include "train/phase.h"
#include "train/start.h"

/* What a run is made of. The same data, options and seed give the same bytes, so nothing of time or place is in it. */
static cJSON *describe_run(const struct ggn_session *s, int *failed)
{
    const struct ggn_train_plan *p = s->plan;
    cJSON *o = cJSON_CreateObject();
    const struct {
        const char *name;
        double value;
    } numbers[] = {{"seed", p->seed},
                   {"steps_denoiser", p->steps_r},
                   {"steps", p->steps},
                   {"epochs", p->epochs},
                   {"batch_denoiser", p->batch_r},
                   {"batch", p->batch},
                   {"crop", s->crop},
                   {"lr_denoiser", p->lr_r},
                   {"lr", p->lr},
                   {"difference", p->difference},
                   {"soft_labels", p->soft_labels},
                   {"flips", p->flips},
                   {"jitter", p->jitter},
                   {"picture", p->noise_map},
                   {"synthetic_per_block", p->synthetic},
                   {"extended", p->extend},
                   {"best_step", (double)s->progress.best_step},
                   {"divergences", s->progress.divergences},
                   {"data_key", s->data_crc}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        base_json_number(o, numbers[i].name, numbers[i].value, failed);
    if (p->hyper.reach > 0)
        base_json_number(o, "residual", p->hyper.reach, failed);
    return o;
}

static cJSON *describe_data(const struct ggn_session *s, int *failed)
{
    cJSON *o = cJSON_CreateObject();
    for (int split = 0; split < GGN_SPLIT_NONE; split++) {
        cJSON *list = base_json_array(o, ggn_split_names[split], failed);
        for (int i = 0; i < s->set.data.n; i++) {
            if (s->set.data.views[i].split == (enum ggn_split)split && s->set.data.views[i].first == i)
                base_json_text(list, NULL, s->set.data.views[i].manifest.scene, failed);
        }
    }
    base_json_number(o, "training_blocks", ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 1), failed);
    base_json_number(o, "synthetic_chains",
                     ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 0) - ggn_series_set_count(&s->set, GGN_SPLIT_TRAIN, 1),
                     failed);
    base_json_number(o, "validation_blocks", ggn_series_set_count(&s->set, GGN_SPLIT_VALIDATION, 1), failed);
    base_json_number(o, "training_windows", s->train.n, failed);
    base_json_number(o, "validation_windows", s->validation.n, failed);
    base_json_text(o, "labels", ggn_dataset_label_source(&s->set.data), failed);
    return o;
}

static cJSON *describe_validation(const struct ggn_classified *v, const struct ggn_stopping *st, int *failed)
{
    cJSON *o = cJSON_CreateObject();
    base_json_number(o, "auc", v->auc, failed);
    base_json_number(o, "accuracy", v->accuracy, failed);
    base_json_number(o, "early_stop_rate", st->early_rate, failed);
    base_json_number(o, "samples_ratio", st->samples_ratio, failed);
    base_json_number(o, "median_abs_log2", st->median_abs_log2, failed);
    return o;
}

static int write_card(const struct ggn_session *s, const struct ggn_model *model, struct base_err *err)
{
    char path[4096];
    cJSON *card = cJSON_Duplicate(model->provenance, 1);
    int failed = 0;
    base_json_number(card, "k_r", s->hyper.k_r, &failed);
    base_json_number(card, "k_m", s->hyper.k_m, &failed);
    base_json_number(card, "k_d", s->hyper.k_d, &failed);
    base_json_number(card, "scale", model->policy.scale, &failed);
    base_json_number(card, "shift", model->policy.shift, &failed);
    base_json_number(card, "threshold", model->policy.threshold, &failed);
    base_json_number(card, "consecutive", model->policy.passes, &failed);
    base_json_number(card, "seconds_denoiser", floor(s->progress.seconds[0]), &failed);
    base_json_number(card, "seconds_judge", floor(s->progress.seconds[1]), &failed);
    snprintf(path, sizeof path, "%s.card.json", s->plan->out);
    int rc = base_json_write(path, card, failed, err);
    cJSON_Delete(card);
    return rc;
}

static void say(const struct ggn_session *s, const struct ggn_classified *v, const struct ggn_stopping *st)
{
    if (s->plan->progress)
        fprintf(
            s->plan->progress,
            "%s: validation AUC %.4f, accuracy %.3f; threshold %.2f stops %.1f %% of %d blocks early, %.2f of the samples "
            "needed, median |log2| %.2f\n",
            s->plan->out, v->auc, v->accuracy, v->policy.threshold, 100 * st->early_rate, st->blocks, st->samples_ratio,
            st->median_abs_log2);
}

static int export(const struct ggn_session *s, const struct ggn_classified *v, const struct ggn_stopping *stopping,
                  struct base_err *err)
{
    struct ggn_model *model = s->model;
    if (s->hyper.preset == GGN_PRESET_LULL)
        ggn_train_fold(&model->graph[GGN_NET_M], model->weights[GGN_NET_M]->params, s->hyper.window, s->plan->difference, 0);
    int failed = 0;
    base_json_item(model->provenance, "training", describe_run(s, &failed), &failed);
    base_json_item(model->provenance, "data", describe_data(s, &failed), &failed);
    base_json_item(model->provenance, "validation", describe_validation(v, stopping, &failed), &failed);
    int rc = failed ? base_fail_nomem(err, "description of the run") : ggn_policy_set(model, &v->policy, err);
    /* f32: half floats change a verdict now and then (ggn/models/README.md counts them); `ggn convert` makes them. */
    if (!rc)
        rc = ggn_model_save(model, s->plan->out, GGN_F32, err);
    return rc ? rc : write_card(s, model, err);
}

static int choose_threshold(const struct ggn_session *s, struct ggn_classified *v, struct ggn_stopping *stopping,
                            struct base_err *err)
{
    struct ggn_checks checks;
    if (!s->validation.n)
        return 0;
    int rc = ggn_checks_create(&checks, &s->validation, v->logit, &v->policy, err);
    if (rc)
        return rc;
    *stopping = s->hyper.reach > 0 ? ggn_calibrate_stopping(&checks, v->policy.threshold)
                                   : ggn_calibrate_threshold(&checks, s->plan->early_rate, &v->policy.threshold);
    ggn_checks_release(&checks);
    return 0;
}

static const double FIRST_SPP = 16; /* of the criterion `observer` */

int ggn_session_finish(struct ggn_session *s, struct base_err *err)
{
    struct ggn_stopping stopping = {0};
    struct ggn_classified v;
    struct ggn_policy *policy = &v.policy;
    int rc = ggn_classify_validation(s, s->validation.n, &v, err);
    if (rc) {
        free(v.logit);
        return rc;
    }
    policy->slope = ggn_calibrate_slope(&s->validation, v.logit, policy);
    ggn_series_set_pace(&s->set, policy);
    if (s->hyper.reach > 0) { /* like the law that it corrects: whose spread is known, where a few scenes tell little */
        policy->first_spp = fmax(policy->first_spp, FIRST_SPP);
        policy->threshold = GGN_OBSERVER_VISIBLE;
        policy->slope = 0.5 * s->scale;
    }
    /* the threshold last: it is chosen for the cadence that will stand beside it */
    rc = choose_threshold(s, &v, &stopping, err);
    if (!rc)
        rc = export(s, &v, &stopping, err);
    if (!rc)
        say(s, &v, &stopping);
    free(v.logit);
    return rc;
}
