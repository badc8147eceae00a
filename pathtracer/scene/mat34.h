/* Affine transforms of float; small, by value, pure. */
#ifndef PT_SCENE_MAT34_H
#define PT_SCENE_MAT34_H

#include "scene/vec.h"

/* Affine transform: three rows of four, applied to column vectors (x, y, z, 1). */
struct pt_mat34 {
    float m[12];
};
static inline pt_vec3 pt_mat34_vector(const struct pt_mat34 *t, pt_vec3 v)
{
    const float *m = t->m;
    return v3(m[0] * v.x + m[1] * v.y + m[2] * v.z, m[4] * v.x + m[5] * v.y + m[6] * v.z,
              m[8] * v.x + m[9] * v.y + m[10] * v.z);
}
static inline pt_vec3 pt_mat34_point(const struct pt_mat34 *t, pt_vec3 p)
{
    return v3_add(pt_mat34_vector(t, p), v3(t->m[3], t->m[7], t->m[11]));
}
/* Normal by the inverse transform `inv` (its transpose is applied); not normalised. */
static inline pt_vec3 pt_mat34_normal(const struct pt_mat34 *inv, pt_vec3 n)
{
    const float *m = inv->m;
    return v3(m[0] * n.x + m[4] * n.y + m[8] * n.z, m[1] * n.x + m[5] * n.y + m[9] * n.z,
              m[2] * n.x + m[6] * n.y + m[10] * n.z);
}

#endif
