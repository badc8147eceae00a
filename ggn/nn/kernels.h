/*
 * The inner loops of the networks, compiled for several instruction sets and chosen at run time.
 *
 * All functions work on planes as nn/graph.h lays them out, are pure (no globals, no allocation) and thread-safe. A result
 * never depends on how a caller divides the work. Different instruction sets may differ in the last bits.
 */
#ifndef GGN_NN_KERNELS_H
#define GGN_NN_KERNELS_H

#include "base/isa.h"
#include "nn/real.h"

enum {
    GGN_TILE_MAX = 8,   /* most output channels of a register tile */
    GGN_GRAD_IC = 16,   /* input channels whose weight gradient one task accumulates */
    GGN_WINO_GRAD = 32, /* input and output channels of a task where Winograd's algorithm is used */
    GGN_SSIM_RADIUS = 5
};

/* A convolution of one image: y[o] = act(bias[o] + Σ_i w[o][i] * x[i]), then scale and shift. */
struct ggn_conv {
    const real *const *x; /* [n_in] element (0,0) of each input plane */
    real *const *y;       /* [n_out] */
    const real *w;        /* packed, tiles of tile_oc output channels and one of the rest, [n_in][taps][tile] each */
    const real *bias;     /* [n_out] or NULL */
    const real *scale;    /* [n_out] or NULL: y = y·scale + shift after the activation */
    const real *shift;
    const unsigned char *add; /* [n_out] or NULL: nonzero = y += … */
    int n_in, n_out;
    int taps;         /* 9 (3×3, pad 1) or 1 */
    int h, w_px, row; /* the common size of the planes */
    real slope;       /* LeakyReLU; 1 = none */
};

/* The gradient of the weights of a 3×3 convolution for one image: dw[o][i][t] = Σ_p dy[o][p]·x[i][p + t]. */
struct ggn_conv_grad {
    const real *const *x;  /* [n_in] */
    const real *const *dy; /* [n_out] */
    int n_in, n_out;       /* <= GGN_WINO_GRAD */
    int h, w_px, row;
    real *dw; /* of o, i at dw + o·o_step + i·i_step: nine taps, from the last to the first if `mirrored` */
    long o_step, i_step;
    int mirrored;
};

struct ggn_kernels {
    enum base_isa isa;
    int lanes;   /* elements of a vector */
    int tile_oc; /* output channels of the largest register tile: 8 or 4 */
    int tile_px; /* pixels of a register tile; tasks start at multiples of it */

    /* Elements [p0, p1) of the flat planes, output channels [oc0, oc1); p0 is a multiple of tile_px, oc0 of tile_oc. */
    void (*conv)(const struct ggn_conv *conv, long p0, long p1, int oc0, int oc1);
    /* A faster form of a 3×3 convolution, NULL where there is none; see nn/winograd.h. Of conv, whose w is not read, at most
     * GGN_WINO_TILES tiles [t0, t1); the gradient of the weights by the adjoint, with GGN_WINO_GRAD_SCRATCH elements. */
    void (*wino)(const struct ggn_conv *conv, const real *u, int t0, int t1, int oc0, int oc1, real *scratch);
    void (*wino_grad)(const struct ggn_conv_grad *grad, real *scratch);
    void (*wino_pack)(real *u, const real *packed, int n_in, int n_out, int tile_oc);

    /* acc[i][tap][o] (vectors of lanes) += Σ_p dy[o][p]·x[i][p + tap], p in [p0, p1), for n_in ≤ GGN_GRAD_IC and
     * ot ≤ tile_oc; p1 is rounded up to whole vectors. */
    void (*conv_grad)(real *acc, const real *const *x, int n_in, const real *const *dy, int ot, int taps, int row, long p0,
                      long p1);
    /* out[k] = Σ of the lanes of acc[k] */
    void (*lane_sums)(real *out, const real *acc, int n);

    /* Planes of h × w with the given row distance. `add`: dx += instead of dx =. */
    double (*sum)(const real *x, int h, int w, int row);
    double (*sum_sq)(const real *x, double mean, int h, int w, int row); /* Σ (x − mean)² */
    void (*affine)(real *y, const real *x, real scale, real shift, int h, int w, int row);
    void (*bn_sums)(double out[2], const real *dy, const real *x, real mean, int h, int w,
                    int row); /* Σ dy, Σ dy(x − mean) */
    void (*bn_grad)(real *dx, const real *dy, const real *x, real a, real b, real c, int add, int h, int w,
                    int row); /* dx = a·dy + b·x + c */
    void (*lrelu)(real *y, const real *x, real slope, int h, int w, int row);
    void (*lrelu_grad)(real *dx, const real *dy, const real *y, real slope, int add, int h, int w, int row);
    double (*act_grad)(real *dy, const real *y, real slope, int h, int w, int row); /* dy *= act'(y); Σ dy */
    void (*sigmoid)(real *y, const real *x, int h, int w, int row);
    void (*sigmoid_grad)(real *dx, const real *dy, const real *y, int add, int h, int w, int row);
    /* y is h × w, x is 2h(+1) × 2w(+1) */
    void (*maxpool2)(real *y, const real *x, int h, int w, int row_y, int row_x);
    /* Writes (or adds to) all of dx, hx × wx; the first largest element of a window takes the gradient. */
    void (*maxpool2_grad)(real *dx, const real *dy, const real *x, const real *y, int add, int hx, int wx, int row_y,
                          int row_x);
    /* Bilinear ×2 of x (h × w) into y (2h × 2w), and its adjoint. */
    void (*up)(real *y, const real *x, int h, int w, int row_y, int row_x);
    void (*up_grad)(real *dx, const real *dy, int add, int h, int w, int row_y, int row_x);

    real (*dot)(const real *a, const real *b, long n);
    void (*axpy)(real *y, real a, const real *x, long n); /* y += a·x */

    /* Separable 11-tap filter of a zero-bordered buffer: `rows` rows of `row` elements, every row and column with
     * GGN_SSIM_RADIUS zeros around the h × w picture whose (0,0) is x. tmp as x. dst (h × w, row distance row). */
    void (*blur)(real *dst, const real *x, real *tmp, const real taps[2 * GGN_SSIM_RADIUS + 1], int h, int w, int row);

    /* One Adam step of n parameters: m, v moments; c1, c2 = 1/(1 − β^t). Kingma & Ba 2015, algorithm 1. */
    void (*adam)(real *param, const real *grad, real *m, real *v, long n, real lr, real beta1, real beta2, real c1, real c2,
                 real eps);
};

/* The table for `isa`, or NULL where it is not available. */
const struct ggn_kernels *ggn_kernels_for(enum base_isa isa);
/* The table for base_isa_best(). */
const struct ggn_kernels *ggn_kernels_best(void);

/* kernels_base.c, kernels_avx2.c, kernels_avx512.c; reached through the functions above. */
extern const struct ggn_kernels ggn_kernels_base, ggn_kernels_avx2, ggn_kernels_avx512;

#endif
