#include "render/host_services.h"

#include <limits.h>
#include <stdio.h>

#include "base/version.h"

static void host_log(const struct lull_host *host, int32_t level, const char *text)
{
    const struct pt_host_services *s = host->context;
    if (!s->warn || level > LULL_LOG_WARNING)
        return;
    char line[600];
    snprintf(line, sizeof line, "criterion %s: %s", s->name, text);
    s->warn(s->warn_data, line);
}

struct job {
    lull_task_fn fn;
    void *arg;
    uint64_t first;
};

static void run_task(void *data, long i, int worker)
{
    const struct job *job = data;
    job->fn(job->arg, job->first + (uint64_t)i, (uint32_t)worker);
}

static int32_t host_parallel_for(const struct lull_host *host, uint64_t count, lull_task_fn fn, void *arg)
{
    const struct pt_host_services *s = host->context;
    struct job job = {.fn = fn, .arg = arg};
    for (; job.first < count;) {
        uint64_t n = count - job.first < LONG_MAX / 2 ? count - job.first : LONG_MAX / 2;
        if (s->threads)
            base_threads_for(s->threads, (long)n, run_task, &job);
        else
            for (uint64_t i = 0; i < n; i++)
                run_task(&job, (long)i, 0);
        job.first += n;
    }
    return LULL_OK;
}

struct lull_host pt_host_services_table(struct pt_host_services *s)
{
    return (struct lull_host){.struct_size = sizeof(struct lull_host), .api_minor = LULL_API_MINOR, .context = s,
                              .name = "lull pathtracer " BASE_VERSION,
                              .max_workers = s->threads ? (uint32_t)base_threads_count(s->threads) : 1,
                              .log = host_log, .parallel_for = host_parallel_for};
}
