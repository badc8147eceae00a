/*
 * One look at a frame, as a file (version 2 of FORMAT.md): those of its blocks that were looked at, each with what a
 * criterion is shown of it, as floats, and with what it answered. One file a look, written once and never changed; planes
 * that are made later (denoised pictures) are files of their own, with records of the same block and sample count.
 */
#ifndef SEQUENCE_LOOK_H
#define SEQUENCE_LOOK_H

#include "sequence/record.h"

struct seq_look {
    uint32_t width, height, number; /* of the picture; the look's, from 1 */
    uint64_t seed;
    uint32_t count;
    struct seq_record *records; /* owns; [count], ids of blocks rise */
    uint8_t *bytes;             /* owns */
    size_t size;
};

/* Takes ownership of bytes (malloc) on success only. `path` is for messages. */
int seq_look_parse(const char *path, uint8_t *bytes, size_t size, struct seq_look *look, struct base_err *err);
int seq_look_read(const char *path, struct seq_look *look, struct base_err *err);
void seq_look_release(struct seq_look *look);

int seq_look_open(struct seq_builder *w, uint32_t width, uint32_t height, uint32_t number, uint64_t seed,
                  struct base_err *err);
/* Adds a block: kind, spp, half_spp, block, x0, y0, width and height of r; stats [n_stats]; of each plane of the mask
 * `planes` (bits 1 << number) in turn what fill puts into out [channels][P]. */
int seq_look_add(struct seq_builder *w, const struct seq_record *r, const struct seq_stat *stats, uint32_t planes,
                 void (*fill)(void *data, enum seq_plane_number plane, float *out), void *data, struct base_err *err);

#endif
