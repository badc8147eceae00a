/*
 * Block sequences: one block of one view at rising sample counts, and its reference. The form on disk is FORMAT.md beside
 * this file.
 *
 * A parsed block owns the file's bytes; pixels are inflated on demand, so that a block costs what its file costs. Everything
 * read is checked (sizes, CRCs, order of levels) before it is believed. Thread-safe for reading after parsing.
 */
#ifndef SEQUENCE_BLOCK_H
#define SEQUENCE_BLOCK_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "sequence/record.h"

enum { SEQ_MAX_SIDE = 4096, SEQ_MAX_RECORDS = 4096 };

struct seq_block {
    uint32_t width, height, id;
    int32_t x0, y0;
    uint64_t seed;
    uint32_t n_levels;
    struct seq_record *levels;    /* owns; spp strictly rising; at least one */
    struct seq_record *reference; /* inside levels' allocation; NULL if the file has none */
    uint8_t *bytes;               /* owns */
    size_t size;
};

/* Takes ownership of bytes (malloc) on success only. `path` is for messages. */
int seq_block_parse(const char *path, uint8_t *bytes, size_t size, struct seq_block *block, struct base_err *err);
int seq_block_read(const char *path, struct seq_block *block, struct base_err *err);
void seq_block_release(struct seq_block *block);

/* Pixels of one record. P = width*height. Errors: BASE_EINVAL when the plane is missing or does not inflate to its size. */
int seq_display_planar(const struct seq_block *b, const struct seq_record *r, uint8_t *rgb /* [3][P] */,
                       struct base_err *err);
int seq_display(const struct seq_block *b, const struct seq_record *r, uint8_t *rgb /* [P][3] */, struct base_err *err);
/* Linear mean, finite. From MEAN_F16, else DISPLAY + FINE, else DISPLAY alone (then within half a code, and at most 1). */
int seq_mean(const struct seq_block *b, const struct seq_record *r, float *rgb /* [3][P] */, struct base_err *err);
int seq_mean_luminance(const struct seq_block *b, const struct seq_record *r, float *y /* [P] */, struct base_err *err);
/* Linear half-buffer difference D: luminance from HALF_F16 or HALF_LOG; all channels from HALF_F16 only. */
int seq_half_luminance(const struct seq_block *b, const struct seq_record *r, float *y /* [P] */, struct base_err *err);
int seq_half(const struct seq_block *b, const struct seq_record *r, float *rgb /* [3][P] */, struct base_err *err);
/* Is the half-buffer difference there, of all channels or of the luminance alone? */
int seq_has_halves(const struct seq_record *r);
/* The level whose half-buffer difference is of all channels; NULL: none. */
const struct seq_record *seq_full_level(const struct seq_block *b);
/* The level with this spp, or NULL. */
const struct seq_record *seq_level(const struct seq_block *b, uint32_t spp);

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

#endif
