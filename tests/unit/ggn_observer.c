/* The model observer: its kernel against naive ones, thresholds from curves, halves against recorded levels, calibration
 * on made-up people. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/approve.h"
#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "base/files.h"
#include "observer/calibrate.h"
#include "observer/remaining.h"
#include "observer/views.h"
#include "observer/trials.h"
#include "observer/visibility.h"

enum { W = 96, H = 80, P = W * H };

static const uint32_t levels[] = {20, 30, 45, 68, 101, 152, 228, 342, 513, 769, 1153, 1730, 2595, 3892, 5839, 8758};
enum { LEVELS = sizeof levels / sizeof levels[0] };

static struct seq_block make_block(double sigma, double texture, uint32_t seed, uint32_t reference_spp)
{
    struct ggn_noise n = {W, H, levels, LEVELS, reference_spp, sigma, texture, seed, 0};
    return ggn_noise_block(&n);
}

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
        sum += pow(patch_mean(sixth, w, h, k), 1.0 / 6.0) / sqrt(texture[k] + 2.0);
    free(sixth);
    return sum / patches;
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
    assert_int_equal(ggn_remaining(&ggn_observer_default, &reference, &image, BLOCK, blocks, map, &err), 0);
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

/* --- thresholds --- */

static void thresholds(void **state)
{
    (void)state;
    double spp[] = {100, 200, 400, 800}, falling[] = {8, 4, 2, 1}, bumpy[] = {1, 0.5, 4, 1}, zero[] = {8, 0, 0, 0};
    struct ggn_curve c = {4, 4, spp, falling};
    int censored;
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 400, 1e-9);
    assert_near(ggn_curve_threshold(&c, sqrt(8.0), &censored), 200 * sqrt(2.0), 1e-9);
    assert_false(censored);
    assert_near(ggn_curve_threshold(&c, 0.5, &censored), 800, 0);
    assert_true(censored);
    assert_near(ggn_curve_threshold(&c, 10, &censored), 100, 0);
    assert_false(censored);
    c.visible = bumpy; /* below at first, visible again at 400: it must stay below */
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 400 * sqrt(2.0), 1e-9);
    c.visible = zero;
    assert_near(ggn_curve_threshold(&c, 2.0, &censored), 100 * sqrt(2.0), 1e-9); /* half way where no line can be drawn */
    c.visible = falling;
    assert_near(ggn_curve_at(&c, 400), 2, 1e-12);
    assert_near(ggn_curve_at(&c, 25), 16, 1e-12); /* twice the noise of 100 samples */
    assert_near(ggn_curve_at(&c, 1e4), 1, 0);
    assert_near(ggn_curve_at(&c, 283), sqrt(8.0), 3e-3);
}

static double threshold_of(const struct seq_block *b, const struct ggn_observer *o, enum ggn_curve_source source)
{
    struct ggn_curve c;
    struct base_err err = {0};
    int censored;
    if (ggn_curve_make(b, source, 1, &c, &err) != 0)
        fail_msg("%s", err.text);
    double t = ggn_curve_threshold(&c, o->level, &censored);
    assert_false(censored);
    ggn_curve_release(&c);
    return t;
}

/* Noise that is sigma/sqrt(n) crosses a fixed visibility at n ~ sigma^2, from either source; texture lowers it. */
static void scaling(void **state)
{
    (void)state;
    struct ggn_observer o = {0.33, 0.4};
    double last = 0.0;
    for (int i = 0; i < 3; i++) {
        double sigma = 0.2 * pow(2.0, i);
        struct seq_block b = make_block(sigma, 0.0, (uint32_t)i + 1, 4096);
        double recorded = threshold_of(&b, &o, GGN_FROM_LEVELS), halves = threshold_of(&b, &o, GGN_FROM_HALVES);
        assert_near(log2(halves / recorded), 0.0,
                    0.25); /* far above the limit, noise scatters into the texture of a smooth block */
        if (i > 0)
            assert_near(log2(recorded / last), 2.0, 0.2); /* twice the noise: four times the samples */
        last = recorded;
        seq_block_release(&b);
    }
    struct seq_block busy = make_block(0.8, 0.1, 3, 4096);
    assert_true(threshold_of(&busy, &o, GGN_FROM_LEVELS) < 0.5 * last);
    seq_block_release(&busy);
}

/* A reference of few samples must not raise the threshold: its own noise is taken out of the difference, and is no
 * texture. */
static void noisy_reference(void **state)
{
    (void)state;
    struct ggn_observer o = {0.25, 0.4};
    struct seq_block good = make_block(0.6, 0.0, 5, 1000000), poor = make_block(0.6, 0.0, 5, 1024);
    double a = threshold_of(&good, &o, GGN_FROM_LEVELS), b = threshold_of(&poor, &o, GGN_FROM_LEVELS);
    assert_true(a > 1024);
    assert_near(log2(b / a), 0.0, 0.15);
    seq_block_release(&good);
    seq_block_release(&poor);
}

/* Recorded to 342 spp only, a threshold beyond is found where the full recording puts it. */
static void beyond_the_last_level(void **state)
{
    (void)state;
    struct ggn_observer o = {0.33, 0.4};
    struct ggn_noise n = {W, H, levels, LEVELS, 4096, 0.6, 0.0, 6, 0}, few = {W, H, levels, 8, 4096, 0.6, 0.0, 6, 0};
    struct seq_block all = ggn_noise_block(&n), head = ggn_noise_block(&few);
    double a = threshold_of(&all, &o, GGN_FROM_LEVELS), b = threshold_of(&head, &o, GGN_FROM_LEVELS);
    assert_true(a > 500);
    assert_near(log2(b / a), 0.0, 0.15);
    seq_block_release(&all);
    seq_block_release(&head);
}

static void needs(void **state)
{
    (void)state;
    struct ggn_curve c;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.0, 7, 0);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 1, &c, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "no reference"));
    for (uint32_t l = 0; l < b.n_levels; l++)
        for (uint32_t p = 0; p < b.levels[l].n_planes; p++)
            if (b.levels[l].planes[p].plane == SEQ_PLANE_HALF_F16)
                b.levels[l].n_planes = p;
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &c, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "no full level"));
    seq_block_release(&b);
}

/* Visible noise of mean +- scale * d, [3][h][w], in the texture of mean +- d. */
static double seen_by_hand(const float *mean, const float *d, int w, int h, double scale)
{
    const size_t n = (size_t)(w * h);
    float *rgb = malloc(3 * n * sizeof *rgb), *l = malloc(2 * n * sizeof *l);
    double *scratch = malloc(ggn_visibility_scratch(w) * sizeof *scratch), texture[16];
    for (int pass = 0; pass < 2; pass++) {
        for (int side = 0; side < 2; side++) {
            float factor = (float)((side ? -1.0 : 1.0) * (pass ? scale : 1.0));
            for (size_t i = 0; i < 3 * n; i++)
                rgb[i] = mean[i] + factor * d[i];
            ggn_visible_lightness(rgb, n, l + (size_t)side * n);
        }
        if (pass == 0)
            ggn_visible_texture(l, l + n, w, h, scratch, texture);
    }
    for (size_t i = 0; i < n; i++)
        l[i] = 0.5f * (l[i] - l[n + i]);
    double seen = ggn_visible_noise(l, w, h, texture, scratch, NULL);
    free(scratch);
    free(l);
    free(rgb);
    return seen;
}

static const struct seq_record *full_of(const struct seq_block *b)
{
    const struct seq_record *r = b->levels;
    while (!seq_has(r, SEQ_PLANE_HALF_F16))
        r++;
    return r;
}

/* A part is judged as a block of its size would be: by hand from the cropped halves; the whole is a part too. */
static void parts(void **state)
{
    (void)state;
    enum { X = 17, Y = 9, PW = 40, PH = 30, AT = 20 };
    static float mean[3 * P], d[3 * P], cut[2][3 * PW * PH];
    struct ggn_curve whole, all, part;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.2, 11, 0);
    const struct seq_record *full = full_of(&b);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &whole, &err), 0);
    assert_int_equal(ggn_curve_part(&b, 0, 0, W, H, &all, &err), 0);
    assert_int_equal(ggn_curve_part(&b, X, Y, PW, PH, &part, &err), 0);
    assert_memory_equal(whole.visible, all.visible, (size_t)all.n * sizeof *all.visible);
    assert_int_equal(seq_mean(&b, full, mean, &err), 0);
    assert_int_equal(seq_half(&b, full, d, &err), 0);
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < PW * PH; k++) {
            int at = c * P + (Y + k / PW) * W + X + k % PW;
            cut[0][c * PW * PH + k] = mean[at];
            cut[1][c * PW * PH + k] = d[at];
        }
    assert_true(part.spp[AT] > full->spp);
    assert_near(seen_by_hand(cut[0], cut[1], PW, PH, sqrt(full->spp / part.spp[AT])), part.visible[AT],
                1e-5 * part.visible[AT]);
    assert_int_equal(ggn_curve_part(&b, X, Y, W, PH, &all, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "has no part"));
    ggn_curve_release(&whole);
    ggn_curve_release(&all);
    ggn_curve_release(&part);
    seq_block_release(&b);
}

/* Blocks side by side are judged as one: by hand from their planes beside each other; one block alone is itself. */
static void joined(void **state)
{
    (void)state;
    enum { AT = 20 };
    static float planes[2][3 * P], pair[2][3 * 2 * P];
    struct base_err err = {0};
    struct seq_block b[2] = {make_block(0.3, 0.2, 11, 0), make_block(0.6, 0.1, 12, 0)};
    struct ggn_curve whole, one, two;
    assert_int_equal(ggn_curve_make(&b[0], GGN_FROM_HALVES, 1, &whole, &err), 0);
    assert_int_equal(ggn_curve_joined(b, 1, 1, &one, &err), 0);
    assert_memory_equal(whole.visible, one.visible, (size_t)one.n * sizeof *one.visible);
    assert_int_equal(ggn_curve_joined(b, 2, 1, &two, &err), 0);
    for (int k = 0; k < 2; k++) {
        assert_int_equal(seq_mean(&b[k], full_of(&b[k]), planes[0], &err), 0);
        assert_int_equal(seq_half(&b[k], full_of(&b[k]), planes[1], &err), 0);
        for (int what = 0; what < 2; what++)
            for (int v = 0; v < 3 * P; v++)
                pair[what][v / P * 2 * P + v % P / W * 2 * W + k * W + v % W] = planes[what][v];
    }
    assert_true(two.spp[AT] > full_of(&b[0])->spp);
    assert_near(seen_by_hand(pair[0], pair[1], 2 * W, H, sqrt(full_of(&b[0])->spp / two.spp[AT])), two.visible[AT],
                1e-5 * two.visible[AT]);
    const int levels_of_both = two.recorded;
    ggn_curve_release(&two);
    b[1].levels[0].spp += 1; /* one has no such level: it is left out */
    assert_int_equal(ggn_curve_joined(b, 2, 1, &two, &err), 0);
    assert_int_equal(two.recorded, levels_of_both - 1);
    ggn_curve_release(&two);
    b[1].levels[full_of(&b[1]) - b[1].levels].spp += 1; /* another level than the first block's */
    assert_int_equal(ggn_curve_joined(b, 2, 1, &two, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "same size and samples"));
    ggn_curve_release(&whole);
    ggn_curve_release(&one);
    for (int k = 0; k < 2; k++)
        seq_block_release(&b[k]);
}

/* --- calibration --- */

enum { VIEWS = 3, BLOCKS = 6 };

/* Views of made-up blocks, quiet and busy ones, and people who are an observer of the family. */
static void make_views(const char *dir, const struct ggn_observer *person, struct ggn_dataset *data, struct ggn_view *human)
{
    static const uint32_t few[] = {64, 384};
    for (int v = 0; v < VIEWS; v++) {
        char view[128], scene[24];
        double sigma[BLOCKS];
        struct ggn_noise n = {W, H, few, 2, 0, 0.0, 0.05 * v, (uint32_t)v + 1, 0};
        for (int i = 0; i < BLOCKS; i++)
            sigma[i] = (0.2 + 0.08 * i) * (1.0 + v);
        snprintf(view, sizeof view, "%s/view%d", dir, v);
        snprintf(scene, sizeof scene, "scene%d", v);
        ggn_noise_view(view, scene, &n, sigma, BLOCKS, 1.0);
    }
    assert_int_equal(ggn_dataset_open(dir, data, NULL), 0);
    assert_int_equal(data->n, VIEWS);
    struct base_threads *threads = base_threads_create(2, NULL);
    for (int v = 0; v < VIEWS; v++) {
        struct ggn_labels l;
        assert_int_equal(ggn_view_label(person, &data->views[v], GGN_FROM_HALVES, threads, &l, NULL), 0);
        human[v] = (struct ggn_view){.n = BLOCKS, .spp = malloc(BLOCKS * sizeof(double))};
        for (int i = 0; i < BLOCKS; i++)
            human[v].spp[i] = ggn_observer_to_study(l.labels[i].threshold);
        ggn_labels_release(&l);
    }
    base_threads_destroy(threads);
}

/* Halves against really recorded levels, of a quiet block, one that is noisy up to the last level, and one with texture. */
static void checks(void **state)
{
    (void)state;
    static const uint32_t few[] = {16, 32, 64, 128, 256, 512};
    static const double sigma[] = {0.15, 2.5, 0.5};
    char dir[] = "/tmp/ggn_checks.XXXXXX", view[64], command[80], *report;
    struct ggn_noise n = {40, 32, few, 6, 2048, 0.0, 0.02, 5, 0};
    struct ggn_dataset data;
    struct ggn_check found[3];
    struct ggn_labels l;
    struct base_err err = {0};
    size_t size;
    FILE *f = open_memstream(&report, &size);
    assert_non_null(mkdtemp(dir));
    snprintf(view, sizeof view, "%s/view", dir);
    ggn_noise_view(view, "scene", &n, sigma, 3, 1.0);
    assert_int_equal(ggn_dataset_open(dir, &data, NULL), 0);
    struct base_threads *threads = base_threads_create(2, NULL);
    assert_int_equal(ggn_view_check(&ggn_observer_default, &data.views[0], threads, found, &err), 0);
    for (int i = 0; i < 3; i++)
        fprintf(f, "block %u: halves %.6g recorded %.6g beyond %d curve %.6g\n", found[i].id, found[i].halves,
                found[i].recorded, found[i].beyond, found[i].curve);
    assert_int_equal(ggn_view_label(&ggn_observer_default, &data.views[0], GGN_FROM_LEVELS, threads, &l, &err), 0);
    fprintf(f, "%s, cap %g, spread %g\n", l.detail, l.cap, l.spread);
    for (uint32_t i = 0; i < l.n; i++)
        fprintf(f, "block %u: %.6g censored %d\n", l.labels[i].id, l.labels[i].threshold, l.labels[i].censored);
    fclose(f);
    approve_text("tests/golden/ggn_observer_checks.txt", report);
    free(report);
    ggn_labels_release(&l);
    base_threads_destroy(threads);
    ggn_dataset_release(&data);
    snprintf(command, sizeof command, "rm -r %s", dir);
    assert_int_equal(system(command), 0);
}

/* All that is written about a calibration, and about the labels of a view, as recorded. */
static void record(const char *path, const struct ggn_dataset_view *view, const struct ggn_calibration *c,
                   struct base_threads *threads)
{
    struct base_err err = {0};
    struct ggn_labels l;
    char *text, *report;
    size_t size;
    assert_int_equal(base_file_read(path, 1 << 20, &text, &size, &err), 0);
    FILE *f = open_memstream(&report, &size);
    fputs(text, f);
    free(text);
    for (int i = 0; i < c->n_blocks; i++)
        fprintf(f, "view %d block %u: people %.6g, the others' observer %.6g\n", c->blocks[i].view, c->blocks[i].id,
                c->blocks[i].human, c->blocks[i].predicted);
    assert_int_equal(ggn_view_label(&c->observer, view, GGN_FROM_HALVES, threads, &l, &err), 0);
    fprintf(f, "%s: %s, cap %g, spread %g\n", l.source, l.detail, l.cap, l.spread);
    for (uint32_t i = 0; i < l.n; i++)
        fprintf(f, "block %u: %.6g censored %d\n", l.labels[i].id, l.labels[i].threshold, l.labels[i].censored);
    ggn_labels_release(&l);
    fclose(f);
    approve_text("tests/golden/ggn_observer_calibration.txt", report);
    free(report);
}

static void calibration(void **state)
{
    (void)state;
    char dir[] = "/tmp/ggn_observer.XXXXXX", path[64], command[200];
    const struct ggn_observer person = {0.4, 0.3};
    struct ggn_dataset data;
    struct ggn_view human[VIEWS];
    struct ggn_calibration_input inputs[VIEWS];
    struct ggn_calibration c;
    struct ggn_observer back;
    struct base_err err = {0};
    assert_non_null(mkdtemp(dir));
    make_views(dir, &person, &data, human);
    for (int v = 0; v < VIEWS; v++)
        inputs[v] = (struct ggn_calibration_input){&data.views[v], &human[v]};
    struct base_threads *threads = base_threads_create(2, NULL);
    if (ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, &err) != 0)
        fail_msg("%s", err.text);
    assert_true(c.n_views == VIEWS && c.n_blocks == VIEWS * BLOCKS && c.views[1].blocks == BLOCKS);
    assert_near(c.observer.level, person.level, 0.01);
    for (int v = 0; v < VIEWS; v++)
        assert_true(c.views[v].median_abs_log2 < 0.05 && c.views[v].spearman > 0.9 && c.views[v].share_below == 0.0);
    /* A view whose people see more than the others' is wrong by what they see more, and the others are no worse for it. */
    ggn_calibration_release(&c);
    for (int i = 0; i < BLOCKS; i++)
        human[2].spp[i] *= 2.0;
    human[2].spp[5] = 12000; /* people look no further than 10,000: no point of a fit, and no error beyond */
    assert_int_equal(ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, &err), 0);
    assert_near(c.views[2].median_log2, -1.0, 0.1);
    c.views[2].level *= 1.5; /* so that it can be told from the others' */
    snprintf(path, sizeof path, "%s/observer.json", dir);
    assert_int_equal(ggn_calibration_write(path, &c, &err), 0);
    record(path, &data.views[1], &c, threads);
    assert_int_equal(ggn_observer_read(path, NULL, &back, &err), 0);
    assert_near(back.level, c.observer.level, 1e-9);
    assert_near(back.spread, c.observer.spread, 1e-9);
    assert_int_equal(ggn_observer_read(path, "view2", &back, &err), 0);
    assert_near(back.level, c.views[2].level, 1e-9);
    assert_true(fabs(back.level - c.observer.level) > 0.01);
    assert_int_equal(ggn_observer_read(path, "view9", &back, &err), 0); /* no part of the fit */
    assert_near(back.level, c.observer.level, 1e-9);
    ggn_calibration_release(&c);
    assert_int_equal(ggn_calibrate(inputs, 1, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "calibration leaves one view out: it needs at least 2 views, there is 1");
    for (int i = 0; i < BLOCKS; i++) /* one block below the cap in each of two views is enough, none in one is not */
        human[0].spp[i] = human[1].spp[i] = i < 1 ? human[1].spp[i] : 10000;
    assert_int_equal(ggn_calibrate(inputs, 2, GGN_FROM_HALVES, threads, &c, &err), 0);
    ggn_calibration_release(&c);
    human[0].spp[0] = 10000;
    assert_int_equal(ggn_calibrate(inputs, 2, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "calibration needs a noisy block with a threshold below 10000 in the other views");
    human[1].spp[3] = 0;
    assert_int_equal(ggn_calibrate(inputs, 2, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    snprintf(command, sizeof command, "%s/view1: block 3 has no threshold in ''", dir);
    assert_string_equal(err.text, command);
    human[1].n = BLOCKS - 1;
    assert_int_equal(ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, &err), BASE_EINVAL);
    snprintf(command, sizeof command, "'' has 5 thresholds, %s/view1 has 6 blocks of 96 pixels", dir);
    assert_string_equal(err.text, command);
    base_threads_destroy(threads);
    for (int v = 0; v < VIEWS; v++)
        free(human[v].spp);
    ggn_dataset_release(&data);
    snprintf(command, sizeof command, "rm -r %s", dir);
    assert_int_equal(system(command), 0);
}

/* The people of three views see from 0.3, mostly 0.4 and 0.5 on: without the third, most see from 0.3 on; with it, 0.4 is the
 * nearest to all. */
static void left_out(void **state)
{
    (void)state;
    char dir[] = "/tmp/ggn_observer.XXXXXX", command[64];
    const struct ggn_observer people[] = {{0.3, 0.3}, {0.4, 0.3}, {0.5, 0.3}};
    struct ggn_dataset data;
    struct ggn_view human[VIEWS];
    struct ggn_calibration_input inputs[VIEWS];
    struct ggn_calibration c;
    assert_non_null(mkdtemp(dir));
    make_views(dir, &people[0], &data, human);
    struct base_threads *threads = base_threads_create(2, NULL);
    for (int v = 0; v < VIEWS; v++) {
        struct ggn_labels l;
        assert_int_equal(ggn_view_label(&people[v], &data.views[v], GGN_FROM_HALVES, threads, &l, NULL), 0);
        for (int i = v == 1 ? 1 : 0; i < BLOCKS; i++)
            human[v].spp[i] = ggn_observer_to_study(l.labels[i].threshold);
        ggn_labels_release(&l);
        inputs[v] = (struct ggn_calibration_input){&data.views[v], &human[v]};
    }
    assert_int_equal(ggn_calibrate(inputs, VIEWS, GGN_FROM_HALVES, threads, &c, NULL), 0);
    assert_near(c.views[2].level, 0.3, 0.01);
    assert_near(c.observer.level, 0.4, 0.01);
    ggn_calibration_release(&c);
    base_threads_destroy(threads);
    for (int v = 0; v < VIEWS; v++)
        free(human[v].spp);
    ggn_dataset_release(&data);
    snprintf(command, sizeof command, "rm -r %s", dir);
    assert_int_equal(system(command), 0);
}

static void parameters(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_observer.XXXXXX";
    struct ggn_observer o;
    struct base_err err = {0};
    FILE *f = fdopen(mkstemp(path), "w");
    fputs("{\"level\": 0.3}", f);
    fclose(f);
    assert_int_equal(ggn_observer_read(path, NULL, &o, &err), BASE_EINVAL);
    unlink(path);
}

/* The file beside the code says what the code has built in. */
static void built_in(void **state)
{
    (void)state;
    struct ggn_observer o;
    struct base_err err = {0};
    if (ggn_observer_read("ggn/observer/observer.json", NULL, &o, &err) != 0)
        fail_msg("%s", err.text);
    assert_near(o.level, ggn_observer_default.level, 1e-6);
    assert_near(o.spread, ggn_observer_default.spread, 1e-6);
}

static void trials(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_trials.XXXXXX";
    FILE *f = fdopen(mkstemp(path), "w");
    for (uint32_t i = 0; i < 800; i++) { /* four blocks, spread of half an octave */
        double level = 5.0 * exp2(6.0 * (ggn_noise_hash(i, 1) / 4294967296.0));
        double x = log2(20.0 * level), t = 8.5 + 0.4 * (i % 4);
        fprintf(f, "%u.0;%.1f;%d\n", i % 4, level, x + 0.5 * ggn_noise_gauss(i, 3) < t);
    }
    fputs("0.0;1.0;05.0;6.0;1\n0.0;0.0;0\n", f);
    fclose(f);
    double spread;
    int blocks, n, skipped;
    assert_int_equal(ggn_trials_spread(path, &spread, &blocks, &n, &skipped, NULL), 0);
    assert_true(blocks == 4 && n == 800 && skipped == 2);
    assert_near(spread, 0.5, 0.12);
    unlink(path);
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

/* Every place of a curve: which levels there are, and what lies between them. */
static void levels_of_curves(void **state)
{
    (void)state;
    enum { BELOW = 7, FULL = 342, FIRST = 25, LAST = BELOW + 48 - FIRST + 1 }; /* of the simulated levels 0 ... 48 */
    struct ggn_curve c;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.1, 3, 4096);
    assert_int_equal(full_of(&b)->spp, FULL);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &c, &err), 0);
    assert_true(c.n == LAST + 1 && c.recorded == BELOW + 1);
    for (int i = 0; i <= BELOW; i++) { /* levels up to the full one by their own halves: nothing is simulated there */
        double seen;
        assert_near(c.spp[i], levels[i], 0);
        assert_int_equal(ggn_curve_level(&b, &b.levels[i], &seen, &err), 0);
        assert_near(log2(seen / c.visible[i]), 0, i == BELOW ? 1e-9 : 0.2); /* its own texture or the full level's */
    }
    for (int i = BELOW + 1; i <= LAST; i++)
        assert_near(c.spp[i], 20000 * exp2(0.25 * (i - LAST)), 1e-9);
    assert_near(ggn_curve_at(&c, 20000), c.visible[LAST], 0);
    assert_near(ggn_curve_at(&c, 1e6), c.visible[LAST], 0);
    assert_near(ggn_curve_at(&c, sqrt(c.spp[20] * c.spp[21])), sqrt(c.visible[20] * c.visible[21]), 1e-12);
    assert_near(ggn_curve_at(&c, c.spp[0]), c.visible[0], 0);
    double keep = c.visible[21];
    c.visible[21] = 0; /* no logarithm of it: along the line */
    assert_near(ggn_curve_at(&c, sqrt(c.spp[20] * c.spp[21])), 0.5 * c.visible[20], 1e-12);
    c.visible[21] = keep;
    ggn_curve_release(&c);
    assert_true(!c.spp && !c.visible && c.n == 0);
    for (int independent = 0; independent < 2; independent++) {
        assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, independent, &c, &err), 0);
        assert_int_equal(c.recorded, LEVELS);
        assert_int_equal(c.n, LEVELS + 5 * independent); /* 8758 * 1.07 < 10000, 11892, 14142, 16818, 20000 */
        for (int i = 0; i < LEVELS; i++)
            assert_near(c.spp[i], levels[i], 0);
        if (independent)
            assert_near(c.spp[LEVELS + 4], 20000, 0);
        ggn_curve_release(&c);
    }
    double grey[2];
    for (int k = 0; k < 2; k++) /* luminance alone is kept of other levels: as visible as their samples say */
        assert_int_equal(ggn_curve_level(&b, full_of(&b) - 2 * k, &grey[k], &err), 0);
    assert_near(log2(grey[1] / grey[0]), 0.5 * log2(342.0 / 152), 0.1);
    seq_block_release(&b);
}

/* Where the noise of one level is, of a block seen through its reference: by hand, of shared and of other samples. */
static void levels_by_hand(void **state)
{
    (void)state;
    static float mean[3 * P], reference[3 * P], work[3 * P], l[3][P];
    struct ggn_curve c;
    struct base_err err = {0};
    struct seq_block b = make_block(0.3, 0.2, 3, 1024);
    double *scratch = malloc(ggn_visibility_scratch(W) * sizeof *scratch), texture;
    assert_int_equal(seq_mean(&b, b.reference, reference, &err), 0);
    ggn_visible_lightness(reference, P, l[2]);
    for (int independent = 0; independent < 2; independent++) {
        assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, independent, &c, &err), 0);
        assert_int_equal(seq_mean(&b, &b.levels[LEVELS - 1], mean, &err), 0);
        ggn_visible_lightness(independent ? mean : reference, P, l[1]); /* the last level's */
        ggn_visible_texture(l[1], l[2], W, H, scratch, &texture);
        for (int k = 0; k < LEVELS; k += LEVELS - 1) {
            const double scale = independent ? sqrt(1024 / (1024.0 + levels[k])) : 1;
            assert_int_equal(seq_mean(&b, &b.levels[k], mean, &err), 0);
            for (int i = 0; i < 3 * P; i++)
                work[i] = reference[i] + (float)scale * (mean[i] - reference[i]);
            ggn_visible_lightness(work, P, l[0]);
            for (int i = 0; i < P; i++)
                l[0][i] -= l[2][i];
            assert_near(c.visible[k], ggn_visible_noise(l[0], W, H, &texture, scratch, NULL), 1e-6);
        }
        ggn_curve_release(&c);
    }
    free(scratch);
    seq_block_release(&b);
}

/* Whole lines of what cannot be judged. */
static void refusals(void **state)
{
    (void)state;
    struct base_err err = {0};
    struct ggn_curve c;
    struct seq_block b = make_block(0.3, 0.0, 7, 0);
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_LEVELS, 1, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "block 7 has no reference: record one, or use --source halves");
    static const int parts_of[][5] = {{0, 0, W, H, 1},     {-1, 0, 5, 5, 0},    {0, -1, 5, 5, 0},
                                      {0, 0, 0, 5, 0},     {0, 0, 5, 0, 0},     {W - 5, 0, 5, H, 1},
                                      {W - 4, 0, 5, 5, 0}, {0, H - 4, 5, 5, 0}, {W - 1, H - 1, 1, 1, 1}};
    for (size_t i = 0; i < sizeof parts_of / sizeof parts_of[0]; i++) {
        const int *p = parts_of[i];
        char want[64];
        int rc = ggn_curve_part(&b, p[0], p[1], p[2], p[3], &c, &err);
        assert_int_equal(rc, p[4] ? 0 : BASE_EINVAL);
        snprintf(want, sizeof want, "block 7 has no part %dx%d at %d, %d", p[2], p[3], p[0], p[1]);
        if (rc)
            assert_string_equal(err.text, want);
        else
            ggn_curve_release(&c);
    }
    for (uint32_t l = 0; l < b.n_levels; l++)
        for (uint32_t p = 0; p < b.levels[l].n_planes; p++)
            if (b.levels[l].planes[p].plane == SEQ_PLANE_HALF_F16)
                b.levels[l].n_planes = p;
    assert_int_equal(ggn_curve_make(&b, GGN_FROM_HALVES, 1, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text,
                        "block 7 has no full level with a half-buffer difference: record one, or use --source levels");
    assert_int_equal(ggn_curve_part(&b, 0, 0, 5, 5, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "block 7 has no full level with a half-buffer difference");
    struct seq_block two[2] = {make_block(0.3, 0.0, 8, 0), b};
    assert_int_equal(ggn_curve_joined(two, 2, 1, &c, &err), BASE_EINVAL);
    assert_string_equal(err.text, "blocks 8 and 7 have no full levels of the same size and samples");
    seq_block_release(&two[0]);
    seq_block_release(&b);
}

/* Parameters at their limits, and a fit that leaves a view out. */
static void parameter_files(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        int good;
    } files[] = {
        {"{\"level\":1e-6,\"spread\":1e-3}", 1},
        {"{\"level\":1e3,\"spread\":10}", 1},
        {"{\"level\":9e-7,\"spread\":1}", 0},
        {"{\"level\":1001,\"spread\":1}", 0},
        {"{\"level\":1,\"spread\":9e-4}", 0},
        {"{\"level\":1,\"spread\":10.1}", 0},
        {"{\"level\":\"1\",\"spread\":1}", 0},
        {"[]", 0},
        {"{\"level\":1,\"spread\":1,\"each_view_left_out\":[{\"name\":\"a\",\"level\":2},{\"name\":\"b\",\"level\":5}]}",
         2}};
    char path[] = "/tmp/ggn_parameters.XXXXXX", want[160];
    struct base_err err = {0};
    struct ggn_observer o;
    assert_true(close(mkstemp(path)) == 0);
    snprintf(want, sizeof want, "%s: level or spread is missing or out of range (ggn label --calibrate writes them)", path);
    for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
        o = (struct ggn_observer){7, 7};
        FILE *f = fopen(path, "w");
        fputs(files[i].text, f);
        fclose(f);
        assert_int_equal(ggn_observer_read(path, files[i].good == 2 ? "b" : "a", &o, &err), files[i].good ? 0 : BASE_EINVAL);
        if (!files[i].good)
            assert_string_equal(err.text, want);
        assert_true(files[i].good ? o.level != 7 : o.level == 7 && o.spread == 7);
        assert_true(files[i].good != 2 || (o.level == 5 && o.spread == 1));
    }
    FILE *f = fopen(path, "w"); /* another law's numbers */
    fputs("{\"level\":1,\"exponent\":0.5,\"spread\":1}", f);
    fclose(f);
    assert_int_equal(ggn_observer_read(path, NULL, &o, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "an observer with two fitted numbers"));
    unlink(path);
}

/* The most likely spread of the grid, by the definition; lines that are no trial. */
static void trials_by_hand(void **state)
{
    (void)state;
    static const char text[] =
        "0.0;1.0;1\n0.0;2.0;1\n0.0;3.0;0\n255.0;4.0;1\n255.0;6.0;0\r\n0;2;0 \t\n256;1;1\n-1;1;1\n1;0;1\n1;1e6;1\n"
        "1;5;2\n1;5;0.5\n1;5\n1,5,1\n1;5;1;\n3;999999;0";
    static const struct {
        int block;
        double level;
        int seen;
    } good[] = {{0, 1, 1}, {0, 2, 1}, {0, 3, 0}, {255, 4, 1}, {255, 6, 0}, {0, 2, 0}, {3, 999999, 0}};
    char path[] = "/tmp/ggn_trials.XXXXXX", want[64];
    double spread = 0, likely = -INFINITY, wanted = 0;
    int blocks, n, skipped;
    struct base_err err = {0};
    FILE *f = fdopen(mkstemp(path), "w");
    fputs(text, f);
    fclose(f);
    assert_int_equal(ggn_trials_spread(path, &spread, &blocks, &n, &skipped, &err), 0);
    assert_true(blocks == 3 && n == 7 && skipped == 9);
    for (double s = 0.05; s < 3; s *= 1.05) {
        double total = 0;
        for (int k = 0; k < 3; k++) {
            const int block = (const int[]){0, 255, 3}[k];
            double best = -INFINITY;
            for (int at = 0; at <= 200; at++) {
                double sum = 0;
                for (int i = 0; i < 7; i++) {
                    double p = 0.01 + 0.49 * erfc((log2(20 * good[i].level) - (4 + 0.05 * at)) / s / sqrt(2));
                    sum += good[i].block == block ? log(good[i].seen ? p : 1 - p) : 0;
                }
                best = fmax(best, sum);
            }
            total += best;
        }
        if (total > likely) {
            likely = total;
            wanted = s;
        }
    }
    assert_near(spread, wanted, 1e-9);
    f = fopen(path, "w");
    fputs("nothing\n", f);
    fclose(f);
    assert_int_equal(ggn_trials_spread(path, &spread, &blocks, &n, &skipped, &err), BASE_EINVAL);
    snprintf(want, sizeof want, "%s: no trials in it", path);
    assert_string_equal(err.text, want);
    assert_true(blocks == 0 && n == 0 && skipped == 1);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lightness),
        cmocka_unit_test(kernel),
        cmocka_unit_test(remaining_noise),
        cmocka_unit_test(apart),
        cmocka_unit_test(people),
        cmocka_unit_test(thresholds),
        cmocka_unit_test(scaling),
        cmocka_unit_test(noisy_reference),
        cmocka_unit_test(beyond_the_last_level),
        cmocka_unit_test(needs),
        cmocka_unit_test(parts),
        cmocka_unit_test(joined),
        cmocka_unit_test(calibration),
        cmocka_unit_test(left_out),
        cmocka_unit_test(parameters),
        cmocka_unit_test(built_in),
        cmocka_unit_test(trials),
        cmocka_unit_test(laws),
        cmocka_unit_test(levels_of_curves),
        cmocka_unit_test(levels_by_hand),
        cmocka_unit_test(refusals),
        cmocka_unit_test(parameter_files),
        cmocka_unit_test(trials_by_hand),
        cmocka_unit_test(checks),
    };
    return cmocka_run_group_tests_name("observer", tests, NULL, NULL);
}
