/* The view that a picture was made for: how its program shows greys, kept with the picture as the attribute lull:view. */
#ifndef REPORT_SHOWN_AS_H
#define REPORT_SHOWN_AS_H

#include "base/err.h"
#include "picture/image.h"

enum { REPORT_MOST_GREYS = 2048 };

/* sRGB codes, 0 to 65535, of the greys 0 and 2^(low + i / per_octave); between them straight lines. */
struct report_view {
    double low, per_octave;
    int count; /* 0: the sRGB transfer alone */
    double black, codes[REPORT_MOST_GREYS];
};

/* "LOW PER_OCTAVE BLACK CODE CODE …"; "": the sRGB transfer alone. BASE_EINVAL, with `path` in its text, for anything
 * else. */
int report_view_parse(const char *text, const char *path, struct report_view *out, struct base_err *err);
/* Of the picture in this file; that of a file without such an attribute is the sRGB transfer. */
int report_view_read(const char *path, struct report_view *out, struct base_err *err);

/* The 8-bit code of a value of light; 0 for what is no number. */
uint8_t report_view_code(const struct report_view *view, double value);

/* pic_read_display (picture/read.h), as the view shows it. */
int report_view_picture(const char *path, const struct report_view *view, struct pic_image *out, struct base_err *err);
/* Codes of a layer (pic_read_layer), [height][width][3], the caller's; NULL: the file does not have it in this size, or no
 * memory. */
uint8_t *report_view_layer(const char *path, const char *layer, const struct report_view *view,
                           const struct pic_image *like);

#endif
