/* What every process of a job must agree about before work begins. */
#ifndef PT_AGREE_H
#define PT_AGREE_H

#include "open.h"

/* What every process of a job must have alike: the version, the identity, the model that the criterion starts with. */
int pt_agree_identity(const struct pt_open *open, struct base_identity *to, struct base_err *err);
/* Every process of a job, ready to begin: rank 0 waits for all and refuses those that differ. Nothing without a job. */
int pt_agree_handshake(const struct pt_open *open, struct job *job, struct base_err *err);

#endif
