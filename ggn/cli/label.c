/* `ggn label DATA…`: attaches thresholds, from people (CSV) or from the model observer; calibrates and checks the observer. */
#include <argp.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/threads.h"
#include "cli/commands.h"
#include "data/dataset.h"
#include "data/thresholds.h"
#include "figures/stats.h"
#include "observer/calibrate.h"

enum { MAX_INPUTS = 256, KEY_HUMAN = 256, KEY_VIEW, KEY_CALIBRATE, KEY_SOURCE, KEY_CHECK, KEY_TRIALS, KEY_SPREAD };

struct options {
    const char *inputs[MAX_INPUTS];
    int n_inputs;
    const char *human, *calibrate, *view, *observer_path, *out;
    enum ggn_observer_source source;
    int check, trials, threads;
    double spread;
};

static const struct argp_option option_table[] = {
    {"human", KEY_HUMAN, "CSV", 0, "label with human thresholds, name;t0;t1;…, matched by --view or by the folder's name", 1},
    {"observer", 'O', "FILE", 0, "parameters of the model observer (default: built in)", 2},
    {"source", KEY_SOURCE, "auto|rendered|halves", 0, "judge the recorded levels, or simulate them from two independent halves, or (auto, the default) simulate only beyond the last one", 2},
    {"spread", KEY_SPREAD, "OCTAVES", 0, "standard deviation of the psychometric curve, for soft labels", 2},
    {"check", KEY_CHECK, NULL, 0, "write nothing: compare the cheap thresholds (halves) with those of the rendered levels", 3},
    {"calibrate", KEY_CALIBRATE, "CSV", 0, "fit the observer to human thresholds; -o FILE gets its parameters", 4},
    {"output", 'o', "FILE", 0, "where --calibrate writes", 4},
    {"view", KEY_VIEW, "NAME", 0, "row of the CSV (when there is one sequence)", 5},
    {"fit-trials", KEY_TRIALS, NULL, 0, "DATA are files of raw trials block;level;seen: print the spread of the psychometric curve", 6},
    {"threads", 't', "N", 0, "worker threads (default: all processors)", 7},
    {0},
};

static error_t parse(int key, char *arg, struct argp_state *state)
{
    struct options *o = state->input;
    char *end = NULL;

    switch (key) {
    case KEY_HUMAN: o->human = arg; return 0;
    case KEY_VIEW: o->view = arg; return 0;
    case KEY_CALIBRATE: o->calibrate = arg; return 0;
    case KEY_CHECK: o->check = 1; return 0;
    case KEY_TRIALS: o->trials = 1; return 0;
    case 'O': o->observer_path = arg; return 0;
    case 'o': o->out = arg; return 0;
    case KEY_SOURCE:
        if (strcmp(arg, "auto") != 0 && strcmp(arg, "rendered") != 0 && strcmp(arg, "halves") != 0)
            argp_error(state, "--source %s: expected auto, rendered or halves", arg);
        o->source = arg[0] == 'a' ? GGN_SOURCE_AUTO : arg[0] == 'h' ? GGN_SOURCE_HALVES : GGN_SOURCE_RENDERED;
        return 0;
    case KEY_SPREAD:
        o->spread = strtod(arg, &end);
        if (*end != '\0' || !(o->spread > 0.0 && o->spread < 10.0))
            argp_error(state, "--spread %s: expected octaves above 0", arg);
        return 0;
    case 't':
        o->threads = (int)strtol(arg, &end, 10);
        if (*end != '\0' || o->threads < 1 || o->threads > 1024)
            argp_error(state, "--threads %s: expected 1 … 1024", arg);
        return 0;
    case ARGP_KEY_ARG:
        if (o->n_inputs == MAX_INPUTS)
            argp_error(state, "more than %d inputs", MAX_INPUTS);
        o->inputs[o->n_inputs++] = arg;
        return 0;
    case ARGP_KEY_END:
        if (o->n_inputs == 0)
            argp_error(state, "DATA is needed");
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* The row of human thresholds of a view. */
static const struct ggn_view *find_row(const struct options *o, const struct ggn_thresholds *t, const struct ggn_dataset_view *v)
{
    const struct ggn_view *row = ggn_thresholds_find(t, o->view ? o->view : v->name);
    char with_part[4200];
    if (row || o->view)
        return row;
    snprintf(with_part, sizeof with_part, "%s_part6", v->name);
    return ggn_thresholds_find(t, with_part);
}

static int start_labels(struct ggn_labels *l, const char *source, const struct ggn_dataset_view *v, double spread, struct base_err *err)
{
    *l = (struct ggn_labels){.cap = v->manifest.levels[v->manifest.n_levels - 1], .spread = spread};
    snprintf(l->source, sizeof l->source, "%s", source);
    l->labels = malloc(v->manifest.n_blocks * sizeof *l->labels);
    return l->labels ? 0 : base_fail_nomem(err, v->dir);
}

/* --- human labels --- */

static int label_human(const struct options *o, const struct ggn_thresholds *t, const struct ggn_dataset_view *v, struct base_err *err)
{
    const struct ggn_view *row = find_row(o, t, v);
    struct ggn_labels l;
    if (!row)
        return base_fail(err, BASE_EINVAL, "%s: no thresholds for '%s'", o->human, o->view ? o->view : v->name);
    int rc = start_labels(&l, "human", v, o->spread > 0 ? o->spread : GGN_LABELS_SPREAD, err);
    for (uint32_t i = 0; i < v->manifest.n_blocks && !rc; i++) {
        uint32_t id = v->manifest.blocks[i].id;
        if (id >= (uint32_t)row->n)
            rc = base_fail(err, BASE_EINVAL, "%s: block %u has no threshold: '%s' has %d", v->dir, id, row->name, row->n);
        else
            l.labels[l.n++] = (struct ggn_label){id, fmin(row->spp[id], l.cap), row->spp[id] >= l.cap};
    }
    snprintf(l.detail, sizeof l.detail, "thresholds of '%.200s'", row->name);
    if (!rc)
        rc = ggn_labels_write(v->dir, &l, err);
    if (!rc)
        printf("%s: %u blocks labelled with human thresholds\n", v->dir, l.n);
    ggn_labels_release(&l);
    return rc;
}

/* --- observer labels: blocks in parallel --- */

struct work {
    const struct ggn_dataset_view *view;
    const struct ggn_observer *observer;
    int both;                /* rendered and halves */
    enum ggn_observer_source source;
    struct ggn_label *labels, *cheap; /* [n_blocks] */
    double *shift;           /* [n_blocks], with `both`: octaves between the curves, see curve_shift */
    double *caps;            /* [n_blocks]; the last sample count that was judged; may be NULL */
    int *rc;
    struct base_err *errs;
};

static int judge(const struct work *w, const struct ggn_seq_block *b, enum ggn_observer_source source, struct ggn_label *out,
                 struct ggn_curve *curve, struct base_err *err)
{
    int rc = ggn_observer_curve(w->observer, b, source, w->view->manifest.reference_independent, curve, err);
    if (rc)
        return rc;
    out->id = b->id;
    out->threshold = ggn_curve_threshold(curve, w->observer->tau, &out->censored);
    return 0;
}

/* Median over the recorded levels of log2(cheap / rendered threshold) when tau is what the level shows: says how well the cheap curve fits wherever
 * the observer's own tau lies. NaN if there is nothing to compare. */
static double curve_shift(const struct ggn_curve *rendered, const struct ggn_curve *cheap)
{
    double *shifts = malloc((size_t)rendered->n * sizeof *shifts), median;
    size_t n = 0;
    for (int i = 0; i < rendered->n && shifts; i++) {
        int end[2];
        double a = ggn_curve_threshold(rendered, rendered->score[i], &end[0]), b = ggn_curve_threshold(cheap, rendered->score[i], &end[1]);
        if (!end[0] && !end[1] && b > cheap->spp[0])
            shifts[n++] = log2(b / a);
    }
    median = shifts ? ggn_stats_quantile(shifts, n, 0.5) : (double)NAN;
    free(shifts);
    return median;
}

static void work_block(void *data, long i, int worker)
{
    struct work *w = data;
    struct ggn_seq_block b;
    struct ggn_curve rendered = {0}, cheap = {0};
    (void)worker;
    if (ggn_cmd_interrupted)
        return;
    w->rc[i] = ggn_manifest_read_block(w->view->dir, &w->view->manifest, (uint32_t)i, &b, &w->errs[i]);
    if (w->rc[i] != 0)
        return;
    w->rc[i] = judge(w, &b, w->both ? GGN_SOURCE_RENDERED : w->source, &w->labels[i], &rendered, &w->errs[i]);
    if (w->rc[i] == 0 && w->caps)
        w->caps[i] = rendered.spp[rendered.n - 1];
    if (w->rc[i] == 0 && w->both)
        w->rc[i] = judge(w, &b, GGN_SOURCE_HALVES, &w->cheap[i], &cheap, &w->errs[i]);
    if (w->rc[i] == 0 && w->both)
        w->shift[i] = curve_shift(&rendered, &cheap);
    ggn_curve_release(&rendered);
    ggn_curve_release(&cheap);
    ggn_seq_block_release(&b);
}

static int run_work(struct work *w, struct base_threads *threads, struct base_err *err)
{
    size_t n = w->view->manifest.n_blocks;
    int rc = 0;
    w->rc = calloc(n, sizeof *w->rc);
    w->errs = calloc(n, sizeof *w->errs);
    if (!w->rc || !w->errs)
        rc = base_fail_nomem(err, w->view->dir);
    else
        base_threads_for(threads, (long)n, work_block, w);
    for (size_t i = 0; i < n && !rc; i++)
        if (w->rc[i] != 0)
            rc = base_fail(err, w->rc[i], "%s: %s", w->view->name, w->errs[i].text);
    free(w->rc);
    free(w->errs);
    return rc;
}

static int label_observer(const struct options *o, const struct ggn_observer *observer, struct base_threads *threads,
                          const struct ggn_dataset_view *v, struct base_err *err)
{
    struct ggn_labels l;
    int rc = start_labels(&l, "observer", v, observer->spread, err);
    if (rc)
        return rc;
    double *caps = calloc(v->manifest.n_blocks, sizeof *caps);
    struct work w = {.view = v, .observer = observer, .source = o->source, .labels = l.labels, .caps = caps};
    rc = caps ? run_work(&w, threads, err) : base_fail_nomem(err, v->dir);
    l.n = v->manifest.n_blocks;
    for (uint32_t i = 0; i < l.n && !rc; i++)
        l.cap = fmax(l.cap, caps[i]);
    free(caps);
    ggn_observer_describe(observer, l.detail, sizeof l.detail - 64);
    strcat(l.detail, o->source == GGN_SOURCE_HALVES ? ", from two halves" : o->source == GGN_SOURCE_AUTO ? ", recorded levels, beyond them two halves" : ", recorded levels");
    if (!rc && !ggn_cmd_interrupted)
        rc = ggn_labels_write(v->dir, &l, err);
    uint32_t censored = 0;
    for (uint32_t i = 0; i < l.n; i++)
        censored += l.labels[i].censored != 0;
    if (!rc && !ggn_cmd_interrupted)
        printf("%s: %u blocks labelled by the model observer, %u censored at %.0f spp\n", v->dir, l.n, censored, l.cap);
    ggn_labels_release(&l);
    return rc;
}

/* --- checking the cheap labels --- */

static int check_view(const struct ggn_observer *observer, struct base_threads *threads, const struct ggn_dataset_view *v, double *errors,
                      size_t *count, struct base_err *err)
{
    size_t n = v->manifest.n_blocks;
    struct ggn_label *labels = calloc(2 * (n > 0 ? n : 1), sizeof *labels);
    double *shift = calloc(n > 0 ? n : 1, sizeof *shift);
    struct work w = {.view = v, .observer = observer, .both = 1, .labels = labels, .cheap = labels + n, .shift = shift};
    int rc = !labels || !shift ? base_fail_nomem(err, v->dir) : run_work(&w, threads, err);
    for (size_t i = 0; i < n && !rc && !ggn_cmd_interrupted; i++) {
        const struct ggn_label *a = &labels[i], *b = &labels[n + i];
        printf("%-24.24s %5u %9.0f%s %9.0f%s %8.3f %8.3f\n", v->name, a->id, a->threshold, a->censored ? "+" : " ", b->threshold,
               b->censored ? "+" : " ", log2(b->threshold / a->threshold), shift[i]);
        if (!isnan(shift[i]))
            errors[(*count)++] = fabs(shift[i]);
    }
    free(shift);
    free(labels);
    return rc;
}

/* --- calibration --- */

static int collect(const struct options *o, const struct ggn_thresholds *t, const struct ggn_dataset *d, struct ggn_calibration_block *blocks,
                   struct ggn_seq_block *pixels, int *n, struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < d->n && !rc; i++) {
        const struct ggn_dataset_view *v = &d->views[i];
        const struct ggn_view *row = find_row(o, t, v);
        double cap = o->source != GGN_SOURCE_RENDERED ? GGN_SIMULATED_CAP : v->manifest.levels[v->manifest.n_levels - 1];
        for (uint32_t b = 0; row && b < v->manifest.n_blocks && !rc; b++) {
            uint32_t id = v->manifest.blocks[b].id;
            if (id >= (uint32_t)row->n || row->spp[id] >= cap)
                continue;
            rc = ggn_manifest_read_block(v->dir, &v->manifest, b, &pixels[*n], err);
            if (!rc) {
                blocks[*n] = (struct ggn_calibration_block){&pixels[*n], v->manifest.reference_independent, row->spp[id]};
                ++*n;
            }
        }
    }
    return rc;
}

static int report_calibration(const struct options *o, const struct ggn_calibration *c, const struct ggn_calibration_block *blocks, struct base_err *err)
{
    char text[512], json[512];
    double spread = o->spread > 0 ? o->spread : c->observer.spread;
    struct ggn_observer observer = c->observer;
    observer.spread = spread;
    ggn_observer_describe(&observer, text, sizeof text);
    printf("%5s %9s %9s %8s\n", "block", "human", "left out", "log2");
    for (int i = 0; i < c->n; i++)
        printf("%5u %9.0f %9.0f %8.3f\n", blocks[i].block->id, blocks[i].human, c->predicted[i], log2(c->predicted[i] / blocks[i].human));
    printf("%s\n%d blocks, |log2(predicted/human)|: median %.3f fitted, %.3f with tau left out, %.3f with tau and form left out (mean %.3f); "
           "Spearman %.3f\n", text, c->n, c->median_abs_log2, c->loo_median_abs_log2, c->nested_median_abs_log2, c->nested_mean_abs_log2, c->spearman);
    snprintf(json, sizeof json, "{\"blocks\": %d, \"median_abs_log2\": %.4f, \"loo_median_abs_log2\": %.4f, \"loo_mean_abs_log2\": %.4f, "
             "\"nested_loo_median_abs_log2\": %.4f, \"nested_loo_mean_abs_log2\": %.4f}", c->n, c->median_abs_log2, c->loo_median_abs_log2,
             c->loo_mean_abs_log2, c->nested_median_abs_log2, c->nested_mean_abs_log2);
    return o->out ? ggn_observer_write(o->out, &observer, json, err) : 0;
}

static int calibrate(const struct options *o, const struct ggn_dataset *d, struct base_threads *threads, struct base_err *err)
{
    struct ggn_thresholds t = {0};
    struct ggn_calibration c = {0};
    size_t room = 1;
    int n = 0;
    for (int i = 0; i < d->n; i++)
        room += d->views[i].manifest.n_blocks;
    struct ggn_calibration_block *blocks = calloc(room, sizeof *blocks);
    struct ggn_seq_block *pixels = calloc(room, sizeof *pixels);
    int rc = !blocks || !pixels ? base_fail_nomem(err, "calibration") : ggn_thresholds_read(o->calibrate, 200, &t, err);
    if (!rc)
        rc = collect(o, &t, d, blocks, pixels, &n, err);
    if (!rc)
        rc = ggn_observer_calibrate(blocks, n, o->source, threads, &c, err);
    if (!rc)
        rc = report_calibration(o, &c, blocks, err);
    ggn_calibration_release(&c);
    for (int i = 0; i < n; i++)
        ggn_seq_block_release(&pixels[i]);
    free(pixels);
    free(blocks);
    ggn_thresholds_release(&t);
    return rc;
}

static int fit_trials(const struct options *o, struct base_err *err)
{
    double log_sum = 0.0;
    for (int i = 0; i < o->n_inputs; i++) {
        double spread;
        int blocks, trials, skipped;
        int rc = ggn_trials_spread(o->inputs[i], &spread, &blocks, &trials, &skipped, err);
        if (rc)
            return rc;
        printf("%s: spread %.2f octaves (%d trials, %d blocks, %d lines left out)\n", o->inputs[i], spread, trials, blocks, skipped);
        log_sum += log(spread);
    }
    printf("geometric mean %.2f octaves\n", exp(log_sum / o->n_inputs));
    return 0;
}

static int run_dataset(const struct options *o, const struct ggn_dataset *d, const struct ggn_observer *observer, const struct ggn_thresholds *human,
                       struct base_threads *threads, struct base_err *err)
{
    size_t count = 0, room = 1;
    int rc = 0;
    for (int i = 0; i < d->n; i++)
        room += d->views[i].manifest.n_blocks;
    double *errors = malloc(room * sizeof *errors);
    if (!errors)
        return base_fail_nomem(err, "check");
    if (o->check)
        printf("%-24s %5s %10s %10s %8s %8s\n", "view", "block", "rendered", "halves", "log2", "curve");
    for (int i = 0; i < d->n && !rc && !ggn_cmd_interrupted; i++) {
        if (d->views[i].manifest.n_blocks == 0)
            fprintf(stderr, "ggn label: %s: no finished block yet, left out\n", d->views[i].dir);
        else if (o->check)
            rc = check_view(observer, threads, &d->views[i], errors, &count, err);
        else if (o->human)
            rc = label_human(o, human, &d->views[i], err);
        else
            rc = label_observer(o, observer, threads, &d->views[i], err);
    }
    if (!rc && o->check && count > 0)
        printf("%zu blocks (+: beyond the last level): |curve| median %.3f, 90th percentile %.3f octaves\n", count, ggn_stats_quantile(errors, count, 0.5),
               ggn_stats_quantile(errors, count, 0.9));
    free(errors);
    return rc;
}

int ggn_cmd_label(int argc, char **argv)
{
    static const struct argp argp = {
        .options = option_table,
        .parser = parse,
        .args_doc = "DATA...",
        .doc = "Attaches thresholds to recorded sequences (DATA: a sequence or a folder of them): those of people, or those of the model "
               "observer, which are never called human.",
    };
    struct options o = {.source = GGN_SOURCE_AUTO, .threads = base_threads_available()};
    struct ggn_observer observer = ggn_observer_default;
    struct ggn_thresholds human = {0};
    struct base_threads *threads = NULL;
    struct base_err err = {0};

    argp_parse(&argp, argc, argv, 0, NULL, &o);
    ggn_cmd_catch_interrupt();
    int rc = o.observer_path ? ggn_observer_read(o.observer_path, &observer, &err) : 0;
    if (o.spread > 0)
        observer.spread = o.spread;
    if (!rc && o.trials) {
        rc = fit_trials(&o, &err);
        goto out;
    }
    if (!rc && o.human)
        rc = ggn_thresholds_read(o.human, 200, &human, &err);
    if (!rc) {
        threads = base_threads_create(o.threads, &err);
        rc = !threads ? err.code : 0;
    }
    for (int i = 0; i < o.n_inputs && !rc && !ggn_cmd_interrupted; i++) {
        struct ggn_dataset d;
        rc = ggn_dataset_open(o.inputs[i], &d, &err);
        if (rc)
            break;
        rc = o.calibrate ? calibrate(&o, &d, threads, &err) : run_dataset(&o, &d, &observer, &human, threads, &err);
        ggn_dataset_release(&d);
    }
out:
    base_threads_destroy(threads);
    ggn_thresholds_release(&human);
    if (rc)
        return ggn_cmd_fail(argv[0], &err);
    return ggn_cmd_interrupted ? GGN_EXIT_INTERRUPTED : GGN_EXIT_OK;
}
