#include "eval/tables.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/json.h"
#include "eval/compare.h"
#include "figures/charts.h"

/* key, column head, format, value */
#define COLUMNS(X) \
    X(auc, "AUC", "%.4f", m->auc) \
    X(auc_scene_mean, "AUC/scene", "%.4f", m->auc_scene_mean) \
    X(accuracy, "accuracy", "%.4f", m->accuracy) \
    X(best_accuracy, "best acc", "%.4f", m->best_accuracy) \
    X(early_stop_rate, "early", "%.3f", m->early_stop_rate) \
    X(samples_ratio, "samples", "%.3f", m->samples_ratio) \
    X(median_abs_log2, "|log2|", "%.3f", m->agreement.median_abs_log2) \
    X(median_log2, "log2", "%.3f", m->agreement.median_log2) \
    X(iqr_log2, "IQR", "%.3f", m->agreement.iqr_log2) \
    X(within_half, "in 1/2", "%.3f", m->agreement.within_half) \
    X(within_one, "in 1", "%.3f", m->agreement.within_one) \
    X(pearson_r, "r", "%.3f", m->agreement.pearson_r) \
    X(spearman, "rho", "%.3f", m->agreement.spearman) \
    X(mae, "MAE", "%.0f", m->agreement.mae) \
    X(flip_mean, "FLIP", "%.4f", m->flip_mean) \
    X(flip_worst, "worst", "%.4f", m->flip_worst) \
    X(ssim_mean, "SSIM", "%.4f", m->ssim_mean) \
    X(ssim_worst, "worst", "%.4f", m->ssim_worst) \
    X(uniform_spp, "uniform", "%.0f", m->uniform_spp) \
    X(samples_vs_uniform, "smp/uni", "%.3f", m->samples_vs_uniform) \
    X(time_vs_uniform, "time/uni", "%.3f", m->time_vs_uniform)

static void print_rows(FILE *f, const struct ggn_method *methods, const struct ggn_method_metrics *metrics, int n, int from,
                       int to)
{
    int column = 0;
    fprintf(f, "%-30s", "");
#define HEAD(key, head, format, value) \
    if (column >= from && column < to) \
        fprintf(f, " %9s", head); \
    column++;
    COLUMNS(HEAD)
#undef HEAD
    fputc('\n', f);
    for (int i = 0; i < n; i++) {
        const struct ggn_method_metrics *m = &metrics[i];
        fprintf(f, "%-30.30s", methods[i].name);
        column = 0;
#define CELL(key, head, format, value) \
    if (column >= from && column < to) { \
        char text[32]; \
        snprintf(text, sizeof text, format, value); \
        fprintf(f, " %9s", isnan(value) ? "-" : text); \
    } \
    column++;
        COLUMNS(CELL)
#undef CELL
        fputc('\n', f);
    }
}

/* 2 log2 of what is seen without halves over what is seen with them, at a block's threshold: octaves of samples. */
static double shift_without_halves(const struct ggn_eval_set *s, const struct ggn_eval_block *b)
{
    size_t i = b->first;
    while (i + 1 < b->end && s->spp[i] < b->label.threshold)
        i++;
    return 2.0 * log2(s->visible_means[i] / s->visible[i]);
}

static int print_without_halves(FILE *f, const struct ggn_eval_set *s, enum ggn_split split, struct base_err *err)
{
    double *shift = malloc(2 * (size_t)s->n_blocks * sizeof *shift), *size = shift ? shift + s->n_blocks : NULL;
    size_t n = 0;
    if (!shift)
        return base_fail_nomem(err, "evaluation");
    for (int b = 0; b < s->n_blocks; b++)
        if (s->blocks[b].split == split && isfinite(shift_without_halves(s, &s->blocks[b]))) {
            shift[n] = shift_without_halves(s, &s->blocks[b]);
            size[n] = fabs(shift[n]);
            n++;
        }
    if (n > 0)
        fprintf(f,
                "observer without halves, at the thresholds of %zu blocks: shifted by %+.3f octaves in the median, "
                "|shift| median %.3f, 90th percentile %.3f\n",
                n, ggn_stats_quantile(shift, n, 0.5), ggn_stats_quantile(size, n, 0.5), ggn_stats_quantile(size, n, 0.9));
    free(shift);
    return 0;
}

int ggn_report_table(FILE *f, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *methods,
                     const struct ggn_method_metrics *metrics, int n, struct base_err *err)
{
    fprintf(f, "\n%s: %d blocks of %d scenes (%d censored), %zu windows\n", ggn_split_names[split], metrics[0].blocks,
            metrics[0].scenes, metrics[0].censored, metrics[0].cases);
    print_rows(f, methods, metrics, n, 0, 14);
    print_rows(f, methods, metrics, n, 14, 21);
    return print_without_halves(f, s, split, err);
}

static void print_view(FILE *f, const struct ggn_eval_set *s, int view, const struct ggn_method *m, double *room)
{
    size_t n = 0;
    double blocks = 0.0, early = 0.0;
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        if (block->view != view)
            continue;
        blocks += 1.0;
        const double stop = ggn_eval_compared(block, m->stop[b]), needs = ggn_eval_compared(block, block->label.threshold);
        early += stop < 0.8 * needs;
        if (!block->label.censored)
            room[n++] = fabs(log2(stop / needs));
    }
    fprintf(f, "  %6.3f %6.3f     ", ggn_stats_quantile(room, n, 0.5), early / blocks);
}

int ggn_report_people(FILE *f, const struct ggn_eval_set *s, const struct ggn_method *methods, int n, struct base_err *err)
{
    const struct ggn_dataset *d = &s->images.data;
    double *room = malloc((size_t)s->n_blocks * sizeof *room);
    if (!room)
        return base_fail_nomem(err, "people");
    fprintf(f, "\n%-30s", "people: |log2|, early");
    for (int v = 0; v < d->n; v++)
        if (d->views[v].split == GGN_SPLIT_PEOPLE)
            fprintf(f, "  %-18.18s", d->views[v].name);
    fputc('\n', f);
    for (int i = 0; i < n; i++) {
        fprintf(f, "%-30.30s", methods[i].name);
        for (int v = 0; v < d->n; v++)
            if (d->views[v].split == GGN_SPLIT_PEOPLE)
                print_view(f, s, v, &methods[i], room);
        fputc('\n', f);
    }
    free(room);
    return 0;
}

void ggn_report_json(struct cJSON *to, const struct ggn_method *methods, const struct ggn_method_metrics *metrics, int n,
                     int *failed)
{
    for (int i = 0; i < n; i++) {
        const struct ggn_method_metrics *m = &metrics[i];
        cJSON *o = base_json_object(to, methods[i].name, failed);
        base_json_number(o, "blocks", m->blocks, failed);
        base_json_number(o, "censored", m->censored, failed);
        base_json_number(o, "windows", (double)m->cases, failed);
        base_json_bool(o, "oracle", methods[i].is_oracle, failed);
        if (!isnan(methods[i].cut))
            base_json_number(o, "cut", methods[i].cut, failed);
#define MEMBER(key, head, format, value) base_json_number(o, #key, value, failed);
        COLUMNS(MEMBER)
#undef MEMBER
    }
}

/* --- pictures --- */

static int picture_path(char path[4096], const char *dir, enum ggn_split split, const char *kind,
                        const struct ggn_method *method, const char *end, struct base_err *err)
{
    char word[GGN_METHOD_NAME] = "";
    size_t n = 0;
    for (const char *p = method ? method->name : ""; *p != '\0' && *p != '(' && n + 2 < sizeof word; p++)
        if (isalnum((unsigned char)*p))
            word[n++] = *p;
    word[n] = '\0';
    int length = snprintf(path, 4096, "%s/%s-%s%s%s%s", dir, ggn_split_names[split], kind, n > 0 ? "-" : "", word, end);
    return length > 0 && length < 4096 ? 0 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
}

struct point {
    double score;
    int noisy;
};

static int by_score_falling(const void *a, const void *b)
{
    double x = ((const struct point *)a)->score, y = ((const struct point *)b)->score;
    return (x < y) - (x > y);
}

/* Fills a series with points of the ROC curve; the caller frees its x. */
static int roc_of(struct ggn_series *out, const struct ggn_method *m, const struct ggn_eval_set *s, enum ggn_split split,
                  struct base_err *err)
{
    struct point *p = malloc((s->n > 0 ? s->n : 1) * sizeof *p);
    double *x = calloc(2 * (s->n + 1), sizeof *x), *y = x + s->n + 1; /* from (0, 0) */
    size_t n = 0, positive = 0, hit = 0, step;
    *out = (struct ggn_series){.title = m->name, .n = 1, .x = x, .y = y, .at = (double)NAN};
    if (!p || !x) {
        free(p);
        return base_fail_nomem(err, m->name);
    }
    for (int b = 0; b < s->n_blocks; b++)
        for (size_t i = s->blocks[b].first; i < s->blocks[b].end; i++)
            if (s->blocks[b].split == split && s->noisy[i] >= 0 && !isnan(m->score[i])) {
                p[n++] = (struct point){m->score[i], s->noisy[i]};
                positive += s->noisy[i] == 1;
            }
    qsort(p, n, sizeof *p, by_score_falling);
    step = n / 500 + 1;
    for (size_t i = 0; i < n; i++) {
        hit += p[i].noisy == 1;
        if (i + 1 == n || (p[i + 1].score != p[i].score && i % step == 0)) {
            x[out->n] = n > positive ? (double)(i + 1 - hit) / (double)(n - positive) : 0.0;
            y[out->n++] = positive > 0 ? (double)hit / (double)positive : 0.0;
        }
    }
    free(p);
    return 0;
}

static int plot_roc(const char *path, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *methods,
                    int n, struct base_err *err)
{
    struct ggn_series *curves = calloc((size_t)n, sizeof *curves);
    char title[80];
    int count = 0, rc = curves ? 0 : base_fail_nomem(err, path);
    for (int i = 0; i < n && !rc; i++)
        if (methods[i].score)
            rc = roc_of(&curves[count++], &methods[i], s, split, err);
    snprintf(title, sizeof title, "all windows of the %s scenes pooled", ggn_split_names[split]);
    const struct ggn_chart chart = {.title = title,
                                    .x_label = "share of converged images called noisy",
                                    .y_label = "share of noisy images called noisy",
                                    .to = {1, 1},
                                    .square = 1,
                                    .diagonal = 1,
                                    .key = GGN_KEY_BOTTOM,
                                    .series = curves,
                                    .n = count};
    if (!rc)
        rc = ggn_plot_charts(path, 720, 680, &chart, 1, err);
    for (int i = 0; i < count; i++)
        free((void *)curves[i].x);
    free(curves);
    return rc;
}

/* Score against spp for six blocks spread over the split by threshold; dashed: the threshold. No picture of a method that
 * judged none of them. */
static int plot_scores(const char *path, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *m,
                       struct base_err *err)
{
    enum { SHOWN = 6 };
    static const char *const colours[SHOWN] = {"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf"};
    struct ggn_series series[SHOWN];
    char titles[SHOWN][200];
    double *x = malloc(2 * (s->n > 0 ? s->n : 1) * sizeof *x);
    int n = 0, total = ggn_eval_count(s, split), seen = 0;
    size_t at = 0;
    if (!x)
        return base_fail_nomem(err, path);
    for (int b = 0; b < s->n_blocks && n < SHOWN; b++) {
        const struct ggn_eval_block *block = &s->blocks[b];
        const struct ggn_dataset_view *v = &s->images.data.views[block->view];
        if (block->split != split || seen++ * SHOWN < n * total)
            continue;
        snprintf(titles[n], sizeof titles[n], "%.120s %u", v->name, v->manifest.blocks[block->index].id);
        series[n] = (struct ggn_series){
            .title = titles[n], .colour = colours[n], .x = x + at, .y = x + s->n + at, .at = block->label.threshold};
        for (size_t i = block->first; i < block->end; i++)
            if (!isnan(m->score[i])) {
                x[at] = s->spp[i];
                x[s->n + at++] = m->score[i];
                series[n].n++;
            }
        n++;
    }
    const double open = (double)NAN;
    const struct ggn_chart chart = {.x_label = "samples per pixel (dashed: threshold)",
                                    .y_label = m->name,
                                    .from = {open, open},
                                    .to = {open, open},
                                    .x_scale = GGN_LOG10,
                                    .key = GGN_KEY_OUTSIDE,
                                    .point_size = 0.5,
                                    .series = series,
                                    .n = n,
                                    .level = isnan(m->cut) ? 0.0 : m->cut,
                                    .level_title = "cut"};
    int rc = ggn_plot_charts(path, 900, 560, &chart, 1, err);
    free(x);
    return rc;
}

static void fill_view(struct ggn_view *v, const struct ggn_eval_set *s, int view, const double *stop)
{
    const struct seq_manifest *m = &s->images.data.views[view].manifest;
    snprintf(v->name, sizeof v->name, "%.100s", s->images.data.views[view].name);
    v->columns = (int)((m->width + m->block - 1) / m->block);
    for (int i = 0; i < v->n; i++)
        v->spp[i] = (double)NAN;
    for (int b = 0; b < s->n_blocks; b++) {
        uint32_t id = m->blocks[s->blocks[b].index < m->n_blocks ? s->blocks[b].index : 0].id;
        if (s->blocks[b].view == view && id < (uint32_t)v->n)
            v->spp[id] = stop ? stop[b] : s->blocks[b].label.threshold;
    }
}

/* Thresholds (stop NULL) or stops of the split's views, for the heat maps. */
static int make_maps(struct ggn_thresholds *t, const struct ggn_eval_set *s, enum ggn_split split, const double *stop,
                     struct base_err *err)
{
    *t = (struct ggn_thresholds){.views = calloc((size_t)s->images.data.n, sizeof *t->views)};
    if (!t->views)
        return base_fail_nomem(err, "maps");
    for (int v = 0; v < s->images.data.n; v++) {
        uint32_t blocks = ggn_dataset_tiles(&s->images.data.views[v]);
        int used = 0;
        for (int b = 0; b < s->n_blocks; b++)
            used |= s->blocks[b].view == v && s->blocks[b].split == split;
        if (!used || blocks > GGN_VIEW_BLOCKS)
            continue;
        struct ggn_view *view = &t->views[t->n];
        view->n = (int)blocks;
        view->spp = malloc(blocks * sizeof *view->spp);
        if (!view->spp) {
            ggn_thresholds_release(t);
            return base_fail_nomem(err, "maps");
        }
        t->n++;
        fill_view(view, s, v, stop);
    }
    return 0;
}

/* score: what the method last said until the stop; empty where it did not judge. */
static int write_stops(const char *path, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *m,
                       struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fputs("view;block;threshold;censored;stop;score\n", out.file);
    for (int b = 0; b < s->n_blocks; b++) {
        const struct ggn_eval_block *e = &s->blocks[b];
        if (e->split != split)
            continue;
        fprintf(out.file, "%s;%u;%.6g;%d;%.6g;", s->images.data.views[e->view].name, e->label.id, e->label.threshold,
                e->label.censored, m->stop[b]);
        size_t i = ggn_method_stop_case(m, s, b);
        while (i > e->first && isnan(ggn_method_verdict(m, i))) /* a verdict stands until the next check */
            i--;
        double score = ggn_method_verdict(m, i);
        fprintf(out.file, isfinite(score) ? "%.17g\n" : "\n", score);
    }
    return base_file_commit(&out, err);
}

static int method_pictures(const char *dir, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *m,
                           struct base_err *err)
{
    char path[4096];
    struct ggn_thresholds truth = {0}, stops = {0};
    struct ggn_pairing pairing = {0};
    int rc = make_maps(&truth, s, split, NULL, err);
    if (!rc)
        rc = make_maps(&stops, s, split, m->stop, err);
    if (!rc)
        rc = ggn_pairing_init(&pairing, &truth, &stops, NULL, err);
    if (!rc && (rc = picture_path(path, dir, split, "scatter", m, ".png", err)) == 0)
        rc = ggn_plot_scatter(path, pairing.truth, pairing.model, pairing.n, "threshold", m->name, err);
    if (!rc && (rc = picture_path(path, dir, split, "errors", m, ".png", err)) == 0)
        rc = ggn_plot_errors(path, pairing.truth, pairing.model, pairing.n, m->name, err);
    if (!rc && (rc = picture_path(path, dir, split, "heatmaps", m, ".png", err)) == 0)
        rc = ggn_compare_heatmaps(path, &pairing, "thresholds", m->name, err);
    if (!rc && m->score && (rc = picture_path(path, dir, split, "score", m, ".png", err)) == 0)
        rc = plot_scores(path, s, split, m, err);
    if (!rc && (rc = picture_path(path, dir, split, "stops", m, ".csv", err)) == 0)
        rc = write_stops(path, s, split, m, err);
    ggn_pairing_release(&pairing);
    ggn_thresholds_release(&truth);
    ggn_thresholds_release(&stops);
    return rc;
}

int ggn_report_pictures(const char *dir, const struct ggn_eval_set *s, enum ggn_split split,
                        const struct ggn_method *methods, int n, struct base_err *err)
{
    char path[4096];
    int rc = picture_path(path, dir, split, "roc", NULL, ".png", err);
    if (!rc)
        rc = plot_roc(path, s, split, methods, n, err);
    for (int i = 0; i < n && !rc; i++)
        rc = method_pictures(dir, s, split, &methods[i], err);
    return rc;
}
