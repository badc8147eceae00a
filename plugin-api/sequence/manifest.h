/*
 * manifest.json of a recorded sequence: which view it is and which blocks are there. The form is FORMAT.md in this folder.
 */
#ifndef SEQUENCE_MANIFEST_H
#define SEQUENCE_MANIFEST_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/identity.h"
#include "sequence/block.h"

enum { SEQ_MANIFEST_NAME = 256, SEQ_MANIFEST_PATH = 4096 };

struct seq_manifest_block {
    uint32_t id, x0, y0, x1, y1;
    char file[64]; /* a plain name inside the folder */
    uint64_t bytes;
    uint32_t crc32;
    double seconds;   /* wall time that recording it took; 0: not known */
    uint64_t dropped; /* samples, of levels and reference, that were not finite and count as not taken */
};

struct seq_manifest {
    char scene[SEQ_MANIFEST_NAME], camera[SEQ_MANIFEST_NAME], renderer[SEQ_MANIFEST_NAME];
    char source[SEQ_MANIFEST_PATH];
    uint32_t source_crc32; /* 0: not known */
    uint32_t inputs_crc32; /* of the source and every file it named (base/paths.h); 0: not known */
    int has_look_at;
    double look_at[9];             /* eye, point looked at, up: instead of the source's camera, with has_look_at */
    double fov_deg;                /* 0: the source's */
    uint32_t width, height, block; /* pixels */
    uint64_t seed, reference_seed;
    uint32_t reference_spp; /* 0: no reference */
    int reference_independent;
    uint32_t n_levels, n_blocks;
    uint32_t *levels;                  /* owns; rising */
    struct seq_manifest_block *blocks; /* owns; ids are unique */
};

/* Reads DIR/manifest.json and checks it. */
int seq_manifest_read(const char *dir, struct seq_manifest *m, struct base_err *err);
int seq_manifest_parse(const char *path, const char *text, size_t size, struct seq_manifest *m, struct base_err *err);
/* Writes DIR/manifest.json atomically. */
int seq_manifest_write(const char *dir, const struct seq_manifest *m, struct base_err *err);
void seq_manifest_release(struct seq_manifest *m);

/* What tells two runs apart, up to their blocks. `source` may differ: its CRC decides. */
void seq_manifest_identity(const struct seq_manifest *m, struct base_identity *to);

/* Index of the block with this id; n_blocks: it is not listed. */
uint32_t seq_manifest_find(const struct seq_manifest *m, uint32_t id);
/* Reads a block that the manifest lists and holds it against the manifest: size, CRC, rectangle, no level missing. */
int seq_manifest_read_block(const char *dir, const struct seq_manifest *m, uint32_t index, struct seq_block *block,
                            struct base_err *err);

#endif
