/*
 * Writing a block's sequence: it is built in memory and then written whole. The form on disk is FORMAT.md beside
 * this file. Not thread-safe per object.
 */
#ifndef SEQUENCE_BUILDER_H
#define SEQUENCE_BUILDER_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "sequence/block.h"

struct seq_builder {
    uint32_t width, height, n_records, has_reference;
    uint8_t *bytes; /* owns */
    size_t size, room;
};

struct seq_frame { /* what to add; NULL planes are left out; all borrowed during the call */
    uint32_t spp, half_spp;
    int is_reference, full;    /* full: f16 planes instead of FINE and HALF_LOG (always for the reference) */
    const uint8_t *display;    /* [3][P]; NULL: the codes of mean */
    const double *mean, *half; /* [3][P], linear, finite: mean, and half-buffer difference D */
    const struct seq_stat *stats;
    uint32_t n_stats;
};

int seq_builder_init(struct seq_builder *w, uint32_t width, uint32_t height, int32_t x0, int32_t y0, uint32_t id,
                     uint64_t seed, struct base_err *err);
/* Levels in rising spp, the reference last. */
int seq_builder_add(struct seq_builder *w, const struct seq_frame *frame, struct base_err *err);
/* Writes the file atomically; *crc gets the CRC of the whole file. */
int seq_builder_write(struct seq_builder *w, const char *path, uint32_t *crc, struct base_err *err);
void seq_builder_release(struct seq_builder *w);

#endif
