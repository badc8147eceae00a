/*
 * Rendering by the processes of a job (job/farm.h). Rank 0 has the only film, decides, shows progress, writes; the workers
 * sample rows and ask the criterion about blocks for it, and keep nothing.
 *
 * A row travels with the sums that it has so far and comes back with the new ones. It is with one process at a time, so that
 * the film has the bytes that one process would give it (rows.h).
 */
#ifndef PT_RENDER_FARM_H
#define PT_RENDER_FARM_H

#include "job/farm.h"
#include "render/film.h"
#include "render/host.h"
#include "render/rows.h"

/* Rows to be sampled. */
struct pt_farm_slice {
    struct pt_row_maker maker;
    struct pt_film *film;
    struct pt_row *rows;
    const uint32_t *order; /* [count] row to be done n-th */
    size_t count;
};

/* Rank 0: samples the rows, with the threads here and by the workers. Not 0 as job_farm_run: then the film is as it was
 * before and so are the rows. */
int pt_farm_sample(struct job *job, struct base_threads *threads, const struct pt_farm_slice *slice, struct base_err *err);

/* Blocks about which the criterion is to be asked: the arguments of pt_criterion_evaluate. */
struct pt_farm_question {
    struct lull_host_criterion *criterion;
    struct lull_host_frame *frame;
    const struct pt_film *film;
    const uint32_t *due;
    const uint8_t *final;
    uint32_t count;
    struct lull_decision *decisions;
};

/* Can workers answer as well? Yes if the criterion keeps no history of its own, its answers are a function of the block's
 * pixels, and every worker has opened the frame. No without a job (NULL). */
int pt_farm_can_ask(const struct job *job, const struct lull_host_criterion *criterion);
/* Rank 0: pt_criterion_evaluate by all processes. Fails as job_farm_run; what the criterion itself fails with is *said, and
 * costs all decisions. *thread_s: processor seconds of the workers. */
int pt_farm_ask(struct job *job, struct base_threads *threads, const struct pt_farm_question *question, double *thread_s,
                struct base_err *said, struct base_err *err);

/* What a worker works with; borrows. */
struct pt_farm_tools {
    struct pt_row_maker maker; /* its integrator is not used: it comes with the rows */
    /* What is asked, made like that of rank 0; criterion NULL: rows only. */
    struct lull_host_criterion *criterion;
    struct lull_host_frame *frame;
    struct pt_film *film;
};

/* A worker: serves until the end of the job. */
int pt_farm_serve(struct job *job, struct base_threads *threads, const struct pt_farm_tools *tools, struct base_err *err);

#endif
