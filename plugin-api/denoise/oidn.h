/*
 * Open Image Denoise 2, found when it is asked for: nothing is linked, nothing else needs it.
 *
 * The library is looked for, in this order: the path given, the environment's LULL_OIDN (each a file, or a folder that holds
 * one), the loader's own path, and lib/ of the folder oidn beside the caller's library or above it (build/oidn, where
 * scripts/setup --denoiser puts it). One device holds the threads; filters are made per call.
 *
 * lull_oidn_run gives the same bits for every number of threads and for every run on one processor, but not for
 * every instruction set. A crop gives the bits of the whole picture inside if its corner lies on a multiple of
 * LULL_OIDN_GRID of the frame and it has LULL_OIDN_HALO pixels around (as far as the frame reaches); measured with 2.5.1.
 *
 * Calls on one struct lull_oidn must not overlap; different ones may.
 */
#ifndef DENOISE_OIDN_H
#define DENOISE_OIDN_H

#include "base/err.h"

enum { LULL_OIDN_GRID = 16, LULL_OIDN_HALO = 96 };

enum lull_oidn_quality { LULL_OIDN_FAST = 4, LULL_OIDN_BALANCED = 5, LULL_OIDN_HIGH = 6 }; /* the library's own numbers */

struct lull_oidn;

/* Interleaved float pictures [height][width][3], linear. */
struct lull_oidn_picture {
    int width, height;
    const float *color;           /* any exposure; negative values and what is no number count as 0 */
    const float *albedo, *normal; /* of the first non-specular hit, [0, 1], [-1, 1]; may be NULL, normal only with albedo */
    double exposure;              /* factor to where white is 1; > 0 */
};

/* threads: of the device; 0: all processors. *out is owned by the caller. BASE_EINVAL: not found (one line says how to get
 * it), of another major version, or its device cannot be made. */
int lull_oidn_open(const char *path, int threads, struct lull_oidn **out, struct base_err *err);
void lull_oidn_close(struct lull_oidn *oidn);
/* "2.5.1". */
const char *lull_oidn_version(const struct lull_oidn *oidn);

/* Denoises into out, [height][width][3], in the units of color; finite everywhere. cancelled(data) is asked now and then;
 * not 0 ends the call with BASE_EINVAL "cancelled". BASE_ENOMEM; BASE_EINVAL: the library's own error, in its words. out is
 * undefined after a failure. */
int lull_oidn_run(struct lull_oidn *oidn, const struct lull_oidn_picture *picture, enum lull_oidn_quality quality,
                  int (*cancelled)(void *data), void *data, float *out, struct base_err *err);

struct lull_oidn_box { /* pixels, half open, none empty */
    int x0, y0, x1, y1;
};

/* What to denoise for the pixels of `core`: `halo` pixels around as far as the frame reaches, the corner on its grid. */
struct lull_oidn_box lull_oidn_box_of(struct lull_oidn_box core, int halo, struct lull_oidn_box frame);

#endif
