/* A criterion leaves the renderer's thread as it found it; where one does not, that is put back. */
#include "host/frame.h"

#include <stdio.h>

static void tell(struct lull_host_criterion *c, const char *call, const char *changed)
{
    char text[128];
    if (!changed || atomic_exchange(&c->warned_of_change, 1))
        return;
    snprintf(text, sizeof text, "%s changed %s; restored", call, changed);
    lull_host_say(c, LULL_LOG_WARNING, text);
}

void lull_host_leave(struct lull_host_criterion *c, const struct lull_process_state *before, const char *call)
{
    tell(c, call, lull_process_state_restore(before));
}

struct tasks {
    struct lull_host_criterion *criterion;
    lull_task_fn fn;
    void *arg;
};

static void run_task(void *arg, uint64_t task, uint32_t worker)
{
    const struct tasks *t = arg;
    const unsigned long long before = lull_fp_control_get();
    t->fn(t->arg, task, worker);
    if (lull_fp_control_get() == before)
        return;
    lull_fp_control_set(before);
    tell(t->criterion, "a task", "the floating-point control register");
}

int32_t lull_host_tasks(struct lull_host_criterion *c, uint64_t count, lull_task_fn fn, void *arg)
{
    struct tasks t = {c, fn, arg};
    if (c->offered.parallel_for)
        return c->offered.parallel_for(c->offered.context, count, run_task, &t);
    base_threads_tasks(c->threads, count, run_task, &t);
    return LULL_OK;
}
