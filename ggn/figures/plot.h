/*
 * A gnuplot script being written, data included, to plot->script; `end` runs gnuplot on it. Included in this folder alone.
 *
 * The script starts with the terminal (pngcairo), output and house style set. The picture appears under its name only when
 * gnuplot succeeded. One thread per plot.
 */
#ifndef GGN_FIGURES_PLOT_H
#define GGN_FIGURES_PLOT_H

#include <stdio.h>

#include "base/err.h"
#include "picture/colour_map.h"

struct ggn_plot {
    FILE *script; /* write here between begin and end */
    char path[4096], tmp_picture[4128], tmp_script[4160];
};

/* path ends in .png; width, height in pixels. On failure nothing is left behind. */
int ggn_plot_begin(struct ggn_plot *plot, const char *path, int width, int height, struct base_err *err);
/* Closes the script and, when run != 0, draws it. Removes the temporaries always. BASE_EIO: no gnuplot, or it refused. */
int ggn_plot_end(struct ggn_plot *plot, int run, struct base_err *err);

/* Writes text as a single-quoted gnuplot string without enhanced-text surprises (quotes doubled, underscores kept). */
void ggn_plot_quote(FILE *script, const char *text);
/* Sets the palette to a colour map. */
void ggn_plot_palette(FILE *script, enum pic_colour_map map);

#endif
