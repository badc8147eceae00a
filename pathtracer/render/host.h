/*
 * The path tracer as a host of criteria: what lull/host.h asks of a renderer, its film, its threads, its words. host_find
 * finds a criterion, host_planes shows it the film. All calls come from one thread; the criterion may use the pool.
 */
#ifndef PT_RENDER_HOST_H
#define PT_RENDER_HOST_H

#include <lull/host_draft.h>

#include "base/err.h"
#include "base/log.h"
#include "base/threads.h"

/* Makes an instance with parameters; lull_host_close frees it. `threads` is borrowed until then and may be NULL (one
 * worker). Errors and warnings of the criterion are notes in the log, which is borrowed likewise and may be NULL. */
int pt_criterion_create(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                        struct base_threads *threads, struct base_log *log, struct lull_host_criterion **out,
                        struct base_err *err);

/* What the host library returned, in the path tracer's words: 0, BASE_ENOMEM or BASE_EINVAL. */
int pt_host_result(int32_t code, const struct lull_error *why, struct base_err *err);

#endif
