/* The end of a training: calibration and stopping policy on the validation scenes, the model file and its card. */
#ifndef GGN_TRAIN_FINISH_H
#define GGN_TRAIN_FINISH_H

#include "train/session.h"

/* The session holds the weights of the best epoch. */
int ggn_session_finish(struct ggn_session *session, struct base_err *err);

#endif
