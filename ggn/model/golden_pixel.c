#include "model/golden.h"

#include <math.h>

#include "nn/hash.h"

double ggn_golden_pixel(int w, int i, int c, int y, int x)
{
    double v = 0.5 + 0.4 * sin((0.02 + 0.01 * w) * x + (0.03 + 0.02 * w) * y + c + w);

    if (i >= 0) {
        double u = ggn_hash_unit((uint32_t)(c * 40000 + 200 * y + x), (uint32_t)(1000 * (w + 1) + i));
        v += 0.3 / ((1 + w) * (i + 1)) * (2 * u - 1);
    }
    return fmin(fmax(v, 0), 1);
}
