/* The LSTM of the SVD-entropy baseline: its size, its gradients, its equations, and that it learns. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/approve.h"
#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "baselines/lstm.h"

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

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(size),        cmocka_unit_test(gradients),
                                       cmocka_unit_test(learns),      cmocka_unit_test(lstm_by_equations),
                                       cmocka_unit_test(first_epoch), cmocka_unit_test(recorded_epochs)};
    return cmocka_run_group_tests_name("baseline_lstm", tests, NULL, NULL);
}
