/* Looks and manifests of recorded frames from hostile bytes: parse, then decode everything that parsed. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <zlib.h>

#include "base/bytes.h"
#include "sequence/recording.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Most mutations die at a CRC; mended ones get further. */
static void mend(uint8_t *p, size_t size)
{
    if (size < SEQ_FILE_HEADER)
        return;
    base_put_u32(p + 60, (uint32_t)crc32_z(0, p, 60));
    for (size_t at = SEQ_FILE_HEADER; at + SEQ_LOOK_HEADER <= size;) {
        const size_t payload = base_get_u32(p + at + 20), left = size - at - SEQ_LOOK_HEADER;
        if (payload <= left)
            base_put_u32(p + at + 24, (uint32_t)crc32_z(0, p + at + SEQ_LOOK_HEADER, payload));
        base_put_u32(p + at + 60, (uint32_t)crc32_z(0, p + at, 60));
        if (payload > left)
            return;
        at += SEQ_LOOK_HEADER + payload;
    }
}

static void decode(const struct seq_record *r)
{
    if ((size_t)r->width * r->height > 1 << 16)
        return;
    float *out = malloc(3 * (size_t)r->width * r->height * sizeof *out);
    for (uint32_t p = 0; p < SEQ_PLANES_END && out; p++)
        seq_shown(r, (enum seq_plane_number)p, out, NULL);
    seq_stat(r, "error");
    free(out);
}

static void try_look(const uint8_t *data, size_t size, int mended)
{
    struct seq_look l;
    struct base_err err = {0};
    uint8_t *copy = malloc(size > 0 ? size : 1);
    if (!copy)
        return;
    memcpy(copy, data, size);
    if (mended)
        mend(copy, size);
    if (seq_look_parse("fuzz", copy, size, &l, &err) != 0) {
        if (err.text[0] == '\0')
            abort();
        free(copy);
        return;
    }
    for (uint32_t i = 0; i < l.count; i++)
        decode(&l.records[i]);
    seq_look_release(&l);
}

static void try_manifest(const uint8_t *data, size_t size)
{
    struct seq_recording *m = malloc(sizeof *m);
    struct base_err err = {0};
    struct base_identity identity = {0};
    const int rc = m ? seq_recording_parse("fuzz", (const char *)data, size, m, &err) : 0;
    if (m && rc == 0) {
        seq_recording_identity(m, &identity);
        base_identity_release(&identity);
        seq_recording_release(m);
    } else if (m && err.text[0] == '\0')
        abort();
    free(m);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > 0 && data[0] == '{') {
        try_manifest(data, size);
        return 0;
    }
    try_look(data, size, 0);
    try_look(data, size, 1);
    return 0;
}
