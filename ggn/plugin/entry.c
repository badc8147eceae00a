#include "plugin/criteria.h"

static const struct lull_criterion *const criteria[] = {
    &ggn_plugin_ggn, &ggn_plugin_observer, &ggn_plugin_svd_entropy, &ggn_plugin_attributes, &ggn_plugin_noise_mask,
};

LULL_EXPORT const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    return index < sizeof criteria / sizeof criteria[0] ? criteria[index] : NULL;
}
