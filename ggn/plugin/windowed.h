/*
 * Criteria that judge a window of a block's last images by the one stopping rule (model/stopper.h): the whole contract with
 * the host but for their parameters, their model and what they keep of an image. ggn and the baselines are such criteria.
 *
 * The instance's history is kept only if a whole evaluate call has succeeded; a block asked about again at the same spp gets
 * the same answer. Tasks on different blocks may run at the same time, each with its own worker.
 */
#ifndef GGN_PLUGIN_WINDOWED_H
#define GGN_PLUGIN_WINDOWED_H

#include "plugin/criteria.h"
#include "plugin/history.h"
#include "plugin/means.h"

#include <stdatomic.h>

#include "base/err.h"
#include "model/measure.h"
#include "model/preprocess.h"

/* One block at one check. */
struct gp_block_view {
    struct lull_instance *in;
    const struct lull_view *view;
    const struct lull_block *block;
    struct gp_head *head;
    void *worker;
};

/* What such a criterion keeps of a block and computes from it; static. */
struct gp_block_view_ops {
    const char *model,
        *variable; /* MODEL.ggn by default (NULL: named as the criterion), or what this variable names (NULL: none) */
    /* Reads the model file: in->model, in->rule, gp_windowed_ready. What it made before it failed is destroyed. */
    int32_t (*load)(struct lull_instance *in, int kind, const char *path, struct lull_error *err);
    /* What its slots hold; of: the instance. */
    struct gp_slot (*slot)(const void *of, int32_t width, int32_t height);
    /* Scratch of one worker for blocks that `room` has been made for. NULL on failure. */
    void *(*worker_create)(const struct lull_instance *in, const struct ggn_meter_room *room, struct base_err *err);
    void (*worker_destroy)(void *worker); /* NULL is allowed */
    void (*model_destroy)(void *model);   /* NULL is allowed */
    /* Measures the block as it is now, before it is read or judged. NULL: nothing is measured. */
    void (*measure)(const struct gp_block_view *seen);
    /* Puts what is kept of the block's image into `slot`; returns how many values of it were broken. */
    long (*read)(const struct gp_block_view *seen, uint32_t slot);
    struct ggn_evidence evidence; /* its functions are given a struct gp_block_view */
};

struct lull_instance {
    struct lull_kit kit;
    const struct gp_block_view_ops *ops;
    void *model;               /* owns, by ops->model_destroy */
    struct ggn_stop_rule rule; /* the model's policy, with the parameters over it */
    uint32_t key;              /* of saved state: a hash of model and policy */
    struct ggn_display display;
    struct gp_history history; /* of the open frame */
    struct gp_means means;     /* likewise; with rule.reach, without HALF */
    atomic_flag warned;        /* of planes that say nothing about noise: once per frame */
    atomic_flag late;          /* of checks that are too far apart: likewise */
    uint32_t workers;
    void **worker;
};

/* create of such a criterion, whose first parameter is the file of its model. kind: for ops->load. */
int32_t gp_windowed_create(const struct gp_block_view_ops *ops, int kind, const struct lull_criterion *table,
                           const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                           uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err);
/* The end of ops->load: parameters over the policy, requirements, the key. width, height: blocks that the model was made
 * for. */
void gp_windowed_ready(struct lull_instance *in, const struct lull_param *params, uint32_t count, int width, int height);
/* Part of the key: any bytes that decide about answers. */
void gp_windowed_hash(struct lull_instance *in, const void *data, size_t size);
/* Display codes of the block, [3][height][width]; returns how many values were broken. */
long gp_windowed_read(const struct gp_block_view *seen, uint8_t *out);

int32_t gp_windowed_begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err);
int32_t gp_windowed_evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                             uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride,
                             uint32_t count, struct lull_error *err);
void gp_windowed_end_frame(struct lull_instance *in);
void gp_windowed_destroy(struct lull_instance *in);
const void *gp_windowed_get_extension(const char *id);

/* Table of such a criterion; see GP_TABLE. */
#define GP_WINDOWED_TABLE(...) \
    GP_TABLE(.version = "1.0", .begin_frame = gp_windowed_begin_frame, .evaluate = gp_windowed_evaluate, \
             .end_frame = gp_windowed_end_frame, .destroy = gp_windowed_destroy, \
             .get_extension = gp_windowed_get_extension, __VA_ARGS__)

#endif
