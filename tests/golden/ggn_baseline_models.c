/* The baselines' models: the LSTM's size and gradients, and that both learners learn. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "baselines/baseline.h"
#include "baselines/lstm.h"
#include "baselines/svm.h"

static void size(void **state)
{
    (void)state;
    struct ggn_lstm *l = ggn_lstm_create(100, 6, 1, NULL);
    assert_non_null(l);
    assert_int_equal(ggn_lstm_parameters(100), 1604257); /* the published count */
    ggn_lstm_destroy(l);
}

/* Central differences along random directions, and for single parameters of every kind. */
static void gradients(void **state)
{
    (void)state;
    enum { IN = 3, STEPS = 4 };
    double sequence[STEPS * IN];
    struct ggn_lstm *l = ggn_lstm_create(IN, STEPS, 5, NULL);
    size_t n = ggn_lstm_parameters(IN);
    float *grad = malloc(n * sizeof *grad), *other = malloc(n * sizeof *other), *keep = malloc(n * sizeof *keep), *p = ggn_lstm_weights(l);
    for (int i = 0; i < STEPS * IN; i++)
        sequence[i] = ggn_noise_gauss((uint32_t)i, 3);
    /* Larger weights, so that no gate sits in the linear middle of its sigmoid. */
    for (size_t i = 0; i < n; i++)
        p[i] *= 3.0f;
    memcpy(keep, p, n * sizeof *p);
    ggn_lstm_gradient(l, sequence, 1, grad);
    for (uint32_t d = 0; d < 6; d++) {
        const double h = 2e-3;
        double slope = 0.0, loss[2];
        for (int side = 0; side < 2; side++) {
            for (size_t i = 0; i < n; i++)
                p[i] = keep[i] + (float)((side == 0 ? -h : h) * (ggn_noise_hash((uint32_t)i, d) & 1 ? 1.0 : -1.0) / sqrt((double)n) * 30.0);
            loss[side] = ggn_lstm_gradient(l, sequence, 1, other);
        }
        for (size_t i = 0; i < n; i++)
            slope += (double)grad[i] * (ggn_noise_hash((uint32_t)i, d) & 1 ? 1.0 : -1.0) / sqrt((double)n) * 30.0;
        assert_near((loss[1] - loss[0]) / (2 * h), slope, 0.02 * fabs(slope) + 2e-3);
    }
    /* Alone, the weights of each input of the first layer: an array that is written beyond its end shows in one of them. */
    for (size_t i = 0; i < 40 * IN; i++) {
        const float h = 0.02f;
        double loss[2];
        memcpy(p, keep, n * sizeof *p);
        for (int side = 0; side < 2; side++) {
            p[i] = keep[i] + (side == 0 ? -h : h);
            loss[side] = ggn_lstm_gradient(l, sequence, 1, other);
        }
        assert_near((loss[1] - loss[0]) / (2 * (double)h), (double)grad[i], 0.03 * fabs((double)grad[i]) + 3e-5);
    }
    free(keep);
    free(other);
    free(grad);
    ggn_lstm_destroy(l);
}

static void learns(void **state)
{
    (void)state;
    enum { IN = 4, STEPS = 1, N = 64 }; /* logistic cells learn slowly: one step only */
    static double x[N][STEPS * IN];
    const double *sequences[N];
    unsigned char label[N];
    for (uint32_t i = 0; i < N; i++) {
        for (uint32_t k = 0; k < STEPS * IN; k++)
            x[i][k] = ggn_noise_gauss(k, i + 10);
        label[i] = x[i][(STEPS - 1) * IN] > 0.0;
        sequences[i] = x[i];
    }
    struct ggn_lstm *a = ggn_lstm_create(IN, STEPS, 2, NULL), *b = ggn_lstm_create(IN, STEPS, 2, NULL);
    double first = ggn_lstm_epoch(a, sequences, label, N, 0), last = first;
    ggn_lstm_epoch(b, sequences, label, N, 0);
    assert_memory_equal(ggn_lstm_weights(a), ggn_lstm_weights(b), ggn_lstm_parameters(IN) * sizeof(float));
    for (uint32_t e = 1; e < 260; e++)
        last = ggn_lstm_epoch(a, sequences, label, N, e);
    assert_true(first > 0.5 && last < 0.5 * first);
    ggn_lstm_destroy(a);
    ggn_lstm_destroy(b);
}

static void svm(void **state)
{
    (void)state;
    enum { N = 200, D = 3 };
    static double x[N * D], fresh[D];
    unsigned char label[N];
    struct ggn_svm s;
    struct base_err err = {0};
    int right = 0;
    for (uint32_t i = 0; i < N; i++) { /* inside or outside a circle; the third feature is constant */
        x[i * D] = 1000.0 * ggn_noise_gauss(i, 1);
        x[i * D + 1] = 0.01 * ggn_noise_gauss(i, 2);
        x[i * D + 2] = 5.0;
        label[i] = hypot(x[i * D] / 1000.0, x[i * D + 1] / 0.01) > 1.5;
    }
    assert_int_equal(ggn_svm_train(&s, x, label, N, D, 1.0, 1.0, &err), 0);
    for (uint32_t i = 0; i < N; i++) {
        fresh[0] = 1000.0 * ggn_noise_gauss(i, 3);
        fresh[1] = 0.01 * ggn_noise_gauss(i, 4);
        fresh[2] = 5.0;
        right += (ggn_svm_score(&s, fresh) > 0.0) == (hypot(fresh[0] / 1000.0, fresh[1] / 0.01) > 1.5);
    }
    assert_true(right > 0.9 * N);
    ggn_svm_release(&s);
    memset(label, 1, sizeof label);
    assert_int_equal(ggn_svm_train(&s, x, label, N, D, 1.0, 1.0, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "are the same"));
}

/* Three looks of a small baseline with made-up weights. */
static void fill(struct ggn_baseline *b, enum ggn_baseline_kind kind)
{
    size_t n;
    assert_int_equal(ggn_baseline_init(b, kind, 24, 24, 3, NULL), 0);
    if (kind == GGN_SVD_ENTROPY) {
        n = ggn_lstm_parameters(b->features);
        b->lstm = malloc(n * sizeof *b->lstm);
    } else {
        assert_int_equal(ggn_svm_init(&b->svm, b->features, 5, NULL), 0);
        n = ggn_svm_values(&b->svm);
        b->svm.gamma = 0.125;
        b->svm.rho = 1.0 / 3.0;
    }
    for (size_t i = 0; i < n; i++)
        (b->lstm ? b->lstm : b->svm.values)[i] = (float)(0.3 * ggn_noise_gauss((uint32_t)i, 8));
    b->policy.threshold = 0.3;
    b->policy.ratio = 1.25;
}

static double logit_of(const struct ggn_baseline *b, int w, int h, uint32_t seed)
{
    static uint8_t rgb[3 * 60 * 60];
    static double look[3][4 * 128];
    const double *looks[3] = {look[0], look[1], look[2]};
    struct ggn_baseline_reader *r = ggn_baseline_reader_create(b, NULL);
    assert_non_null(r);
    assert_true(ggn_baseline_look_size(b, w, h) <= 4 * 128);
    for (uint32_t i = 0; i < 3; i++) {
        for (int k = 0; k < 3 * w * h; k++)
            rgb[k] = (uint8_t)(128.0 + 30.0 * ggn_noise_gauss((uint32_t)k, seed + i));
        ggn_baseline_look(r, rgb, w, h, look[i]);
    }
    double logit = ggn_baseline_logit(r, looks, w, h);
    ggn_baseline_reader_destroy(r);
    return logit;
}

/* What is written is what is read: same numbers, same answers, for blocks of another size too. */
static void stored(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_baseline.XXXXXX";
    struct base_err err = {0};
    close(mkstemp(path));
    for (int kind = 0; kind < GGN_BASELINES; kind++) {
        struct ggn_baseline a, b;
        fill(&a, (enum ggn_baseline_kind)kind);
        cJSON *from = cJSON_CreateObject();
        assert_int_equal(ggn_baseline_save(&a, path, GGN_F32, from, &err), 0);
        cJSON_Delete(from);
        assert_int_equal(ggn_baseline_load(&b, path, (enum ggn_baseline_kind)((kind + 1) % GGN_BASELINES), &err), BASE_EINVAL);
        assert_non_null(strstr(err.text, "not a baseline for"));
        assert_int_equal(ggn_baseline_load(&b, path, (enum ggn_baseline_kind)kind, &err), 0);
        assert_int_equal(b.kind, kind);
        assert_int_equal(b.window, kind == GGN_SVD_ENTROPY ? 3 : 1);
        assert_true(b.policy.threshold == 0.3 && b.policy.ratio == 1.25);
        assert_true(logit_of(&a, 24, 24, 1) == logit_of(&b, 24, 24, 1));
        assert_true(logit_of(&a, 24, 24, 1) != logit_of(&a, 24, 24, 7));
        assert_true(logit_of(&a, 40, 30, 1) == logit_of(&b, 40, 30, 1));
        assert_true(isfinite(logit_of(&b, 1, 1, 1)));
        ggn_baseline_release(&a);
        ggn_baseline_release(&b);
    }
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(size), cmocka_unit_test(gradients), cmocka_unit_test(learns), cmocka_unit_test(svm), cmocka_unit_test(stored)};
    return cmocka_run_group_tests_name("baseline_models", tests, NULL, NULL);
}
