/* The support vector machine of two baselines: that it learns, and the formula of its score. */
#include <math.h>
#include <string.h>

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>

#include "support/ggn_near.h"
#include "support/ggn_noise.h"

#include "baselines/svm.h"

static void svm(void **state)
{
    (void)state;
    enum { N = 200, D = 3 };
    static double x[N * D], fresh[D];
    const double *rows[N];
    unsigned char label[N];
    struct ggn_svm s;
    struct base_err err = {0};
    int right = 0;
    for (uint32_t i = 0; i < N; i++) { /* inside or outside a circle; the third feature is constant */
        x[i * D] = 1000.0 * ggn_noise_gauss(i, 1);
        x[i * D + 1] = 0.01 * ggn_noise_gauss(i, 2);
        x[i * D + 2] = 5.0;
        rows[i] = x + i * D;
        label[i] = hypot(x[i * D] / 1000.0, x[i * D + 1] / 0.01) > 1.5;
    }
    assert_int_equal(ggn_svm_train(&s, rows, label, N, D, 1.0, 1.0, &err), 0);
    for (uint32_t i = 0; i < N; i++) {
        fresh[0] = 1000.0 * ggn_noise_gauss(i, 3);
        fresh[1] = 0.01 * ggn_noise_gauss(i, 4);
        fresh[2] = 5.0;
        right += (ggn_svm_score(&s, fresh) > 0.0) == (hypot(fresh[0] / 1000.0, fresh[1] / 0.01) > 1.5);
    }
    assert_true(right > 0.9 * N);
    ggn_svm_release(&s);
    memset(label, 1, sizeof label);
    assert_int_equal(ggn_svm_train(&s, rows, label, N, D, 1.0, 1.0, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "are the same"));
}

/* The formula of the score, on weights that were made up; features standardised by mean and deviation, a constant one not at all. */
static void scores(void **state)
{
    (void)state;
    enum { N = 60, D = 3 };
    double x[N * D], sum[D] = {0}, square[D] = {0};
    const double *rows[N];
    unsigned char label[N];
    struct ggn_svm s;
    struct base_err err = {0};
    for (uint32_t i = 0; i < N; i++) {
        x[i * D] = 100 + 20 * ggn_noise_gauss(i, 1);
        x[i * D + 1] = 0.01 * ggn_noise_gauss(i, 2);
        x[i * D + 2] = 5;
        rows[i] = x + i * D;
        label[i] = x[i * D] > 112; /* few of them: classes weigh the same */
        for (int k = 0; k < D; k++)
            sum[k] += x[i * D + (uint32_t)k] / N;
    }
    for (int i = 0; i < N * D; i++)
        square[i % D] += (x[i] - sum[i % D]) * (x[i] - sum[i % D]) / N;
    assert_int_equal(ggn_svm_train(&s, rows, label, N, D, 1, 1.5, &err), 0);
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
    assert_int_equal(ggn_svm_train(&s, rows, label, N, D, 1, 1, &err), BASE_EINVAL);
    assert_string_equal(err.text, "SVM: all 60 labels are the same");
    assert_int_equal(ggn_svm_init(&s, 256, 0, &err), 0);
    ggn_svm_release(&s);
    assert_int_equal(ggn_svm_init(&s, 257, 1, &err), BASE_EINVAL);
    assert_string_equal(err.text, "SVM of 257 features (1 to 256) and 1 vectors");
    assert_true(ggn_svm_init(&s, 0, 1, &err) == BASE_EINVAL && ggn_svm_init(&s, 1, -1, &err) == BASE_EINVAL && !s.values);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(svm), cmocka_unit_test(scores)};
    return cmocka_run_group_tests_name("baseline_svm", tests, NULL, NULL);
}
