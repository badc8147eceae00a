/* The film shown to a criterion as the planes of the ABI; nothing is copied. */
#ifndef PT_RENDER_HOST_PLANES_H
#define PT_RENDER_HOST_PLANES_H

#include <lull/host.h>

#include "render/film.h"

/* PT_FILM_* planes that a criterion with these needs reads. */
uint32_t pt_host_film_planes(const struct lull_requirements *needs);
/* And the other way round: planes of the ABI that a film with these PT_FILM_* planes holds. */
uint32_t pt_host_planes_of(uint32_t film_planes);

struct pt_host_view {
    struct lull_plane planes[LULL_PLANE_COUNT], dropped, dropped_half;
    struct lull_host_view view;
};
/* Describes the film's arrays, which are borrowed, and sets the blocks' half_spp. Returns &out->view. */
const struct lull_host_view *pt_host_show(const struct pt_film *film, struct lull_host_blocks *blocks,
                                          struct pt_host_view *out);

#endif
