/* Block sequences and manifests from hostile bytes: parse, then decode everything that parsed. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <zlib.h>

#include "sequence/manifest.h"
#include "sequence/block.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Most mutations die at a CRC; mended ones get further. */
static void mend(uint8_t *p, size_t size)
{
    if (size < 64)
        return;
    for (size_t at = 0, head = 60; at + head + 4 <= size;) {
        size_t payload = 0;
        if (at > 0) {
            payload = (size_t)p[at + 20] | (size_t)p[at + 21] << 8 | (size_t)p[at + 22] << 16 | (size_t)p[at + 23] << 24;
            if (size - at - 32 >= payload) {
                uint32_t c = (uint32_t)crc32_z(0, p + at + 32, payload);
                for (int i = 0; i < 4; i++)
                    p[at + 24 + (size_t)i] = (uint8_t)(c >> 8 * i);
            } else {
                payload = size;
            }
        }
        uint32_t c = (uint32_t)crc32_z(0, p + at, head);
        for (size_t i = 0; i < 4; i++)
            p[at + head + i] = (uint8_t)(c >> 8 * i);
        if (payload > size - at)
            return;
        at += head + 4 + payload;
        head = 28;
    }
}

static void decode(const struct seq_block *b, const struct seq_record *r, uint8_t *bytes, float *floats)
{
    seq_display(b, r, bytes, NULL);
    seq_display_planar(b, r, bytes, NULL);
    seq_mean(b, r, floats, NULL);
    seq_half(b, r, floats, NULL);
    seq_half_luminance(b, r, floats, NULL);
    seq_stat(r, "seconds");
}

static void try_block(const uint8_t *data, size_t size, int mended)
{
    struct seq_block b;
    struct base_err err = {0};
    uint8_t *copy = malloc(size > 0 ? size : 1);
    if (!copy)
        return;
    memcpy(copy, data, size);
    if (mended)
        mend(copy, size);
    if (seq_block_parse("fuzz", copy, size, &b, &err) != 0) {
        if (err.text[0] == '\0')
            abort();
        free(copy);
        return;
    }
    size_t pixels = (size_t)b.width * b.height;
    if (pixels <= 1 << 16) {
        uint8_t *bytes = malloc(3 * pixels);
        float *floats = malloc(3 * pixels * sizeof *floats);
        for (uint32_t i = 0; i < b.n_levels && bytes && floats; i++)
            decode(&b, &b.levels[i], bytes, floats);
        if (b.reference && bytes && floats)
            decode(&b, b.reference, bytes, floats);
        free(floats);
        free(bytes);
    }
    seq_block_release(&b);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct seq_manifest m;
    if (size > 0 && data[0] == '{') {
        if (seq_manifest_parse("fuzz", (const char *)data, size, &m, NULL) == 0)
            seq_manifest_release(&m);
        return 0;
    }
    try_block(data, size, 0);
    try_block(data, size, 1);
    return 0;
}
