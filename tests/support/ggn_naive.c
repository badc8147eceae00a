#include "support/ggn_naive.h"

static int weight_at(const struct ggn_naive_conv *c, int o, int i, int ky, int kx)
{
    if (c->transposed)
        return ((i * c->c_out + o) * c->kernel + c->kernel - 1 - ky) * c->kernel + c->kernel - 1 - kx;
    return ((o * c->c_in + i) * c->kernel + ky) * c->kernel + kx;
}

/* Calls nothing for taps outside of the picture: they read 0. */
static int source(const struct ggn_naive_conv *c, int i, int y, int x, int ky, int kx)
{
    int yy = y + ky - c->kernel / 2, xx = x + kx - c->kernel / 2;
    return yy >= 0 && yy < c->h && xx >= 0 && xx < c->w ? (i * c->h + yy) * c->w + xx : -1;
}

void ggn_naive_forward(const struct ggn_naive_conv *c, const double *x, const double *weight, const double *bias,
                       double slope, double *y)
{
    for (int o = 0; o < c->c_out; o++)
        for (int p = 0; p < c->h * c->w; p++) {
            double sum = bias[o];
            for (int i = 0; i < c->c_in; i++)
                for (int k = 0; k < c->kernel * c->kernel; k++) {
                    int at = source(c, i, p / c->w, p % c->w, k / c->kernel, k % c->kernel);
                    if (at >= 0)
                        sum += x[at] * weight[weight_at(c, o, i, k / c->kernel, k % c->kernel)];
                }
            y[o * c->h * c->w + p] = sum > 0 ? sum : slope * sum;
        }
}

void ggn_naive_backward(const struct ggn_naive_conv *c, const double *x, const double *weight, const double *dz, double *dx,
                        double *dweight, double *dbias)
{
    for (int o = 0; o < c->c_out; o++)
        for (int p = 0; p < c->h * c->w; p++) {
            double d = dz[o * c->h * c->w + p];
            dbias[o] += d;
            for (int i = 0; i < c->c_in; i++)
                for (int k = 0; k < c->kernel * c->kernel; k++) {
                    int at = source(c, i, p / c->w, p % c->w, k / c->kernel, k % c->kernel);
                    int w = weight_at(c, o, i, k / c->kernel, k % c->kernel);
                    if (at >= 0) {
                        dx[at] += d * weight[w];
                        dweight[w] += d * x[at];
                    }
                }
        }
}
