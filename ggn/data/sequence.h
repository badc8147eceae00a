/*
 * Block sequences: one block of one view at rising sample counts, and its reference. The form on disk is ggn/data/FORMAT.md.
 *
 * A parsed block owns the file's bytes; pixels are inflated on demand, so that a block costs what its file costs. Everything
 * read is checked (sizes, CRCs, order of levels) before it is believed. Thread-safe for reading after parsing.
 */
#ifndef GGN_DATA_SEQUENCE_H
#define GGN_DATA_SEQUENCE_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "data/planes.h"

enum { GGN_SEQ_MAX_SIDE = 4096, GGN_SEQ_MAX_RECORDS = 4096, GGN_SEQ_MAX_PLANES = 16, GGN_SEQ_MAX_STATS = 64, GGN_SEQ_NAME = 24 };

struct ggn_seq_stat {
    char name[GGN_SEQ_NAME];
    double value;
};

struct ggn_seq_plane { /* borrows from the block's bytes */
    uint32_t plane, filter, raw_bytes, stored_bytes;
    const uint8_t *stored;
};

struct ggn_seq_record { /* a level, or the reference */
    uint32_t spp, half_spp;
    uint32_t n_planes, n_stats;
    struct ggn_seq_plane planes[GGN_SEQ_MAX_PLANES];
    struct ggn_seq_stat *stats; /* owns */
};

struct ggn_seq_block {
    uint32_t width, height, id;
    int32_t x0, y0;
    uint64_t seed;
    uint32_t n_levels;
    struct ggn_seq_record *levels;   /* owns; spp strictly rising; at least one */
    struct ggn_seq_record *reference; /* inside levels' allocation; NULL if the file has none */
    uint8_t *bytes;                  /* owns */
    size_t size;
};

/* Takes ownership of bytes (malloc) on success only. `path` is for messages. */
int ggn_seq_block_parse(const char *path, uint8_t *bytes, size_t size, struct ggn_seq_block *block, struct base_err *err);
int ggn_seq_block_read(const char *path, struct ggn_seq_block *block, struct base_err *err);
void ggn_seq_block_release(struct ggn_seq_block *block);

/* Pixels of one record. P = width*height. Errors: BASE_EINVAL when the plane is missing or does not inflate to its size. */
int ggn_seq_display_planar(const struct ggn_seq_block *b, const struct ggn_seq_record *r, uint8_t *rgb /* [3][P] */, struct base_err *err);
int ggn_seq_display(const struct ggn_seq_block *b, const struct ggn_seq_record *r, uint8_t *rgb /* [P][3] */, struct base_err *err);
/* Linear mean, finite. From MEAN_F16, else DISPLAY + FINE, else DISPLAY alone (then within half a code, and at most 1). */
int ggn_seq_mean(const struct ggn_seq_block *b, const struct ggn_seq_record *r, float *rgb /* [3][P] */, struct base_err *err);
/* Linear half-buffer difference D: luminance from HALF_F16 or HALF_LOG; all channels from HALF_F16 only. */
int ggn_seq_half_luminance(const struct ggn_seq_block *b, const struct ggn_seq_record *r, float *y /* [P] */, struct base_err *err);
int ggn_seq_half(const struct ggn_seq_block *b, const struct ggn_seq_record *r, float *rgb /* [3][P] */, struct base_err *err);
int ggn_seq_has(const struct ggn_seq_record *r, enum ggn_plane plane);
/* NaN when the record does not have the statistic. */
double ggn_seq_stat(const struct ggn_seq_record *r, const char *name);
/* The level with this spp, or NULL. */
const struct ggn_seq_record *ggn_seq_level(const struct ggn_seq_block *b, uint32_t spp);

/* Writing: a block is built in memory and then written whole. */
struct ggn_seq_builder {
    uint32_t width, height, n_records, has_reference;
    uint8_t *bytes; /* owns */
    size_t size, room;
};

struct ggn_seq_frame { /* what to add; NULL planes are left out; all borrowed during the call */
    uint32_t spp, half_spp;
    int is_reference, full;  /* full: f16 planes instead of FINE and HALF_LOG (always for the reference) */
    const uint8_t *display;  /* [3][P], required */
    const float *mean, *half; /* [3][P] */
    const struct ggn_seq_stat *stats;
    uint32_t n_stats;
};

int ggn_seq_builder_init(struct ggn_seq_builder *w, uint32_t width, uint32_t height, int32_t x0, int32_t y0, uint32_t id,
                         uint64_t seed, struct base_err *err);
/* Levels in rising spp, the reference last. */
int ggn_seq_builder_add(struct ggn_seq_builder *w, const struct ggn_seq_frame *frame, struct base_err *err);
/* Writes the file atomically; *crc gets the CRC of the whole file. */
int ggn_seq_builder_write(struct ggn_seq_builder *w, const char *path, uint32_t *crc, struct base_err *err);
void ggn_seq_builder_release(struct ggn_seq_builder *w);

#endif
