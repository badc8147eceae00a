/*
 * Two sets of thresholds side by side: pairing by view and block, figures.
 */
#ifndef GGN_EVAL_COMPARE_H
#define GGN_EVAL_COMPARE_H

#include <stdio.h>

#include "data/thresholds.h"
#include "figures/stats.h"

struct ggn_pair { /* one view that both sides have; borrows from the two thresholds */
    const struct ggn_view *truth, *model;
    size_t first; /* index of its block 0 in truth_spp */
};

struct ggn_pairing {
    int n_views;
    struct ggn_pair *views; /* owns */
    size_t n;               /* blocks that both sides have */
    double *truth, *model;  /* own; [n] */
};

/* Pairs views of equal name; when the model has a single view, `view` (may be NULL) names its partner, and of two single
 * views one that its file does not name is the other's. Borrows from both until released. */
int ggn_pairing_init(struct ggn_pairing *p, const struct ggn_thresholds *truth, const struct ggn_thresholds *model,
                     const char *view, struct base_err *err);
void ggn_pairing_release(struct ggn_pairing *p);

void ggn_agreement_print_table(FILE *f, const struct ggn_agreement *a);
/* One JSON object, no newline after it. */
void ggn_agreement_print_json(FILE *f, const struct ggn_agreement *a);

/* A line for each block that both sides have, with its place in the view; where neither side knows that, in a square. */
int ggn_compare_write_blocks(const char *path, const struct ggn_pairing *p, struct base_err *err);

#endif
