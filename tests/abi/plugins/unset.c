/*
 * Criteria of somebody else: parameters without a default, and ones that share a name with a quality parameter and nothing more. Both
 * stop when an error that falls with the samples is small.
 *
 *     unset   error, visible, threshold: numbers that nobody has set
 *     odd     error: a text, visible: a choice, threshold: a whole number
 */
#include <lull/criterion_kit.h>

enum { ERROR, VISIBLE, THRESHOLD, COUNT };

static const struct lull_param unset_params[COUNT] = {
    [ERROR] = LULL_KIT_FLOAT("error", NULL, 0, 100, "stop at this error"),
    [VISIBLE] = LULL_KIT_FLOAT("visible", NULL, 0, 1, "stop at this share"),
    [THRESHOLD] = LULL_KIT_FLOAT("threshold", NULL, 0, 100, "stop at this threshold"),
};
static const struct lull_param odd_params[COUNT] = {
    [ERROR] = {.name = "error", .help = "a text", .type = LULL_PARAM_TEXT},
    [VISIBLE] = {.name = "visible", .help = "a choice", .choices = "low|high", .type = LULL_PARAM_CHOICE},
    [THRESHOLD] = {.name = "threshold", .help = "a whole number", .type = LULL_PARAM_INT, .min = 1, .max = 100},
};

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *block,
                  struct lull_decision *decision, uint32_t worker)
{
    const struct lull_kit_tally tally = {.valid = 1};
    (void)view, (void)worker;
    lull_kit_verdict(lull_kit_of(in), block, &tally, 2 / sqrt((double)block->spp), 0.5, 0, 1.5, decision);
}

static const struct lull_kit_rule rule = {.judge = judge};

static const struct lull_criterion tables[2];

static int32_t create_of(const struct lull_criterion *table, const struct lull_host *host, const struct lull_pair *pairs,
                         uint32_t count, uint32_t stride, struct lull_instance **instance, struct lull_error *err)
{
    return lull_kit_create(&rule, table, sizeof(struct lull_kit), host, pairs, count, stride, NULL, instance, err);
}

static int32_t create_unset(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                            struct lull_instance **instance, struct lull_error *err)
{
    return create_of(&tables[0], host, pairs, count, stride, instance, err);
}

static int32_t create_odd(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                          struct lull_instance **instance, struct lull_error *err)
{
    return create_of(&tables[1], host, pairs, count, stride, instance, err);
}

#define TABLE(the_id, the_params, the_create) \
    { \
        .struct_size = sizeof(struct lull_criterion), .api_minor = LULL_API_MINOR, .id = the_id, .name = "somebody else's", \
        .version = "1", .description = "stops when its error is small", .params = the_params, .param_count = COUNT, \
        .param_stride = sizeof(struct lull_param), .thread_level = LULL_THREADS_FULL, \
        .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT, .create = the_create, \
        .requirements = lull_kit_requirements, .begin_frame = lull_kit_begin_frame, .evaluate = lull_kit_evaluate, \
        .end_frame = lull_kit_end_frame, .destroy = lull_kit_destroy, .get_extension = lull_kit_get_extension \
    }

static const struct lull_criterion tables[2] = {TABLE("unset", unset_params, create_unset),
                                                TABLE("odd", odd_params, create_odd)};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index < 2 ? &tables[index] : NULL; }
