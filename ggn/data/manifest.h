/*
 * manifest.json of a recorded sequence: which view it is and which blocks are there. See ggn/data/FORMAT.md.
 */
#ifndef GGN_DATA_MANIFEST_H
#define GGN_DATA_MANIFEST_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "data/sequence.h"

enum { GGN_MANIFEST_NAME = 256 };

struct ggn_manifest_block {
    uint32_t id, x0, y0, x1, y1;
    char file[64]; /* a plain name inside the folder */
    uint64_t bytes;
    uint32_t crc32;
};

struct ggn_manifest {
    char scene[GGN_MANIFEST_NAME], source[GGN_MANIFEST_NAME], camera[GGN_MANIFEST_NAME], renderer[GGN_MANIFEST_NAME];
    uint32_t width, height, block; /* pixels */
    uint64_t seed, reference_seed;
    uint32_t reference_spp; /* 0: no reference */
    int reference_independent;
    uint32_t n_levels, n_blocks;
    uint32_t *levels;                  /* owns; rising */
    struct ggn_manifest_block *blocks; /* owns; ids are unique */
};

/* Reads DIR/manifest.json and checks it. */
int ggn_manifest_read(const char *dir, struct ggn_manifest *m, struct base_err *err);
int ggn_manifest_parse(const char *path, const char *text, size_t size, struct ggn_manifest *m, struct base_err *err);
/* Writes DIR/manifest.json atomically. */
int ggn_manifest_write(const char *dir, const struct ggn_manifest *m, struct base_err *err);
void ggn_manifest_release(struct ggn_manifest *m);

/* Reads a block that the manifest lists and holds it against the manifest: size, CRC, rectangle, no level missing. */
int ggn_manifest_read_block(const char *dir, const struct ggn_manifest *m, uint32_t index, struct ggn_seq_block *block, struct base_err *err);

#endif
