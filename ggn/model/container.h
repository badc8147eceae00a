/*
 * The .ggn file: named tensors and one JSON object, little-endian. Models and training checkpoints are such files.
 *
 *   0   8  magic "LULLGGN\n"
 *   8   4  version, 1
 *  12   4  number of tensors
 *  16   8  size of the file
 *  24   8  offset of the JSON text     32  8  its size (no terminating zero)
 *  40   8  offset of the tensor table  48  8  checksum: FNV-1a (64 bit) of the file with these 8 bytes as zero
 *  56   8  zero
 *  64      table, one entry of 88 bytes per tensor: name[48] (zero-padded), u32 type (0 f32, 1 f16, 2 bf16),
 *          u32 rank (1..4), u32 dim[4] (unused ones 1), u64 offset (multiple of 64), u64 size in bytes
 *
 * then JSON and data in any order, without overlap being required or relied on.
 *
 * A reader checks sizes, offsets and checksum before it looks at anything else, and never allocates from a size in a file
 * that the file itself is too short for. Unknown versions and types are refused. Thread-safe (no globals).
 */
#ifndef GGN_MODEL_CONTAINER_H
#define GGN_MODEL_CONTAINER_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/files.h"

enum ggn_type { GGN_F32, GGN_F16, GGN_BF16, GGN_TYPES };

extern const struct base_file_kind ggn_container_kind;

enum { GGN_CONTAINER_VERSION = 1, GGN_CONTAINER_NAME = 48, GGN_CONTAINER_TENSORS = 4096 };

extern const char *const ggn_type_names[GGN_TYPES + 1]; /* ends with NULL */

struct ggn_entry {
    char name[GGN_CONTAINER_NAME]; /* at most 47 characters */
    enum ggn_type type;
    int rank;
    uint32_t dim[4];
    uint64_t offset, size;
    size_t count;       /* product of dim */
    const float *write; /* writer: the values; borrows until ggn_container_write returns */
};

struct ggn_container {
    struct ggn_entry *entry; /* owns */
    int n_entries;
    char *json; /* owns; NUL-terminated */
    char *data; /* reader: the whole file; owns */
    size_t size;
};

void ggn_container_release(struct ggn_container *c);

/* Appends a tensor to be written. */
int ggn_container_add(struct ggn_container *c, const char *name, enum ggn_type type, int rank, const int *dim,
                      const float *values, struct base_err *err);
/* Writes entries and json atomically. */
int ggn_container_write(struct ggn_container *c, const char *path, struct base_err *err);

/* Reads and checks a file. On failure *c is empty and err names the file. */
int ggn_container_read(struct ggn_container *c, const char *path, struct base_err *err);
/* The same from malloc'ed memory, which it owns from here on, also on failure. `name` is for messages. */
int ggn_container_parse(struct ggn_container *c, const char *name, char *data, size_t size, struct base_err *err);
/* Decodes the named tensor of exactly this shape into out; BASE_EINVAL when it is missing, shaped otherwise, not finite. */
int ggn_container_get(const struct ggn_container *c, const char *name, int rank, const int *dim, float *out,
                      struct base_err *err);

#endif
