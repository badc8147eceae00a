/* What processes that work on the same data must have alike, so that their shares make what one process makes. */
#ifndef GGN_DATA_AGREE_H
#define GGN_DATA_AGREE_H

#include "base/team.h"
#include "data/chains.h"

/* Refuses (BASE_EINVAL) a process of another version, with vectors of another length (they add in another order), with
 * other images or labels, other bytes in files[n_files] or other options (any number that stands for them). Nothing without
 * team. */
int ggn_agree(struct base_team *team, const struct ggn_chains *set, const char *const *files, int n_files, uint32_t options,
              struct base_err *err);

#endif
