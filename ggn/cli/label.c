/* `ggn label DATA…`: attaches thresholds of people (CSV) or of the model observer; calibrates and checks the observer. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/interrupt.h"
#include "base/options.h"
#include "base/threads.h"
#include "base/version.h"
#include "cli/commands.h"
#include "data/dataset.h"
#include "data/thresholds.h"
#include "sight/stats.h"
#include "job/farm.h"
#include "train/calibrate.h"
#include "train/views.h"

enum { MAX_INPUTS = 256 };

struct options {
    const char *inputs[MAX_INPUTS];
    int n_inputs;
    const char *human, *calibrate, *view, *observer_path, *out;
    int source; /* enum ggn_curve_source */
    int check, trials, threads, replace_human;
    double spread;
};

#define TO(member) BASE_TO(struct options, member)
static const struct base_option list[] = {
    {.help = "Thresholds of people:"},
    {"human", 0, "CSV", TO(human), .input = BASE_FILE,
     .help = "label with human thresholds, name;t0;t1;…, matched by --view or by the folder's name"},
    {"replace-human", 0, NULL, TO(replace_human),
     .help = "replace thresholds of people that DATA has already (otherwise other ones are refused)"},
    {"view", 0, "NAME", TO(view), .help = "row of the CSV for --human (when there is one sequence)"},
    {.help = "Thresholds of the model observer:"},
    {"observer", 'O', "FILE", TO(observer_path), .input = BASE_FILE, .help = "parameters of the model observer (built in)"},
    {"source", 0, NULL, TO(source), .words = ggn_curve_sources,
     .help = "judge two independent halves (halves), or the recorded levels against their reference and halves beyond the "
             "last one"},
    {"spread", 0, "OCTAVES", TO(spread), 0.001, 10, .help = "standard deviation of the psychometric curve, for soft labels"},
    {"check", 0, NULL, TO(check),
     .help = "write nothing: compare the thresholds from halves with those of the recorded levels"},
    {.help = "Fitting it:"},
    {"calibrate", 0, "CSV", TO(calibrate), .input = BASE_FILE,
     .help =
         "fit the observer to human thresholds of several views and print the table with each view left out; -o FILE gets "
         "parameters and table"},
    {"output", 'o', "FILE", TO(out), .output = BASE_FILE, .help = "where --calibrate writes"},
    {"fit-trials", 0, NULL, TO(trials),
     .help = "DATA are files of raw trials block;level;seen: print the spread of the psychometric curve"},
    {.help = "All:"},
    {"threads", 't', "N", TO(threads), 1, 1024, .help = "worker threads (all processors)"},
    {0}};

static const int study_block[2] = {200, 200};

/* The row of human thresholds of a view. */
static int find_row(const char *csv, const char *name, const struct ggn_thresholds *t, const struct ggn_view **row,
                    struct base_err *err)
{
    *row = ggn_thresholds_of(t, name);
    if (!*row)
        return base_fail(err, BASE_EINVAL, "%s: no thresholds for '%s'", csv, name);
    return (*row)->of_study ? 0 : base_fail(err, BASE_EINVAL, "%s: these are no thresholds of people's study", csv);
}

/* From thresholds of the study to samples at which no noise is seen at all. */
static void convert_from_study(struct ggn_labels *l)
{
    const size_t used = strlen(l->detail);
    for (uint32_t i = 0; i < l->n; i++) {
        struct ggn_label *label = &l->labels[i];
        label->censored = label->threshold >= SEQ_STUDY_CAP;
        label->threshold = ggn_observer_from_study(label->threshold);
    }
    l->cap = SEQ_SIMULATED_CAP;
    snprintf(l->detail + used, sizeof l->detail - used, ", as samples at which no noise is seen at all");
}

/* The last level, as of imported pictures. */
static int has_own_reference(const struct ggn_dataset_view *v)
{
    return !v->manifest.reference_independent && v->manifest.reference_spp > 0;
}

/* Of imported pictures the thresholds that the import would attach; of a recording they are those of the study. */
static int human_labels(const struct options *o, const struct ggn_thresholds *t, const struct ggn_dataset_view *v,
                        struct ggn_labels *out, struct base_err *err)
{
    const int own_pictures = has_own_reference(v);
    const struct ggn_view *row;
    struct base_err why = {0};
    int rc = find_row(o->human, o->view ? o->view : v->name, t, &row, err);
    if (rc)
        return rc;
    if (!own_pictures && (uint32_t)row->n != ggn_dataset_tiles(v))
        return base_fail(err, BASE_EINVAL, "%s: '%s' has %d thresholds, %s has %u blocks", o->human, row->name, row->n,
                         v->dir, ggn_dataset_tiles(v));
    rc = ggn_thresholds_label(row, &v->manifest, out, &why);
    if (rc)
        return base_fail(err, rc, "%s: %s", v->dir, why.text);
    if (!own_pictures)
        convert_from_study(out);
    if (o->spread > 0)
        out->spread = o->spread;
    return 0;
}

static int has_blocks(const struct ggn_dataset_view *v)
{
    if (v->manifest.n_blocks == 0)
        fprintf(stderr, "ggn label: %s: no finished block yet, left out\n", v->dir);
    return v->manifest.n_blocks > 0;
}

static int check_labels(const struct ggn_dataset *d, const struct ggn_observer *observer, struct base_threads *threads,
                        struct base_err *err)
{
    size_t count = 0, room = 1;
    int rc = 0;
    for (int i = 0; i < d->n; i++)
        room += d->views[i].manifest.n_blocks;
    double *curves = malloc(room * sizeof *curves);
    if (!curves)
        return base_fail_nomem(err, "check");
    printf("%-24s %5s %10s %9s %8s %8s\n", "view", "block", "recorded", "halves", "log2", "curve");
    for (int i = 0; i < d->n && !rc && !base_interrupted; i++) {
        const struct ggn_dataset_view *v = &d->views[i];
        if (!has_blocks(v))
            continue;
        struct ggn_check *checks = malloc(v->manifest.n_blocks * sizeof *checks);
        rc = !checks ? base_fail_nomem(err, v->dir) : ggn_view_check(observer, v, threads, checks, err);
        for (uint32_t k = 0; k < v->manifest.n_blocks && !rc; k++) {
            const struct ggn_check *c = &checks[k];
            printf("%-24.24s %5u %9.0f%s %9.0f %8.3f %8.3f\n", v->name, c->id, c->recorded, c->beyond ? "+" : " ", c->halves,
                   log2(c->halves / c->recorded), c->curve);
            if (!isnan(c->curve))
                curves[count++] = fabs(c->curve);
        }
        free(checks);
    }
    if (!rc && count > 0)
        printf("%zu blocks (+: beyond the last level): |curve| median %.3f, 90th percentile %.3f octaves\n", count,
               ggn_stats_quantile(curves, count, 0.5), ggn_stats_quantile(curves, count, 0.9));
    free(curves);
    return rc;
}

/* Views are what the processes of a job share out. */
struct labelling {
    const struct options *o;
    const struct ggn_dataset *d;
    const struct ggn_observer *observer;
    const struct ggn_thresholds *human;
    struct base_threads *threads;
};

static int label_view(const struct labelling *l, const struct ggn_dataset_view *v, struct base_err *err)
{
    const struct options *o = l->o;
    struct ggn_labels labels;
    uint32_t censored = 0;
    int rc = o->human ? human_labels(o, l->human, v, &labels, err)
                      : ggn_view_label(l->observer, v, (enum ggn_curve_source)o->source, l->threads, &labels, err);
    if (rc)
        return rc;
    for (uint32_t i = 0; i < labels.n; i++)
        censored += labels.labels[i].censored != 0;
    rc = ggn_labels_write(v->dir, &labels, o->replace_human, err);
    if (!rc && o->human)
        printf("%s: %u blocks labelled with human thresholds\n", v->dir, labels.n);
    else if (!rc)
        printf("%s: %u blocks labelled by the model observer, %u censored at %.0f spp%s\n", v->dir, labels.n, censored,
               labels.cap,
               o->source == GGN_FROM_LEVELS && has_own_reference(v) ? "; the reference is the last level itself" : "");
    ggn_labels_release(&labels);
    return rc;
}

static int label_views(void *data, uint32_t first, uint32_t n, int thread, struct base_err *err)
{
    const struct labelling *l = data;
    int rc = 0;
    for (uint32_t i = first; i < first + n && !rc && !base_interrupted; i++) {
        const struct ggn_dataset_view *v = &l->d->views[i];
        if (has_blocks(v))
            rc = label_view(l, v, err);
    }
    (void)thread;
    return rc;
}

static int label_task(void *data, struct job_task *task, uint32_t k, uint32_t n, void *answer, int thread,
                      struct base_err *err)
{
    (void)answer; /* the file that is written */
    return label_views(data, task->first + k, n, thread, err);
}

static int share_views(struct labelling *l, struct base_err *err)
{
    const struct job_service service = {label_task, l};
    const struct job_farm farm = {.whole = 1, .count = (uint32_t)l->d->n, .here = label_views, .data = l};
    int rc = job_share(ggn_cmd_job, l->threads, &farm, &service, err);
    return rc == JOB_STOPPED ? 0 : rc;
}

/* Whether people's thresholds would be lost is known before the first view is labelled. */
static int check_views(const struct options *o, const struct ggn_dataset *d, const struct ggn_thresholds *human,
                       struct base_err *err)
{
    int rc = 0;
    for (int i = 0; i < d->n && !rc && !o->check && !o->replace_human; i++) {
        struct ggn_labels next = {0};
        if (d->views[i].manifest.n_blocks == 0)
            continue;
        rc = o->human ? human_labels(o, human, &d->views[i], &next, err) : 0;
        if (!rc)
            rc = ggn_labels_keep_people(d->views[i].dir, o->human ? &next : NULL, err);
        ggn_labels_release(&next);
    }
    return rc;
}

static int label(const struct options *o, struct base_threads *threads, struct base_err *err)
{
    struct ggn_observer observer = ggn_observer_default;
    struct ggn_thresholds human = {0};
    int rc = o->observer_path ? ggn_observer_read(o->observer_path, NULL, &observer, err) : 0;
    if (o->spread > 0)
        observer.spread = o->spread;
    if (!rc && o->human)
        rc = ggn_thresholds_read(o->human, study_block, &human, err);
    if (!rc && !o->check)
        rc = job_handshake(ggn_cmd_job, "version=" BASE_VERSION "\n", base_threads_count(threads), err);
    for (int i = 0; i < 2 * o->n_inputs && !rc && !base_interrupted; i++) { /* a look at all, then the work */
        struct ggn_dataset d;
        rc = ggn_dataset_open(o->inputs[i % o->n_inputs], &d, err);
        if (rc)
            break;
        struct labelling l = {o, &d, &observer, &human, threads};
        if (i < o->n_inputs)
            rc = check_views(o, &d, &human, err);
        else
            rc = o->check ? check_labels(&d, &observer, threads, err) : share_views(&l, err);
        ggn_dataset_release(&d);
    }
    ggn_thresholds_release(&human);
    return rc;
}

static void print_row(const struct ggn_calibration_row *r)
{
    printf("%-26.26s %6d %8.3f %8.3f %+8.3f %9.0f%% %8.2f %8.4f\n", r->name, r->blocks, r->median_abs_log2, r->mean_abs_log2,
           r->median_log2, 100.0 * r->share_below, r->spearman, r->level);
}

static void print_calibration(const struct ggn_calibration *c)
{
    char text[512];
    printf("%-26s %5s %9s %9s\n", "view", "block", "human", "left out");
    for (int i = 0; i < c->n_blocks; i++)
        printf("%-26.26s %5u %9.0f %9.0f\n", c->views[c->blocks[i].view].name, c->blocks[i].id, c->blocks[i].human,
               c->blocks[i].predicted);
    printf("\n%-26s %6s %8s %8s %8s %10s %8s %8s\n", "log2(left out / human)", "blocks", "median||", "mean||", "bias",
           "below 0.8", "Spearman", "level");
    for (int v = 0; v < c->n_views; v++)
        print_row(&c->views[v]);
    print_row(&c->all);
    ggn_observer_describe(&c->observer, text, sizeof text);
    printf("%s\n", text);
}

static int calibrate(const struct options *o, struct base_threads *threads, struct base_err *err)
{
    struct ggn_dataset sets[MAX_INPUTS] = {{0}};
    struct ggn_thresholds t = {0};
    struct ggn_calibration c = {0};
    size_t room = 1;
    int n = 0, rc = ggn_thresholds_read(o->calibrate, study_block, &t, err);
    for (int s = 0; s < o->n_inputs && !rc; s++) {
        rc = ggn_dataset_open(o->inputs[s], &sets[s], err);
        room += rc ? 0 : (size_t)sets[s].n;
    }
    struct ggn_calibration_input *inputs = malloc(room * sizeof *inputs);
    if (!rc && !inputs)
        rc = base_fail_nomem(err, "calibration");
    for (int s = 0; s < o->n_inputs && !rc; s++)
        for (int i = 0; i < sets[s].n && !rc; i++, n++) {
            inputs[n].view = &sets[s].views[i];
            rc = find_row(o->calibrate, inputs[n].view->name, &t, &inputs[n].human, err);
        }
    if (!rc)
        rc = ggn_calibrate(inputs, n, (enum ggn_curve_source)o->source, threads, &c, err);
    if (!rc && o->spread > 0)
        c.observer.spread = o->spread;
    if (!rc)
        print_calibration(&c);
    if (!rc && o->out)
        rc = ggn_calibration_write(o->out, &c, err);
    ggn_calibration_release(&c);
    free(inputs);
    for (int s = 0; s < o->n_inputs; s++)
        ggn_dataset_release(&sets[s]);
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
        printf("%s: spread %.2f octaves (%d trials, %d blocks, %d lines left out)\n", o->inputs[i], spread, trials, blocks,
               skipped);
        log_sum += log(spread);
    }
    printf("geometric mean %.2f octaves\n", exp(log_sum / o->n_inputs));
    return 0;
}

int ggn_cmd_label(int argc, char **argv, struct base_err *err)
{
    static const struct base_options options = {.list = list,
                                                .args_doc = "DATA...",
                                                .args_min = 1,
                                                .args_max = MAX_INPUTS,
                                                .args = offsetof(struct options, inputs),
                                                .arg_count = offsetof(struct options, n_inputs),
                                                .doc = "Attaches thresholds to recorded sequences (DATA: a sequence or a "
                                                       "folder of them): those of people, or those of the "
                                                       "model observer, which are never called human."};
    struct options o = {.source = GGN_FROM_HALVES, .threads = job_threads(ggn_cmd_job)};
    int rc = base_options_parse(&options, argc, argv, &o, err);
    if (rc)
        return rc;
    base_interrupt_catch();
    if (job_rank(ggn_cmd_job) > 0) /* rank 0 ends the job */
        base_interrupt_ignore();
    if ((o.trials || o.calibrate || o.check) && job_rank(ggn_cmd_job) > 0) /* nothing is shared out */
        return 0;
    if (o.trials) {
        rc = fit_trials(&o, err);
    } else {
        struct base_threads *threads = base_threads_create(o.threads, err);
        rc = !threads ? err->code : o.calibrate ? calibrate(&o, threads, err) : label(&o, threads, err);
        base_threads_destroy(threads);
    }
    return !rc && base_interrupted ? GGN_EXIT_INTERRUPTED : rc;
}
