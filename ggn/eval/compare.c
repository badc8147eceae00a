#include "eval/compare.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/files.h"
#include "figures/plot.h"

void ggn_pairing_release(struct ggn_pairing *p)
{
    free(p->views);
    free(p->truth);
    free(p->model);
    *p = (struct ggn_pairing){0};
}

/* The model's view that goes with truth->views[i], or NULL. */
static const struct ggn_view *partner(const struct ggn_thresholds *truth, int i, const struct ggn_thresholds *model,
                                      const char *view)
{
    const struct ggn_view *t = &truth->views[i];
    if (view && model->n == 1)
        return strcmp(t->name, view) == 0 ? &model->views[0] : NULL;
    if (view && strcmp(t->name, view) != 0)
        return NULL;
    if (truth->n == 1 && model->n == 1 && (t->unnamed || model->views[0].unnamed))
        return &model->views[0];
    return ggn_thresholds_find(model, t->name);
}

int ggn_pairing_init(struct ggn_pairing *out, const struct ggn_thresholds *truth, const struct ggn_thresholds *model,
                     const char *view, struct base_err *err)
{
    struct ggn_pairing p = {0};
    size_t room = 0;
    int rc = 0;
    for (int i = 0; i < truth->n; i++)
        room += (size_t)truth->views[i].n;
    p.views = malloc((size_t)(truth->n > 0 ? truth->n : 1) * sizeof *p.views);
    p.truth = malloc((room > 0 ? room : 1) * sizeof *p.truth);
    p.model = malloc((room > 0 ? room : 1) * sizeof *p.model);
    if (!p.views || !p.truth || !p.model) {
        rc = base_fail_nomem(err, "pairs");
        goto out;
    }
    for (int i = 0; i < truth->n; i++) {
        const struct ggn_view *t = &truth->views[i], *m = partner(truth, i, model, view);
        if (!m)
            continue;
        if (m->n != t->n) {
            rc = base_fail(err, BASE_EINVAL, "view '%s': %d blocks against %d", t->name, t->n, m->n);
            goto out;
        }
        p.views[p.n_views++] = (struct ggn_pair){t, m, p.n};
        for (int b = 0; b < t->n; b++)
            if (!isnan(t->spp[b]) && !isnan(m->spp[b])) {
                p.truth[p.n] = t->spp[b];
                p.model[p.n++] = m->spp[b];
            }
    }
    if (p.n == 0)
        rc = base_fail(err, BASE_EINVAL,
                       view ? "no view called '%s' to compare" : "no view has the same name on both sides%s",
                       view ? view : " (--view NAME names the partner of a single view)");
out:
    if (rc) {
        ggn_pairing_release(&p);
        return rc;
    }
    *out = p;
    return 0;
}

/* The figures in the order they are shown. */
#define FIGURES(X) \
    X(pearson_r, "%.4f", "Pearson r") \
    X(pearson_r_below_cap, "%.4f", "Pearson r, true below cap") \
    X(spearman, "%.4f", "Spearman rho") \
    X(spearman_below_cap, "%.4f", "Spearman rho, true below cap") \
    X(mae, "%.1f", "mean absolute error (spp)") \
    X(mae_below_cap, "%.1f", "  true below cap") \
    X(rmse, "%.1f", "RMSE (spp)") \
    X(share_below, "%.4f", "share below the true threshold") \
    X(early_stop_rate, "%.4f", "share below 0.8 x true (early stops)") \
    X(samples_ratio, "%.4f", "samples / samples at the true thresholds") \
    X(median_abs_log2, "%.4f", "median |log2(model/true)|") \
    X(median_log2, "%.4f", "median log2(model/true)") \
    X(iqr_log2, "%.4f", "inter-quartile range of log2") \
    X(within_half, "%.4f", "share within 1/2 octave") \
    X(within_one, "%.4f", "share within 1 octave")

void ggn_agreement_print_table(FILE *f, const struct ggn_agreement *a)
{
    fprintf(f, "%-42s %10zu\n%-42s %10zu\n", "blocks", a->blocks, "  true below cap", a->below_cap);
#define ROW(key, format, text) \
    do { \
        char value[32]; \
        snprintf(value, sizeof value, format, a->key + 1e-12); /* an exact half (284 of 640) rounds up */ \
        fprintf(f, "%-42s %10s\n", text, isnan(a->key) ? "-" : value); \
    } while (0);
    FIGURES(ROW)
#undef ROW
}

void ggn_agreement_print_json(FILE *f, const struct ggn_agreement *a)
{
    fprintf(f, "{\"blocks\": %zu, \"blocks_below_cap\": %zu", a->blocks, a->below_cap);
#define MEMBER(key, format, text) \
    if (isnan(a->key)) \
        fputs(", \"" #key "\": null", f); \
    else \
        fprintf(f, ", \"" #key "\": %.6f", a->key);
    FIGURES(MEMBER)
#undef MEMBER
    fputs("}", f);
}

int ggn_plot_scatter(const char *path, const double *truth, const double *model, size_t n, const char *truth_name,
                     const char *model_name, struct base_err *err)
{
    struct ggn_plot plot;
    double *logs = malloc(2 * n * sizeof *logs), a, b;
    if (!logs)
        return base_fail_nomem(err, path);
    for (size_t i = 0; i < n; i++) {
        logs[i] = log2(truth[i]);
        logs[n + i] = log2(model[i]);
    }
    ggn_stats_line(logs, logs + n, n, &a, &b);
    double r = ggn_stats_pearson(logs, logs + n, n);
    free(logs);
    int rc = ggn_plot_begin(&plot, path, 760, 720, err);
    if (rc)
        return rc;
    FILE *s = plot.script;
    fputs("set logscale xy 2\nset size square\nset key top left\nset xlabel ", s);
    ggn_plot_quote(s, truth_name);
    fputs(" . ' (spp)'\nset ylabel ", s);
    ggn_plot_quote(s, model_name);
    fputs(" . ' (spp)'\n$d << EOD\n", s);
    for (size_t i = 0; i < n; i++)
        fprintf(s, "%.6g %.6g\n", truth[i], model[i]);
    fputs("EOD\nstats $d using (log($1)/log(2)) nooutput name 'X'\nstats $d using (log($2)/log(2)) nooutput name 'Y'\n"
          "lo=2**(floor((X_min<Y_min?X_min:Y_min)*4)/4.0-0.05)\nhi=2**(ceil((X_max>Y_max?X_max:Y_max)*4)/4.0+0.05)\n"
          "set xrange [lo:hi]\n"
          "set yrange [lo:hi]\nset xtics (20,50,100,200,500,1000,2000,5000,10000,20000,50000,100000)\n"
          "set ytics (20,50,100,200,500,1000,2000,5000,10000,20000,50000,100000)\n"
          "plot x lc '#444444' lw 1 title 'equal', 2*x dt 2 lc '#999999' title 'one octave', x/2 dt 2 lc '#999999' notitle",
          s);
    if (!isnan(b))
        fprintf(s, ", 2**(%.9g + %.9g*log(x)/log(2)) lc '#d95f02' lw 2 title 'regression in log2, r = %.3f'", a, b, r);
    fputs(", $d with points pt 7 ps 0.6 lc '#801f77b4' title 'blocks'\n", s);
    return ggn_plot_end(&plot, 1, err);
}

int ggn_plot_errors(const char *path, const double *truth, const double *model, size_t n, const char *title,
                    struct base_err *err)
{
    struct ggn_plot plot;
    int rc = ggn_plot_begin(&plot, path, 760, 480, err);
    if (rc)
        return rc;
    FILE *s = plot.script;
    fputs("set title ", s);
    ggn_plot_quote(s, title);
    fputs("\nset xlabel 'log2(predicted / true): left of 0 stops early, right of 0 wastes samples'\nset ylabel 'blocks'\n"
          "bin(x)=floor(x*4+0.5)/4.0\nset boxwidth 0.23\nset style fill solid 0.8 noborder\n"
          "set xrange [-4.1:4.1]\nset yrange [0:*]\n"
          "set arrow 1 from 0, graph 0 to 0, graph 1 nohead lc '#444444' dt 2\n"
          "set arrow 2 from -0.3219, graph 0 to -0.3219, graph 1 nohead lc '#d62728'\n"
          "set label 1 'early stop' at -0.36, graph 0.96 right tc '#d62728'\n$d << EOD\n",
          s);
    for (size_t i = 0; i < n; i++) {
        double e = log2(model[i] / truth[i]);
        fprintf(s, "%.6g\n", e < -4.0 ? -4.0 : e > 4.0 ? 4.0 : e);
    }
    fputs("EOD\nplot $d using (bin($1)):(1) smooth frequency with boxes lc '#1f77b4' notitle\n", s);
    return ggn_plot_end(&plot, 1, err);
}

static int columns_of(const struct ggn_pair *p)
{
    int c = p->truth->columns > 0 ? p->truth->columns : p->model->columns;
    return c > 0 ? c : (int)lround(ceil(sqrt((double)p->truth->n)));
}

int ggn_plot_heatmaps(const char *path, const struct ggn_pairing *p, const char *truth_name, const char *model_name,
                      struct base_err *err)
{
    enum { MOST = 100 };
    struct ggn_plot plot;
    int shown = p->n_views < MOST ? p->n_views : MOST;
    int across = shown < 5 ? shown : 5, down = (shown + across - 1) / across;
    int labels = shown <= 6, cell = shown == 1 ? 900 : 360;
    int rc = ggn_plot_begin(&plot, path, across * cell + 60, down * (cell * 6 / 10) + 60, err);
    if (rc)
        return rc;
    FILE *s = plot.script;
    double lo = INFINITY, hi = 0.0;
    for (size_t i = 0; i < p->n; i++) {
        lo = fmin(lo, fmin(p->truth[i], p->model[i]));
        hi = fmax(hi, fmax(p->truth[i], p->model[i]));
    }
    ggn_plot_palette(s, PIC_VIRIDIS);
    fprintf(s,
            "set logscale cb\nset cbrange [%g:%g]\nunset grid\nunset tics\nunset border\nset cbtics\n"
            "set multiplot layout %d,%d title ",
            lo, hi > lo ? hi : 2.0 * lo, down, across);
    char title[256];
    snprintf(title, sizeof title, "threshold (spp) per block: left %.90s, right %.90s", truth_name, model_name);
    ggn_plot_quote(s, title);
    fputc('\n', s);
    for (int v = 0; v < shown; v++) {
        const struct ggn_pair *pair = &p->views[v];
        int columns = columns_of(pair), rows = (pair->truth->n + columns - 1) / columns;
        for (int side = 0; side < 2; side++) {
            const double *spp = side == 0 ? pair->truth->spp : pair->model->spp;
            fprintf(s, "$v%d_%d << EOD\n", v, side);
            for (int b = 0; b < pair->truth->n; b++)
                if (!isnan(spp[b]))
                    fprintf(s, "%d %d %.0f\n", side * (columns + 1) + b % columns, b / columns, spp[b]);
            fputs("EOD\n", s);
        }
        fputs("set title ", s);
        ggn_plot_quote(s, pair->truth->name);
        fprintf(s, "\nset xrange [-0.5:%d.5]\nset yrange [%d.5:-0.5]\nset size ratio %g\n%splot ", 2 * columns, rows - 1,
                (double)rows / (2 * columns + 1), shown > 1 ? "unset colorbox\n" : "");
        for (int side = 0; side < 2; side++)
            fprintf(s,
                    "%s$v%d_%d using 1:2:($1-0.5):($1+0.5):($2-0.5):($2+0.5):3 with boxxyerror fs solid noborder lc palette "
                    "notitle",
                    side > 0 ? ", " : "", v, side);
        for (int side = 0; side < 2 && labels && columns <= 16; side++)
            fprintf(s, ", $v%d_%d using 1:2:(sprintf('%%d',int($3))) with labels font ',%d' tc '#ffffff' notitle", v, side,
                    shown == 1 ? 10 : 7);
        fputc('\n', s);
    }
    fputs("unset multiplot\n", s);
    return ggn_plot_end(&plot, 1, err);
}

static int write_blocks(const char *path, const struct ggn_pairing *p, struct base_err *err)
{
    struct base_file_out out;
    int rc = base_file_begin(&out, path, err);
    if (rc)
        return rc;
    fputs("view;block;true_spp;model_spp;log2_error\n", out.file);
    for (int v = 0; v < p->n_views; v++) {
        const struct ggn_view *t = p->views[v].truth, *m = p->views[v].model;
        for (int b = 0; b < t->n; b++)
            if (!isnan(t->spp[b]) && !isnan(m->spp[b]))
                fprintf(out.file, "%s;%d;%.10g;%.10g;%.4f\n", t->name, b, t->spp[b], m->spp[b], log2(m->spp[b] / t->spp[b]));
    }
    return base_file_commit(&out, err);
}

int ggn_compare_pictures(const char *dir, const struct ggn_pairing *p, const char *truth_name, const char *model_name,
                         struct base_err *err)
{
    char path[4096];
    int n = snprintf(path, sizeof path, "%s/blocks.csv", dir);
    if (n < 0 || (size_t)n + 16 >= sizeof path)
        return base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", dir);
    int rc = write_blocks(path, p, err);
    snprintf(path, sizeof path, "%s/scatter.png", dir);
    if (!rc)
        rc = ggn_plot_scatter(path, p->truth, p->model, p->n, truth_name, model_name, err);
    snprintf(path, sizeof path, "%s/errors.png", dir);
    if (!rc)
        rc = ggn_plot_errors(path, p->truth, p->model, p->n, model_name, err);
    snprintf(path, sizeof path, "%s/heatmaps.png", dir);
    if (!rc)
        rc = ggn_plot_heatmaps(path, p, truth_name, model_name, err);
    return rc;
}
