/*
 * The parameters by which a criterion is told that its frame is one of a moving picture (observer/temporal.h). Without
 * `fps`, or with 0, it is a still.
 */
#ifndef GGN_PLUGIN_MOVING_H
#define GGN_PLUGIN_MOVING_H

#include <math.h>
#include <lull/criterion_kit.h>

#include "observer/temporal.h"

#define GP_PARAM_FPS \
    LULL_KIT_FLOAT("fps", NULL, 0, 240, "frames per second of the shot that the frame belongs to; without it, or 0, a still")
#define GP_PARAM_PPD LULL_KIT_FLOAT("ppd", NULL, 5, 500, "with fps: pixels per degree of the display (without it 67)")

static inline int gp_is_moving(const struct lull_kit *kit, int fps) { return kit->value[fps] > 0.0; }

static inline void gp_temporal_init(struct ggn_temporal *temporal, const struct lull_kit *kit, int fps, int ppd)
{
    const double usual = 67.0; /* 0.7 m from a screen 0.7 m wide with 3840 pixels, as in observer/flip.h */
    ggn_temporal_init(temporal, gp_is_moving(kit, fps) ? kit->value[fps] : 0.0,
                      isnan(kit->value[ppd]) ? usual : kit->value[ppd]);
}

#endif
