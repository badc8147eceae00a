#include "figures/charts.h"

#include <math.h>
#include <stdlib.h>

#include "figures/plot.h"
#include "figures/stats.h"

/* --- series ------------------------------------------------------------------------------------------------------------ */

static void put_text(FILE *f, const char *what, const char *text)
{
    if (!text)
        return;
    fprintf(f, "set %s ", what);
    ggn_plot_quote(f, text);
    putc('\n', f);
}

static void put_range(FILE *f, char axis, double from, double to)
{
    const double ends[2] = {from, to};
    fprintf(f, "set %crange [", axis);
    for (int i = 0; i < 2; i++) {
        fprintf(f, isnan(ends[i]) ? "*" : "%g", ends[i]);
        fputs(i ? "]\n" : ":", f);
    }
}

static void put_axes(FILE *f, const struct ggn_chart *c)
{
    static const char *const keys[] = {"top right", "bottom right", "outside right"};
    static const char *const bases[] = {[GGN_LOG10] = "", [GGN_LOG2] = " 2"};
    if (c->x_scale)
        fprintf(f, "set logscale x%s\n", bases[c->x_scale]);
    if (c->y_scale)
        fprintf(f, "set logscale y%s\n", bases[c->y_scale]);
    fputs(c->square ? "set size square\n" : "", f);
    put_range(f, 'x', c->from[0], c->to[0]);
    put_range(f, 'y', c->from[1], c->to[1]);
    for (int i = 0; i < c->n_x_names; i++) {
        fputs(i > 0 ? ", " : "set xtics (", f);
        ggn_plot_quote(f, c->x_names[i]);
        fprintf(f, i + 1 < c->n_x_names ? " %d" : " %d)\n", i);
    }
    fprintf(f, "set grid\nset key %s\n", keys[c->key]);
    put_text(f, "title", c->title);
    put_text(f, "xlabel", c->x_label);
    put_text(f, "ylabel", c->y_label);
}

static void put_data(FILE *f, const struct ggn_series *s, int k)
{
    fprintf(f, "$s%d << EOD\n", k);
    for (size_t i = 0; i < s->n; i++) {
        fprintf(f, "%.6g %.6g", s->x[i], s->y[i]);
        if (s->lo)
            fprintf(f, " %.6g %.6g", s->lo[i], s->hi[i]);
        else if (s->sizes)
            fprintf(f, " %.6g", s->sizes[i]);
        putc('\n', f);
    }
    fputs("EOD\n", f);
    if (!isnan(s->at))
        fprintf(f, "set arrow from %.6g, graph 0 to %.6g, graph 1 nohead dt 2 lc '%s'\n", s->at, s->at, s->colour);
}

static void put_series(FILE *f, const struct ggn_series *s, int k, double point_size)
{
    fprintf(f, "$s%d with ", k);
    if (s->lo)
        fprintf(f, "yerrorbars pt 7 ps %g", point_size);
    else if (s->sizes)
        fputs("points pt 6 ps variable", f);
    else if (s->apart)
        fprintf(f, "points pt 7 ps %g", point_size);
    else if (point_size > 0)
        fprintf(f, "linespoints pt 7 ps %g", point_size);
    else
        fputs("lines", f);
    if (s->colour)
        fprintf(f, " lc '%s'", s->colour);
    if (!s->apart && !s->lo && !s->sizes)
        fputs(" lw 2", f);
    fputs(s->title ? " title " : " notitle", f);
    if (s->title)
        ggn_plot_quote(f, s->title);
}

static void put_chart(FILE *f, const struct ggn_chart *c)
{
    for (int k = 0; k < c->n; k++)
        put_data(f, &c->series[k], k);
    put_axes(f, c);
    for (int k = 0; k < c->n; k++) {
        fputs(k > 0 ? ", " : "plot ", f);
        put_series(f, &c->series[k], k, c->point_size);
    }
    fputs(c->diagonal ? ", x dt 2 lc '#999999' notitle" : "", f);
    if (c->level_title) {
        fprintf(f, ", %.9g dt 3 lc '#444444' title ", c->level);
        ggn_plot_quote(f, c->level_title);
    }
    putc('\n', f);
}

int ggn_plot_charts(const char *path, int width, int height, const struct ggn_chart *charts, int n, struct base_err *err)
{
    struct ggn_plot plot;
    const int across = n < GGN_CHARTS_ACROSS ? n : GGN_CHARTS_ACROSS;
    int any = 0, rc = ggn_plot_begin(&plot, path, width, height, err);
    if (rc)
        return rc;
    if (n > 1)
        fprintf(plot.script, "set multiplot layout %d,%d\n", (n + across - 1) / across, across);
    for (int i = 0; i < n; i++) {
        put_chart(plot.script, &charts[i]);
        for (int k = 0; k < charts[i].n; k++)
            any |= charts[i].series[k].n > 0;
    }
    fputs(n > 1 ? "unset multiplot\n" : "", plot.script);
    return ggn_plot_end(&plot, any, err);
}

/* --- thresholds -------------------------------------------------------------------------------------------------------- */

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

int ggn_plot_heatmaps(const char *path, const struct ggn_map_pair *views, int n, const char *left_name,
                      const char *right_name, struct base_err *err)
{
    enum { MOST = 100 };
    struct ggn_plot plot;
    int shown = n < MOST ? n : MOST;
    int across = shown < 5 ? shown : 5, down = (shown + across - 1) / across;
    int labels = shown <= 6, cell = shown == 1 ? 900 : 360;
    int rc = ggn_plot_begin(&plot, path, across * cell + 60, down * (cell * 6 / 10) + 60, err);
    if (rc)
        return rc;
    FILE *s = plot.script;
    double lo = INFINITY, hi = 0.0;
    for (int v = 0; v < n; v++)
        for (int i = 0; i < views[v].n; i++)
            if (!isnan(views[v].left[i]) && !isnan(views[v].right[i])) {
                lo = fmin(lo, fmin(views[v].left[i], views[v].right[i]));
                hi = fmax(hi, fmax(views[v].left[i], views[v].right[i]));
            }
    ggn_plot_palette(s, PIC_VIRIDIS);
    fprintf(s,
            "set logscale cb\nset cbrange [%g:%g]\nunset grid\nunset tics\nunset border\nset cbtics\n"
            "set multiplot layout %d,%d title ",
            lo, hi > lo ? hi : 2.0 * lo, down, across);
    char title[256];
    snprintf(title, sizeof title, "threshold (spp) per block: left %.90s, right %.90s", left_name, right_name);
    ggn_plot_quote(s, title);
    fputc('\n', s);
    for (int v = 0; v < shown; v++) {
        const struct ggn_map_pair *pair = &views[v];
        int columns = pair->columns, rows = (pair->n + columns - 1) / columns;
        for (int side = 0; side < 2; side++) {
            const double *spp = side == 0 ? pair->left : pair->right;
            fprintf(s, "$v%d_%d << EOD\n", v, side);
            for (int b = 0; b < pair->n; b++)
                if (!isnan(spp[b]))
                    fprintf(s, "%d %d %.0f\n", side * (columns + 1) + b % columns, b / columns, spp[b]);
            fputs("EOD\n", s);
        }
        fputs("set title ", s);
        ggn_plot_quote(s, pair->name);
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

/* --- pictures ---------------------------------------------------------------------------------------------------------- */

int ggn_plot_strips(const char *path, const char *const *files, const char *const *titles, int n, int width, int height,
                    struct base_err *err)
{
    struct ggn_plot plot;
    int rc = ggn_plot_begin(&plot, path, width, height * n + 20, err);
    if (rc)
        return rc;
    fprintf(plot.script, "unset tics\nunset border\nset size ratio -1\nset yrange [] reverse\nset multiplot layout %d,1\n",
            n);
    for (int i = 0; i < n; i++) {
        put_text(plot.script, "title", titles[i]);
        fputs("plot ", plot.script);
        ggn_plot_quote(plot.script, files[i]);
        fputs(" binary filetype=png with rgbimage notitle\n", plot.script);
    }
    fputs("unset multiplot\n", plot.script);
    return ggn_plot_end(&plot, 1, err);
}
