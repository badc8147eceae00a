#include "baselines/svm.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include <libsvm/svm.h>

struct ggn_svm {
    int features;
    double gamma, rho, sign;
    size_t n_support;
    double *support;     /* [n_support][features], standardised */
    double *coefficient; /* [n_support] */
    double *mean, *scale; /* [features] */
};

void ggn_svm_destroy(struct ggn_svm *svm)
{
    if (!svm)
        return;
    free(svm->support);
    free(svm->coefficient);
    free(svm->mean);
    free(svm);
}

static void be_quiet(const char *text)
{
    (void)text;
}

static void fit_scale(struct ggn_svm *svm, const double *x, size_t n)
{
    for (int k = 0; k < svm->features; k++) {
        double sum = 0.0, square = 0.0;
        for (size_t i = 0; i < n; i++)
            sum += x[i * (size_t)svm->features + (size_t)k];
        svm->mean[k] = sum / (double)n;
        for (size_t i = 0; i < n; i++) {
            double d = x[i * (size_t)svm->features + (size_t)k] - svm->mean[k];
            square += d * d;
        }
        double deviation = sqrt(square / (double)n);
        svm->scale[k] = deviation > 1e-12 ? 1.0 / deviation : 0.0;
    }
}

/* Keeps what scoring needs and nothing of libsvm's own. */
static int take_over(struct ggn_svm *svm, const struct svm_model *model, const double *x, struct base_err *err)
{
    size_t n = (size_t)model->l, d = (size_t)svm->features;
    svm->support = malloc((n > 0 ? n : 1) * d * sizeof *svm->support);
    svm->coefficient = malloc((n > 0 ? n : 1) * sizeof *svm->coefficient);
    if (!svm->support || !svm->coefficient)
        return base_fail_nomem(err, "SVM");
    svm->n_support = n;
    svm->rho = model->rho[0];
    svm->sign = model->label[0] == 1 ? 1.0 : -1.0;
    for (size_t i = 0; i < n; i++) {
        size_t from = (size_t)model->sv_indices[i] - 1;
        svm->coefficient[i] = model->sv_coef[0][i];
        for (size_t k = 0; k < d; k++)
            svm->support[i * d + k] = (x[from * d + k] - svm->mean[k]) * svm->scale[k];
    }
    return 0;
}

struct ggn_svm *ggn_svm_train(const double *x, const unsigned char *label, size_t n, int features, double c, double gamma,
                              struct base_err *err)
{
    size_t d = (size_t)features, positive = 0;
    struct ggn_svm *svm = calloc(1, sizeof *svm);
    struct svm_node *nodes = malloc(n * (d + 1) * sizeof *nodes), **rows = malloc((n > 0 ? n : 1) * sizeof *rows);
    double *y = malloc((n > 0 ? n : 1) * sizeof *y);
    int rc = 0;
    if (svm)
        svm->mean = malloc(2 * d * sizeof *svm->mean);
    if (!svm || !nodes || !rows || !y || !svm->mean) {
        rc = base_fail_nomem(err, "SVM");
        goto out;
    }
    svm->scale = svm->mean + d;
    svm->features = features;
    svm->gamma = gamma / features;
    fit_scale(svm, x, n);
    for (size_t i = 0; i < n; i++) {
        rows[i] = nodes + i * (d + 1);
        y[i] = label[i] != 0;
        positive += label[i] != 0;
        for (size_t k = 0; k < d; k++)
            rows[i][k] = (struct svm_node){(int)k + 1, (x[i * d + k] - svm->mean[k]) * svm->scale[k]};
        rows[i][d].index = -1;
    }
    if (positive == 0 || positive == n) {
        rc = base_fail(err, BASE_EINVAL, "SVM: all %zu labels are the same", n);
        goto out;
    }
    int labels[2] = {1, 0};
    double weights[2] = {0.5 * (double)n / (double)positive, 0.5 * (double)n / (double)(n - positive)};
    struct svm_problem problem = {.l = (int)n, .y = y, .x = rows};
    struct svm_parameter parameter = {.svm_type = C_SVC, .kernel_type = RBF, .gamma = svm->gamma, .C = c, .cache_size = 100,
                                      .eps = 1e-3, .shrinking = 1,
                                      .nr_weight = 2, .weight_label = labels, .weight = weights};
    svm_set_print_string_function(be_quiet);
    struct svm_model *model = svm_train(&problem, &parameter);
    rc = !model ? base_fail_nomem(err, "SVM") : take_over(svm, model, x, err);
    if (model)
        svm_free_and_destroy_model(&model);
out:
    free(y);
    free(rows);
    free(nodes);
    if (rc) {
        ggn_svm_destroy(svm);
        return NULL;
    }
    return svm;
}

double ggn_svm_score(const struct ggn_svm *svm, const double *x, double *scratch)
{
    size_t d = (size_t)svm->features;
    double sum = 0.0;
    for (size_t k = 0; k < d; k++)
        scratch[k] = (x[k] - svm->mean[k]) * svm->scale[k];
    for (size_t i = 0; i < svm->n_support; i++) {
        double distance = 0.0;
        for (size_t k = 0; k < d; k++) {
            double t = scratch[k] - svm->support[i * d + k];
            distance += t * t;
        }
        sum += svm->coefficient[i] * exp(-svm->gamma * distance);
    }
    return svm->sign * (sum - svm->rho);
}
