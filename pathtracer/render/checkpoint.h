/*
 * A render in the middle, as a file: film, blocks, totals and the criterion's history. Continued from it, the image is
 * byte for byte that of a render that was never interrupted. The file is replaced atomically, guarded by a CRC, and
 * holds the identity as text: it is refused (BASE_EINVAL, saying which key) by a render whose samples are others.
 * Limits of samples and the criterion's parameters may differ (pt_render_go_on). Byte order and number formats are those
 * of the machine: a checkpoint is not for exchange.
 */
#ifndef PT_RENDER_CHECKPOINT_H
#define PT_RENDER_CHECKPOINT_H

#include "base/err.h"
#include "base/files.h"
#include "base/identity.h"
#include "render/render.h"

extern const struct base_file_kind pt_checkpoint_kind;

/* identity: what the image depends on, made by the caller; compared when loading. */
int pt_checkpoint_save(const char *path, const struct pt_render *render, const struct base_identity *identity,
                       struct base_err *err);
/* Into a freshly created render of the same identity; on failure it must not be run. */
int pt_checkpoint_load(const char *path, struct pt_render *render, const struct base_identity *identity,
                       struct base_err *err);

#endif
