#include "baselines/features.h"

#include <math.h>
#include <string.h>

#include "base/colour.h"
#include "baselines/blas.h"

void ggn_lightness(const uint8_t *rgb, size_t pixels, double *l)
{
    for (size_t i = 0; i < pixels; i++) {
        /* Y row of the sRGB matrix with the digits that the published code's library has */
        double r = base_srgb_linear[rgb[i]], g = base_srgb_linear[rgb[pixels + i]];
        double b = base_srgb_linear[rgb[2 * pixels + i]];
        double y = 0.212671 * r + 0.715160 * g + 0.072169 * b;
        double f = y > 0.008856 ? cbrt(y) : 7.787 * y + 16.0 / 116.0;
        l[i] = 116.0 * f - 16.0;
    }
}

int ggn_svd_entropy_count(int w, int h) { return (w / GGN_SUB_BLOCK) * (h / GGN_SUB_BLOCK); }

/* Entropy of the squared singular values s[first..last), normalised to [0,1]. */
static double entropy(const double *s, int first, int last)
{
    double sum = 0.0, h = 0.0;
    for (int i = first; i < last; i++)
        sum += s[i] * s[i];
    if (!(sum > 0.0))
        return 0.0;
    for (int i = first; i < last; i++) {
        double v = s[i] * s[i] / sum;
        h -= v > 0.0 ? v * log(v) : 0.0;
    }
    return h / log(last - first);
}

int ggn_svd_entropy(const double *l, int w, int h, int first, int last, double *out)
{
    enum { N = GGN_SUB_BLOCK };
    double a[N * N], s[N], work[64 * N];
    for (int by = 0; by < h / N; by++)
        for (int bx = 0; bx < w / N; bx++) {
            for (int y = 0; y < N; y++)
                for (int x = 0; x < N; x++)
                    a[x * N + y] = floor(l[(size_t)(by * N + y) * (size_t)w + (size_t)(bx * N + x)]);
            if (ggn_blas_singular_values(N, a, s, work) != 0)
                return -1;
            const double largest = s[0];
            for (int i = 0; i < N; i++) /* rounding errors of a rank-deficient sub-block are no noise */
                s[i] = s[i] > 1e-12 * largest ? s[i] : 0.0;
            *out++ = entropy(s, first, last);
        }
    return 0;
}

enum border { BORDER_MIRROR /* c b | a b c */, BORDER_ZERO };

/* n >= 3, i at most two beyond. */
static int mirror(int i, int n)
{
    i = i < 0 ? -i : i;
    return i >= n ? 2 * n - 2 - i : i;
}

/* out = sum of taps[|x|..] products, separable, radius 1 or 2. */
static void separable(const double *in, double *tmp, double *out, int w, int h, const double *taps, int r,
                      enum border border)
{
    size_t step = (size_t)w;
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            double sum = 0.0;
            for (int k = -r; k <= r; k++)
                if (border != BORDER_ZERO || (x + k >= 0 && x + k < w))
                    sum += taps[k + r] * in[(size_t)y * step + (size_t)mirror(x + k, w)];
            tmp[(size_t)y * step + (size_t)x] = sum;
        }
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            double sum = 0.0;
            for (int k = -r; k <= r; k++)
                if (border != BORDER_ZERO || (y + k >= 0 && y + k < h))
                    sum += taps[k + r] * tmp[(size_t)mirror(y + k, h) * step + (size_t)x];
            out[(size_t)y * step + (size_t)x] = sum;
        }
}

static void box(const double *in, double *tmp, double *out, int w, int h, int r, enum border border)
{
    double taps[5];
    for (int i = 0; i <= 2 * r; i++)
        taps[i] = 1.0 / (2 * r + 1);
    separable(in, tmp, out, w, h, taps, r, border);
}

static void gaussian(const double *in, double *tmp, double *out, int w, int h, int r, double sigma)
{
    double taps[5], sum = 0.0;
    for (int i = -r; i <= r; i++)
        sum += taps[i + r] = exp(-0.5 * i * i / (sigma * sigma));
    for (int i = 0; i <= 2 * r; i++)
        taps[i] /= sum;
    separable(in, tmp, out, w, h, taps, r, BORDER_MIRROR);
}

/* Element k of v in rising order; v is reordered (Hoare 1961). Not qsort, which allocates. */
static double ranked(double *v, size_t n, size_t k)
{
    size_t first = 0, last = n - 1;
    while (first < last) {
        double pivot = v[first + (last - first) / 2];
        size_t i = first, j = last + 1;
        for (;; i++) {
            while (v[i] < pivot)
                i++;
            do
                j--;
            while (v[j] > pivot);
            if (i >= j)
                break;
            double keep = v[i];
            v[i] = v[j];
            v[j] = keep;
        }
        if (k <= j)
            last = j;
        else
            first = j + 1;
    }
    return v[k];
}

/* Zeros beyond the border, as the published figures have it. */
static void median(const double *in, double *out, int w, int h, int r)
{
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            double v[25];
            size_t n = 0;
            for (int yy = y - r; yy <= y + r; yy++)
                for (int xx = x - r; xx <= x + r; xx++) {
                    int inside = yy >= 0 && yy < h && xx >= 0 && xx < w;
                    v[n++] = inside ? in[(size_t)yy * (size_t)w + (size_t)xx] : 0.0;
                }
            out[(size_t)y * (size_t)w + (size_t)x] = ranked(v, n, n / 2);
        }
}

/* Local Wiener filter (Lim 1990), noise power = mean of the local variances; zeros beyond the border. scratch: 2 planes. */
static void wiener(const double *in, double *tmp, double *out, double *scratch, int w, int h, int r)
{
    size_t n = (size_t)w * (size_t)h;
    double *mean = scratch, *variance = scratch + n, noise = 0.0;
    for (size_t i = 0; i < n; i++)
        out[i] = in[i] * in[i];
    box(in, tmp, mean, w, h, r, BORDER_ZERO);
    box(out, tmp, variance, w, h, r, BORDER_ZERO);
    for (size_t i = 0; i < n; i++) {
        variance[i] -= mean[i] * mean[i];
        noise += variance[i];
    }
    noise /= (double)n;
    for (size_t i = 0; i < n; i++)
        out[i] = !(variance[i] > noise) ? mean[i] : mean[i] + (in[i] - mean[i]) * (1.0 - noise / variance[i]);
}

static double shrink(double v, double threshold)
{
    return v > threshold ? v - threshold : v < -threshold ? v + threshold : 0.0;
}

/* One level of the orthonormal 2-D Haar transform with soft, universal thresholds (Donoho & Johnstone 1994), sigma from the
 * median of the diagonal details. An odd last row or column stays as it is. scratch: one plane. */
static void haar(const double *in, double *out, double *scratch, int w, int h)
{
    size_t step = (size_t)w, n = 0;
    memcpy(out, in, step * (size_t)h * sizeof *out);
    for (int y = 0; y + 1 < h; y += 2)
        for (int x = 0; x + 1 < w; x += 2) {
            const double *p = in + (size_t)y * step + (size_t)x;
            scratch[n++] = fabs(0.5 * (p[0] - p[1] - p[step] + p[step + 1]));
        }
    if (n == 0)
        return;
    double threshold = ranked(scratch, n, n / 2) / 0.6745 * sqrt(2.0 * log((double)(step * (size_t)h)));
    for (int y = 0; y + 1 < h; y += 2)
        for (int x = 0; x + 1 < w; x += 2) {
            double *p = out + (size_t)y * step + (size_t)x, a = p[0], b = p[1], c = p[step], d = p[step + 1];
            double ll = 0.5 * (a + b + c + d), lh = shrink(0.5 * (a - b + c - d), threshold);
            double hl = shrink(0.5 * (a + b - c - d), threshold), hh = shrink(0.5 * (a - b - c + d), threshold);
            p[0] = 0.5 * (ll + lh + hl + hh);
            p[1] = 0.5 * (ll - lh + hl - hh);
            p[step] = 0.5 * (ll + lh - hl - hh);
            p[step + 1] = 0.5 * (ll - lh - hl + hh);
        }
}

static void residual(const double *l, const double *filtered, size_t n, double *out)
{
    double sum = 0.0, square = 0.0;
    for (size_t i = 0; i < n; i++) {
        double d = fabs(l[i] - filtered[i]);
        sum += d;
        square += d * d;
    }
    out[0] = sum / (double)n;
    out[1] = sqrt(fmax(square / (double)n - out[0] * out[0], 0.0));
}

void ggn_attributes(const double *l, int w, int h, double *tmp, double out[GGN_ATTRIBUTES])
{
    static const double sigmas[3] = {0.5, 1.0, 1.5};
    size_t n = (size_t)w * (size_t)h;
    double *f = tmp + n, *scratch = tmp + 2 * n;
    for (int r = 1; r <= 2; r++) {
        box(l, tmp, f, w, h, r, BORDER_MIRROR);
        residual(l, f, n, out + 2 * (r - 1));
        for (int s = 0; s < 3; s++) {
            gaussian(l, tmp, f, w, h, r, sigmas[s]);
            residual(l, f, n, out + 4 + 2 * (3 * (r - 1) + s));
        }
        median(l, f, w, h, r);
        residual(l, f, n, out + 16 + 2 * (r - 1));
        wiener(l, tmp, f, scratch, w, h, r);
        residual(l, f, n, out + 20 + 2 * (r - 1));
    }
    haar(l, f, tmp, w, h);
    residual(l, f, n, out + 24);
}

/* Means over an 8x8 grid of |image - Gaussian(image)|. */
static void reduce_mask(const double *image, double *tmp, double *smooth, int w, int h, double *out)
{
    gaussian(image, tmp, smooth, w, h, 2, 1.0);
    for (int gy = 0; gy < GGN_MASK_GRID; gy++)
        for (int gx = 0; gx < GGN_MASK_GRID; gx++) {
            double sum = 0.0, count = 0.0;
            for (int y = gy * h / GGN_MASK_GRID; y < (gy + 1) * h / GGN_MASK_GRID; y++)
                for (int x = gx * w / GGN_MASK_GRID; x < (gx + 1) * w / GGN_MASK_GRID; x++) {
                    size_t i = (size_t)y * (size_t)w + (size_t)x;
                    sum += fabs(image[i] - smooth[i]);
                    count += 1.0;
                }
            *out++ = sum / count;
        }
}

void ggn_noise_mask(const double *l, int w, int h, double *tmp, double out[GGN_MASK_FEATURES])
{
    size_t n = (size_t)w * (size_t)h;
    reduce_mask(l, tmp, tmp + n, w, h, out);
    wiener(l, tmp, tmp + n, tmp + 2 * n, w, h, 2);
    reduce_mask(tmp + n, tmp, tmp + 2 * n, w, h, out + GGN_MASK_FEATURES / 2);
}
