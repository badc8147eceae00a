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
#include "sight/measure.h"
#include "sight/preprocess.h"

/* One block at one check. */
struct gp_block_view {
    struct lull_instance *in;
    const struct lull_view *view;
    const struct lull_block *block;
    struct gp_head *head;
    void *worker;
};

/* What such a criterion keeps of a block and computes from it; static. Its GP_CRITERION has gp_windowed_rule and this, its
 * first parameter is the file of the model. */
struct gp_block_view_ops {
    const char *model, *variable; /* MODEL.ggn by default, or what this variable names (NULL: none) */
    int kind;                     /* for load */
    /* Reads the model file: in->model, in->rule, gp_windowed_ready. What it made before it failed is destroyed. */
    int32_t (*load)(struct lull_instance *in, const char *path, struct lull_error *err);
    /* What its slots hold; of: the instance. */
    struct gp_slot (*slot)(const void *of, int32_t width, int32_t height);
    /* Scratch of one worker, of zeros, for blocks that `room` has been made for; a failure may leave it half made. */
    size_t worker_size;
    int (*worker_init)(void *worker, const struct lull_instance *in, const struct ggn_meter_room *room,
                       struct base_err *err);
    void (*worker_release)(void *worker);
    void (*model_destroy)(void *model); /* NULL is allowed */
    /* Measures the block as it is now, before it is read or judged. NULL: nothing is measured. */
    void (*measure)(const struct gp_block_view *seen);
    /* Puts what is kept of the block's image into `slot`; returns how many values of it were broken. */
    long (*read)(const struct gp_block_view *seen, uint32_t slot);
    struct ggn_evidence evidence; /* its functions are given a struct gp_block_view */
};

struct gp_windowed_frame {
    struct gp_history history;
    struct gp_history means; /* with rule.reach, without HALF */
    uint32_t workers;
    unsigned char *worker; /* owns; [workers][ops->worker_size] */
    const struct gp_block_view_ops *ops;
    atomic_flag warned; /* of planes that say nothing about noise: once per frame */
    atomic_flag late;   /* of checks that are too far apart: likewise */
};

struct lull_instance {
    struct lull_kit kit;
    const struct gp_block_view_ops *ops;
    void *model;               /* owns, by ops->model_destroy */
    struct ggn_stop_rule rule; /* the model's policy, with the parameters over it */
    uint32_t key;              /* of saved state: a hash of model and policy */
    struct gp_windowed_frame frame;
};

extern const struct gp_rule gp_windowed_rule;

/* The end of ops->load: parameters over the policy, requirements, the key. width, height: blocks that the model was made
 * for. */
void gp_windowed_ready(struct lull_instance *in, const struct lull_param *params, uint32_t count, int width, int height);
/* Part of the key: any bytes that decide about answers. */
void gp_windowed_hash(struct lull_instance *in, const void *data, size_t size);
/* Display codes of the block, [3][height][width]; returns how many values were broken. */
long gp_windowed_read(const struct gp_block_view *seen, uint8_t *out);

/* Where the criterion finds its model when no parameter names one: the first of these that exists goes into path: the one
 * that the environment variable names (NULL: none); a file of this name beside the shared object; share/lull of the prefix
 * that it is installed in; ggn/models of the source tree that it was built in. Without any, returns 0 and path holds the
 * list of places for the message. */
int gp_model_find(const char *name, const char *variable, char *path, size_t room);

#endif
