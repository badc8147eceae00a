/*
 * The criteria of ggn, and what their tables have in common. entry_NAME.c lists those of the library NAME.so.
 *
 * To add one: declare its table here and append it to the list of a library (an index, once released, keeps its criterion),
 * or begin a library of its own where it needs others than those there do.
 */
#ifndef GGN_PLUGIN_CRITERIA_H
#define GGN_PLUGIN_CRITERIA_H

#include <lull/criterion_kit.h>

extern const struct lull_criterion ggn_plugin_ggn;         /* id "ggn" */
extern const struct lull_criterion ggn_plugin_observer;    /* id "observer" */
extern const struct lull_criterion ggn_plugin_denoised;    /* id "denoised" */
extern const struct lull_criterion ggn_plugin_svd_entropy; /* id "svd-entropy" */
extern const struct lull_criterion ggn_plugin_attributes;  /* id "attributes" */
extern const struct lull_criterion ggn_plugin_noise_mask;  /* id "noise-mask" */

/* A table; the arguments are its remaining members: id, name, version, description and the functions. The file
 * has its parameters as params[P_COUNT]. */
#define GP_TABLE(...) \
    { \
        .struct_size = sizeof(struct lull_criterion), .api_minor = LULL_API_MINOR, .params = params, \
        .param_count = P_COUNT, .param_stride = sizeof(struct lull_param), .thread_level = LULL_THREADS_INSTANCE, \
        .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT, .requirements = lull_kit_requirements, \
        __VA_ARGS__ \
    }

/* The library's one exported function, over the tables given. */
#define GP_ENTRY(...) \
    LULL_EXPORT const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) \
    { \
        static const struct lull_criterion *const criteria[] = {__VA_ARGS__}; \
        return index < sizeof criteria / sizeof criteria[0] ? criteria[index] : NULL; \
    }

#endif
