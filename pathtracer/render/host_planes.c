#include "render/host_planes.h"

static const struct {
    int abi;
    uint32_t film;
} map[] = {{LULL_PLANE_HALF, PT_FILM_HALF},
           {LULL_PLANE_MOMENT2, PT_FILM_MOMENT2},
           {LULL_PLANE_ALBEDO, PT_FILM_ALBEDO},
           {LULL_PLANE_NORMAL, PT_FILM_NORMAL},
           {LULL_PLANE_DEPTH, PT_FILM_DEPTH}};

uint32_t pt_host_film_planes(const struct lull_requirements *needs)
{
    uint32_t planes = PT_FILM_COLOR;
    for (size_t i = 0; i < sizeof map / sizeof map[0]; i++)
        if (needs->planes_used & LULL_PLANE_BIT(map[i].abi))
            planes |= map[i].film;
    return planes;
}

uint32_t pt_host_planes_of(uint32_t film_planes)
{
    uint32_t planes = LULL_PLANE_BIT(LULL_PLANE_COLOR);
    for (size_t i = 0; i < sizeof map / sizeof map[0]; i++)
        if (film_planes & map[i].film)
            planes |= LULL_PLANE_BIT(map[i].abi);
    return planes;
}

/* NULL data: no such plane. */
static struct lull_plane plane_of(const struct pt_film *film, const void *data, uint32_t channels, size_t size, int32_t type,
                                  int32_t normaliser)
{
    int64_t pixel = (int64_t)(channels * size);
    if (!data)
        return (struct lull_plane){0};
    return (struct lull_plane){.data = data,
                               .stride_x = pixel,
                               .stride_y = pixel * (film->x1 - film->x0),
                               .stride_c = (int64_t)size,
                               .scale = 1.0,
                               .type = type,
                               .normaliser = normaliser,
                               .channels = channels};
}

static struct lull_plane sums(const struct pt_film *film, const double *data, uint32_t channels, int32_t normaliser)
{
    return plane_of(film, data, channels, sizeof *data, LULL_TYPE_F64, normaliser);
}

static struct lull_plane counts(const struct pt_film *film, const uint32_t *data)
{
    return plane_of(film, data, 1, sizeof *data, LULL_TYPE_U32, LULL_NORM_ONE);
}

const struct lull_host_view *pt_host_show(const struct pt_film *film, struct lull_host_blocks *blocks,
                                          struct pt_host_view *v)
{
    for (uint32_t i = 0; i < blocks->count; i++)
        blocks->list[i].half_spp = film->half ? pt_film_half_spp(blocks->list[i].spp) : 0;
    *v = (struct pt_host_view){.dropped = counts(film, film->dropped), .dropped_half = counts(film, film->dropped_half)};
    v->planes[LULL_PLANE_COLOR] = sums(film, film->color, 3, LULL_NORM_SPP);
    v->planes[LULL_PLANE_HALF] = sums(film, film->half, 3, LULL_NORM_HALF_SPP);
    v->planes[LULL_PLANE_MOMENT2] = sums(film, film->moment2, 1, LULL_NORM_SPP);
    v->planes[LULL_PLANE_ALBEDO] = sums(film, film->albedo, 3, LULL_NORM_SPP);
    v->planes[LULL_PLANE_NORMAL] = sums(film, film->normal, 3, LULL_NORM_SPP);
    v->planes[LULL_PLANE_DEPTH] = sums(film, film->depth, 1, LULL_NORM_ONE);
    v->view = (struct lull_host_view){.struct_size = sizeof v->view,
                                      .plane_count = LULL_PLANE_COUNT,
                                      .x0 = film->x0,
                                      .y0 = film->y0,
                                      .x1 = film->x1,
                                      .y1 = film->y1,
                                      .planes = v->planes,
                                      .dropped = &v->dropped,
                                      .dropped_half = film->dropped_half ? &v->dropped_half : NULL};
    return &v->view;
}
