/*
 * Writer of one block-NNNNN.lseq file, the form of ggn/data/FORMAT.md: a block's image at rising sample counts and its
 * reference, compressed. Not thread-safe. The file appears under its name only when committed.
 */
#ifndef PT_RENDER_LSEQ_H
#define PT_RENDER_LSEQ_H

#include <stdint.h>

#include "base/err.h"
#include "base/files.h"

enum { PT_LSEQ_LEVEL = 1, PT_LSEQ_REFERENCE = 2 };
enum { PT_LSEQ_COMPACT, PT_LSEQ_FULL }; /* DISPLAY + FINE + HALF_LOG, or DISPLAY + MEAN_F16 + HALF_F16 */

struct pt_lseq {
    struct base_file_out out;
    uint32_t crc;          /* of everything written */
    uint64_t bytes;
    uint32_t width, height;
    unsigned char *payload, *plane; /* own; scratch */
    size_t payload_room, payload_used;
};

struct pt_lseq_statistic {
    char name[24]; /* NUL-padded */
    double value;  /* finite */
};

struct pt_lseq_record {
    uint32_t kind;             /* PT_LSEQ_LEVEL or PT_LSEQ_REFERENCE */
    uint32_t form;             /* PT_LSEQ_COMPACT or PT_LSEQ_FULL */
    uint32_t spp, half_spp;
    const double *mean;        /* [height, width, 3] linear, finite */
    const double *difference;  /* [height, width, 3] D = (A - B) / 2, finite */
    uint32_t statistic_count;  /* at most 64 */
    const struct pt_lseq_statistic *statistics;
};

/* Opens a temporary beside path and writes the header. width, height in [1, 4096]. */
int pt_lseq_begin(struct pt_lseq *file, const char *path, uint32_t width, uint32_t height, int32_t x0, int32_t y0,
                  uint32_t id, uint32_t records, uint64_t seed, struct base_err *err);
int pt_lseq_put(struct pt_lseq *file, const struct pt_lseq_record *record, struct base_err *err);
/* file->bytes and file->crc hold what the manifest says about it. */
int pt_lseq_commit(struct pt_lseq *file, struct base_err *err);
void pt_lseq_abort(struct pt_lseq *file);

/* The codes of the format, for tests. */
uint16_t pt_lseq_half_float(double x);             /* IEEE binary16, nearest even, clamped to +-65504 */
uint8_t pt_lseq_fine(double x, uint8_t display);   /* FINE of x >= 0 that shows as display */
uint8_t pt_lseq_half_log(double luminance);        /* HALF_LOG */

#endif
