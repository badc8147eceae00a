#include "baselines/svm.h"

#include <math.h>
#include <stdlib.h>

#include <libsvm/svm.h>

void ggn_svm_release(struct ggn_svm *svm)
{
    free(svm->values);
    *svm = (struct ggn_svm){0};
}

size_t ggn_svm_values(const struct ggn_svm *svm)
{
    size_t d = (size_t)svm->features, n = (size_t)svm->n_support;
    return 2 * d + n + n * d;
}

int ggn_svm_init(struct ggn_svm *svm, int features, int n_support, struct base_err *err)
{
    size_t d = (size_t)features;
    *svm = (struct ggn_svm){0};
    if (features < 1 || features > GGN_SVM_FEATURES || n_support < 0)
        return base_fail(err, BASE_EINVAL, "SVM of %d features (1 to %d) and %d vectors", features, GGN_SVM_FEATURES,
                         n_support);
    *svm = (struct ggn_svm){.features = features, .n_support = n_support};
    svm->values = malloc(ggn_svm_values(svm) * sizeof *svm->values);
    if (!svm->values)
        return base_fail_nomem(err, "SVM");
    svm->mean = svm->values;
    svm->scale = svm->mean + d;
    svm->coefficient = svm->scale + d;
    svm->support = svm->coefficient + n_support;
    return 0;
}

static void be_quiet(const char *text) { (void)text; }

/* Mean and 1/deviation of each feature: [features] each. */
static void fit_scale(double *mean, double *scale, const double *const *x, size_t n, size_t features)
{
    for (size_t k = 0; k < features; k++) {
        double sum = 0.0, square = 0.0;
        for (size_t i = 0; i < n; i++)
            sum += x[i][k];
        mean[k] = sum / (double)n;
        for (size_t i = 0; i < n; i++) {
            double d = x[i][k] - mean[k];
            square += d * d;
        }
        double deviation = sqrt(square / (double)n);
        scale[k] = deviation > 1e-12 ? 1.0 / deviation : 0.0;
    }
}

/* Keeps what scoring needs and nothing of libsvm's own. */
static int take_over(struct ggn_svm *svm, const struct svm_model *model, const double *mean, const double *scale,
                     struct svm_node *const *rows, int features, struct base_err *err)
{
    int rc = ggn_svm_init(svm, features, model->l, err);
    if (rc)
        return rc;
    double sign = model->label[0] == 1 ? 1.0 : -1.0;
    svm->gamma = model->param.gamma;
    svm->rho = sign * model->rho[0];
    for (int k = 0; k < features; k++) {
        svm->mean[k] = (float)mean[k];
        svm->scale[k] = (float)scale[k];
    }
    for (int i = 0; i < model->l; i++) {
        const struct svm_node *row = rows[model->sv_indices[i] - 1];
        svm->coefficient[i] = (float)(sign * model->sv_coef[0][i]);
        for (int k = 0; k < features; k++)
            svm->support[(size_t)i * (size_t)features + (size_t)k] = (float)row[k].value;
    }
    return 0;
}

int ggn_svm_train(struct ggn_svm *svm, const double *const *x, const unsigned char *label, size_t n, int features, double c,
                  double gamma, struct base_err *err)
{
    size_t d = (size_t)features, positive = 0;
    struct svm_node *nodes = malloc(n * (d + 1) * sizeof *nodes), **rows = malloc((n > 0 ? n : 1) * sizeof *rows);
    double *y = malloc((n > 0 ? n : 1) * sizeof *y), *mean = malloc(2 * d * sizeof *mean);
    int rc = 0;
    *svm = (struct ggn_svm){0};
    if (!nodes || !rows || !y || !mean) {
        rc = base_fail_nomem(err, "SVM");
        goto out;
    }
    fit_scale(mean, mean + d, x, n, d);
    for (size_t i = 0; i < n; i++) {
        rows[i] = nodes + i * (d + 1);
        y[i] = label[i] != 0;
        positive += label[i] != 0;
        for (size_t k = 0; k < d; k++)
            rows[i][k] = (struct svm_node){(int)k + 1, (x[i][k] - mean[k]) * mean[d + k]};
        rows[i][d].index = -1;
    }
    if (positive == 0 || positive == n) {
        rc = base_fail(err, BASE_EINVAL, "SVM: all %zu labels are the same", n);
        goto out;
    }
    /* The rarer label weighs more, so that "always noisy" is no good answer where few windows are clean. */
    int labels[2] = {1, 0};
    double weights[2] = {0.5 * (double)n / (double)positive, 0.5 * (double)n / (double)(n - positive)};
    struct svm_problem problem = {.l = (int)n, .y = y, .x = rows};
    struct svm_parameter parameter = {.svm_type = C_SVC,
                                      .kernel_type = RBF,
                                      .gamma = gamma / features,
                                      .C = c,
                                      .cache_size = 100,
                                      .eps = 1e-3,
                                      .shrinking = 1,
                                      .nr_weight = 2,
                                      .weight_label = labels,
                                      .weight = weights};
    svm_set_print_string_function(be_quiet);
    struct svm_model *model = svm_train(&problem, &parameter);
    rc = !model ? base_fail_nomem(err, "SVM") : take_over(svm, model, mean, mean + d, rows, features, err);
    if (model)
        svm_free_and_destroy_model(&model);
out:
    free(mean);
    free(y);
    free(rows);
    free(nodes);
    return rc;
}

double ggn_svm_score(const struct ggn_svm *svm, const double *x)
{
    size_t d = (size_t)svm->features;
    double z[GGN_SVM_FEATURES], sum = 0.0;
    for (size_t k = 0; k < d; k++)
        z[k] = (x[k] - (double)svm->mean[k]) * (double)svm->scale[k];
    for (int i = 0; i < svm->n_support; i++) {
        const float *support = svm->support + (size_t)i * d;
        double distance = 0.0;
        for (size_t k = 0; k < d; k++)
            distance += (z[k] - (double)support[k]) * (z[k] - (double)support[k]);
        sum += (double)svm->coefficient[i] * exp(-svm->gamma * distance);
    }
    return sum - svm->rho;
}
