#include "render/blockstats.h"

#include <math.h>
#include <stdlib.h>

#include "base/colour.h"

/* What the criteria halfbuf and variance call a settled pixel by default. */
static const double tail_error = 0.5, floor_y = 0.02;

static double luminance(const double *rgb)
{
    return base_luminance(rgb[0], rgb[1], rgb[2]);
}

static int ascending(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Dammertz et al. 2010, eq. 2, averaged over the block */
static double dammertz(const double *mean, const double *half_mean, size_t pixels)
{
    double sum = 0.0;
    for (size_t i = 0; i < pixels; i++) {
        const double *m = mean + 3 * i, *a = half_mean + 3 * i;
        double total = m[0] + m[1] + m[2];
        if (total > 0.0)
            sum += (fabs(m[0] - a[0]) + fabs(m[1] - a[1]) + fabs(m[2] - a[2])) / sqrt(total);
    }
    return sum / (double)pixels;
}

void pt_block_stats(const double *mean, const double *half_mean, const double *difference, const double *moment2,
                    size_t pixels, uint64_t spp, double *scratch, struct pt_block_stats *out)
{
    double n = (double)pixels, sum_y = 0.0, sum_e = 0.0, sum_a = 0.0, weighted = 0.0;
    size_t half_unsettled = 0, rse_unsettled = 0;
    for (size_t i = 0; i < pixels; i++) {
        double y = luminance(mean + 3 * i), level = fmax(fabs(y), floor_y);
        double e = spp > 1 ? sqrt(fmax(moment2[i] - y * y, 0.0) / (double)(spp - 1)) / level : 0.0;
        sum_y += y;
        sum_e += e * e;
        rse_unsettled += e > tail_error;
        half_unsettled += fabs(y - luminance(half_mean + 3 * i)) > tail_error * level;
        scratch[i] = fabs(luminance(difference + 3 * i));
    }
    double mean_y = fmax(sum_y / n, 1e-4);
    qsort(scratch, pixels, sizeof *scratch, ascending);
    for (size_t i = 0; i < pixels; i++) {
        sum_a += scratch[i];
        weighted += (2.0 * (double)(i + 1) - n - 1.0) * scratch[i];
    }
    out->dammertz = dammertz(mean, half_mean, pixels);
    out->half_unsettled = (double)half_unsettled / n;
    out->rse = sqrt(sum_e / n);
    out->rse_unsettled = (double)rse_unsettled / n;
    out->tail999 = scratch[(size_t)ceil(0.999 * n) - 1] / mean_y;
    out->gini = sum_a > 0.0 ? weighted / (n * sum_a) : 0.0;
}
