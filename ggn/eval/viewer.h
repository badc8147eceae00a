/* A trained model's view of the windows of recorded blocks. One thread at a time. */
#ifndef GGN_EVAL_VIEWER_H
#define GGN_EVAL_VIEWER_H

#include "data/series.h"
#include "model/inference.h"
#include "model/stopper.h"

struct ggn_viewer {
    struct ggn_inference *inference;       /* owns */
    enum ggn_precision precision;          /* of it */
    const struct ggn_series_set *set;      /* borrows */
    const struct ggn_level_series *series; /* borrows; the block */
    const double *law;                     /* borrows; [levels] of a residual model: log2 of the law's error */
    int window, noise_maps;                /* images of a window; whether the model takes the noise maps of the set */
    uint16_t *denoised[GGN_WINDOW_MAX];    /* [3][H][W] each; one allocation, owned */
    int holds[GGN_WINDOW_MAX];             /* the level that is in it, -1: none */
};

int ggn_viewer_init(struct ggn_viewer *v, const struct ggn_model *model, enum ggn_precision precision,
                    const struct ggn_series_set *set, struct base_err *err);
void ggn_viewer_release(struct ggn_viewer *v);

/* Turns to a block; images of the one before are forgotten. */
void ggn_viewer_turn(struct ggn_viewer *v, const struct ggn_level_series *series);
/* viewer: a struct ggn_viewer. Logit of the window of these levels, noisiest first. */
double ggn_viewer_logit(void *viewer, const int *levels);

#endif
