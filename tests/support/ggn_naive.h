/* Convolution as its definition says, over gap-free arrays: the oracle of the fast kernels. */
#ifndef TESTS_SUPPORT_GGN_NAIVE_H
#define TESTS_SUPPORT_GGN_NAIVE_H

struct ggn_naive_conv {
    int c_in, c_out, h, w, kernel; /* stride 1, padding kernel / 2 */
    int transposed;                /* weights [in, out, k, k], flipped */
};

/* y[c_out][h][w] = leaky(b + w * x) */
void ggn_naive_forward(const struct ggn_naive_conv *c, const double *x, const double *weight, const double *bias,
                       double slope, double *y);
/* Adds the gradients for dz = gradient before the activation. */
void ggn_naive_backward(const struct ggn_naive_conv *c, const double *x, const double *weight, const double *dz, double *dx,
                        double *dweight, double *dbias);

#endif
