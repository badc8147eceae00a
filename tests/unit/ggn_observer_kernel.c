/* The model observer's kernel against naive ones, and the laws that it keeps. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"
#include "support/ggn_noise.h"
#include "support/ggn_observer_block.h"
#include "support/splitmix.h"

#include "base/files.h"
#include "sight/remaining.h"
#include "sight/visibility.h"

/* --- the kernel --- */

static double naive_lightness(double y) { return y > 216.0 / 24389.0 ? 116.0 * cbrt(y) - 16.0 : y * 24389.0 / 27.0; }

static void lightness(void **state)
{
    (void)state;
    enum { N = 4000 };
    static float rgb[3 * N], out[N];
    for (int i = 0; i < N; i++)
        rgb[i] = rgb[N + i] = rgb[2 * N + i] = (float)i / (N - 1);
    ggn_visible_lightness(rgb, N, out);
    for (int i = 0; i < N; i++)
        assert_near((double)out[i], naive_lightness((double)i / (N - 1)), 2e-4);
    /* one channel at a time, clamped; what is not a number is black */
    const float odd[3][4] = {{5.0f, 0.0f, -1.0f, NAN}, {0.0f, INFINITY, -INFINITY, NAN}, {-3.0f, 0.0f, 1.0f, 1e-30f}};
    ggn_visible_lightness(odd[0], 4, out);
    assert_near((double)out[0], naive_lightness(0.2126729), 1e-3);
    assert_near((double)out[1], naive_lightness(0.7151522), 1e-3);
    assert_near((double)out[2], naive_lightness(0.0721750), 1e-3);
    assert_near((double)out[3], 0.0, 1e-20);
}

static float pixel(const float *image, int w, int h, int x, int y)
{
    x = x < 0 ? 0 : x >= w ? w - 1 : x;
    y = y < 0 ? 0 : y >= h ? h - 1 : y;
    return image[y * w + x];
}

static int ends_of(int side, int k) { return side * k / ((side + 99) / 100); }

/* Mean over a patch of values [h][w]. */
static double patch_mean(const double *values, int w, int h, int patch)
{
    const int across = (w + 99) / 100, i = patch % across, j = patch / across;
    double sum = 0.0, n = 0.0;
    for (int y = ends_of(h, j); y < ends_of(h, j + 1); y++)
        for (int x = ends_of(w, i); x < ends_of(w, i + 1); x++, n += 1.0)
            sum += values[y * w + x];
    return sum / n;
}

static double naive_noise(const float *noise, int w, int h, const double *texture)
{
    const int patches = ((w + 99) / 100) * ((h + 99) / 100);
    double *sixth = malloc((size_t)(w * h) * sizeof *sixth), sum = 0.0;
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            double seen = 0.0, weights = 0.0;
            for (int j = -2; j <= 2; j++)
                for (int i = -2; i <= 2; i++) {
                    double g = exp(-0.5 * (i * i + j * j) / (0.7 * 0.7));
                    seen += g * (double)pixel(noise, w, h, x + i, y + j);
                    weights += g;
                }
            sixth[y * w + x] = pow(seen / weights, 6.0);
        }
    for (int k = 0; k < patches; k++)
        sum += pow(patch_mean(sixth, w, h, k), 1.0 / 3.0) / (texture[k] + 2.0);
    free(sixth);
    return sqrt(sum / patches);
}

static void naive_texture(const float *a, const float *b, int w, int h, double *texture)
{
    double *deviation = malloc((size_t)(w * h) * sizeof *deviation);
    for (int y = 0; y < h; y++)
        for (int x = 0; x < w; x++) {
            double u = 0.0, v = 0.0, uv = 0.0, nn = 0.0;
            for (int k = 0; k < 25; k++) {
                double p = (double)pixel(a, w, h, x + k % 5 - 2, y + k / 5 - 2),
                       q = (double)pixel(b, w, h, x + k % 5 - 2, y + k / 5 - 2);
                u += p / 25.0;
                v += q / 25.0;
                uv += p * q / 25.0;
                nn += (p - q) * (p - q) / 100.0;
            }
            deviation[y * w + x] = sqrt(fmax(uv - u * v - nn / 5.0, 0.0));
        }
    for (int k = 0; k < ((w + 99) / 100) * ((h + 99) / 100); k++)
        texture[k] = patch_mean(deviation, w, h, k);
    free(deviation);
}

/* L* of an 8-bit sRGB colour, by the definitions of sRGB and CIE. */
static float lightness_of_codes(const uint8_t *rgb)
{
    static const double weight[] = {0.2126, 0.7152, 0.0722};
    double y = 0.0;
    for (int c = 0; c < 3; c++) {
        double v = rgb[c] / 255.0;
        y += weight[c] * (v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4));
    }
    return (float)(y > 216.0 / 24389.0 ? 116.0 * cbrt(y) - 16.0 : y * 24389.0 / 27.0);
}

/* Images against references: blocks of 32 of 75x50 pixels, the last ones smaller. */
static void remaining_noise(void **state)
{
    (void)state;
    enum { WIDTH = 75, HEIGHT = 50, BLOCK = 32, COUNT = 6 };
    static uint8_t codes[2][HEIGHT * WIDTH * 3];
    static float map[HEIGHT * WIDTH], ours[BLOCK * BLOCK], theirs[BLOCK * BLOCK], noise[BLOCK * BLOCK];
    struct ggn_remaining blocks[COUNT];
    struct base_err err = {0};
    for (int i = 0; i < HEIGHT * WIDTH * 3; i++) {
        codes[0][i] = (uint8_t)(120 + 100 * sin(0.1 * (i % (3 * WIDTH))));
        codes[1][i] = (uint8_t)(codes[0][i] + (i % 41 == 0 && i > 3 * WIDTH * BLOCK ? 30 : 0));
    }
    struct pic_image reference = {.width = WIDTH, .height = HEIGHT, .channels = 3, .u8 = codes[0]}, image = reference;
    image.u8 = codes[1];
    assert_int_equal(ggn_remaining_count(WIDTH, HEIGHT, BLOCK), COUNT);
    const struct pic_image *const references[2] = {&reference};
    assert_int_equal(ggn_remaining(&ggn_observer_default, references, &image, BLOCK, blocks, map, &err), 0);
    for (int k = 0; k < COUNT; k++) {
        const struct ggn_remaining *b = blocks + k;
        int x0 = k % 3 * BLOCK, y0 = k / 3 * BLOCK, w = k % 3 == 2 ? 11 : BLOCK, h = k / 3 ? 18 : BLOCK;
        double sixth = 0.0, texture;
        assert_true(b->x == x0 && b->y == y0 && b->width == w && b->height == h);
        for (int i = 0; i < w * h; i++) {
            int p = (y0 + i / w) * WIDTH + x0 + i % w;
            ours[i] = lightness_of_codes(codes[1] + 3 * p);
            theirs[i] = lightness_of_codes(codes[0] + 3 * p);
            noise[i] = ours[i] - theirs[i];
            sixth += pow((double)map[p], 6.0) / (w * h);
        }
        naive_texture(theirs, theirs, w, h, &texture);
        assert_near(b->error, naive_noise(noise, w, h, &texture) / ggn_observer_default.level, 2e-4);
        assert_near(pow(sixth, 1.0 / 6.0), b->error, 1e-4);
        assert_true(k < 3 ? b->error == 0.0 : b->error > 0.1);
    }
}

/* Two noisy references say what a clean one says: of an image with an error of its own, and of one without. */
static void two_references(void **state)
{
    (void)state;
    enum { WIDTH = 200, HEIGHT = 200, SIZE = WIDTH * HEIGHT };
    static uint8_t codes[5][SIZE * 3];
    struct pic_image image[5];
    struct ggn_remaining got[2], none;
    struct base_err err = {0};
    uint64_t random = 9;
    for (int i = 0; i < SIZE; i++) {
        const double noise[5] = {0, splitmix_gauss(&random), splitmix_gauss(&random), splitmix_gauss(&random), 0};
        for (int k = 0; k < 5; k++)
            for (int c = 0; c < 3; c++)
                codes[k][3 * i + c] = (uint8_t)(128.5 + 2 * noise[k]);
    }
    for (int k = 0; k < 5; k++)
        image[k] = (struct pic_image){.width = WIDTH, .height = HEIGHT, .channels = 3, .u8 = codes[k]};
    const struct pic_image *const clean[2] = {&image[0]}, *const two[2] = {&image[1], &image[2]};
    assert_int_equal(ggn_remaining(&ggn_observer_default, clean, &image[3], WIDTH, &got[0], NULL, &err), 0);
    assert_int_equal(ggn_remaining(&ggn_observer_default, two, &image[3], WIDTH, &got[1], NULL, &err), 0);
    assert_int_equal(ggn_remaining(&ggn_observer_default, two, &image[4], WIDTH, &none, NULL, &err), 0);
    assert_near(got[1].error / got[0].error, 1.0, 0.06);
    assert_true(none.error < 0.4 * got[0].error);
}

static void kernel(void **state)
{
    (void)state;
    static const int sizes[][2] = {{W, H},   {1, 1},    {1, 7},    {3, 2},   {5, 5},   {200, 1},
                                   {41, 17}, {101, 30}, {205, 37}, {7, 350}, {100, 60}};
    static float a[P], b[P], noise[P];
    static double scratch[5 * 300], texture[8], naive[8];
    for (size_t k = 0; k < sizeof sizes / sizeof sizes[0]; k++) {
        int w = sizes[k][0], h = sizes[k][1];
        assert_true(ggn_visibility_scratch(w) <= sizeof scratch / sizeof scratch[0]);
        for (int i = 0; i < w * h; i++) {
            a[i] = 50.0f + 20.0f * (float)ggn_noise_gauss((uint32_t)i, 1);
            b[i] = a[i] + 10.0f * (float)ggn_noise_gauss((uint32_t)i, 2);
            noise[i] = (a[i] - b[i]) / 2;
        }
        assert_int_equal(ggn_visible_patches(w, h), ((w + 99) / 100) * ((h + 99) / 100));
        ggn_visible_texture(a, b, w, h, scratch, texture);
        naive_texture(a, b, w, h, naive);
        for (size_t i = 0; i < ggn_visible_patches(w, h); i++)
            assert_near(texture[i], naive[i], 1e-9);
        assert_near(ggn_visible_noise(noise, w, h, texture, scratch, NULL) / naive_noise(noise, w, h, naive), 1.0, 1e-6);
    }
    /* a bright pixel in a quiet block counts */
    memset(noise, 0, sizeof noise);
    noise[20 * W + 24] = 60.0f;
    assert_true(ggn_visible_noise(noise, W, H, (const double[]){0.0}, scratch, NULL) > 1.0);
    /* a constant picture has neither */
    for (int i = 0; i < P; i++)
        a[i] = 95.0f;
    ggn_visible_texture(a, a, W, H, scratch, texture);
    assert_near(texture[0], 0.0, 1e-6);
}

/* Two noisy means of one picture: the noise must not count as texture, nor the texture as noise. */
static void apart(void **state)
{
    (void)state;
    static float a[P], b[P], flat[2][P];
    static double scratch[5 * 300];
    double shared, smooth;
    for (int i = 0; i < P; i++) {
        float picture = (ggn_noise_hash((uint32_t)i, 9) & 1) ? 3.0f : -3.0f;
        float n = 2.0f * (float)ggn_noise_gauss((uint32_t)i, 3), m = 2.0f * (float)ggn_noise_gauss((uint32_t)i, 4);
        flat[0][i] = 50.0f + n;
        flat[1][i] = 50.0f + m;
        a[i] = flat[0][i] + picture;
        b[i] = flat[1][i] + picture;
    }
    ggn_visible_texture(a, b, W, H, scratch, &shared);
    ggn_visible_texture(flat[0], flat[1], W, H, scratch, &smooth);
    assert_near(shared, 3.0, 0.2); /* one picture alone would show sqrt(9 + 4) */
    assert_true(smooth < 0.4);     /* and sqrt(4) here */
}

static void people(void **state)
{
    (void)state;
    const struct ggn_observer o = {0.3, 0.4};
    assert_near(ggn_observer_p_noisy(&o, 1.0), 0.5, 1e-12);
    assert_near(ggn_observer_p_noisy(&o, exp2(0.2)), 0.8413447, 1e-6); /* one deviation, 0.4 octaves of samples */
    assert_near(ggn_observer_p_noisy(&o, 0.0), 0.0, 0);
    for (double p = 0.02; p < 1.0; p += 0.07)
        assert_near(ggn_observer_p_noisy(&o, ggn_observer_error_at(&o, p)), p, 1e-6);
}

/* --- closed forms --------------------------------------------------------------------------------------------------------- */

static void laws(void **state)
{
    (void)state;
    const struct ggn_observer o = {0.3, 0.4};
    char text[128];
    assert_near(ggn_observer_error(&o, 0.9, 49), (1 + 1.94 / 7) * 0.9 / 0.3, 1e-12);
    assert_near(ggn_observer_from_study(8000), 13333 + 1.0 / 3, 1e-6);
    assert_near(ggn_observer_from_study(10000), 20000, 0);
    assert_near(ggn_observer_from_study(12000), 20000, 0);
    assert_near(ggn_observer_from_study(100), 1 / (1 / 100.0 - 1 / 20000.0), 1e-9);
    assert_near(ggn_observer_to_study(13333 + 1.0 / 3), 8000, 1e-6);
    assert_near(ggn_observer_to_study(20000), 10000, 0);
    assert_near(ggn_observer_to_study(INFINITY), 10000, 0);
    assert_near(ggn_observer_p_noisy(&o, -1.0), 0.0, 0);
    assert_near(ggn_observer_p_noisy(&o, 0.5), 0.5 * erfc(2 / (0.4 * sqrt(2))), 1e-15);
    assert_near(ggn_observer_error_at(&o, 0.8413447460685429), exp2(0.2), 1e-9);
    assert_near(ggn_observer_error_at(&o, 0.25), exp2(-0.2 * 0.6744897501960817), 1e-9);
    assert_near(ggn_observer_next(100, 120, 1.5), 120, 0);
    assert_near(ggn_observer_next(100, 160, 1.5), 150, 0);
    assert_near(ggn_observer_next(100, 90, 1.5), 104, 1e-12);
    assert_near(ggn_observer_next(100, 90, 1.02), 102, 1e-12);
    ggn_observer_describe(&o, text, sizeof text);
    assert_string_equal(
        text, "model observer: noise in L* is seen above 0.3000 sqrt(texture + 2) of a patch, spread 0.40 octaves");
    /* 0.7 px: exp(-k^2 / 0.98) of five taps */
    static float impulse[15 * 15], seen[15 * 15];
    static double scratch[5 * 20];
    double taps = 1 + 2 * exp(-1 / 0.98) + 2 * exp(-4 / 0.98), sixth = 0, texture = 7;
    impulse[7 * 15 + 7] = 1;
    double noise = ggn_visible_noise(impulse, 15, 15, &texture, scratch, seen);
    for (int i = 0; i < 225; i++) {
        int x = abs(i % 15 - 7), y = abs(i / 15 - 7);
        double want = x > 2 || y > 2 ? 0 : exp(-(x * x + y * y) / 0.98) / taps / taps / sqrt(7 + 2);
        assert_near((double)seen[i], want, 1e-8);
        sixth += pow(want, 6);
    }
    assert_near(noise, pow(sixth / 225, 1.0 / 6), 1e-8);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lightness),      cmocka_unit_test(kernel), cmocka_unit_test(remaining_noise),
        cmocka_unit_test(two_references), cmocka_unit_test(apart),  cmocka_unit_test(people),
        cmocka_unit_test(laws),
    };
    return cmocka_run_group_tests_name("observer kernel", tests, NULL, NULL);
}
