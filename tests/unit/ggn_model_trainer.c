/* Training steps: they learn, resume bit-exactly, do not depend on threads, and both presets work. */
#include "support/ggn_cmocka.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "model/checkpoint.h"

enum { H = 17, W = 21, AREA = H * W, WINDOW = 2, PLANES = 3 * WINDOW, BATCH = 4 };

static char path[] = "/tmp/ggn_trainer.XXXXXX";

static struct data {
    float noisy[BATCH * PLANES][AREA], denoised[BATCH * PLANES][AREA], reference[BATCH * 3][AREA];
    const float *p_noisy[BATCH * PLANES], *p_denoised[BATCH * PLANES], *p_reference[BATCH * 3], *p_first[BATCH * 3];
    double label[BATCH];
} data;

static int setup(void **state)
{
    int fd = mkstemp(path);

    for (int n = 0; n < BATCH; n++) {
        data.label[n] = n & 1;
        for (int c = 0; c < PLANES; c++)
            for (int k = 0; k < AREA; k++) {
                float clean = 0.5f + 0.4f * sinf(0.3f * (float)(k % W) + 0.2f * (float)(k / W) + (float)(n + c % 3));
                float noise = (n & 1 ? 0.4f : 0.02f) * ((float)ggn_hash_unit((uint32_t)k, (uint32_t)(n * 100 + c)) - 0.5f);
                data.noisy[n * PLANES + c][k] = clean + noise;
                data.denoised[n * PLANES + c][k] = clean;
                data.reference[n * 3 + c % 3][k] = clean;
            }
    }
    for (int i = 0; i < BATCH * PLANES; i++) {
        data.p_noisy[i] = data.noisy[i];
        data.p_denoised[i] = data.denoised[i];
    }
    for (int i = 0; i < BATCH * 3; i++) {
        data.p_reference[i] = data.reference[i];
        data.p_first[i] = data.noisy[i / 3 * PLANES + i % 3];
    }
    (void)state;
    return fd < 0 ? -1 : close(fd);
}

static int teardown(void **state)
{
    (void)state;
    return unlink(path);
}

static struct ggn_trainer_f32 *make(enum ggn_preset preset, double lr, struct base_threads *threads)
{
    struct ggn_hyper hyper = {preset, H, W, WINDOW, 4, 6, 4};
    struct ggn_train_options options = ggn_train_options_default(preset);
    struct base_err err = {0};

    options.batch = BATCH;
    options.dropout = preset == GGN_PRESET_PAPER;
    for (int net = 0; net < GGN_NETS; net++)
        options.lr[net] = lr;
    struct ggn_trainer_f32 *t = ggn_trainer_create_f32(&hyper, &options, threads, &err);
    if (!t)
        fail_msg("%s", err.text);
    return t;
}

static double judge(struct ggn_trainer_f32 *t)
{
    struct ggn_batch_f32 batch = {.count = BATCH, .noisy = data.p_noisy, .denoised = data.p_denoised, .label = data.label};
    struct base_err err = {0};
    double bce;

    if (ggn_trainer_judge_step_f32(t, &batch, &bce, NULL, &err))
        fail_msg("%s", err.text);
    return bce;
}

static double denoise(struct ggn_trainer_f32 *t)
{
    struct base_err err = {0};
    double loss;

    if (ggn_trainer_denoiser_step_f32(t, data.p_first, data.p_reference, BATCH, &loss, &err))
        fail_msg("%s", err.text);
    return loss;
}

static void test_learns(void **state)
{
    struct ggn_trainer_f32 *t = make(GGN_PRESET_LULL, 4e-3, NULL);
    double first = denoise(t), first_bce = judge(t), last = 0, last_bce = 0;

    for (int i = 0; i < 40; i++) {
        last = denoise(t);
        last_bce = judge(t);
    }
    if (!(last < 0.7 * first && last_bce < 0.6 * first_bce))
        fail_msg("1 - SSIM went from %g to %g, cross-entropy from %g to %g", first, last, first_bce, last_bce);
    ggn_trainer_destroy_f32(t);
    (void)state;
}

static void same_state(struct ggn_trainer_f32 *a, struct ggn_trainer_f32 *b)
{
    size_t count, other;

    for (int net = 0; net < GGN_NETS; net++) {
        float *x, *y;
        for (int i = 0; (x = ggn_trainer_state_f32(a, net, i, &count)) != NULL; i++) {
            y = ggn_trainer_state_f32(b, net, i, &other);
            assert_int_equal(count, other);
            assert_memory_equal(x, y, count * sizeof *x);
        }
        assert_int_equal(a->adam_t[net], b->adam_t[net]);
    }
    assert_int_equal(a->steps, b->steps);
}

static void test_resume_and_threads(void **state)
{
    struct base_threads *threads = base_threads_create(2, NULL);
    struct ggn_trainer_f32 *a = make(GGN_PRESET_LULL, 1e-3, NULL), *b = make(GGN_PRESET_LULL, 1e-3, threads);
    cJSON *loop = cJSON_CreateObject(), *read = NULL;
    struct base_err err = {0};

    assert_non_null(cJSON_AddNumberToObject(loop, "epoch", 3));
    for (int i = 0; i < 2; i++) {
        denoise(a);
        judge(a);
    }
    assert_int_equal(ggn_checkpoint_save(a, loop, path, &err), 0);
    for (int i = 0; i < 2; i++) {
        denoise(a);
        judge(a);
    }
    if (ggn_checkpoint_load(b, &read, path, &err))
        fail_msg("%s", err.text);
    assert_int_equal(cJSON_GetObjectItem(read, "epoch")->valueint, 3);
    for (int i = 0; i < 2; i++) {
        denoise(b);
        judge(b);
    }
    same_state(a, b);
    cJSON_Delete(loop);
    cJSON_Delete(read);
    ggn_trainer_destroy_f32(a);
    ggn_trainer_destroy_f32(b);
    base_threads_destroy(threads);
    (void)state;
}

static void test_checkpoint_of_others(void **state)
{
    struct ggn_trainer_f32 *a = make(GGN_PRESET_LULL, 1e-3, NULL), *b = make(GGN_PRESET_PAPER, 1e-3, NULL);
    struct base_err err = {0};

    assert_int_equal(ggn_checkpoint_save(a, NULL, path, &err), 0);
    assert_int_equal(ggn_checkpoint_load(b, NULL, path, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "differ"));
    ggn_trainer_destroy_f32(a);
    ggn_trainer_destroy_f32(b);
    (void)state;
}

static void test_paper(void **state)
{
    struct ggn_trainer_f32 *t = make(GGN_PRESET_PAPER, 2e-4, NULL);
    const struct ggn_graph *m = &t->graph[GGN_NET_M];
    size_t last = m->tensor[m->n_tensors - 2].offset;
    float *kept = malloc((m->n_params - last) * sizeof *kept);
    struct ggn_batch_f32 batch = {.count = BATCH, .noisy = data.p_noisy, .reference = data.p_reference, .label = data.label};
    struct ggn_paper_record_f32 r;
    struct base_err err = {0};

    assert_non_null(kept);
    memcpy(kept, t->weights[GGN_NET_M]->params + last, (m->n_params - last) * sizeof *kept);
    for (int i = 0; i < 3; i++)
        if (ggn_trainer_paper_step_f32(t, &batch, &r, &err))
            fail_msg("%s", err.text);
    assert_int_equal(t->adam_t[GGN_NET_R], 3 * WINDOW);
    assert_int_equal(t->adam_t[GGN_NET_M], 3);
    assert_int_equal(t->adam_t[GGN_NET_D], 3);
    /* published: the generator's last convolution is never trained */
    assert_memory_equal(kept, t->weights[GGN_NET_M]->params + last, (m->n_params - last) * sizeof *kept);
    assert_true(isfinite(r.bce_after));
    free(kept);
    ggn_trainer_destroy_f32(t);
    (void)state;
}

static void test_model_from_trainer(void **state)
{
    struct ggn_trainer_f32 *t = make(GGN_PRESET_LULL, 1e-3, NULL), *u = make(GGN_PRESET_LULL, 1e-3, NULL);
    struct ggn_model *m = ggn_model_create(&t->hyper, NULL);

    assert_non_null(m);
    denoise(t);
    assert_int_equal(ggn_model_from_trainer(m, t, GGN_TRAIN_ALL, NULL), 0);
    assert_int_equal(ggn_trainer_from_model(u, m, GGN_TRAIN_ALL, NULL), 0);
    assert_memory_equal(u->weights[0]->params, t->weights[0]->params, t->graph[0].n_params * sizeof(float));
    assert_memory_equal(u->weights[0]->mean, t->weights[0]->mean, t->graph[0].n_stats * sizeof(float));
    ggn_model_destroy(m);
    ggn_trainer_destroy_f32(t);
    ggn_trainer_destroy_f32(u);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_learns), cmocka_unit_test(test_resume_and_threads),
                                       cmocka_unit_test(test_checkpoint_of_others), cmocka_unit_test(test_paper),
                                       cmocka_unit_test(test_model_from_trainer)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
