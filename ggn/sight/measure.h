/*
 * What is measured of a block's image beside its pixels: the law of visible noise (sight/visibility.h), and what tells when
 * that law may err. Residual networks are anchored to the first and given the rest.
 *
 * A meter owns the scratch memory for blocks that its room was made for; one call at a time per meter.
 */
#ifndef GGN_MODEL_MEASURE_H
#define GGN_MODEL_MEASURE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct ggn_measure {
    double visible;   /* r; 0: no noise; NaN: nothing tells it, and the rest is meaningless */
    double texture;   /* mean over the patches of log2(s + 2) */
    double lightness; /* mean L*, 1 = white */
    double peak;      /* log2 of r over the root mean square of the noise in the same units: 0.651 for Gaussian noise */
    double uneven;    /* log2 of the noisiest patch over r, >= 0 */
};

/* A residual network's scalars of a window: log2 of the newest image's error, how far log2 r has moved from -1/2 log2 n
 * over the window and since the last image, and the newest image's texture, lightness, peak and unevenness, each about 0. */
enum { GGN_SCALARS = 7 };

struct ggn_meter {
    float *rgb[2];       /* the caller's pictures: linear light, [3][P] */
    float *lightness[2]; /* [P] */
    float *blurred;      /* [P] */
    double *texture;     /* [patches] */
    double *scratch;     /* of sight/visibility.h */
    void *memory;        /* owns all of it */
};

/* The most that any of some blocks has; starts at zero. */
struct ggn_meter_room {
    size_t pixels, patches;
    int width;
};
void ggn_meter_make_room(struct ggn_meter_room *room, int width, int height);
int ggn_meter_init(struct ggn_meter *meter, const struct ggn_meter_room *room, struct base_err *err);
void ggn_meter_release(struct ggn_meter *meter);

/* Of the two pictures in meter->rgb, which differ by noise: `split` takes the difference of their L* to noise of the mean's
 * strength. keep_texture: as of the call before, on a block of this shape. map: [P] gets how often each pixel's noise is
 * what is hidden, GGN_VISIBLE_CODES per 1 of r, or NULL. */
void ggn_measure(const struct ggn_meter *meter, int width, int height, double split, int keep_texture,
                 struct ggn_measure *out, uint8_t *map);
#define GGN_VISIBLE_CODES 96.0
/* Only r and the mean lightness, which take most of the time but not all. */
double ggn_measure_visible(const struct ggn_meter *meter, int width, int height, double split, int keep_texture,
                           double *lightness);

/* window: of S images, oldest first, taken at spp; error: of the newest, in log2. Unknown ones say nothing: 0. */
void ggn_measure_scalars(const struct ggn_measure *window, const double *spp, int length, double error,
                         float scalars[GGN_SCALARS]);

/* log2 of an error >= 0; no less than that of noise nobody could measure. NaN stays. */
double ggn_measure_octaves(double error);

/* What a residual model answers, in octaves of noise: the law's log2 error and the network's correction, which stays within
 * `reach`. A network that is no number counts as one that sees all the noise it may. */
double ggn_residual_correction(double network, double reach);

#endif
