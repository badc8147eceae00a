/*
 * A criterion that never returns from what LULL_HANG names: load, entry, create, begin or evaluate. Before that it makes the
 * file LULL_HANG_SIGN, so that who waits for it need not guess.
 */
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "stub.h"

static void hang_in(const char *where)
{
    const char *chosen = getenv("LULL_HANG"), *sign = getenv("LULL_HANG_SIGN");
    if (!chosen || strcmp(chosen, where) != 0)
        return;
    if (sign)
        close(open(sign, O_WRONLY | O_CREAT, 0666));
    for (;;)
        pause();
}

__attribute__((constructor)) static void load(void) { hang_in("load"); }

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err)
{
    static char one;
    (void)host, (void)pairs, (void)pair_count, (void)pair_stride, (void)err;
    hang_in("create");
    *instance = (struct lull_instance *)(void *)&one;
    return LULL_OK;
}

static int32_t requirements(const struct lull_instance *in, struct lull_requirements *req, struct lull_error *err)
{
    (void)in, (void)err;
    *req = (struct lull_requirements){.struct_size = req->struct_size, .flags = LULL_REQ_FLEXIBLE, .first_spp = 1};
    return LULL_OK;
}

static int32_t begin(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    (void)in, (void)frame, (void)err;
    hang_in("begin");
    return LULL_OK;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    (void)in, (void)view, (void)blocks, (void)block_stride, (void)decisions, (void)decision_stride, (void)count, (void)err;
    hang_in("evaluate");
    return LULL_OK;
}

static const struct lull_criterion criterion = {.struct_size = sizeof criterion,
                                                .api_minor = LULL_API_MINOR,
                                                .id = "hang",
                                                .name = "hang",
                                                .version = "1",
                                                .description = "For the tests of what ends a program",
                                                .create = create,
                                                .requirements = requirements,
                                                .begin_frame = begin,
                                                .evaluate = evaluate,
                                                .end_frame = stub_end,
                                                .destroy = stub_end,
                                                .get_extension = stub_extension};

LULL_EXPORT const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    hang_in("entry");
    return index == 0 ? &criterion : NULL;
}
