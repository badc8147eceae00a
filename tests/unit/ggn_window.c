/* What trainer, evaluation and criterion share: tiles, tail statistics, policy. */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <setjmp.h>
#include <cmocka.h>
#include <cjson/cJSON.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sequence/tail.h"
#include "model/policy.h"
#include "model/model.h"
#include "base/colour.h"
#include "model/window.h"
#include "nn/hash.h"

static const struct ggn_value small = {.h = 5, .w = 8, .row = 8, .plane = 40};

static void one_plane_is_cut_as_three(void **state)
{
    uint8_t image[6] = {0, 1, 2, 3, 4, 5};
    float tile[5 * 8], three[3 * 5 * 8];
    uint8_t thrice[18];
    for (int i = 0; i < 18; i++)
        thrice[i] = image[i % 6];
    ggn_tile_load_u8(image, 1, 3, 2, 0, 0, 3, tile, &small);
    ggn_tile_load_u8(thrice, 3, 3, 2, 0, 0, 3, three, &small);
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
    ggn_tile_load_u8(image, 3, 3, 2, 0, 0, 1, tile, &small);
    const float row[8] = {0, 1, 2, 2, 1, 0, 0, 1};
    const int rows[5] = {0, 3, 3, 0, 0};
    for (int c = 0; c < 3; c++)
        for (int y = 0; y < 5; y++)
            for (int x = 0; x < 8; x++)
                assert_true(tile[40 * c + 8 * y + x] == row[x] + (float)(rows[y] + 6 * c));
    uint16_t back[18];
    for (int i = 0; i < 120; i++)
        tile[i] = i % 8 == 0 ? (float)NAN : (float)i / 119;
    ggn_tile_store_u16(back, 3, 2, 0, 0, tile, &small);
    assert_int_equal(back[0], GGN_FIXED_NAN);
    assert_false(ggn_fixed_is_finite(back, 18));
    assert_int_equal(back[4], (int)(9.0 / 119 * 65535 + 0.5));
    for (int i = 0; i < 120; i++)
        tile[i] = 1;
    ggn_tile_store_u16(back, 3, 2, 0, 0, tile, &small);
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
        double sum = 0, weighted = 0, squares = 0, top = 0;
        for (uint32_t i = 0; i < P; i++)
            sorted[i] = a[i] = fabs(ggn_hash_unit(i, 3) - 0.5) * (heavy && i % 500 == 0 ? 300 : 0.2);
        qsort(sorted, P, sizeof sorted[0], by_value);
        for (int i = 0; i < P; i++) {
            sum += sorted[i];
            weighted += (2.0 * (i + 1) - P - 1) * sorted[i];
            squares += sorted[i] * sorted[i];
            top += i >= P - P / 100 ? sorted[i] * sorted[i] : 0;
        }
        struct seq_tail tail = seq_tail_of(a, P, 0.4);
        assert_true(tail.tail999 == sorted[(int)ceil(0.999 * P) - 1] / 0.4);
        assert_true(tail.gini == weighted / (P * sum));
        assert_true(tail.top_share == top / squares && (tail.top_share > 0.9) == heavy);
        assert_memory_equal(a, sorted, sizeof a);
    }
    double zero[10] = {0}, one = 2;
    struct seq_tail black = seq_tail_of(zero, 10, 0), single = seq_tail_of(&one, 1, 4), none = seq_tail_of(&one, 0, 1);
    assert_true(black.gini == 0 && black.tail999 == 0 && black.top_share == 0 && none.tail999 == 0);
    assert_true(single.gini == 0 && single.tail999 == 0.5 && single.top_share == 1);
    (void)state;
}

static void policy_travels_with_the_model(void **state)
{
    struct ggn_hyper hyper = {
        .preset = GGN_PRESET_LULL, .height = 16, .width = 16, .window = 2, .k_r = 1, .k_m = 1, .k_d = 1};
    struct base_err err = {0};
    struct ggn_model *model = ggn_model_create(&hyper, &err);
    struct ggn_policy
        p = {.first_spp = 12, .ratio = 1.25, .scale = 0.7, .shift = -0.3, .threshold = 0.4, .passes = 3, .slope = 5},
        q;

    assert_non_null(model);
    assert_int_equal(ggn_policy_set(model, &p, &err), 0);
    assert_int_equal(ggn_policy_of(model, &q, &err), 0);
    assert_true(q.first_spp == p.first_spp && q.ratio == p.ratio && q.step_spp == p.step_spp && q.scale == p.scale &&
                q.shift == p.shift);
    assert_true(q.threshold == p.threshold && q.passes == p.passes && q.slope == p.slope);
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

/* A network sees what the renderer's pictures and recordings hold, wherever the mean lies: at each limit, one step of a double
 * and of a float beside it. */
static void codes_are_those_of_the_pictures(void **state)
{
    const struct ggn_display same = {.transfer = GGN_TRANSFER_SRGB, .exposure = 1};

    for (int code = 1; code < 256; code++) {
        const double limit = base_srgb_limit[code];
        const float near = (float)limit;
        const double values[6] = {limit,        nextafter(limit, 0),         nextafter(limit, 1),
                                  (double)near, (double)nextafterf(near, 0), (double)nextafterf(near, 1)};
        assert_int_equal(ggn_preprocess(values[1], NULL, NULL), code - 1);
        for (int i = 0; i < 6; i++) {
            assert_int_equal(ggn_preprocess(values[i], NULL, NULL), base_srgb_code(values[i]));
            assert_int_equal(ggn_preprocess(values[i], &same, NULL), base_srgb_code(values[i]));
        }
    }
    (void)state;
}

/* A tile that begins inside of the image, and one that reaches beyond it; what is stored lies inside. */
static void tiles_begin_anywhere(void **state)
{
    enum { W = 7, H = 5, TW = 4, TH = 3, ROW = 6, PLANE = 20 };
    const struct ggn_value tile = {.h = TH, .w = TW, .row = ROW, .plane = PLANE},
                           line = {.h = 1, .w = 9, .row = 9, .plane = 9};
    uint8_t bytes[3 * W * H];
    uint16_t wide[3 * W * H], back[3 * W * H];

    for (int i = 0; i < 3 * W * H; i++) {
        bytes[i] = (uint8_t)(2 * i);
        wide[i] = (uint16_t)(600 * i);
    }
    for (int x0 = 0; x0 < W; x0++)
        for (int y0 = 0; y0 < H; y0++) {
            float a[3 * PLANE], b[3 * PLANE];
            for (int i = 0; i < 3 * PLANE; i++)
                a[i] = b[i] = -1;
            ggn_tile_load_u8(bytes, 3, W, H, x0, y0, 0.5f, a, &tile);
            ggn_tile_load_u16(wide, 3, W, H, x0, y0, 1.0f / 65535, b, &tile);
            for (int i = 0; i < 3 * PLANE; i++) {
                const int c = i / PLANE, y = i % PLANE / ROW, x = i % PLANE % ROW, u = x0 + x, v = y0 + y;
                const int at = (c * H + (v < H ? v : 2 * H - 1 - v)) * W + (u < W ? u : 2 * W - 1 - u);
                assert_true(a[i] == (x < TW && y < TH ? (float)at : -1));
                assert_true(b[i] == (x < TW && y < TH ? (float)(600 * at) * (1.0f / 65535) : -1));
            }
            memset(back, 0, sizeof back);
            ggn_tile_store_u16(back, W, H, x0, y0, b, &tile);
            for (int i = 0; i < 3 * W * H; i++) {
                const int x = i % W - x0, y = i / W % H - y0;
                assert_int_equal(back[i], x >= 0 && x < TW && y >= 0 && y < TH ? wide[i] : 0);
            }
        }
    static const int starts[][4] = {{10, 10, 1, 0},  {9, 10, 1, 0},   {11, 10, 2, 1},
                                    {20, 10, 2, 10}, {21, 10, 3, 11}, {29, 10, 3, 19}};
    for (size_t i = 0; i < sizeof starts / sizeof starts[0]; i++) {
        assert_int_equal(ggn_tile_count(starts[i][0], starts[i][1]), starts[i][2]);
        assert_int_equal(ggn_tile_start(starts[i][0], starts[i][1], starts[i][2] - 1), starts[i][3]);
    }
    assert_int_equal(ggn_tile_start(29, 10, 1), 9);
    /* codes: half up; all of 1 and beyond is 65534, less than 0 is 0 */
    const float v[] = {0.49999f / 65535, 0.50001f / 65535, 1.6f / 65535, -3, 1, 65533.9f / 65535, (float)NAN, 2e30f,
                       -(float)INFINITY};
    static const uint16_t codes[] = {0, 1, 2, 0, 65534, 65534, 65535, 65534, 0};
    float planes[27] = {0};
    memcpy(planes, v, sizeof v);
    ggn_tile_store_u16(back, 9, 1, 0, 0, planes, &line);
    assert_memory_equal(back, codes, sizeof codes);
    (void)state;
}

/* --- policy -------------------------------------------------------------------------------------------------------------- */

static const struct {
    const char *name;
    size_t at;
    double min, max;
} limits[] = {{"first_spp", offsetof(struct ggn_policy, first_spp), 1, 1e9},
              {"ratio", offsetof(struct ggn_policy, ratio), 0, 100},
              {"step_spp", offsetof(struct ggn_policy, step_spp), 0, 1e9},
              {"scale", offsetof(struct ggn_policy, scale), 1e-6, 1e6},
              {"shift", offsetof(struct ggn_policy, shift), -1e6, 1e6},
              {"threshold", offsetof(struct ggn_policy, threshold), 0, 1},
              {"slope", offsetof(struct ggn_policy, slope), 0, 1e6}};

static void same_policy(const struct ggn_policy *a, const struct ggn_policy *b)
{
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++)
        assert_memory_equal((const char *)a + limits[i].at, (const char *)b + limits[i].at, sizeof(double));
    assert_int_equal(a->passes, b->passes);
}

static void policies_have_limits(void **state)
{
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++)
        for (int k = 0; k < 5; k++) {
            const double span = limits[i].max - limits[i].min;
            const double values[] = {limits[i].min, limits[i].max, limits[i].min - 1e-3 * span, limits[i].max + 1e-3 * span,
                                     (double)NAN};
            struct ggn_policy p = ggn_policy_default();
            struct base_err err = {0};
            char want[128];
            p.step_spp = 1;
            memcpy((char *)&p + limits[i].at, &values[k], sizeof values[k]);
            snprintf(want, sizeof want, "policy: %s = %g is not in %g..%g", limits[i].name, values[k], limits[i].min,
                     limits[i].max);
            assert_int_equal(ggn_policy_check(&p, &err), k < 2 ? 0 : BASE_EINVAL);
            if (k >= 2)
                assert_string_equal(err.text, want);
        }
    for (int passes = 0; passes <= 17; passes++) {
        struct ggn_policy p = ggn_policy_default();
        struct base_err err = {0};
        p.passes = passes;
        assert_int_equal(ggn_policy_check(&p, &err), passes >= 1 && passes <= 16 ? 0 : BASE_EINVAL);
        if (passes == 17)
            assert_string_equal(err.text, "policy: passes = 17 is not in 1..16");
    }
    struct ggn_policy p = ggn_policy_default();
    struct base_err err = {0};
    assert_true(p.first_spp == 20 && p.ratio == 1.15 && p.step_spp == 0 && p.scale == 1 && p.shift == 0 &&
                p.threshold == 0.5);
    assert_true(p.passes == 1 && p.slope == 0);
    p.ratio = 1.001;
    p.step_spp = 1;
    assert_int_equal(ggn_policy_check(&p, &err), 0);
    p.step_spp = 0.99;
    assert_int_equal(ggn_policy_check(&p, &err), BASE_EINVAL);
    assert_string_equal(err.text, "policy: neither a ratio above 1 nor a step says how levels are spaced");
    p.ratio = 1.0011;
    assert_int_equal(ggn_policy_check(&p, &err), 0);
    (void)state;
}

/* What users may set, and what follows from it. */
static void policies_are_adjusted(void **state)
{
    struct ggn_policy
        p = {.first_spp = 12, .ratio = 1.25, .scale = 2, .shift = -1, .threshold = 0.25, .passes = 3, .slope = 2},
        was = p;

    assert_true(ggn_policy_adjust(&p, "visible", 0.1) && p.threshold == 0.1);
    assert_true(ggn_policy_adjust(&p, "first-spp", 99) && p.first_spp == 99);
    assert_true(ggn_policy_adjust(&p, "passes", 5) && p.passes == 5);
    struct ggn_policy kept = p;
    assert_false(ggn_policy_adjust(&p, "model", 1) || ggn_policy_adjust(&p, "", 1) || ggn_policy_adjust(&p, "gate", 1));
    same_policy(&kept, &p);
    p = was;
    assert_true(fabs(ggn_policy_p(&p, 0.5) - 0.5) < 1e-15 && fabs(ggn_policy_p(&p, 1) - 1 / (1 + exp(-1))) < 1e-15);
    assert_true(ggn_policy_p(&p, (double)INFINITY) == 1 && ggn_policy_p(&p, -(double)INFINITY) == 1 &&
                ggn_policy_p(&p, (double)NAN) == 1);
    assert_true(ggn_policy_next(&p, 10) == 13 && ggn_policy_next(&p, 9) == 11 && ggn_policy_next(&p, 2) == 3);
    p.ratio = 1.001;
    p.step_spp = 7;
    assert_true(ggn_policy_next(&p, 10) == 17);
    p.step_spp = 0.5;
    assert_true(ggn_policy_next(&p, 10) == 11);
    /* octaves of logit over slope, p and threshold at most six nines apart, twenty octaves at most */
    assert_true(fabs(ggn_policy_predict(&p, 0.75, 0.25, 8) - 8 * exp2(2 * log(3) / 2)) < 1e-9);
    assert_true(ggn_policy_predict(&p, 0.2, 0.25, 8) == 8 && isnan(ggn_policy_predict(&p, (double)NAN, 0.25, 8)));
    assert_true(fabs(ggn_policy_predict(&p, 1, 0.5, 8) / (8 * exp2(log(999999) / 2)) - 1) < 1e-9);
    assert_true(fabs(ggn_policy_predict(&p, 0.5, 0, 8) / (8 * exp2(log(999999) / 2)) - 1) < 1e-9);
    assert_true(ggn_policy_predict(&p, 0, 1, 8) == 8 && ggn_policy_predict(&p, 0, 0, 8) == 8);
    p.slope = 1e-3;
    assert_true(ggn_policy_predict(&p, 0.9, 0.1, 8) == 8 * exp2(20));
    p.slope = 0;
    assert_true(isnan(ggn_policy_predict(&p, 0.9, 0.1, 8)));
    (void)state;
}

/* Evenly spaced levels that were thinned to a ratio are both in turn: the list says the first, the ratio goes on. */
static void policies_list_their_levels(void **state)
{
    static const double thinned[] = {16, 32, 48, 64, 80, 96, 112, 128, 144, 160, 176, 208, 240},
                        geometric[] = {4, 5, 6, 8, 10, 13, 16, 20, 25, 32, 40, 42}, even[] = {16, 32, 48, 64, 80, 96};
    struct ggn_policy p = ggn_policy_default(), q;
    struct base_err err = {0};
    cJSON *root = cJSON_CreateObject();
    int failed = 0;

    p.ratio = 8.0 / 7;
    ggn_policy_set_levels(&p, thinned, 13);
    assert_true(p.n_levels >= 8 && p.n_levels <= 13);
    double spp = 0;
    for (int i = 0; i < 10; i++) {
        assert_true(ggn_policy_next(&p, spp) == thinned[i]);
        spp = ggn_policy_next(&p, spp);
    }
    assert_true(ggn_policy_next(&p, 17) == 32 && ggn_policy_next(&p, 700) == 800);
    ggn_policy_print(root, &p, &failed);
    assert_int_equal(ggn_policy_parse(root, &q, &err), 0);
    same_policy(&p, &q);
    assert_true(q.n_levels == p.n_levels && !memcmp(q.level, p.level, (size_t)p.n_levels * sizeof p.level[0]));
    cJSON_ReplaceItemInObject(root, "levels", cJSON_Parse("[16, 32, 32.5]"));
    assert_int_equal(ggn_policy_parse(root, &q, &err), BASE_EINVAL);
    assert_string_equal(err.text, "policy: level 2, 32.5 samples, does not follow");
    cJSON_ReplaceItemInObject(root, "levels", cJSON_Parse("16"));
    assert_int_equal(ggn_policy_parse(root, &q, &err), BASE_EINVAL);
    cJSON_Delete(root);
    /* what ratio or step tell by themselves needs no list */
    p.ratio = 1.26;
    ggn_policy_set_levels(&p, geometric, 12); /* the last one is the end of the recording */
    assert_int_equal(p.n_levels, 0);
    p.ratio = 0;
    p.step_spp = 16;
    ggn_policy_set_levels(&p, even, 6);
    assert_int_equal(p.n_levels, 0);
    (void)state;
}

static void settings_are_compared(void **state)
{
    static const double even[] = {16, 32, 48, 64, 80, 96}, geometric[] = {16, 18, 20, 23, 26, 30};
    const struct ggn_setting learned = {200, 200, GGN_TRANSFER_SRGB};
    struct ggn_setting here = learned;
    struct ggn_policy p = ggn_policy_default();
    char text[200];
    double asked = 0, nearest = 0;

    assert_true(ggn_setting_difference(&learned, &here, text, sizeof text) == 0 && text[0] == '\0');
    here = (struct ggn_setting){64, 32, GGN_TRANSFER_LINEAR};
    assert_true(ggn_setting_difference(&learned, &here, text, sizeof text) == strlen(text));
    assert_string_equal(text, "blocks of 64x32 pixels instead of 200x200, linear codes instead of sRGB");
    assert_true(ggn_setting_difference(&learned, &here, text, 20) == 19 && strlen(text) == 19);
    assert_true(ggn_setting_difference(&here, &learned, text, sizeof text) > 0); /* more than it needs is no difference */
    assert_string_equal(text, "blocks of 200x200 pixels instead of 64x32, sRGB instead of linear codes");
    p.first_spp = 16;
    p.ratio = 1.14;
    assert_true(ggn_policy_levels_differ(&p, even, 6, &asked, &nearest) && asked == 18 && nearest == 32);
    assert_false(ggn_policy_levels_differ(&p, geometric, 6, &asked, &nearest));
    memcpy(p.level, even, sizeof even);
    p.n_levels = 6;
    assert_false(ggn_policy_levels_differ(&p, even, 6, &asked, &nearest));
    assert_true(ggn_policy_levels_differ(&p, geometric, 6, &asked, &nearest) == 0); /* its last level is before the next */
    (void)state;
}

/* As JSON, whole; what is missing keeps its default, but for passes. */
static void policies_are_written_down(void **state)
{
    const struct ggn_policy p = {
        .first_spp = 12, .ratio = 1.25, .step_spp = 3, .scale = 2, .shift = -1, .threshold = 0.25, .passes = 3, .slope = 4};
    struct ggn_policy q = {.scale = 77};
    struct base_err err = {0};
    cJSON *root = cJSON_CreateObject();
    int failed = 0;

    ggn_policy_print(root, &p, &failed);
    char *text = cJSON_PrintUnformatted(root);
    assert_string_equal(
        text, "{\"first_spp\":12,\"ratio\":1.25,\"step_spp\":3,\"scale\":2,\"shift\":-1,\"threshold\":0.25,\"slope\":4,"
              "\"passes\":3}");
    assert_false(failed);
    assert_int_equal(ggn_policy_parse(root, &q, &err), 0);
    same_policy(&p, &q);
    cJSON_ReplaceItemInObject(root, "slope", cJSON_CreateString("4"));
    assert_int_equal(ggn_policy_parse(root, &q, &err), BASE_EINVAL);
    assert_string_equal(err.text, "policy: slope is not a number");
    cJSON_DeleteItemFromObject(root, "slope");
    cJSON_DeleteItemFromObject(root, "ratio");
    assert_int_equal(ggn_policy_parse(root, &q, &err), 0);
    assert_true(q.slope == 0 && q.ratio == 1.15);
    cJSON_AddNumberToObject(root, "gate_noise", 0.5); /* of files from before: without a gate and guards since */
    cJSON_AddNumberToObject(root, "gini", 77);
    assert_int_equal(ggn_policy_parse(root, &q, &err), 0);
    cJSON_DeleteItemFromObject(root, "passes");
    assert_int_equal(ggn_policy_parse(root, &q, &err), BASE_EINVAL);
    assert_string_equal(err.text, "policy: passes = 0 is not in 1..16");
    free(text);
    cJSON_Delete(root);
    (void)state;
}

/* In a model: its calibration, and the rest beside it; without the rest the model's own numbers and the defaults. */
static void policies_of_models(void **state)
{
    struct ggn_hyper hyper = {GGN_PRESET_LULL, 16, 16, 2, 1, 1, 1, 0, 0, 0};
    struct ggn_policy
        p = {.first_spp = 12, .step_spp = 3, .scale = 2, .shift = -1, .threshold = 0.25, .passes = 3, .slope = 4},
        q;
    struct ggn_model *m = ggn_model_create(&hyper, NULL);

    assert_non_null(m);
    assert_true(m->policy.scale == 1 && m->policy.shift == 0 && m->policy.threshold == 0.5);
    assert_true(m->policy.passes == 2 && m->policy.ratio == 1.2);
    assert_int_equal(ggn_policy_of(m, &q, NULL), 0);
    assert_true(q.first_spp == 20 && q.ratio == 1.2 && q.threshold == 0.5 && q.passes == 2 && q.scale == 1);
    for (int twice = 0; twice < 2; twice++) {
        assert_int_equal(ggn_policy_set(m, &p, NULL), 0);
        assert_int_equal(cJSON_GetArraySize(m->provenance), 1);
    }
    assert_true(m->policy.scale == 2 && m->policy.shift == -1 && m->policy.threshold == 0.25);
    assert_true(m->policy.passes == 3 && m->policy.ratio == 1);
    char *text = cJSON_PrintUnformatted(m->provenance);
    assert_string_equal(text, "{\"policy\":{\"first_spp\":12,\"ratio\":0,\"step_spp\":3,\"slope\":4}}");
    free(text);
    assert_int_equal(ggn_policy_of(m, &q, NULL), 0);
    same_policy(&p, &q);
    p.ratio = 1.5;
    assert_int_equal(ggn_policy_set(m, &p, NULL), 0);
    assert_true(m->policy.ratio == 1.5);
    m->policy.threshold = 2;
    assert_int_equal(ggn_policy_of(m, &q, NULL), BASE_EINVAL);
    ggn_model_destroy(m);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_plane_is_cut_as_three),
        cmocka_unit_test(tiles_cover_and_reflect),
        cmocka_unit_test(tail_statistics_match_their_definition),
        cmocka_unit_test(policy_travels_with_the_model),
        cmocka_unit_test(codes_are_those_of_the_pictures),
        cmocka_unit_test(tiles_begin_anywhere),
        cmocka_unit_test(policies_have_limits),
        cmocka_unit_test(policies_are_adjusted),
        cmocka_unit_test(policies_list_their_levels),
        cmocka_unit_test(settings_are_compared),
        cmocka_unit_test(policies_are_written_down),
        cmocka_unit_test(policies_of_models),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
