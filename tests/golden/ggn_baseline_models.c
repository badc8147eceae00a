/* The baselines' models: the LSTM's size and gradients, and that both learners learn. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/approve.h"
#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "baselines/baseline.h"
#include "baselines/learned.h"
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
    float *grad = malloc(n * sizeof *grad), *other = malloc(n * sizeof *other), *keep = malloc(n * sizeof *keep),
          *p = ggn_lstm_weights(l);
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
                p[i] = keep[i] + (float)((side == 0 ? -h : h) * (ggn_noise_hash((uint32_t)i, d) & 1 ? 1.0 : -1.0) /
                                         sqrt((double)n) * 30.0);
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
    assert_true(ggn_baseline_feature_count(b, w, h) <= 4 * 128);
    for (uint32_t i = 0; i < 3; i++) {
        for (int k = 0; k < 3 * w * h; k++)
            rgb[k] = (uint8_t)(128.0 + 30.0 * ggn_noise_gauss((uint32_t)k, seed + i));
        ggn_baseline_extract(r, rgb, w, h, look[i]);
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
        assert_int_equal(ggn_baseline_load(&b, path, (enum ggn_baseline_kind)((kind + 1) % GGN_BASELINES), &err),
                         BASE_EINVAL);
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

/* --- the LSTM by its equations -------------------------------------------------------------------------------------------- */

static double unit(uint32_t k, uint32_t s) { return (double)((float)ggn_noise_hash(k, s) / 4294967296.0f); }

static double logistic(double x) { return 1 / (1 + exp(-x)); }

static double gate(double x) { return fmin(fmax(0.2 * x + 0.5, 0), 1); }

/* i, f, o = gate(W x + U h + b), g = logistic(…); c = f c + i g; h = o logistic(c); three layers, one unit. p as the weights lie: W, U, b
 * of each layer, then the unit's. masks: [3] dropout of each layer's outputs of one sequence, [steps][out], NULL: none. */
static double forward_again(const float *p, int inputs, int steps, const double *x, const double *const *masks)
{
    static const int widths[] = {512, 128, 32};
    static double out[8 * 512];
    double below[8 * 512], z = 0;
    memcpy(below, x, (size_t)(steps * inputs) * sizeof *x);
    for (int layer = 0, in = inputs; layer < 3; in = widths[layer++]) {
        const int n = widths[layer];
        const float *w = p, *u = w + 4 * n * in, *b = u + 4 * n * n;
        double c[512] = {0}, h[512] = {0};
        for (int t = 0; t < steps; t++) {
            double next[512];
            for (int k = 0; k < n; k++) {
                double a[4];
                for (int g = 0; g < 4; g++) {
                    a[g] = (double)b[g * n + k];
                    for (int i = 0; i < in; i++)
                        a[g] += (double)w[(g * n + k) * in + i] * below[t * in + i];
                    for (int i = 0; i < n; i++)
                        a[g] += (double)u[(g * n + k) * n + i] * h[i];
                }
                c[k] = gate(a[1]) * c[k] + gate(a[0]) * logistic(a[2]);
                next[k] = gate(a[3]) * logistic(c[k]);
            }
            memcpy(h, next, (size_t)n * sizeof *h);
            for (int k = 0; k < n; k++)
                out[t * n + k] = h[k] * (masks ? masks[layer][t * n + k] : 1);
        }
        memcpy(below, out, (size_t)(steps * n) * sizeof *out);
        p = b + 4 * n;
    }
    for (int k = 0; k < 32; k++)
        z += (double)p[k] * below[(steps - 1) * 32 + k];
    return z + (double)p[32];
}

static void lstm_by_equations(void **state)
{
    (void)state;
    enum { IN = 3, STEPS = 3 };
    static const int widths[] = {512, 128, 32};
    double x[STEPS * IN];
    const double *rows[STEPS] = {x, x + IN, x + 2 * IN};
    struct ggn_lstm *l = ggn_lstm_create(IN, STEPS, 5, NULL);
    float *p = ggn_lstm_weights(l);
    size_t at = 0;
    for (int layer = 0, in = IN; layer < 3; in = widths[layer++]) { /* Glorot's limits; the forget gates' biases are 1 */
        const int n = widths[layer];
        const uint32_t seed = 5 + 10 * (uint32_t)layer;
        for (int i = 0; i < 4 * n * in; i++, at++)
            assert_near((double)p[at], sqrt(6.0 / (in + 4 * n)) * (2 * unit((uint32_t)i, seed) - 1), 1e-6);
        for (int i = 0; i < 4 * n * n; i++, at++)
            assert_near((double)p[at], sqrt(6.0 / (5 * n)) * (2 * unit((uint32_t)i, seed + 1) - 1), 1e-6);
        for (int i = 0; i < 4 * n; i++, at++)
            assert_true(p[at] == (i >= n && i < 2 * n));
    }
    for (int i = 0; i < 32; i++, at++)
        assert_near((double)p[at], sqrt(6.0 / 33) * (2 * unit((uint32_t)i, 5 + 99) - 1), 1e-6);
    assert_true(p[at] == 0 && at + 1 == ggn_lstm_parameters(IN));
    for (size_t i = 0; i < at + 1; i++) /* larger, so that gates reach their ends */
        p[i] *= 3;
    for (int i = 0; i < STEPS * IN; i++)
        x[i] = 2 * ggn_noise_gauss((uint32_t)i, 3);
    assert_near(ggn_lstm_logit(l, rows), forward_again(p, IN, STEPS, x, NULL), 1e-4);
    struct ggn_lstm *reader = ggn_lstm_reader(IN, STEPS, p, NULL);
    assert_near(ggn_lstm_logit(reader, rows), forward_again(p, IN, STEPS, x, NULL), 1e-4);
    double z = forward_again(p, IN, STEPS, x, NULL);
    float *grad = malloc((at + 1) * sizeof *grad);
    for (int y = 0; y < 2; y++) {
        assert_near(ggn_lstm_gradient(l, x, y, grad), log(1 + exp(y ? -z : z)), 1e-4);
        assert_near((double)grad[at], logistic(z) - y, 1e-4); /* of the last bias */
    }
    free(grad);
    ggn_lstm_destroy(reader);
    ggn_lstm_destroy(l);
}

/* One pass over fewer than a batch: the loss by the equations with dropout drawn for each layer (4 of 10, the rest times 5/3), classes in
 * balance, and Adam's first step, which moves a parameter by at most 1e-3. */
static void first_epoch(void **state)
{
    (void)state;
    enum { IN = 2, STEPS = 2, N = 5, SEED = 9, EPOCH = 3, BATCH = 64 };
    static const int widths[] = {512, 128, 32};
    static const unsigned char label[N] = {1, 0, 0, 1, 0};
    static double x[N][STEPS * IN], masks[3][STEPS * 512];
    const double *sequences[N], *const mask[] = {masks[0], masks[1], masks[2]};
    int order[N];
    struct ggn_lstm *l = ggn_lstm_create(IN, STEPS, SEED, NULL);
    const size_t n = ggn_lstm_parameters(IN);
    float *before = malloc(n * sizeof *before), *p = ggn_lstm_weights(l);
    double loss = 0, slope = 0;
    for (int i = 0; i < N; i++) {
        order[i] = i;
        sequences[i] = x[i];
        for (int k = 0; k < STEPS * IN; k++)
            x[i][k] = ggn_noise_gauss((uint32_t)k, (uint32_t)i + 30);
    }
    for (uint32_t i = N; i > 1; i--) {
        const uint32_t j = ggn_noise_hash(i, SEED + 77 + EPOCH) % i;
        const int keep = order[i - 1];
        order[i - 1] = order[j];
        order[j] = keep;
    }
    for (size_t i = 0; i < n; i++)
        before[i] = p[i];
    for (int r = 0; r < N; r++) {
        for (int layer = 0; layer < 3; layer++)
            for (int t = 0; t < STEPS; t++)
                for (int k = 0; k < widths[layer]; k++) {
                    const uint32_t element = (uint32_t)((t * BATCH + r) * widths[layer] + k);
                    masks[layer][t * widths[layer] + k] =
                        unit(element, SEED + 1000 + 1 + (uint32_t)layer) < 0.4 ? 0 : 1 / 0.6;
                }
        const int y = label[order[r]];
        double z = forward_again(before, IN, STEPS, x[order[r]], mask);
        loss += (y ? 0.5 * N / 2 : 0.5 * N / 3) * log(1 + exp(y ? -z : z)) / N;
        slope += (y ? 0.5 * N / 2 : 0.5 * N / 3) * (logistic(z) - y) / N;
    }
    assert_near(ggn_lstm_epoch(l, sequences, label, N, EPOCH), loss, 1e-5);
    for (size_t i = 0; i < n; i++)
        assert_true(fabs((double)p[i] - (double)before[i]) < 1.001e-3);
    /* the last bias by rate · g / (|g| + 1e-7 √1000) */
    assert_near((double)p[n - 1] - (double)before[n - 1], -1e-3 * slope / (fabs(slope) + 1e-7 * sqrt(1000)), 1e-7);
    assert_true(isnan(ggn_lstm_epoch(l, sequences, label, 0, 1)));
    free(before);
    ggn_lstm_destroy(l);
}

/* Epochs of more than a batch, to the last figure that another processor's BLAS leaves alone; one class only weighs nothing else. */
static void recorded_epochs(void **state)
{
    (void)state;
    enum { IN = 2, STEPS = 2, N = 70 };
    static double x[N][STEPS * IN];
    const double *sequences[N], *rows[STEPS];
    unsigned char label[N];
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    for (uint32_t i = 0; i < N; i++) {
        for (uint32_t k = 0; k < STEPS * IN; k++)
            x[i][k] = 2 * ggn_noise_gauss(k, i + 10);
        label[i] = x[i][0] > 0.6;
        sequences[i] = x[i];
    }
    struct ggn_lstm *l = ggn_lstm_create(IN, STEPS, 2, NULL);
    for (uint32_t e = 0; e < 5; e++) {
        if (e == 4)
            memset(label, 1, sizeof label);
        fprintf(f, "epoch %u: loss %.6f", e, ggn_lstm_epoch(l, sequences, label, N, e));
        for (int i = 0; i < 3; i++) {
            rows[0] = x[i];
            rows[1] = x[i] + IN;
            fprintf(f, " logit %.6f", ggn_lstm_logit(l, rows));
        }
        fputc('\n', f);
    }
    fclose(f);
    approve_text("tests/golden/ggn_baseline_epochs.txt", text);
    free(text);
    ggn_lstm_destroy(l);
}

/* --- the support vector machine ------------------------------------------------------------------------------------------- */

/* The formula of the score, on weights that were made up; features standardised by mean and deviation, a constant one not at all. */
static void scores(void **state)
{
    (void)state;
    enum { N = 60, D = 3 };
    double x[N * D], sum[D] = {0}, square[D] = {0};
    unsigned char label[N];
    struct ggn_svm s;
    struct base_err err = {0};
    for (uint32_t i = 0; i < N; i++) {
        x[i * D] = 100 + 20 * ggn_noise_gauss(i, 1);
        x[i * D + 1] = 0.01 * ggn_noise_gauss(i, 2);
        x[i * D + 2] = 5;
        label[i] = x[i * D] > 112; /* few of them: classes weigh the same */
        for (int k = 0; k < D; k++)
            sum[k] += x[i * D + (uint32_t)k] / N;
    }
    for (int i = 0; i < N * D; i++)
        square[i % D] += (x[i] - sum[i % D]) * (x[i] - sum[i % D]) / N;
    assert_int_equal(ggn_svm_train(&s, x, label, N, D, 1, 1.5, &err), 0);
    assert_true(s.features == D && s.n_support > 3 && s.n_support < N && s.gamma == 0.5);
    double total = 0;
    for (int k = 0; k < D; k++) {
        assert_near((double)s.mean[k], sum[k], 1e-6 * fabs(sum[k]) + 1e-9);
        assert_near((double)s.scale[k], k == 2 ? 0 : 1 / sqrt(square[k]), k == 2 ? 0 : 1e-6 / sqrt(square[k]));
    }
    double most[2] = {0, 0}; /* alpha ≤ C times half of n over the class */
    int positive = 0;
    for (int i = 0; i < N; i++)
        positive += label[i];
    for (int i = 0; i < s.n_support; i++) {
        double c = (double)s.coefficient[i];
        total += c;
        most[c > 0] = fmax(most[c > 0], fabs(c));
    }
    assert_near(total, 0, 1e-4);
    assert_near(most[1], 0.5 * N / positive, 1e-4);
    assert_true(most[0] <= 0.5 * N / (N - positive) + 1e-4);
    for (uint32_t i = 0; i < 5; i++) {
        const double v[D] = {100 + 30 * ggn_noise_gauss(i, 7), 0.01 * ggn_noise_gauss(i, 8), 5 + i};
        double want = -s.rho;
        for (int k = 0; k < s.n_support; k++) {
            double distance = 0;
            for (int c = 0; c < D; c++) {
                double d = (v[c] - (double)s.mean[c]) * (double)s.scale[c] - (double)s.support[k * D + c];
                distance += d * d;
            }
            want += (double)s.coefficient[k] * exp(-s.gamma * distance);
        }
        assert_near(ggn_svm_score(&s, v), want, 1e-12);
        assert_int_equal(want > 0, v[0] > 112 || want > 0);
    }
    assert_true(ggn_svm_score(&s, (const double[]){140, 0, 5}) > 0.5 &&
                ggn_svm_score(&s, (const double[]){90, 0, 5}) < -0.5);
    assert_int_equal(ggn_svm_values(&s), 2 * D + s.n_support * (1 + D));
    ggn_svm_release(&s);
    memset(label, 0, sizeof label);
    assert_int_equal(ggn_svm_train(&s, x, label, N, D, 1, 1, &err), BASE_EINVAL);
    assert_string_equal(err.text, "SVM: all 60 labels are the same");
    assert_int_equal(ggn_svm_init(&s, 256, 0, &err), 0);
    ggn_svm_release(&s);
    assert_int_equal(ggn_svm_init(&s, 257, 1, &err), BASE_EINVAL);
    assert_string_equal(err.text, "SVM of 257 features (1 to 256) and 1 vectors");
    assert_true(ggn_svm_init(&s, 0, 1, &err) == BASE_EINVAL && ggn_svm_init(&s, 1, -1, &err) == BASE_EINVAL && !s.values);
}

/* --- the file ------------------------------------------------------------------------------------------------------------- */

/* Sizes and windows at their ends; what a new one holds. */
static void new_baselines(void **state)
{
    (void)state;
    static const int least[] = {20, 8, 8};
    for (int kind = 0; kind < GGN_BASELINES; kind++) {
        struct ggn_baseline b;
        struct base_err err = {0};
        const int sizes[][3] = {{least[kind], 4096, 1},   {4096, least[kind], 1}, {least[kind] - 1, 50, 0},
                                {50, least[kind] - 1, 0}, {4097, 50, 0},          {50, 4097, 0}};
        char want[128];
        for (int i = 0; i < 6; i++) {
            assert_int_equal(ggn_baseline_init(&b, (enum ggn_baseline_kind)kind, sizes[i][0], sizes[i][1], 6, &err),
                             sizes[i][2] ? 0 : BASE_EINVAL);
            snprintf(want, sizeof want, "%s: blocks of %dx%d pixels; it takes %d to 4096", ggn_baseline_names[kind],
                     sizes[i][0], sizes[i][1], least[kind]);
            if (!sizes[i][2])
                assert_string_equal(err.text, want);
        }
        for (int window = 0; window <= 17; window++) {
            assert_int_equal(ggn_baseline_init(&b, (enum ggn_baseline_kind)kind, 65, 45, window, &err),
                             window > 0 && window < 17 ? 0 : BASE_EINVAL);
            snprintf(want, sizeof want, "%s: windows of %d images; it takes 1 to 16", ggn_baseline_names[kind], window);
            if (window == 0 || window == 17)
                assert_string_equal(err.text, want);
        }
        assert_int_equal(ggn_baseline_init(&b, (enum ggn_baseline_kind)kind, 65, 45, 4, &err), 0);
        assert_true(b.kind == (enum ggn_baseline_kind)kind && b.width == 65 && b.height == 45 && b.first == 0 && !b.lstm &&
                    !b.svm.values);
        assert_int_equal(b.window, kind == GGN_SVD_ENTROPY ? 4 : 1);
        assert_int_equal(b.features, kind == GGN_SVD_ENTROPY ? 6 : kind == GGN_ATTRIBUTES_SVM ? 26 : 128);
        assert_true(b.policy.passes == 1 && b.policy.threshold == 0.5 && b.policy.ratio == 1.15 && b.policy.first_spp == 20);
        assert_int_equal(ggn_baseline_feature_count(&b, 65, 45), b.features);
        assert_int_equal(ggn_baseline_feature_count(&b, 66, 91), 6 * b.features);
    }
}

/* A file whose description has one text for another: what reading it says ("": it is read). */
static void forged(const char *path, const char *from, const char *to, const char *want)
{
    struct ggn_container c, other = {0};
    struct ggn_baseline b;
    struct base_err err = {0};
    char line[200];
    assert_int_equal(ggn_container_read(&c, path, NULL), 0);
    const char *hit = strstr(c.json, from);
    assert_non_null(hit);
    other.json = malloc(strlen(c.json) + strlen(to) + 1);
    sprintf(other.json, "%.*s%s%s", (int)(hit - c.json), c.json, to, hit + strlen(from));
    for (int i = 0; i < c.n_entries; i++) {
        const struct ggn_entry *e = &c.entry[i];
        const int dim[] = {(int)e->dim[0], (int)e->dim[1]};
        assert_int_equal(ggn_container_add(&other, e->name, GGN_F32, e->rank, dim,
                                           (const float *)(const void *)(c.data + e->offset), NULL),
                         0);
    }
    char forged_path[] = "/tmp/ggn_forged.XXXXXX";
    close(mkstemp(forged_path));
    assert_int_equal(ggn_container_write(&other, forged_path, NULL), 0);
    ggn_container_release(&other);
    ggn_container_release(&c);
    int rc = ggn_baseline_load(&b, forged_path, GGN_BASELINES, &err);
    snprintf(line, sizeof line, "%s: %s", forged_path, want);
    assert_int_equal(rc, *want ? BASE_EINVAL : 0);
    assert_string_equal(err.text, *want ? line : "");
    ggn_baseline_release(&b);
    unlink(forged_path);
}

static void described(void **state)
{
    (void)state;
    char path[] = "/tmp/ggn_described.XXXXXX", *text, *flat;
    struct ggn_baseline b;
    struct ggn_container c;
    cJSON *from = cJSON_CreateObject();
    cJSON_AddNumberToObject(from, "blocks", 7);
    close(mkstemp(path));
    for (int kind = 0; kind < 2; kind++) {
        fill(&b, (enum ggn_baseline_kind)kind);
        b.first = 5 * !kind;
        assert_int_equal(ggn_baseline_save(&b, path, GGN_F16, from, NULL), 0);
        ggn_baseline_release(&b);
        assert_int_equal(ggn_container_read(&c, path, NULL), 0);
        text = flat = c.json;
        for (char *at = text; (*flat = *at) != '\0'; at++)
            flat += !strchr("\n\t ", *at);
        assert_string_equal(
            text,
            kind ? "{\"kind\":\"baseline\",\"method\":\"attributes\",\"width\":24,\"height\":24,\"window\":1,\"first\":0,"
                   "\"support\":5,\"gamma\":0.125,\"rho\":0.33333333333333331,\"policy\":{\"first_spp\":20,\"ratio\":1.25,"
                   "\"step_spp\":0,\"scale\":1,\"shift\":0,\"threshold\":0.3,\"slope\":0,"
                   "\"passes\":1},\"provenance\":{\"blocks\":7}}"
                 : "{\"kind\":\"baseline\",\"method\":\"svd-entropy\",\"width\":24,\"height\":24,\"window\":3,\"first\":5,"
                   "\"policy\":{\"first_spp\":20,\"ratio\":1.25,\"step_spp\":0,\"scale\":1,\"shift\":0,\"threshold\":0.3,"
                   "\"slope\":0,\"passes\":1},\"provenance\":{\"blocks\":7}}");
        static const char *const names[] = {"mean", "scale", "coefficient", "support"};
        assert_int_equal(c.n_entries, kind ? 4 : 1);
        for (int i = 0; i < c.n_entries; i++) {
            assert_string_equal(c.entry[i].name, kind ? names[i] : "lstm");
            assert_int_equal(c.entry[i].type, !kind || i == 3 ? GGN_F16 : GGN_F32);
            assert_int_equal(c.entry[i].rank, kind && i == 3 ? 2 : 1);
            assert_int_equal(c.entry[i].count, !kind ? ggn_lstm_parameters(1) : i == 2 ? 5 : i == 3 ? 5 * 26 : 26);
        }
        ggn_container_release(&c);
    }
    cJSON_Delete(from);
    fill(&b, GGN_ATTRIBUTES_SVM);
    from = cJSON_CreateObject();
    assert_int_equal(ggn_baseline_save(&b, path, GGN_F32, from, NULL), 0);
    cJSON_Delete(from);
    ggn_baseline_release(&b);
    forged(path, "attributes", "attributes", "");
    forged(path, "\"baseline\"", "\"model\"", "not a baseline");
    forged(path, "\"attributes\"", "\"attribute\"", "not a baseline");
    forged(path, "\"attributes\"", "1", "not a baseline");
    forged(path, "{", "[", "the description is not JSON");
    forged(path, "\"width\":\t24", "\"width\":\t0", "'width' is missing or not a number in 1..4096");
    forged(path, "\"width\":\t24", "\"width\":\t7", "attributes: blocks of 7x24 pixels; it takes 8 to 4096");
    forged(path, "\"height\":\t24", "\"height\":\t4097", "'height' is missing or not a number in 1..4096");
    forged(path, "\"height\":\t24", "\"height\":\t24.5", "'height' is not a whole number");
    forged(path, "\"window\":\t1", "\"window\":\t17", "'window' is missing or not a number in 1..16");
    forged(path, "\"window\":\t1", "\"window\":\t16", "");
    forged(path, "\"first\":\t0", "\"first\":\t18", "");
    forged(path, "\"first\":\t0", "\"first\":\t19", "'first' is missing or not a number in 0..18");
    forged(path, "\"support\":\t5", "\"support\":\t0", "'support' is missing or not a number in 1..1.04858e+06");
    forged(path, "\"support\":\t5", "\"support\":\t4",
           "tensor 'coefficient' does not have the shape that the network asks for");
    forged(path, "\"support\":\t5", "\"support\":\t1000", "the file is too small for 1000 vectors");
    forged(path, "\"gamma\":\t0.125", "\"gamma\":\t1e-12", "");
    forged(path, "\"gamma\":\t0.125", "\"gamma\":\t0", "'gamma' is missing or not a number in 1e-12..1e+12");
    forged(path, "\"rho\":\t0.3", "\"rho\":\t-2e12, \"r\":\t0.3", "'rho' is missing or not a number in -1e+12..1e+12");
    forged(path, "\"passes\":\t1", "\"passes\":\t0", "policy: passes = 0 is not in 1..16");
    fill(&b, GGN_SVD_ENTROPY);
    from = cJSON_CreateObject();
    assert_int_equal(ggn_baseline_save(&b, path, GGN_F32, from, NULL), 0);
    cJSON_Delete(from);
    ggn_baseline_release(&b);
    forged(path, "\"width\":\t24,\n\t\"height\":\t24", "\"width\":4000,\"height\":4000",
           "the file is too small for a network of this size");
    forged(path, "\"width\":\t24", "\"width\":\t40", "tensor 'lstm' does not have the shape that the network asks for");
    unlink(path);
}

/* What is seen of a block of another size: of tiles of the own one, row by row; the highest answer speaks, and none is none. */
static void looks_at_tiles(void **state)
{
    (void)state;
    enum { W = 40, H = 30 };
    static uint8_t rgb[3 * W * H], tile[3 * 24 * 24];
    static const int starts[4][2] = {{0, 0}, {16, 0}, {0, 6}, {16, 6}};
    for (int kind = 0; kind < GGN_BASELINES; kind++) {
        static double look[4 * 128], part[128], stale[4 * 128];
        struct ggn_baseline b;
        double highest = -1e30;
        fill(&b, (enum ggn_baseline_kind)kind);
        struct ggn_baseline_reader *r = ggn_baseline_reader_create(&b, NULL);
        for (int i = 0; i < 3 * W * H; i++)
            rgb[i] = (uint8_t)(128.0 + 30.0 * ggn_noise_gauss((uint32_t)i, 5) * (i % W > 20 ? 2 : 1));
        ggn_baseline_extract(r, rgb, W, H, look);
        assert_int_equal(ggn_baseline_feature_count(&b, W, H), 4 * b.features);
        for (int k = 0; k < 4; k++) {
            for (int i = 0; i < 3 * 24 * 24; i++)
                tile[i] = rgb[i / 576 * W * H + (starts[k][1] + i % 576 / 24) * W + starts[k][0] + i % 24];
            ggn_baseline_extract(r, tile, 24, 24, part);
            assert_memory_equal(part, look + k * b.features, (size_t)b.features * sizeof *part);
            memcpy(stale + k * b.features, part, (size_t)b.features * sizeof *part);
            const double *alone[] = {part, part, part};
            highest = fmax(highest, ggn_baseline_logit(r, alone, 24, 24));
        }
        const double *all[] = {look, look, look}, *newest_broken[] = {look, look, stale};
        assert_true(ggn_baseline_logit(r, all, W, H) == highest);
        stale[2 * b.features] = (double)NAN;
        if (kind == GGN_SVD_ENTROPY)
            assert_true(isnan(ggn_baseline_logit(r, newest_broken, W, H)));
        newest_broken[0] = stale;
        assert_true(isnan(ggn_baseline_logit(r, newest_broken, W, H)));
        ggn_baseline_reader_destroy(r);
        ggn_baseline_release(&b);
    }
}

/* --- learning from scenes ------------------------------------------------------------------------------------------------- */

/* Where a row of scores below the cut ends first, else the last level. */
static double stop_of(const struct ggn_method *m, const struct ggn_eval_set *s, const struct ggn_eval_block *b)
{
    int row = 0;
    for (size_t i = b->first; i < b->end; i++) {
        row = m->score[i] < m->cut ? row + 1 : 0;
        if (row >= m->passes)
            return s->spp[i];
    }
    return b->cap;
}

static void put_method(FILE *f, const struct ggn_method *m, const struct ggn_baseline *b, const struct ggn_eval_set *s)
{
    const struct ggn_policy *p = &b->policy;
    fprintf(f, "> %s: passes %d; first %g ratio %g step %g, %d vectors\n", m->name, m->passes, p->first_spp, p->ratio,
            p->step_spp, b->svm.n_support);
    if (!b->lstm) /* in two epochs an LSTM learns nothing that could be told apart */
        fprintf(f, "cut %.5g scale %.4f shift %.4f threshold %.5g\n", m->cut, p->scale, p->shift, p->threshold);
    for (int k = 0; k < s->n_blocks; k++) {
        fprintf(f, "block %d", k);
        if (!b->lstm)
            fprintf(f, " stops at %g", stop_of(m, s, &s->blocks[k]));
        fputc(':', f);
        for (size_t i = s->blocks[k].first; i < s->blocks[k].end; i++)
            fprintf(f, " %.4f", m->score[i]);
        fputc('\n', f);
    }
}

/* All three on two scenes for training, one for validation: scores of every case, calibration, cadence, cut and stops as recorded; what a
 * look is made of, and what cannot be learned. */
static void learned_from_scenes(void **state)
{
    (void)state;
    static const uint32_t levels[] = {4, 8, 16, 32, 64, 128, 256, 512};
    static const double sigma[3][3] = {{0.2, 0.45, 0.8}, {0.3, 0.6, 0.9}, {0.25, 0.5, 0.7}};
    char root[] = "/tmp/ggn_learned.XXXXXX", path[96], *text;
    struct base_threads *threads = base_threads_create(2, NULL);
    struct ggn_eval_set set;
    struct base_err err = {0};
    size_t size;
    int skipped;
    FILE *report = open_memstream(&text, &size);
    assert_non_null(mkdtemp(root));
    for (uint32_t v = 0; v < 3; v++) {
        const struct ggn_noise n = {24, 22, levels, 8, 1024, 0, 0.02, v + 1, 0};
        char scene[8] = {(char)('a' + v), 0};
        snprintf(path, sizeof path, "%s/%s", root, scene);
        ggn_noise_view(path, scene, &n, sigma[v], 3, 200);
    }
    snprintf(path, sizeof path, "%s/split.json", root);
    FILE *f = fopen(path, "w");
    fputs("{\"train\": [\"a\", \"c\"], \"validation\": [\"b\"], \"test\": []}", f);
    fclose(f);
    const struct ggn_eval_options o = {.dir = root, .window = 3, .recorded = 1};
    if (ggn_eval_set_load(&set, &o, threads, &skipped, &err))
        fail_msg("%s", err.text);
    for (int kind = 0; kind < GGN_BASELINES; kind++)
        for (int split = GGN_SPLIT_TRAIN; split <= GGN_SPLIT_TEST; split++) {
            struct ggn_method m;
            struct ggn_baseline b;
            char want[96];
            int rc =
                ggn_method_learned(&m, &b, &set, (enum ggn_baseline_kind)kind, (enum ggn_split)split, 0.2, 2, threads, &err);
            snprintf(want, sizeof want, "%s: the split 'test' lacks one of the classes", ggn_baseline_titles[kind]);
            assert_int_equal(rc, split == GGN_SPLIT_TEST ? BASE_EINVAL : 0);
            if (rc) {
                assert_string_equal(err.text, want);
                assert_true(!b.lstm && !b.svm.values);
                continue;
            }
            assert_true(b.policy.threshold == fmin(m.cut, 1) && b.window == (kind ? 1 : 3));
            put_method(report, &m, &b, &set);
            ggn_method_release(&m);
            ggn_baseline_release(&b);
        }
    fclose(report);
    approve_text("tests/golden/ggn_baseline_learned.txt", text);
    free(text);
    ggn_eval_set_release(&set);
    base_threads_destroy(threads);
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", root);
    assert_int_equal(system(command), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(size),
                                       cmocka_unit_test(gradients),
                                       cmocka_unit_test(learns),
                                       cmocka_unit_test(svm),
                                       cmocka_unit_test(stored),
                                       cmocka_unit_test(lstm_by_equations),
                                       cmocka_unit_test(first_epoch),
                                       cmocka_unit_test(recorded_epochs),
                                       cmocka_unit_test(scores),
                                       cmocka_unit_test(new_baselines),
                                       cmocka_unit_test(described),
                                       cmocka_unit_test(looks_at_tiles),
                                       cmocka_unit_test(learned_from_scenes)};
    return cmocka_run_group_tests_name("baseline_models", tests, NULL, NULL);
}
