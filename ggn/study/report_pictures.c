#include <math.h>
#include <stdlib.h>

#include "base/files.h"
#include "figures/charts.h"
#include "study/report.h"

static const double open = (double)NAN;

static int draw(const char *dir, const char *name, int width, int height, const struct ggn_chart *charts, int n,
                struct base_err *err)
{
    char path[4096];
    int rc = base_file_join(path, dir, name, err);
    return rc ? rc : ggn_plot_charts(path, width, height, charts, n, err);
}

/* Thresholds of all blocks, view after view, with their intervals. */
static int plot_thresholds(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                           struct base_err *err)
{
    const size_t cells = (size_t)p->n_cells;
    double *x = malloc(4 * cells * sizeof *x), *y = x + cells, *lo = y + cells, *hi = lo + cells;
    struct ggn_series s = {.colour = "#3b6ea5", .x = x, .y = y, .at = open, .lo = lo, .hi = hi};
    if (!x)
        return base_fail_nomem(err, dir);
    for (int c = 0; c < p->n_cells; c++)
        if (!isnan(t[c].t)) {
            x[s.n] = c;
            y[s.n] = exp2(t[c].t);
            lo[s.n] = exp2(isnan(t[c].lo) ? t[c].t : t[c].lo);
            hi[s.n++] = exp2(isnan(t[c].hi) ? t[c].t : t[c].hi);
        }
    const struct ggn_chart chart = {.x_label = "block, view after view",
                                    .y_label = "samples per pixel",
                                    .from = {-0.5, open},
                                    .to = {p->n_cells - 0.5, open},
                                    .y_scale = GGN_LOG2,
                                    .point_size = 0.8,
                                    .series = &s,
                                    .n = 1};
    int rc = draw(dir, "thresholds.png", 900, 420, &chart, 1, err);
    free(x);
    return rc;
}

/* Each person's thresholds against the mean of all; of who does not count, none. */
static int plot_people(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                       struct base_err *err)
{
    const size_t cells = (size_t)p->n_cells;
    struct ggn_series *people = calloc((size_t)p->n, sizeof *people), *s = people;
    double *x = malloc(2 * (size_t)p->n * cells * sizeof *x), *y = x + cells;
    for (int i = 0; i < p->n && people && x; i++) {
        const struct ggn_study_result *r = &p->results[i];
        *s = (struct ggn_series){.x = x + 2 * (size_t)i * cells, .y = y + 2 * (size_t)i * cells, .at = open, .apart = 1};
        for (int c = 0; c < p->n_cells && r->excluded[0] == '\0'; c++)
            if (r->cells[c].trials > 0) {
                x[2 * (size_t)i * cells + s->n] = exp2(t[c].t);
                y[2 * (size_t)i * cells + s->n++] = exp2(fmin(r->cells[c].t, ggn_study_cell_cap(p, c)));
            }
        s += s->n > 0;
    }
    const struct ggn_chart chart = {.x_label = "mean over people, samples per pixel",
                                    .y_label = "one person, samples per pixel",
                                    .from = {open, open},
                                    .to = {open, open},
                                    .x_scale = GGN_LOG2,
                                    .y_scale = GGN_LOG2,
                                    .square = 1,
                                    .diagonal = 1,
                                    .point_size = 0.6,
                                    .series = people,
                                    .n = (int)(s - people)};
    int rc = people && x ? draw(dir, "people.png", 560, 560, &chart, 1, err) : base_fail_nomem(err, dir);
    free(x);
    free(people);
    return rc;
}

/* One block: shares of correct answers of all people that count, and the curve at their mean threshold and spread. */
struct curve {
    char title[GGN_STUDY_NAME + 48];
    double spp[GGN_STUDY_MAX_LEVELS], share[GGN_STUDY_MAX_LEVELS], size[GGN_STUDY_MAX_LEVELS], fit[GGN_STUDY_MAX_LEVELS];
    struct ggn_series series[2];
};

static struct ggn_chart curve_of(struct curve *out, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                                 int cell)
{
    int view;
    const struct ggn_study_block *b = ggn_study_cell_block(p, cell, &view);
    const size_t levels = (size_t)b->n_levels;
    snprintf(out->title, sizeof out->title, "%s, block %u: %.0f", p->study->views[view].name, b->id, exp2(t[cell].t));
    for (size_t l = 0; l < levels; l++) {
        int n = 0, correct = 0;
        for (int i = 0; i < p->n; i++)
            for (int k = 0; k < p->results[i].n_choices && p->results[i].excluded[0] == '\0'; k++)
                if (p->results[i].choice_cells[k] == cell && p->results[i].choices[k].x == log2(b->levels[l])) {
                    n++;
                    correct += p->results[i].choices[k].correct;
                }
        out->spp[l] = b->levels[l];
        out->share[l] = n > 0 ? (double)correct / n : open;
        out->size[l] = 0.5 + 0.35 * sqrt(n);
        out->fit[l] = ggn_study_p_correct(log2(b->levels[l]), t[cell].t, t[cell].spread);
    }
    out->series[0] = (struct ggn_series){
        .colour = "#3b6ea5", .n = levels, .x = out->spp, .y = out->share, .at = open, .sizes = out->size};
    out->series[1] = (struct ggn_series){.colour = "#c0504d", .n = levels, .x = out->spp, .y = out->fit, .at = open};
    return (struct ggn_chart){.title = out->title,
                              .from = {b->levels[0], 0.35},
                              .to = {b->levels[levels - 1], 1.05},
                              .x_scale = GGN_LOG10,
                              .series = out->series,
                              .n = 2};
}

static int plot_curves(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                       struct base_err *err)
{
    enum { MOST = 48 };
    struct ggn_chart charts[MOST];
    struct curve *curves = malloc(MOST * sizeof *curves);
    int n = 0;
    if (!curves)
        return base_fail_nomem(err, dir);
    for (int c = 0; c < p->n_cells && n < MOST; c++)
        if (!isnan(t[c].t)) {
            charts[n] = curve_of(&curves[n], p, t, c);
            n++;
        }
    const int across = n < GGN_CHARTS_ACROSS ? n : GGN_CHARTS_ACROSS, down = (n + across - 1) / across;
    int rc = draw(dir, "curves.png", 250 * across, 240 * down, charts, n, err);
    free(curves);
    return rc;
}

/* Per view and pooled: the share of "same" of each condition with its interval. */
static int plot_shares(const char *dir, const struct ggn_study_people *p, struct base_err *err)
{
    const struct ggn_study *study = p->study;
    const int rows = study->n_views + 1;
    const char *names[GGN_STUDY_MAX_VIEWS + 1];
    struct ggn_series series[GGN_STUDY_MAX_CONDITIONS];
    double *numbers = malloc(4 * (size_t)(study->n_conditions * rows) * sizeof *numbers), *x = numbers;
    if (!numbers)
        return base_fail_nomem(err, dir);
    for (int v = 0; v < rows; v++)
        names[v] = v < study->n_views ? study->views[v].name : "(all)";
    for (int c = 0; c < study->n_conditions; c++, x += 4 * rows) {
        double *y = x + rows, *lo = y + rows, *hi = lo + rows;
        series[c] = (struct ggn_series){.title = study->conditions[c], .x = x, .y = y, .at = open, .lo = lo, .hi = hi};
        for (int v = 0; v < rows; v++) {
            struct ggn_study_share s = ggn_study_share(p, v < study->n_views ? v : -1, c);
            if (s.n == 0)
                continue;
            const size_t at = series[c].n++;
            x[at] = v + 0.6 * ((c + 0.5) / study->n_conditions - 0.5);
            y[at] = 100 * s.share;
            lo[at] = 100 * s.lo;
            hi[at] = 100 * s.hi;
        }
    }
    const struct ggn_chart chart = {.y_label = "judged the same, %",
                                    .from = {-0.6, 0},
                                    .to = {rows - 0.4, 100},
                                    .key = GGN_KEY_OUTSIDE,
                                    .point_size = 1,
                                    .series = series,
                                    .n = study->n_conditions,
                                    .x_names = names,
                                    .n_x_names = rows};
    int rc = draw(dir, "shares.png", 900, 420, &chart, 1, err);
    free(numbers);
    return rc;
}

int ggn_study_report_pictures(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                              struct base_err *err)
{
    int known = 0;
    for (int c = 0; c < p->n_cells; c++)
        known += !isnan(t[c].t);
    if (p->study->task == GGN_STUDY_VALIDATION)
        return plot_shares(dir, p, err);
    if (known == 0)
        return 0;
    int rc = plot_thresholds(dir, p, t, err);
    if (!rc)
        rc = plot_people(dir, p, t, err);
    if (!rc && p->study->task == GGN_STUDY_TWO_INTERVAL)
        rc = plot_curves(dir, p, t, err);
    return rc;
}
