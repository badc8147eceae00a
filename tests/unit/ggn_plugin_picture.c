/*
 * The criterion "ggn" through the ABI with a model that takes the noise map: what a host with half buffers, one without and
 * one whose halves are unequal get is what the networks say of the picture by its definition.
 */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <lull/criterion.h>

#include "model/inference.h"
#include "model/policy.h"
#include "nn/hash.h"
#include "plugin/criteria.h"

enum { W = 21, H = 18, PIXELS = W * H, WINDOW = 2 };

static const struct ggn_hyper hyper = {GGN_PRESET_LULL, H, W, WINDOW, 3, 4, 3, 1, 0, 0};
static char path[] = "/tmp/ggn_picture.XXXXXX";
static struct ggn_model *model;
static struct ggn_policy policy;
static float color[WINDOW][PIXELS][3], half[PIXELS][3];

static int setup(void **state)
{
    (void)state;
    int fd = mkstemp(path);
    if (fd < 0 || close(fd) || !(model = ggn_model_create(&hyper, NULL)))
        return -1;
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_weights_init(model->weights[net], GGN_INIT_HASH, 60 + (uint32_t)net);
        ggn_weights_pack(model->weights[net], NULL);
    }
    policy = ggn_policy_default();
    policy.first_spp = 8;
    policy.ratio = 2;
    policy.scale = 50; /* so that small differences of the logit show */
    policy.shift = 7;
    for (uint32_t p = 0; p < PIXELS; p++)
        for (uint32_t c = 0; c < 3; c++) {
            for (uint32_t k = 0; k < WINDOW; k++)
                color[k][p][c] = (float)(0.02 + 0.4 * ggn_hash_unit(3 * p + c, k));
            half[p][c] = color[WINDOW - 1][p][c] * (float)(0.8 + 0.4 * ggn_hash_unit(3 * p + c, 9));
        }
    return ggn_policy_set(model, &policy, NULL) || ggn_model_save(model, path, GGN_F32, NULL) ? -1 : 0;
}

static int teardown(void **state)
{
    (void)state;
    ggn_model_destroy(model);
    return unlink(path);
}

static uint8_t code(double linear)
{
    double v = linear > 0 ? linear < 1 ? linear : 1 : 0;
    return (uint8_t)floor(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055) + 0.5);
}

static double luminance(const float rgb[3]) { return 0.2 * (double)rgb[0] + 0.7 * (double)rgb[1] + 0.1 * (double)rgb[2]; }

/* p of the networks, with the picture of 16 samples of which `h` are in HALF; h 0: without one. */
static double expected(double h)
{
    static uint8_t noisy[WINDOW][3 * PIXELS], picture[PIXELS];
    static uint16_t denoised[WINDOW][3 * PIXELS];
    const uint8_t *const n[] = {noisy[0], noisy[1]};
    const uint16_t *const d[] = {denoised[0], denoised[1]};
    struct ggn_inference *j = ggn_inference_create(model, NULL, NULL);

    assert_non_null(j);
    for (int k = 0; k < WINDOW; k++) {
        for (int p = 0; p < PIXELS; p++)
            for (int c = 0; c < 3; c++)
                noisy[k][c * PIXELS + p] = code((double)color[k][p][c]);
        ggn_inference_denoise(j, noisy[k], denoised[k], W, H);
    }
    for (int p = 0; p < PIXELS && h > 0; p++) {
        double y = luminance(color[1][p]), difference = sqrt(h / (16 - h)) * (luminance(half[p]) - y);
        picture[p] = (uint8_t)abs(code(y + difference) - code(y));
    }
    double p = ggn_policy_p(&policy, ggn_inference_logit(j, n, d, h > 0 ? picture : NULL, NULL, W, H));
    ggn_inference_destroy(j);
    return p;
}

/* p_noisy after two checks, at 8 and 16 samples. */
static double asked(uint64_t half_spp, int with_half)
{
    static const struct lull_host host = {.struct_size = sizeof host, .max_workers = 1};
    const struct lull_criterion *criterion = &ggn_plugin_ggn;
    const struct lull_pair pairs[] = {{"model", path}};
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_requirements need = {.struct_size = sizeof need};
    struct lull_instance *in = NULL;
    struct lull_rect rect = {0, 0, W, H};
    struct lull_frame frame = {.struct_size = sizeof frame,
                               .width = W,
                               .height = H,
                               .blocks = &rect,
                               .block_count = 1,
                               .block_stride = sizeof rect,
                               .planes = with_half ? 0xff : 0xff & ~LULL_PLANE_BIT(LULL_PLANE_HALF),
                               .exposure = 1,
                               .transfer = LULL_TRANSFER_SRGB,
                               .gamma = 2.2,
                               .rgb_to_xyz = {0, 0, 0, 0.2, 0.7, 0.1, 0, 0, 0}};
    struct lull_decision d = {.p_noisy = (double)NAN};

    if (criterion->create(&host, pairs, 1, sizeof pairs[0], &in, &err) != LULL_OK)
        fail_msg("%s", err.message);
    assert_int_equal(criterion->requirements(in, &need, &err), LULL_OK);
    assert_true(need.planes_used & LULL_PLANE_BIT(LULL_PLANE_HALF));
    assert_int_equal(criterion->begin_frame(in, &frame, &err), LULL_OK);
    for (int k = 0; k < WINDOW; k++) {
        struct lull_plane planes[LULL_PLANE_COUNT] = {
            [LULL_PLANE_COLOR] = {color[k], 12, 12 * W, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0}};
        if (with_half)
            planes[LULL_PLANE_HALF] = (struct lull_plane){half, 12, 12 * W, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0};
        struct lull_block block = {
            .x1 = W, .y1 = H, .spp = (uint64_t)(8 << k), .half_spp = half_spp, .thread_s = (double)NAN};
        struct lull_view view = {.struct_size = sizeof view,
                                 .x1 = W,
                                 .y1 = H,
                                 .planes = planes,
                                 .plane_count = LULL_PLANE_COUNT,
                                 .plane_stride = sizeof planes[0],
                                 .elapsed_s = (double)NAN};
        if (criterion->evaluate(in, &view, &block, sizeof block, &d, sizeof d, 1, &err) != LULL_OK)
            fail_msg("%s", err.message);
    }
    criterion->destroy(in);
    return d.p_noisy;
}

/* What is left is a pixel or two whose code rounds differently: float in the criterion's table, double here. */
static const double TOLERANCE = 1e-3;

static void with_and_without_halves(void **state)
{
    double with = asked(8, 1), without = asked(0, 0);

    assert_true(fabs(with - expected(8)) < TOLERANCE);
    assert_true(fabs(without - expected(0)) < TOLERANCE);
    assert_true(fabs(asked(4, 1) - expected(4)) < TOLERANCE);
    /* a half of no samples, or of all, is none */
    assert_true(asked(0, 1) == without && asked(16, 1) == without);
    assert_true(fabs(with - without) > 10 * TOLERANCE && fabs(with - expected(4)) > 10 * TOLERANCE);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(with_and_without_halves)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
