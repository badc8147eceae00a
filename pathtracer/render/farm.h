/*
 * Rendering by the processes of a job (job/farm.h). Rank 0 has the only film, asks the criterion, shows progress, writes;
 * the workers sample rows for it and keep nothing.
 *
 * A row travels with the sums that it has so far and comes back with the new ones. It is with one process at a time, so that
 * the film has the bytes that one process would give it (rows.h).
 */
#ifndef PT_RENDER_FARM_H
#define PT_RENDER_FARM_H

#include "job/farm.h"
#include "render/film.h"
#include "render/rows.h"

/* Rows to be sampled, in this order. */
struct pt_farm_slice {
    struct pt_sampler_context context;
    struct pt_film *film;
    struct pt_row *rows; /* [count] */
    size_t count;
};

/* Rank 0: samples the rows, with the threads here and by the workers, if there is a job. Not 0 as job_farm_run: then the
 * film is as it was before and so are the rows. */
int pt_farm_sample(struct job *job, struct base_threads *threads, const struct pt_farm_slice *slice, struct base_err *err);

/* A worker: samples rows until the end of the job. The context's integrator is not used: it comes with the rows. */
int pt_farm_serve(struct job *job, struct base_threads *threads, const struct pt_sampler_context *context,
                  struct base_err *err);

#endif
