/*
 * The criteria of ggn.so, in the order of lull_criterion_entry_v1's index, and what their tables have in common.
 *
 * To add one: declare its table here and append it to the list in entry.c (an index, once released, keeps its criterion).
 */
#ifndef GGN_PLUGIN_CRITERIA_H
#define GGN_PLUGIN_CRITERIA_H

#include <lull/criterion_kit.h>

extern const struct lull_criterion ggn_plugin_ggn;         /* id "ggn" */
extern const struct lull_criterion ggn_plugin_observer;    /* id "observer" */
extern const struct lull_criterion ggn_plugin_svd_entropy; /* id "svd-entropy" */
extern const struct lull_criterion ggn_plugin_attributes;  /* id "attributes" */
extern const struct lull_criterion ggn_plugin_noise_mask;  /* id "noise-mask" */

/* A table; the arguments are its remaining members: id, name, description and the functions. The file has its parameters as
 * params[P_COUNT]. */
#define GP_TABLE(...) \
    {.struct_size = sizeof(struct lull_criterion), .api_minor = LULL_API_MINOR, .version = "1.0", .params = params, \
     .param_count = P_COUNT, .param_stride = sizeof(struct lull_param), .thread_level = LULL_THREADS_INSTANCE, \
     .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT, .requirements = lull_kit_requirements, \
     __VA_ARGS__}

#endif
