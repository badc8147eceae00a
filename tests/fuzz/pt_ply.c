/* PLY: any bytes either give a mesh whose indices are in range and whose points are finite, or one line. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "pbrt/ply.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct pt_ply ply;
    struct base_err err = {0};
    if (pt_ply_parse("f.ply", (const char *)data, size, &ply, &err) != 0) {
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
