/*
 * The kernels, once per precision and instruction set. Without anything defined they are those of any processor; a file for
 * an instruction set defines its vectors (nn/vector.h), ISA, TABLE (the name of its table) and, where there are any,
 * FASTER_FORMS.
 */
#include <math.h>
#include <string.h>

#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/vector.h"

#ifndef TABLE
#define TABLE ggn_kernels_base
#define ISA BASE_ISA_BASE
#endif
#ifndef FASTER_FORMS
#define FASTER_FORMS
#endif
#ifdef GGN_DOUBLE
#define SQRT sqrt
#else
#define SQRT sqrtf
#endif

enum { TILE_V = 3 /* vectors of pixels in a register tile: 8·3 or 4·3 accumulators */ };

INLINE real vsum(vf a) { return VSUM(a); }

/* Register tile: `ot` channels × `nv` vectors of pixels; input channels [i0, i1). A weight is broadcast, a vector of pixels
 * is loaded at each tap's offset. */
INLINE void conv_tile(const struct ggn_conv *a, const real *w, int oc, int i0, int i1, long p, const int ot, const int nv,
                      const int taps)
{
    vf acc[8][TILE_V];
    for (int o = 0; o < ot; o++) {
        int load = i0 > 0 || (a->add && a->add[oc + o]);
        for (int v = 0; v < nv; v++)
            acc[o][v] = load ? LOAD(a->y[oc + o] + p + v * VW) : SET1(a->bias ? a->bias[oc + o] : 0);
    }
    const int side = taps == 9 ? 3 : 1;
    for (int i = i0; i < i1; i++) {
        const real *row = a->x[i] + p - (taps == 9 ? a->row + 1 : 0);
        for (int ky = 0; ky < side; ky++, row += a->row)
            for (int kx = 0; kx < side; kx++, w += ot) {
                vf x[TILE_V];
                for (int v = 0; v < nv; v++)
                    x[v] = LOAD(row + kx + v * VW);
                for (int o = 0; o < ot; o++) {
                    vf wo = SET1(w[o]);
                    KEEP(wo);
                    for (int v = 0; v < nv; v++)
                        acc[o][v] = FMA(wo, x[v], acc[o][v]);
                }
            }
    }
    int last = i1 == a->n_in;
    for (int o = 0; o < ot; o++)
        for (int v = 0; v < nv; v++) {
            vf y = acc[o][v];
            if (last && a->slope != 1)
                y = VMAX(y, SET1(a->slope) * y);
            if (last && a->scale)
                y = FMA(y, SET1(a->scale[oc + o]), SET1(a->shift[oc + o]));
            STORE(a->y[oc + o] + p + v * VW, y);
        }
}

#define CONV_TILE(OT, NV, TAPS) \
    static void conv_tile_##OT##_##NV##_##TAPS(const struct ggn_conv *a, const real *w, int oc, int i0, int i1, long p) \
    { \
        conv_tile(a, w, oc, i0, i1, p, OT, NV, TAPS); \
    }
#define CONV_TILES(OT) CONV_TILE(OT, 3, 9) CONV_TILE(OT, 1, 9) CONV_TILE(OT, 3, 1) CONV_TILE(OT, 1, 1)
EACH_OT(CONV_TILES)

typedef void conv_tile_fn(const struct ggn_conv *a, const real *w, int oc, int i0, int i1, long p);

/* Writes the zeros that the layout asks for after the tile [p, p + n) has been computed as if the plane had no row ends. */
static void restore_padding(const struct ggn_conv *a, int oc0, int oc1, long p, long n)
{
    long end = (long)a->h * a->row;
    long first = p + (a->w_px - p % a->row);
    for (int o = oc0; o < oc1; o++) {
        for (long q = first; q < p + n; q += a->row)
            a->y[o][q] = 0;
        for (long q = end > p ? end : p; q < p + n; q++)
            a->y[o][q] = 0;
    }
}

static void conv(const struct ggn_conv *a, long p0, long p1, int oc0, int oc1)
{
#define CONV_OF(OT) {{conv_tile_##OT##_3_9, conv_tile_##OT##_1_9}, {conv_tile_##OT##_3_1, conv_tile_##OT##_1_1}},
    static conv_tile_fn *const tiles[TILE_OC][2][2] = {EACH_OT(CONV_OF)};
    const int chunk = a->taps == 9 ? 32 : 256; /* input channels whose rows and weights stay in the first-level cache */
    const long end = (long)a->h * a->row;

    if (p1 > end)
        p1 = end;
    for (int i0 = 0; i0 < a->n_in; i0 += chunk) {
        int i1 = i0 + chunk < a->n_in ? i0 + chunk : a->n_in;
        for (long p = p0, n; p < p1; p += n) {
            int wide = p1 - p > VW;
            n = (wide ? TILE_V : 1) * VW;
            for (int oc = oc0, ot; oc < oc1; oc += ot) {
                ot = oc1 - oc < TILE_OC ? oc1 - oc : TILE_OC;
                const real *w = a->w + ((long)oc * a->n_in + (long)i0 * ot) * a->taps;
                tiles[ot - 1][a->taps != 9][!wide](a, w, oc, i0, i1, p);
            }
            if (i1 == a->n_in)
                restore_padding(a, oc0, oc1, p, n);
        }
    }
}

/* dW[o][i][t] = Σ_p dY[o][p] · X[i][p + t], in lanes; one row of three taps (or the one tap) at a time. */
INLINE void grad_tile(real *acc, const real *x, const real *const *dy, long p0, long p1, const int ot, const int nt)
{
    vf sum[3][8];
    for (int t = 0; t < nt; t++)
        for (int o = 0; o < ot; o++)
            sum[t][o] = LOAD(acc + (t * ot + o) * VW);
    for (long p = p0; p < p1; p += VW) {
        vf xt[3];
        for (int t = 0; t < nt; t++)
            xt[t] = LOAD(x + p + t);
        for (int o = 0; o < ot; o++) {
            vf d = LOAD(dy[o] + p);
            KEEP(d);
            for (int t = 0; t < nt; t++)
                sum[t][o] = FMA(d, xt[t], sum[t][o]);
        }
    }
    for (int t = 0; t < nt; t++)
        for (int o = 0; o < ot; o++)
            STORE(acc + (t * ot + o) * VW, sum[t][o]);
}

#define GRAD_TILE(OT, NT) \
    static void grad_tile_##OT##_##NT(real *acc, const real *x, const real *const *dy, long p0, long p1) \
    { \
        grad_tile(acc, x, dy, p0, p1, OT, NT); \
    }
#define GRAD_TILES(OT) GRAD_TILE(OT, 3) GRAD_TILE(OT, 1)
EACH_OT(GRAD_TILES)

static void conv_grad(real *acc, const real *const *x, int n_in, const real *const *dy, int ot, int taps, int row, long p0,
                      long p1)
{
    typedef void grad_tile_fn(real *, const real *, const real *const *, long, long);
#define GRAD_OF(OT) {grad_tile_##OT##_3, grad_tile_##OT##_1},
    static grad_tile_fn *const tiles[TILE_OC][2] = {EACH_OT(GRAD_OF)};
    grad_tile_fn *const fn = tiles[ot - 1][taps == 1];

    for (int i = 0; i < n_in; i++)
        for (int ky = 0; ky < (taps == 9 ? 3 : 1); ky++, acc += (taps == 9 ? 3 : 1) * ot * VW)
            fn(acc, x[i] + (taps == 9 ? (ky - 1) * row - 1 : 0), dy, p0, p1);
}

static void lane_sums(real *out, const real *acc, int n)
{
    for (int k = 0; k < n; k++)
        out[k] = vsum(LOAD(acc + (long)k * VW));
}

static double sum(const real *x, int h, int w, int row)
{
    double total = 0;
    for (int y = 0; y < h; y++, x += row) {
        vf s = SET1(0);
        int i = 0;
        for (; i + VW <= w; i += VW)
            s += LOAD(x + i);
        real tail = 0;
        for (; i < w; i++)
            tail += x[i];
        total += (double)(vsum(s) + tail);
    }
    return total;
}

static double sum_sq(const real *x, double mean, int h, int w, int row)
{
    const real m = (real)mean;
    double total = 0;
    for (int y = 0; y < h; y++, x += row) {
        vf s = SET1(0);
        int i = 0;
        for (; i + VW <= w; i += VW) {
            vf d = LOAD(x + i) - SET1(m);
            s = FMA(d, d, s);
        }
        real tail = 0;
        for (; i < w; i++)
            tail += (x[i] - m) * (x[i] - m);
        total += (double)(vsum(s) + tail);
    }
    return total;
}

static void affine(real *restrict y, const real *restrict x, real scale, real shift, int h, int w, int row)
{
    for (int r = 0; r < h; r++, x += row, y += row)
        for (int i = 0; i < w; i++)
            y[i] = x[i] * scale + shift;
}

static void bn_sums(double out[2], const real *dy, const real *x, real mean, int h, int w, int row)
{
    double total[2] = {0, 0};
    for (int r = 0; r < h; r++, x += row, dy += row) {
        vf s0 = SET1(0), s1 = SET1(0);
        int i = 0;
        for (; i + VW <= w; i += VW) {
            vf d = LOAD(dy + i);
            s0 += d;
            s1 = FMA(d, LOAD(x + i) - SET1(mean), s1);
        }
        real t0 = 0, t1 = 0;
        for (; i < w; i++) {
            t0 += dy[i];
            t1 += dy[i] * (x[i] - mean);
        }
        total[0] += (double)(vsum(s0) + t0);
        total[1] += (double)(vsum(s1) + t1);
    }
    out[0] = total[0];
    out[1] = total[1];
}

static void bn_grad(real *restrict dx, const real *restrict dy, const real *restrict x, real a, real b, real c, int add,
                    int h, int w, int row)
{
    for (int r = 0; r < h; r++, x += row, dx += row, dy += row) {
        if (add)
            for (int i = 0; i < w; i++)
                dx[i] += a * dy[i] + b * x[i] + c;
        else
            for (int i = 0; i < w; i++)
                dx[i] = a * dy[i] + b * x[i] + c;
    }
}

static void lrelu(real *restrict y, const real *restrict x, real slope, int h, int w, int row)
{
    for (int r = 0; r < h; r++, x += row, y += row) {
        int i = 0;
        for (; i + VW <= w; i += VW) {
            vf v = LOAD(x + i);
            STORE(y + i, vector_select(v > SET1(0), v, SET1(slope) * v));
        }
        for (; i < w; i++)
            y[i] = x[i] > 0 ? x[i] : slope * x[i];
    }
}

static void lrelu_grad(real *restrict dx, const real *restrict dy, const real *restrict y, real slope, int add, int h, int w,
                       int row)
{
    for (int r = 0; r < h; r++, y += row, dx += row, dy += row)
        for (int i = 0; i < w; i++)
            dx[i] = (add ? dx[i] : 0) + (y[i] > 0 ? dy[i] : slope * dy[i]);
}

static double act_grad(real *dy, const real *y, real slope, int h, int w, int row)
{
    double total = 0;
    for (int r = 0; r < h; r++, y += row, dy += row) {
        vf s = SET1(0);
        int i = 0;
        for (; i + VW <= w; i += VW) {
            vf d = LOAD(dy + i);
            d = vector_select(LOAD(y + i) > SET1(0), d, SET1(slope) * d);
            s += d;
            STORE(dy + i, d);
        }
        real tail = 0;
        for (; i < w; i++) {
            dy[i] = y[i] > 0 ? dy[i] : slope * dy[i];
            tail += dy[i];
        }
        total += (double)(vsum(s) + tail);
    }
    return total;
}

#ifndef GGN_DOUBLE
/* e^x for |x| ≤ 87: 2^n · p(r), x = n ln 2 + r, p of degree 6 (Taylor on |r| ≤ ln 2 / 2: relative error below 2e-7). */
INLINE vf vector_exp(vf x)
{
    x = vector_select(x > SET1(87.0f), SET1(87.0f), x);
    x = vector_select(x < SET1(-87.0f), SET1(-87.0f), x);
    vf shifted = x * SET1(1.44269504f) + SET1(12582912.0f); /* 1.5·2²³: rounds to the nearest integer */
    vf n = shifted - SET1(12582912.0f);
    vf r = (x - n * SET1(0.693145752f)) - n * SET1(1.42860677e-6f);
    vf p = SET1(1.0f / 720);
    p = p * r + SET1(1.0f / 120);
    p = p * r + SET1(1.0f / 24);
    p = p * r + SET1(1.0f / 6);
    p = p * r + SET1(0.5f);
    p = p * r + SET1(1.0f);
    p = p * r + SET1(1.0f);
    /* the low bits of `shifted` are n; a NaN stays one through p */
    return p * (vf)(((vi)shifted + (127 - 0x4b400000)) << 23);
}
#else
INLINE vf vector_exp(vf x)
{
    for (int k = 0; k < VW; k++)
        x[k] = exp(x[k]);
    return x;
}
#endif

static void sigmoid(real *restrict y, const real *restrict x, int h, int w, int row)
{
    for (int r = 0; r < h; r++, x += row, y += row)
        for (int i = 0; i < w; i += VW) {
            const size_t part = (size_t)(w - i < VW ? w - i : VW) * sizeof *x; /* columns behind the picture stay 0 */
            vf v = SET1(0);
            if (part == sizeof v)
                v = LOAD(x + i);
            else
                memcpy(&v, x + i, part);
            v = SET1(1) / (SET1(1) + vector_exp(-v));
            if (part == sizeof v)
                STORE(y + i, v);
            else
                memcpy(y + i, &v, part);
        }
}

static void sigmoid_grad(real *restrict dx, const real *restrict dy, const real *restrict y, int add, int h, int w, int row)
{
    for (int r = 0; r < h; r++, y += row, dx += row, dy += row)
        for (int i = 0; i < w; i++)
            dx[i] = (add ? dx[i] : 0) + dy[i] * y[i] * (1 - y[i]);
}

static void maxpool2(real *restrict y, const real *restrict x, int h, int w, int row_y, int row_x)
{
    for (int r = 0; r < h; r++, y += row_y, x += 2 * row_x) {
        const real *restrict b = x + row_x;
        for (int i = 0; i < w; i++) {
            y[i] = ggn_larger(ggn_larger(x[2 * i], x[2 * i + 1]), ggn_larger(b[2 * i], b[2 * i + 1]));
        }
    }
}

static void maxpool2_grad(real *restrict dx, const real *restrict dy, const real *restrict x, const real *restrict y,
                          int add, int hx, int wx, int row_y, int row_x)
{
    if (!add)
        for (int r = 0; r < hx; r++)
            memset(dx + (long)r * row_x, 0, (size_t)wx * sizeof *dx);
    for (int r = 0; r < hx / 2; r++) {
        const real *restrict x0 = x + 2L * r * row_x, *restrict x1 = x0 + row_x;
        real *restrict d0 = dx + 2L * r * row_x, *restrict d1 = d0 + row_x;
        for (int i = 0; i < wx / 2; i++) {
            real top = y[i], d = dy[i];
            real a = x0[2 * i] == top ? d : 0;
            real left = x0[2 * i] == top ? 0 : d;
            real b = x0[2 * i + 1] == top ? left : 0;
            left = x0[2 * i + 1] == top ? 0 : left;
            real c = x1[2 * i] == top ? left : 0;
            left = x1[2 * i] == top ? 0 : left;
            real e = x1[2 * i + 1] == top ? left : 0;
            d0[2 * i] += a;
            d0[2 * i + 1] += b;
            d1[2 * i] += c;
            d1[2 * i + 1] += e;
        }
        y += row_y;
        dy += row_y;
    }
}

/* Output 2i = ¼ x[i−1] + ¾ x[i], output 2i+1 = ¾ x[i] + ¼ x[i+1], indices clamped, in y and in x. */
INLINE void up_row(real *restrict y, const real *restrict near, const real *restrict far, int w)
{
    const real q = (real)0.25, t = (real)0.75;
    real first = t * near[0] + q * far[0], last = t * near[w - 1] + q * far[w - 1];
    for (int i = 0; i + 1 < w; i++) {
        real a = t * near[i] + q * far[i], b = t * near[i + 1] + q * far[i + 1];
        y[2 * i + 1] = t * a + q * b;
        y[2 * i + 2] = q * a + t * b;
    }
    y[0] = first;
    y[2 * w - 1] = last;
}

static void up(real *restrict y, const real *restrict x, int h, int w, int row_y, int row_x)
{
    for (int r = 0; r < h; r++) {
        const real *mid = x + (long)r * row_x;
        up_row(y + 2L * r * row_y, mid, r > 0 ? mid - row_x : mid, w);
        up_row(y + (2L * r + 1) * row_y, mid, r + 1 < h ? mid + row_x : mid, w);
    }
}

/* Column i of x gathers from y: ¾ (y[2i] + y[2i+1]) + ¼ (y[2i−1] + y[2i+2]), the clamped ends keep their own share. */
INLINE real up_gather(const real *v, int i, int w)
{
    real s = (real)0.75 * (v[2 * i] + v[2 * i + 1]);
    s += (real)0.25 * (i > 0 ? v[2 * i - 1] : v[0]);
    return s + (real)0.25 * (i + 1 < w ? v[2 * i + 2] : v[2 * w - 1]);
}

static void up_grad(real *restrict dx, const real *restrict dy, int add, int h, int w, int row_y, int row_x)
{
    const real q = (real)0.25, t = (real)0.75;
    real column[2 * GGN_MAX_SIDE];
    if (w < 1) /* never; gcc 14 takes the column for unset otherwise */
        return;

    for (int r = 0; r < h; r++, dx += row_x) {
        const real *restrict b = dy + 2L * r * row_y, *restrict c = b + row_y;
        const real *restrict a = r > 0 ? b - row_y : b, *restrict d = r + 1 < h ? c + row_y : c;
        for (int i = 0; i < 2 * w; i++)
            column[i] = t * (b[i] + c[i]) + q * (a[i] + d[i]);
        real first = up_gather(column, 0, w), last = up_gather(column, w - 1, w);
        dx[0] = (add ? dx[0] : 0) + first;
        for (int i = 1; i + 1 < w; i++)
            dx[i] =
                (add ? dx[i] : 0) + (t * (column[2 * i] + column[2 * i + 1]) + q * (column[2 * i - 1] + column[2 * i + 2]));
        if (w > 1)
            dx[w - 1] = (add ? dx[w - 1] : 0) + last;
    }
}

static real dot(const real *a, const real *b, long n)
{
    vf s0 = SET1(0), s1 = SET1(0);
    long i = 0;
    for (; i + 2 * VW <= n; i += 2 * VW) {
        s0 = FMA(LOAD(a + i), LOAD(b + i), s0);
        s1 = FMA(LOAD(a + i + VW), LOAD(b + i + VW), s1);
    }
    real tail = 0;
    for (; i < n; i++)
        tail += a[i] * b[i];
    return vsum(s0 + s1) + tail;
}

static void axpy(real *restrict y, real a, const real *restrict x, long n)
{
    for (long i = 0; i < n; i++)
        y[i] += a * x[i];
}

static void blur(real *dst, const real *x, real *tmp, const real taps[2 * GGN_SSIM_RADIUS + 1], int h, int w, int row)
{
    const int n = 2 * GGN_SSIM_RADIUS + 1;
    for (int r = 0; r < h; r++)
        for (int i = -GGN_SSIM_RADIUS; i < w + GGN_SSIM_RADIUS; i += VW) {
            const real *column = x + (long)(r - GGN_SSIM_RADIUS) * row + i;
            vf s = SET1(0);
            for (int k = 0; k < n; k++, column += row)
                s = FMA(SET1(taps[k]), LOAD(column), s);
            STORE(tmp + (long)r * row + i, s);
        }
    for (int r = 0; r < h; r++)
        for (int i = 0; i < w; i += VW) {
            const real *p = tmp + (long)r * row + i - GGN_SSIM_RADIUS;
            vf s = SET1(0);
            for (int k = 0; k < n; k++)
                s = FMA(SET1(taps[k]), LOAD(p + k), s);
            STORE(dst + (long)r * row + i, s);
        }
}

static void adam(real *restrict param, const real *restrict grad, real *restrict m, real *restrict v, long n, real lr,
                 real beta1, real beta2, real c1, real c2, real eps)
{
    for (long i = 0; i < n; i++) {
        m[i] = beta1 * m[i] + (1 - beta1) * grad[i];
        v[i] = beta2 * v[i] + (1 - beta2) * grad[i] * grad[i];
        param[i] -= lr * (m[i] * c1) / (SQRT(v[i] * c2) + eps);
    }
}

const struct ggn_kernels TABLE = {
    .isa = ISA,
    .lanes = VW,
    .tile_oc = TILE_OC,
    .tile_px = TILE_V * VW,
    .conv = conv,
    FASTER_FORMS.conv_grad = conv_grad,
    .lane_sums = lane_sums,
    .sum = sum,
    .sum_sq = sum_sq,
    .affine = affine,
    .bn_sums = bn_sums,
    .bn_grad = bn_grad,
    .lrelu = lrelu,
    .lrelu_grad = lrelu_grad,
    .act_grad = act_grad,
    .sigmoid = sigmoid,
    .sigmoid_grad = sigmoid_grad,
    .maxpool2 = maxpool2,
    .maxpool2_grad = maxpool2_grad,
    .up = up,
    .up_grad = up_grad,
    .dot = dot,
    .axpy = axpy,
    .blur = blur,
    .adam = adam,
};
