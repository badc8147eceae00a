/* The film shown to a criterion as the planes of the ABI; nothing is copied but counts of samples. */
#ifndef PT_RENDER_HOST_PLANES_H
#define PT_RENDER_HOST_PLANES_H

#include <lull/criterion.h>

#include "render/blocks.h"
#include "render/film.h"

/* PT_FILM_* planes that a criterion with these needs reads. */
uint32_t pt_host_film_planes(const struct lull_requirements *needs);

/* Describes the film's arrays; `spp` ([film pixels], may be NULL) serves as SPP and WEIGHT. Borrows both. Returns the mask
 * of the planes that are there. */
uint32_t pt_host_planes(const struct pt_film *film, const uint32_t *spp, struct lull_plane planes[LULL_PLANE_COUNT]);

/* Samples of each pixel, those of its block, into spp[film pixels]. */
void pt_host_fill_spp(const struct pt_film *film, const struct pt_blocks *blocks, uint32_t *spp);

#endif
