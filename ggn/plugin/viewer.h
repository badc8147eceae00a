/*
 * For whom a criterion of the model observer works: the parameters that say when nobody is disturbed any more, and how the
 * frame is looked at (sight/viewing.h). Shares of viewers end where nearly everybody sees noise, at less than twice what
 * is just seen; errors go on.
 */
#ifndef GGN_PLUGIN_VIEWER_H
#define GGN_PLUGIN_VIEWER_H

#include <math.h>
#include <lull/criterion_kit.h>

#include "sight/observer.h"
#include "sight/viewing.h"

#define GP_PARAM_ERROR \
    LULL_KIT_FLOAT("error", NULL, 0.1, 100, \
                   "stop when the error is at most so many times what is just seen, instead of visible")
#define GP_PARAM_FPS \
    LULL_KIT_FLOAT("fps", NULL, 0, 240, "frames per second of the shot that the frame belongs to; without it, or 0, a still")
#define GP_PARAM_PPD \
    LULL_KIT_FLOAT("ppd", NULL, 5, 500, "pixels per degree of the display, as far away as it is looked at (without it 67)")

struct gp_viewer {
    double stop_error;                 /* at which a block stops: `error` says it, else `visible` */
    const struct ggn_viewing *viewing; /* NULL: a still, seen as the observer takes for granted */
    struct ggn_viewing own;
};

/* From the values of the parameters with these indices; *viewer does not move from here on. */
static inline void gp_viewer_init(struct gp_viewer *viewer, const double *value, int visible, int error, int fps, int ppd)
{
    const int moves = value[fps] > 0, is_placed = !isnan(value[ppd]);

    viewer->stop_error = isnan(value[error]) ? ggn_observer_error_at(&ggn_observer_default, value[visible]) : value[error];
    ggn_viewing_init(&viewer->own, moves ? value[fps] : 0, is_placed ? value[ppd] : GGN_VIEWING_PPD);
    viewer->viewing = moves || is_placed ? &viewer->own : NULL;
}

#endif
