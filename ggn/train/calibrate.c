#include "train/calibrate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "base/json.h"
#include "base/text.h"
#include "sight/stats.h"
#include "train/views.h"

/* What is known of all blocks before any fit. */
struct evidence {
    const struct ggn_calibration_block *blocks; /* borrows */
    struct ggn_curve *curves;                   /* owns; [n] */
    double *x, *y, *answers;                    /* own, one allocation; [n]; room for figures */
    int n;
};

/* Sum of |log2(predicted / human)| over the blocks of all views but `skip`. */
static double misfit(const struct evidence *e, int skip, double level)
{
    double sum = 0.0;
    int censored;
    for (int i = 0; i < e->n; i++)
        if (e->blocks[i].view != skip)
            sum +=
                fabs(log2(ggn_observer_to_study(ggn_curve_threshold(&e->curves[i], level, &censored)) / e->blocks[i].human));
    return sum;
}

/* Fits on all blocks but those of view `skip` (-1: on all). A sum of absolute errors has its least value where one of them
 * is 0, so the levels to try are what the blocks show at their own thresholds. */
static int fit(const struct evidence *e, int skip, struct ggn_observer *o, struct base_err *err)
{
    double least = INFINITY;
    for (int i = 0; i < e->n; i++) {
        if (e->blocks[i].view == skip || e->blocks[i].human >= SEQ_STUDY_CAP)
            continue;
        double level = ggn_curve_at(&e->curves[i], ggn_observer_from_study(e->blocks[i].human));
        double sum = level > 0.0 ? misfit(e, skip, level) : INFINITY;
        if (sum < least) {
            least = sum;
            o->level = level;
        }
    }
    if (!isfinite(least))
        return base_fail(err, BASE_EINVAL, "calibration needs a noisy block with a threshold below %d in the other views",
                         SEQ_STUDY_CAP);
    return 0;
}

/* Half the way from the 16th to the 84th percentile of log2(answer / threshold) in samples of the observer, of the blocks
 * whose threshold is known. answers is overwritten. */
static double spread_of(const struct evidence *e, double *answers)
{
    size_t n = 0;
    for (int i = 0; i < e->n; i++)
        if (e->blocks[i].human < SEQ_STUDY_CAP)
            answers[n++] = log2(answers[i] / ggn_observer_from_study(e->blocks[i].human));
    return 0.5 * (ggn_stats_quantile(answers, n, 0.84) - ggn_stats_quantile(answers, n, 0.16));
}

static double error_of(const struct ggn_calibration_block *b) { return log2(b->predicted / b->human); }

/* Figures over blocks[from, to). */
static int summarise(struct evidence *e, int from, int to, struct ggn_calibration_row *row, struct base_err *err)
{
    size_t n = 0, below = 0;
    row->blocks = to - from;
    for (int i = from; i < to; i++, n++) {
        e->x[n] = e->blocks[i].human;
        e->y[n] = e->blocks[i].predicted;
    }
    int rc = ggn_stats_spearman(e->x, e->y, n, &row->spearman, err);
    for (size_t i = 0; i < n; i++) {
        e->x[i] = error_of(&e->blocks[from + (int)i]);
        e->y[i] = fabs(e->x[i]);
        below += e->x[i] < log2(0.8);
    }
    row->mean_abs_log2 = ggn_stats_mean(e->y, n);
    row->median_log2 = ggn_stats_quantile(e->x, n, 0.5);
    row->median_abs_log2 = ggn_stats_quantile(e->y, n, 0.5);
    row->share_below = (double)below / (double)n;
    return rc;
}

static int leave_each_out(struct evidence *e, const struct ggn_calibration_input *inputs, struct ggn_calibration *c,
                          struct base_err *err)
{
    int rc = 0, from = 0;
    for (int v = 0; v < c->n_views && !rc; v++) {
        struct ggn_calibration_row *row = &c->views[v];
        struct ggn_observer o;
        rc = fit(e, v, &o, err);
        if (rc)
            break;
        *row = (struct ggn_calibration_row){.name = inputs[v].view->name, .level = o.level};
        int to = from, censored;
        for (; to < e->n && e->blocks[to].view == v; to++) {
            e->answers[to] = ggn_curve_threshold(&e->curves[to], o.level, &censored);
            c->blocks[to].predicted = ggn_observer_to_study(e->answers[to]);
        }
        rc = summarise(e, from, to, row, err);
        from = to;
    }
    if (!rc)
        rc = fit(e, -1, &c->observer, err);
    c->all = (struct ggn_calibration_row){.name = "all, each view left out", .level = c->observer.level};
    if (!rc)
        rc = summarise(e, 0, e->n, &c->all, err);
    c->observer.spread = spread_of(e, e->answers);
    return rc;
}

/* Curves and thresholds of one view, from block `*at` on. */
static int add_view(const struct ggn_calibration_input *in, int view, enum ggn_curve_source source,
                    struct base_threads *threads, struct evidence *e, struct ggn_calibration_block *blocks,
                    struct base_err *err)
{
    const struct seq_manifest *m = &in->view->manifest;
    uint32_t tiles = ggn_dataset_tiles(in->view);
    if (m->n_blocks == 0)
        return base_fail(err, BASE_EINVAL, "%s: no finished block yet", in->view->dir);
    if ((uint32_t)in->human->n != tiles)
        return base_fail(err, BASE_EINVAL, "'%s' has %d thresholds, %s has %u blocks of %u pixels", in->human->name,
                         in->human->n, in->view->dir, tiles, m->block);
    int rc = ggn_view_curves(in->view, source, threads, e->curves + e->n, err);
    for (uint32_t i = 0; i < m->n_blocks && !rc; i++) {
        uint32_t id = m->blocks[i].id;
        double human = id < tiles ? in->human->spp[id] : (double)NAN;
        blocks[e->n++] = (struct ggn_calibration_block){.view = view, .id = id, .human = fmin(human, SEQ_STUDY_CAP)};
        if (!(human > 0.0))
            rc = base_fail(err, BASE_EINVAL, "%s: block %u has no threshold in '%s'", in->view->dir, id, in->human->name);
    }
    return rc;
}

void ggn_calibration_release(struct ggn_calibration *c)
{
    free(c->views);
    free(c->blocks);
    *c = (struct ggn_calibration){0};
}

int ggn_calibrate(const struct ggn_calibration_input *inputs, int n, enum ggn_curve_source source,
                  struct base_threads *threads, struct ggn_calibration *out, struct base_err *err)
{
    size_t room = 1;
    int rc = 0;
    if (n < 2)
        return base_fail(err, BASE_EINVAL, "calibration leaves one view out: it needs at least 2 views, there is %d", n);
    for (int v = 0; v < n; v++)
        room += inputs[v].view->manifest.n_blocks;
    struct ggn_calibration c = {
        .n_views = n, .views = calloc((size_t)n, sizeof *c.views), .blocks = calloc(room, sizeof *c.blocks)};
    struct evidence e = {.blocks = c.blocks, .curves = calloc(room, sizeof *e.curves), .x = malloc(3 * room * sizeof *e.x)};
    if (!c.views || !c.blocks || !e.curves || !e.x)
        rc = base_fail_nomem(err, "calibration");
    e.y = e.x ? e.x + room : NULL;
    e.answers = e.x ? e.x + 2 * room : NULL;
    for (int v = 0; v < n && !rc; v++)
        rc = add_view(&inputs[v], v, source, threads, &e, c.blocks, err);
    c.n_blocks = e.n;
    if (!rc)
        rc = leave_each_out(&e, inputs, &c, err);
    for (size_t i = 0; e.curves && i < room; i++)
        ggn_curve_release(&e.curves[i]);
    free(e.curves);
    free(e.x);
    if (rc)
        ggn_calibration_release(&c);
    else
        *out = c;
    return rc;
}

static void add_row(cJSON *to, const struct ggn_calibration_row *row, int *failed)
{
    base_json_text(to, "name", row->name, failed);
    base_json_number(to, "blocks", row->blocks, failed);
    base_json_number(to, "level", row->level, failed);
    base_json_number(to, "median_abs_log2", row->median_abs_log2, failed);
    base_json_number(to, "mean_abs_log2", row->mean_abs_log2, failed);
    base_json_number(to, "median_log2", row->median_log2, failed);
    base_json_number(to, "share_below_0.8", row->share_below, failed);
    base_json_number(to, "spearman", row->spearman, failed);
}

int ggn_calibration_write(const char *path, const struct ggn_calibration *c, struct base_err *err)
{
    cJSON *root = cJSON_CreateObject();
    int failed = !root;
    base_json_number(root, "level", c->observer.level, &failed);
    base_json_number(root, "spread", c->observer.spread, &failed);
    cJSON *table = base_json_array(root, "each_view_left_out", &failed);
    for (int v = 0; v < c->n_views; v++)
        add_row(base_json_object(table, NULL, &failed), &c->views[v], &failed);
    add_row(base_json_object(root, "all", &failed), &c->all, &failed);
    int rc = base_json_write(path, root, failed, err);
    cJSON_Delete(root);
    return rc;
}

enum { TRIAL_BLOCKS = 256 };

struct trial {
    int block, seen;
    double log2_spp;
};

/* Lines that are no trial (two that ran into one another, level 0) are left out and counted. */
static int parse_trials(const char *path, char *text, size_t size, struct trial **out, int *count, int *skipped,
                        struct base_err *err)
{
    struct base_lines lines;
    const char *line;
    size_t length;
    int rc, n = 0;
    base_lines_init(&lines, path, text, size);
    struct trial *t = malloc((base_lines_left(&lines) + 1) * sizeof *t);
    *skipped = 0;
    if (!t)
        return base_fail_nomem(err, path);
    while (!(rc = base_lines_next(&lines, &line, &length, err)) && line) {
        char *end = text + (line - text);
        if (length == 0)
            continue;
        end[length] = '\0';
        double block = strtod(line, &end), level = *end == ';' ? strtod(end + 1, &end) : -1.0,
               seen = *end == ';' ? strtod(end + 1, &end) : -1.0;
        if (!(block >= 0 && block < TRIAL_BLOCKS) || !(level > 0 && level < 1e6) || (seen != 0.0 && seen != 1.0) ||
            end[strspn(end, " \t")] != '\0')
            ++*skipped;
        else
            t[n++] = (struct trial){(int)block, seen == 1.0, log2(20.0 * level)};
    }
    *out = t;
    *count = n;
    return rc;
}

/* Log-likelihood of one block's trials for threshold x (log2) and spread s. A lapse rate of 2 %: no slip rules. */
static double likelihood(const struct trial *t, int n, int block, double x, double s)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        if (t[i].block == block) {
            double p = 0.01 + 0.98 * 0.5 * erfc((t[i].log2_spp - x) / (s * sqrt(2.0)));
            sum += log(t[i].seen ? p : 1.0 - p);
        }
    return sum;
}

int ggn_trials_spread(const char *path, double *spread, int *blocks, int *trials, int *skipped, struct base_err *err)
{
    char *text;
    size_t size;
    struct trial *t = NULL;
    int n = 0, present[TRIAL_BLOCKS] = {0};
    int rc = base_file_read(path, 1 << 26, &text, &size, err);
    if (rc)
        return rc;
    rc = parse_trials(path, text, size, &t, &n, skipped, err);
    free(text);
    if (rc) {
        free(t);
        return rc;
    }
    *blocks = 0;
    for (int i = 0; i < n; i++)
        *blocks += present[t[i].block]++ == 0;
    double best = -INFINITY;
    for (double s = 0.05; s < 3.0; s *= 1.05) {
        double sum = 0.0;
        for (int b = 0; b < TRIAL_BLOCKS; b++) {
            double most = -INFINITY;
            for (double x = 4.0; present[b] > 0 && x <= 14.0; x += 0.05)
                most = fmax(most, likelihood(t, n, b, x, s));
            sum += present[b] > 0 ? most : 0.0;
        }
        if (sum > best) {
            best = sum;
            *spread = s;
        }
    }
    free(t);
    *trials = n;
    return n > 0 ? 0 : base_fail(err, BASE_EINVAL, "%s: no trials in it", path);
}
