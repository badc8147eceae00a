/*
 * PLY files (ascii, binary of both endians) to triangles. Pure; thread-safe.
 */
#ifndef PT_PBRT_PLY_H
#define PT_PBRT_PLY_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

struct pt_ply {
    uint32_t vertex_count, triangle_count;
    float *positions;  /* owns: [vertex_count][3], finite */
    float *normals;    /* owns: [vertex_count][3] as they stand in the file, finite or not; or NULL */
    float *uvs;        /* owns: [vertex_count][2] or NULL */
    uint32_t *indices; /* owns: [triangle_count][3], each < vertex_count */
    int corner_uvs;    /* the file has texture coordinates per face corner, which are not read */
};

/* Parses bytes[0, size). Faces with more than three corners become fans. Fails with BASE_EINVAL and `name: what is wrong`
 * for truncated data, indices out of range, positions that are not finite, counts that the file cannot hold. */
int pt_ply_parse(const char *name, const char *bytes, size_t size, struct pt_ply *out, struct base_err *err);
void pt_ply_release(struct pt_ply *ply);

#endif
