/*
 * The path tracer as a host of criteria: what lull/host.h asks of a renderer, its film, its threads, its words. All calls
 * come from one thread; the criterion may use the pool.
 */
#ifndef PT_RENDER_HOST_H
#define PT_RENDER_HOST_H

#include <stdio.h>

#include <lull/host_draft.h>

#include "base/err.h"
#include "base/paths.h"
#include "base/log.h"
#include "base/threads.h"
#include "render/film.h"

/* The criterion that spec names (NAME, PATH.so or PATH.so:ID), where the loader looks for it: a table that lives for ever.
 * What the loader says is noted in the log, which may be NULL. The library is put into `inputs`, which may be NULL. */
int pt_criterion_find(const char *spec, struct base_inputs *inputs, struct base_log *log, const struct lull_criterion **out,
                      struct base_err *err);
/* Its name and description, for people. */
void pt_criterion_describe(const struct lull_criterion *table, FILE *out);
/* Every criterion that can be found, with its parameters, for people. Returns the number listed. */
int pt_criterion_list(FILE *out, struct base_log *log);
/* Makes an instance with parameters; lull_host_close frees it. `threads` is borrowed until then and may be NULL (one
 * worker). Errors and warnings of the criterion are notes in the log, which is borrowed likewise and may be NULL. */
int pt_criterion_create(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                        struct base_threads *threads, struct base_log *log, struct lull_host_criterion **out,
                        struct base_err *err);

/* What the host library returned, in the path tracer's words: 0, BASE_ENOMEM or BASE_EINVAL. */
int pt_host_result(int32_t code, const struct lull_error *why, struct base_err *err);

/* PT_FILM_* planes that a criterion with these needs reads. */
uint32_t pt_host_film_planes(const struct lull_requirements *needs);
/* And the other way round: planes of the ABI that a film with these PT_FILM_* planes holds. */
uint32_t pt_host_planes_of(uint32_t film_planes);

struct pt_host_view {
    struct lull_plane planes[LULL_PLANE_COUNT], dropped, dropped_half;
    struct lull_host_view view;
};
/* Shows the film's arrays, which are borrowed, as the planes of the ABI. *out stays where it is. */
void pt_host_show(const struct pt_film *film, struct pt_host_view *out);

/* A region that the user wants better (lull_host_config.mask): any picture file of exactly this size, colours averaged, as
 * stored: a plane of numbers in [0, 1] that owns its data. BASE_EINVAL names what is wrong with the file. */
int pt_mask_read(const char *path, int width, int height, struct lull_plane *out, struct base_err *err);
void pt_mask_release(struct lull_plane *mask);

#endif
