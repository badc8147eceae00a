/* What trainer, evaluation and criterion share: noise statistic, tiles, tail statistics, policy. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "sequence/tail.h"
#include "model/policy.h"
#include "model/window.h"
#include "nn/hash.h"

/* Nested images with noise σ/√n: the statistic of any pair estimates what is left in the later one. */
static void noise_is_that_of_the_newest_image(void **state)
{
    enum { N = 60000 };
    static uint8_t first[N], last[N];
    const double sigma = 60;

    for (uint32_t i = 0; i < N; i++) {
        double a = 0, b = 0;
        for (uint32_t k = 0; k < 4; k++) {
            a += (ggn_hash_unit(4 * i + k, 1) - 0.5) * sqrt(3);
            b += (ggn_hash_unit(4 * i + k, 2) - 0.5) * sqrt(3);
        }
        double sum = 20 * 120 + sigma * sqrt(20) * a, more = sum + 30 * 120 + sigma * sqrt(30) * b;
        first[i] = (uint8_t)(sum / 20 + 0.5);
        last[i] = (uint8_t)(more / 50 + 0.5);
    }
    double noise = ggn_window_noise(first, last, N, 20, 50);
    assert_true(fabs(noise * 255 / (sigma / sqrt(50)) - 1) < 0.03);
    assert_true(ggn_window_noise(last, last, N, 20, 50) == 0);
    (void)state;
}

/* The sRGB curve written out (IEC 61966-2-1). */
static int shown(double linear)
{
    double v = linear > 0 ? linear < 1 ? linear : 1 : 0;
    return (int)floor(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055) + 0.5);
}

static void noise_pictures_are_differences_of_codes(void **state)
{
    const struct ggn_display exposed = {.transfer = GGN_TRANSFER_SRGB, .exposure = 2};
    int apart = 0;

    for (uint32_t k = 0; k < 20000; k++) {
        /* as the film stores them, so that both sides round the same number */
        double mean = (double)(float)exp2(-14 + 16 * ggn_hash_unit(k, 1));
        double d = (double)(float)(mean * 0.5 * (ggn_hash_unit(k, 2) - 0.5));
        int want = abs(shown((double)(float)(mean + d)) - shown(mean)), got = ggn_picture_code(mean, d, NULL);
        if (abs(got - want) > 0)
            apart++; /* the renderer's table and the curve may round a value between two codes differently */
        assert_true(abs(got - want) <= 1);
        assert_int_equal(ggn_picture_code(mean, d, &exposed), ggn_picture_code(2 * mean, 2 * d, NULL));
    }
    assert_true(apart < 10);
    assert_int_equal(ggn_picture_code(5, 1, NULL), 0);
    assert_int_equal(ggn_picture_code(1.1, -1.05, NULL), 255 - shown(0.05));
    assert_int_equal(ggn_picture_code(0.2, (double)NAN, NULL), 0);
    assert_int_equal(ggn_picture_code((double)NAN, 0.2, NULL), 0);
    assert_int_equal(ggn_picture_code(0.2, (double)INFINITY, NULL), 0);
    uint8_t image[6] = {0, 1, 2, 3, 4, 5};
    float tile[5 * 8], three[3 * 5 * 8];
    uint8_t thrice[18];
    for (int i = 0; i < 18; i++)
        thrice[i] = image[i % 6];
    ggn_tile_load_plane(image, 3, 2, 0, 0, 8, 5, 3, tile, 8);
    ggn_tile_load_u8(thrice, 3, 2, 0, 0, 8, 5, 3, three, 8, 40);
    assert_memory_equal(tile, three + 80, sizeof tile);
    (void)state;
}

static void tiles_cover_and_reflect(void **state)
{
    for (int size = 1; size < 700; size += 13) {
        int n = ggn_tile_count(size, 200), covered = 0;
        for (int i = 0; i < n; i++) {
            int at = ggn_tile_start(size, 200, i);
            assert_true(at <= covered);
            covered = at + 200;
        }
        assert_true(covered >= size && (n == 1 || covered == size));
    }
    uint8_t image[3 * 2 * 3];
    float tile[3 * 5 * 8];
    for (int i = 0; i < 18; i++)
        image[i] = (uint8_t)i;
    ggn_tile_load_u8(image, 3, 2, 0, 0, 8, 5, 1, tile, 8, 40);
    const float row[8] = {0, 1, 2, 2, 1, 0, 0, 1};
    const int rows[5] = {0, 3, 3, 0, 0};
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < 5; y++)
            for (int x = 0; x < 8; x++)
                assert_true(tile[40 * c + 8 * y + x] == row[x] + (float)(rows[y] + 6 * c));
    uint16_t back[18];
    for (int i = 0; i < 120; i++)
        tile[i] = i % 8 == 0 ? (float)NAN : (float)i / 119;
    ggn_tile_store_u16(back, 3, 2, 0, 0, 8, 5, tile, 8, 40);
    assert_int_equal(back[0], GGN_FIXED_NAN);
    assert_false(ggn_fixed_is_finite(back, 18));
    assert_int_equal(back[4], (int)(9.0 / 119 * 65535 + 0.5));
    for (int i = 0; i < 120; i++)
        tile[i] = 1;
    ggn_tile_store_u16(back, 3, 2, 0, 0, 8, 5, tile, 8, 40);
    assert_int_equal(back[0], GGN_FIXED_NAN - 1);
    assert_true(ggn_fixed_is_finite(back, 18));
    (void)state;
}

static int by_value(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Against the definitions in plugin-api/sequence/FORMAT.md, by sorting. */
static void tail_statistics_match_their_definition(void **state)
{
    enum { P = 40000 };
    static double a[P], sorted[P];

    for (int heavy = 0; heavy < 2; heavy++) {
        double sum = 0, weighted = 0;
        for (uint32_t i = 0; i < P; i++)
            sorted[i] = a[i] = fabs(ggn_hash_unit(i, 3) - 0.5) * (heavy && i % 500 == 0 ? 300 : 0.2);
        qsort(sorted, P, sizeof sorted[0], by_value);
        for (int i = 0; i < P; i++) {
            sum += sorted[i];
            weighted += (2.0 * (i + 1) - P - 1) * sorted[i];
        }
        struct seq_tail tail = seq_tail_of(a, P, 0.4);
        assert_true(tail.tail999 == sorted[(int)ceil(0.999 * P) - 1] / 0.4);
        assert_true(tail.gini == weighted / (P * sum));
        assert_memory_equal(a, sorted, sizeof a);
    }
    double zero[10] = {0}, one = 2;
    struct seq_tail black = seq_tail_of(zero, 10, 0), single = seq_tail_of(&one, 1, 4), none = seq_tail_of(&one, 0, 1);
    assert_true(black.gini == 0 && black.tail999 == 0 && none.tail999 == 0);
    assert_true(single.gini == 0 && single.tail999 == 0.5);
    (void)state;
}

static void policy_travels_with_the_model(void **state)
{
    struct ggn_hyper hyper = {.preset = GGN_PRESET_LULL, .height = 16, .width = 16, .window = 2, .k_r = 1, .k_m = 1, .k_d = 1};
    struct base_err err = {0};
    struct ggn_model *model = ggn_model_create(&hyper, &err);
    struct ggn_policy p = {.first_spp = 12, .ratio = 1.25, .scale = 0.7, .shift = -0.3, .threshold = 0.4, .passes = 3,
                           .gate_noise = 0.02, .slope = 5, .tail999 = 2, .gini = 0.9}, q;

    assert_non_null(model);
    assert_int_equal(ggn_policy_set(model, &p, &err), 0);
    assert_int_equal(ggn_policy_of(model, &q, &err), 0);
    assert_memory_equal(&p, &q, sizeof p);
    p.threshold = 1.5;
    assert_int_equal(ggn_policy_set(model, &p, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "threshold"));
    assert_true(ggn_policy_next(&q, 100) == 125 && ggn_policy_next(&q, 1) == 2);
    assert_true(ggn_policy_predict(&q, 0.3, 0.4, 100) == 100);
    /* one slope above the threshold is one octave away */
    double above = 1 / (1 + exp(-(log(0.4 / 0.6) + 5)));
    assert_true(fabs(ggn_policy_predict(&q, above, 0.4, 100) - 200) < 1e-6);
    ggn_model_destroy(model);
    (void)state;
}

/* Sparks hold a block; an uneven spread of noise that nobody sees does not. */
static void tail_guard(void **state)
{
    struct ggn_policy p = ggn_policy_default();

    assert_false(ggn_policy_tail_holds(&p, 1e9, 1));
    p.tail999 = 2;
    p.gini = 0.8;
    assert_true(ggn_policy_tail_holds(&p, 2.1, 0.1));
    assert_true(ggn_policy_tail_holds(&p, 0.5, 0.9));
    assert_false(ggn_policy_tail_holds(&p, 0.5, 0.7));
    assert_false(ggn_policy_tail_holds(&p, 0.1, 0.99));
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tail_guard),
        cmocka_unit_test(noise_is_that_of_the_newest_image),
        cmocka_unit_test(noise_pictures_are_differences_of_codes), cmocka_unit_test(tiles_cover_and_reflect),
        cmocka_unit_test(tail_statistics_match_their_definition),
        cmocka_unit_test(policy_travels_with_the_model),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
