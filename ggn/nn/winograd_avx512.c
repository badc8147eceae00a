/*
 * 3×3 convolution by Winograd's F(4×4, 3×3) for AVX-512: 36 products per 16 outputs instead of 144.
 *
 * Lavin & Gray, "Fast Algorithms for Convolutional Neural Networks", CVPR 2016: Y = Aᵀ[(G g Gᵀ) ⊙ (Bᵀ d B)]A. Tiles of 4×4
 * outputs are numbered row by row; a task takes up to 64 of them. The lanes of a vector are 16 consecutive tiles:
 *   gather:   the 6×6 inputs of each tile, split by phase modulo 4          d[36][lanes], one input channel at a time
 *   forward:  Bᵀ d B                                                        v[36][n_in][lanes]
 *   multiply: 36 independent products of matrices                           m[n_out][36][lanes]
 *   inverse:  Aᵀ m A, bias, activation, batch norm                          o[16][lanes], then back to rows of pixels
 */
#if defined(__x86_64__)
#include <immintrin.h>
#include <string.h>

#include "nn/graph.h"
#include "nn/kernels.h"
#include "nn/winograd.h"

enum { L = 16, XI = 36, ROOM = GGN_WINO_TILES + L /* gather and scatter touch one vector more */ };

typedef __m512 vf;
#define INLINE static inline __attribute__((always_inline))

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
    const vf four = _mm512_set1_ps(4), five = _mm512_set1_ps(5), two = _mm512_set1_ps(2);
    vf a = _mm512_fnmadd_ps(four, x[2], x[4]), b = _mm512_fnmadd_ps(four, x[1], x[3]);
    vf c = _mm512_sub_ps(x[4], x[2]), d = _mm512_sub_ps(x[3], x[1]);

    o[0] = _mm512_fmadd_ps(four, x[0], _mm512_fnmadd_ps(five, x[2], x[4]));
    o[1] = _mm512_add_ps(a, b);
    o[2] = _mm512_sub_ps(a, b);
    o[3] = _mm512_fmadd_ps(two, d, c);
    o[4] = _mm512_fnmadd_ps(two, d, c);
    o[5] = _mm512_fmadd_ps(four, x[1], _mm512_fnmadd_ps(five, x[3], x[5]));
}

/* Aᵀ on six values. */
INLINE void inverse4(vf o[4], const vf m[6])
{
    vf s = _mm512_add_ps(m[1], m[2]), d = _mm512_sub_ps(m[1], m[2]);
    vf p = _mm512_add_ps(m[3], m[4]), q = _mm512_sub_ps(m[3], m[4]);

    o[0] = _mm512_add_ps(_mm512_add_ps(m[0], s), p);
    o[1] = _mm512_fmadd_ps(_mm512_set1_ps(2), q, d);
    o[2] = _mm512_fmadd_ps(_mm512_set1_ps(4), p, s);
    o[3] = _mm512_add_ps(_mm512_fmadd_ps(_mm512_set1_ps(8), q, d), m[5]);
}

/* Six phases of 16 tiles: to[j·ROOM + t] = row[4t + j]. */
INLINE void split_phases(float *to, const float *row)
{
    const __m512i low = _mm512_set_epi32(29, 25, 21, 17, 13, 9, 5, 1, 28, 24, 20, 16, 12, 8, 4, 0);
    const __m512i high = _mm512_set_epi32(31, 27, 23, 19, 15, 11, 7, 3, 30, 26, 22, 18, 14, 10, 6, 2);
    vf a = _mm512_loadu_ps(row), b = _mm512_loadu_ps(row + 16), c = _mm512_loadu_ps(row + 32), d = _mm512_loadu_ps(row + 48);
    vf ab0 = _mm512_permutex2var_ps(a, low, b), ab2 = _mm512_permutex2var_ps(a, high, b);
    vf cd0 = _mm512_permutex2var_ps(c, low, d), cd2 = _mm512_permutex2var_ps(c, high, d);
    vf p0 = _mm512_shuffle_f32x4(ab0, cd0, 0x44), p1 = _mm512_shuffle_f32x4(ab0, cd0, 0xee);

    _mm512_storeu_ps(to, p0);
    _mm512_storeu_ps(to + ROOM, p1);
    _mm512_storeu_ps(to + 2 * ROOM, _mm512_shuffle_f32x4(ab2, cd2, 0x44));
    _mm512_storeu_ps(to + 3 * ROOM, _mm512_shuffle_f32x4(ab2, cd2, 0xee));
    /* phases 4 and 5 of a tile are 0 and 1 of the next */
    _mm512_storeu_ps(to + 4 * ROOM, _mm512_castsi512_ps(_mm512_alignr_epi32(_mm512_castps_si512(_mm512_set1_ps(row[64])),
                                                                            _mm512_castps_si512(p0), 1)));
    _mm512_storeu_ps(to + 5 * ROOM, _mm512_castsi512_ps(_mm512_alignr_epi32(_mm512_castps_si512(_mm512_set1_ps(row[65])),
                                                                            _mm512_castps_si512(p1), 1)));
}

/* d[(6i + j)·ROOM + lane] = input (4ty − 1 + i, 4tx − 1 + j) of the lane's tile, 0 outside of the picture. */
static void gather(float *d, const float *x, const struct ggn_conv *a, const struct block *b)
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
            const float *row = x + (long)y * a->row + 4 * tx - 1;
            for (int k = 0; k < n; k += L)
                split_phases(to + k, row + 4 * k);
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
                x[i] = _mm512_loadu_ps(d + (6 * i + j) * ROOM + lane);
            forward6(o, x);
            for (int i = 0; i < 6; i++)
                t[i][j] = o[i];
        }
        for (int i = 0; i < 6; i++) {
            vf o[6];
            forward6(o, t[i]);
            for (int j = 0; j < 6; j++)
                _mm512_storeu_ps(v + (6 * i + j) * b->v_stride + lane, o[j]);
        }
    }
}

/* m[o][ξ] = Σ_i u[i][o]·v[i] for `ot` output channels and nv vectors. */
INLINE void multiply_tile(float *m, const float *u, const float *v, int n_in, int lanes, const int ot, const int nv)
{
    vf acc[8][3];

    for (int o = 0; o < ot; o++)
        for (int k = 0; k < nv; k++)
            acc[o][k] = _mm512_setzero_ps();
    for (int i = 0; i < n_in; i++, u += ot, v += lanes) {
        vf x[3];
        for (int k = 0; k < nv; k++)
            x[k] = _mm512_loadu_ps(v + k * L);
        for (int o = 0; o < ot; o++) {
            vf w = _mm512_set1_ps(u[o]);
            __asm__("" : "+v"(w)); /* loaded once, not once per multiply-add */
            for (int k = 0; k < nv; k++)
                acc[o][k] = _mm512_fmadd_ps(w, x[k], acc[o][k]);
        }
    }
    for (int o = 0; o < ot; o++)
        for (int k = 0; k < nv; k++)
            _mm512_storeu_ps(m + (long)o * XI * GGN_WINO_TILES + k * L, acc[o][k]);
}

#define TILE(OT, NV)                                                                                                        \
    static void multiply_##OT##_##NV(float *m, const float *u, const float *v, int n_in, int lanes)                         \
    {                                                                                                                       \
        multiply_tile(m, u, v, n_in, lanes, OT, NV);                                                                        \
    }
#define TILES(OT) TILE(OT, 1) TILE(OT, 2) TILE(OT, 3)
TILES(1) TILES(2) TILES(3) TILES(4) TILES(5) TILES(6) TILES(7) TILES(8)

/* All 36 products for output channels [oc0, oc1). */
static void multiply(float *m, const float *u, const float *v, const struct ggn_conv *a, const struct block *b, int oc0,
                     int oc1)
{
    typedef void tile_fn(float *, const float *, const float *, int, int);
#define ROW(OT) {multiply_##OT##_1, multiply_##OT##_2, multiply_##OT##_3}
    static tile_fn *const tiles[8][3] = {ROW(1), ROW(2), ROW(3), ROW(4), ROW(5), ROW(6), ROW(7), ROW(8)};
    const int vectors = b->lanes / L;

    for (int xi = 0; xi < XI; xi++)
        for (int oc = oc0, ot; oc < oc1; oc += ot) {
            ot = oc1 - oc < 8 ? oc1 - oc : 8;
            const float *w = u + ((long)xi * a->n_out + oc) * a->n_in;
            float *to = m + ((long)(oc - oc0) * XI + xi) * GGN_WINO_TILES;
            for (int k = 0, nv; k < vectors; k += nv) {
                nv = vectors - k == 4 ? 2 : vectors - k < 3 ? vectors - k : 3;
                tiles[ot - 1][nv - 1](to + k * L, w, v + xi * b->v_stride + k * L, a->n_in, b->lanes);
            }
        }
}

/* Aᵀ m A and the epilogue of one output channel into o[(4i + j)·ROOM + lane]. */
static void inverse_channel(float *o, const float *m, const struct ggn_conv *a, int oc, const struct block *b)
{
    const vf bias = _mm512_set1_ps(a->bias ? a->bias[oc] : 0), slope = _mm512_set1_ps(a->slope);

    for (int lane = 0; lane < b->lanes; lane += L) {
        vf t[4][6];
        for (int j = 0; j < 6; j++) {
            vf x[6], r[4];
            for (int i = 0; i < 6; i++)
                x[i] = _mm512_loadu_ps(m + (6 * i + j) * GGN_WINO_TILES + lane);
            inverse4(r, x);
            for (int i = 0; i < 4; i++)
                t[i][j] = r[i];
        }
        for (int i = 0; i < 4; i++) {
            vf r[4];
            inverse4(r, t[i]);
            for (int j = 0; j < 4; j++) {
                vf y = _mm512_add_ps(r[j], bias);
                if (a->slope != 1)
                    y = _mm512_max_ps(y, _mm512_mul_ps(slope, y));
                if (a->scale)
                    y = _mm512_fmadd_ps(y, _mm512_set1_ps(a->scale[oc]), _mm512_set1_ps(a->shift[oc]));
                _mm512_storeu_ps(o + (4 * i + j) * ROOM + lane, y);
            }
        }
    }
}

/* row[4t + j] (+)= from[j·ROOM + t] for the first n pixels, n ≤ 64. */
INLINE void join_phases(float *row, const float *from, int n, int add)
{
    vf p0 = _mm512_loadu_ps(from), p1 = _mm512_loadu_ps(from + ROOM), p2 = _mm512_loadu_ps(from + 2 * ROOM);
    vf p3 = _mm512_loadu_ps(from + 3 * ROOM);
    /* pairs of phases, then pairs of pairs; each 128-bit part holds one tile */
    const __m512i first = _mm512_set_epi32(23, 7, 22, 6, 21, 5, 20, 4, 19, 3, 18, 2, 17, 1, 16, 0);
    const __m512i second = _mm512_set_epi32(31, 15, 30, 14, 29, 13, 28, 12, 27, 11, 26, 10, 25, 9, 24, 8);
    __m512d a01 = _mm512_castps_pd(_mm512_permutex2var_ps(p0, first, p1)),
            b01 = _mm512_castps_pd(_mm512_permutex2var_ps(p0, second, p1));
    __m512d a23 = _mm512_castps_pd(_mm512_permutex2var_ps(p2, first, p3)),
            b23 = _mm512_castps_pd(_mm512_permutex2var_ps(p2, second, p3));
    const __m512i low = _mm512_set_epi64(11, 3, 10, 2, 9, 1, 8, 0), high = _mm512_set_epi64(15, 7, 14, 6, 13, 5, 12, 4);
    vf out[4] = {
        _mm512_castpd_ps(_mm512_permutex2var_pd(a01, low, a23)), _mm512_castpd_ps(_mm512_permutex2var_pd(a01, high, a23)),
        _mm512_castpd_ps(_mm512_permutex2var_pd(b01, low, b23)), _mm512_castpd_ps(_mm512_permutex2var_pd(b01, high, b23))};

    for (int k = 0; k < 4 && n > 0; k++, n -= L) {
        unsigned bits = n >= L ? 0xffffu : (1u << n) - 1;
        __mmask16 mask = (__mmask16)bits;
        if (add)
            out[k] = _mm512_add_ps(out[k], _mm512_maskz_loadu_ps(mask, row + L * k));
        _mm512_mask_storeu_ps(row + L * k, mask, out[k]);
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
                join_phases(row + 4 * k, o + 4 * i * ROOM + lane + k, end - 4 * (tx + k) < 64 ? end - 4 * (tx + k) : 64,
                            add);
        }
    }
}

void ggn_wino_conv_avx512(const struct ggn_conv *a, const float *u, int t0, int t1, float *scratch)
{
    struct block b = {.t0 = t0, .n = t1 - t0, .lanes = (t1 - t0 + L - 1) / L * L, .tiles_x = (a->w_px + 3) / 4};
    float *d = scratch, *o = d + XI * ROOM, *m = o + 16 * ROOM, *v = m + GGN_WINO_OC * XI * GGN_WINO_TILES;

    b.v_stride = (long)a->n_in * b.lanes + L;
    memset(d, 0, (size_t)XI * ROOM * sizeof *d); /* lanes past the last tile */
    for (int i = 0; i < a->n_in; i++) {
        gather(d, a->x[i], a, &b);
        forward_channel(v + (long)i * b.lanes, d, &b);
    }
    for (int oc0 = 0; oc0 < a->n_out; oc0 += GGN_WINO_OC) {
        const int oc1 = oc0 + GGN_WINO_OC < a->n_out ? oc0 + GGN_WINO_OC : a->n_out;
        multiply(m, u, v, a, &b, oc0, oc1);
        for (int oc = oc0; oc < oc1; oc++) {
            inverse_channel(o, m + (long)(oc - oc0) * XI * GGN_WINO_TILES, a, oc, &b);
            scatter(a->y[oc], o, a, &b, a->add && a->add[oc]);
        }
    }
}

/* --- gradient of the weights ------------------------------------------------------------------------------------------ */

/* dU = Σ over the tiles of (A dY Aᵀ) ⊙ (Bᵀ d B), dW = Gᵀ dU G, the adjoint of the above. Here the lanes of a vector are 16
 * channels, so that the sum over tiles is one of products of a broadcast value and a vector, in order. */
enum { GRAD_TILES = GGN_WINO_GRAD_TILES, STRIDE = GGN_WINO_GRAD_STRIDE, CHANNELS = GGN_WINO_GRAD };

/* Some whole rows of tiles, or a part of one. */
struct tile_block {
    int ty0, rows;
    int tx0, n;
};

/* m[c] = lane c of the vectors m[0..15]. */
INLINE void transpose16(vf m[16])
{
    vf t[16];

    for (int i = 0; i < 16; i += 2) {
        t[i] = _mm512_unpacklo_ps(m[i], m[i + 1]);
        t[i + 1] = _mm512_unpackhi_ps(m[i], m[i + 1]);
    }
    for (int i = 0; i < 16; i += 4)
        for (int k = 0; k < 2; k++) {
            __m512d a = _mm512_castps_pd(t[i + k]), b = _mm512_castps_pd(t[i + k + 2]);
            m[i + 2 * k] = _mm512_castpd_ps(_mm512_unpacklo_pd(a, b));
            m[i + 2 * k + 1] = _mm512_castpd_ps(_mm512_unpackhi_pd(a, b));
        }
    for (int k = 0; k < 4; k++) { /* m[4i + k]: columns k, k+4, k+8, k+12 of rows 4i to 4i+3, in this order */
        vf a = _mm512_shuffle_f32x4(m[k], m[4 + k], 0x88), b = _mm512_shuffle_f32x4(m[k], m[4 + k], 0xdd);
        vf c = _mm512_shuffle_f32x4(m[8 + k], m[12 + k], 0x88), d = _mm512_shuffle_f32x4(m[8 + k], m[12 + k], 0xdd);
        t[k] = _mm512_shuffle_f32x4(a, c, 0x88);
        t[8 + k] = _mm512_shuffle_f32x4(a, c, 0xdd);
        t[4 + k] = _mm512_shuffle_f32x4(b, d, 0x88);
        t[12 + k] = _mm512_shuffle_f32x4(b, d, 0xdd);
    }
    for (int i = 0; i < 16; i++)
        m[i] = t[i];
}

/* strip[column][16 channels]: columns [x0, x0 + n) of row y of up to 16 planes, 0 outside of the picture. */
static void load_strip(float *strip, const float *const *plane, int channels, const struct ggn_conv_grad *g, int y, int x0,
                       int n)
{
    if (y < 0 || y >= g->h) {
        memset(strip, 0, (size_t)(n * L) * sizeof *strip);
        return;
    }
    for (int at = 0; at < n; at += L, strip += L * L) {
        const int first = x0 + at, left = first < 0 ? -first : 0, inside = g->w_px - first < L ? g->w_px - first : L;
        const unsigned bits = inside > left ? ((1u << inside) - 1) & ~((1u << left) - 1) : 0;
        vf m[16];
        for (int c = 0; c < 16; c++)
            m[c] = c < channels ? _mm512_maskz_loadu_ps((__mmask16)bits, plane[c] + (long)y * g->row + first)
                                : _mm512_setzero_ps();
        transpose16(m);
        for (int c = 0; c < 16; c++)
            _mm512_storeu_ps(strip + c * L, m[c]);
    }
}

/* A on four values. */
INLINE void spread6(vf o[6], const vf g[4])
{
    const vf two = _mm512_set1_ps(2), four = _mm512_set1_ps(4), eight = _mm512_set1_ps(8);
    vf even = _mm512_add_ps(g[0], g[2]), odd = _mm512_add_ps(g[1], g[3]);
    vf even2 = _mm512_fmadd_ps(four, g[2], g[0]), odd2 = _mm512_fmadd_ps(eight, g[3], _mm512_mul_ps(two, g[1]));

    o[0] = g[0];
    o[1] = _mm512_add_ps(even, odd);
    o[2] = _mm512_sub_ps(even, odd);
    o[3] = _mm512_add_ps(even2, odd2);
    o[4] = _mm512_sub_ps(even2, odd2);
    o[5] = g[3];
}

/* One tile of 16 channels, `side` rows and columns of the strip: into the 36 matrices. */
INLINE void transform_tile(float *v, const float *strip, const int side)
{
    vf t[6][6];

    for (int j = 0; j < side; j++) {
        vf x[6], o[6];
        for (int i = 0; i < side; i++)
            x[i] = _mm512_loadu_ps(strip + (i * GGN_WINO_GRAD_STRIP + j) * L);
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
            _mm512_storeu_ps(v + (6 * i + j) * STRIDE, o[j]);
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

/* u[o][CHANNELS] += Σ_t m[t][o]·v[t] for `ot` output channels and nv vectors of input channels. */
INLINE void accumulate_tile(float *u, const float *m, const float *v, int tiles, const int ot, const int nv)
{
    vf acc[8][2];

    for (int o = 0; o < ot; o++)
        for (int k = 0; k < nv; k++)
            acc[o][k] = _mm512_loadu_ps(u + o * CHANNELS + k * L);
    for (int t = 0; t < tiles; t++, m += CHANNELS, v += CHANNELS) {
        vf x[2];
        for (int k = 0; k < nv; k++)
            x[k] = _mm512_loadu_ps(v + k * L);
        for (int o = 0; o < ot; o++) {
            vf w = _mm512_set1_ps(m[o]);
            for (int k = 0; k < nv; k++)
                acc[o][k] = _mm512_fmadd_ps(w, x[k], acc[o][k]);
        }
    }
    for (int o = 0; o < ot; o++)
        for (int k = 0; k < nv; k++)
            _mm512_storeu_ps(u + o * CHANNELS + k * L, acc[o][k]);
}

static void accumulate(float *u, const float *m, const float *v, const struct ggn_conv_grad *g, int tiles)
{
    for (int xi = 0; xi < XI; xi++, u += CHANNELS * CHANNELS, m += STRIDE, v += STRIDE)
        for (int o = 0; o < g->n_out; o += 8) { /* channels beyond n_out are 0 */
            float *to = u + o * CHANNELS;
            if (g->n_out - o > 4 && g->n_in > L)
                accumulate_tile(to, m + o, v, tiles, 8, 2);
            else if (g->n_out - o > 4)
                accumulate_tile(to, m + o, v, tiles, 8, 1);
            else if (g->n_in > L)
                accumulate_tile(to, m + o, v, tiles, 4, 2);
            else
                accumulate_tile(to, m + o, v, tiles, 4, 1);
        }
}

/* Gᵀ on six values. */
INLINE void gather3(vf o[3], const vf u[6])
{
    const vf sixth = _mm512_set1_ps(1.0f / 6);
    vf s = _mm512_add_ps(u[1], u[2]), d = _mm512_sub_ps(u[2], u[1]);
    vf p = _mm512_add_ps(u[3], u[4]), q = _mm512_sub_ps(u[3], u[4]);

    o[0] = _mm512_fmadd_ps(_mm512_set1_ps(1.0f / 24), p,
                           _mm512_fnmadd_ps(sixth, s, _mm512_mul_ps(_mm512_set1_ps(0.25f), u[0])));
    o[1] = _mm512_fmadd_ps(_mm512_set1_ps(1.0f / 12), q, _mm512_mul_ps(sixth, d));
    o[2] = _mm512_fmadd_ps(sixth, _mm512_sub_ps(p, s), u[5]);
}

/* Gᵀ dU G of output channel o and up to 16 input channels from i0 on. */
static void write_weights(const struct ggn_conv_grad *g, const float *u, int o, int i0)
{
    const int n = g->n_in - i0 < L ? g->n_in - i0 : L;
    float *to = g->dw + (long)o * g->o_step + (long)i0 * g->i_step;
    vf t[3][6], m[16];

    for (int j = 0; j < 6; j++) {
        vf x[6], r[3];
        for (int i = 0; i < 6; i++)
            x[i] = _mm512_loadu_ps(u + ((6 * i + j) * CHANNELS + o) * CHANNELS + i0);
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
    for (int k = 9; k < 16; k++)
        m[k] = _mm512_setzero_ps();
    transpose16(m);
    for (int c = 0; c < n; c++)
        _mm512_mask_storeu_ps(to + (long)c * g->i_step, (__mmask16)0x1ff, m[c]);
}

void ggn_wino_grad_avx512(const struct ggn_conv_grad *g, float *scratch)
{
    const int tiles_x = (g->w_px + 3) / 4, tiles_y = (g->h + 3) / 4;
    const int parts = (tiles_x + GRAD_TILES - 1) / GRAD_TILES, rows = tiles_x < GRAD_TILES ? GRAD_TILES / tiles_x : 1;
    float *v = scratch, *m = v + XI * STRIDE, *u = m + XI * STRIDE, *strip = u + XI * CHANNELS * CHANNELS;

    memset(u, 0, (size_t)(XI * CHANNELS * CHANNELS) * sizeof *u);
    for (int ty = 0; ty < tiles_y; ty += rows)
        for (int part = 0; part < parts; part++) {
            struct tile_block b = {.ty0 = ty, .rows = tiles_y - ty < rows ? tiles_y - ty : rows,
                                   .tx0 = tiles_x * part / parts};
            b.n = tiles_x * (part + 1) / parts - b.tx0;
            transform_block(v, g->x, g->n_in, g, &b, strip, 6);
            transform_block(m, g->dy, g->n_out, g, &b, strip, 4);
            accumulate(u, m, v, g, b.rows * b.n);
        }
    for (int o = 0; o < g->n_out; o++)
        for (int i = 0; i < g->n_in; i += L)
            write_weights(g, u, o, i);
}

#else
typedef int ggn_no_winograd_here; /* ISO C forbids an empty file */
#endif
