/*
 * Where a ray leaves a surface so that it cannot meet the same surface again: the point moves along the geometric normal
 * beyond a bound on its rounding error (after Pharr, Jakob & Humphreys 2016, §3.9; the idea of an offset that scales with
 * the coordinates, Wächter & Binder 2019). No absolute epsilon, so the scale of the scene does not matter. What lies within
 * the bound is passed, too: surfaces at one place are for integ/contact.h.
 */
#ifndef PT_GEOM_OFFSET_H
#define PT_GEOM_OFFSET_H

#include "scene/vec.h"

/* Per-axis error of a point interpolated from corners, relative to the largest corner coordinate: γ(7) for the point itself,
 * and as much again for the intersection's own distance, whose rounding is relative to the corners too. */
#define PT_OFFSET_ERROR 8e-7f

/* p moved off the surface with unit normal n to the side that `w` points to. */
static inline pt_vec3 pt_offset_point(pt_vec3 p, pt_vec3 n, pt_vec3 error, pt_vec3 w)
{
    return v3_madd(p, copysignf(v3_dot(v3_abs(n), error), v3_dot(n, w)), n);
}

#endif
