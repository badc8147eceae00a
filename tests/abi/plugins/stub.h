/*
 * A criterion that does nothing, for libraries that are wrong before any instance is made.
 */
#ifndef TESTS_ABI_PLUGINS_STUB_H
#define TESTS_ABI_PLUGINS_STUB_H

#include <lull/criterion.h>

static inline int32_t stub_create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                                  uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err)
{
    (void)host, (void)pairs, (void)pair_count, (void)pair_stride, (void)instance, (void)err;
    return LULL_E_UNSUPPORTED;
}

static inline int32_t stub_requirements(const struct lull_instance *in, struct lull_requirements *req,
                                        struct lull_error *err)
{
    (void)in, (void)req, (void)err;
    return LULL_E_UNSUPPORTED;
}

static inline int32_t stub_begin(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    (void)in, (void)frame, (void)err;
    return LULL_E_UNSUPPORTED;
}

static inline int32_t stub_evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                                    uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride,
                                    uint32_t count, struct lull_error *err)
{
    (void)in, (void)view, (void)blocks, (void)block_stride, (void)decisions, (void)decision_stride, (void)count, (void)err;
    return LULL_E_UNSUPPORTED;
}

static inline void stub_end(struct lull_instance *in) { (void)in; }

static inline const void *stub_extension(const char *id)
{
    (void)id;
    return NULL;
}

#define STUB(the_id) \
    { \
        .struct_size = sizeof(struct lull_criterion), .api_minor = LULL_API_MINOR, .id = the_id, .name = "stub", \
        .version = "1", .description = "does nothing", .create = stub_create, .requirements = stub_requirements, \
        .begin_frame = stub_begin, .evaluate = stub_evaluate, .end_frame = stub_end, .destroy = stub_end, \
        .get_extension = stub_extension \
    }

#endif
