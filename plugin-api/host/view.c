#include "host/frame.h"

#include <lull/criterion_kit.h>

#include <stdlib.h>

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

/* The pixels of a block, of what is made. weight: the sums of COLOR and MOMENT2 are divided by the samples that are in them;
 * a pixel that kept none is black, as its sum is. half: the number in HALF is another one, which no normaliser knows per
 * pixel, therefore a copy, its sums as if all samples had been kept, or, of LULL_NORM_WEIGHT, as many as of all. */
static void fill(struct lull_host_shown *s, const struct lull_host_view *v, const struct lull_host_block *k)
{
    const struct lull_plane *half = &s->planes[LULL_PLANE_HALF],
                            *own = v->plane_count > LULL_PLANE_SPP ? &v->planes[LULL_PLANE_SPP] : NULL;
    const int by_weight = half->normaliser == LULL_NORM_WEIGHT;
    for (int32_t y = k->y0; y < k->y1; y++)
        for (int32_t x = k->x0; x < k->x1; x++) {
            const size_t at = (size_t)(y - v->y0) * (size_t)(v->x1 - v->x0) + (size_t)(x - v->x0);
            if (s->spp)
                s->spp[at] = (uint32_t)k->spp;
            if (!s->weight)
                continue;
            const uint32_t spp = own && own->data ? (uint32_t)read_at(own, v, x, y, 0) : (uint32_t)k->spp;
            const uint32_t dropped = (uint32_t)read_at(v->dropped, v, x, y, 0);
            s->weight[at] = spp > dropped ? spp - dropped : spp;
            if (!s->half)
                continue;
            const double dropped_half = k->dropped > 0 ? read_at(v->dropped_half, v, x, y, 0) : 0.0;
            const double n = by_weight ? (double)spp / half->scale : (double)k->half_spp;
            const double shown = by_weight ? (double)s->weight[at] / half->scale : n;
            const double up = n > dropped_half ? shown / (n - dropped_half) : 1.0;
            for (int c = 0; c < 3; c++)
                s->half[3 * at + (size_t)c] = read_at(half, v, x, y, c) * up;
        }
}

/* Puts what was made in its places. */
static void place(struct lull_host_shown *s, const struct lull_host_view *v)
{
    static const int counts[2] = {LULL_PLANE_SPP, LULL_PLANE_WEIGHT}, sums[2] = {LULL_PLANE_COLOR, LULL_PLANE_MOMENT2};
    for (int i = 0; i < 2; i++) {
        struct lull_plane *count = &s->planes[counts[i]], *sum = &s->planes[sums[i]];
        if (s->spp && !count->data)
            *count = plane_of(v, s->spp, sizeof *s->spp, 1, LULL_TYPE_U32, LULL_NORM_ONE);
        if (s->weight && sum->data && sum->normaliser == LULL_NORM_SPP)
            sum->normaliser = LULL_NORM_WEIGHT;
    }
    if (s->weight)
        s->planes[LULL_PLANE_WEIGHT] = plane_of(v, s->weight, sizeof *s->weight, 1, LULL_TYPE_U32, LULL_NORM_ONE);
    if (s->half)
        s->planes[LULL_PLANE_HALF] =
            plane_of(v, s->half, sizeof *s->half, 3, LULL_TYPE_F64, s->planes[LULL_PLANE_HALF].normaliser);
}

int32_t lull_host_show(const struct lull_host_blocks *b, const struct lull_host_view *v, int counts,
                       struct lull_host_shown *out, struct lull_error *err)
{
    struct lull_host_shown s = {0};
    const struct lull_plane *half = &s.planes[LULL_PLANE_HALF];
    int32_t code = lull_host_check_view(b, v, err);
    if (code != LULL_OK)
        return code;
    const size_t pixels = (size_t)(v->x1 - v->x0) * (size_t)(v->y1 - v->y0);
    int dropped = 0;
    for (uint32_t i = 0; i < b->count; i++)
        dropped |= v->dropped && b->list[i].dropped > 0;
    for (uint32_t i = 0; i < v->plane_count && i < LULL_PLANE_COUNT; i++)
        s.planes[i] = v->planes[i];
    if (!s.planes[LULL_PLANE_WEIGHT].data)
        s.planes[LULL_PLANE_WEIGHT] = s.planes[LULL_PLANE_SPP];
    /* where samples were dropped, sums are divided by those that are in them: the host's planes do not count those */
    const int halves = dropped && v->dropped_half && half->data &&
                       (half->normaliser == LULL_NORM_WEIGHT || half->normaliser == LULL_NORM_HALF_SPP);
    counts = counts && !(s.planes[LULL_PLANE_SPP].data && s.planes[LULL_PLANE_WEIGHT].data);
    s.spp = counts ? calloc(pixels, sizeof *s.spp) : NULL;
    s.weight = dropped ? calloc(pixels, sizeof *s.weight) : NULL;
    s.half = halves ? calloc(pixels, 3 * sizeof *s.half) : NULL;
    if ((counts && !s.spp) || (dropped && !s.weight) || (halves && !s.half)) {
        code = lull_host_no_memory(err, counts && !s.spp ? "samples per pixel" : "pixels with dropped samples");
        lull_host_hide(&s);
        return code;
    }
    for (uint32_t i = 0; i < b->count && (counts || dropped); i++)
        fill(&s, v, &b->list[i]);
    place(&s, v);
    *out = s;
    out->view = (struct lull_view){.struct_size = sizeof out->view,
                                   .x0 = v->x0,
                                   .y0 = v->y0,
                                   .x1 = v->x1,
                                   .y1 = v->y1,
                                   .planes = out->planes,
                                   .plane_count = LULL_PLANE_COUNT,
                                   .plane_stride = sizeof out->planes[0]};
    return LULL_OK;
}

void lull_host_hide(struct lull_host_shown *s)
{
    free(s->spp);
    free(s->weight);
    free(s->half);
}
