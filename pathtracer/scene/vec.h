/*
 * 3-vectors of float, by value, all inline. The same type holds points, directions, normals and linear RGB radiance: names
 * say which (p_world, wi_local, n_world, radiance).
 */
#ifndef PT_SCENE_VEC_H
#define PT_SCENE_VEC_H

#include <float.h>
#include <math.h>

#include "base/colour.h"
#include "base/pi.h"

#define PT_PI ((float)BASE_PI)
#define PT_INV_PI 0.31830988618379067154f

typedef struct pt_vec3 {
    float x, y, z;
} pt_vec3;

static inline pt_vec3 v3(float x, float y, float z) { return (pt_vec3){x, y, z}; }
static inline pt_vec3 v3_splat(float s) { return (pt_vec3){s, s, s}; }
static inline pt_vec3 v3_add(pt_vec3 a, pt_vec3 b) { return (pt_vec3){a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline pt_vec3 v3_sub(pt_vec3 a, pt_vec3 b) { return (pt_vec3){a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline pt_vec3 v3_mul(pt_vec3 a, pt_vec3 b) { return (pt_vec3){a.x * b.x, a.y * b.y, a.z * b.z}; }
static inline pt_vec3 v3_scale(pt_vec3 a, float s) { return (pt_vec3){a.x * s, a.y * s, a.z * s}; }
static inline pt_vec3 v3_abs(pt_vec3 a) { return (pt_vec3){fabsf(a.x), fabsf(a.y), fabsf(a.z)}; }
static inline pt_vec3 v3_neg(pt_vec3 a) { return (pt_vec3){-a.x, -a.y, -a.z}; }
/* a + s b */
static inline pt_vec3 v3_madd(pt_vec3 a, float s, pt_vec3 b)
{
    return (pt_vec3){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z};
}
static inline float v3_dot(pt_vec3 a, pt_vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline pt_vec3 v3_cross(pt_vec3 a, pt_vec3 b)
{
    return (pt_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
static inline float v3_len(pt_vec3 a) { return sqrtf(v3_dot(a, a)); }
/* A zero vector stays zero. */
static inline pt_vec3 v3_norm(pt_vec3 a)
{
    float len2 = v3_dot(a, a);
    return len2 > 0.0f ? v3_scale(a, 1.0f / sqrtf(len2)) : a;
}
/* The same of vectors as long as an area, whose squared length may leave float's range: normals of triangles. */
static inline pt_vec3 v3_unit(pt_vec3 a)
{
    float len2 = v3_dot(a, a);
    if (len2 >= FLT_MIN && len2 <= FLT_MAX)
        return v3_scale(a, 1.0f / sqrtf(len2));
    float big = fmaxf(fabsf(a.x), fmaxf(fabsf(a.y), fabsf(a.z)));
    return big > 0.0f && big <= FLT_MAX ? v3_norm(v3(a.x / big, a.y / big, a.z / big)) : a;
}
/* Largest component; the plain comparison compiles to one instruction, fmaxf to a call. NaN in z stays, in x and y may
 * not. */
static inline float v3_max(pt_vec3 a)
{
    float m = a.x > a.y ? a.x : a.y;
    return m > a.z ? m : a.z;
}
static inline float v3_mean(pt_vec3 a) { return (a.x + a.y + a.z) * (1.0f / 3.0f); }
/* The smaller and the larger of each component. */
static inline pt_vec3 v3_least(pt_vec3 a, pt_vec3 b) { return v3(fminf(a.x, b.x), fminf(a.y, b.y), fminf(a.z, b.z)); }
static inline pt_vec3 v3_most(pt_vec3 a, pt_vec3 b) { return v3(fmaxf(a.x, b.x), fmaxf(a.y, b.y), fmaxf(a.z, b.z)); }
static inline int v3_is_black(pt_vec3 a) { return a.x == 0.0f && a.y == 0.0f && a.z == 0.0f; }
static inline int v3_is_finite(pt_vec3 a) { return isfinite(a.x) && isfinite(a.y) && isfinite(a.z); }
/* Relative luminance Y of linear sRGB/Rec.709 primaries. */
static inline float v3_luminance(pt_vec3 a)
{
    return (float)BASE_LUMINANCE_R * a.x + (float)BASE_LUMINANCE_G * a.y + (float)BASE_LUMINANCE_B * a.z;
}

/* Orthonormal basis (s, t, n). Duff et al. 2017, "Building an Orthonormal Basis, Revisited". */
struct pt_frame {
    pt_vec3 s, t, n;
};
static inline struct pt_frame pt_frame_from_normal(pt_vec3 n)
{
    float sign = copysignf(1.0f, n.z);
    float a = -1.0f / (sign + n.z), b = n.x * n.y * a;
    return (struct pt_frame){{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}
static inline pt_vec3 pt_frame_to_local(const struct pt_frame *f, pt_vec3 w)
{
    return (pt_vec3){v3_dot(w, f->s), v3_dot(w, f->t), v3_dot(w, f->n)};
}
static inline pt_vec3 pt_frame_to_world(const struct pt_frame *f, pt_vec3 w)
{
    return v3_madd(v3_madd(v3_scale(f->s, w.x), w.y, f->t), w.z, f->n);
}

#endif
