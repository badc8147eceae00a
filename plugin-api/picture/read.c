#include "picture/read.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/colour.h"
#include "base/guard.h"
#include "base/module.h"
#include "picture/oiio.h"

static int find_library(const char *name, const struct pic_library **out, struct base_err *err)
{
    static _Atomic(const struct pic_library *) loaded;
    const struct pic_library *linked = &pic_library;
    struct base_err why = {0};
    *out = linked ? linked : loaded;
    if (*out)
        return 0;
    base_guard_begin("the image library", BASE_GUARD_LOADING);
    *out = base_module_symbol("lull-images.so", "pic_library", 0, &why);
    loaded = *out;
    base_guard_end();
    return *out ? 0
           : why.code == BASE_ENOMEM
               ? base_fail_nomem(err, name)
               : base_fail(err, BASE_EIO,
                           "%.200s: images cannot be read: lib/lull/modules/lull-images.so beside this "
                           "program's bin/: %.200s",
                           name, why.text);
}

static int answer(const struct pic_request *request, struct pic_image *out, struct base_err *err)
{
    const struct pic_library *l;
    int rc = find_library(request->name, &l, err);
    if (rc)
        return rc;
    base_guard_begin(request->name, BASE_GUARD_CALLS);
    rc = l->read(request, out, err);
    base_guard_end();
    return rc;
}

int pic_read_header(const char *path, struct pic_window *window, struct pic_attribute *attributes, int count,
                    struct base_err *err)
{
    const struct pic_library *l;
    int rc = find_library(path, &l, err);
    return rc ? rc : l->read_header(path, window, attributes, count, err);
}

int pic_read(const char *path, struct pic_image *out, struct base_err *err)
{
    return answer(&(struct pic_request){.wanted = PIC_STORED, .name = path}, out, err);
}

int pic_read_memory(const char *name, const void *data, size_t size, struct pic_image *out, struct base_err *err)
{
    return answer(&(struct pic_request){.wanted = PIC_STORED, .name = name, .data = data ? data : "", .size = size}, out,
                  err);
}

int pic_read_channel(const char *path, const char *channel, struct pic_image *out, struct base_err *err)
{
    return answer(&(struct pic_request){.wanted = PIC_CHANNEL, .name = path, .channel = channel}, out, err);
}

int pic_read_layer(const char *path, const char *layer, struct pic_image *out, struct base_err *err)
{
    struct pic_image image;
    int rc = answer(&(struct pic_request){.wanted = PIC_LAYER, .name = path, .channel = layer}, &image, err);
    if (rc)
        return rc;
    rc = pic_to_rec709(path, &image, err);
    if (rc)
        pic_release(&image);
    else
        *out = image;
    return rc;
}

static const double least_area = 1e-6; /* of a triangle that is no rounding error */

static double det3(const double a[3], const double b[3], const double c[3])
{
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1]) + c[0] * (a[1] * b[2] - a[2] * b[1]);
}

/* columns · out = v, by Cramer's rule. */
static void solve3(double columns[3][3], const double v[3], double out[3])
{
    const double det = det3(columns[0], columns[1], columns[2]);
    out[0] = det3(v, columns[1], columns[2]) / det;
    out[1] = det3(columns[0], v, columns[2]) / det;
    out[2] = det3(columns[0], columns[1], v) / det;
}

/* columns: XYZ of red, green and blue, which add up to the white of luminance 1 (SMPTE RP 177). */
static int find_xyz(const float primaries[8], double columns[3][3])
{
    double p[4][3], weight[3];
    for (int i = 0; i < 4; i++) {
        const double x = (double)primaries[2 * i], y = (double)primaries[2 * i + 1];
        if (!isfinite(x) || !isfinite(y))
            return 0;
        p[i][0] = x;
        p[i][1] = y;
        p[i][2] = 1 - x - y;
    }
    if (!(p[3][1] > 0) || !(fabs(det3(p[0], p[1], p[2])) > least_area))
        return 0;
    solve3(p, p[3], weight);
    for (int i = 0; i < 3; i++) {
        if (!(weight[i] > 0))
            return 0;
        for (int k = 0; k < 3; k++)
            columns[i][k] = p[i][k] * weight[i] / p[3][1];
    }
    return 1;
}

int pic_primaries_to_rec709(const float primaries[8], double m[3][3])
{
    static const float rec709[8] = PIC_REC709_PRIMARIES;
    double from[3][3], to[3][3];
    if (!find_xyz(primaries, from) || !find_xyz(rec709, to))
        return 0;
    for (int i = 0; i < 3; i++) {
        double column[3];
        solve3(to, from[i], column);
        for (int k = 0; k < 3; k++)
            m[k][i] = column[k];
    }
    return 1;
}

int pic_to_rec709(const char *name, struct pic_image *image, struct base_err *err)
{
    const size_t n = (size_t)image->width * (size_t)image->height, channels = (size_t)image->channels;
    double m[3][3];
    if (!image->has_primaries || !image->f32)
        return 0;
    if (!pic_primaries_to_rec709(image->primaries, m))
        return base_fail(err, BASE_EINVAL, "%s: its chromaticities are no colour space", name);
    for (size_t i = 0; i < n; i++) {
        float *rgb = image->f32 + i * channels;
        const double r = (double)rgb[0], g = (double)rgb[1], b = (double)rgb[2];
        for (int c = 0; c < 3 && isfinite(r + g + b); c++) /* what is not finite stays so, whoever reads it decides */
            rgb[c] = (float)(m[c][0] * r + m[c][1] * g + m[c][2] * b);
    }
    image->has_primaries = 0;
    return 0;
}

static int is_light(float v) { return isfinite(v) && v >= 0.0f; }

int pic_encode(const char *name, struct pic_image *image, struct base_err *err)
{
    const size_t n = (size_t)image->width * (size_t)image->height;
    image->u8 = malloc(n * 3);
    if (!image->u8)
        return base_fail_nomem(err, name);
    for (size_t i = 0; i < n; i++) {
        const float *rgb = image->f32 + 3 * i;
        for (size_t c = 0; c < 3; c++)
            image->u8[3 * i + c] = base_srgb_code((double)rgb[c]);
        image->clipped += !(is_light(rgb[0]) && is_light(rgb[1]) && is_light(rgb[2]));
    }
    return 0;
}

int pic_read_light(const char *path, struct pic_image *out, struct base_err *err)
{
    struct pic_image image;
    int rc = answer(&(struct pic_request){.wanted = PIC_DISPLAY, .name = path}, &image, err);
    const int has_image = !rc;
    if (!rc && image.f32) {
        rc = pic_to_rec709(path, &image, err);
        if (!rc)
            rc = pic_encode(path, &image, err);
    }
    if (rc && has_image)
        pic_release(&image);
    if (!rc)
        *out = image;
    return rc;
}

int pic_read_display(const char *path, struct pic_image *out, struct base_err *err)
{
    int rc = pic_read_light(path, out, err);
    if (!rc) {
        free(out->f32);
        out->f32 = NULL;
    }
    return rc;
}

void pic_release(struct pic_image *image)
{
    free(image->u8);
    free(image->f32);
    *image = (struct pic_image){0};
}
