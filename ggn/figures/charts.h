/*
 * Pictures of numbers, drawn by gnuplot: the caller hands series, this folder alone writes gnuplot's language.
 *
 * PNG files, which appear under their name only when gnuplot succeeded; on failure nothing is left behind. BASE_EIO: no
 * gnuplot, or it refused.
 */
#ifndef GGN_FIGURES_CHARTS_H
#define GGN_FIGURES_CHARTS_H

#include <stddef.h>

#include "base/err.h"

struct ggn_series {             /* borrows */
    const char *title, *colour; /* title NULL: not in the key. "#rrggbb"; NULL: one of gnuplot's own */
    size_t n;
    const double *x, *y;   /* [n]; NaN: no point */
    double at;             /* a dashed vertical line there, in the series' colour; NaN: none */
    int apart;             /* no line joins the points */
    const double *lo, *hi; /* [n]; the ends of a vertical bar through each point, which stands apart; NULL: none */
    const double *sizes;   /* [n]; of points that stand apart; NULL: the chart's */
};

enum ggn_scale { GGN_LINEAR, GGN_LOG10, GGN_LOG2 };
enum ggn_key { GGN_KEY_TOP, GGN_KEY_BOTTOM, GGN_KEY_OUTSIDE };

struct ggn_chart {                         /* borrows */
    const char *title, *x_label, *y_label; /* NULL: none */
    double from[2], to[2];                 /* of x and y; NaN: as far as the series go */
    enum ggn_scale x_scale, y_scale;
    int square, diagonal; /* diagonal: a dashed line y = x */
    enum ggn_key key;
    double point_size; /* 0: lines without points */
    const struct ggn_series *series;
    int n;
    double level;               /* a dotted horizontal line, called level_title */
    const char *level_title;    /* NULL: none */
    const char *const *x_names; /* [n_x_names]; at x = 0, 1, …, in place of numbers; NULL: numbers */
    int n_x_names;
};

enum { GGN_CHARTS_ACROSS = 4 };
/* Charts side by side, in rows of GGN_CHARTS_ACROSS. No picture where no series has a point. */
int ggn_plot_charts(const char *path, int width, int height, const struct ggn_chart *charts, int n, struct base_err *err);

/* Predicted against true thresholds (spp), both logarithmic, with their regression. */
int ggn_plot_scatter(const char *path, const double *truth, const double *model, size_t n, const char *truth_name,
                     const char *model_name, struct base_err *err);
/* Histogram of log2(model / truth). */
int ggn_plot_errors(const char *path, const double *truth, const double *model, size_t n, const char *title,
                    struct base_err *err);

struct ggn_map_pair { /* thresholds (spp) of one view's blocks, row by row; NaN: none. Borrows */
    const char *name;
    int n, columns;
    const double *left, *right; /* [n] */
};
/* One small picture per view, one colour scale for all. At most 100 views. */
int ggn_plot_heatmaps(const char *path, const struct ggn_map_pair *views, int n, const char *left_name,
                      const char *right_name, struct base_err *err);

/* PNG files one under the other, each with its title, `height` pixels for each. */
int ggn_plot_strips(const char *path, const char *const *files, const char *const *titles, int n, int width, int height,
                    struct base_err *err);

#endif
