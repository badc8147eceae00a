/* The end of a training: calibration and stopping policy on the validation scenes, the model file and its card. */
#include <cjson/cJSON.h>
#include <math.h>

#include "base/json.h"
#include "model/policy.h"
#include "observer/observer.h"
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
    if (p->reach > 0)
        base_json_number(o, "residual", p->reach, failed);
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

static cJSON *describe_validation(const struct ggn_stopping *st, double auc, double accuracy, int *failed)
{
    cJSON *o = cJSON_CreateObject();

    base_json_number(o, "auc", auc, failed);
    base_json_number(o, "accuracy", accuracy, failed);
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

static void say(const struct ggn_session *s, const struct ggn_policy *policy, const struct ggn_stopping *st, double auc,
                double accuracy)
{
    if (s->plan->progress)
        fprintf(
            s->plan->progress,
            "%s: validation AUC %.4f, accuracy %.3f; threshold %.2f stops %.1f %% of %d blocks early, %.2f of the samples "
            "needed, median |log2| %.2f\n",
            s->plan->out, auc, accuracy, policy->threshold, 100 * st->early_rate, st->blocks, st->samples_ratio,
            st->median_abs_log2);
}

static int export(struct ggn_session *s, const struct ggn_policy *policy, const struct ggn_stopping *stopping, double auc,
                  double accuracy, struct base_err *err)
{
    struct ggn_model *model = ggn_model_create(&s->hyper, err);

    if (!model)
        return BASE_ENOMEM;
    for (int net = 0; net < GGN_NETS; net++)
        ggn_weights_copy(model->weights[net], net == GGN_NET_R ? s->r->params : s->trainer->weights[net]->params);
    if (s->hyper.preset == GGN_PRESET_LULL)
        ggn_train_fold(&model->graph[GGN_NET_M], model->weights[GGN_NET_M]->params, s->hyper.window, s->plan->difference, 0);
    int failed = 0;
    base_json_item(model->provenance, "training", describe_run(s, &failed), &failed);
    base_json_item(model->provenance, "data", describe_data(s, &failed), &failed);
    base_json_item(model->provenance, "validation", describe_validation(stopping, auc, accuracy, &failed), &failed);
    int rc = failed ? base_fail_nomem(err, "description of the run") : ggn_policy_set(model, policy, err);
    /* f32: half floats change a verdict now and then (ggn/models/README.md counts them); `ggn convert` makes them. */
    if (!rc)
        rc = ggn_model_save(model, s->plan->out, GGN_F32, err);
    if (!rc)
        rc = write_card(s, model, err);
    ggn_model_destroy(model);
    return rc;
}

static int choose_threshold(const struct ggn_session *s, const struct ggn_classified *v, struct ggn_policy *policy,
                            struct ggn_stopping *stopping, struct base_err *err)
{
    struct ggn_checks checks;

    if (!v->n)
        return 0;
    int rc = ggn_checks_create(&checks, &s->validation, v->logit, policy, err);
    if (rc)
        return rc;
    if (s->hyper.reach > 0)
        rc = ggn_calibrate_stopping(&checks, policy->threshold, stopping, err);
    else
        rc = ggn_calibrate_threshold(&checks, s->plan->early_rate, policy, stopping, err);
    ggn_checks_release(&checks);
    return rc;
}

static const double FIRST_SPP = 16; /* of the criterion `observer` */

int ggn_session_finish(struct ggn_session *s, struct base_err *err)
{
    struct ggn_policy policy = ggn_policy_default();
    struct ggn_stopping stopping = {0};
    struct ggn_classified v;
    double accuracy = (double)NAN;
    int rc = ggn_classify_validation(s, s->validation.n, &v, err), right = 0;

    if (rc) {
        ggn_classified_release(&v);
        return rc;
    }
    if (v.n) {
        ggn_session_calibrate(s, &v, &policy);
        for (int i = 0; i < v.n; i++)
            right += (ggn_policy_p(&policy, v.logit[i]) >= 0.5) == v.noisy[i];
        accuracy = (double)right / v.n;
        policy.slope = ggn_calibrate_slope(&s->validation, v.logit, &policy);
    }
    ggn_series_set_pace(&s->set, &policy);
    if (s->hyper.reach > 0) { /* like the law that it corrects: whose spread is known, where a few scenes tell little */
        policy.first_spp = fmax(policy.first_spp, FIRST_SPP);
        policy.threshold = GGN_OBSERVER_VISIBLE;
        policy.slope = 0.5 * s->scale;
    }
    /* the threshold last: it is chosen for the cadence that will stand beside it */
    rc = choose_threshold(s, &v, &policy, &stopping, err);
    if (!rc)
        rc = export(s, &policy, &stopping, v.auc, accuracy, err);
    if (!rc)
        say(s, &policy, &stopping, v.auc, accuracy);
    ggn_classified_release(&v);
    return rc;
}
