#include "sequence/tail.h"

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
