/*
 * 3×3 convolution by Winograd's F(4×4, 3×3): 36 products per 16 outputs instead of 144. Once per instruction set: its file
 * (nn/kernels_*.c) defines before what moves values between lanes: deinterleave4, interleave4, shift_in, transpose,
 * load_part and store_part.
 *
 * Lavin & Gray, "Fast Algorithms for Convolutional Neural Networks", CVPR 2016: Y = Aᵀ[(G g Gᵀ) ⊙ (Bᵀ d B)]A. Tiles of 4×4
 * outputs are numbered row by row; a task takes up to 64 of them. The lanes of a vector are consecutive tiles:
 *   gather:   the 6×6 inputs of each tile, split by phase modulo 4          d[36][lanes], one input channel at a time
 *   forward:  Bᵀ d B                                                        v[36][n_in][lanes]
 *   multiply: 36 independent products of matrices                           m[n_out][36][lanes]
 *   inverse:  Aᵀ m A, bias, activation, batch norm                          o[16][lanes], then back to rows of pixels
 * No value depends on how many lanes there are: every instruction set with FMA computes the same bytes.
 */
#ifdef VECTOR_BYTES
#include <string.h>

#include "nn/kernels.h"
#include "nn/winograd.h"

enum { L = VW, XI = 36, TAPS = 9, ROOM = GGN_WINO_TILES + L /* gather and scatter touch one vector more */ };

/* Where the tiles of one task lie. */
struct block {
    int t0, n; /* first tile, number of tiles */
    int lanes; /* n rounded up to whole vectors */
    int tiles_x;
    long v_stride; /* elements between two of the 36 matrices; not a multiple of 4 KiB, so that stores do not collide */
};

/* Bᵀ on six values. */
INLINE void forward6(vf o[6], const vf x[6])
{
    const vf four = SET1(4), five = SET1(5), two = SET1(2);
    vf a = FMA(-four, x[2], x[4]), b = FMA(-four, x[1], x[3]);
    vf c = x[4] - x[2], d = x[3] - x[1];
    o[0] = FMA(four, x[0], FMA(-five, x[2], x[4]));
    o[1] = a + b;
    o[2] = a - b;
    o[3] = FMA(two, d, c);
    o[4] = FMA(-two, d, c);
    o[5] = FMA(four, x[1], FMA(-five, x[3], x[5]));
}

/* Aᵀ on six values. */
INLINE void inverse4(vf o[4], const vf m[6])
{
    vf s = m[1] + m[2], d = m[1] - m[2];
    vf p = m[3] + m[4], q = m[3] - m[4];
    o[0] = (m[0] + s) + p;
    o[1] = FMA(SET1(2), q, d);
    o[2] = FMA(SET1(4), p, s);
    o[3] = FMA(SET1(8), q, d) + m[5];
}

/* Six phases of L tiles: to[j·ROOM + t] = row[4t + j]. */
INLINE void split_phases(float *to, const float *row)
{
    vf p[4];
    deinterleave4(p, row);
    for (int j = 0; j < 4; j++)
        STORE(to + j * ROOM, p[j]);
    for (int j = 0; j < 2; j++) /* phases 4 and 5 of a tile are 0 and 1 of the next */
        STORE(to + (4 + j) * ROOM, shift_in(p[j], row[4 * L + j]));
}

/* d[(6i + j)·ROOM + lane] = input (4ty − 1 + i, 4tx − 1 + j) of the lane's tile, 0 outside of the picture. */
static void gather(float *d, const float *x, const float *next, const struct ggn_conv *a, const struct block *b)
{
    for (int lane = 0, n; lane < b->n; lane += n) {
        const int tile = b->t0 + lane, ty = tile / b->tiles_x, tx = tile % b->tiles_x;
        n = b->tiles_x - tx < b->n - lane ? b->tiles_x - tx : b->n - lane;
        for (int i = 0; i < 6; i++) {
            const int y = 4 * ty - 1 + i;
            float *to = d + 6 * i * ROOM + lane;
            if (y < 0 || y >= a->h) {
                for (int j = 0; j < 6; j++)
                    memset(to + j * ROOM, 0, (size_t)n * sizeof *to);
                continue;
            }
            const long at = (long)y * a->row + 4 * tx - 1;
            for (int k = 0; k < n; k += L) {
                split_phases(to + k, x + at + 4 * k);
                for (int line = 0; line < 4 * L; line += 16)
                    __builtin_prefetch(next + at + 4 * k + line);
            }
            const int last = tx + n - 1; /* its phases beyond the right border hold the next row */
            for (int j = 5; j >= 0 && 4 * last - 1 + j > a->w_px; j--)
                to[j * ROOM + n - 1] = 0;
        }
    }
}

static void forward_channel(float *v, const float *d, const struct block *b)
{
    for (int lane = 0; lane < b->lanes; lane += L) {
        vf t[6][6];
        for (int j = 0; j < 6; j++) {
            vf x[6], o[6];
            for (int i = 0; i < 6; i++)
                x[i] = LOAD(d + (6 * i + j) * ROOM + lane);
            forward6(o, x);
            for (int i = 0; i < 6; i++)
                t[i][j] = o[i];
        }
        for (int i = 0; i < 6; i++) {
            vf o[6];
            forward6(o, t[i]);
            for (int j = 0; j < 6; j++)
                STORE(v + (6 * i + j) * b->v_stride + lane, o[j]);
        }
    }
}

/* out[o·out_step] = Σ_i a[i·a_step + o]·b[i·b_step] for `ot` channels and nv vectors; `add`: to what is there. */
INLINE void product_tile(float *out, long out_step, const float *a, long a_step, const float *b, long b_step, int n,
                         const int ot, const int nv, const int add)
{
    vf acc[TILE_OC][3];
    UNROLL
    for (int o = 0; o < ot; o++)
        UNROLL
    for (int k = 0; k < nv; k++)
        acc[o][k] = add ? LOAD(out + o * out_step + k * L) : SET1(0);
    for (int i = 0; i < n; i++, a += a_step, b += b_step) {
        vf x[3];
        for (int k = 0; k < nv; k++)
            x[k] = LOAD(b + k * L);
        for (int o = 0; o < ot; o++) {
            vf w = SET1(a[o]);
            if (!add)
                KEEP(w);
            for (int k = 0; k < nv; k++)
                acc[o][k] = FMA(w, x[k], acc[o][k]);
        }
    }
    UNROLL
    for (int o = 0; o < ot; o++)
        UNROLL
    for (int k = 0; k < nv; k++)
        STORE(out + o * out_step + k * L, acc[o][k]);
}

/* How many of so many vectors a tile takes: three, but no single one is left over. */
INLINE int tile_vectors(int left) { return left == 4 ? 2 : left < 3 ? left : 3; }

/* m[o][ξ] = Σ_i u[i][o]·v[i] */
#define TILE(OT, NV) \
    static void multiply_##OT##_##NV(float *m, const float *u, const float *v, int n_in, int lanes) \
    { \
        product_tile(m, XI *GGN_WINO_TILES, u, OT, v, lanes, n_in, OT, NV, 0); \
    }
#define TILES(OT) TILE(OT, 1) TILE(OT, 2) TILE(OT, 3)
EACH_OT(TILES)

/* All 36 products for output channels [oc0, oc1). */
static void multiply(float *m, const float *u, const float *v, const struct ggn_conv *a, const struct block *b, int oc0,
                     int oc1)
{
    typedef void tile_fn(float *, const float *, const float *, int, int);
#define MULTIPLY_OF(OT) {multiply_##OT##_1, multiply_##OT##_2, multiply_##OT##_3},
    static tile_fn *const tiles[TILE_OC][3] = {EACH_OT(MULTIPLY_OF)};
    const int vectors = b->lanes / L;

    for (int xi = 0; xi < XI; xi++)
        for (int oc = oc0, ot; oc < oc1; oc += ot) {
            ot = oc1 - oc < TILE_OC ? oc1 - oc : TILE_OC;
            const float *w = u + ((long)xi * a->n_out + oc) * a->n_in;
            float *to = m + ((long)(oc - oc0) * XI + xi) * GGN_WINO_TILES;
            for (int k = 0, nv; k < vectors; k += nv) {
                nv = tile_vectors(vectors - k);
                tiles[ot - 1][nv - 1](to + k * L, w, v + xi * b->v_stride + k * L, a->n_in, b->lanes);
            }
        }
}

/* Aᵀ m A and the epilogue of one output channel into o[(4i + j)·ROOM + lane]. */
static void inverse_channel(float *o, const float *m, const struct ggn_conv *a, int oc, const struct block *b)
{
    const vf bias = SET1(a->bias ? a->bias[oc] : 0), slope = SET1(a->slope);
    for (int lane = 0; lane < b->lanes; lane += L) {
        vf t[4][6];
        for (int j = 0; j < 6; j++) {
            vf x[6], r[4];
            for (int i = 0; i < 6; i++)
                x[i] = LOAD(m + (6 * i + j) * GGN_WINO_TILES + lane);
            inverse4(r, x);
            for (int i = 0; i < 4; i++)
                t[i][j] = r[i];
        }
        for (int i = 0; i < 4; i++) {
            vf r[4];
            inverse4(r, t[i]);
            for (int j = 0; j < 4; j++) {
                vf y = r[j] + bias;
                if (a->slope != 1)
                    y = VMAX(y, slope * y);
                if (a->scale)
                    y = FMA(y, SET1(a->scale[oc]), SET1(a->shift[oc]));
                STORE(o + (4 * i + j) * ROOM + lane, y);
            }
        }
    }
}

/* row[4t + j] (+)= from[j·ROOM + t] for the first n pixels and at most 4·L. */
INLINE void join_phases(float *row, const float *from, int n, int add)
{
    vf p[4];
    for (int j = 0; j < 4; j++)
        p[j] = LOAD(from + j * ROOM);
    interleave4(p);
    for (int k = 0; k < 4 && n > 0; k++, n -= L) {
        const int part = n < L ? n : L;
        if (add)
            p[k] += load_part(row + L * k, part);
        store_part(row + L * k, part, p[k]);
    }
}

static void scatter(float *y, const float *o, const struct ggn_conv *a, const struct block *b, int add)
{
    for (int lane = 0, n; lane < b->n; lane += n) {
        const int tile = b->t0 + lane, ty = tile / b->tiles_x, tx = tile % b->tiles_x;
        n = b->tiles_x - tx < b->n - lane ? b->tiles_x - tx : b->n - lane;
        for (int i = 0; i < 4 && 4 * ty + i < a->h; i++) {
            float *row = y + (long)(4 * ty + i) * a->row + 4 * tx;
            const int end = 4 * (tx + n) < a->w_px ? 4 * (tx + n) : a->w_px;
            for (int k = 0; k < n; k += L)
                join_phases(row + 4 * k, o + 4 * i * ROOM + lane + k, end - 4 * (tx + k), add);
        }
    }
}

static void wino_conv(const struct ggn_conv *a, const float *u, int t0, int t1, int first, int end, float *scratch)
{
    struct block b = {.t0 = t0, .n = t1 - t0, .lanes = (t1 - t0 + L - 1) / L * L, .tiles_x = (a->w_px + 3) / 4};
    float *d = scratch, *o = d + XI * ROOM, *m = o + 16 * ROOM, *v = m + GGN_WINO_OC * XI * GGN_WINO_TILES;
    b.v_stride = (long)a->n_in * b.lanes + L;
    memset(d, 0, (size_t)XI * ROOM * sizeof *d); /* lanes past the last tile */
    for (int i = 0; i < a->n_in; i++) {
        gather(d, a->x[i], a->x[i + 1 < a->n_in ? i + 1 : 0], a, &b);
        forward_channel(v + (long)i * b.lanes, d, &b);
    }
    for (int oc0 = first; oc0 < end; oc0 += GGN_WINO_OC) {
        const int oc1 = oc0 + GGN_WINO_OC < end ? oc0 + GGN_WINO_OC : end;
        multiply(m, u, v, a, &b, oc0, oc1);
        for (int oc = oc0; oc < oc1; oc++) {
            inverse_channel(o, m + (long)(oc - oc0) * XI * GGN_WINO_TILES, a, oc, &b);
            scatter(a->y[oc], o, a, &b, a->add && a->add[oc]);
        }
    }
}

/* dU = Σ over the tiles of (A dY Aᵀ) ⊙ (Bᵀ d B), dW = Gᵀ dU G, the adjoint of the above. Here the lanes of a vector are
 * channels, so that the sum over tiles is one of products of a broadcast value and a vector, in order. */
enum { GRAD_TILES = GGN_WINO_GRAD_TILES, STRIDE = GGN_WINO_GRAD_STRIDE, CHANNELS = GGN_WINO_GRAD };

/* Some whole rows of tiles, or a part of one. */
struct tile_block {
    int ty0, rows;
    int tx0, n;
};

/* strip[column][L channels]: columns [x0, x0 + n) of row y of up to L planes, 0 outside of the picture. */
static void load_strip(float *strip, const float *const *plane, int channels, const struct ggn_conv_grad *g, int y, int x0,
                       int n)
{
    if (y < 0 || y >= g->h) {
        memset(strip, 0, (size_t)(n * L) * sizeof *strip);
        return;
    }
    for (int at = 0; at < n; at += L, strip += L * L) {
        const int left = g->w_px - x0 - at, inside = left < 0 ? 0 : left < L ? left : L;
        vf m[L];
        for (int c = 0; c < L; c++)
            m[c] = c < channels ? load_part(plane[c] + (long)y * g->row + x0 + at, inside) : SET1(0);
        transpose(m);
        for (int c = 0; c < L; c++)
            STORE(strip + c * L, m[c]);
    }
}

/* A on four values. */
INLINE void spread6(vf o[6], const vf g[4])
{
    const vf two = SET1(2), four = SET1(4), eight = SET1(8);
    vf even = g[0] + g[2], odd = g[1] + g[3];
    vf even2 = FMA(four, g[2], g[0]), odd2 = FMA(eight, g[3], two * g[1]);
    o[0] = g[0];
    o[1] = even + odd;
    o[2] = even - odd;
    o[3] = even2 + odd2;
    o[4] = even2 - odd2;
    o[5] = g[3];
}

/* One tile of L channels, `side` rows and columns of the strip: into the 36 matrices. */
INLINE void transform_tile(float *v, const float *strip, const int side)
{
    vf t[6][6];
    for (int j = 0; j < side; j++) {
        vf x[6], o[6];
        for (int i = 0; i < side; i++)
            x[i] = LOAD(strip + (i * GGN_WINO_GRAD_STRIP + j) * L);
        if (side == 6)
            forward6(o, x);
        else
            spread6(o, x);
        for (int i = 0; i < 6; i++)
            t[i][j] = o[i];
    }
    for (int i = 0; i < 6; i++) {
        vf o[6];
        if (side == 6)
            forward6(o, t[i]);
        else
            spread6(o, t[i]);
        for (int j = 0; j < 6; j++)
            STORE(v + (6 * i + j) * STRIDE, o[j]);
    }
}

/* v[36][tile][CHANNELS]: the tiles of a block of `n` planes; side 6 with a border of one pixel (Bᵀ d B) or 4 (A dY Aᵀ). */
INLINE void transform_block(float *v, const float *const *plane, int n, const struct ggn_conv_grad *g,
                            const struct tile_block *b, float *strip, const int side)
{
    const int border = side == 6;
    for (int c = 0; c < n; c += L)
        for (int r = 0; r < b->rows; r++) {
            for (int i = 0; i < side; i++)
                load_strip(strip + i * GGN_WINO_GRAD_STRIP * L, plane + c, n - c < L ? n - c : L, g,
                           4 * (b->ty0 + r) - border + i, 4 * b->tx0 - border, 4 * b->n + 2 * border);
            for (int k = 0; k < b->n; k++)
                transform_tile(v + (r * b->n + k) * CHANNELS + c, strip + 4 * k * L, side);
        }
}

/* u[o][CHANNELS] += Σ_t m[t][o]·v[t] for `ot` output channels and all vectors of input channels. */
INLINE void accumulate_row(float *u, const float *m, const float *v, int tiles, int vectors, const int ot)
{
    for (int k = 0, nv; k < vectors; k += nv) {
        nv = tile_vectors(vectors - k);
        if (nv == 3)
            product_tile(u + k * L, CHANNELS, m, CHANNELS, v + k * L, CHANNELS, tiles, ot, 3, 1);
        else if (nv == 2)
            product_tile(u + k * L, CHANNELS, m, CHANNELS, v + k * L, CHANNELS, tiles, ot, 2, 1);
        else
            product_tile(u + k * L, CHANNELS, m, CHANNELS, v + k * L, CHANNELS, tiles, ot, 1, 1);
    }
}

static void accumulate(float *u, const float *m, const float *v, const struct ggn_conv_grad *g, int tiles)
{
    const int vectors = (g->n_in + L - 1) / L;
    for (int xi = 0; xi < XI; xi++, u += CHANNELS * CHANNELS, m += STRIDE, v += STRIDE)
        for (int o = 0; o < g->n_out; o += TILE_OC) { /* channels beyond n_out are 0 */
            if (g->n_out - o > TILE_OC / 2)
                accumulate_row(u + o * CHANNELS, m + o, v, tiles, vectors, TILE_OC);
            else
                accumulate_row(u + o * CHANNELS, m + o, v, tiles, vectors, TILE_OC / 2);
        }
}

/* Gᵀ on six values. */
INLINE void gather3(vf o[3], const vf u[6])
{
    const vf sixth = SET1(1.0f / 6);
    vf s = u[1] + u[2], d = u[2] - u[1];
    vf p = u[3] + u[4], q = u[3] - u[4];
    o[0] = FMA(SET1(1.0f / 24), p, FMA(-sixth, s, SET1(0.25f) * u[0]));
    o[1] = FMA(SET1(1.0f / 12), q, sixth * d);
    o[2] = FMA(sixth, p - s, u[5]);
}

/* Gᵀ dU G of output channel o and up to L input channels from i0 on. */
static void write_weights(const struct ggn_conv_grad *g, const float *u, int o, int i0)
{
    const int n = g->n_in - i0 < L ? g->n_in - i0 : L;
    float *to = g->dw + (long)o * g->o_step + (long)i0 * g->i_step;
    vf t[3][6], m[L < TAPS ? TAPS : L];
    for (int j = 0; j < 6; j++) {
        vf x[6], r[3];
        for (int i = 0; i < 6; i++)
            x[i] = LOAD(u + ((6 * i + j) * CHANNELS + o) * CHANNELS + i0);
        gather3(r, x);
        for (int i = 0; i < 3; i++)
            t[i][j] = r[i];
    }
    for (int i = 0; i < 3; i++) {
        vf r[3];
        gather3(r, t[i]);
        for (int j = 0; j < 3; j++)
            m[g->mirrored ? 8 - (3 * i + j) : 3 * i + j] = r[j];
    }
    for (int k = TAPS; k < L; k++)
        m[k] = SET1(0);
    for (int k = L; k < TAPS; k++) /* what a vector has no room for */
        for (int c = 0; c < n; c++)
            to[(long)c * g->i_step + k] = m[k][c];
    transpose(m);
    for (int c = 0; c < n; c++)
        store_part(to + (long)c * g->i_step, TAPS < L ? TAPS : L, m[c]);
}

static void wino_grad(const struct ggn_conv_grad *g, float *scratch)
{
    const int tiles_x = (g->w_px + 3) / 4, tiles_y = (g->h + 3) / 4;
    const int parts = (tiles_x + GRAD_TILES - 1) / GRAD_TILES;
    const int rows = tiles_x < GRAD_TILES
    ? GRAD_TILES
    / tiles_x : 1;
    float *v = scratch, *m = v + XI * STRIDE, *u = m + XI * STRIDE, *strip = u + XI * CHANNELS * CHANNELS;
    memset(u, 0, (size_t)(XI * CHANNELS * CHANNELS) * sizeof *u);
    for (int ty = 0; ty < tiles_y; ty += rows)
        for (int part = 0; part < parts; part++) {
            struct tile_block b = {
                .ty0 = ty, .rows = tiles_y - ty < rows ? tiles_y - ty : rows, .tx0 = tiles_x * part / parts};
            b.n = tiles_x * (part + 1) / parts - b.tx0;
            transform_block(v, g->x, g->n_in, g, &b, strip, 6);
            transform_block(m, g->dy, g->n_out, g, &b, strip, 4);
            accumulate(u, m, v, g, b.rows * b.n);
        }
    for (int o = 0; o < g->n_out; o++)
        for (int i = 0; i < g->n_in; i += L)
            write_weights(g, u, o, i);
}

#endif
