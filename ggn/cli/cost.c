/* `ggn cost --data DATA`: what accuracy costs each criterion, over its quality parameters, from recorded sequences. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/json.h"
#include "base/options.h"
#include "baselines/baseline.h"
#include "cli/commands.h"
#include "cli/replay.h"
#include "eval/cost.h"
#include "observer/curve.h"
#include "observer/observer.h"

enum { LEAST_WINDOW = 6 }; /* images */

struct options {
    struct ggn_replay_options replay;
    const char *out;
    int split, sizes, scores, precision;
    double cadence;
};

static const char *const precisions[] = {"f32", "f64", NULL}; /* enum ggn_precision */
static const char *const split_words[] = {"train", "validation", "test", "people", "none", NULL};

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {"data", 'd', "DATA", TO(replay.data), .input = BASE_FOLDER, .needed = 1, .help = "labelled data set (needed)"},
    {"split", 0, NULL, TO(split), .words = split_words, .help = "which of its views (test)"},
    {"model", 'm', "FILE", BASE_TO_LIST(struct options, replay.models, replay.n_models, "files"), .input = BASE_FILE,
     .help = "trained network (.ggn); may be repeated"},
    {"baseline", 0, "FILE", BASE_TO_LIST(struct options, replay.baselines, replay.n_baselines, "files"), .input = BASE_FILE,
     .help = "what ggn baseline wrote; may be repeated"},
    {"thresholds", 0, "CSV", BASE_TO_LIST(struct options, replay.thresholds, replay.n_thresholds, "files"),
     .input = BASE_FILE, .help = "stop where this file says (published thresholds); may be repeated"},
    {"observer", 'O', "FILE", TO(replay.observer), .input = BASE_FILE,
     .help = "the observer's parameters, each view without itself"},
    {"output", 'o', "FILE", TO(out), .output = BASE_FILE, .help = "write there instead of printing"},
    {"ratio", 0, "R", TO(replay.ratio), 1, 16, .help = "thin the levels, and the checks, to this ratio of samples"},
    {"cadence", 0, "R", TO(cadence), 1.02, 16,
     .help = "simulate all levels, this far apart, and ask networks and baselines as often"},
    {"precision", 0, NULL, TO(precision), .words = precisions, .help = "of the networks' arithmetic (f32)"},
    {"scores", 0, NULL, TO(scores), .help = "of the networks' own settings only: p of every window, and the stops"},
    {"recorded", 0, NULL, TO(replay.recorded),
     .help = "recorded levels only; blocks that show noise in the last one are left out"},
    {"no-pictures", 0, NULL, TO(replay.no_halves), .help = "networks as in a host without half buffers"},
    {"no-quality", 0, NULL, TO(replay.no_quality), .help = "skip FLIP"},
    {"sizes", 0, NULL, TO(sizes), .help = "also thresholds of the blocks' parts, as of smaller blocks"},
    {"threads", 't', "N", TO(replay.threads), 1, 1024, .help = "worker threads (all processors)"},
    {0}};

struct costing {
    const struct options *o;
    struct ggn_replay r;
    enum ggn_split split;
    double *checks, *stop; /* [blocks] */
    cJSON *points;
    int failed;
};

/* --- output --- */

static void put_cost(cJSON *to, const struct ggn_cost *c, int *failed)
{
    const struct {
        const char *key;
        double value;
    } fields[] = {{"samples", c->samples},
                  {"sampling_s", c->sampling_s},
                  {"checks_full", c->checks},
                  {"noisy", c->noisy},
                  {"early", c->early},
                  {"worst", c->worst},
                  {"uniform_spp", c->uniform_spp},
                  {"time_ratio", c->time_ratio},
                  {"samples_ratio", c->samples_ratio},
                  {"flip", c->flip},
                  {"flip_worst", c->flip_worst},
                  {"relmse", c->relmse}};
    base_json_number(to, "blocks", c->blocks, failed);
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++)
        base_json_number(to, fields[i].key, fields[i].value, failed);
}

/* One setting of one criterion: a point for each scene and one for all together (scene null). */
static void put_setting(struct costing *j, const char *criterion, const char *parameter, double value, const double *stop,
                        const double *checks)
{
    const struct ggn_dataset *d = &j->r.set.images.data;
    cJSON *o = base_json_object(j->points, NULL, &j->failed);
    base_json_text(o, "criterion", criterion, &j->failed);
    base_json_text(o, "dial", parameter, &j->failed);
    base_json_number(o, "value", value, &j->failed);
    cJSON *stops = base_json_array(o, "stops", &j->failed);
    for (int b = 0; b < j->r.set.n_blocks; b++)
        if (j->r.set.blocks[b].split == j->split)
            base_json_number(stops, NULL, floor(stop[b] + 0.5), &j->failed);
    cJSON *scenes = base_json_object(o, "scenes", &j->failed);
    for (int scene = 0; scene < j->r.set.n_scenes; scene++) {
        struct ggn_cost c;
        ggn_cost_of(&j->r.set, j->split, scene, stop, checks, &c);
        if (c.blocks > 0)
            put_cost(base_json_object(scenes, d->views[scene].manifest.scene, &j->failed), &c, &j->failed);
    }
}

static void put_method(struct costing *j, const char *parameter, double value, const struct ggn_method *m)
{
    ggn_cost_checks(m, &j->r.set, j->checks);
    put_setting(j, m->name, parameter, value, m->stop, j->checks);
}

/* Where a block is in the lists of stops. */
static int place_of(const struct costing *j, int b)
{
    int n = 0;
    for (int k = 0; k < b; k++)
        n += j->r.set.blocks[k].split == j->split;
    return n;
}

static void put_scenes(struct costing *j, cJSON *root)
{
    const struct ggn_eval_set *s = &j->r.set;
    cJSON *to = base_json_object(root, "scenes", &j->failed);
    for (int scene = 0; scene < s->n_scenes; scene++) {
        cJSON *o = NULL, *blocks = NULL;
        for (int b = 0; b < s->n_blocks; b++) {
            const struct ggn_eval_block *e = &s->blocks[b];
            if (e->split != j->split || e->scene != scene)
                continue;
            if (!o) {
                o = base_json_object(to, s->images.data.views[scene].manifest.scene, &j->failed);
                blocks = base_json_array(o, "blocks", &j->failed);
            }
            const struct ggn_level_series *c = &s->images.series[e->series];
            cJSON *block = base_json_object(blocks, NULL, &j->failed);
            base_json_number(block, "place", place_of(j, b), &j->failed);
            base_json_text(block, "view", s->images.data.views[e->view].name, &j->failed);
            base_json_number(block, "id", e->label.id, &j->failed);
            base_json_number(block, "threshold", e->label.threshold, &j->failed);
            base_json_number(block, "cap", e->cap, &j->failed);
            base_json_bool(block, "censored", e->label.censored, &j->failed);
            base_json_bool(block, "simulated", c->simulated, &j->failed);
            base_json_bool(block, "reference", c->reference != NULL, &j->failed);
            base_json_number(block, "us_per_path", 1e6 * ggn_cost_path_s(s, e), &j->failed);
        }
    }
}

static void put_threshold(struct costing *j, cJSON *to, const struct ggn_curve *c)
{
    int censored;
    base_json_number(to, NULL, ggn_curve_threshold(c, ggn_observer_default.level, &censored), &j->failed);
}

/* The list of a scene's parts of `side` pixels, empty when nothing has been put into it. */
static cJSON *parts_of(struct costing *j, cJSON *to, const char *scene, int side)
{
    char key[16];
    snprintf(key, sizeof key, "%d", side);
    cJSON *sides = cJSON_GetObjectItemCaseSensitive(to, scene);
    sides = sides ? sides : base_json_object(to, scene, &j->failed);
    cJSON *parts = cJSON_GetObjectItemCaseSensitive(sides, key);
    return parts ? parts : base_json_array(sides, key, &j->failed);
}

/* Thresholds of every square of `side` pixels that a block divides into. */
static int put_parts(struct costing *j, cJSON *to, const struct seq_block *p, int side, struct base_err *err)
{
    for (int k = 0; k < (int)(p->width / (uint32_t)side * (p->height / (uint32_t)side)); k++) {
        struct ggn_curve c;
        int across = (int)p->width / side;
        int rc = ggn_curve_part(p, k % across * side, k / across * side, side, side, &c, err);
        if (rc)
            return rc;
        put_threshold(j, to, &c);
        ggn_curve_release(&c);
    }
    return 0;
}

/* The manifest's blocks that begin at (x, y) of a view and beside and below it. 0: one of the four was not recorded. */
static int four_at(const struct seq_manifest *m, int x, int y, int side, uint32_t out[4])
{
    int found = 0;
    for (uint32_t i = 0; i < m->n_blocks; i++) {
        int dx = (int)m->blocks[i].x0 - x, dy = (int)m->blocks[i].y0 - y;
        if ((dx == 0 || dx == side) && (dy == 0 || dy == side)) {
            out[dx / side + 2 * (dy / side)] = i;
            found++;
        }
    }
    return found == 4;
}

/* Thresholds of every square of four neighbours, of twice a block's side. */
static int put_joined(struct costing *j, cJSON *to, const struct ggn_dataset_view *v, struct base_err *err)
{
    const int side = j->r.set.images.width;
    for (int y = 0; y + 2 * side <= (int)v->manifest.height; y += 2 * side)
        for (int x = 0; x + 2 * side <= (int)v->manifest.width; x += 2 * side) {
            struct seq_block four[4];
            uint32_t index[4];
            struct ggn_curve c;
            int rc = 0, read = 0;
            if (!four_at(&v->manifest, x, y, side, index))
                continue;
            for (; read < 4 && !rc; read += !rc)
                rc = seq_manifest_read_block(v->dir, &v->manifest, index[read], &four[read], err);
            if (!rc && !(rc = ggn_curve_joined(four, 2, 2, &c, err))) {
                put_threshold(j, parts_of(j, to, v->manifest.scene, 2 * side), &c);
                ggn_curve_release(&c);
            }
            while (read > 0)
                seq_block_release(&four[--read]);
            if (rc)
                return rc;
        }
    return 0;
}

/* For each scene and side all thresholds of such parts, by the observer from the halves. */
static int put_sizes(struct costing *j, cJSON *root, struct base_err *err)
{
    static const int sides[] = {25, 50, 100, 200};
    const struct ggn_eval_set *s = &j->r.set;
    cJSON *to = base_json_object(root, "parts", &j->failed);
    int rc = 0;
    for (int b = 0; b < s->n_blocks && !rc; b++) {
        const struct ggn_eval_block *e = &s->blocks[b];
        const struct ggn_dataset_view *v = &s->images.data.views[e->view];
        struct seq_block p;
        if (e->split != j->split)
            continue;
        rc = seq_manifest_read_block(v->dir, &v->manifest, e->index, &p, err);
        if (rc)
            return rc;
        for (size_t i = 0; i < sizeof sides / sizeof sides[0] && !rc; i++)
            rc = put_parts(j, parts_of(j, to, v->manifest.scene, sides[i]), &p, sides[i], err);
        seq_block_release(&p);
    }
    for (int v = 0; v < s->images.data.n && !rc; v++)
        if (s->images.data.views[v].split == j->split)
            rc = put_joined(j, to, &s->images.data.views[v], err);
    return rc;
}

/* --- quality parameters --- */

static void vary(struct costing *j, struct ggn_method *m, const char *parameter, const double *values, size_t n)
{
    double own = m->cut;
    for (size_t i = 0; i < n; i++) {
        m->cut = values[i];
        ggn_method_run(m, &j->r.set);
        put_method(j, parameter, values[i], m);
    }
    m->cut = own;
    ggn_method_run(m, &j->r.set);
}

#define COUNT(a) (sizeof(a) / sizeof(a)[0])
static const double shares[] = {0.9, 0.7, 0.5, 0.35, 0.25, 0.15, 0.1, 0.05, 0.02, 0.01, 0.004};

/* The same samples everywhere: as the host's own limit, and as the criterion `fixed`, which is asked once. */
static void cost_uniform(struct costing *j)
{
    for (double spp = 16; spp <= 16384; spp *= 2) {
        for (int b = 0; b < j->r.set.n_blocks; b++) {
            j->stop[b] = spp;
            j->checks[b] = 1;
        }
        put_setting(j, "uniform", "spp", spp, j->stop, NULL);
        put_setting(j, "fixed", "spp", spp, j->stop, j->checks);
    }
    for (int b = 0; b < j->r.set.n_blocks; b++)
        j->stop[b] = j->r.set.blocks[b].label.threshold;
    put_setting(j, "limit", "none", 0, j->stop, NULL);
}

static int cost_errors(struct costing *j, struct base_err *err)
{
    static const double variance[] = {0.64, 0.45, 0.32, 0.23, 0.16, 0.113, 0.08, 0.057, 0.04, 0.03, 0.02, 0.014, 0.01};
    static const double halfbuf[] = {0.03, 0.021, 0.015, 0.011, 0.0075, 0.0053, 0.004, 0.0028, 0.002, 0.0014, 0.001};
    for (int k = 0; k < 2; k++) {
        struct ggn_method m;
        int available, rc = k ? ggn_method_halfbuf(&m, &j->r.set, &available, err)
                              : ggn_method_variance(&m, &j->r.set, &available, err);
        if (rc)
            return rc;
        const double *thresholds = k ? halfbuf : variance, own = k ? 0.004 : 0.03; /* the criteria's defaults */
        const size_t n = k ? COUNT(halfbuf) : COUNT(variance);
        for (int guarded = 1; guarded >= 0 && available; guarded--) {
            if (!guarded)
                snprintf(m.name, sizeof m.name, k ? "halfbuf, no guard" : "variance, no guard");
            m.guard = guarded ? m.guard : NULL;
            vary(j, &m, "threshold", j->o->cadence > 0 ? &own : thresholds, j->o->cadence > 0 ? 1 : n);
        }
        ggn_method_release(&m);
    }
    return 0;
}

static int put_observer(struct costing *j, int halves, const char *parameter, double visible, double growth,
                        struct base_err *err)
{
    struct ggn_method m;
    int available, rc = ggn_method_observer(&m, &j->r.set, j->o->replay.observer, halves, visible, growth, &available, err);
    if (rc)
        return rc;
    if (available)
        put_method(j, parameter, strcmp(parameter, "growth") == 0 ? growth : visible, &m);
    ggn_method_release(&m);
    return 0;
}

static int cost_observer(struct costing *j, struct base_err *err)
{
    static const double growths[] = {1.05, 1.1, 1.25, 1.5, 2.0};
    int rc = 0;
    if (j->o->cadence > 0)
        return put_observer(j, 1, "growth", GGN_OBSERVER_VISIBLE, j->o->cadence, err);
    for (int halves = 1; halves >= 0; halves--)
        for (size_t i = 0; i < COUNT(shares) && !rc; i++)
            rc = put_observer(j, halves, "visible", shares[i], GGN_OBSERVER_GROWTH, err);
    for (size_t i = 0; i < COUNT(growths) && !rc; i++)
        rc = put_observer(j, 1, "growth", GGN_OBSERVER_VISIBLE, growths[i], err);
    return rc;
}

/* How many checks in a row must pass. */
static void turn_passes(struct costing *j, struct ggn_method *m)
{
    const int own = m->passes;
    for (m->passes = 1; m->passes <= 4; m->passes++) {
        ggn_method_run(m, &j->r.set);
        put_method(j, "passes", m->passes, m);
    }
    m->passes = own;
    ggn_method_run(m, &j->r.set);
}

static void cost_network(struct costing *j, struct ggn_method *m)
{
    put_method(j, "own", m->cut, m);
    if (j->o->cadence > 0 || j->o->scores)
        return;
    vary(j, m, "visible", shares, COUNT(shares));
}

/* Where the law knows the noise between levels a residual model stops there, too. */
static int cost_residual(struct costing *j, struct ggn_method *m, const struct ggn_policy *policy, struct base_err *err)
{
    int rc = 0;
    put_method(j, "own", m->cut, m);
    for (size_t i = 0; i < COUNT(shares) && !rc && !(j->o->cadence > 0 || j->o->scores); i++) {
        m->cut = shares[i];
        rc = ggn_eval_trained_stop(m, &j->r.set, policy, j->o->replay.observer, err);
        if (!rc)
            put_method(j, "visible", shares[i], m);
    }
    m->cut = policy->threshold;
    return rc;
}

/* Beside the point that was just put: p of every window of the split, null where none was judged. */
static void put_scores(struct costing *j, const struct ggn_method *m)
{
    cJSON *point = cJSON_GetArrayItem(j->points, cJSON_GetArraySize(j->points) - 1);
    cJSON *scores = j->o->scores ? base_json_array(point, "scores", &j->failed) : NULL;
    for (int b = 0; b < j->r.set.n_blocks && scores; b++)
        for (size_t i = j->r.set.blocks[b].first; i < j->r.set.blocks[b].end && j->r.set.blocks[b].split == j->split; i++)
            base_json_number(scores, NULL, m->score[i], &j->failed);
    if (scores)
        base_json_number(point, "cut", m->cut, &j->failed);
}

static int cost_models(struct costing *j, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < j->o->replay.n_models && !rc; i++) {
        struct ggn_policy policy;
        struct ggn_method m;
        char name[GGN_METHOD_NAME];
        snprintf(name, sizeof name, "%.32s%s%s%s", base_file_name(j->o->replay.models[i]), j->o->precision ? " " : "",
                 j->o->precision ? precisions[j->o->precision] : "", j->o->replay.no_halves ? ", no halves" : "");
        rc = ggn_replay_policy(&j->r, i, &policy, err);
        if (!rc)
            rc = ggn_replay_model(&j->r, i, name, (enum ggn_precision)j->o->precision, &m, err);
        if (rc)
            break;
        if (m.correction)
            rc = cost_residual(j, &m, &policy, err);
        else
            cost_network(j, &m);
        put_scores(j, &m);
        ggn_method_release(&m);
    }
    return rc;
}

static int cost_baselines(struct costing *j, struct base_err *err)
{
    int rc = 0, kind;
    for (int i = 0; i < j->o->replay.n_baselines && !rc; i++) {
        struct ggn_method m;
        rc = ggn_replay_baseline(&j->r, i, &m, &kind, err);
        if (rc)
            break;
        snprintf(m.name, sizeof m.name, "%s", ggn_baseline_names[kind]);
        put_method(j, "own", m.cut, &m);
        if (!(j->o->cadence > 0)) {
            vary(j, &m, "visible", shares, COUNT(shares));
            turn_passes(j, &m);
        }
        ggn_method_release(&m);
    }
    return rc;
}

static int cost_thresholds(struct costing *j, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < j->o->replay.n_thresholds && !rc; i++) {
        struct ggn_method m;
        rc = ggn_replay_thresholds(&j->r, i, j->split, &m, err);
        if (rc)
            break;
        put_setting(j, m.name, "own", 0, m.stop, NULL);
        ggn_method_release(&m);
    }
    return rc;
}

/* Networks and baselines are asked as often as the levels are simulated. */
static void adjust(const void *command, struct ggn_policy *policy)
{
    const struct options *o = command;
    if (o->cadence > 0)
        policy->ratio = o->cadence, policy->n_levels = 0;
}

static int cost(struct costing *j, struct base_err *err)
{
    size_t n = (size_t)j->r.set.n_blocks;
    cJSON *root = cJSON_CreateObject();
    int rc = 0;
    j->checks = calloc(n, sizeof *j->checks);
    j->stop = calloc(n, sizeof *j->stop);
    if (!root || !j->checks || !j->stop)
        rc = base_fail_nomem(err, "cost");
    base_json_text(root, "split", ggn_split_names[j->split], &j->failed);
    base_json_text(root, "labels", ggn_dataset_label_source(&j->r.set.images.data), &j->failed);
    base_json_number(root, "ratio", j->r.set.images.ratio, &j->failed);
    put_scenes(j, root);
    if (!rc && j->o->sizes)
        rc = put_sizes(j, root, err);
    j->points = base_json_array(root, "points", &j->failed);
    if (!rc && !j->o->scores) {
        cost_uniform(j);
        rc = cost_errors(j, err);
        if (!rc)
            rc = cost_observer(j, err);
    }
    if (!rc)
        rc = cost_models(j, err);
    if (!rc && !j->o->scores)
        rc = cost_baselines(j, err);
    if (!rc && !j->o->scores)
        rc = cost_thresholds(j, err);
    if (!rc)
        rc = base_json_write(j->o->out, root, j->failed, err);
    cJSON_Delete(root);
    free(j->checks);
    free(j->stop);
    return rc;
}

int ggn_cmd_cost(int argc, char **argv)
{
    static const struct base_options options = {
        .list = list,
        .doc = "Replays recorded blocks through every criterion over the range of its quality parameters and writes, scene "
               "by scene, "
               "what was spent until the blocks stop and how good the picture is then, as JSON. scripts/lab cost puts "
               "measured prices on the checks and draws it."};
    struct options o = {.split = GGN_SPLIT_TEST, .replay.threads = base_threads_available()};
    struct costing j = {.o = &o, .r = {.o = &o.replay, .adjust = adjust, .command = &o}};
    struct base_err err = {0};

    int rc = base_options_parse(&options, argc, argv, &o, &err);
    struct ggn_eval_options eo = {.window = LEAST_WINDOW, .no_ssim = 1, .cadence = o.cadence};
    j.split = (enum ggn_split)o.split;
    if (!rc)
        rc = ggn_replay_open(&j.r, &eo, LEAST_WINDOW, &err);
    for (int b = 0; o.replay.recorded && b < j.r.set.n_blocks; b++) /* whose thresholds lie beyond: nothing is known there */
        if (j.r.set.blocks[b].label.censored)
            j.r.set.blocks[b].split = GGN_SPLITS;
    if (!rc && ggn_eval_count(&j.r.set, j.split) == 0)
        rc =
            base_fail(&err, BASE_EINVAL, "%s: no labelled block in the split '%s'", o.replay.data, ggn_split_names[j.split]);
    if (!rc)
        rc = cost(&j, &err);
    ggn_replay_close(&j.r);
    return rc ? ggn_cmd_fail(argv[0], &err) : GGN_EXIT_OK;
}
