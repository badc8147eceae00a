#include "denoise/estimate.h"

#include <math.h>

/* Squares of what is estimated stay finite in float and in sums of it, whatever the pixels hold. */
static const double MOST = 1e15;

double lull_lightness_slope(double y)
{
    const double knee = 216.0 / 24389.0;
    double root = cbrt(y > knee ? y : knee);
    return y > knee ? 116.0 / (3.0 * root * root) : 24389.0 / 27.0;
}

static float bounded(double v) { return (float)(v < MOST ? (v > -MOST ? v : -MOST) : MOST); }

void lull_estimate_pixels(const struct lull_estimate_in *in, size_t n, const struct lull_estimate *out)
{
    const double split = in->share * (1.0 - in->share);
    for (size_t i = 0; i < n; i++) {
        const double a = (double)in->a[i], b = (double)in->b[i], fa = (double)in->fa[i], fb = (double)in->fb[i];
        const double xa = (double)in->xa[i], xb = (double)in->xb[i], away = fa - xa - (fb - xb);
        const double slope = lull_lightness_slope(0.5 * (fa + fb)), unit = slope * slope;
        const double crossed = 0.5 * ((fa - b) * (fa - xa) + (fb - a) * (fb - xb));
        const double other = 0.5 * (fa + fb - xa - xb), mean = 0.5 * (fa + fb - a - b);
        const double doubt = 0.5 * unit * ((fa - fb + a - b) * other - away * mean);
        out->gain[i] = bounded(unit * (crossed - 0.25 * (fa - fb) * away));
        out->doubt[i] = bounded(doubt * doubt);
        out->moved[i] = bounded(unit * other * other);
        out->agreed[i] = bounded(unit * 0.25 * (fa - fb) * (fa - fb));
        out->noisy[i] = bounded(unit * split * (a - b) * (a - b));
    }
}
