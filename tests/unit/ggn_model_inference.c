/* Preprocessing and the judge. */
#include "support/ggn_cmocka.h"

#include <fenv.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model/inference.h"
#include "sight/preprocess.h"
#include "model/window.h"
#include "nn/exec.h"
#include "nn/hash.h"

static struct ggn_hyper hyper = {GGN_PRESET_LULL, 24, 33, 3, 4, 6, 3, 0, 0, 0};
enum { AREA = 24 * 33, BYTES = 3 * AREA };

static struct ggn_model *make(void)
{
    struct ggn_model *m = ggn_model_create(&hyper, NULL);

    assert_non_null(m);
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_weights_init(m->weights[net], GGN_INIT_HASH, 50 + (uint32_t)net);
        ggn_weights_pack(m->weights[net], NULL);
    }
    return m;
}

static void image(uint8_t *rgb, uint32_t seed)
{
    for (uint32_t k = 0; k < BYTES; k++)
        rgb[k] = (uint8_t)(ggn_hash(k, seed) >> 24);
}

/* The logit of the window of images `first` and the next two, with a noise map or NULL. */
static double picture_logit(struct ggn_inference *j, uint32_t first, const uint8_t *picture)
{
    static uint8_t noisy[3][BYTES];
    static uint16_t denoised[3][BYTES];
    const uint8_t *const n[3] = {noisy[0], noisy[1], noisy[2]};
    const uint16_t *const d[3] = {denoised[0], denoised[1], denoised[2]};

    for (uint32_t i = 0; i < 3; i++) {
        image(noisy[i], first + i);
        ggn_inference_denoise(j, noisy[i], denoised[i], 33, 24);
    }
    double logit = ggn_inference_logit(j, n, d, picture, NULL, 33, 24);
    assert_true(isfinite(logit));
    return logit;
}

static double window_logit(struct ggn_inference *j, uint32_t first) { return picture_logit(j, first, NULL); }

/* The answer depends on the window alone: not on the judge, nor on what it judged before. */
static void test_no_memory(void **state)
{
    struct ggn_model *m = make();
    struct ggn_inference *a = ggn_inference_create(m, NULL, NULL), *b = ggn_inference_create(m, NULL, NULL);

    assert_true(a && b);
    double before = window_logit(a, 1), used = window_logit(a, 5), fresh = window_logit(b, 5);
    assert_true(before != used);
    assert_memory_equal(&used, &fresh, sizeof used);
    ggn_inference_destroy(a);
    ggn_inference_destroy(b);
    ggn_model_destroy(m);
    (void)state;
}

/* The judge is the three networks run plainly, with denoised images in 16 bits. picture: NULL, none. */
static void compare_with_networks(const uint8_t *picture)
{
    struct ggn_model *m = make();
    struct ggn_inference *j = ggn_inference_create(m, NULL, NULL);
    struct ggn_exec *den = ggn_exec_create(&m->graph[GGN_NET_R], NULL, 1, GGN_EXEC_NO_FUSE, NULL, NULL);
    struct ggn_exec *gen = ggn_exec_create(&m->graph[GGN_NET_M], NULL, 2, GGN_EXEC_NO_FUSE, NULL, NULL);
    struct ggn_exec *dis = ggn_exec_create(&m->graph[GGN_NET_D], NULL, 1, GGN_EXEC_NO_FUSE, NULL, NULL);
    uint8_t *rgb = malloc(BYTES);
    const int denoised = m->graph[GGN_NET_R].n_values - 1, out = m->graph[GGN_NET_M].n_values - 1;

    assert_true(j && den && gen && dis && rgb);
    double got = picture_logit(j, 1, picture);
    for (int i = 0; i < 3; i++) {
        image(rgb, 1 + (uint32_t)i);
        for (int k = 0; k < BYTES; k++)
            ggn_exec_plane(den, 0, 0, k / AREA)[k % AREA / 33 * 34 + k % AREA % 33] = (float)rgb[k] / 255;
        ggn_exec_forward(den, m->weights[GGN_NET_R], 1, GGN_EVAL);
        for (int k = 0; k < BYTES; k++) {
            int c = 3 * i + k / AREA, at = k % AREA / 33 * 34 + k % AREA % 33;
            ggn_exec_plane(gen, 0, 0, c)[at] = floorf(ggn_exec_plane(den, denoised, 0, k / AREA)[at] * 65535 + 0.5f) / 65535;
            ggn_exec_plane(gen, 0, 1, c)[at] = (float)rgb[k] / 255;
        }
    }
    ggn_exec_forward(gen, m->weights[GGN_NET_M], 2, GGN_EVAL);
    for (int c = 0; c < 2; c++)
        for (int y = 0; y < 24; y++)
            memcpy(ggn_exec_plane(dis, 0, 0, c) + y * 34, ggn_exec_plane(gen, out, c, 0) + y * 34, 33 * sizeof(float));
    for (int k = 0; k < AREA && hyper.noise_map; k++) {
        ggn_exec_plane(dis, 0, 0, 2)[k / 33 * 34 + k % 33] = picture ? 16.0F * (float)picture[k] / 255 : 0;
        ggn_exec_plane(dis, 0, 0, 3)[k / 33 * 34 + k % 33] = picture ? 1 : 0;
    }
    ggn_exec_forward(dis, m->weights[GGN_NET_D], 1, GGN_EVAL);
    double want = (double)*ggn_exec_plane(dis, m->graph[GGN_NET_D].n_values - 1, 0, 0);
    if (!(fabs(got - want) < 1e-4 * fmax(1, fabs(want))))
        fail_msg("judge %.9g, networks %.9g", got, want);
    ggn_exec_destroy(den);
    ggn_exec_destroy(gen);
    ggn_exec_destroy(dis);
    ggn_inference_destroy(j);
    ggn_model_destroy(m);
    free(rgb);
}

static void test_against_networks(void **state)
{
    compare_with_networks(NULL);
    (void)state;
}

/* The noise map reaches the discriminator; none is not the same as one without noise; other models do not look at it. */
static void test_picture(void **state)
{
    static uint8_t picture[AREA], still[AREA];
    struct ggn_inference *j;
    struct ggn_model *m = make();

    for (uint32_t k = 0; k < AREA; k++)
        picture[k] = (uint8_t)(ggn_hash(k, 77) >> 30);
    assert_non_null(j = ggn_inference_create(m, NULL, NULL));
    assert_true(picture_logit(j, 1, picture) == window_logit(j, 1));
    ggn_inference_destroy(j);
    ggn_model_destroy(m);
    hyper.noise_map = 1;
    compare_with_networks(picture);
    compare_with_networks(NULL);
    m = make();
    assert_non_null(j = ggn_inference_create(m, NULL, NULL));
    double with = picture_logit(j, 1, picture), without = window_logit(j, 1), calm = picture_logit(j, 1, still);
    assert_true(with != without && with != calm && calm != without);
    assert_true(window_logit(j, 1) == without);
    ggn_inference_destroy(j);
    ggn_model_destroy(m);
    hyper.noise_map = 0;
    (void)state;
}

static void test_memory_bounds(void **state)
{
    struct ggn_hyper full = ggn_hyper_default(GGN_PRESET_LULL);
    struct ggn_model *m = ggn_model_create(&full, NULL);

    assert_non_null(m);
    assert_true(ggn_inference_bytes(m, 1) <= 64000000);
    ggn_model_destroy(m);
    (void)state;
}

static double srgb(double v) { return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055; }

static void test_srgb(void **state)
{
    const struct ggn_display brighter = {GGN_TRANSFER_SRGB, 0, 1.5}, gamma = {GGN_TRANSFER_GAMMA, 2.2, 1},
                             linear = {GGN_TRANSFER_LINEAR, 0, 2};

    for (int i = 0; i < 20000; i++) {
        float v[3] = {(float)(i / 19000.0), (float)pow(2, -20 + i / 900.0), (float)ggn_hash_unit((uint32_t)i, 1)};
        for (int c = 0; c < 3; c++) {
            double x = (double)v[c];
            assert_int_equal(ggn_preprocess(x, NULL, NULL), (int)fmin(255, floor(255 * srgb(x) + 0.5)));
            assert_int_equal(ggn_preprocess(x, &brighter, NULL), (int)fmin(255, floor(255 * srgb(1.5 * x) + 0.5)));
            assert_int_equal(ggn_preprocess(x, &gamma, NULL), (int)fmin(255, floor(255 * pow(x, 1 / 2.2) + 0.5)));
            assert_int_equal(ggn_preprocess(x, &linear, NULL), (int)fmin(255, floor(255 * 2 * x + 0.5)));
        }
    }
    (void)state;
}

/* In double the same answer, as far as floats go, with and without a noise map; and not the very same. */
static void test_exact(void **state)
{
    static uint8_t noisy[3][BYTES], picture[AREA];
    static uint16_t wide[3][BYTES], narrow[3][BYTES];
    const uint8_t *const n[3] = {noisy[0], noisy[1], noisy[2]};
    const uint16_t *const w[3] = {wide[0], wide[1], wide[2]};
    const float *learned[GGN_NETS];
    const int before = hyper.noise_map;

    hyper.noise_map = 1;
    struct ggn_model *m = make();
    for (int net = 0; net < GGN_NETS; net++)
        learned[net] = m->weights[net]->params;
    struct ggn_inference *j = ggn_inference_create(m, NULL, NULL);
    struct ggn_inference *e = ggn_inference_create_f64(&m->hyper, m->graph, learned, NULL);
    assert_true(j && e);
    int differ = 0;
    for (uint32_t i = 0; i < 3; i++) {
        image(noisy[i], 1 + i);
        ggn_inference_denoise(j, noisy[i], narrow[i], 33, 24);
        ggn_inference_denoise_f64(e, noisy[i], wide[i], 33, 24);
        for (int k = 0; k < BYTES; k++)
            assert_in_range((int)wide[i][k] - (int)narrow[i][k] + 2, 0, 4);
    }
    for (int k = 0; k < AREA; k++)
        picture[k] = (uint8_t)(k % 7);
    for (int with = 0; with < 2; with++) {
        double exact = ggn_inference_logit_f64(e, n, w, with ? picture : NULL, NULL, 33, 24),
               judged = ggn_inference_logit(j, n, w, with ? picture : NULL, NULL, 33, 24);
        if (!(fabs(exact - judged) < 1e-4 * fmax(1, fabs(judged))))
            fail_msg("picture %d: double %.12g, judge %.12g", with, exact, judged);
        differ += exact != judged;
    }
    assert_true(differ > 0);
    ggn_inference_destroy_f64(e);
    ggn_inference_destroy(j);
    ggn_model_destroy(m);
    hyper.noise_map = before;
    (void)state;
}

static void test_cleaning(void **state)
{
    const float bad[8] = {NAN, INFINITY, -INFINITY, -1, 1e30f, 1e-40f, -1e-40f, -0.0f};
    static const uint8_t want[8] = {0, 255, 0, 0, 255, 0, 0, 0};
    static const int counted[8] = {1, 2, 3, 3, 4, 4, 4, 4};
    long count = 0;

    for (int i = 0; i < 8; i++) {
        assert_int_equal(ggn_preprocess((double)bad[i], NULL, &count), want[i]);
        assert_int_equal(count, counted[i]);
    }
    assert_int_equal(ggn_preprocess(0.5, NULL, &count), 188);
    assert_int_equal(ggn_preprocess(1e300, NULL, NULL), 255);
    assert_int_equal(count, 4);
    (void)state;
}

/* --- blocks of another size ----------------------------------------------------------------------------------------------- */

enum { NET_H = 24, NET_W = 33, MOST = 3 * 60 * 90 };

static int mirrored(int i, int n)
{
    while (i < 0 || i >= n)
        i = i < 0 ? -1 - i : 2 * n - 1 - i;
    return i;
}

/* Where tile k of those that cover n pixels begins: the first at 0, the last at the end, evenly between. */
static int begin_of(int n, int tile, int k)
{
    const int count = n <= tile ? 1 : (n + tile - 1) / tile;
    return count == 1 ? 0 : (n - tile) * k / (count - 1);
}

/* The block cut into images of the network's size, each judged alone: the highest logit, and what the last tile that covers a pixel makes
 * of it. */
static double tile_by_tile(struct ggn_inference *j, uint8_t noisy[3][MOST], const uint8_t *picture, int w, int h,
                           uint16_t denoised[3][MOST])
{
    static uint8_t cut[3][BYTES], small[AREA];
    static uint16_t out[3][BYTES];
    const uint8_t *const n[3] = {cut[0], cut[1], cut[2]};
    const uint16_t *const d[3] = {out[0], out[1], out[2]};
    const int nx = w <= NET_W ? 1 : (w + NET_W - 1) / NET_W, ny = h <= NET_H ? 1 : (h + NET_H - 1) / NET_H;
    double highest = -1e30;

    for (int pass = 0; pass < 2; pass++) /* denoised first: tiles overlap */
        for (int t = 0; t < nx * ny; t++) {
            const int x0 = begin_of(w, NET_W, t % nx), y0 = begin_of(h, NET_H, t / nx);
            for (int i = 0; i < 3; i++) {
                for (int k = 0; k < BYTES; k++) {
                    const int at = k / AREA * w * h + mirrored(y0 + k % AREA / NET_W, h) * w + mirrored(x0 + k % NET_W, w);
                    cut[i][k] = noisy[i][at];
                    if (pass)
                        out[i][k] = denoised[i][at];
                    small[k % AREA] = picture[at % (w * h)];
                }
                if (!pass)
                    ggn_inference_denoise(j, cut[i], out[i], NET_W, NET_H);
                for (int k = 0; k < BYTES && !pass; k++) {
                    const int y = y0 + k % AREA / NET_W, x = x0 + k % NET_W;
                    if (y < h && x < w)
                        denoised[i][k / AREA * w * h + y * w + x] = out[i][k];
                }
            }
            highest = pass ? fmax(highest, ggn_inference_logit(j, n, d, small, NULL, NET_W, NET_H)) : highest;
        }
    return highest;
}

static void test_tiles(void **state)
{
    static const int sizes[][2] = {{33, 24}, {20, 10}, {5, 60}, {34, 25}, {90, 24}, {70, 53}};
    static uint8_t noisy[3][MOST], picture[MOST];
    static uint16_t want[3][MOST], got[3][MOST];
    const uint8_t *const n[3] = {noisy[0], noisy[1], noisy[2]};
    const uint16_t *const d[3] = {got[0], got[1], got[2]};
    const int before = hyper.noise_map;

    hyper.noise_map = 1;
    struct ggn_model *m = make();
    struct ggn_inference *j = ggn_inference_create(m, NULL, NULL);
    assert_non_null(j);
    for (uint32_t k = 0; k < MOST; k++) {
        picture[k] = (uint8_t)(ggn_hash(k, 7) >> 29);
        for (uint32_t i = 0; i < 3; i++)
            noisy[i][k] = (uint8_t)(ggn_hash(k, 20 + i) >> (24 + k % 3));
    }
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        const int w = sizes[s][0], h = sizes[s][1];
        double highest = tile_by_tile(j, noisy, picture, w, h, want);
        for (int i = 0; i < 3; i++) {
            ggn_inference_denoise(j, noisy[i], got[i], w, h);
            assert_memory_equal(got[i], want[i], (size_t)(3 * w * h) * sizeof got[i][0]);
        }
        assert_true(ggn_inference_logit(j, n, d, picture, NULL, w, h) == highest);
        got[1][3 * w * h - 1] = GGN_FIXED_NAN; /* one value that is none, of the last image's neighbour */
        assert_true(isnan(ggn_inference_logit(j, n, d, picture, NULL, w, h)));
    }
    ggn_inference_destroy(j);
    ggn_model_destroy(m);
    hyper.noise_map = before;
    (void)state;
}

/* In double too what is no number stays none. */
static void test_exact_without_numbers(void **state)
{
    static uint8_t noisy[3][BYTES];
    static uint16_t denoised[3][BYTES];
    const uint8_t *const n[3] = {noisy[0], noisy[1], noisy[2]};
    const uint16_t *const d[3] = {denoised[0], denoised[1], denoised[2]};
    const float *learned[GGN_NETS];
    struct ggn_model *m = make();

    for (int net = 0; net < GGN_NETS; net++)
        learned[net] = m->weights[net]->params;
    m->weights[GGN_NET_R]->params[m->graph[GGN_NET_R].n_params - 1] = 1e30f; /* the last bias: blue is 1 */
    m->weights[GGN_NET_R]->params[m->graph[GGN_NET_R].n_params - 2] = -1e30f;
    struct ggn_inference *e = ggn_inference_create_f64(&m->hyper, m->graph, learned, NULL);
    assert_non_null(e);
    for (int i = 0; i < 3; i++)
        ggn_inference_denoise_f64(e, noisy[i], denoised[i], 33, 24);
    assert_int_equal(denoised[0][2 * AREA + 5], 65534);
    assert_int_equal(denoised[0][AREA + 5], 0);
    assert_true(isfinite(ggn_inference_logit_f64(e, n, d, NULL, NULL, 33, 24)));
    denoised[2][7] = GGN_FIXED_NAN;
    assert_true(isnan(ggn_inference_logit_f64(e, n, d, NULL, NULL, 33, 24)));
    ggn_inference_destroy_f64(e);
    m->weights[GGN_NET_R]->params[m->graph[GGN_NET_R].n_params - 1] = NAN;
    e = ggn_inference_create_f64(&m->hyper, m->graph, learned, NULL);
    assert_non_null(e);
    ggn_inference_denoise_f64(e, noisy[0], denoised[0], 33, 24);
    assert_int_equal(denoised[0][2 * AREA + 5], GGN_FIXED_NAN);
    ggn_inference_destroy_f64(e);
    ggn_model_destroy(m);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_no_memory),
                                       cmocka_unit_test(test_against_networks),
                                       cmocka_unit_test(test_picture),
                                       cmocka_unit_test(test_memory_bounds),
                                       cmocka_unit_test(test_exact),
                                       cmocka_unit_test(test_srgb),
                                       cmocka_unit_test(test_cleaning),
                                       cmocka_unit_test(test_tiles),
                                       cmocka_unit_test(test_exact_without_numbers)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
