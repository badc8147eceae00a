/* `ggn baseline NAME --data DATA --output FILE`: a published model before the network, trained for the criterion NAME. */
#include <stdio.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/json.h"
#include "base/options.h"
#include "baselines/learned.h"
#include "cli/commands.h"
#include "model/container.h"

struct options {
    const char *name, *out;
    struct ggn_eval_options set;
    int type, epochs, threads;
    double early;
};
#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"data", 'd', "DATA", TO(set.data.dir), .input = BASE_FOLDER, .needed = 1,
     .help = "labelled data set: a folder of sequences with split.json (needed)"},
    {"output", 'o', "FILE", TO(out), .needed = 1, .output = BASE_FILE, .kind = &ggn_container_kind,
     .help = "the model, for -p model=FILE (needed)"},
    {"epochs", 0, "N", TO(epochs), 1, 1024, .help = "epochs of svd-entropy's LSTM (30, as published)"},
    {"early", 0, "RATE", TO(early), 0, 1,
     .help = "early-stop rate that the threshold is tuned for on the training scenes "
             "(0.05)"},
    {"ratio", 0, "R", TO(set.data.ratio), 1, 16, .help = "thin the levels to this ratio of samples; else keep all"},
    {"window", 'w', "S", TO(set.window), 2, 16, .help = "images that svd-entropy judges together (6)"},
    {"type", 't', NULL, TO(type), .words = ggn_type_names, .help = "type of the stored weights (f32)"},
    {"threads", 0, "N", TO(threads), 1, 1024, .help = "worker threads (all processors)"},
    {0}};

static int save(const struct options *o, const struct ggn_baseline *b, const struct ggn_eval_set *s,
                const struct ggn_method_figures *m, struct base_err *err)
{
    cJSON *from = cJSON_CreateObject();
    int failed = !from;
    base_json_text(from, "labels", ggn_dataset_label_source(&s->images.data), &failed);
    base_json_number(from, "blocks", m->blocks, &failed);
    base_json_number(from, "scenes", m->scenes, &failed);
    base_json_number(from, "windows", (double)m->windows, &failed);
    base_json_number(from, "epochs", b->lstm ? o->epochs : 0, &failed);
    base_json_number(from, "early_rate_tuned_for", o->early, &failed);
    base_json_number(from, "training_auc", m->auc, &failed);
    base_json_number(from, "training_early_stop_rate", m->early_stop_rate, &failed);
    base_json_number(from, "training_samples_ratio", m->samples_ratio, &failed);
    int rc = failed ? base_fail_nomem(err, "baseline") : ggn_baseline_save(b, o->out, (enum ggn_type)o->type, from, err);
    cJSON_Delete(from);
    return rc;
}

static int train(const struct options *o, enum ggn_baseline_kind kind, struct ggn_eval_set *s, struct base_threads *threads,
                 struct base_err *err)
{
    enum ggn_split split = ggn_eval_count(s, GGN_SPLIT_TRAIN) > 0 ? GGN_SPLIT_TRAIN : GGN_SPLIT_NONE;
    struct ggn_baseline b;
    struct ggn_method m;
    struct ggn_method_figures figures;
    int rc = ggn_method_learned(&m, &b, s, kind, split, o->early, o->epochs, threads, err);
    if (rc)
        return rc;
    rc = ggn_method_measure(&m, s, split, &figures, err);
    if (!rc)
        rc = save(o, &b, s, &figures, err);
    if (!rc)
        printf("%s: %d blocks of %d scenes; on these: AUC %.4f, early %.3f, samples %.3f; threshold %.4f\n%s\n",
               ggn_baseline_titles[kind], figures.blocks, figures.scenes, figures.auc, figures.early_stop_rate,
               figures.samples_ratio, b.policy.threshold, o->out);
    ggn_method_release(&m);
    ggn_baseline_release(&b);
    return rc;
}

int ggn_cmd_baseline(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .args_doc = "NAME",
        .args_min = 1,
        .args_max = 1,
        .args_are = BASE_ARGS_WORDS,
        .args = offsetof(struct options, name),
        .doc = "Trains svd-entropy, attributes or noise-mask, the published models before the network, on the training "
               "scenes of a data set (calibrated on its validation scenes). The file is what the criterion of that name and "
               "`ggn evaluate --baseline` judge by."};
    struct options o = {.epochs = 30, .set = {.window = 6, .seed = 1}, .early = 0.05, .threads = base_threads_available()};
    struct ggn_eval_set set = {0};
    struct base_threads *threads = NULL;
    int skipped, kind = 0;
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc && (kind = base_word_index(ggn_baseline_names, o.name, strlen(o.name))) < 0)
        rc = base_fail(err, BASE_EINVAL, "'%.80s' is none of svd-entropy, attributes, noise-mask", o.name);
    if (!rc && !(threads = base_threads_create(o.threads, err)))
        rc = err->code;
    if (!rc)
        rc = ggn_eval_set_load(&set, &o.set, threads, &skipped, err);
    if (!rc)
        rc = train(&o, (enum ggn_baseline_kind)kind, &set, threads, err);
    ggn_eval_set_release(&set);
    base_threads_destroy(threads);
    return rc;
}
