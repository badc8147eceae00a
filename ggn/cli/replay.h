/*
 * Recorded blocks replayed through what a command line names: models, baselines, thresholds from files. What `ggn evaluate`
 * and `ggn cost` have in common.
 *
 * Fill the first part in, open, make the methods in any order, close after all of them. One thread at a time.
 */
#ifndef GGN_CLI_REPLAY_H
#define GGN_CLI_REPLAY_H

#include "eval/trained.h"

enum { GGN_REPLAY_FILES = 16 };

struct ggn_replay_options {      /* of a command line; borrows */
    const char *data, *observer; /* observer NULL: built in */
    const char *models[GGN_REPLAY_FILES], *baselines[GGN_REPLAY_FILES], *thresholds[GGN_REPLAY_FILES];
    int n_models, n_baselines, n_thresholds, threads, no_quality, recorded, no_halves;
    double ratio;
};

struct ggn_replay {
    const struct ggn_replay_options *o; /* borrows */
    /* what the command changes of the policy of a model or a baseline */
    void (*adjust)(const void *command, struct ggn_policy *policy);
    const void *command;

    struct base_threads *threads;                  /* owns */
    struct ggn_model *model[GGN_REPLAY_FILES];     /* own; [n_models] */
    const struct cJSON *learned[GGN_REPLAY_FILES]; /* borrow; the data that each was made with */
    struct ggn_eval_set set;                       /* owns */
    int skipped;                                   /* views without labels */
};

/* Loads the models, and the data set as `options`, the command line and the models want it: noise pictures and measures
 * where one takes them, windows of the longest one's images, and of least_window at least. options->window: where there is
 * no model. Close it after a failure, too. */
int ggn_replay_open(struct ggn_replay *r, struct ggn_eval_options *options, int least_window, struct base_err *err);
void ggn_replay_close(struct ggn_replay *r);

/* The policy that a model is replayed by. */
int ggn_replay_policy(const struct ggn_replay *r, int model, struct ggn_policy *policy, struct base_err *err);
/* Methods, which the caller releases: a model; a baseline, and what it is; the thresholds of a file, which has to have all
 * views of `split`. */
int ggn_replay_model(const struct ggn_replay *r, int model, const char *name, enum ggn_precision precision,
                     struct ggn_method *m, struct base_err *err);
int ggn_replay_baseline(const struct ggn_replay *r, int baseline, struct ggn_method *m, int *kind, struct base_err *err);
int ggn_replay_thresholds(const struct ggn_replay *r, int file, enum ggn_split split, struct ggn_method *m,
                          struct base_err *err);

#endif
