/* What a criterion is offered while it is asked: a log, threads. It leaves the renderer's thread as it found it; where one
 * does not, that is put back. */
#include "host/frame.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Copies a text of a criterion as one line. */
static void copy_line(char *to, size_t room, const char *text)
{
    snprintf(to, room, "%s", text);
    for (char *at = to; *at; at++)
        *at = iscntrl((unsigned char)*at) ? ' ' : *at;
}

/* Whether it is new. */
static int keep_message(struct lull_host_criterion *c, const char *line)
{
    uint32_t i = 0;
    pthread_mutex_lock(&c->messages_lock);
    const uint32_t count = c->message_count;
    while (i < count && strcmp(c->messages[i], line) != 0)
        i++;
    if (i == count && count < LULL_HOST_MESSAGES)
        snprintf(c->messages[c->message_count++], LULL_HOST_LINE, "%s", line);
    pthread_mutex_unlock(&c->messages_lock);
    return i == count;
}

int32_t lull_host_blame(const struct lull_host_criterion *c, const char *what, int32_t code, const struct lull_error *why,
                        struct lull_error *err)
{
    char whole[sizeof why->message + 1], text[sizeof whole], line[LULL_HOST_LINE];
    memcpy(whole, why->message, sizeof why->message);
    whole[sizeof why->message] = '\0'; /* it may have forgotten that */
    copy_line(text, sizeof text, whole);
    snprintf(line, sizeof line, "criterion %s: %s%s", c->table->id, what, text);
    keep_message((void *)(uintptr_t)c, line);
    return lull_error_set(err, code < LULL_OK ? code : LULL_E_INTERNAL, "%s", line);
}

void lull_host_say(struct lull_host_criterion *c, int32_t level, const char *text)
{
    int none = LULL_WARNING_NONE;
    char line[LULL_HOST_LINE];
    snprintf(line, sizeof line, "criterion %s: ", c->table->id);
    copy_line(line + strlen(line), sizeof line - strlen(line), text ? text : "");
    if (level <= LULL_LOG_INFO && !keep_message(c, line) && level == LULL_LOG_INFO)
        return; /* some say it at each check */
    if (c->offered.log)
        c->offered.log(c->offered.context, level, line);
    else if (level <= LULL_LOG_WARNING &&
             atomic_compare_exchange_strong(&c->warning_state, &none, LULL_WARNING_BEING_WRITTEN)) {
        memcpy(c->warning, line, sizeof line);
        atomic_store(&c->warning_state, LULL_WARNING_WAITING);
    }
}

int32_t lull_host_pass_warning(struct lull_host_criterion *c, struct lull_error *err)
{
    int waiting = LULL_WARNING_WAITING;
    if (err && atomic_compare_exchange_strong(&c->warning_state, &waiting, LULL_WARNING_PASSED))
        lull_error_set(err, LULL_OK, "%s", c->warning);
    return LULL_OK;
}

static void host_log(const struct lull_host *host, int32_t level, const char *text)
{
    lull_host_say(host->context, level, text);
}

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

static int32_t host_parallel_for(const struct lull_host *host, uint64_t count, lull_task_fn fn, void *arg)
{
    struct lull_host_criterion *c = host->context;
    struct tasks t = {c, fn, arg};
    if (c->offered.parallel_for)
        return c->offered.parallel_for(c->offered.context, count, run_task, &t);
    base_threads_tasks(c->threads, count, run_task, &t);
    return LULL_OK;
}

int32_t lull_host_offer(struct lull_host_criterion *c, const struct lull_host_services *services, struct lull_error *err)
{
    struct base_err e = {0};
    if (services) {
        c->offered = *services;
        c->offered.name = services->name ? strdup(services->name) : NULL;
        if (services->name && !c->offered.name)
            return lull_host_no_memory(err, "criterion");
    }
    c->offered.threads = c->offered.threads > 0 ? c->offered.threads : 1;
    if (c->offered.threads > 1 && !c->offered.parallel_for &&
        !(c->threads = base_threads_create((int)c->offered.threads, &e)))
        return lull_host_translate(&e, err);
    c->host = (struct lull_host){.struct_size = sizeof c->host,
                                 .api_minor = LULL_API_MINOR,
                                 .context = c,
                                 .name = c->offered.name,
                                 .max_workers = c->offered.threads,
                                 .log = host_log,
                                 .parallel_for = host_parallel_for};
    return LULL_OK;
}

void lull_host_withdraw(struct lull_host_criterion *c)
{
    base_threads_destroy(c->threads);
    if (c->offered.release)
        c->offered.release(c->offered.context);
    free((void *)(uintptr_t)c->offered.name);
}
