/* The parts of lull-report. Errors as of picture/read.h. */
#ifndef REPORT_REPORT_H
#define REPORT_REPORT_H

#include "base/err.h"
#include "picture/image.h"

enum { REPORT_MOST_GREYS = 2048, REPORT_MOST_FRAMES = 10000 };

/* The report of a render of which only the picture was kept: from its layers lull.… and attributes lull:…. *report: JSON as
 * lull_host_page takes it, the caller's; NULL after a failure. It has what the picture knows: blocks cut to the stored
 * pixels, without times and checks. BASE_EINVAL also when layers are missing, or layers and attributes contradict each
 * other. */
int report_from_exr(const char *path, char **report, struct base_err *err);

/* A shot as a moving picture, an animated PNG: every frame beside the map of its samples, which has one scale for all
 * frames. pictures: of lull-render, of one size, with the layer lull.spp; 1 … REPORT_MOST_FRAMES. Each is shown for
 * 1 / fps s; fps from 1 to 240. BASE_EINVAL also when sizes differ or the layer is missing. */
int report_sheet(const char *const *pictures, int count, double fps, const char *path, struct base_err *err);

/* The view that a picture was made for: how its program shows greys, kept with the picture as the attribute lull:view, "LOW
 * PER_OCTAVE BLACK CODE CODE …". sRGB codes, 0 to 65535, of the greys 0 and 2^(low + i / per_octave); between them straight
 * lines. */
struct report_view {
    double low, per_octave;
    int count; /* 0: the sRGB transfer alone */
    double black, codes[REPORT_MOST_GREYS];
};

/* The view of the picture in this file, and pic_read_display (picture/read.h) as it shows it. The view of a file without
 * such an attribute is the sRGB transfer; BASE_EINVAL for any other attribute. */
int report_view_picture(const char *path, struct report_view *view, struct pic_image *out, struct base_err *err);
/* Codes of a layer (pic_read_layer), [height][width][3], the caller's; NULL: the file does not have it in this size, or no
 * memory. */
uint8_t *report_view_layer(const char *path, const char *layer, const struct report_view *view,
                           const struct pic_image *like);

#endif
