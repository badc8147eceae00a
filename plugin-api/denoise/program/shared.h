/*
 * The memory that lull-denoiser shares with the process that runs it (base/process.h): this, and then pictures,
 * [height][width][3] floats each, in the order of their names. The program is lull-denoiser LIBRARY, "" for the usual
 * places.
 */
#ifndef DENOISE_PROGRAM_SHARED_H
#define DENOISE_PROGRAM_SHARED_H

#include <stddef.h>

#include "denoise/oidn.h"

enum {
    SHARED_COLOR,
    SHARED_ALBEDO = LULL_OIDN_COLORS,
    SHARED_NORMAL,
    SHARED_OUT,
    SHARED_PICTURES = SHARED_OUT + LULL_OIDN_COLORS
};

struct shared {
    struct lull_oidn_form form; /* width 0: only make a device */
    int32_t colors, prefiltered;
    int32_t code;   /* BASE_ */
    char text[468]; /* the pictures begin at byte 512 */
};

static inline float *shared_picture(struct shared *s, int which)
{
    return (float *)(s + 1) + (size_t)which * 3 * (size_t)s->form.width * (size_t)s->form.height;
}

#endif
