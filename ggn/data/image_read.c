#include <math.h>
#include <stdlib.h>

#include "base/module.h"
#include "data/oiio.h"
#include "model/preprocess.h"

/* 0, or why OpenImageIO is not there. */
static int library(const char *path, const struct ggn_oiio_library **out, struct base_err *err)
{
    const struct ggn_oiio_library *linked = &ggn_oiio_library;
    *out = linked ? linked : base_module_symbol("ggn-images.so", "ggn_oiio_library", 0);
    return *out ? 0
                : base_fail(err, BASE_EIO,
                            "%s: images cannot be read: lib/ggn-images.so, which belongs beside this "
                            "program's bin/, or OpenImageIO cannot be loaded",
                            path);
}

static int is_light(float v) { return isfinite(v) && v >= 0.0f; }

/* Light as a display shows it. */
static int encode(const char *path, const struct ggn_imagef *linear, struct ggn_image8 *image, struct base_err *err)
{
    const size_t n = (size_t)linear->width * (size_t)linear->height;
    *image = (struct ggn_image8){.width = linear->width, .height = linear->height, .data = malloc(n * 3)};
    if (!image->data)
        return base_fail_nomem(err, path);
    for (size_t i = 0; i < n; i++) {
        const float *rgb = linear->data + 3 * i;
        for (size_t c = 0; c < 3; c++)
            image->data[3 * i + c] = ggn_preprocess(rgb[c], NULL, NULL);
        image->clipped += !(is_light(rgb[0]) && is_light(rgb[1]) && is_light(rgb[2]));
    }
    return 0;
}

int ggn_image8_read(const char *path, struct ggn_image8 *image, struct base_err *err)
{
    const struct ggn_oiio_library *l;
    struct ggn_imagef linear = {0};
    struct ggn_image8 out = {0};
    int is_float = 0, rc = library(path, &l, err);
    if (!rc)
        rc = l->read_display(path, &out, &is_float, err);
    if (!rc && is_float) {
        rc = l->read_linear(path, &linear, err);
        if (!rc)
            rc = encode(path, &linear, &out, err);
        ggn_imagef_release(&linear);
    }
    if (!rc)
        *image = out;
    return rc;
}

int ggn_imagef_read_channel(const char *path, const char *channel, struct ggn_imagef *image, struct base_err *err)
{
    const struct ggn_oiio_library *l;
    int rc = library(path, &l, err);
    return rc ? rc : l->read_channel(path, channel, image, err);
}
