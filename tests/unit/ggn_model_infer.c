/* Preprocessing, histories and decisions. */
#include "support/ggn_cmocka.h"

#include <fenv.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "model/infer.h"
#include "model/preprocess.h"
#include "nn/exec.h"

static const struct ggn_hyper hyper = {GGN_PRESET_LULL, 24, 33, 3, 4, 6, 3};
enum { AREA = 24 * 33, BYTES = 3 * AREA };

static struct ggn_model *make(void)
{
    struct ggn_model *m = ggn_model_create(&hyper, NULL);

    assert_non_null(m);
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_weights_init_f32(m->weights[net], GGN_INIT_HASH, 50 + (uint32_t)net);
        ggn_weights_pack_f32(m->weights[net]);
    }
    return m;
}

static void image(uint8_t *rgb, uint32_t seed)
{
    for (uint32_t k = 0; k < BYTES; k++)
        rgb[k] = (uint8_t)(ggn_hash(k, seed) >> 24);
}

static double decide(struct ggn_infer *f, void *history, uint32_t first, int images)
{
    static uint8_t rgb[BYTES];
    double p = NAN, logit = NAN;

    for (int i = 0; i < images; i++) {
        image(rgb, first + (uint32_t)i);
        ggn_infer_push(f, history, rgb, 10 * (first + (uint32_t)i));
    }
    assert_int_equal(ggn_infer_decide(f, history, &p, &logit), GGN_OK);
    assert_true(p > 0 && p < 1 && isfinite(logit));
    return logit;
}

/* A window that slid into place and the same window in a fresh history; asking twice; two workers. */
static void test_history(void **state)
{
    struct ggn_model *m = make();
    struct ggn_infer *f = ggn_infer_create(m, GGN_PRECISION_F32, NULL, NULL),
                     *g = ggn_infer_create(m, GGN_PRECISION_F32, NULL, NULL);
    void *a = calloc(1, ggn_history_bytes(&hyper)), *b = calloc(1, ggn_history_bytes(&hyper));
    double p, logit;

    assert_true(f && g && a && b);
    ggn_history_clear(a);
    ggn_history_clear(b);
    assert_int_equal(ggn_infer_decide(f, a, &p, &logit), GGN_EINVAL);
    double slid = decide(f, a, 1, 7);
    assert_int_equal(ggn_history_count(a), 3);
    assert_int_equal(ggn_history_spp(a, &hyper, 0), 50);
    assert_int_equal(ggn_history_spp(a, &hyper, 2), 70);
    double fresh = decide(g, b, 5, 3);
    assert_memory_equal(&slid, &fresh, sizeof slid);
    double again = decide(f, a, 7, 1); /* same spp: nothing added */
    assert_memory_equal(&slid, &again, sizeof slid);
    assert_true(decide(f, a, 8, 1) != slid);
    assert_true(ggn_history_valid(a, ggn_history_bytes(&hyper), &hyper));
    assert_false(ggn_history_valid(a, ggn_history_bytes(&hyper) - 1, &hyper));
    ((uint32_t *)a)[1] = 77;
    assert_false(ggn_history_valid(a, ggn_history_bytes(&hyper), &hyper));
    ggn_infer_destroy(f);
    ggn_infer_destroy(g);
    free(a);
    free(b);
    ggn_model_destroy(m);
    (void)state;
}

/* The decision is the three networks run plainly, but for the 16-bit storage of denoised images. */
static void test_against_networks(void **state)
{
    struct ggn_model *m = make();
    struct ggn_infer *f = ggn_infer_create(m, GGN_PRECISION_F32, NULL, NULL);
    void *history = calloc(1, ggn_history_bytes(&hyper));
    struct ggn_exec_f32 *gen = ggn_exec_create_f32(&m->graph[GGN_NET_M], NULL, 2, GGN_EXEC_NO_FUSE, NULL, NULL);
    struct ggn_exec_f32 *dis = ggn_exec_create_f32(&m->graph[GGN_NET_D], NULL, 1, GGN_EXEC_NO_FUSE, NULL, NULL);
    float *denoised = malloc(BYTES * sizeof *denoised);
    uint8_t *rgb = malloc(BYTES);
    const int out = m->graph[GGN_NET_M].n_values - 1;

    assert_true(f && history && gen && dis && denoised && rgb);
    double got = decide(f, history, 1, 3);
    for (int i = 0; i < 3; i++) {
        image(rgb, 1 + (uint32_t)i);
        ggn_infer_denoise(f, rgb, denoised);
        for (int k = 0; k < BYTES; k++) {
            int c = 3 * i + k / AREA, at = k % AREA / 33 * 34 + k % AREA % 33;
            ggn_exec_plane_f32(gen, 0, 0, c)[at] = denoised[k];
            ggn_exec_plane_f32(gen, 0, 1, c)[at] = (float)rgb[k] / 255;
        }
    }
    ggn_exec_forward_f32(gen, m->weights[GGN_NET_M], 2, GGN_EVAL);
    for (int c = 0; c < 2; c++)
        for (int y = 0; y < 24; y++)
            memcpy(ggn_exec_plane_f32(dis, 0, 0, c) + y * 34, ggn_exec_plane_f32(gen, out, c, 0) + y * 34,
                   33 * sizeof(float));
    ggn_exec_forward_f32(dis, m->weights[GGN_NET_D], 1, GGN_EVAL);
    double want = (double)*ggn_exec_plane_f32(dis, m->graph[GGN_NET_D].n_values - 1, 0, 0);
    if (!(fabs(got - want) < 1e-4 * fmax(1, fabs(want))))
        fail_msg("decision %.9g, networks %.9g", got, want);
    ggn_exec_destroy_f32(gen);
    ggn_exec_destroy_f32(dis);
    ggn_infer_destroy(f);
    ggn_model_destroy(m);
    free(history);
    free(denoised);
    free(rgb);
    (void)state;
}

/* bfloat16 has 8 bits: close to float, deterministic, and float itself where the processor lacks it. */
static void test_bf16(void **state)
{
    struct ggn_model *m = make();
    struct ggn_infer *f = ggn_infer_create(m, GGN_PRECISION_F32, NULL, NULL),
                     *b = ggn_infer_create(m, GGN_PRECISION_BF16, NULL, NULL);
    void *history = calloc(1, ggn_history_bytes(&hyper));
    double exact, rounded, again;

    assert_true(f && b && history);
    exact = decide(f, history, 1, 3);
    ggn_history_clear(history);
    rounded = decide(b, history, 1, 3);
    ggn_history_clear(history);
    again = decide(b, history, 1, 3);
    assert_memory_equal(&rounded, &again, sizeof again);
    assert_true(fabs(rounded - exact) < 0.1);
    assert_int_equal(rounded != exact, ggn_infer_has_bf16());
    ggn_infer_destroy(f);
    ggn_infer_destroy(b);
    free(history);
    ggn_model_destroy(m);
    (void)state;
}

static void test_memory_bounds(void **state)
{
    struct ggn_hyper full = ggn_hyper_default(GGN_PRESET_LULL);
    struct ggn_model *m = ggn_model_create(&full, NULL);

    assert_non_null(m);
    assert_true(ggn_history_bytes(&full) <= (size_t)3 << 20);
    assert_true(ggn_infer_bytes(m, GGN_PRECISION_F32, 1) <= 64000000);
    assert_true(ggn_infer_bytes(m, GGN_PRECISION_BF16, 1) <= 64000000);
    ggn_model_destroy(m);
    (void)state;
}

static double srgb(double v)
{
    return v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
}

static void test_srgb(void **state)
{
    for (int i = 0; i < 20000; i++) {
        float v[3] = {(float)(i / 19000.0), (float)pow(2, -20 + i / 900.0), (float)ggn_hash_unit((uint32_t)i, 1)};
        uint8_t out[3];
        struct ggn_linear_view view = {v, 1, 1, 1, 1, 1, 1};
        ggn_preprocess(&view, out, NULL);
        for (int c = 0; c < 3; c++)
            assert_int_equal(out[c], (int)fmin(255, floor(255 * srgb((double)v[c]) + 0.5)));
    }
    (void)state;
}

static void test_cleaning(void **state)
{
    const float bad[8] = {NAN, INFINITY, -INFINITY, -1, 1e30f, 1e-40f, -1e-40f, -0.0f};
    static const uint8_t want[8] = {0, 255, 0, 0, 255, 0, 0, 0};
    float view_data[24];
    uint8_t out[24];
    struct ggn_pixel_counts counts = {0};
    /* bottom-up, interleaved */
    struct ggn_linear_view view = {view_data + 12, 1, 3, -12, 2, 4, 1};

    for (int i = 0; i < 24; i++)
        view_data[i] = 0.5f;
    for (int i = 0; i < 8; i++)
        view_data[(i < 4 ? 12 : 0) + 3 * (i % 4)] = bad[i];
    ggn_preprocess(&view, out, &counts);
    for (int i = 0; i < 24; i++)
        assert_int_equal(out[i], i < 8 ? want[i] : 188);
    assert_int_equal(counts.nan, 1);
    assert_int_equal(counts.infinite, 2);
    assert_int_equal(counts.negative, 1);
    assert_int_equal(counts.huge, 1);
    assert_int_equal(counts.denormal, 2);
    assert_int_equal(ggn_pixel_counts_bad(&counts), 4);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_history),       cmocka_unit_test(test_against_networks),
                                       cmocka_unit_test(test_memory_bounds), cmocka_unit_test(test_bf16),
                                       cmocka_unit_test(test_srgb),          cmocka_unit_test(test_cleaning)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
