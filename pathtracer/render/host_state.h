/* A criterion's history as bytes, for checkpoints. */
#ifndef PT_RENDER_HOST_STATE_H
#define PT_RENDER_HOST_STATE_H

#include "render/host.h"

/* *data is malloc'ed (caller frees); *size 0 when the criterion keeps no history. */
int pt_criterion_save(const struct pt_criterion *criterion, unsigned char **data, size_t *size, struct base_err *err);
int pt_criterion_load(struct pt_criterion *criterion, const unsigned char *data, size_t size, struct base_err *err);

#endif
