/*
 * What has been sampled so far, per pixel: sums in double, one array per plane, planes on demand only.
 *
 * A sample with a non-finite radiance is dropped: it enters no sum of radiance, and `dropped` counts it, so that the
 * mean of a pixel is sum / (its block's spp - dropped). Half A is a fixed half of the sample indices (pt_film_in_half).
 * Different threads may work on different pixels at the same time; the bytes depend on the order of samples within a pixel
 * only.
 */
#ifndef PT_RENDER_FILM_H
#define PT_RENDER_FILM_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/colour.h"
#include "base/err.h"
#include "scene/vec.h"
#include "integ/integrator.h"

enum {
    PT_FILM_COLOR = 1,   /* always there */
    PT_FILM_HALF = 2,    /* radiance of half A */
    PT_FILM_MOMENT2 = 4, /* squared luminance */
    PT_FILM_ALBEDO = 8,
    PT_FILM_NORMAL = 16,
    PT_FILM_DEPTH = 32,
    PT_FILM_ALL = 63
};
#define PT_FILM_AUX (PT_FILM_ALBEDO | PT_FILM_NORMAL | PT_FILM_DEPTH)

struct pt_film {
    int x0, y0, x1, y1;     /* the part of the image that is kept, end exclusive */
    uint32_t planes;        /* PT_FILM_* */
    size_t pixels;          /* (x1-x0)(y1-y0); the arrays below are in rows from the top, owned, NULL when not in planes */
    double *color;          /* [pixels, 3] sums */
    double *half;           /* [pixels, 3] sums over half A */
    double *moment2;        /* [pixels] sums */
    double *albedo;         /* [pixels, 3] sums */
    double *normal;         /* [pixels, 3] sums */
    double *depth;          /* [pixels] mean over the samples that hit something */
    uint32_t *depth_hits;   /* [pixels] samples in depth */
    uint32_t *dropped;      /* [pixels] */
    uint32_t *dropped_half; /* [pixels] of half A; with PT_FILM_HALF */
    size_t bytes;           /* of all arrays */
};

/* One pixel of the film while it is being sampled. */
struct pt_film_pixel {
    double color[3], half[3], moment2, albedo[3], normal[3], depth;
    uint32_t depth_hits, dropped, dropped_half;
};

/* Zeroed planes for the pixels of [x0, x1) x [y0, y1), which must not be empty. On failure *film is untouched. */
int pt_film_init(struct pt_film *film, int x0, int y0, int x1, int y1, uint32_t planes, struct base_err *err);
void pt_film_release(struct pt_film *film);
/* Bytes per pixel that these planes cost. */
size_t pt_film_pixel_bytes(uint32_t planes);

/* Index of a pixel given in image coordinates. */
static inline size_t pt_film_index(const struct pt_film *film, int x, int y)
{
    return (size_t)(y - film->y0) * (size_t)(film->x1 - film->x0) + (size_t)(x - film->x0);
}

/* Is this sample in half A? Even and odd samples are sequences of their own (sample/sampler.h). */
static inline int pt_film_in_half(uint32_t sample) { return !(sample & 1); }
/* How many of the samples [0, spp) are in half A. */
static inline uint64_t pt_film_half_spp(uint64_t spp) { return spp / 2 + spp % 2; }

static inline void pt_film_exchange_bytes(void *film, void *pixel, size_t size, int store)
{
    memcpy(store ? film : pixel, store ? pixel : film, size);
}

/* A pixel between the film and *p. store: a constant, so that each way is compiled by itself. */
static inline void pt_film_exchange(const struct pt_film *f, size_t i, struct pt_film_pixel *p, int store)
{
    pt_film_exchange_bytes(f->color + 3 * i, p->color, sizeof p->color, store);
    pt_film_exchange_bytes(f->dropped + i, &p->dropped, sizeof p->dropped, store);
    if (f->planes & PT_FILM_HALF) {
        pt_film_exchange_bytes(f->half + 3 * i, p->half, sizeof p->half, store);
        pt_film_exchange_bytes(f->dropped_half + i, &p->dropped_half, sizeof p->dropped_half, store);
    }
    if (f->planes & PT_FILM_MOMENT2)
        pt_film_exchange_bytes(f->moment2 + i, &p->moment2, sizeof p->moment2, store);
    if (f->planes & PT_FILM_ALBEDO)
        pt_film_exchange_bytes(f->albedo + 3 * i, p->albedo, sizeof p->albedo, store);
    if (f->planes & PT_FILM_NORMAL)
        pt_film_exchange_bytes(f->normal + 3 * i, p->normal, sizeof p->normal, store);
    if (f->planes & PT_FILM_DEPTH) {
        pt_film_exchange_bytes(f->depth + i, &p->depth, sizeof p->depth, store);
        pt_film_exchange_bytes(f->depth_hits + i, &p->depth_hits, sizeof p->depth_hits, store);
    }
}

/* A pixel out of the film and back; sums of planes that it does not have begin with 0. */
static inline void pt_film_load(const struct pt_film *f, size_t i, struct pt_film_pixel *p)
{
    *p = (struct pt_film_pixel){0};
    pt_film_exchange(f, i, p, 0);
}

static inline void pt_film_store(struct pt_film *f, size_t i, struct pt_film_pixel *p) { pt_film_exchange(f, i, p, 1); }

static inline void pt_film_sum(double sums[3], pt_vec3 v)
{
    sums[0] += (double)v.x;
    sums[1] += (double)v.y;
    sums[2] += (double)v.z;
}

/* Adds one sample; in_half: pt_film_in_half of its index, worked out once for many pixels. Returns 0 when it was dropped. */
static inline int pt_film_add(struct pt_film_pixel *p, uint32_t planes, int in_half, const struct pt_path_result *r)
{
    if (planes & PT_FILM_AUX) {
        if (v3_is_finite(r->albedo))
            pt_film_sum(p->albedo, r->albedo);
        if (v3_is_finite(r->normal_world))
            pt_film_sum(p->normal, r->normal_world);
        if (isfinite(r->depth))
            p->depth += ((double)r->depth - p->depth) / ++p->depth_hits;
    }
    if (!v3_is_finite(r->radiance)) {
        p->dropped++;
        p->dropped_half += in_half && (planes & PT_FILM_HALF);
        return 0;
    }
    pt_film_sum(p->color, r->radiance);
    if (in_half && (planes & PT_FILM_HALF))
        pt_film_sum(p->half, r->radiance);
    if (planes & PT_FILM_MOMENT2) {
        double luminance = base_luminance((double)r->radiance.x, (double)r->radiance.y, (double)r->radiance.z);
        p->moment2 += luminance * luminance;
    }
    return 1;
}

/* The arrays that are there, in a fixed order, for saving and loading: of each the part from pixel `first` on for so many.
 * Returns how many of out[] were filled. */
enum { PT_FILM_ARRAYS = 9 };
struct pt_film_array {
    void *data; /* borrows */
    size_t bytes;
};
int pt_film_list_arrays(const struct pt_film *film, size_t first, size_t pixels, struct pt_film_array out[PT_FILM_ARRAYS]);

/* Mean radiance of a pixel after spp samples; black when there is none. */
void pt_film_mean(const struct pt_film *film, size_t index, uint64_t spp, double rgb[3]);
/* Mean of half A, half_spp = pt_film_half_spp(spp). */
void pt_film_half_mean(const struct pt_film *film, size_t index, uint64_t half_spp, double rgb[3]);

#endif
