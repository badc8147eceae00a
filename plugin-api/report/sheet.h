/* A shot as a moving picture: every frame beside the map of its samples, which has one scale for all frames. */
#ifndef REPORT_SHEET_H
#define REPORT_SHEET_H

#include "base/err.h"

enum { REPORT_MOST_FRAMES = 10000 };

/* pictures: of lull-render, of one size, with the layer lull.spp; 1 … REPORT_MOST_FRAMES. Each is shown for 1 / fps s.
 * Writes an animated PNG. Errors as of picture/read.h; BASE_EINVAL also when sizes differ or the layer is missing. */
int report_sheet(const char *const *pictures, int count, double fps, const char *path, struct base_err *err);

#endif
