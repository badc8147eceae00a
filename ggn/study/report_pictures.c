#include <math.h>

#include "base/files.h"
#include "figures/plot.h"
#include "study/report.h"

enum { MAX_CURVES = 12, WIDTH = 900 };

static int open_plot(struct ggn_plot *plot, const char *dir, const char *name, int width, int height, struct base_err *err)
{
    char path[4096];
    int rc = base_file_join(path, dir, name, err);
    return rc ? rc : ggn_plot_begin(plot, path, width, height, err);
}

/* Thresholds of all blocks, sorted, with their intervals. */
static int plot_thresholds(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                           struct base_err *err)
{
    struct ggn_plot plot;
    int rc = open_plot(&plot, dir, "thresholds.png", WIDTH, 420, err);
    if (rc)
        return rc;
    fputs("set logscale y 2\nset ylabel 'samples per pixel'\nset xlabel 'block, view after view'\nset grid ytics\nset key "
          "off\n"
          "set style fill solid\nset xrange [-0.5:*]\nplot '-' using 1:2:3:4 with yerrorbars lc '#3b6ea5' pt 7 ps 0.8\n",
          plot.script);
    for (int c = 0; c < p->n_cells; c++)
        if (!isnan(t[c].t))
            fprintf(plot.script, "%d %g %g %g\n", c, exp2(t[c].t), exp2(isnan(t[c].lo) ? t[c].t : t[c].lo),
                    exp2(isnan(t[c].hi) ? t[c].t : t[c].hi));
    fputs("e\n", plot.script);
    return ggn_plot_end(&plot, 1, err);
}

/* Whether a person counts and has an estimate. */
static int is_shown(const struct ggn_study_people *p, int person)
{
    const struct ggn_study_result *r = &p->results[person];
    for (int c = 0; c < p->n_cells && r->excluded[0] == '\0'; c++)
        if (r->cells[c].trials > 0)
            return 1;
    return 0;
}

/* Each person's thresholds against the mean of all. */
static int plot_people(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                       struct base_err *err)
{
    struct ggn_plot plot;
    int rc = open_plot(&plot, dir, "people.png", 560, 560, err);
    if (rc)
        return rc;
    fputs("set logscale xy 2\nset size square\nset xlabel 'mean over people, samples per pixel'\nset ylabel 'one person, "
          "samples per pixel'\n"
          "set grid\nset key off\nplot x with lines lc '#888888'",
          plot.script);
    for (int i = 0; i < p->n; i++)
        if (is_shown(p, i))
            fputs(", '-' using 1:2 with points pt 7 ps 0.6", plot.script);
    putc('\n', plot.script);
    for (int i = 0; i < p->n; i++) {
        if (!is_shown(p, i))
            continue;
        for (int c = 0; c < p->n_cells; c++)
            if (p->results[i].cells[c].trials > 0)
                fprintf(plot.script, "%g %g\n", exp2(t[c].t),
                        exp2(fmin(p->results[i].cells[c].t, ggn_study_cell_cap(p, c))));
        fputs("e\n", plot.script);
    }
    return ggn_plot_end(&plot, 1, err);
}

/* One block: shares of correct answers of all people that count, and the curve at their mean threshold and spread. */
static void plot_curve(FILE *f, const struct ggn_study_people *p, const struct ggn_study_threshold *t, int cell)
{
    int view;
    const struct ggn_study_block *b = ggn_study_cell_block(p, cell, &view);
    char title[GGN_STUDY_NAME + 48];
    snprintf(title, sizeof title, "%s, block %u: %.0f", p->study->views[view].name, b->id, exp2(t[cell].t));
    fputs("set title ", f);
    ggn_plot_quote(f, title);
    fprintf(f,
            "\nplot [%u:%u] '-' using 1:2:3 with points pt 6 ps variable lc '#3b6ea5', '-' using 1:2 with lines lw 2 lc "
            "'#c0504d'\n",
            b->levels[0], b->levels[b->n_levels - 1]);
    for (int l = 0; l < b->n_levels; l++) {
        int n = 0, correct = 0;
        for (int i = 0; i < p->n; i++)
            for (int k = 0; k < p->results[i].n_choices && p->results[i].excluded[0] == '\0'; k++)
                if (p->results[i].choice_cells[k] == cell && p->results[i].choices[k].x == log2(b->levels[l])) {
                    n++;
                    correct += p->results[i].choices[k].correct;
                }
        if (n > 0)
            fprintf(f, "%u %g %g\n", b->levels[l], (double)correct / n, 0.5 + 0.35 * sqrt(n));
    }
    fputs("e\n", f);
    for (int l = 0; l < b->n_levels; l++)
        fprintf(f, "%u %g\n", b->levels[l], ggn_study_p_correct(log2(b->levels[l]), t[cell].t, t[cell].spread));
    fputs("e\n", f);
}

static int plot_curves(const char *dir, const struct ggn_study_people *p, const struct ggn_study_threshold *t,
                       struct base_err *err)
{
    struct ggn_plot plot;
    int shown = 0, rc = open_plot(&plot, dir, "curves.png", 1000, 720, err);
    if (rc)
        return rc;
    fputs("set multiplot layout 3,4\nset logscale x 2\nset yrange [0.35:1.05]\nset key off\nset grid\nset xtics rotate by "
          "45 right\n",
          plot.script);
    for (int c = 0; c < p->n_cells && shown < MAX_CURVES; c++)
        if (!isnan(t[c].t)) {
            plot_curve(plot.script, p, t, c);
            shown++;
        }
    fputs("unset multiplot\n", plot.script);
    return ggn_plot_end(&plot, 1, err);
}

/* Per view and pooled: the share of "same" of each condition with its interval. */
static int plot_shares(const char *dir, const struct ggn_study_people *p, struct base_err *err)
{
    struct ggn_plot plot;
    int rows = p->study->n_views + 1, rc = open_plot(&plot, dir, "shares.png", WIDTH, 420, err);
    if (rc)
        return rc;
    fputs("set yrange [0:100]\nset ylabel 'judged the same, %'\nset grid ytics\nset key outside top horizontal\nset xtics (",
          plot.script);
    for (int v = 0; v < rows; v++) {
        fputs(v > 0 ? ", " : "", plot.script);
        ggn_plot_quote(plot.script, v < p->study->n_views ? p->study->views[v].name : "(all)");
        fprintf(plot.script, " %d", v);
    }
    fprintf(plot.script, ")\nset xrange [-0.6:%g]\nplot ", rows - 0.4);
    for (int c = 0; c < p->study->n_conditions; c++) {
        fprintf(plot.script, "%s'-' using 1:2:3:4 with yerrorbars pt 7 lw 1.5 title ", c > 0 ? ", " : "");
        ggn_plot_quote(plot.script, p->study->conditions[c]);
    }
    putc('\n', plot.script);
    for (int c = 0; c < p->study->n_conditions; c++) {
        for (int v = 0; v < rows; v++) {
            struct ggn_study_share s = ggn_study_share(p, v < p->study->n_views ? v : -1, c);
            if (s.n > 0)
                fprintf(plot.script, "%g %g %g %g\n", v + 0.6 * ((c + 0.5) / p->study->n_conditions - 0.5), 100 * s.share,
                        100 * s.lo, 100 * s.hi);
        }
        fputs("e\n", plot.script);
    }
    return ggn_plot_end(&plot, 1, err);
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
