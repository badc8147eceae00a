/*
 * Saving and resuming a training run: a .ggn file of "kind": "checkpoint" with every array that ggn_trainer_state lists, the
 * update counters, and the training loop's own JSON. A resumed run continues bit-exactly.
 */
#ifndef GGN_MODEL_CHECKPOINT_H
#define GGN_MODEL_CHECKPOINT_H

#include "model/model.h"
#include "model/trainer.h"

/* Atomic. `loop` (may be NULL): what the training loop must remember. */
int ggn_checkpoint_save(struct ggn_trainer_f32 *trainer, const struct cJSON *loop, const char *path, struct base_err *err);
/* The trainer must have been made with the same hyper-parameters and parts. On failure it is unchanged. *loop (may be NULL)
 * is the caller's to delete. */
int ggn_checkpoint_load(struct ggn_trainer_f32 *trainer, struct cJSON **loop, const char *path, struct base_err *err);

/* Copies the trainer's parameters and statistics of the networks in `parts` into a model of the same hyper-parameters. */
int ggn_model_from_trainer(struct ggn_model *model, const struct ggn_trainer_f32 *trainer, int parts, struct base_err *err);
/* And back: to continue from a model, with fresh moments. */
int ggn_trainer_from_model(struct ggn_trainer_f32 *trainer, const struct ggn_model *model, int parts, struct base_err *err);

#endif
