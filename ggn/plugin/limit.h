/*
 * The visible error at which a criterion of the model observer stops a block: the parameter `error` says it, else the share
 * of viewers `visible`. Shares end where nearly everybody sees noise, at less than twice what is just seen; errors go on.
 */
#ifndef GGN_PLUGIN_LIMIT_H
#define GGN_PLUGIN_LIMIT_H

#include <math.h>
#include <lull/criterion_kit.h>

#include "observer/observer.h"

#define GP_PARAM_ERROR \
    LULL_KIT_FLOAT("error", NULL, 0.1, 100, \
                   "stop when the error is at most so many times what is just seen, instead of visible")

static inline double gp_stop_error(const struct lull_kit *kit, const struct ggn_observer *observer, int visible, int error)
{
    return isnan(kit->value[error]) ? ggn_observer_error_at(observer, kit->value[visible]) : kit->value[error];
}

#endif
