#include "sight/quality.h"

#include <math.h>
#include <stdlib.h>

#include "base/colour.h"
#include "nn/ssim.h"

static const double DARK = 0.01; /* below a tenth of white an error counts as there */

int ggn_quality_ssim(const struct pic_image *reference, const struct pic_image *image, double *ssim, struct base_err *err)
{
    const int width = image->width, height = image->height;
    const size_t pixels = (size_t)width * (size_t)height;
    float *planes = malloc(6 * pixels * sizeof *planes);
    struct ggn_ssim *memory = ggn_ssim_create(height, width, NULL, err);
    const float *x[3], *y[3];
    int rc = planes && memory ? 0 : base_fail_nomem(err, "SSIM of an image");
    for (size_t c = 0; c < 3 && !rc; c++) {
        x[c] = planes + c * pixels;
        y[c] = planes + (3 + c) * pixels;
        for (size_t i = 0; i < pixels; i++) {
            planes[c * pixels + i] = (float)image->u8[3 * i + c] / 255.0f;
            planes[(3 + c) * pixels + i] = (float)reference->u8[3 * i + c] / 255.0f;
        }
    }
    if (!rc)
        *ssim = ggn_ssim_mean(memory, x, y, NULL, 3, width, 0.0);
    ggn_ssim_destroy(memory);
    free(planes);
    return rc;
}

static double light(const struct pic_image *image, size_t i)
{
    const double value = image->f32 ? (double)image->f32[i] : base_srgb_linear[image->u8[i]];
    return isfinite(value) && value > 0.0 ? value : 0.0;
}

double ggn_quality_relmse(const struct pic_image *reference, const struct pic_image *image)
{
    const size_t values = 3 * (size_t)image->width * (size_t)image->height;
    double sum = 0.0;
    for (size_t i = 0; i < values; i++) {
        const double r = light(reference, i), d = light(image, i) - r;
        sum += d * d / (r * r + DARK);
    }
    return sum / (double)values;
}
