#include "denoise/blend.h"

#include <math.h>
#include <string.h>

enum { RADIUS = 9, HOLE = 2 };

/* exp(-k^2 / 18): a Gaussian of 3 px, up to three of its deviations. */
static const float weight[RADIUS + 1] = {1.0f,         0.945959469f, 0.800737403f, 0.606530660f, 0.411112291f,
                                         0.249352209f, 0.135335283f, 0.065728529f, 0.028565501f, 0.011108997f};

/* A pixel whose own square is more than this many of its neighbourhood's is a speck: two standard deviations. */
static const float SPECK = 4.0f;

/* Of one line of `count` values, `step` apart, around x: the weighted sum of those that are at least `near` and at most
 * `far` away. */
static double sum_around(const float *line, int count, size_t step, int x, int near, int far, double *total)
{
    double sum = 0.0;
    *total = 0.0;
    for (int k = x - far > 0 ? x - far : 0; k < count && k <= x + far; k++) {
        const int away = k < x ? x - k : k - x;
        if (away >= near) {
            sum += (double)weight[away] * (double)line[(size_t)k * step];
            *total += (double)weight[away];
        }
    }
    return sum;
}

/* One line of `count` values, `step` apart. */
static void pool_line(const float *from, int count, size_t step, float *to)
{
    for (int x = 0; x < count; x++) {
        double total, sum = sum_around(from, count, step, x, 0, RADIUS, &total);
        to[(size_t)x * step] = (float)(sum / total);
    }
}

static void pool(float *map, int width, int height, float *scratch)
{
    for (int y = 0; y < height; y++)
        pool_line(map + (size_t)y * (size_t)width, width, 1, scratch + (size_t)y * (size_t)width);
    for (int x = 0; x < width; x++)
        pool_line(scratch + x, height, (size_t)width, map + x);
}

/* Weighted sums over the neighbourhood of each pixel without the middle of it: columns that are not in the middle with all
 * rows, and those that are with the other rows. */
static void sum_without_middle(const float *map, int width, int height, float *scratch, float *to)
{
    static const int across[2][2] = {{HOLE + 1, RADIUS}, {0, HOLE}}, down[2][2] = {{0, RADIUS}, {HOLE + 1, RADIUS}};
    const size_t row = (size_t)width;
    double total;
    memset(to, 0, row * (size_t)height * sizeof *to);
    for (int part = 0; part < 2; part++) {
        for (size_t y = 0; y < (size_t)height; y++)
            for (int x = 0; x < width; x++)
                scratch[y * row + (size_t)x] =
                    (float)sum_around(map + y * row, width, 1, x, across[part][0], across[part][1], &total);
        for (int y = 0; y < height; y++)
            for (size_t x = 0; x < row; x++)
                to[(size_t)y * row + x] +=
                    (float)sum_around(scratch + x, height, row, y, down[part][0], down[part][1], &total);
    }
}

void lull_blend_weights_blind(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha)
{
    const size_t n = (size_t)width * (size_t)height;
    float *denoised = scratch + n, *agreed = scratch + 2 * n;
    sum_without_middle(estimate->denoised, width, height, scratch, denoised);
    sum_without_middle(estimate->agreed, width, height, scratch, agreed);
    sum_without_middle(estimate->noisy, width, height, scratch, alpha);
    for (size_t i = 0; i < n; i++) { /* of sums: their weights are the same */
        const float mse = fmaxf(denoised[i], agreed[i]);
        alpha[i] = mse > 0.0f ? mse / (mse + alpha[i]) : 0.0f;
    }
}

float lull_blend_mse(const struct lull_estimate *pooled, size_t i) { return fmaxf(pooled->denoised[i], pooled->agreed[i]); }

void lull_blend_weights(const struct lull_estimate *estimate, int width, int height, float *scratch, float *alpha,
                        float *apart)
{
    const size_t n = (size_t)width * (size_t)height;
    memcpy(alpha, estimate->noisy, n * sizeof *alpha);
    memcpy(apart, estimate->agreed, n * sizeof *apart);
    pool(estimate->denoised, width, height, scratch);
    pool(estimate->agreed, width, height, scratch);
    pool(estimate->noisy, width, height, scratch);
    for (size_t i = 0; i < n; i++) {
        float mse = lull_blend_mse(estimate, i), noise = fmaxf(estimate->noisy[i], alpha[i] / SPECK);
        alpha[i] = mse > 0.0f ? mse / (mse + noise) : 0.0f;
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
