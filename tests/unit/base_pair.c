/*
 * A denoised pair with a denoiser whose answers are known (tests/stub/oidn.c): what each stage leaves in its buffers.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "denoise/blend.h"
#include "denoise/pair.h"
#include "support/api_folders.h"
#include "support/splitmix.h"

enum { W = 40, H = 30, PIXELS = W * H };

static char stub[2048];

static void open_pair(struct lull_denoised_pair *p, const char *kind, int auxiliary)
{
    const struct lull_oidn_form form = {.width = W,
                                        .height = H,
                                        .albedo = auxiliary,
                                        .normal = auxiliary,
                                        .quality = LULL_OIDN_HIGH,
                                        .threads = 1,
                                        .exposure = 1};
    struct base_err err = {0};
    setenv("OIDN_STUB", kind, 1);
    if (lull_denoised_open(p, stub, &form, &err))
        fail_msg("%s", err.text);
}

static void halves_from_means(void **unused)
{
    (void)unused;
    struct lull_denoised_pair p;
    const double mean[3] = {2, 3, -1}, half[3] = {1, 5, -1}, bad[3] = {1, NAN, 0};
    open_pair(&p, "identity", 0);
    struct lull_denoised_part whole;
    assert_int_equal(lull_denoised_part_open(&whole, p.pixels, &p, NULL), 0);
    assert_true(whole.half[0] == p.half[0] && whole.denoised[1] == p.denoised[1] && whole.pixels == PIXELS);
    assert_true(whole.width == W && whole.height == H);
    lull_denoised_part_close(&whole);
    assert_null(p.albedo);
    assert_true(lull_denoised_put(&p, 7, mean, half, 8, 2));
    for (int c = 0; c < 3; c++) {
        assert_true(p.half[0][21 + c] == (float)half[c]);
        assert_true(p.half[1][21 + c] == (float)((8 * mean[c] - 2 * half[c]) / 6));
    }
    for (int h = 0; h <= 8; h += 8) { /* no half, or all of it */
        assert_true(lull_denoised_put(&p, 7, mean, half, 8, h));
        assert_memory_equal(p.half[0] + 21, p.half[1] + 21, 3 * sizeof(float));
        assert_true(p.half[0][22] == 3);
    }
    assert_false(lull_denoised_put(&p, 7, mean, bad, 8, 2));
    assert_true(lull_denoised_put(&p, 7, mean, bad, 8, 8));
    lull_denoised_begin(&p, 5, 3); /* a smaller rectangle */
    assert_true(p.half[0][22] == 0 && p.half[1][22] == 0 && p.pixels == 15);
    p.half[0][44] = 2;
    assert_int_equal(lull_denoised_run(&p, NULL, NULL, NULL), 0);
    assert_true(p.denoised[0][44] == 2);
    lull_denoised_close(&p);
    lull_denoised_close(&p);
}

/* Beyond what is known a picture goes on as in a mirror whose edge is the outermost pixel. */
static void mirrored(void **unused)
{
    (void)unused;
    struct lull_denoised_pair p;
    const struct lull_denoised_rect known = {10, 5, 25, 8};
    open_pair(&p, "identity", 1);
    float *const pictures[4] = {p.half[0], p.half[1], p.albedo, p.normal};
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < PIXELS; i++)
            for (int c = 0; c < 3; c++)
                pictures[k][3 * i + c] = (float)(10000 * k + 100 * (i / W) + i % W) + 0.25f * (float)c;
    lull_denoised_mirror(&p, known);
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < PIXELS; i++) {
            int x = i % W, y = i / W;
            while (x < 10 || x > 24)
                x = x < 10 ? 20 - x : 48 - x;
            while (y < 5 || y > 7)
                y = y < 5 ? 10 - y : 14 - y;
            for (int c = 0; c < 3; c++)
                assert_true(pictures[k][3 * i + c] == (float)(10000 * k + 100 * y + x) + 0.25f * (float)c);
        }
    lull_denoised_close(&p);
}

static float shown(const float *rgb) { return rgb[0]; }

static void estimate_all(struct lull_denoised_part *part, double share)
{
    static float light[4][PIXELS];
    for (size_t i = 0; i < part->pixels; i++)
        for (int k = 0; k < 2; k++) {
            light[k][i] = shown(part->half[k] + 3 * i);
            light[2 + k][i] = shown(part->denoised[k] + 3 * i);
        }
    const size_t first = part->pixels / 3; /* in two goes */
    struct lull_estimate_in in = {light[0], light[1], light[2], light[3], light[0], light[1], share};
    lull_denoised_estimate(part, 0, first, &in);
    in = (struct lull_estimate_in){
        light[0] + first, light[1] + first, light[2] + first, light[3] + first, light[0] + first, light[1] + first, share};
    lull_denoised_estimate(part, first, part->pixels - first, &in);
}

/* A part that is cut out is what it would be alone: the stages after that know nothing of what lies around. */
static void a_part_is_a_picture_of_its_own(void **unused)
{
    (void)unused;
    enum { X = 11, Y = 9, PW = 17, PH = 13, PART = PW * PH };
    const struct lull_denoised_rect rect = {X, Y, X + PW, Y + PH};
    struct lull_denoised_pair p;
    struct lull_denoised_part part;
    uint64_t state = 1;
    open_pair(&p, "box", 0);
    assert_int_equal(lull_denoised_part_open(&part, PART + 5, NULL, NULL), 0);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3 * PIXELS; i++)
            p.half[k][i] = 0.2f + 0.1f * (float)splitmix_uniform(&state);
    struct base_err err = {0};
    assert_int_equal(lull_denoised_run(&p, NULL, NULL, &err), 0);
    lull_denoised_cut(&part, &p, rect);
    assert_true(part.width == PW && part.height == PH && part.pixels == PART);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < PART; i++) {
            const int from = 3 * ((Y + i / PW) * W + X + i % PW);
            assert_memory_equal(part.half[k] + 3 * i, p.half[k] + from, 3 * sizeof(float));
            assert_memory_equal(part.denoised[k] + 3 * i, p.denoised[k] + from, 3 * sizeof(float));
            assert_true(fabsf(p.denoised[k][from] - 0.25f) < fabsf(p.half[k][from] - 0.25f) + 0.05f); /* it was denoised */
        }

    /* what blend.h says of these arrays */
    static float fa[3 * PART], fb[3 * PART], maps[5][PART], scratch[PART], weight[PART], apart[PART], light[4][PART];
    static float kept[2][3 * PART], wanted[3 * PART];
    memcpy(fa, part.denoised[0], sizeof fa);
    memcpy(fb, part.denoised[1], sizeof fb);
    for (int i = 0; i < PART; i++) {
        light[0][i] = part.half[0][3 * i], light[1][i] = part.half[1][3 * i];
        light[2][i] = fa[3 * i], light[3][i] = fb[3 * i];
    }
    const struct lull_estimate_in in = {light[0], light[1], light[2], light[3], light[0], light[1], 0.4};
    const struct lull_estimate error = {maps[0], maps[1], maps[2], maps[3], maps[4]};
    lull_estimate_pixels(&in, PART, &error);
    lull_blend_weights(&error, PW, PH, scratch, weight, apart);
    lull_blend_despeckle(apart, PART, fa, fb);
    estimate_all(&part, 0.4);
    lull_denoised_weigh(&part);
    assert_memory_equal(part.weight, weight, sizeof weight);
    assert_memory_equal(part.denoised[0], fa, sizeof fa);
    assert_memory_equal(part.denoised[1], fb, sizeof fb);
    assert_memory_equal(part.error.gain, maps[0], sizeof maps[0]);
    float *const to[2] = {kept[0], kept[1]};
    lull_denoised_blend(&part, weight, to);
    lull_blend(part.half[1], fb, weight, PART, wanted);
    assert_memory_equal(kept[1], wanted, sizeof wanted);
    lull_blend(part.half[0], fa, weight, PART, wanted);
    assert_memory_equal(kept[0], wanted, sizeof wanted);
    lull_denoised_part_close(&part);
    lull_denoised_close(&p);
}

static int at_once(void *data)
{
    (void)data;
    return 1;
}

static void what_fails_leaves_nothing_open(void **unused)
{
    (void)unused;
    struct lull_denoised_pair p;
    struct base_err err = {0};
    struct lull_denoised_part part;
    struct lull_oidn_form form = {.width = W, .height = H, .quality = LULL_OIDN_HIGH, .exposure = 1};
    assert_int_equal(lull_denoised_open(&p, "/no/such", &form, &err), BASE_EINVAL);
    assert_true(!p.oidn && !p.memory);
    err.code = 0;
    assert_int_equal(lull_denoised_part_open(&part, SIZE_MAX / 100, NULL, &err), BASE_ENOMEM);
    assert_null(part.memory);
    form.width = form.height = INT32_MAX;
    /* Its own memory is asked for first, which fails at once; the denoiser's is filled, until a machine has none left. */
    err.code = 0;
    assert_int_equal(lull_denoised_open(&p, "/no/such/library", &form, &err), BASE_ENOMEM);
    open_pair(&p, "endless", 0);
    err.code = 0;
    assert_int_equal(lull_denoised_run(&p, at_once, NULL, &err), BASE_ECANCELLED);
    lull_denoised_close(&p);
}

int main(void)
{
    if (api_folder(stub, sizeof stub, "../oidn-stub") != 0)
        return 1;
    unsetenv("LULL_OIDN");
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(halves_from_means),
        cmocka_unit_test(mirrored),
        cmocka_unit_test(a_part_is_a_picture_of_its_own),
        cmocka_unit_test(what_fails_leaves_nothing_open),
    };
    return cmocka_run_group_tests_name("pair", tests, NULL, NULL);
}
