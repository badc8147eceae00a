/*
 * The criterion "ggn" between its contract with the host (ggn.c) and its verdict on one block (verdict.c). Private to both.
 */
#ifndef GGN_PLUGIN_GGN_H
#define GGN_PLUGIN_GGN_H

#include <lull/criterion_kit.h>

#include "model/judge.h"
#include "model/preprocess.h"
#include "model/window.h"
#include "plugin/history.h"

struct gp_worker {
    struct ggn_judge *judge;
    double *noise;    /* [pixels of the largest block], for the tail guard */
    uint8_t *picture; /* [pixels of the largest block], for models with the noise picture */
};

struct lull_instance {
    struct lull_kit kit;
    struct ggn_model *model;
    struct ggn_stop_rule rule; /* the model's policy, with the parameters over it */
    enum ggn_precision precision;
    uint32_t key; /* of saved state: a hash of model and policy */
    struct ggn_display display;
    struct gp_history history; /* of the open frame */
    uint32_t workers;
    struct gp_worker *worker;
};

/* Fills in->history.pending[b->id] with the verdict on a checked block; the same block at the same spp again keeps its
 * verdict. Tasks on different blocks may run at the same time, each with its own worker < in->workers. */
void gp_verdict(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, uint32_t worker);

#endif
