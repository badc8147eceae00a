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
        const double slope = lull_lightness_slope(0.5 * (fa + fb)), unit = slope * slope;
        const double halves = (a - b) * (a - b), filtered = (fa - fb) * (fa - fb);
        const double crossed = 0.5 * ((fa - b) * (fa - b) + (fb - a) * (fb - a));
        const double moved = 0.5 * (fa + fb) - (in->share * a + (1.0 - in->share) * b);
        out->gain[i] = bounded(unit * (crossed - 0.5 * halves - 0.25 * filtered - 0.25 * (fa - fb) * (a - b)));
        const double apart = unit * (fa - fb + a - b) * moved;
        out->doubt[i] = bounded(apart * apart);
        out->moved[i] = bounded(unit * moved * moved);
        out->agreed[i] = bounded(unit * 0.25 * filtered);
        out->noisy[i] = bounded(unit * split * halves);
    }
}
