#include "sight/observer.h"

#include <math.h>

static const double STUDY_REFERENCE = 20000.0; /* R */

const struct ggn_observer ggn_observer_default = {.level = 0.261835, .spread = 0.437111};

double ggn_observer_from_study(double spp)
{
    return spp >= SEQ_STUDY_CAP ? SEQ_SIMULATED_CAP : 1.0 / (1.0 / spp - 1.0 / STUDY_REFERENCE);
}

double ggn_observer_to_study(double spp) { return fmin(1.0 / (1.0 / spp + 1.0 / STUDY_REFERENCE), SEQ_STUDY_CAP); }

/* Standard error of the pooled Gaussian noise of P pixels is this over sqrt(P), as a share of it: a sixth moment scatters by
 * sqrt(10170)/15, its root by a sixth of that, and the blur leaves about a third of the pixels independent. */
static const double POOLING_ERROR = 1.94;

double ggn_observer_error(const struct ggn_observer *o, double visible, size_t pixels)
{
    return (1.0 + POOLING_ERROR / sqrt((double)pixels)) * visible / o->level;
}

double ggn_observer_next(double spp, double predicted, double growth)
{
    return fmin(fmax(predicted, 1.04 * spp), growth * spp);
}

double ggn_observer_p_noisy(const struct ggn_observer *o, double error)
{
    return error > 0.0 ? 0.5 * erfc(-2.0 * log2(error) / (o->spread * sqrt(2.0))) : 0.0;
}

double ggn_observer_slope(const struct ggn_observer *o)
{
    const double share = GGN_OBSERVER_VISIBLE;
    return log(share / (1.0 - share)) / log2(ggn_observer_error_at(o, share));
}

double ggn_observer_error_at(const struct ggn_observer *o, double share)
{
    double below = 1e-6, above = 1e6; /* errors; bisected in octaves */
    for (int i = 0; i < 60; i++) {
        double middle = sqrt(below * above);
        if (ggn_observer_p_noisy(o, middle) < share)
            below = middle;
        else
            above = middle;
    }
    return sqrt(below * above);
}
