/*
 * The model observer: stands in for people where there are no human thresholds, and is never called human.
 *
 * Visible noise r (sight/visibility.h) is seen while it exceeds `level`, the one number that is fitted to people
 * (train/calibrate.h). People differ and the observer errs: log2 of the samples at which a viewer stops seeing the noise
 * is taken as normal around its answer, with the deviation `spread`. Pure functions, thread-safe.
 *
 * The observer answers at how many samples no noise is seen at all. The study (SIN3D) asked another question: from how many
 * on a picture looks like one of 10,000 samples, which contains the picture's own; its values are means of three people's
 * answers, none above 10,000. Both bend thresholds towards 10,000. One conversion serves for both: n samples in the study
 * are 1 / (1/n - 1/R) of the observer's, R = 20,000.
 */
#ifndef GGN_OBSERVER_OBSERVER_H
#define GGN_OBSERVER_OBSERVER_H

#include <stddef.h>

#include "base/err.h"
#include "sequence/simulate.h"

/* The criterion's default share of viewers who may still see noise (ggn/sight/README.md says how it was chosen). */
#define GGN_OBSERVER_VISIBLE 0.35

struct ggn_observer {
    double level;
    double spread; /* octaves of samples, > 0 */
};

/* What is used when no other is named; ggn/sight/observer.json says the same and how it came about. */
extern const struct ggn_observer ggn_observer_default;

/* A threshold of the study in samples of the observer; one that is censored there, at SEQ_STUDY_CAP, is SEQ_SIMULATED_CAP.
 * spp > 0. */
double ggn_observer_from_study(double spp);
/* The study's threshold that an answer of the observer stands for, at most SEQ_STUDY_CAP. spp > 0. */
double ggn_observer_to_study(double spp);

/* What the criterion `observer` calls error: visible noise over the level, and one standard error of the pooling more, so
 * that luck in the few pixels of a small block stops nothing: 1 % for 200x200 pixels. */
double ggn_observer_error(const struct ggn_observer *observer, double visible, size_t pixels);
/* Where to ask again about a block whose error falls to stop_error at `predicted` spp: there, but within [1.04, growth]
 * times spp. */
double ggn_observer_next(double spp, double predicted, double growth);
/* Share of viewers who still see noise of `error` times the level: the noise of a mean falls as 1/sqrt(spp), so that an
 * error of 2 is two octaves of samples away. error >= 0. */
double ggn_observer_p_noisy(const struct ggn_observer *observer, double error);
/* Its inverse: the error at which this share of viewers, in (0, 1), sees noise. */
double ggn_observer_error_at(const struct ggn_observer *observer, double share);

/* a such that the logistic 1/(1 + exp(-a log2(error))) says the same at GGN_OBSERVER_VISIBLE, and nearly everywhere else. */
double ggn_observer_slope(const struct ggn_observer *observer);

/* Parameters from a file that ggn_calibration_write made. left_out: the name of a view that may have been fitted: the
 * parameters without it, if it was; NULL: those fitted to all views. */
int ggn_observer_read(const char *path, const char *left_out, struct ggn_observer *observer, struct base_err *err);
/* One line for people and for the card. */
void ggn_observer_describe(const struct ggn_observer *observer, char *text, size_t room);

#endif
