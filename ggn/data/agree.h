/* What processes that work on the same data must have alike, so that their shares fit together. */
#ifndef GGN_DATA_AGREE_H
#define GGN_DATA_AGREE_H

#include "job/job.h"
#include "data/series.h"

/* CRC-32 of the images and labels. */
uint32_t ggn_series_set_crc(const struct ggn_series_set *set);

/* The handshake of a job (job/job.h) with what makes its processes compute the same: refuses (BASE_EINVAL) one of another
 * version, with vectors of another length, with other images or labels, or other bytes in files[n_files]. Nothing without
 * a job. */
int ggn_agree(struct job *job, const struct ggn_series_set *set, const char *const *files, int n_files, int threads,
              struct base_err *err);

#endif
