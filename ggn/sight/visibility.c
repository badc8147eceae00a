#include "sight/visibility.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "base/colour.h"

enum { RADIUS = 2, TAPS = 2 * RADIUS + 1, SUMS = 4, PATCH = 100 };

static const double TEXTURE_OFFSET = 2.0; /* L*: texture far below it hides nothing */

/* exp(-k^2 / (2 * 0.7^2)) over the sum of all five taps, k = 0, 1, 2: a Gaussian of 0.7 px; and the squares of these, which
 * take the variances of independent pixels to that of their blurred sum. */
static const double blur[RADIUS + 1] = {0.569912492, 0.205423697, 0.009620057};
static const double blur_of_variance[RADIUS + 1] = {0.569912492 * 0.569912492, 0.205423697 * 0.205423697,
                                                    0.009620057 * 0.009620057};

static const double MOMENTS = 0.2; /* their share of a mean square beside halves; chosen on recordings (docs/results.md) */

static const double GAUSSIAN_SIXTH = 15.0; /* sixth moment of a normal distribution over the cube of its second */

/* y in [0.008, 1], relative error below 1e-6: a first guess from the exponent, then two steps of Halley's method. */
static inline float cube_root(float y)
{
    uint32_t bits;
    float r;
    memcpy(&bits, &y, sizeof bits);
    bits = bits / 3 + 709921077u;
    memcpy(&r, &bits, sizeof r);
    for (int i = 0; i < 2; i++) {
        float cube = r * r * r;
        r *= (cube + 2.0f * y) / (2.0f * cube + y);
    }
    return r;
}

static inline float clamp01(float v) { return v > 0.0f ? (v < 1.0f ? v : 1.0f) : 0.0f; }

void ggn_visible_lightness(const float *rgb, size_t n, float *lightness)
{
    const float *red = rgb, *green = rgb + n, *blue = rgb + 2 * n;
    const float knee = 216.0f / 24389.0f, slope = 24389.0f / 27.0f;
    for (size_t i = 0; i < n; i++) {
        float y = (float)BASE_LUMINANCE_R * clamp01(red[i]) + (float)BASE_LUMINANCE_G * clamp01(green[i]) +
                  (float)BASE_LUMINANCE_B * clamp01(blue[i]);
        float root = 116.0f * cube_root(y > knee ? y : knee) - 16.0f;
        lightness[i] = y > knee ? root : slope * y;
    }
}

static int parts(int side) { return (side - 1) / PATCH + 1; }

/* Where part k of a side begins; part k + 1 begins where it ends. */
static int part_begin(int side, int k) { return (int)((int64_t)side * k / parts(side)); }

size_t ggn_visible_patches(int width, int height) { return (size_t)parts(width) * (size_t)parts(height); }

double ggn_visible_patch(int width, int height, size_t k, const double *texture, int rect[4])
{
    const int x = (int)(k % (size_t)parts(width)), y = (int)(k / (size_t)parts(width));
    rect[0] = part_begin(width, x);
    rect[1] = part_begin(height, y);
    rect[2] = part_begin(width, x + 1);
    rect[3] = part_begin(height, y + 1);
    return texture[k] + TEXTURE_OFFSET;
}

/* Means over a row of patches from sums over the rows of each column, which are 0 afterwards. */
static void patch_means(double *columns, int width, int rows, double *means)
{
    for (int k = 0; k < parts(width); k++) {
        int begin = part_begin(width, k), end = part_begin(width, k + 1);
        double sum = 0.0;
        for (int x = begin; x < end; x++) {
            sum += columns[x];
            columns[x] = 0.0;
        }
        means[k] = sum / ((double)(end - begin) * rows);
    }
}

size_t ggn_visibility_scratch(int width) { return (SUMS + 1) * ((size_t)width + 2 * RADIUS) + (size_t)parts(width); }

/* The row that stands at y + k - RADIUS; beyond the block its first or last. */
static const float *row_at(const float *image, int width, int height, int y)
{
    y = y < 0 ? 0 : y < height ? y : height - 1;
    return image + (size_t)y * (size_t)width;
}

/* column: [RADIUS + width + RADIUS], the middle is filled; repeats its ends outwards. */
static void extend(double *column, int width)
{
    for (int k = 0; k < RADIUS; k++) {
        column[k] = column[RADIUS];
        column[RADIUS + width + k] = column[RADIUS + width - 1];
    }
}

static inline double across(const double *c, const double *taps)
{
    return taps[2] * (c[0] + c[4]) + taps[1] * (c[1] + c[3]) + taps[0] * c[2];
}

/* One row of G, whose sixth power is added to the columns' sums. column: [RADIUS + width + RADIUS], blurred downwards. */
static void blur_row(const double *column, int width, double *sixth, float *blurred)
{
    for (int x = 0; x < width; x++) {
        double seen = across(column + x, blur), square = seen * seen;
        sixth[x] += square * square * square;
        if (blurred)
            blurred[x] = (float)seen;
    }
}

/* The same for a row of variances of G: the sixth power that is expected of Gaussian noise. */
static void expect_row(const double *column, int width, double *sixth)
{
    for (int x = 0; x < width; x++) {
        double variance = across(column + x, blur_of_variance);
        sixth[x] += GAUSSIAN_SIXTH * variance * variance * variance;
    }
}

/* Five rows around y, summed downwards. column: [RADIUS + width + RADIUS]. */
static void sum_columns(const float *image, int width, int height, int y, const double *taps, double *column)
{
    const float *row[TAPS];
    for (int k = 0; k < TAPS; k++)
        row[k] = row_at(image, width, height, y + k - RADIUS);
    for (int x = 0; x < width; x++)
        column[RADIUS + x] = taps[2] * (double)(row[0][x] + row[4][x]) + taps[1] * (double)(row[1][x] + row[3][x]) +
                             taps[0] * (double)row[2][x];
    extend(column, width);
}

/* Over the patches of one row of them: the sum of squares of what is seen, and the blurred rows in units of what texture
 * hides. */
static double finish_patches(const double *means, const double *texture, int width, int rows, float *blurred)
{
    double sum = 0.0;
    for (int k = 0; k < parts(width); k++) {
        double unit = 1.0 / sqrt(texture[k] + TEXTURE_OFFSET), seen = sqrt(cbrt(means[k])) * unit;
        sum += seen * seen;
        for (int y = 0; blurred && y < rows; y++)
            for (int x = part_begin(width, k); x < part_begin(width, k + 1); x++)
                blurred[(size_t)y * (size_t)width + (size_t)x] *= (float)unit;
    }
    return sum;
}

/* image: N, or with `expected` its variance. */
static double visible(const float *image, int expected, int width, int height, const double *texture, double *scratch,
                      float *blurred)
{
    const size_t row_size = (size_t)width;
    double *column = scratch, *sixth = column + row_size + 2 * RADIUS, *means = sixth + row_size, sum = 0.0;
    memset(sixth, 0, row_size * sizeof *sixth);
    for (int j = 0; j < parts(height); j++) {
        int begin = part_begin(height, j), end = part_begin(height, j + 1);
        for (int y = begin; y < end; y++) {
            sum_columns(image, width, height, y, expected ? blur_of_variance : blur, column);
            if (expected)
                expect_row(column, width, sixth);
            else
                blur_row(column, width, sixth, blurred ? blurred + (size_t)y * row_size : NULL);
        }
        patch_means(sixth, width, end - begin, means);
        sum += finish_patches(means, texture + (size_t)j * (size_t)parts(width), width, end - begin,
                              blurred ? blurred + (size_t)begin * row_size : NULL);
    }
    return sqrt(sum / (double)ggn_visible_patches(width, height));
}

double ggn_visible_noise(const float *noise, int width, int height, const double *texture, double *scratch, float *blurred)
{
    return visible(noise, 0, width, height, texture, scratch, blurred);
}

double ggn_visible_expected(const float *variance, int width, int height, const double *texture, double *scratch)
{
    return visible(variance, 1, width, height, texture, scratch, NULL);
}

double ggn_visible_together(double halves, double moments)
{
    return sqrt((1 - MOMENTS) * halves * halves + MOMENTS * moments * moments);
}

/* Sums over five rows of a, b, a b and ((a - b) / 2)^2, each [RADIUS + width + RADIUS]. */
static void sum_rows(const float *a, const float *b, int width, int height, int y, double *const columns[SUMS])
{
    const float *p[TAPS], *q[TAPS];
    for (int k = 0; k < TAPS; k++) {
        p[k] = row_at(a, width, height, y + k - RADIUS);
        q[k] = row_at(b, width, height, y + k - RADIUS);
    }
    for (int x = 0; x < width; x++) {
        double u = 0.0, v = 0.0, uv = 0.0, nn = 0.0;
        for (int k = 0; k < TAPS; k++) {
            double s = (double)p[k][x], t = (double)q[k][x], n = 0.5 * (s - t);
            u += s;
            v += t;
            uv += s * t;
            nn += n * n;
        }
        columns[0][RADIUS + x] = u;
        columns[1][RADIUS + x] = v;
        columns[2][RADIUS + x] = uv;
        columns[3][RADIUS + x] = nn;
    }
    for (int c = 0; c < SUMS; c++)
        extend(columns[c], width);
}

static inline double mean_of_window(const double *c) { return (c[0] + c[1] + c[2] + c[3] + c[4]) * (1.0 / (TAPS * TAPS)); }

void ggn_visible_texture(const float *a, const float *b, int width, int height, double *scratch, double *texture)
{
    const size_t stride = (size_t)width + 2 * RADIUS;
    double *const columns[SUMS] = {scratch, scratch + stride, scratch + 2 * stride, scratch + 3 * stride};
    double *deviation = scratch + SUMS * stride;
    memset(deviation, 0, (size_t)width * sizeof *deviation);
    for (int j = 0; j < parts(height); j++) {
        int begin = part_begin(height, j), end = part_begin(height, j + 1);
        for (int y = begin; y < end; y++) {
            sum_rows(a, b, width, height, y, columns);
            for (int x = 0; x < width; x++) {
                double covariance =
                    mean_of_window(columns[2] + x) - mean_of_window(columns[0] + x) * mean_of_window(columns[1] + x);
                double shared = covariance - (1.0 / TAPS) * mean_of_window(columns[3] + x);
                deviation[x] += sqrt(shared > 0.0 ? shared : 0.0);
            }
        }
        patch_means(deviation, width, end - begin, texture + (size_t)j * (size_t)parts(width));
    }
}
