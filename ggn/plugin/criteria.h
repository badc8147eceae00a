/*
 * The criteria of ggn, and what they have in common: the life of an instance, its open frame, what a call has noted and the
 * state that is saved. entry_NAME.c lists the criteria of the library NAME.so.
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

/* What one is made of, static. Its struct lull_instance begins with a struct lull_kit and holds, as one struct, all that an
 * open frame needs: zero while none is open. */
struct gp_rule {
    struct lull_kit_rule kit;
    size_t size, frame_at, frame_size; /* of the instance, and where the frame is in it */
    /* The end of create. own: as GP_CRITERION has it; text: as lull_kit_create gives it. What it made before it failed is
     * released. */
    int32_t (*init)(struct lull_instance *in, const void *own, const char *const *text, struct lull_error *err);
    void (*release)(struct lull_instance *in); /* of what init has made; NULL: of nothing */
    /* Makes the struct of a checked frame, and ends with gp_frame_open. */
    int32_t (*begin_frame)(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err);
    void (*frame_release)(void *frame); /* also of one that is zero or half made */
    /* Answers a checked question; NULL: by judging each block. */
    int32_t (*answer)(const struct lull_kit_batch *batch, struct lull_error *err);
    /* What judge has noted of a block becomes its history: the whole call has succeeded. */
    void (*keep)(struct lull_instance *in, const struct lull_block *block);
    /* lull.state/1, with arguments that have been checked. */
    int32_t (*save)(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err);
    int32_t (*load)(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err);
};

/* Takes *fresh, which was made with this status, for the frame that was open, if any; a failure releases it instead. */
int32_t gp_frame_open(struct lull_instance *in, const struct lull_frame *frame, void *fresh, int32_t status);
/* Judges blocks of a question: those that `members` lists, or NULL: the first ones. */
int32_t gp_judge(const struct lull_kit_batch *batch, const uint32_t *members, uint32_t count, struct lull_error *err);

int32_t gp_create(const struct gp_rule *rule, const struct lull_criterion *table, const void *own,
                  const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                  struct lull_instance **instance, struct lull_error *err);
int32_t gp_begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err);
int32_t gp_evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                    uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                    struct lull_error *err);
void gp_end_frame(struct lull_instance *in);
void gp_destroy(struct lull_instance *in);
const void *gp_get_extension(const char *id);

/* The table of a criterion by this rule; `own` is for its init. The arguments are its remaining members: id, name, version,
 * description. The file has its parameters as params[P_COUNT]. */
#define GP_CRITERION(table, rule, own, ...) \
    static int32_t create_##table(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, \
                                  uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err) \
    { \
        return gp_create(rule, &table, own, host, pairs, pair_count, pair_stride, instance, err); \
    } \
    const struct lull_criterion table = {.struct_size = sizeof(struct lull_criterion), \
                                         .api_minor = LULL_API_MINOR, \
                                         .params = params, \
                                         .param_count = P_COUNT, \
                                         .param_stride = sizeof(struct lull_param), \
                                         .thread_level = LULL_THREADS_INSTANCE, \
                                         .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT, \
                                         .create = create_##table, \
                                         .requirements = lull_kit_requirements, \
                                         .begin_frame = gp_begin_frame, \
                                         .evaluate = gp_evaluate, \
                                         .end_frame = gp_end_frame, \
                                         .destroy = gp_destroy, \
                                         .get_extension = gp_get_extension, \
                                         __VA_ARGS__}

/* The library's one exported function, over the tables given. */
#define GP_ENTRY(...) \
    LULL_EXPORT const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) \
    { \
        static const struct lull_criterion *const criteria[] = {__VA_ARGS__}; \
        return index < sizeof criteria / sizeof criteria[0] ? criteria[index] : NULL; \
    }

#endif
