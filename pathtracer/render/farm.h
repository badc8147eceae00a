/*
 * Sampling rows of pixels, by the threads here and, if there is a job (job/farm.h), its other processes. Rank 0 has the only
 * film, asks the criterion, shows progress, writes; the workers sample rows for it and keep nothing.
 *
 * The unit of work is one row of one block, from one number of samples to another. It travels with the sums that it has so
 * far and comes back with the new ones. Who has it continues the sums of its pixels in the order of their samples, and it is
 * with one thread of one process at a time: the film has the same bytes however rows are dealt out. Different rows may be
 * sampled at the same time.
 */
#ifndef PT_RENDER_FARM_H
#define PT_RENDER_FARM_H

#include <stdint.h>

#include "integ/integrator.h"
#include "job/farm.h"
#include "render/film.h"

/* What is to be done, and below it what came of it. Plain data without padding, as it travels between processes. */
struct pt_row {
    uint32_t block;    /* index in the list of blocks */
    int32_t y, x0, x1; /* pixels, end exclusive */
    uint32_t from, to; /* samples per pixel, 0 <= from < to */
    uint64_t samples, rays, dropped;
    double thread_s;
    uint32_t first_x, first_sample; /* the first dropped sample of the row */
};

/* What every row of a render is sampled with; borrows. */
struct pt_sampler_context {
    const struct pt_scene *scene;
    pt_kernel *kernel;
    const struct pt_integrator *integrator;
};

/* Adds the row's samples to the film and fills the second half of *row, which must be zero. */
void pt_row_sample(const struct pt_sampler_context *context, struct pt_film *film, struct pt_row *row);

/* The sums of a row's pixels as bytes, plane after plane, and back. */
size_t pt_row_bytes(const struct pt_row *row, uint32_t planes);
void pt_row_save(const struct pt_film *film, const struct pt_row *row, unsigned char *bytes);
void pt_row_restore(struct pt_film *film, const struct pt_row *row, const unsigned char *bytes);

/* Rows to be sampled. */
struct pt_farm_slice {
    struct pt_sampler_context context;
    struct pt_film *film;
    struct pt_row *rows;
    const uint32_t *order; /* [count] row to be done n-th */
    size_t count;
};

/* Rank 0: samples the rows, with the threads here and by the workers, if there is a job. Not 0 as job_farm_run: then the
 * film is as it was before and so are the rows. */
int pt_farm_sample(struct job *job, struct base_threads *threads, const struct pt_farm_slice *slice, struct base_err *err);

/* A worker: samples rows until the end of the job. The context's integrator is not used: it comes with the rows. */
int pt_farm_serve(struct job *job, struct base_threads *threads, const struct pt_sampler_context *context,
                  struct base_err *err);

#endif
