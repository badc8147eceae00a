/* `ggn replay --data DATA`: recorded blocks through models and baselines; per case what was seen, spent and answered. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/json.h"
#include "base/options.h"
#include "baselines/learned.h"
#include "cli/commands.h"
#include "sight/observer.h"

enum { MAX_FILES = 16, MAX_ADJUSTED = 8, USUAL_WINDOW = 6 };

struct options {
    struct ggn_eval_options set;
    const char *observer, *out;
    const char *models[MAX_FILES], *baselines[MAX_FILES];
    int n_models, n_baselines, n_adjusted;
    int precision, no_quality, threads;
    double visible;
    struct {
        char name[16];
        double value;
    } adjusted[MAX_ADJUSTED]; /* of all policies */
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

static const char *const precisions[] = {"f32", "f64", NULL}; /* enum ggn_precision */

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {.help = "What is replayed:"},
    {"data", 'd', "DATA", TO(set.data.dir), .input = BASE_FOLDER, .needed = 1,
     .help = "labelled data set: a folder of sequences (needed)"},
    {"validation", 'V', "SCENE,...", TO(set.data.split.validation),
     .help = "validation scenes, over the split of the data set or the models"},
    {"test", 'T', "SCENE,...", TO(set.data.split.test), .help = "test scenes, likewise"},
    {"model", 'm', "FILE", BASE_TO_LIST(struct options, models, n_models, "models"), .input = BASE_FILE,
     .help = "trained model (.ggn); may be repeated"},
    {"baseline", 0, "FILE", BASE_TO_LIST(struct options, baselines, n_baselines, "baselines"), .input = BASE_FILE,
     .help = "what ggn baseline wrote; may be repeated"},
    {"observer", 'O', "FILE", TO(observer), .input = BASE_FILE,
     .help = "the observer's parameters, each view without itself (ggn label --calibrate)"},
    {"output", 'o', "FILE", TO(out), .output = BASE_FILE, .help = "write there instead of printing"},
    {.help = "How:"},
    {"visible", 0, "SHARE", TO(visible), 1e-4, 0.9999,
     .help = "share of viewers that may still see noise (that of the files)"},
    {"param", 'p', "KEY=NUMBER", .set = add_adjusted,
     .help = "judge as the criterion does with this parameter: visible, passes, first-spp"},
    {"cadence", 0, "R", TO(set.cadence), 1.02, 16, .help = "simulate all levels, this far apart, and ask as often"},
    {"ratio", 0, "R", TO(set.data.ratio), 1, 16,
     .help = "thin the levels, and the checks, to this ratio of samples; else keep all"},
    {"recorded", 0, NULL, TO(set.recorded),
     .help = "recorded levels only, instead of going on with the samples of the reference"},
    {"window", 'w', "S", TO(set.window), 1, 16, .help = "levels that a window has at least (as the models say, or 6)"},
    {"precision", 0, NULL, TO(precision), .words = precisions, .help = "of the networks' arithmetic (f32)"},
    {"no-pictures", 0, NULL, TO(set.without_halves), .help = "networks as in a host without half buffers"},
    {"no-quality", 0, NULL, TO(no_quality), .help = "skip FLIP and SSIM"},
    {"no-ssim", 0, NULL, TO(set.no_ssim), .help = "skip SSIM"},
    {"threads", 't', "N", TO(threads), 1, 1024, .help = "worker threads (all processors)"},
    {0}};

struct replay {
    const struct options *o;
    struct base_threads *threads;           /* owns */
    struct ggn_model *model[MAX_FILES];     /* own */
    const struct cJSON *learned[MAX_FILES]; /* borrow; the data that each was made with */
    struct ggn_eval_set set;                /* owns */
    struct ggn_observer *observers;         /* owns; [views]: who judges it */
    int skipped;                            /* views without labels */
};

static void adjust(const struct options *o, struct ggn_policy *policy)
{
    if (o->visible > 0)
        policy->threshold = o->visible;
    for (int i = 0; i < o->n_adjusted; i++)
        ggn_policy_adjust(policy, o->adjusted[i].name, o->adjusted[i].value);
    if (o->set.cadence > 0) {
        policy->ratio = o->set.cadence;
        policy->n_levels = 0;
    }
}

/* A scene that a model has met in training says nothing about scenes that it has not met. */
static void warn_of_learned(const struct replay *r)
{
    const struct ggn_dataset *d = &r->set.images.data;
    for (int i = 0; i < d->n; i++)
        for (int k = 0; k < r->o->n_models && d->views[i].first == i; k++) {
            const struct ggn_dataset_view *v = &d->views[i];
            const enum ggn_split own = ggn_split_learned(r->learned[k], v->manifest.scene);
            if (own < v->split && v->split != GGN_SPLIT_NONE && v->split != GGN_SPLIT_PEOPLE)
                fprintf(stderr, "ggn replay: %s: scene '%s' is in %s here, and in %s of this model\n", r->o->models[k],
                        v->manifest.scene, ggn_split_names[v->split], ggn_split_names[own]);
        }
}

/* A host asks a model at the samples that it has learned with, about blocks of its size. Where the recording has others,
 * what is judged here is not what a host would stop by. */
static void warn_of_setting(const struct replay *r, int index, const struct ggn_policy *policy)
{
    const struct ggn_series_set *s = &r->set.images;
    const struct ggn_model *model = r->model[index];
    const char *path = r->o->models[index];
    char text[200];
    double asked, nearest;
    const struct ggn_setting learned = {model->hyper.width, model->hyper.height, GGN_TRANSFER_SRGB};
    const struct ggn_setting here = {s->width, s->height, GGN_TRANSFER_SRGB};
    if (ggn_setting_difference(&learned, &here, text, sizeof text))
        fprintf(stderr, "ggn replay: %s: the model is asked about what it has not learned: %s\n", path, text);
    for (int i = 0; i < s->n; i++)
        if (ggn_policy_levels_differ(policy, s->series[i].spp, s->series[i].n_levels, &asked, &nearest)) {
            fprintf(stderr,
                    "ggn replay: %s: a host asks at %g samples, %s has %g next to it: other windows than a "
                    "host's are judged\n",
                    path, asked, s->data.views[s->series[i].view].dir, nearest);
            return;
        }
}

static int load(struct replay *r, struct base_err *err)
{
    struct ggn_eval_options eo = r->o->set;
    eo.quality = !r->o->no_quality;
    eo.seed = 1;
    eo.data.split.learned = r->learned;
    eo.data.split.n_learned = r->o->n_models;
    r->threads = base_threads_create(r->o->threads, err);
    int rc = r->threads ? 0 : err->code;
    /* One set is read for all models: windows of the longest, and what any of them measures. */
    for (int i = 0; i < r->o->n_models && !rc; i++) {
        rc = ggn_model_load(r->o->models[i], &r->model[i], err);
        if (rc)
            break;
        const struct ggn_hyper *h = &r->model[i]->hyper;
        r->learned[i] = cJSON_GetObjectItemCaseSensitive(r->model[i]->provenance, "data");
        eo.window = h->window > eo.window ? h->window : eo.window;
        eo.data.noise_maps |= h->noise_map && h->reach > 0;
        eo.data.measures |= h->reach > 0;
    }
    eo.window = eo.window > 0 ? eo.window : USUAL_WINDOW;
    if (!rc)
        rc = ggn_eval_set_load(&r->set, &eo, r->threads, &r->skipped, err);
    if (rc)
        return rc;
    warn_of_learned(r);
    const struct ggn_dataset *d = &r->set.images.data;
    r->observers = malloc((size_t)d->n * sizeof *r->observers);
    if (!r->observers)
        return base_fail_nomem(err, "observers");
    for (int i = 0; i < d->n && !rc; i++) { /* where a view had a part in the fit, the observer is the one without it */
        r->observers[i] = ggn_observer_default;
        if (r->o->observer)
            rc = ggn_observer_read(r->o->observer, d->views[i].name, &r->observers[i], err);
    }
    return rc;
}

static void put_views(const struct replay *r, cJSON *to, int *failed)
{
    const struct ggn_dataset *d = &r->set.images.data;
    for (int i = 0; i < d->n; i++) {
        const struct ggn_dataset_view *v = &d->views[i];
        cJSON *o = base_json_object(to, NULL, failed);
        base_json_text(o, "name", v->name, failed);
        base_json_text(o, "folder", v->dir, failed);
        base_json_text(o, "scene", v->manifest.scene, failed);
        base_json_text(o, "split", ggn_split_names[v->split], failed);
        base_json_text(o, "labels", v->has_labels ? v->labels.source : NULL, failed);
        base_json_number(o, "width", v->manifest.width, failed);
        base_json_number(o, "height", v->manifest.height, failed);
        base_json_number(o, "tiles", ggn_dataset_tiles(v), failed);
        base_json_number(o, "spread", r->observers[i].spread, failed);
    }
}

/* The law's error from the observer's visible noise. */
static void put_errors(const struct replay *r, const struct ggn_eval_block *b, const char *key, const double *visible,
                       cJSON *to, int *failed)
{
    const size_t pixels = (size_t)r->set.images.width * (size_t)r->set.images.height;
    cJSON *array = base_json_array(to, key, failed);
    for (size_t i = b->first; i < b->end; i++)
        base_json_number(array, NULL, ggn_observer_error(&r->observers[b->view], visible[i], pixels), failed);
}

/* A block, and what is known of it at each of its cases. */
static void put_block(const struct replay *r, const struct ggn_eval_block *b, cJSON *to, int *failed)
{
    const struct ggn_eval_set *s = &r->set;
    const struct seq_manifest *m = &s->images.data.views[b->view].manifest;
    const struct seq_manifest_block *at = &m->blocks[b->index];
    const struct ggn_level_series *series = &s->images.series[b->series];
    const struct {
        const char *key;
        const double *values;
    } columns[] = {{"spp", s->spp},           {"seconds", s->seconds},
                   {"dammertz", s->dammertz}, {"half_unsettled", s->half_unsettled},
                   {"rse", s->rse},           {"rse_unsettled", s->rse_unsettled},
                   {"flip", s->flip},         {"ssim", s->ssim},
                   {"relmse", s->relmse}};
    base_json_number(to, "view", b->view, failed);
    base_json_number(to, "id", b->label.id, failed);
    base_json_number(to, "column", at->x0 / m->block, failed);
    base_json_number(to, "row", at->y0 / m->block, failed);
    base_json_number(to, "pixels", (double)(at->x1 - at->x0) * (at->y1 - at->y0), failed);
    base_json_number(to, "threshold", b->label.threshold, failed);
    base_json_bool(to, "censored", b->label.censored, failed);
    base_json_number(to, "cap", b->cap, failed);
    base_json_bool(to, "simulated", series->simulated, failed);
    base_json_bool(to, "reference", series->has_reference, failed);
    cJSON *noisy = base_json_array(to, "noisy", failed);
    for (size_t i = b->first; i < b->end; i++)
        base_json_number(noisy, NULL, s->noisy[i] >= 0 ? s->noisy[i] : (double)NAN, failed);
    for (size_t c = 0; c < sizeof columns / sizeof columns[0]; c++)
        base_json_numbers(to, columns[c].key, columns[c].values + b->first, (int)(b->end - b->first), failed);
    put_errors(r, b, "error", s->visible, to, failed);
    put_errors(r, b, "error_means", s->visible_means, to, failed);
}

/* What a method answered, case by case, and by which policy it stops. */
static void put_method(const struct replay *r, const char *kind, const char *name, const struct ggn_method *m,
                       const struct ggn_policy *policy, cJSON *to, int *failed)
{
    base_json_text(to, "kind", kind, failed);
    base_json_text(to, "name", name, failed);
    base_json_text(to, "title", m->name, failed);
    base_json_number(to, "passes", m->passes, failed);
    ggn_policy_print(base_json_object(to, "policy", failed), policy, failed);
    cJSON *scores = base_json_array(to, "scores", failed);
    cJSON *corrections = m->correction ? base_json_array(to, "corrections", failed) : NULL;
    for (int i = 0; i < r->set.n_blocks; i++) {
        const struct ggn_eval_block *b = &r->set.blocks[i];
        const int cases = (int)(b->end - b->first);
        base_json_numbers(scores, NULL, m->score + b->first, cases, failed);
        if (corrections)
            base_json_numbers(corrections, NULL, m->correction + b->first, cases, failed);
    }
}

static int replay_model(const struct replay *r, int index, cJSON *to, int *failed, struct base_err *err)
{
    const char *name = base_file_name(r->o->models[index]);
    struct ggn_policy policy;
    struct ggn_method m;
    int rc = ggn_policy_of(r->model[index], &policy, err);
    if (rc)
        return rc;
    adjust(r->o, &policy);
    warn_of_setting(r, index, &policy);
    rc = ggn_eval_trained(&m, &r->set, r->model[index], &policy, name, (enum ggn_precision)r->o->precision, r->observers,
                          r->threads, err);
    if (rc)
        return rc;
    put_method(r, "model", name, &m, &policy, to, failed);
    ggn_method_release(&m);
    return 0;
}

static int replay_baseline(const struct replay *r, int index, cJSON *to, int *failed, struct base_err *err)
{
    const char *path = r->o->baselines[index];
    struct ggn_baseline b;
    struct ggn_method m;
    int rc = ggn_baseline_load(&b, path, GGN_BASELINES, err);
    if (rc)
        return rc;
    adjust(r->o, &b.policy);
    if (b.window > r->set.window)
        rc = base_fail(err, BASE_EINVAL, "%s: it judges %d images, windows here have %d (ggn evaluate --window)", path,
                       b.window, r->set.window);
    if (!rc && !(rc = ggn_method_baseline(&m, &r->set, &b, r->threads, err))) {
        put_method(r, "baseline", ggn_baseline_names[b.kind], &m, &b.policy, to, failed);
        ggn_method_release(&m);
    }
    ggn_baseline_release(&b);
    return rc;
}

static int print(const struct replay *r, struct base_err *err)
{
    const struct ggn_series_set *images = &r->set.images;
    cJSON *root = cJSON_CreateObject();
    int failed = !root, rc = 0;
    base_json_text(root, "labels", ggn_dataset_label_source(&images->data), &failed);
    base_json_text(root, "split", ggn_split_sources[images->split_source], &failed);
    base_json_number(root, "window", r->set.window, &failed);
    base_json_number(root, "ratio", images->ratio, &failed);
    base_json_number(root, "visible", GGN_OBSERVER_VISIBLE, &failed);
    base_json_number(root, "pixels", (double)images->width * images->height, &failed);
    base_json_number(root, "views_without_labels", r->skipped, &failed);
    put_views(r, base_json_array(root, "views", &failed), &failed);
    cJSON *blocks = base_json_array(root, "blocks", &failed), *methods = base_json_array(root, "methods", &failed);
    for (int b = 0; b < r->set.n_blocks; b++)
        put_block(r, &r->set.blocks[b], base_json_object(blocks, NULL, &failed), &failed);
    for (int i = 0; i < r->o->n_baselines && !rc; i++)
        rc = replay_baseline(r, i, base_json_object(methods, NULL, &failed), &failed, err);
    for (int i = 0; i < r->o->n_models && !rc; i++)
        rc = replay_model(r, i, base_json_object(methods, NULL, &failed), &failed, err);
    if (!rc)
        rc = base_json_write(r->o->out, root, failed, err);
    cJSON_Delete(root);
    return rc;
}

int ggn_cmd_replay(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {
        .list = list,
        .doc = "Replays recorded blocks through models and published baselines, and prints as JSON what was measured of "
               "every block at each of its sample counts, and what each answered: it is what `ggn evaluate` and `ggn "
               "cost` judge."};
    struct options o = {.threads = base_threads_available()};
    struct replay r = {.o = &o};
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (!rc)
        rc = load(&r, err);
    if (!rc)
        rc = print(&r, err);
    free(r.observers);
    ggn_eval_set_release(&r.set);
    for (int i = 0; i < o.n_models; i++)
        ggn_model_destroy(r.model[i]);
    base_threads_destroy(r.threads);
    return rc;
}
