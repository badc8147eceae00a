/* Sizes of the parts of block-NNNNN.lseq, see FORMAT.md. Private to this folder. */
#ifndef SEQUENCE_LAYOUT_H
#define SEQUENCE_LAYOUT_H

#include <zlib.h>

#include <stddef.h>
#include <stdint.h>

#define SEQ_MAGIC "LULLSEQ1"

enum {
    SEQ_FILE_HEADER = 64,
    SEQ_RECORD_HEADER = 32,
    SEQ_STAT_BYTES = 32, /* char name[24], f64 value */
    SEQ_PLANE_HEADER = 16,
    SEQ_KIND_LEVEL = 1,
    SEQ_KIND_REFERENCE = 2
};

static inline uint32_t seq_crc(const uint8_t *bytes, size_t size) { return (uint32_t)crc32_z(0, bytes, size); }

#endif
