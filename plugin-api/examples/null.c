/* SPDX-License-Identifier: MIT
 *
 * The smallest criterion: never stops a block. Copy this file to begin your own; it needs nothing but the ABI's header.
 *
 *     cc -shared -fPIC -fvisibility=hidden -Wl,--version-script=plugin.map null.c -o null.so
 *     lull-check ./null.so
 */
#include <lull/criterion.h>

#include <stdio.h>
#include <stdlib.h>

struct lull_instance {
    uint32_t block_count; /* of the open frame, 0 = none is open */
};

static int32_t fail(struct lull_error *err, int32_t code, const char *message)
{
    if (err && LULL_HAS(struct lull_error, err, message)) {
        err->code = code;
        snprintf(err->message, sizeof err->message, "%s", message);
    }
    return code;
}

static int32_t null_create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                           uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err)
{
    (void)pairs, (void)pair_stride;
    if (!instance)
        return fail(err, LULL_E_INVALID, "create: no place for the instance");
    if (host && !LULL_HAS(struct lull_host, host, get_extension))
        return fail(err, LULL_E_VERSION, "the host's struct is older than version 1.0");
    if (pair_count > 0) { /* name the key, so that the user sees what was mistyped */
        char message[200];
        snprintf(message, sizeof message, "no parameter '%s': null has none", pairs && pairs->key ? pairs->key : "");
        return fail(err, LULL_E_KEY, message);
    }
    struct lull_instance *made = calloc(1, sizeof *made);
    if (!made)
        return fail(err, LULL_E_MEMORY, "out of memory");
    *instance = made;
    return LULL_OK;
}

static int32_t null_requirements(const struct lull_instance *instance, struct lull_requirements *req, struct lull_error *err)
{
    if (!instance || !req)
        return fail(err, LULL_E_INVALID, "requirements: an argument is missing");
    if (!LULL_HAS(struct lull_requirements, req, bytes_per_block))
        return fail(err, LULL_E_VERSION, "the host's requirements struct is older than version 1.0");
    req->flags = LULL_REQ_FLEXIBLE;
    req->planes_required = 0; /* it looks at nothing */
    req->planes_used = 0;
    req->block_width = 0; /* any size */
    req->block_height = 0;
    req->halo = 0;
    req->checks_hint = 0;
    req->first_spp = 1;
    req->bytes_per_block = 0;
    return LULL_OK;
}

static int32_t null_begin_frame(struct lull_instance *instance, const struct lull_frame *frame, struct lull_error *err)
{
    if (!instance || !frame)
        return fail(err, LULL_E_INVALID, "begin_frame: an argument is missing");
    if (!LULL_HAS(struct lull_frame, frame, rgb_to_xyz))
        return fail(err, LULL_E_VERSION, "the host's frame struct is older than version 1.0");
    if (instance->block_count > 0 && !(frame->flags & LULL_FRAME_RESTART))
        return fail(err, LULL_E_STATE, "begin_frame: a frame is open");
    if (!frame->blocks || frame->block_count == 0)
        return fail(err, LULL_E_INVALID, "begin_frame: the frame has no blocks");
    instance->block_count = frame->block_count;
    return LULL_OK;
}

static int32_t null_evaluate(struct lull_instance *instance, const struct lull_view *view, const struct lull_block *blocks,
                             uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride,
                             uint32_t count, struct lull_error *err)
{
    if (!instance || !view || (count > 0 && (!blocks || !decisions)))
        return fail(err, LULL_E_INVALID, "evaluate: an argument is missing");
    if (!LULL_HAS(struct lull_view, view, elapsed_s) || block_stride < sizeof *blocks || decision_stride < sizeof *decisions)
        return fail(err, LULL_E_VERSION, "evaluate: the host's structs are older than version 1.0");
    if (instance->block_count == 0)
        return fail(err, LULL_E_STATE, "evaluate: no frame is open");
    for (uint32_t i = 0; i < count; i++) {
        const void *block = (const char *)blocks + (size_t)i * block_stride;
        if (((const struct lull_block *)block)->id >= instance->block_count)
            return fail(err, LULL_E_INVALID, "evaluate: a block that is not in the frame");
    }
    for (uint32_t i = 0; i < count; i++) {
        void *decision = (char *)decisions + (size_t)i * decision_stride; /* the stride, not sizeof: hosts may be newer */
        ((struct lull_decision *)decision)->action = LULL_CONTINUE;
        ((struct lull_decision *)decision)->next_spp = 0; /* the host chooses when to ask again */
    }
    return LULL_OK;
}

static void null_end_frame(struct lull_instance *instance)
{
    if (instance)
        instance->block_count = 0;
}

static void null_destroy(struct lull_instance *instance)
{
    free(instance);
}

static const void *null_get_extension(const char *id)
{
    (void)id; /* no history, hence no lull.state/1 */
    return NULL;
}

static const struct lull_criterion null_criterion = {
    .struct_size = sizeof(struct lull_criterion),
    .api_minor = LULL_API_MINOR,
    .id = "null",
    .name = "Never stop",
    .version = "1.0",
    .description = "Continues every block for ever: the host's own limit ends the render.",
    .thread_level = LULL_THREADS_FULL, /* evaluate writes nothing but the decisions */
    .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
    .create = null_create,
    .requirements = null_requirements,
    .begin_frame = null_begin_frame,
    .evaluate = null_evaluate,
    .end_frame = null_end_frame,
    .destroy = null_destroy,
    .get_extension = null_get_extension,
};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index)
{
    return index == 0 ? &null_criterion : NULL;
}
