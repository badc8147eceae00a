/* Numerically hard cases of the networks, the losses and training. */
#include "support/ggn_cmocka.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "model/inference.h"
#include "model/policy.h"
#include "sight/preprocess.h"
#include "model/trainer.h"
#include "nn/hash.h"
#include "nn/loss.h"
#include "nn/ssim.h"
#include "nn/ssim.h"

#if defined(__x86_64__)
#include <xmmintrin.h>
#endif

static const struct ggn_hyper hyper = {
    .preset = GGN_PRESET_LULL, .height = 32, .width = 32, .window = 3, .k_r = 4, .k_m = 4, .k_d = 3};
enum { SIDE = 32, AREA = SIDE * SIDE, BYTES = 3 * AREA };

static struct ggn_model *make(void)
{
    struct ggn_model *m = ggn_model_create(&hyper, NULL);

    assert_non_null(m);
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_weights_init(m->weights[net], GGN_INIT_HASH, 70 + (uint32_t)net);
        ggn_weights_pack(m->weights[net], NULL);
    }
    return m;
}

/* The decision on a window whose images are the given linear blocks, cleaned by the shared function. */
static double decide(const struct ggn_model *m, float (*block)(int image, int k), long *bad)
{
    const struct ggn_policy policy = ggn_policy_default();
    struct ggn_inference *j = ggn_inference_create(m, NULL, NULL);
    static uint8_t noisy[3][BYTES];
    static uint16_t denoised[3][BYTES];
    const uint8_t *const n[3] = {noisy[0], noisy[1], noisy[2]};
    const uint16_t *const d[3] = {denoised[0], denoised[1], denoised[2]};

    assert_non_null(j);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < BYTES; k++)
            noisy[i][k] = ggn_preprocess((double)block(i, k), NULL, bad);
        ggn_inference_denoise(j, noisy[i], denoised[i], SIDE, SIDE);
    }
    double p = ggn_policy_p(&policy, ggn_inference_logit(j, n, d, NULL, NULL, SIDE, SIDE));
    ggn_inference_destroy(j);
    return p;
}

static float constant(int image, int k)
{
    (void)image;
    (void)k;
    return 0.18f;
}

static float black(int image, int k)
{
    (void)image;
    (void)k;
    return 0;
}

static float white(int image, int k)
{
    (void)image;
    (void)k;
    return 50;
}

static float firefly(int image, int k)
{
    (void)image;
    return k == 500 ? 1e4f : 0;
}

static float equal_images(int image, int k)
{
    (void)image;
    return (float)ggn_hash_unit((uint32_t)k, 3);
}

static float broken(int image, int k)
{
    static const float bad[6] = {1e30f, NAN, INFINITY, -INFINITY, -5, 1e-42f};
    return k % 97 == 0 ? bad[(k / 97 + image) % 6] : (float)ggn_hash_unit((uint32_t)k, 3);
}

/* The same pictures as a display would show them: what is beyond white is white, what is no light is black. */
static float full(int image, int k)
{
    (void)image;
    (void)k;
    return 1;
}

static float white_pixel(int image, int k)
{
    (void)image;
    return k == 500;
}

static float repaired(int image, int k)
{
    static const float good[6] = {1, 0, 1, 0, 0, 0};
    return k % 97 == 0 ? good[(k / 97 + image) % 6] : (float)ggn_hash_unit((uint32_t)k, 3);
}

static void test_blocks(void **state)
{
    static const struct {
        float (*block)(int, int), (*as)(int, int);
    } cases[] = {{constant, constant},         {black, black},    {white, full}, {firefly, white_pixel},
                 {equal_images, equal_images}, {broken, repaired}};
    enum { CASES = sizeof cases / sizeof *cases };
    struct ggn_model *m = make();
    double p[CASES];

    for (size_t i = 0; i < CASES; i++) {
        long bad = 0, none = 0;
        p[i] = decide(m, cases[i].block, &bad);
        assert_true(p[i] > 0 && p[i] < 1 && p[i] == decide(m, cases[i].as, &none));
        assert_int_equal(none, 0);
        /* every 97th of 3 x 3072 values, six kinds in turn: 17 are NaN, 33 infinite, 16 huge, the others harmless */
        assert_int_equal(bad, cases[i].block == broken ? 17 + 33 + 16 : 0);
        for (size_t k = 0; k < i; k++)
            assert_true(p[k] != p[i]); /* it looks at the pixels */
    }
    ggn_model_destroy(m);
    (void)state;
}

/* Finite weights that overflow on the way must not look converged. */
static void test_overflowing_weights(void **state)
{
    for (int net = 0; net < GGN_NETS; net++) {
        struct ggn_model *m = make();
        long bad = 0;
        for (size_t i = 0; i < m->graph[net].n_params; i++)
            m->weights[net]->params[i] *= 1e36f;
        ggn_weights_pack(m->weights[net], NULL);
        double p = decide(m, equal_images, &bad);
        printf("# figure overflow: p %g\n", p);
        assert_true(p == 1);
        ggn_model_destroy(m);
    }
    (void)state;
}

/* A pixel that is no number makes every maximum it takes part in none: it must not vanish on the way to a decision. */
static void check_nan_in_pool(int kernel, enum base_isa isa)
{
    enum { W = 50, H = 7 };
    static struct ggn_graph g;
    const struct ggn_kernels *k = ggn_kernels_for(isa);

    ggn_graph_begin(&g, "pool", 1, H, W);
    ggn_graph_stage(&g, "a");
    ggn_graph_maxpool(&g, 0, kernel);
    assert_int_equal(ggn_graph_end(&g, NULL), 0);
    struct ggn_weights *w = ggn_weights_create(&g, k, 0, NULL);
    struct ggn_exec *e = ggn_exec_create(&g, k, 1, 0, NULL, NULL);
    assert_true(w && e);
    for (int at = 0; at < H * W; at++) {
        for (int i = 0; i < H * W; i++)
            ggn_exec_plane(e, 0, 0, 0)[i / W * g.value[0].row + i % W] =
                i == at ? NAN : (float)ggn_hash_unit((uint32_t)i, 1);
        ggn_exec_forward(e, w, 1, GGN_EVAL);
        for (int y = 0; y < g.value[1].h; y++)
            for (int x = 0; x < g.value[1].w; x++) {
                const int first_y = 2 * y - (kernel == 3), first_x = 2 * x - (kernel == 3);
                const int met =
                    at / W >= first_y && at / W < first_y + kernel && at % W >= first_x && at % W < first_x + kernel;
                assert_int_equal(isnan(ggn_exec_plane(e, 1, 0, 0)[y * g.value[1].row + x]) != 0, met);
            }
    }
    ggn_exec_destroy(e);
    ggn_weights_destroy(w);
}

static void test_nan_in_pools(void **state)
{
    for (int isa = 0; isa < BASE_ISA_COUNT; isa++)
        for (int kernel = 2; kernel <= 3 && base_isa_available((enum base_isa)isa); kernel++)
            check_nan_in_pool(kernel, (enum base_isa)isa);
    (void)state;
}

/* Flush-to-zero and denormals-are-zero must not change a decision, even with activations in the denormal range. */
static void test_flush_to_zero(void **state)
{
#if defined(__x86_64__)
    struct ggn_model *m = make();
    long bad = 0;
    unsigned mode = _mm_getcsr();
    double before[2], after[2];

    for (int pass = 0; pass < 2; pass++) {
        before[pass] = decide(m, broken, &bad);
        _mm_setcsr(mode | 0x8040);
        after[pass] = decide(m, broken, &bad);
        _mm_setcsr(mode);
        for (size_t i = 0; i < m->graph[GGN_NET_M].n_params; i++) /* now tiny weights */
            m->weights[GGN_NET_M]->params[i] *= 1e-18f;
        ggn_weights_pack(m->weights[GGN_NET_M], NULL);
    }
    for (int pass = 0; pass < 2; pass++) {
        printf("# figure flush: p moves by %.2g\n", fabs(before[pass] - after[pass]));
        assert_true(fabs(before[pass] - after[pass]) < 1e-6);
    }
    ggn_model_destroy(m);
#endif
    (void)state;
}

/* Logits up to ±1e4: no NaN, no logarithm of 0, gradients in [−1, 1]. */
static void test_bce_extremes(void **state)
{
    for (int i = -4; i <= 4; i++)
        for (int y = 0; y <= 2; y++) {
            double z = (i < 0 ? -1 : 1) * pow(10, abs(i)) * (i != 0), loss = ggn_bce(z, y / 2.0),
                   grad = ggn_bce_grad(z, y / 2.0);
            assert_true(isfinite(loss) && loss >= 0);
            assert_true(grad >= -1 && grad <= 1);
        }
    assert_true(ggn_bce(1e4, 1) == 0);
    assert_true(ggn_bce(1e4, 0) == 1e4);
    assert_true(ggn_sigmoid(1e4) == 1 && ggn_sigmoid(-1e4) >= 0);
    (void)state;
}

/* Flat against flat is 0/0 without the constants. */
static void test_ssim_flat(void **state)
{
    static float x[AREA], y[AREA], dx[AREA];
    const float *px[1] = {x}, *py[1] = {y};
    float *pd[1] = {dx};
    static const float level[4] = {0, 0.25f, 0.5f, 1};
    struct ggn_ssim *s = ggn_ssim_create(SIDE, SIDE, NULL, NULL);

    assert_non_null(s);
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++) {
            for (int k = 0; k < AREA; k++) {
                x[k] = level[i];
                y[k] = level[j];
            }
            double mean = ggn_ssim_mean(s, px, py, pd, 1, SIDE, 1);
            if (i + j == 0)
                printf("# figure flat: SSIM %g of black and black\n", mean);
            assert_true(mean <= 1 + 1e-6 && mean >= -1);
            if (i == j)
                assert_true(fabs(mean - 1) < 1e-5);
            for (int k = 0; k < AREA; k++)
                assert_true(isfinite(dx[k]));
        }
    ggn_ssim_destroy(s);
    (void)state;
}

/* Constant input: every batch norm sees zero variance; batch 1, and D's last ones see a single value. */
static void test_zero_variance(void **state)
{
    static struct ggn_graph g;

    for (int net = 0; net < GGN_NETS; net++) {
        assert_int_equal(ggn_network_build(&g, net, &hyper, NULL), 0);
        struct ggn_weights *w = ggn_weights_create(&g, NULL, 1, NULL);
        struct ggn_exec *e = ggn_exec_create(&g, NULL, 1, GGN_EXEC_GRADS | GGN_EXEC_INPUT_GRAD, NULL, NULL);
        float *grad = calloc(g.n_params, sizeof *grad);
        const struct ggn_value *out = &g.value[g.n_values - 1];
        assert_true(w && e && grad);
        ggn_weights_init(w, GGN_INIT_HE, 3);
        memset(w->params, 0, g.tensor[0].count * sizeof(float)); /* the first layer is constant too */
        ggn_weights_pack(w, NULL);
        ggn_exec_forward(e, w, 1, GGN_TRAIN);
        for (int c = 0; c < out->c; c++)
            for (int y = 0; y < out->h; y++)
                for (int x = 0; x < out->w; x++) {
                    assert_true(isfinite(ggn_exec_plane(e, g.n_values - 1, 0, c)[y * out->row + x]));
                    ggn_exec_grad(e, g.n_values - 1, 0, c)[y * out->row + x] = 1;
                }
        ggn_exec_backward(e, w, grad);
        for (size_t i = 0; i < g.n_params; i++)
            assert_true(isfinite(grad[i]));
        for (size_t i = 0; i < g.n_stats; i++)
            assert_true(isfinite(w->mean[i]) && w->var[i] >= 0);
        ggn_weights_destroy(w);
        ggn_exec_destroy(e);
        free(grad);
    }
    (void)state;
}

/* γ·(x − μ)/√(var + 1e-5) + β (Ioffe & Szegedy 2015, algorithm 1) where the variances are so small that what is added to them counts. */
static void test_batch_norm_of_tiny_variances(void **state)
{
    static struct ggn_graph g;
    int layers = 0;

    assert_int_equal(ggn_network_build(&g, GGN_NET_M, &hyper, NULL), 0);
    struct ggn_weights *w = ggn_weights_create(&g, NULL, 1, NULL);
    struct ggn_exec *e = ggn_exec_create(&g, NULL, 1, GGN_EXEC_GRADS, NULL, NULL);
    assert_true(w && e);
    ggn_weights_init(w, GGN_INIT_HE, 3);
    for (size_t i = 0; i < g.n_stats; i++) {
        w->mean[i] = (float)ggn_hash_unit((uint32_t)i, 1) - 0.5f;
        w->var[i] = 2e-5f * (float)ggn_hash_unit((uint32_t)i, 2);
    }
    ggn_weights_pack(w, NULL);
    for (int c = 0; c < g.value[0].c; c++)
        for (int k = 0; k < AREA; k++)
            ggn_exec_plane(e, 0, 0, c)[k / SIDE * g.value[0].row + k % SIDE] =
                (float)ggn_hash_unit((uint32_t)k, (uint32_t)c);
    ggn_exec_forward(e, w, 1, GGN_EVAL);
    for (int i = 0; i < g.n_layers; i++) {
        const struct ggn_layer *l = &g.layer[i];
        const struct ggn_value *v = &g.value[l->out];
        layers += l->op == GGN_OP_BN;
        for (int c = 0; l->op == GGN_OP_BN && c < v->c; c++)
            for (int y = 0; y < v->h; y++)
                for (int x = 0; x < v->w; x++) {
                    size_t at = (size_t)(y * v->row + x), k = (size_t)c;
                    double in = (double)ggn_exec_plane(e, l->in, 0, c)[at],
                           out = (double)ggn_exec_plane(e, l->out, 0, c)[at];
                    double mean = (double)w->mean[l->stats + k], sd = sqrt((double)w->var[l->stats + k] + 1e-5);
                    double want = (double)w->params[l->weight + k] * (in - mean) / sd + (double)w->params[l->bias + k];
                    /* scale and shift are floats, and their difference may be small */
                    if (!(fabs(out - want) <= 1e-5 * (fabs(in) + fabs(mean) + 1e-3) / sd))
                        fail_msg("layer %d, channel %d: %g becomes %g, not %g", i, c, in, out, want);
                }
    }
    assert_true(layers > 0);
    ggn_exec_destroy(e);
    ggn_weights_destroy(w);
    (void)state;
}

enum { BATCH = 2, PLANES = 9 };
static float noisy[BATCH * PLANES][AREA], reference[BATCH * 3][AREA];
static const float *p_noisy[BATCH * PLANES], *p_reference[BATCH * 3], *p_image[BATCH * 3];

static void fill_training(void)
{
    for (int i = 0; i < BATCH * PLANES; i++) {
        for (int k = 0; k < AREA; k++)
            noisy[i][k] = (float)ggn_hash_unit((uint32_t)k, (uint32_t)i);
        p_noisy[i] = noisy[i];
    }
    for (int i = 0; i < BATCH * 3; i++) {
        for (int k = 0; k < AREA; k++)
            reference[i][k] = 0.5f;
        p_reference[i] = reference[i];
        p_image[i] = noisy[i];
    }
}

static struct ggn_trainer *trainer(double lr, double clip)
{
    struct ggn_train_options o = ggn_train_options_default(GGN_PRESET_LULL);

    o.batch = BATCH;
    o.clip = clip;
    for (int net = 0; net < GGN_NETS; net++)
        o.lr[net] = lr;
    struct ggn_trainer *t = ggn_trainer_create(&hyper, &o, NULL, NULL);
    assert_non_null(t);
    return t;
}

static int all_finite(struct ggn_trainer *t)
{
    size_t count;
    float *x;

    for (int net = 0; net < GGN_NETS; net++)
        for (int i = 0; (x = ggn_trainer_state(t, net, i, &count)) != NULL; i++)
            for (size_t k = 0; k < count; k++)
                if (!isfinite(x[k]))
                    return 0;
    return 1;
}

static void test_equal_labels(void **state)
{
    static const double label[2][BATCH] = {{0, 0}, {1, 1}};
    struct ggn_trainer *t = trainer(2e-4, 1);
    struct base_err err = {0};
    double bce;

    fill_training();
    for (int i = 0; i < 6; i++) {
        struct ggn_batch b = {.count = BATCH, .noisy = p_noisy, .denoised = p_noisy, .label = label[i & 1]};
        assert_int_equal(ggn_trainer_classifier_step(t, &b, &bce, NULL, &err), 0);
        assert_true(isfinite(bce));
    }
    assert_true(all_finite(t));
    ggn_trainer_destroy(t);
    (void)state;
}

/* An absurd learning rate is noticed, named, and leaves the last good weights. */
static void test_divergence(void **state)
{
    struct ggn_trainer *t = trainer(1e37, 0);
    struct base_err err = {0};
    int rc = 0, steps = 0;
    double loss;
    float *good = malloc(t->graph[0].n_params * sizeof *good);

    assert_non_null(good);
    fill_training();
    memcpy(good, t->weights[0]->params, t->graph[0].n_params * sizeof *good);
    while (!rc && steps++ < 50)
        rc = ggn_trainer_denoiser_step(t, p_image, p_reference, BATCH, &loss, &err);
    assert_int_equal(rc, GGN_EDIVERGED);
    assert_non_null(strstr(err.text, "denoiser"));
    assert_non_null(strstr(err.text, ".weight") ? strstr(err.text, ".weight") : strstr(err.text, ".bias"));
    assert_true(all_finite(t));
    assert_memory_equal(good, t->weights[0]->params, t->graph[0].n_params * sizeof *good);
    assert_int_equal(t->steps, 0);
    t->options.lr[0] = 1e-4; /* and training can go on */
    assert_int_equal(ggn_trainer_denoiser_step(t, p_image, p_reference, BATCH, &loss, &err), 0);
    free(good);
    ggn_trainer_destroy(t);
    (void)state;
}

/* A NaN in the data is divergence as well, not a NaN in the weights. */
static void test_nan_data(void **state)
{
    struct ggn_trainer *t = trainer(2e-4, 1);
    static const double label[BATCH] = {0, 1};
    struct ggn_batch b = {.count = BATCH, .noisy = p_noisy, .denoised = p_noisy, .label = label};
    struct base_err err = {0};
    double bce;

    fill_training();
    noisy[4][77] = NAN;
    assert_int_equal(ggn_trainer_classifier_step(t, &b, &bce, NULL, &err), GGN_EDIVERGED);
    assert_true(all_finite(t));
    noisy[4][77] = 0.5f;
    assert_int_equal(ggn_trainer_classifier_step(t, &b, &bce, NULL, &err), 0);
    ggn_trainer_destroy(t);
    (void)state;
}

/* 1/(1 − β^t) stays exact for many steps: a constant gradient moves a parameter by lr each step (Kingma & Ba 2015,
 * section 2.1). */
static void test_many_adam_steps(void **state)
{
    enum { STEPS = 100000 };
    const struct ggn_kernels *k = ggn_kernels_best();
    float param[16] = {0}, grad[16], m[16] = {0}, v[16] = {0};
    double sum = 0;

    for (int i = 0; i < 16; i++)
        grad[i] = 1e-3f;
    for (long t = 1; t <= STEPS; t++) {
        double c1 = 1 / -expm1((double)t * log(0.5)), c2 = 1 / -expm1((double)t * log(0.999));
        float before = param[3];
        k->adam(param, grad, m, v, 16, 1e-6f, 0.5f, 0.999f, (float)c1, (float)c2, 1e-8f);
        sum += (double)(before - param[3]);
        if (t % 10000 == 1) /* the step itself, free of the sum's rounding */
            assert_true(fabs((double)m[3] * c1 / (sqrt((double)v[3] * c2) + 1e-8) - 1) < 1e-3);
    }
    assert_true(fabs(sum - STEPS * 1e-6) < 0.02 * STEPS * 1e-6);
    (void)state;
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_blocks),
                                       cmocka_unit_test(test_flush_to_zero),
                                       cmocka_unit_test(test_overflowing_weights),
                                       cmocka_unit_test(test_nan_in_pools),
                                       cmocka_unit_test(test_bce_extremes),
                                       cmocka_unit_test(test_ssim_flat),
                                       cmocka_unit_test(test_zero_variance),
                                       cmocka_unit_test(test_batch_norm_of_tiny_variances),
                                       cmocka_unit_test(test_equal_labels),
                                       cmocka_unit_test(test_divergence),
                                       cmocka_unit_test(test_nan_data),
                                       cmocka_unit_test(test_many_adam_steps)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
