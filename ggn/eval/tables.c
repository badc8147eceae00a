#include "eval/tables.h"

#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <cjson/cJSON.h>

#include "base/files.h"
#include "base/json.h"

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

/* --- stops --- */

static int stops_path(char path[4096], const char *dir, enum ggn_split split, const struct ggn_method *method,
                      struct base_err *err)
{
    char word[GGN_METHOD_NAME] = "";
    size_t n = 0;
    for (const char *p = method->name; *p != '\0' && *p != '(' && n + 2 < sizeof word; p++)
        if (isalnum((unsigned char)*p))
            word[n++] = *p;
    word[n] = '\0';
    int length = snprintf(path, 4096, "%s/%s-stops-%s.csv", dir, ggn_split_names[split], word);
    return length > 0 && length < 4096 ? 0 : base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
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

int ggn_report_stops(const char *dir, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *methods,
                     int n, struct base_err *err)
{
    char path[4096];
    int rc = 0;
    for (int i = 0; i < n && !rc; i++) {
        rc = stops_path(path, dir, split, &methods[i], err);
        if (!rc)
            rc = write_stops(path, s, split, &methods[i], err);
    }
    return rc;
}
