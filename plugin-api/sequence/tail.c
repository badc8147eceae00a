#include "sequence/tail.h"

#include "base/colour.h"

/* Lets a[i] sink to its place in the heap a[0 .. n − 1], largest on top. */
static void sink(double *a, size_t i, size_t n)
{
    double v = a[i];

    for (size_t child; (child = 2 * i + 1) < n; i = child) {
        child += child + 1 < n && a[child + 1] > a[child];
        if (a[child] <= v)
            break;
        a[i] = a[child];
    }
    a[i] = v;
}

/* Heapsort: the C library's qsort allocates, which a criterion must not do while it is asked. */
static void sort(double *a, size_t n)
{
    for (size_t i = n / 2; i-- > 0;)
        sink(a, i, n);
    for (size_t end = n; end-- > 1;) {
        double top = a[0];
        a[0] = a[end];
        a[end] = top;
        sink(a, 0, end);
    }
}

struct seq_tail seq_tail_of(double *a, size_t n, double mean_luminance)
{
    struct seq_tail t = {0};
    double count = (double)n, sum = 0, weighted = 0, squares = 0, top = 0;

    if (!n)
        return t;
    sort(a, n);
    for (size_t i = 0; i < n; i++) {
        sum += a[i];
        weighted += (2.0 * (double)(i + 1) - count - 1.0) * a[i];
        squares += a[i] * a[i];
        top += i + (n + 99) / 100 >= n ? a[i] * a[i] : 0;
    }
    t.tail999 = a[(size_t)ceil(0.999 * count) - 1] / fmax(mean_luminance, 1e-4);
    t.gini = sum > 0 ? weighted / (count * sum) : 0;
    t.top_share = squares > 0 ? top / squares : 0;
    return t;
}

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
