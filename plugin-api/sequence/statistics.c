#include "sequence/statistics.h"

#include <math.h>

#include "base/colour.h"
#include "sequence/tail.h"

/* Of pixel i of a planar image. */
static double luminance(const double *rgb, size_t pixels, size_t i)
{
    return base_luminance(rgb[i], rgb[pixels + i], rgb[2 * pixels + i]);
}

/* Dammertz et al. 2010, eq. 2, averaged over the block */
static double dammertz(const double *mean, const double *half_mean, size_t pixels)
{
    double sum = 0.0;
    for (size_t i = 0; i < pixels; i++) {
        const double *m = mean + i, *a = half_mean + i;
        double total = m[0] + m[pixels] + m[2 * pixels];
        if (total > 0.0)
            sum += (fabs(m[0] - a[0]) + fabs(m[pixels] - a[pixels]) + fabs(m[2 * pixels] - a[2 * pixels])) / sqrt(total);
    }
    return sum / (double)pixels;
}

void seq_statistics(const double *mean, const double *half_mean, const double *half, const double *moment2, size_t pixels,
                    uint64_t spp, double *scratch, struct seq_stat out[SEQ_STATISTICS])
{
    double n = (double)pixels, sum_y = 0.0, sum_e = 0.0;
    size_t half_unsettled = 0, rse_unsettled = 0;
    for (size_t i = 0; i < pixels; i++) {
        double y = luminance(mean, pixels, i);
        double e =
            spp > 1 ? sqrt(fmax(moment2[i] - y * y, 0.0) / (double)(spp - 1)) / fmax(fabs(y), SEQ_UNSETTLED_FLOOR) : 0.0;
        sum_y += y;
        sum_e += e * e;
        rse_unsettled += e > SEQ_UNSETTLED_ERROR;
        half_unsettled += (size_t)seq_is_unsettled(fabs(y - luminance(half_mean, pixels, i)), y);
        scratch[i] = fabs(luminance(half, pixels, i));
    }
    struct seq_tail tail = seq_tail_of(scratch, pixels, sum_y / n);
    out[SEQ_DAMMERTZ] = (struct seq_stat){"dammertz", dammertz(mean, half_mean, pixels)};
    out[SEQ_HALF_UNSETTLED] = (struct seq_stat){"half_unsettled", (double)half_unsettled / n};
    out[SEQ_RSE] = (struct seq_stat){"rse", sqrt(sum_e / n)};
    out[SEQ_RSE_UNSETTLED] = (struct seq_stat){"rse_unsettled", (double)rse_unsettled / n};
    out[SEQ_TAIL999] = (struct seq_stat){"tail999", tail.tail999};
    out[SEQ_GINI] = (struct seq_stat){"gini", tail.gini};
}
