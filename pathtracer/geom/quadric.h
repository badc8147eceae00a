/*
 * Ray–quadric intersection in the quadric's own space, in double: origin offsets and scene scale then need no tolerance
 * here. Pure, thread-safe. Shared by the ray queries and by light sampling.
 */
#ifndef PT_GEOM_QUADRIC_H
#define PT_GEOM_QUADRIC_H

#include "scene/scene.h"

/* Nearest hit with t in (t_min, t_max); the ray is in the space of q->to_render, *p_quadric (the hit point) in the quadric's
 * own. Its line crosses the quadric at most twice: 1 or 2 says which is hit, 0 that none is. Bit 0 of `left_out`: not
 * the first, bit 1: not the second. */
int pt_quadric_intersect(const struct pt_quadric *q, pt_vec3 origin, pt_vec3 direction, float t_min, float t_max,
                         unsigned left_out, float *t, pt_vec3 *p_quadric);

/* Axis-aligned bounds in the space of to_render, rounded outwards. */
void pt_quadric_bounds(const struct pt_quadric *q, pt_vec3 *lower, pt_vec3 *upper);

/* The surface at a point of the quadric's own space; the result is in the space of to_render. */
struct pt_quadric_point {
    pt_vec3 p, error; /* error: absolute bound on the rounding of p, per axis */
    pt_vec3 n;        /* unnormalised: away from the centre or axis; disk: +z */
};
void pt_quadric_at(const struct pt_quadric *q, pt_vec3 p_quadric, struct pt_quadric_point *out);

/* Parameters in [0, 1] as in pbrt, and their tangents (zero at poles). */
void pt_quadric_uv(const struct pt_quadric *q, pt_vec3 p_quadric, float *u, float *v, pt_vec3 *dpdu, pt_vec3 *dpdv);

#endif
