#include "render/host.h"

#include <stdlib.h>

#include "base/version.h"

int pt_host_result(int32_t code, const struct lull_error *why, struct base_err *err)
{
    return code == LULL_OK ? 0 : base_fail(err, code == LULL_E_MEMORY ? BASE_ENOMEM : BASE_EINVAL, "%s", why->message);
}

/* What a criterion's services stand on; lives as long as it. */
struct services {
    struct base_threads *threads;
    struct base_log *log;
};

static void log_message(void *context, int32_t level, const char *text)
{
    const struct services *s = context;
    if (level <= LULL_LOG_INFO)
        base_log_note(s->log, "%s", text);
}

static int32_t run_tasks(void *context, uint64_t count, lull_task_fn fn, void *arg)
{
    const struct services *s = context;
    base_threads_tasks(s->threads, count, fn, arg);
    return LULL_OK;
}

int pt_criterion_create(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                        struct base_threads *threads, struct base_log *log, struct lull_host_criterion **out,
                        struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct services *s = malloc(sizeof *s);
    if (!s)
        return base_fail_nomem(err, "criterion");
    *s = (struct services){threads, log};
    struct lull_host_services services = {.struct_size = sizeof services,
                                          .threads = threads ? (uint32_t)base_threads_count(threads) : 1,
                                          .name = "lull-render " BASE_VERSION,
                                          .context = s,
                                          .log = log_message,
                                          .parallel_for = run_tasks,
                                          .release = free};
    int32_t code = lull_host_create(&services, table, pairs, pair_count, out, &e);
    return pt_host_result(code, &e, err);
}
