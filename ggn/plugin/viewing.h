/*
 * The parameters by which a criterion is told how its frame is viewed (observer/viewing.h). Without them it is a still,
 * seen as the observer takes for granted.
 */
#ifndef GGN_PLUGIN_VIEWING_H
#define GGN_PLUGIN_VIEWING_H

#include <math.h>
#include <lull/criterion_kit.h>

#include "observer/viewing.h"

#define GP_PARAM_FPS \
    LULL_KIT_FLOAT("fps", NULL, 0, 240, "frames per second of the shot that the frame belongs to; without it, or 0, a still")
#define GP_PARAM_PPD \
    LULL_KIT_FLOAT("ppd", NULL, 5, 500, "pixels per degree of the display, as far away as it is looked at (without it 67)")

/* Whether anything is other than the observer takes for granted. */
static inline int gp_is_viewed(const struct lull_kit *kit, int fps, int ppd)
{
    return kit->value[fps] > 0.0 || !isnan(kit->value[ppd]);
}

static inline void gp_viewing_init(struct ggn_viewing *viewing, const struct lull_kit *kit, int fps, int ppd)
{
    ggn_viewing_init(viewing, kit->value[fps] > 0.0 ? kit->value[fps] : 0.0,
                     isnan(kit->value[ppd]) ? GGN_VIEWING_PPD : kit->value[ppd]);
}

#endif
