/*
 * The unit of work: one row of pixels of one block, from one number of samples to another.
 *
 * The worker that has a row continues the sums of its pixels in the order of their samples, and a row is with one worker at
 * a time: the film has the same bytes however rows are dealt out, to threads or to processes. Different rows may be sampled
 * at the same time.
 */
#ifndef PT_RENDER_ROWS_H
#define PT_RENDER_ROWS_H

#include <stdint.h>

#include "integ/integrator.h"
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

#endif
