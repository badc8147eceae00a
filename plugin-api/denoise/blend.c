#include "denoise/blend.h"

#include <math.h>
#include <string.h>

enum { RADIUS = 9 };

/* exp(-k^2 / 18): a Gaussian of 3 px, up to three of its deviations. */
static const float weight[RADIUS + 1] = {1.0f,         0.945959469f, 0.800737403f, 0.606530660f, 0.411112291f,
                                         0.249352209f, 0.135335283f, 0.065728529f, 0.028565501f, 0.011108997f};

/* A pixel whose own square is more than this many of its neighbourhood's is a speck: two standard deviations. */
static const float SPECK = 4.0f;

/* One line of `count` values, `step` apart. */
static void pool_line(const float *from, int count, size_t step, float *to)
{
    for (int x = 0; x < count; x++) {
        int begin = x < RADIUS ? 0 : x - RADIUS, end = count - x <= RADIUS ? count - 1 : x + RADIUS;
        double sum = 0.0, total = 0.0;
        for (int k = begin; k <= end; k++) {
            double w = (double)weight[k < x ? x - k : k - x];
            sum += w * (double)from[(size_t)k * step];
            total += w;
        }
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
