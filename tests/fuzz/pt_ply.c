/* PLY, packed or not: any bytes either give a mesh whose indices are in range and whose points are finite, or one line. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "pbrt/ply.h"
#include "pbrt/source.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct pt_ply ply;
    struct base_err err = {0};
    char *unpacked = NULL;
    const char *bytes = (const char *)data;
    int rc = 0;
    if (size >= 2 && data[0] == 0x1f && data[1] == 0x8b) {
        rc = pt_source_unpack("f.ply.gz", bytes, size, &unpacked, &size, &err);
        bytes = unpacked;
    }
    if (!rc)
        rc = pt_ply_parse("f.ply", bytes, size, &ply, &err);
    free(unpacked);
    if (rc) {
        if (err.text[0] == '\0')
            abort();
        return 0;
    }
    for (size_t i = 0; i < 3 * (size_t)ply.triangle_count; i++)
        if (ply.indices[i] >= ply.vertex_count)
            abort();
    for (size_t i = 0; i < 3 * (size_t)ply.vertex_count; i++)
        if (!isfinite(ply.positions[i]))
            abort();
    pt_ply_release(&ply);
    return 0;
}
