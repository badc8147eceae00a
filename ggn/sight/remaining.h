/*
 * How visible the noise is that remains in an image, block by block, against a reference of the same view.
 *
 * The noise of a block is the difference of its lightness to the reference's (CIE L* of the 8-bit display images), its
 * texture the reference's own; the rest is the observer's (sight/visibility.h). What noise the reference has itself
 * counts as the image's: with k times the samples it adds a factor of sqrt(1 + 1/k).
 *
 * A second reference, as good and independent of the first, takes that noise out. For the blurred differences g and h of a
 * pixel to the two, m = (g + h) / 2 is the error and noise, d = (g - h) / 2 the same noise alone, and the mean of
 * Re (m + i d)^6 = m^6 - 15 m^4 d^2 + 15 m^2 d^4 - d^6 is that of the sixth power of the error, for Gaussian noise (its
 * square is g h). Texture is then what the two share. Thread-safe.
 */
#ifndef GGN_OBSERVER_REMAINING_H
#define GGN_OBSERVER_REMAINING_H

#include "base/err.h"
#include "picture/image.h"
#include "sight/observer.h"

struct ggn_remaining {
    int x, y, width, height; /* pixels; from the top left corner */
    double error;            /* visible noise over the level: 1 is just not seen, 2 twice that */
};

/* Blocks of side `block` >= 1 that cover width x height pixels, row by row; those at the right and bottom may be smaller. */
int ggn_remaining_count(int width, int height, int block);

/* references: the second may be NULL; all of equal size. blocks: [ggn_remaining_count]. map: [height][width], each pixel's
 * blurred difference over its patch's limit (of two, their mean), or NULL. BASE_ENOMEM. */
int ggn_remaining(const struct ggn_observer *observer, const struct pic_image *const references[2],
                  const struct pic_image *image, int block, struct ggn_remaining *blocks, float *map, struct base_err *err);

#endif
