/*
 * OUT.ckpt: everything that continuing a run bit-exactly needs, as a .ggn file (model/container.h): the arrays that a phase
 * changes as tensors "0", "1", …, progress, optimiser counts and learning curves as JSON of "kind": "training".
 */
#ifndef GGN_TRAIN_RESUME_H
#define GGN_TRAIN_RESUME_H

#include "train/session.h"

int ggn_resume_save(struct ggn_session *session, const char *path, struct base_err *err);
/* The phase first, so that the session can make the trainer of that phase; then the numbers. */
int ggn_resume_phase(const char *path, int *phase, struct base_err *err);
int ggn_resume_load(struct ggn_session *session, const char *path, struct base_err *err);

#endif
