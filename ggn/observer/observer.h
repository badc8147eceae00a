/*
 * The model observer: stands in for people where there are no human thresholds, and is never called human.
 *
 * Noise of visibility v (observer/visibility.h) in a block of texture s is seen while v exceeds the limit level * (s +
 * 2)^exponent: busy pictures hide noise. The two parameters are fitted to people (observer/calibrate.h). People differ and
 * the observer errs: log2 of the samples at which a viewer stops seeing the noise is taken as normal around its answer, with
 * the deviation `spread`. Pure functions, thread-safe.
 */
#ifndef GGN_OBSERVER_OBSERVER_H
#define GGN_OBSERVER_OBSERVER_H

#include <stddef.h>

#include "base/err.h"

#define GGN_OBSERVER_OFFSET 2.0 /* L*: texture far below it hides nothing */

struct ggn_observer {
    double level, exponent;
    double spread; /* octaves of samples, > 0 */
};

/* What is used when no other is named; ggn/observer/observer.json says the same and how it came about. */
extern const struct ggn_observer ggn_observer_default;

/* The visible noise at which people stop seeing it in a block of this texture. */
double ggn_observer_limit(const struct ggn_observer *observer, double texture);
/* What the criterion `observer` calls error: visible noise over its limit, and one standard error of the pooling more, so
 * that luck in
 * the few pixels of a small block stops nothing: 0.7 % for 200x200 pixels. */
double ggn_observer_error(const struct ggn_observer *observer, double visible, double texture, size_t pixels);
/* Where to ask again about a block whose error falls to stop_error at `predicted` spp: there, but within [1.04, growth]
 * times spp. */
double ggn_observer_next(double spp, double predicted, double growth);
/* Share of viewers who still see noise of `error` times the limit: the noise of a mean falls as 1/sqrt(spp), so that an
 * error of
 * 2 is two octaves of samples away. error >= 0. */
double ggn_observer_p_noisy(const struct ggn_observer *observer, double error);
/* Its inverse: the error at which this share of viewers, in (0, 1), sees noise. */
double ggn_observer_error_at(const struct ggn_observer *observer, double share);

/* Parameters from a file that ggn_calibration_write made. left_out: the name of a view that may have been fitted: the
 * parameters without it, if it was; NULL: those fitted to all views. */
int ggn_observer_read(const char *path, const char *left_out, struct ggn_observer *observer, struct base_err *err);
/* One line for people and for the card. */
void ggn_observer_describe(const struct ggn_observer *observer, char *text, size_t room);

#endif
