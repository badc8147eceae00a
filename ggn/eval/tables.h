/* What an evaluation says: table, JSON, stops. */
#ifndef GGN_EVAL_TABLES_H
#define GGN_EVAL_TABLES_H

#include <stdio.h>

#include "eval/method.h"

struct cJSON;

/* Every method's figures, and how far the observer is off without half buffers. BASE_ENOMEM only. */
int ggn_report_table(FILE *f, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *methods,
                     const struct ggn_method_metrics *metrics, int n, struct base_err *err);
/* People's views one by one: for each method the median of |log2(stop/threshold)| over blocks whose thresholds are no caps,
 * and the share of blocks stopped below 0.8 of theirs. BASE_ENOMEM only. */
int ggn_report_people(FILE *f, const struct ggn_eval_set *s, const struct ggn_method *methods, int n, struct base_err *err);
/* An object with one member per method; NULL: out of memory. */
void ggn_report_json(struct cJSON *to, const struct ggn_method *methods, const struct ggn_method_metrics *metrics, int n,
                     int *failed);

/* The stops of one split as DIR/SPLIT-stops-K.csv for each method. */
int ggn_report_stops(const char *dir, const struct ggn_eval_set *s, enum ggn_split split, const struct ggn_method *methods,
                     int n, struct base_err *err);

#endif
