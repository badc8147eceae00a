#include "nn/loss.h"

#include <math.h>

double ggn_bce(double logit, double label) { return fmax(logit, 0) - label * logit + log1p(exp(-fabs(logit))); }

double ggn_sigmoid(double logit)
{
    double e = exp(-fabs(logit));
    return logit >= 0 ? 1 / (1 + e) : e / (1 + e);
}

double ggn_bce_grad(double logit, double label) { return ggn_sigmoid(logit) - label; }
