/* FLIP: the published implementation's figures on a real sequence, and what must hold for any images. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"

#include "picture/read.h"
#include "sight/flip.h"

static const char sequence[] = "../shared/sequences/cornell-box/p3d_cornel-box-view0_%05d.png";

static struct pic_image read_level(int spp)
{
    char path[128];
    struct pic_image image;
    struct base_err err = {0};
    snprintf(path, sizeof path, sequence, spp);
    if (pic_read_display(path, &image, &err) != 0)
        fail_msg("%s", err.text);
    return image;
}

static void published_figures(void **state)
{
    (void)state;
    static const struct {
        int spp;
        double mean;
    } golden[] = {{500, 0.043397}, {1000, 0.033533}, {2000, 0.025407}, {5000, 0.016180}, {9500, 0.007630}};
    char path[128];
    snprintf(path, sizeof path, sequence, 10000);
    FILE *f = fopen(path, "rb");
    if (!f) {
        print_message("# SKIP ../shared is absent\n");
        skip();
    }
    fclose(f);
    struct pic_image reference = read_level(10000);
    for (size_t i = 0; i < sizeof golden / sizeof golden[0]; i++) {
        struct pic_image test = read_level(golden[i].spp);
        struct ggn_flip_stats s;
        assert_int_equal(ggn_flip(reference.u8, test.u8, 800, 800, GGN_FLIP_PPD, NULL, &s, NULL), 0);
        assert_near(s.mean, golden[i].mean, 1e-6);
        if (golden[i].spp == 500)
            assert_near(s.max, 0.570340, 1e-6);
        pic_release(&test);
    }
    pic_release(&reference);
}

/* A smooth picture and the same with noise, from a fixed hash. */
static void make_pair(uint8_t *a, uint8_t *b, int w, int h, int amplitude)
{
    uint32_t k = 1;
    for (int i = 0; i < w * h * 3; i++) {
        k = k * 1664525u + 1013904223u;
        int v = 128 + (int)lround(90.0 * sin(0.05 * (i / 3 % w) + 0.3 * (i % 3)) * cos(0.07 * (i / 3 / w)));
        int n = v + (int)(k >> 16) % (2 * amplitude + 1) - amplitude;
        a[i] = (uint8_t)v;
        b[i] = (uint8_t)(n < 0 ? 0 : n > 255 ? 255 : n);
    }
}

/* The same code reproduces the published figures above; these keep it so where ../shared is absent. */
static void frozen_figures(void **state)
{
    (void)state;
    enum { W = 64, H = 48 };
    static uint8_t a[W * H * 3], b[W * H * 3];
    struct ggn_flip_stats s;
    make_pair(a, b, W, H, 24);
    assert_int_equal(ggn_flip(a, b, W, H, GGN_FLIP_PPD, NULL, &s, NULL), 0);
    assert_near(s.mean, 0.121811, 1e-6);
    assert_near(s.max, 0.377908, 1e-6);
}

static void properties(void **state)
{
    (void)state;
    enum { W = 40, H = 30 };
    static uint8_t a[W * H * 3], b[W * H * 3];
    static float map[W * H];
    struct ggn_flip_stats same, one, other, small;
    make_pair(a, b, W, H, 40);
    ggn_flip(a, a, W, H, GGN_FLIP_PPD, map, &same, NULL);
    assert_true(same.mean == 0.0 && same.max == 0.0);
    ggn_flip(a, b, W, H, GGN_FLIP_PPD, map, &one, NULL);
    ggn_flip(b, a, W, H, GGN_FLIP_PPD, NULL, &other, NULL);
    assert_near(one.mean, other.mean, 1e-9);
    double sum = 0.0;
    for (int i = 0; i < W * H; i++)
        sum += (double)map[i];
    assert_near(sum / (W * H), one.mean, 1e-7);
    make_pair(a, b, W, H, 10);
    ggn_flip(a, b, W, H, GGN_FLIP_PPD, NULL, &small, NULL);
    assert_true(small.mean < one.mean && small.mean > 0.0);
    /* Black against white is the largest difference there is among greys, on any size down to one pixel. */
    for (int side = 1; side <= 30; side += 29) {
        memset(a, 0, sizeof a);
        memset(b, 255, sizeof b);
        assert_int_equal(ggn_flip(a, b, side, side, GGN_FLIP_PPD, NULL, &one, NULL), 0);
        assert_true(one.mean > 0.9 && one.max <= 1.0);
    }
}

static void bad_arguments(void **state)
{
    (void)state;
    uint8_t p[3] = {0};
    struct ggn_flip_stats s;
    struct base_err err = {0};
    assert_int_equal(ggn_flip(p, p, 0, 1, GGN_FLIP_PPD, NULL, &s, &err), BASE_EINVAL);
    assert_int_equal(ggn_flip(p, p, 1, 1, (double)NAN, NULL, &s, &err), BASE_EINVAL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(published_figures),
        cmocka_unit_test(frozen_figures),
        cmocka_unit_test(properties),
        cmocka_unit_test(bad_arguments),
    };
    return cmocka_run_group_tests_name("flip", tests, NULL, NULL);
}
