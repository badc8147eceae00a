/*
 * The criteria of ggn.so, in the order of lull_criterion_entry_v1's index.
 *
 * One file per criterion defines its table; to add one, declare it here and append it to the list in entry.c (an index, once
 * released, keeps its criterion).
 */
#ifndef GGN_PLUGIN_CRITERIA_H
#define GGN_PLUGIN_CRITERIA_H

#include <lull/criterion.h>

extern const struct lull_criterion ggn_plugin_ggn;      /* id "ggn" */
extern const struct lull_criterion ggn_plugin_observer; /* id "observer" */

#endif
