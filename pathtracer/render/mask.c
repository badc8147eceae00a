#include "render/mask.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "picture/read.h"

static float sample(const struct pic_image *image, size_t i)
{
    float v = image->u8 ? (float)image->u8[i] / 255.0f : image->f32[i];
    return v > 0.0f ? fminf(v, 1.0f) : 0.0f;
}

int pt_mask_read(const char *path, int width, int height, struct lull_plane *out, struct base_err *err)
{
    struct pic_image image;
    int rc = pic_read(path, &image, err);
    if (rc)
        return rc == BASE_EIO ? (err->code = BASE_EINVAL) : rc;
    if (image.width != width || image.height != height) {
        rc = base_fail(err, BASE_EINVAL, "--mask %s: it has %dx%d pixels, the image %dx%d", path, (int)image.width,
                       (int)image.height, width, height);
        goto out;
    }
    size_t pixels = (size_t)width * (size_t)height, channels = (size_t)image.channels, colours = channels < 3 ? 1 : 3;
    float *grey = malloc(pixels * sizeof *grey);
    if (!grey) {
        rc = base_fail_nomem(err, "mask");
        goto out;
    }
    for (size_t i = 0; i < pixels; i++) {
        float sum = 0.0f;
        for (size_t c = 0; c < colours; c++)
            sum += sample(&image, channels * i + c);
        grey[i] = sum / (float)colours;
    }
    *out = (struct lull_plane){.data = grey,
                               .stride_x = sizeof *grey,
                               .stride_y = (int64_t)sizeof *grey * width,
                               .stride_c = sizeof *grey,
                               .scale = 1.0,
                               .type = LULL_TYPE_F32,
                               .normaliser = LULL_NORM_ONE,
                               .channels = 1};
out:
    pic_release(&image);
    return rc;
}

void pt_mask_release(struct lull_plane *mask)
{
    free((void *)(uintptr_t)mask->data);
    *mask = (struct lull_plane){0};
}
