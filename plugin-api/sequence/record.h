/*
 * What files of blocks (block.h) and of looks (look.h) are made of: records, that is one block of pixels at one sample count
 * with statistics and planes. The forms are FORMAT.md beside this file. Everything that is read is checked (sizes, CRCs)
 * before it is believed; pixels are inflated on demand. Thread-safe for reading.
 */
#ifndef SEQUENCE_RECORD_H
#define SEQUENCE_RECORD_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "sequence/planes.h"

enum { SEQ_MAX_PLANES = 16, SEQ_MAX_STATS = 64, SEQ_NAME = 24, SEQ_MAX_FILE = 1 << 30 };
/* Bytes of the parts of a file; the header of a record is the second one in files of looks. */
enum { SEQ_FILE_HEADER = 64, SEQ_STAT_BYTES = SEQ_NAME + 8, SEQ_PLANE_HEADER = 16 };
enum { SEQ_RECORD_HEADER = 32, SEQ_LOOK_HEADER = 64 };
enum seq_kind { SEQ_LEVEL = 1, SEQ_REFERENCE = 2, SEQ_BEYOND = 3 };

struct seq_stat {
    char name[SEQ_NAME];
    double value;
};

struct seq_plane { /* borrows from the file's bytes */
    uint32_t plane, filter, raw_bytes, stored_bytes;
    const uint8_t *stored;
};

struct seq_record {
    enum seq_kind kind;
    uint32_t spp, half_spp;
    uint32_t block; /* its id */
    int32_t x0, y0; /* its upper left pixel in the picture */
    uint32_t width, height;
    uint32_t n_planes, n_stats;
    struct seq_plane planes[SEQ_MAX_PLANES];
    const uint8_t *stats; /* borrows, as planes do; seq_stat reads them */
};

/* --- reading -------------------------------------------------------------------------------------------------------- */

/* The bytes of a file, borrowed. */
struct seq_source {
    const char *path; /* for messages */
    const uint8_t *bytes;
    size_t size;
    uint32_t version, count; /* of the format, of records */
    uint32_t width, height;  /* of the block (version 1) or of the picture */
    uint32_t id;             /* of the block, or of the look */
    int32_t x0, y0;
    uint64_t seed;
};

/* The file header; what is no file of this version is refused by name. */
int seq_source_open(const char *path, const uint8_t *bytes, size_t size, uint32_t version, struct seq_source *out,
                    struct base_err *err);
/* Record `index` at *at, which is moved past it. */
int seq_record_parse(const struct seq_source *in, uint32_t index, size_t *at, struct seq_record *r, struct base_err *err);

int seq_has(const struct seq_record *r, enum seq_plane_number plane);
/* NaN when the record does not have the statistic. */
double seq_stat(const struct seq_record *r, const char *name);
/* Inflates a plane and undoes its filters. raw has the plane's raw size. BASE_EINVAL when it is missing or does not inflate
 * to its size. */
int seq_inflate(const struct seq_record *r, enum seq_plane_number plane, uint8_t *raw, struct base_err *err);
/* The same of a plane of looks, as numbers [channels][P]. */
int seq_shown(const struct seq_record *r, enum seq_plane_number plane, float *out, struct base_err *err);

/* --- writing -------------------------------------------------------------------------------------------------------- */

/* A file in the making: built in memory, and then written whole. Not thread-safe per object. */
struct seq_builder {
    uint32_t width, height, n_records, has_reference;
    uint8_t *bytes; /* owns */
    size_t size, room;
};

/* A file without records; width and height as in seq_source. */
int seq_builder_open(struct seq_builder *w, const struct seq_source *what, struct base_err *err);
/* Begins a record: its statistics. *start is for seq_record_end. */
int seq_record_begin(struct seq_builder *w, size_t header, const struct seq_stat *stats, uint32_t n_stats, size_t *start,
                     struct base_err *err);
/* Filters raw, of a plane of width x height pixels, in place and deflates it to the end of the builder. */
int seq_record_add(struct seq_builder *w, enum seq_plane_number plane, uint32_t filter, uint8_t *raw, uint32_t width,
                   uint32_t height, struct base_err *err);
/* The header, which has the size and the checksum of what follows it. */
void seq_record_end(struct seq_builder *w, size_t start, size_t header, const struct seq_record *r);
/* Writes the file atomically; *crc gets the CRC of the whole file. */
int seq_builder_write(struct seq_builder *w, const char *path, uint32_t *crc, struct base_err *err);
void seq_builder_release(struct seq_builder *w);

#endif
