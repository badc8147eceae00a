#include "render/mask.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/options.h"
#include "image/oiio.h"
#include "render/host_find.h"

static const double WHITE_SCALE = 0.25;

static float sample(const struct pt_oiio_image *image, size_t i)
{
    float v = image->u8 ? (float)image->u8[i] / 255.0f : image->f32[i];
    return v > 0.0f ? fminf(v, 1.0f) : 0.0f;
}

int pt_mask_read(const char *path, int width, int height, struct pt_mask *out, struct base_err *err)
{
    struct pt_oiio_image image;
    int rc = pt_oiio_read(path, &image, err);
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
    *out = (struct pt_mask){width, height, grey};
out:
    pt_oiio_release(&image);
    return rc;
}

void pt_mask_release(struct pt_mask *mask)
{
    free(mask->grey);
    *mask = (struct pt_mask){0};
}

int pt_mask_step(const struct pt_mask *mask, const struct pt_block *b)
{
    float lightest = 0.0f;
    for (int y = b->y0; y < b->y1; y++)
        for (int x = b->x0; x < b->x1; x++)
            lightest = fmaxf(lightest, mask->grey[(size_t)y * (size_t)mask->width + (size_t)x]);
    return (int)(lightest * PT_MASK_STEPS + 0.5f);
}

double pt_mask_scale(int step)
{
    return pow(WHITE_SCALE, (double)step / PT_MASK_STEPS);
}

int pt_mask_dial(const struct lull_criterion *t, const struct lull_pair *pairs, uint32_t pair_count, int step,
                 char value[32], struct lull_pair *pair, struct base_err *err)
{
    static const char *const dials[] = {"visible", "threshold"};
    const char *known = NULL; /* a dial that has no value */
    for (size_t d = 0; d < sizeof dials / sizeof dials[0]; d++) {
        const struct lull_param *p;
        const char *text = pt_criterion_parameter(t, dials[d], pairs, pair_count, &p);
        double dial;
        if (p && !text && !known)
            known = dials[d];
        if (!text || !base_parse_real(text, p->min, p->max, &dial))
            continue;
        dial *= pt_mask_scale(step);
        snprintf(value, 32, "%.17g", fmin(fmax(dial, p->min), p->max));
        *pair = (struct lull_pair){dials[d], value};
        return 0;
    }
    if (known)
        return base_fail(err, BASE_EINVAL, "criterion %s: --mask scales '%s', which has no value: give it with -p %s=VALUE",
                         t->id, known, known);
    return base_fail(err, BASE_EINVAL, "criterion %s has no dial 'visible' or 'threshold' for --mask to scale", t->id);
}
