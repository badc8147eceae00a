/* `ggn evaluate --data DATA [--model MODEL]`: every metric of every method, on scenes that were kept apart. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/interrupt.h"
#include "base/json.h"
#include "base/options.h"
#include "baselines/learned.h"
#include "cli/commands.h"
#include "cli/replay.h"
#include "eval/strips.h"
#include "eval/tables.h"
#include "job/farm.h"
#include "model/setting.h"
#include "observer/observer.h"

enum { MAX_METHODS = 10 + 3 * GGN_REPLAY_FILES, MAX_ADJUSTED = 8 };

struct options {
    struct ggn_replay_options replay;
    const char *validation, *test, *out;
    int json, window, retune, baselines, epochs;
    double early, visible;
    int n_adjusted;
    struct {
        char name[16];
        double value;
    } adjusted[MAX_ADJUSTED]; /* of the models' policies */
};

static int add_adjusted(void *into, const char *arg, struct base_err *err)
{
    struct options *o = into;
    struct ggn_policy any = ggn_policy_default();
    const char *equals = strchr(arg, '=');

    if (!equals || equals == arg || (size_t)(equals - arg) >= sizeof o->adjusted[0].name || o->n_adjusted == MAX_ADJUSTED)
        return base_fail(err, BASE_EINVAL, "expected KEY=NUMBER, at most %d times", MAX_ADJUSTED);
    int i = o->n_adjusted++;
    snprintf(o->adjusted[i].name, sizeof o->adjusted[i].name, "%.*s", (int)(equals - arg), arg);
    if (!base_parse_real(equals + 1, -1e300, 1e300, &o->adjusted[i].value) ||
        !ggn_policy_adjust(&any, o->adjusted[i].name, o->adjusted[i].value) || ggn_policy_check(&any, NULL))
        return base_fail(err, BASE_EINVAL, "expected visible, passes or first-spp and a number in its range");
    return 0;
}

static const char *const written[] = {"figures.json", NULL}; /* its inputs are no pictures */

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {.help = "What is measured:"},
    {"data", 'd', "DATA", TO(replay.data), .input = BASE_FOLDER, .needed = 1,
     .help = "labelled data set: a folder of sequences (needed)"},
    {"validation", 'V', "SCENE,...", TO(validation),
     .help = "validation scenes, over the split of the data set or the models"},
    {"test", 'T', "SCENE,...", TO(test), .help = "test scenes, likewise"},
    {"model", 'm', "FILE", BASE_TO_LIST(struct options, replay.models, replay.n_models, "models"), .input = BASE_FILE,
     .help = "trained model (.ggn); may be repeated"},
    {"observer", 'O', "FILE", TO(replay.observer), .input = BASE_FILE,
     .help = "the observer's parameters, each view without itself (ggn label --calibrate); needed where there are people's "
             "views"},
    {"visible", 0, "SHARE", TO(visible), 1e-4, 0.9999,
     .help = "share of viewers that may still see noise, for observer (0.35) and models (their own)"},
    {"baseline", 0, "FILE", BASE_TO_LIST(struct options, replay.baselines, replay.n_baselines, "baselines"),
     .input = BASE_FILE, .help = "a published baseline as ggn baseline trained it; may be repeated"},
    {"thresholds", 0, "CSV", BASE_TO_LIST(struct options, replay.thresholds, replay.n_thresholds, "files of thresholds"),
     .input = BASE_FILE, .help = "a published model's thresholds of people's views; may be repeated"},
    {"param", 'p', "KEY=NUMBER", .set = add_adjusted,
     .help = "judge as the criterion does with this parameter: visible, passes, first-spp"},
    {.help = "What comes out:"},
    {"json", 'j', NULL, TO(json), .help = "print the figures as JSON"},
    {"output", 'o', "DIR", TO(out), .output = BASE_FOLDER, .files = written,
     .help = "write figures.json, stops and strips of blocks there; lull-plot draws the first"},
    {.help = "How:"},
    {"early", 0, "RATE", TO(early), 0, 1, .help = "early-stop rate that cuts are tuned for on the training scenes (0.05)"},
    {"retune", 0, NULL, TO(retune),
     .help = "tune the models' thresholds too, on the validation scenes, instead of taking the stored ones"},
    {"no-quality", 0, NULL, TO(replay.no_quality), .help = "skip FLIP and SSIM at the stop"},
    {"no-pictures", 0, NULL, TO(replay.no_halves), .help = "judge as in a host without half buffers"},
    {"baselines", 0, NULL, TO(baselines),
     .help = "train the published baselines on the training scenes and measure them too (minutes)"},
    {"epochs", 0, "N", TO(epochs), 1, 1024, .help = "epochs of the LSTM baseline (15)"},
    {"recorded", 0, NULL, TO(replay.recorded),
     .help = "stop at the last recorded level instead of going on with the samples of the reference"},
    {"ratio", 0, "R", TO(replay.ratio), 1, 16,
     .help = "thin the levels to this ratio of samples (SIN3D: 1.15); else keep all"},
    {"window", 'w', "S", TO(window), 1, 16, .help = "levels that a window has when no model says so (6)"},
    {"threads", 't', "N", TO(replay.threads), 1, 1024, .help = "worker threads (all processors)"},
    {0}};

struct evaluation {
    const struct options *o;
    struct ggn_replay r;
    struct ggn_method methods[MAX_METHODS];
    int n;
    /* whose decisions a model's are compared with: the first model's; else -1 */
    int likened[MAX_METHODS];
    enum ggn_split tuning, tuning_models;
};

/* A method that could be made takes its place in the list; one that lacks its data does not. */
static int add_trivial(struct evaluation *j, struct base_err *err)
{
    int available, rc = ggn_method_spp(&j->methods[j->n], &j->r.set, err);
    if (!rc)
        rc = ggn_method_tune(&j->methods[j->n++], &j->r.set, j->tuning, j->o->early, err);
    if (!rc && (rc = ggn_method_constant(&j->methods[j->n], &j->r.set, err)) == 0)
        j->n++;
    if (!rc && (rc = ggn_method_scene_mean(&j->methods[j->n], &j->r.set, err)) == 0)
        j->n++;
    for (int k = 0; k < 2 && !rc; k++) {
        struct ggn_method *m = &j->methods[j->n];
        rc = k == 0 ? ggn_method_halfbuf(m, &j->r.set, &available, err) : ggn_method_variance(m, &j->r.set, &available, err);
        if (!rc && !available)
            ggn_method_release(m);
        else if (!rc)
            rc = ggn_method_tune(&j->methods[j->n++], &j->r.set, j->tuning, j->o->early, err);
    }
    return rc;
}

static void adjust(const void *command, struct ggn_policy *policy)
{
    const struct options *o = command;
    if (o->visible > 0)
        policy->threshold = o->visible;
    for (int i = 0; i < o->n_adjusted; i++)
        ggn_policy_adjust(policy, o->adjusted[i].name, o->adjusted[i].value);
}

static int add_baselines(struct evaluation *j, struct base_err *err)
{
    int rc = 0, kind;
    for (int i = 0; i < j->o->replay.n_baselines && !rc; i++)
        if ((rc = ggn_replay_baseline(&j->r, i, &j->methods[j->n], &kind, err)) == 0)
            j->n++;
    for (int k = 0; k < GGN_BASELINES && j->o->baselines && !rc; k++) {
        struct ggn_baseline trained;
        rc = ggn_method_learned(&j->methods[j->n], &trained, &j->r.set, (enum ggn_baseline_kind)k, j->tuning, j->o->early,
                                j->o->epochs, j->r.threads, err);
        if (rc)
            return rc;
        ggn_baseline_release(&trained);
        j->n++;
    }
    return rc;
}

static int add_models(struct evaluation *j, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < j->o->replay.n_models && !rc; i++) {
        char name[GGN_METHOD_NAME];
        snprintf(name, sizeof name, "%.40s", base_file_name(j->o->replay.models[i]));
        rc = ggn_replay_model(&j->r, i, name, GGN_PRECISION_F32, &j->methods[j->n], err);
        if (rc)
            return rc;
        j->likened[j->n] = i > 0 ? j->n - i : -1;
        struct ggn_method *m = &j->methods[j->n++];
        if (j->o->retune)
            rc = ggn_method_tune(m, &j->r.set, j->tuning_models, j->o->early, err);
    }
    return rc;
}

static int check_people(const struct evaluation *j, struct base_err *err)
{
    const struct ggn_dataset *d = &j->r.set.images.data;
    for (int i = 0; i < d->n; i++) {
        const struct ggn_dataset_view *v = &d->views[i];
        if (v->split != GGN_SPLIT_PEOPLE)
            continue;
        if (!v->has_labels || strcmp(v->labels.source, "human") != 0)
            return base_fail(err, BASE_EINVAL, "%s: no human thresholds (ggn label --human CSV %s)", v->dir, v->dir);
        if (!j->o->replay.observer)
            return base_fail(err, BASE_EINVAL,
                             "%s: may have been fitted: --observer FILE says what the observer is without it", v->dir);
    }
    return 0;
}

static int add_observed(struct evaluation *j, struct base_err *err)
{
    int available, rc = check_people(j, err);
    if (rc)
        return rc;
    const double visible = j->o->visible > 0 ? j->o->visible : GGN_OBSERVER_VISIBLE;
    for (int halves = 1; halves >= 0 && !rc; halves--) {
        struct ggn_method *m = &j->methods[j->n];
        rc = ggn_method_observer(m, &j->r.set, j->o->replay.observer, halves, visible, GGN_OBSERVER_GROWTH, &available, err);
        if (!rc && available)
            j->n++;
        else if (!rc)
            ggn_method_release(m);
    }
    for (int i = 0; i < j->o->replay.n_thresholds && !rc; i++)
        if ((rc = ggn_replay_thresholds(&j->r, i, GGN_SPLIT_PEOPLE, &j->methods[j->n], err)) == 0)
            j->n++;
    return rc;
}

/* What other models change on a split: verdicts on windows that both judged, and where blocks stop. */
static void report_changes(const struct evaluation *j, enum ggn_split split, cJSON *to, int *failed)
{
    for (int i = 0; i < j->n; i++) {
        if (j->likened[i] < 0)
            continue;
        const struct ggn_method *other = &j->methods[i], *first = &j->methods[j->likened[i]];
        int windows = 0, verdicts = 0, blocks = 0, stops = 0;
        double furthest = 0.0;
        for (int b = 0; b < j->r.set.n_blocks; b++) {
            const struct ggn_eval_block *block = &j->r.set.blocks[b];
            if (block->split != split)
                continue;
            blocks++;
            stops += other->stop[b] != first->stop[b];
            for (size_t k = block->first; k < block->end; k++) {
                if (isnan(first->score[k]) || isnan(other->score[k]))
                    continue;
                windows++;
                verdicts += ggn_method_passes(other, k) != ggn_method_passes(first, k);
                furthest = fmax(furthest, fabs(other->score[k] - first->score[k]));
            }
        }
        if (!j->o->json)
            printf("%s: %d of %d verdicts and %d of %d stops differ from %s; p moves by at most %.2g\n\n", other->name,
                   verdicts, windows, stops, blocks, first->name, furthest);
        cJSON *o = base_json_object(to, other->name, failed);
        base_json_text(o, "from", first->name, failed);
        base_json_number(o, "windows", windows, failed);
        base_json_number(o, "verdicts_changed", verdicts, failed);
        base_json_number(o, "blocks", blocks, failed);
        base_json_number(o, "stops_changed", stops, failed);
        base_json_number(o, "p_moved_at_most", furthest, failed);
    }
}

/* What each method said of a block's windows. */
static void report_windows(const struct evaluation *j, const struct ggn_eval_block *block, cJSON *to, int *failed)
{
    const struct ggn_eval_set *s = &j->r.set;
    cJSON *spp = base_json_array(to, "spp", failed), *noisy = base_json_array(to, "noisy", failed);
    for (size_t k = block->first; k < block->end; k++) {
        base_json_number(spp, NULL, ggn_eval_compared(block, s->spp[k]), failed);
        base_json_number(noisy, NULL, s->noisy[k] < 0 ? (double)NAN : s->noisy[k], failed);
    }
    cJSON *scores = base_json_object(to, "scores", failed);
    for (int i = 0; i < j->n; i++) {
        cJSON *of = j->methods[i].score ? base_json_array(scores, j->methods[i].name, failed) : NULL;
        for (size_t k = block->first; k < block->end && of; k++)
            base_json_number(of, NULL, j->methods[i].score[k], failed);
    }
}

/* Of every block, where each method stops, and why. */
static void report_stops(const struct evaluation *j, cJSON *to, int *failed)
{
    for (int b = 0; b < j->r.set.n_blocks; b++) {
        const struct ggn_eval_block *block = &j->r.set.blocks[b];
        const struct ggn_dataset_view *view = &j->r.set.images.data.views[block->view];
        const struct seq_manifest_block *at = &view->manifest.blocks[block->index];
        cJSON *o = base_json_object(to, NULL, failed);
        base_json_text(o, "scene", view->manifest.scene, failed);
        base_json_text(o, "view", view->name, failed);
        base_json_number(o, "block", at->id, failed);
        base_json_number(o, "threshold", ggn_eval_compared(block, block->label.threshold), failed);
        base_json_bool(o, "censored", block->label.censored, failed);
        cJSON *spp = base_json_object(o, "spp", failed);
        for (int i = 0; i < j->n; i++)
            base_json_number(spp, j->methods[i].name, ggn_eval_compared(block, j->methods[i].stop[b]), failed);
        base_json_text(o, "split", ggn_split_names[block->split], failed);
        base_json_number(o, "column", at->x0 / view->manifest.block, failed);
        base_json_number(o, "row", at->y0 / view->manifest.block, failed);
        report_windows(j, block, base_json_object(o, "windows", failed), failed);
    }
}

/* What beside the figures goes into the folder: stops, and strips of what the first model's networks make of blocks. */
static int write_beside(const struct evaluation *j, enum ggn_split split, cJSON *strips, int *failed, struct base_err *err)
{
    char path[4096];
    int rc = ggn_report_stops(j->o->out, &j->r.set, split, j->methods, j->n, err);
    if (rc || j->o->replay.n_models == 0 || split == GGN_SPLIT_TRAIN)
        return rc;
    snprintf(path, sizeof path, "%.3900s/%s-denoiser.png", j->o->out, ggn_split_names[split]);
    rc = ggn_eval_denoiser_picture(path, &j->r.set, j->r.model[0], split, strips, failed, err);
    snprintf(path, sizeof path, "%.3900s/%s-features.png", j->o->out, ggn_split_names[split]);
    return !rc ? ggn_eval_feature_picture(path, &j->r.set, j->r.model[0], split, strips, failed, err) : rc;
}

static int report(struct evaluation *j, struct base_err *err)
{
    struct ggn_method_metrics metrics[MAX_METHODS];
    cJSON *root = cJSON_CreateObject();
    char path[4096];
    int failed = 0;
    base_json_text(root, "data", j->o->replay.data, &failed);
    base_json_text(root, "labels", ggn_dataset_label_source(&j->r.set.images.data), &failed);
    base_json_text(root, "split", ggn_split_sources[j->r.set.images.split_source], &failed);
    base_json_number(root, "window", j->r.set.window, &failed);
    base_json_number(root, "early_rate_tuned_for", j->o->early, &failed);
    base_json_text(root, "tuned_on", ggn_split_names[j->tuning], &failed);
    cJSON *splits = base_json_object(root, "splits", &failed), *changes = base_json_object(root, "changes", &failed);
    cJSON *strips = j->o->out ? base_json_object(root, "strips", &failed) : NULL;
    int rc = 0;
    if (!j->o->json)
        printf("labels: %s; split: %s; cuts tuned on %s for %.1f %% early stops%s\n",
               ggn_dataset_label_source(&j->r.set.images.data), ggn_split_sources[j->r.set.images.split_source],
               ggn_split_names[j->tuning], 100.0 * j->o->early,
               j->r.skipped > 0 ? "; views without labels are left out" : "");
    for (int split = 0; split < GGN_SPLITS && !rc; split++) {
        if (ggn_eval_count(&j->r.set, (enum ggn_split)split) == 0)
            continue;
        for (int i = 0; i < j->n && !rc; i++)
            rc = ggn_method_measure(&j->methods[i], &j->r.set, (enum ggn_split)split, &metrics[i], err);
        if (rc)
            break;
        if (!j->o->json)
            rc = ggn_report_table(stdout, &j->r.set, (enum ggn_split)split, j->methods, metrics, j->n, err);
        if (!rc && !j->o->json && split == GGN_SPLIT_PEOPLE)
            rc = ggn_report_people(stdout, &j->r.set, j->methods, j->n, err);
        ggn_report_json(base_json_object(splits, ggn_split_names[split], &failed), j->methods, metrics, j->n, &failed);
        report_changes(j, (enum ggn_split)split, base_json_object(changes, ggn_split_names[split], &failed), &failed);
        if (j->o->out)
            rc = write_beside(j, (enum ggn_split)split, strips, &failed, err);
    }
    report_stops(j, base_json_array(root, "stops", &failed), &failed);
    if (!rc && j->o->json)
        rc = base_json_write(NULL, root, failed, err);
    if (!rc && j->o->out && !(rc = base_file_join(path, j->o->out, "figures.json", err)))
        rc = base_json_write(path, root, failed, err);
    cJSON_Delete(root);
    return rc;
}

/* A scene that a model has met in training says nothing about scenes that it has not met. */
static void warn_of_learned(const struct evaluation *j)
{
    const struct ggn_dataset *d = &j->r.set.images.data;
    for (int i = 0; i < d->n && job_rank(ggn_cmd_job) == 0; i++)
        for (int k = 0; k < j->o->replay.n_models && ggn_dataset_first(d, i) == i; k++) {
            const struct ggn_dataset_view *v = &d->views[i];
            const enum ggn_split own = ggn_split_learned(j->r.learned[k], v->manifest.scene);
            if (own < v->split && v->split != GGN_SPLIT_NONE && v->split != GGN_SPLIT_PEOPLE)
                fprintf(stderr, "ggn evaluate: %s: scene '%s' is in %s here, and in %s of this model\n",
                        j->o->replay.models[k], v->manifest.scene, ggn_split_names[v->split], ggn_split_names[own]);
        }
}

/* A host asks a model at the samples that it has learned with, about blocks of its size. Where the recording has others,
 * what is judged here is not what a host would stop by. */
static int warn_of_setting(const struct evaluation *j, int index, struct base_err *err)
{
    const struct ggn_series_set *s = &j->r.set.images;
    const struct ggn_model *model = j->r.model[index];
    const char *path = j->o->replay.models[index];
    struct ggn_policy policy;
    char text[200];
    double asked, nearest;
    int rc = ggn_replay_policy(&j->r, index, &policy, err);
    const struct ggn_setting learned = {model->hyper.width, model->hyper.height, GGN_TRANSFER_SRGB};
    const struct ggn_setting here = {s->width, s->height, GGN_TRANSFER_SRGB};
    if (!rc && ggn_setting_difference(&learned, &here, text, sizeof text))
        fprintf(stderr, "ggn evaluate: %s: the model is asked about what it has not learned: %s\n", path, text);
    for (int i = 0; i < s->n && !rc; i++)
        if (ggn_setting_levels_differ(&policy, s->series[i].spp, s->series[i].n_levels, &asked, &nearest)) {
            fprintf(stderr,
                    "ggn evaluate: %s: a host asks at %g samples, %s has %g next to it: other windows than a "
                    "host's are judged\n",
                    path, asked, s->data.views[s->series[i].view].dir, nearest);
            break;
        }
    return rc;
}

static int load(struct evaluation *j, struct base_err *err)
{
    const struct options *o = j->o;
    struct ggn_eval_options eo = {
        .split = {.validation = o->validation, .test = o->test}, .window = o->window, .job = ggn_cmd_job};
    int rc = ggn_replay_open(&j->r, &eo, 0, err);
    if (!rc)
        warn_of_learned(j);
    for (int i = 0; i < o->replay.n_models && !rc && job_rank(ggn_cmd_job) == 0; i++)
        rc = warn_of_setting(j, i, err);
    return rc;
}

static int measure(struct evaluation *j, struct base_err *err)
{
    j->tuning = ggn_eval_count(&j->r.set, GGN_SPLIT_TRAIN) > 0 ? GGN_SPLIT_TRAIN : j->r.set.blocks[0].split;
    j->tuning_models = ggn_eval_count(&j->r.set, GGN_SPLIT_VALIDATION) > 0 ? GGN_SPLIT_VALIDATION : j->tuning;
    int rc = add_trivial(j, err);
    if (!rc)
        rc = add_observed(j, err);
    if (!rc)
        rc = add_baselines(j, err);
    return rc ? rc : add_models(j, err);
}

int ggn_cmd_evaluate(int argc, char **argv)
{
    static const struct base_options options = {
        .list = list,
        .doc =
            "Measures models, the trivial baselines and the criteria halfbuf and variance on the same recorded sequences, "
            "separately for training, validation and test scenes and for views that people judged. Under mpirun the "
            "processes share out the blocks."};
    struct options o = {.early = 0.05, .replay.threads = job_threads(ggn_cmd_job), .window = 6, .epochs = 15};
    const int speaks = job_rank(ggn_cmd_job) == 0;
    struct evaluation j = {.o = &o, .r = {.o = &o.replay, .adjust = adjust, .command = &o}};
    struct base_err err = {0};

    if (base_options_parse(&options, argc, argv, &o, &err))
        return ggn_cmd_fail(argv[0], &err);
    if (ggn_cmd_job)
        base_interrupt_catch(); /* that is how MPI says that a process has died */
    ggn_cmd_follow_rank_0();
    for (int i = 0; i < MAX_METHODS; i++)
        j.likened[i] = -1;
    int rc = speaks && o.out ? base_make_folder(o.out, &err) : 0;
    if (!rc)
        rc = load(&j, &err);
    if (!rc && !base_interrupted)
        rc = measure(&j, &err);
    if (!rc && !base_interrupted && speaks)
        rc = report(&j, &err);
    for (int i = 0; i < j.n; i++)
        ggn_method_release(&j.methods[i]);
    ggn_replay_close(&j.r);
    if (rc && rc != JOB_STOPPED)
        return ggn_cmd_fail(argv[0], &err);
    return base_interrupted ? GGN_EXIT_INTERRUPTED : GGN_EXIT_OK;
}
