/*
 * Open Image Denoise 2, in a process of its own: nothing is linked, nothing else needs it.
 *
 * The library starts a thread for each device, allocates while it works and, out of memory, ends the process that it is in.
 * None of that may happen to a host of criteria, so the program lib/lull/modules/lull-denoiser (denoise/program) does it,
 * with pictures in shared memory; whatever happens there is an error here. It is a child process from lull_oidn_open to
 * lull_oidn_close, which waits from run to run. It ends when this process does, and when a run fails; the next run starts
 * it anew. The library is looked for in this order:
 *
 * - the path given, a file or a folder that holds one;
 * - the environment's LULL_OIDN, likewise;
 * - the loader's own path;
 * - lib/ of a folder oidn beside the program or up to five folders above it: scripts/setup --denoiser makes build/oidn;
 * - lib/ of lull/oidn in XDG_DATA_HOME (~/.local/share) and of /usr/local/lib/lull/oidn: lull-denoiser-setup makes them.
 *
 * The same bits for every number of threads and for every run on one processor, but not for every instruction set. A crop
 * whose sides lie on multiples of LULL_OIDN_GRID of the frame, or where the frame ends, gives the bits of the whole picture
 * in all but the outermost LULL_OIDN_HALO pixels. That is how far the network sees, from its convolutions: 2 and 3 pixels in
 * the picture's own size, then twice 1 and 2 in each of four smaller ones, are five cells of the grid. Measured with 2.5.1:
 * of a crop with 80 pixels around no value differs, with 64 a quarter of them.
 *
 * A denoiser errs most where a picture ends: outermost pixels are several times as far off as others, but not in a picture
 * that is mirrored on for LULL_OIDN_MARGIN pixels (tests/unit/base_oidn.c). A crop that reaches the end of the frame must be
 * mirrored there, too, or it is not what the whole picture is.
 *
 * Calls on one struct lull_oidn must not overlap; different ones may.
 */
#ifndef DENOISE_OIDN_H
#define DENOISE_OIDN_H

#include <stdint.h>

#include "base/err.h"

enum { LULL_OIDN_GRID = 16, LULL_OIDN_HALO = 80, LULL_OIDN_MARGIN = LULL_OIDN_GRID, LULL_OIDN_COLORS = 2 };

enum lull_oidn_quality { LULL_OIDN_FAST = 4, LULL_OIDN_BALANCED = 5, LULL_OIDN_HIGH = 6 }; /* the library's own numbers */

struct lull_oidn;

struct lull_oidn_form { /* of the pictures; all of one size */
    int32_t width, height;
    int32_t albedo, normal; /* whether there are such pictures; normal only with albedo */
    int32_t quality;        /* LULL_OIDN_ */
    int32_t threads;        /* 0: all processors */
    int32_t margin;         /* pixels around each picture in which it is mirrored, a multiple of LULL_OIDN_GRID */
    float exposure;         /* factor to where white is 1; > 0 */
};

/* Interleaved float pictures [height][width][3], linear. */
struct lull_oidn_pictures {
    const float *color[LULL_OIDN_COLORS]; /* any exposure; negative and no number count as 0; NULL: not given */
    const float *albedo;                  /* of the first non-specular hit, in [0, 1] */
    const float *normal;                  /* there, in [-1, 1] */
    float *out[LULL_OIDN_COLORS];         /* of each color, in its units; finite everywhere */
    int32_t prefiltered;                  /* albedo and normal are denoised first, each by itself, and count as clean */
};

/* Which of the pixels [0, n) stands at i, which may lie outside, where a picture is mirrored; n > 0. */
static inline int32_t lull_oidn_mirrored(int32_t i, int32_t n)
{
    const int32_t period = n > 1 ? 2 * (n - 1) : 1, at = (i % period + period) % period;
    return at < n ? at : period - at;
}

/* *out is owned by the caller. BASE_EINVAL: no lull-denoiser; no library (one line says how to get it), one of another major
 * version, or one whose device cannot be made. */
int lull_oidn_open(const char *library, struct lull_oidn **out, struct base_err *err);
void lull_oidn_close(struct lull_oidn *oidn);

/* Takes the memory that pictures of this form need, 72 bytes a pixel; the program takes some 600 more in a run. */
int lull_oidn_prepare(struct lull_oidn *oidn, const struct lull_oidn_form *form, struct base_err *err);
/* From now on pictures of this size, which need no more memory than those of the form. */
void lull_oidn_resize(struct lull_oidn *oidn, int32_t width, int32_t height);

/* Denoises each color of the prepared form. cancelled(data), which may be NULL, is asked 50 times a second; not 0 ends the
 * program and the call, with BASE_ECANCELLED. Allocates nothing. BASE_ENOMEM; BASE_EIO: the program cannot be run;
 * BASE_EINVAL: the library's own error, in its words, or that the program died. out is undefined after a failure. */
int lull_oidn_run(struct lull_oidn *oidn, const struct lull_oidn_pictures *pictures, int (*cancelled)(void *data),
                  void *data, struct base_err *err);

#endif
