#include "nn/ssim.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "nn/kernels.h"
#include "nn/real.h"

enum { N_TAPS = 2 * GGN_SSIM_RADIUS + 1, BORDER = 16 };

static const double C1 = 1e-4, C2 = 9e-4, SIGMA = 1.5;

enum { X, Y, XX, YY, XY, TMP, N_MAPS };
enum { BATCH = 64 }; /* planes whose sums are kept at a time */

struct ggn_ssim {
    const struct ggn_kernels *kernels;
    struct base_threads *threads;
    int h, w, row; /* of the zero-bordered maps */
    size_t map;    /* elements of one map */
    real taps[N_TAPS];
    float taps_2d[N_TAPS * N_TAPS];
    /* of the call in progress */
    const real *const *x, *const *y;
    real *const *dx;
    int in_row;
    double grad_scale;       /* per pixel */
    double plane_sum[BATCH]; /* of the planes that are at work */
    real maps[];             /* [workers][N_MAPS][map] */
};

/* The published window is an 11×11 array of single-precision products whose sum is 1 − 7e-8. Since σ² = E[x²] − μ² is a
 * small difference, that shows in the fifth digit of SSIM. Double precision, which golden values are compared in, filters
 * with that very array; single precision with separable taps of the same sum. */
static void make_taps(struct ggn_ssim *s)
{
    float single[N_TAPS];
    double total = 0, sum = 0, sum_2d = 0;
    for (int k = 0; k < N_TAPS; k++)
        total += (double)(single[k] = (float)exp(-(k - GGN_SSIM_RADIUS) * (k - GGN_SSIM_RADIUS) / (2 * SIGMA * SIGMA)));
    for (int k = 0; k < N_TAPS; k++)
        sum += (double)(single[k] /= (float)total);
    for (int k = 0; k < N_TAPS * N_TAPS; k++) {
        s->taps_2d[k] = single[k / N_TAPS] * single[k % N_TAPS];
        sum_2d += (double)s->taps_2d[k];
    }
    for (int k = 0; k < N_TAPS; k++)
        s->taps[k] = (real)((double)single[k] * sqrt(sum_2d) / sum);
}

struct ggn_ssim *ggn_ssim_create(int h, int w, struct base_threads *threads, struct base_err *err)
{
    const size_t workers = threads ? (size_t)base_threads_count(threads) : 1;
    const int row = (w + 2 * BORDER + 15) / 16 * 16 + 16;
    const size_t map = (size_t)row * (size_t)(h + 2 * GGN_SSIM_RADIUS + 2);
    struct ggn_ssim *s = calloc(1, sizeof *s + workers * N_MAPS * map * sizeof s->maps[0]);
    if (!s) {
        base_fail_nomem(err, "SSIM");
        return NULL;
    }
    s->kernels = ggn_kernels_best();
    s->threads = threads;
    s->h = h;
    s->w = w;
    s->row = row;
    s->map = map;
    make_taps(s);
    return s;
}

/* Element (0,0) of map m of a worker. */
static real *map_of(struct ggn_ssim *s, int worker, int m)
{
    return s->maps + ((size_t)worker * N_MAPS + (size_t)m) * s->map + (size_t)(GGN_SSIM_RADIUS * s->row) + BORDER;
}

static void blur_2d(const struct ggn_ssim *s, real *map, real *tmp)
{
    for (int r = 0; r < s->h; r++) {
        real *out = tmp + (long)r * s->row;
        memset(out, 0, (size_t)s->w * sizeof *out);
        for (int k = 0; k < N_TAPS * N_TAPS; k++)
            s->kernels->axpy(out, (real)s->taps_2d[k],
                             map + (long)(r + k / N_TAPS - GGN_SSIM_RADIUS) * s->row + k % N_TAPS - GGN_SSIM_RADIUS, s->w);
    }
    for (int r = 0; r < s->h; r++)
        memcpy(map + (long)r * s->row, tmp + (long)r * s->row, (size_t)s->w * sizeof *map);
}

static void blur_in_place(struct ggn_ssim *s, int worker, real *map)
{
    real *tmp = map_of(s, worker, TMP);
    if (sizeof(real) == sizeof(double)) {
        blur_2d(s, map, tmp);
        return;
    }
    s->kernels->blur(map, map, tmp, s->taps, s->h, s->w, s->row);
    /* the kernel writes whole vectors: restore the zeros on the right */
    for (int r = 0; r < s->h; r++)
        memset(map + (long)r * s->row + s->w, 0, (size_t)(s->row - s->w - BORDER) * sizeof *map);
}

/* One row: the SSIM of each pixel is A1·A2 / (B1·B2); the maps become ∂S/∂μx, ∂S/∂E[x²], ∂S/∂E[xy]. */
static double ssim_row(struct ggn_ssim *s, int worker, long at)
{
    real *mx = map_of(s, worker, X) + at, *my = map_of(s, worker, Y) + at, *exx = map_of(s, worker, XX) + at;
    real *eyy = map_of(s, worker, YY) + at, *exy = map_of(s, worker, XY) + at;
    const real c1 = (real)C1, c2 = (real)C2;
    double total = 0;
    for (int i = 0; i < s->w; i++) {
        real a1 = 2 * mx[i] * my[i] + c1, a2 = 2 * (exy[i] - mx[i] * my[i]) + c2;
        real b1 = mx[i] * mx[i] + my[i] * my[i] + c1;
        real b2 = (exx[i] - mx[i] * mx[i]) + (eyy[i] - my[i] * my[i]) + c2;
        real inv = 1 / (b1 * b2), q = a1 * a2 * inv;
        real d_mean = 2 * my[i] * (a2 - a1) * inv + 2 * mx[i] * q * (1 / b2 - 1 / b1);
        exx[i] = -q / b2;
        exy[i] = 2 * a1 * inv;
        mx[i] = d_mean;
        my[i] = q;
    }
    for (int i = 0; i < s->w; i++)
        total += (double)my[i];
    return total;
}

static void ssim_plane(void *data, long i, int worker)
{
    struct ggn_ssim *s = data;
    real *mx = map_of(s, worker, X), *my = map_of(s, worker, Y), *exx = map_of(s, worker, XX), *eyy = map_of(s, worker, YY);
    real *exy = map_of(s, worker, XY);
    double total = 0;
    for (int r = 0; r < s->h; r++) {
        const real *x = s->x[i] + (long)r * s->in_row, *y = s->y[i] + (long)r * s->in_row;
        long at = (long)r * s->row;
        for (int c = 0; c < s->w; c++) {
            mx[at + c] = x[c];
            my[at + c] = y[c];
            exx[at + c] = x[c] * x[c];
            eyy[at + c] = y[c] * y[c];
            exy[at + c] = x[c] * y[c];
        }
    }
    for (int m = X; m <= XY; m++)
        blur_in_place(s, worker, map_of(s, worker, m));
    for (int r = 0; r < s->h; r++)
        total += ssim_row(s, worker, (long)r * s->row);
    s->plane_sum[i] = total;
    if (!s->dx)
        return;
    /* dL/dx = G*∂μx + 2x·(G*∂E[x²]) + y·(G*∂E[xy]); the window is symmetric, so its adjoint is itself */
    blur_in_place(s, worker, mx);
    blur_in_place(s, worker, exx);
    blur_in_place(s, worker, exy);
    const real scale = (real)s->grad_scale;
    for (int r = 0; r < s->h; r++) {
        const real *x = s->x[i] + (long)r * s->in_row, *y = s->y[i] + (long)r * s->in_row;
        real *dx = s->dx[i] + (long)r * s->in_row;
        long at = (long)r * s->row;
        for (int c = 0; c < s->w; c++)
            dx[c] = scale * (mx[at + c] + 2 * x[c] * exx[at + c] + y[c] * exy[at + c]);
    }
}

double ggn_ssim_mean(struct ggn_ssim *s, const real *const *x, const real *const *y, real *const *dx, int n, int row,
                     double grad_scale)
{
    double total = 0, pixels = (double)n * s->h * s->w;
    s->in_row = row;
    s->grad_scale = grad_scale / pixels;
    for (int first = 0; first < n; first += BATCH) {
        int count = n - first < BATCH ? n - first : BATCH;
        s->x = x + first;
        s->y = y + first;
        s->dx = dx ? dx + first : NULL;
        base_threads_for(s->threads, count, ssim_plane, s);
        for (int i = 0; i < count; i++)
            total += s->plane_sum[i];
    }
    return total / pixels;
}
