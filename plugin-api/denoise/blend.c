#include "denoise/blend.h"

#include <math.h>
#include <string.h>

/* Squares of what is estimated stay finite in float and in sums of it, whatever the pixels hold. */
static const double MOST = 1e15;

double lull_lightness_slope(double y)
{
    const double knee = 216.0 / 24389.0;
    double root = cbrt(y > knee ? y : knee);
    return y > knee ? 116.0 / (3.0 * root * root) : 24389.0 / 27.0;
}

static float bounded(double v) { return (float)(v < MOST ? (v > -MOST ? v : -MOST) : MOST); }

void lull_estimate_pixels(const struct lull_estimate_in *in, size_t n, const struct lull_estimate *out)
{
    const double split = in->share * (1.0 - in->share);
    for (size_t i = 0; i < n; i++) {
        const double a = (double)in->a[i], b = (double)in->b[i], fa = (double)in->fa[i], fb = (double)in->fb[i];
        const double xa = (double)in->xa[i], xb = (double)in->xb[i], away = fa - xa - (fb - xb);
        const double slope = lull_lightness_slope(0.5 * (fa + fb)), unit = slope * slope;
        const double crossed = 0.5 * ((fa - b) * (fa - xa) + (fb - a) * (fb - xb));
        const double other = 0.5 * (fa + fb - xa - xb), mean = 0.5 * (fa + fb - a - b);
        const double doubt = 0.5 * unit * ((fa - fb + a - b) * other - away * mean);
        out->gain[i] = bounded(unit * (crossed - 0.25 * (fa - fb) * away));
        out->doubt[i] = bounded(doubt * doubt);
        out->moved[i] = bounded(unit * other * other);
        out->agreed[i] = bounded(unit * 0.25 * (fa - fb) * (fa - fb));
        out->noisy[i] = bounded(unit * split * (a - b) * (a - b));
    }
}

enum { RADIUS = 12, HOLE = 2 };

/* exp(-k^2 / 32): a Gaussian of 4 px, up to three of its deviations. */
static const float weight[RADIUS + 1] = {1.0f,         0.969233234f, 0.882496903f, 0.754839602f, 0.606530660f,
                                         0.457833362f, 0.324652467f, 0.216265167f, 0.135335283f, 0.079559509f,
                                         0.043936934f, 0.022794181f, 0.011108997f};

/* (sum of weights)^2 / (sum of their squares) of the two-dimensional Gaussian: 4 pi 4^2. */
static const float PIXELS = 201.0f;

/* Standard errors that a pooled gain must exceed to count. */
static const float SURE = 1.5f;

/* A pixel whose own square is more than this many of its neighbourhood's is a speck: four standard deviations. */
static const float SPECK = 16.0f;

/* Of one line of `count` values, `step` apart, around x: the weighted sum of those that are at least `near` and at most
 * `far` away. */
static double sum_around(const float *line, int count, size_t step, int x, int near, int far)
{
    double sum = 0.0;
    for (int k = x - far > 0 ? x - far : 0; k < count && k <= x + far; k++) {
        const int away = k < x ? x - k : k - x;
        if (away >= near)
            sum += (double)weight[away] * (double)line[(size_t)k * step];
    }
    return sum;
}

/* Means of `lines` lines, `next` apart, each as above. */
static void pool_lines(const float *from, int lines, size_t next, int count, size_t step, float *to)
{
    static const float one = 1.0f;
    for (int x = 0; x < count; x++) {
        const double total = sum_around(&one, count, 0, x, 0, RADIUS); /* of the weights: that of a line of ones */
        for (size_t k = 0; k < (size_t)lines; k++)
            to[k * next + (size_t)x * step] = (float)(sum_around(from + k * next, count, step, x, 0, RADIUS) / total);
    }
}

static void pool(float *map, int width, int height, float *scratch)
{
    pool_lines(map, height, (size_t)width, width, 1, scratch);
    pool_lines(scratch, width, 1, height, (size_t)width, map);
}

static void square_all(const float *from, size_t n, float *to)
{
    for (size_t i = 0; i < n; i++)
        to[i] = from[i] * from[i];
}

/* Weighted sums over the neighbourhood of each pixel without the middle of it: columns that are not in the middle with all
 * rows, and those that are with the other rows. */
static void sum_without_middle(const float *map, int width, int height, float *scratch, float *to)
{
    static const int across[2][2] = {{HOLE + 1, RADIUS}, {0, HOLE}}, down[2][2] = {{0, RADIUS}, {HOLE + 1, RADIUS}};
    const size_t row = (size_t)width;
    memset(to, 0, row * (size_t)height * sizeof *to);
    for (int part = 0; part < 2; part++) {
        for (size_t y = 0; y < (size_t)height; y++)
            for (int x = 0; x < width; x++)
                scratch[y * row + (size_t)x] =
                    (float)sum_around(map + y * row, width, 1, x, across[part][0], across[part][1]);
        for (int y = 0; y < height; y++)
            for (size_t x = 0; x < row; x++)
                to[(size_t)y * row + x] += (float)sum_around(scratch + x, height, row, y, down[part][0], down[part][1]);
    }
}

/* What of a pooled gain is more than the noise of its estimate. square, doubt: of the gain, pooled. */
static float sure_gain(float gain, float square, float doubt)
{
    const float variance = fminf(fmaxf(square - gain * gain, 0.0f), doubt) / PIXELS;
    return gain > 0.0f ? fmaxf(gain - SURE * SURE * variance / gain, 0.0f) : 0.0f;
}

static float share(float gain, float moved) { return gain > 0.0f ? fminf(gain / moved, 1.0f) : 0.0f; }

void lull_blend_weights_cross_validated(const struct lull_estimate *estimate, int width, int height, float *scratch,
                                        float *alpha)
{
    const size_t n = (size_t)width * (size_t)height;
    float *gain = scratch + n;
    sum_without_middle(estimate->gain, width, height, scratch, gain);
    sum_without_middle(estimate->moved, width, height, scratch, alpha);
    for (size_t i = 0; i < n; i++) /* of sums: their weights are the same */
        alpha[i] = share(gain[i], alpha[i]);
}

void lull_blend_shares(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha)
{
    const size_t n = (size_t)width * (size_t)height;
    square_all(estimate->gain, n, alpha);
    pool(alpha, width, height, scratch);
    pool(estimate->gain, width, height, scratch);
    pool(estimate->doubt, width, height, scratch);
    pool(estimate->moved, width, height, scratch);
    for (size_t i = 0; i < n; i++)
        alpha[i] = share(sure_gain(estimate->gain[i], alpha[i], estimate->doubt[i]), estimate->moved[i]);
}

void lull_blend_mix(const float *other, const float *alpha, size_t n, float *to)
{
    for (size_t i = 0; i < 3 * n; i++)
        to[i] += alpha[i / 3] * (other[i] - to[i]);
}

void lull_blend_weights(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha,
                        float *apart)
{
    const size_t n = (size_t)width * (size_t)height;
    lull_blend_shares(estimate, width, height, scratch, alpha);
    memcpy(apart, estimate->agreed, n * sizeof *apart);
    pool(estimate->agreed, width, height, scratch);
    for (size_t i = 0; i < n; i++) {
        const float moved = estimate->moved[i], speck = estimate->noisy[i] / SPECK;
        alpha[i] *= speck > moved ? moved / speck : 1.0f;
        apart[i] = apart[i] > SPECK * estimate->agreed[i] ? sqrtf(SPECK * estimate->agreed[i] / apart[i]) : 1.0f;
    }
}

void lull_blend_despeckle(const float *apart, size_t n, float *fa, float *fb)
{
    for (size_t i = 0; i < 3 * n; i++) {
        float *brighter = fa[i] > fb[i] ? &fa[i] : &fb[i];
        const float darker = fminf(fa[i], fb[i]);
        *brighter = darker + apart[i / 3] * (*brighter - darker);
    }
}

void lull_blend(const float *noisy, const float *denoised, const float *alpha, size_t n, float *out)
{
    for (size_t i = 0; i < 3 * n; i++) {
        const float w = alpha[i / 3];
        out[i] = isfinite(noisy[i]) ? w * noisy[i] + (1.0f - w) * denoised[i] : denoised[i];
    }
}
