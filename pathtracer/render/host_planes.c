#include "render/host_planes.h"

#include <string.h>

uint32_t pt_host_film_planes(const struct lull_requirements *needs)
{
    static const struct {
        int abi;
        uint32_t film;
    } map[] = {{LULL_PLANE_HALF, PT_FILM_HALF},     {LULL_PLANE_MOMENT2, PT_FILM_MOMENT2},
               {LULL_PLANE_ALBEDO, PT_FILM_ALBEDO}, {LULL_PLANE_NORMAL, PT_FILM_NORMAL},
               {LULL_PLANE_DEPTH, PT_FILM_DEPTH}};
    uint32_t planes = PT_FILM_COLOR;
    for (size_t i = 0; i < sizeof map / sizeof map[0]; i++)
        if (needs->planes_used & LULL_PLANE_BIT(map[i].abi))
            planes |= map[i].film;
    return planes;
}

static struct lull_plane plane_f64(const double *data, const struct pt_film *film, uint32_t channels, int32_t normaliser)
{
    int64_t pixel = (int64_t)(channels * sizeof(double));
    return (struct lull_plane){.data = data, .stride_x = pixel, .stride_y = pixel * (film->x1 - film->x0),
                               .stride_c = (int64_t)sizeof(double), .scale = 1.0, .type = LULL_TYPE_F64,
                               .normaliser = normaliser, .channels = channels};
}

uint32_t pt_host_planes(const struct pt_film *film, const uint32_t *spp, struct lull_plane p[LULL_PLANE_COUNT])
{
    memset(p, 0, LULL_PLANE_COUNT * sizeof *p);
    p[LULL_PLANE_COLOR] = plane_f64(film->color, film, 3, LULL_NORM_SPP);
    p[LULL_PLANE_HALF] = plane_f64(film->half, film, 3, LULL_NORM_HALF_SPP);
    p[LULL_PLANE_MOMENT2] = plane_f64(film->moment2, film, 1, LULL_NORM_SPP);
    p[LULL_PLANE_ALBEDO] = plane_f64(film->albedo, film, 3, LULL_NORM_SPP);
    p[LULL_PLANE_NORMAL] = plane_f64(film->normal, film, 3, LULL_NORM_SPP);
    p[LULL_PLANE_DEPTH] = plane_f64(film->depth, film, 1, LULL_NORM_ONE);
    if (spp) {
        struct lull_plane counts = {.data = spp, .stride_x = sizeof *spp,
                                    .stride_y = (int64_t)sizeof *spp * (film->x1 - film->x0), .stride_c = sizeof *spp,
                                    .scale = 1.0, .type = LULL_TYPE_U32, .normaliser = LULL_NORM_ONE, .channels = 1};
        p[LULL_PLANE_WEIGHT] = counts;
        p[LULL_PLANE_SPP] = counts;
    }
    uint32_t mask = 0;
    for (int i = 0; i < LULL_PLANE_COUNT; i++) {
        if (p[i].data)
            mask |= LULL_PLANE_BIT(i);
        else
            p[i] = (struct lull_plane){0};
    }
    return mask;
}

void pt_host_fill_spp(const struct pt_film *film, const struct pt_blocks *blocks, uint32_t *spp)
{
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct pt_block *b = &blocks->list[i];
        for (int y = b->y0; y < b->y1; y++)
            for (int x = b->x0; x < b->x1; x++)
                spp[pt_film_index(film, x, y)] = (uint32_t)b->spp;
    }
}
