#include "report/report.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/colour.h"
#include "picture/read.h"

static const double MOST_CODE = 65535.0;

/* The next number of the text, in a range. */
static int next(const char **at, double low, double high, double *out)
{
    char *end;
    *out = strtod(*at, &end);
    int found = end != *at && (*end == ' ' || *end == '\0') && *out >= low && *out <= high;
    *at = end + strspn(end, " ");
    return found;
}

static int read_view(const char *path, struct report_view *out, struct base_err *err)
{
    struct pic_attribute attribute = {.name = "lull:view"};
    struct pic_window window;
    struct report_view v = {0};
    if (pic_read_header(path, &window, &attribute, 1, NULL) != 0)
        attribute.text[0] = '\0'; /* no picture of Lull's; whoever reads its pixels says what is wrong */
    if (attribute.text[0] != '\0') {
        const char *at = attribute.text;
        int good =
            next(&at, -64.0, 64.0, &v.low) && next(&at, 1e-3, 1e3, &v.per_octave) && next(&at, 0.0, MOST_CODE, &v.black);
        while (good && *at != '\0')
            good = v.count < REPORT_MOST_GREYS && next(&at, 0.0, MOST_CODE, &v.codes[v.count++]);
        if (!good || v.count < 2)
            return base_fail(err, BASE_EINVAL, "%s: its lull:view makes no sense (expected LOW PER_OCTAVE CODE CODE CODE …)",
                             path);
    }
    *out = v;
    return 0;
}

/* The 8-bit code of a value of light; 0 for what is no number. */
static uint8_t code_of(const struct report_view *v, double value)
{
    if (v->count == 0)
        return base_srgb_code(value);
    const double darkest = exp2(v->low), place = value > darkest ? (log2(value) - v->low) * v->per_octave : 0.0;
    double code;
    if (!(value > 0.0))
        code = isnan(value) ? 0.0 : v->black;
    else if (value <= darkest)
        code = v->black + (v->codes[0] - v->black) * value / darkest;
    else if (place >= v->count - 1)
        code = v->codes[v->count - 1];
    else {
        const int i = (int)place;
        code = v->codes[i] + (v->codes[i + 1] - v->codes[i]) * (place - i);
    }
    return (uint8_t)lround(code * 255.0 / MOST_CODE);
}

uint8_t *report_view_layer(const char *path, const char *layer, const struct report_view *view, const struct pic_image *like)
{
    const size_t values = 3 * (size_t)like->width * (size_t)like->height;
    struct pic_image image = {0};
    uint8_t *codes = NULL;
    if (pic_read_layer(path, layer, &image, NULL) == 0 && image.width == like->width && image.height == like->height)
        codes = malloc(values);
    for (size_t i = 0; codes && i < values; i++)
        codes[i] = code_of(view, (double)image.f32[i]);
    pic_release(&image);
    return codes;
}

int report_view_picture(const char *path, struct report_view *view, struct pic_image *out, struct base_err *err)
{
    struct pic_image picture = {0};
    int rc = read_view(path, view, err);
    if (!rc)
        rc = pic_read_display(path, &picture, err);
    if (rc)
        return rc;
    if (view->count > 0) {
        uint8_t *codes = report_view_layer(path, "", view, &picture);
        if (!codes) {
            pic_release(&picture);
            return base_fail(err, BASE_EINVAL, "%s: it has a view, lull:view, but no channels R, G and B", path);
        }
        free(picture.u8);
        picture.u8 = codes;
    }
    *out = picture;
    return 0;
}
