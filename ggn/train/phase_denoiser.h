/* Phase 0 of preset lull: the denoiser, on crops of noisy images and their references. */
#ifndef GGN_TRAIN_PHASE_DENOISER_H
#define GGN_TRAIN_PHASE_DENOISER_H

#include "train/session.h"

/* checkpoint: where to continue from, or NULL. Leaves the denoiser in session->r. */
int ggn_phase_denoiser(struct ggn_session *session, const char *checkpoint, struct base_err *err);

#endif
