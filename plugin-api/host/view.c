#include "host/frame.h"

#include <lull/criterion_kit.h>

#include <stdlib.h>

static size_t pixels_of(const struct lull_host_view *v) { return (size_t)(v->x1 - v->x0) * (size_t)(v->y1 - v->y0); }

/* Index of a pixel in an array over the view. */
static size_t at(const struct lull_host_view *v, int32_t x, int32_t y)
{
    return (size_t)(y - v->y0) * (size_t)(v->x1 - v->x0) + (size_t)(x - v->x0);
}

/* An array over the view. */
static struct lull_plane plane_of(const struct lull_host_view *v, const void *data, size_t size, uint32_t channels,
                                  int32_t type, int32_t normaliser)
{
    int64_t pixel = (int64_t)(channels * size);
    return (struct lull_plane){.data = data,
                               .stride_x = pixel,
                               .stride_y = pixel * (v->x1 - v->x0),
                               .stride_c = (int64_t)size,
                               .scale = 1.0,
                               .type = type,
                               .normaliser = normaliser,
                               .channels = channels};
}

static double read_at(const struct lull_plane *p, const struct lull_host_view *v, int32_t x, int32_t y, int channel)
{
    const char *e = (const char *)p->data + (x - v->x0) * p->stride_x + (y - v->y0) * p->stride_y + channel * p->stride_c;
    return lull_kit_stored(e, p->type) * p->scale;
}

/* Samples of a pixel of block k. */
static uint32_t spp_at(const struct lull_host_view *v, const struct lull_host_block *k, int32_t x, int32_t y)
{
    const int own = v->plane_count > LULL_PLANE_SPP && v->planes[LULL_PLANE_SPP].data;
    return own ? (uint32_t)read_at(&v->planes[LULL_PLANE_SPP], v, x, y, 0) : (uint32_t)k->spp;
}

static int32_t show_counts(const struct lull_host_blocks *b, const struct lull_host_view *v, struct lull_host_shown *s,
                           struct lull_error *err)
{
    if (s->planes[LULL_PLANE_SPP].data && s->planes[LULL_PLANE_WEIGHT].data)
        return LULL_OK;
    s->spp = calloc(pixels_of(v), sizeof *s->spp);
    if (!s->spp)
        return lull_host_no_memory(err, "samples per pixel");
    for (uint32_t i = 0; i < b->count; i++) {
        const struct lull_host_block *k = &b->list[i];
        for (int32_t y = k->y0; y < k->y1; y++)
            for (int32_t x = k->x0; x < k->x1; x++)
                s->spp[at(v, x, y)] = (uint32_t)k->spp;
    }
    static const int counts[2] = {LULL_PLANE_SPP, LULL_PLANE_WEIGHT};
    for (int i = 0; i < 2; i++)
        if (!s->planes[counts[i]].data)
            s->planes[counts[i]] = plane_of(v, s->spp, sizeof *s->spp, 1, LULL_TYPE_U32, LULL_NORM_ONE);
    return LULL_OK;
}

/* COLOR and MOMENT2 without the dropped samples: their sums are divided by those that are in them. A pixel that kept none is
 * black, as its sum is. */
static int32_t show_weights(const struct lull_host_blocks *b, const struct lull_host_view *v, struct lull_host_shown *s,
                            struct lull_error *err)
{
    static const int sums[2] = {LULL_PLANE_COLOR, LULL_PLANE_MOMENT2};
    s->weight = calloc(pixels_of(v), sizeof *s->weight);
    if (!s->weight)
        return lull_host_no_memory(err, "pixels with dropped samples");
    for (uint32_t i = 0; i < b->count; i++) {
        const struct lull_host_block *k = &b->list[i];
        for (int32_t y = k->y0; y < k->y1; y++) {
            for (int32_t x = k->x0; x < k->x1; x++) {
                uint32_t spp = spp_at(v, k, x, y), dropped = (uint32_t)read_at(v->dropped, v, x, y, 0);
                s->weight[at(v, x, y)] = spp > dropped ? spp - dropped : spp;
            }
        }
    }
    s->planes[LULL_PLANE_WEIGHT] = plane_of(v, s->weight, sizeof *s->weight, 1, LULL_TYPE_U32, LULL_NORM_ONE);
    for (int i = 0; i < 2; i++)
        if (s->planes[sums[i]].data && s->planes[sums[i]].normaliser == LULL_NORM_SPP)
            s->planes[sums[i]].normaliser = LULL_NORM_WEIGHT;
    return LULL_OK;
}

/* HALF has another count, which no normaliser knows per pixel: a copy, its sums as if all samples had been kept, or, of
 * LULL_NORM_WEIGHT, as many as of all. */
static int32_t show_half(const struct lull_host_blocks *b, const struct lull_host_view *v, struct lull_host_shown *s,
                         struct lull_error *err)
{
    struct lull_plane *plane = &s->planes[LULL_PLANE_HALF];
    const int by_weight = plane->normaliser == LULL_NORM_WEIGHT;
    if (!v->dropped_half || !plane->data || (!by_weight && plane->normaliser != LULL_NORM_HALF_SPP))
        return LULL_OK;
    s->half = calloc(pixels_of(v), 3 * sizeof *s->half);
    if (!s->half)
        return lull_host_no_memory(err, "pixels with dropped samples");
    for (uint32_t i = 0; i < b->count; i++) {
        const struct lull_host_block *k = &b->list[i];
        for (int32_t y = k->y0; y < k->y1; y++) {
            for (int32_t x = k->x0; x < k->x1; x++) {
                const double dropped = k->dropped > 0 ? read_at(v->dropped_half, v, x, y, 0) : 0.0;
                const double n = by_weight ? (double)spp_at(v, k, x, y) / plane->scale : (double)k->half_spp;
                const double shown = by_weight ? (double)s->weight[at(v, x, y)] / plane->scale : n;
                const double up = n > dropped ? shown / (n - dropped) : 1.0;
                for (int c = 0; c < 3; c++)
                    s->half[3 * at(v, x, y) + (size_t)c] = read_at(plane, v, x, y, c) * up;
            }
        }
    }
    *plane = plane_of(v, s->half, sizeof *s->half, 3, LULL_TYPE_F64, plane->normaliser);
    return LULL_OK;
}

int32_t lull_host_show(const struct lull_host_blocks *b, const struct lull_host_view *v, int counts,
                       struct lull_host_shown *out, struct lull_error *err)
{
    struct lull_host_shown s = {0};
    int32_t code = lull_host_check_view(b, v, err);
    if (code != LULL_OK)
        return code;
    int dropped = 0;
    for (uint32_t i = 0; i < b->count; i++)
        dropped |= v->dropped && b->list[i].dropped > 0;
    for (uint32_t i = 0; i < v->plane_count && i < LULL_PLANE_COUNT; i++)
        s.planes[i] = v->planes[i];
    if (!s.planes[LULL_PLANE_WEIGHT].data)
        s.planes[LULL_PLANE_WEIGHT] = s.planes[LULL_PLANE_SPP];
    if (counts)
        code = show_counts(b, v, &s, err);
    if (code == LULL_OK && dropped)
        code = show_weights(b, v, &s, err);
    if (code == LULL_OK && dropped)
        code = show_half(b, v, &s, err);
    if (code != LULL_OK)
        lull_host_hide(&s);
    else
        *out = s;
    return code;
}

void lull_host_hide(struct lull_host_shown *s)
{
    free(s->spp);
    free(s->weight);
    free(s->half);
}

struct lull_view lull_host_seen(const struct lull_host_view *v, const struct lull_host_shown *s)
{
    return (struct lull_view){.struct_size = sizeof(struct lull_view),
                              .x0 = v->x0,
                              .y0 = v->y0,
                              .x1 = v->x1,
                              .y1 = v->y1,
                              .planes = s->planes,
                              .plane_count = LULL_PLANE_COUNT,
                              .plane_stride = sizeof s->planes[0]};
}
