/*
 * A farm: rank 0 deals out tasks, some of `count` items each, to whoever is idle, works itself, and applies the answers as
 * they come. An item is with one process at a time. Two tasks are with each worker, so that it need not wait for rank 0.
 */
#ifndef JOB_FARM_H
#define JOB_FARM_H

#include "base/threads.h"
#include "job/job.h"

/* A task as a worker sees it. */
struct job_task {
    uint32_t kind, serial;
    uint32_t whole, count, first; /* of the farm; items */
    uint64_t common_bytes, item_bytes, answer_bytes;
    unsigned char bytes[]; /* what is common, then the items [count] */
};
static inline const void *job_task_common(const struct job_task *task) { return task->bytes; }
static inline void *job_task_item(struct job_task *task, uint32_t k)
{
    return task->bytes + task->common_bytes + k * task->item_bytes;
}

/* Rank 0's side. Sizes in bytes are multiples of 8 and the same for every item. */
struct job_farm {
    int whole;      /* what is done to an item uses all threads of a process; else threads take one item each */
    uint32_t count; /* items */
    size_t common_bytes, item_bytes, answer_bytes;
    const void *common;
    /* pack: item i into a task; may be NULL if item_bytes is 0. here: items [first, first + n) at rank 0, not 0 if they
     * cannot be done. apply: the answer about item i, not 0 if it makes no sense; may be NULL. */
    void (*pack)(void *data, uint32_t i, void *item);
    int (*here)(void *data, uint32_t first, uint32_t n, int thread, struct base_err *err);
    int (*apply)(void *data, uint32_t i, const void *answer);
    void *data;
};

/* A worker's side. Does the items [k, k + n) of a task, all of them if it is whole, else one of them in any of the threads;
 * answer: of item k and following ones. Not 0: it cannot go on. */
struct job_service {
    int (*work)(void *data, struct job_task *task, uint32_t k, uint32_t n, void *answer, int thread, struct base_err *err);
    void *data;
};

/* Rank 0: has all items done, here and by the workers, who serve. JOB_STOPPED when it was interrupted (job_watch), negative
 * when somebody was lost: then some of the items are done. */
enum { JOB_STOPPED = 1 };
int job_farm_run(struct job *job, struct base_threads *threads, const struct job_farm *farm, struct base_err *err);
/* A worker: does tasks until rank 0 says that there are no more, of this farm or at all. */
int job_serve(struct job *job, struct base_threads *threads, const struct job_service *service, struct base_err *err);
/* Both, called by all in the same order; job NULL: this process does all items. */
int job_share(struct job *job, struct base_threads *threads, const struct job_farm *farm, const struct job_service *service,
              struct base_err *err);

#endif
