/*
 * Ray queries against a scene. The implementation (accel.c) is the only file that knows Embree.
 *
 * Queries are thread-safe and depend on nothing but their arguments. Distances are along the ray's direction, which need not
 * be unit.
 */
#ifndef PT_GEOM_ACCEL_H
#define PT_GEOM_ACCEL_H

#include "base/err.h"
#include "scene/scene.h"

/* Builds scene->accel and the bounds from shapes, objects and instances. On failure the scene is unchanged. */
int pt_accel_build(struct pt_scene *scene, struct base_err *err);
/* Frees scene->accel; safe when there is none. */
void pt_accel_release(struct pt_scene *scene);
/* Bytes that the structure holds. */
long long pt_accel_bytes(const struct pt_scene *scene);

/* t_min of a ray that does not meet the triangles which it begins in. Rays from 0 do: no path leaves a room through the
 * corner that it begins in. Small for every scene, and large enough to be multiplied with the area of a triangle. */
#define PT_RAY_OFF_START 1e-20f

struct pt_ray {
    pt_vec3 origin, direction;
    float t_min, t_max;
    float time; /* in [0, 1] over the time in which things move */
};

struct pt_hit {
    float t;
    float u, v;        /* mesh: weights of corners 1 and 2; quadric: u is the number, 0 or 1, of the line's crossing */
    int32_t shape;     /* id, -1 = nothing was hit */
    int32_t primitive; /* mesh: triangle */
    int32_t instance;  /* id, -1 = a shape of the world */
    pt_vec3 geometric; /* mesh: unnormalised normal in the shape's space (right-hand rule, before flip_normal);
                          quadric: the hit point in the quadric's own space */
};

/* The surfaces that a ray has passed through, at most the last PT_PASSED. They are left out by their names, not by their
 * distances: what coincides with one of them, or lies closely behind it, is still met. */
enum { PT_PASSED = 16 };
struct pt_passed {
    uint32_t count; /* of all; number i is in place i % PT_PASSED */
    struct pt_hit hits[PT_PASSED];
};
/* The ray goes on behind `hit`. Of more than PT_PASSED surfaces at one place, those that come too late are left out, too. */
void pt_ray_pass(struct pt_ray *ray, struct pt_passed *passed, const struct pt_hit *hit);

/* Nearest hit; returns 1 and fills *hit, or 0 and hit->shape is -1. Alpha is not looked at. */
int pt_accel_intersect(const struct pt_scene *scene, const struct pt_ray *ray, struct pt_hit *hit);
/* The same without what was passed. The scene has shapes with alpha, of the material `interface`, or that touch. */
int pt_accel_intersect_behind(const struct pt_scene *scene, const struct pt_ray *ray, const struct pt_passed *passed,
                              struct pt_hit *hit);

/* The same for `count` rays, faster than one after the other and with the same hits; but of two surfaces at the very same
 * distance the other rays may decide which is found. `coherent`: the rays keep together. */
void pt_accel_intersect_many(const struct pt_scene *scene, const struct pt_ray *const *rays, int count, int coherent,
                             struct pt_hit *const *hits);
/* occluded[i]: 1 when anything lies in (t_min, t_max) of rays[i], else 0. Alpha is not looked at. */
void pt_accel_occluded_many(const struct pt_scene *scene, const struct pt_ray *const *rays, int count, uint8_t *occluded);

/* Rays side by side, from t_min to t_max at time 0; arrays of equal length, a multiple of 16. */
struct pt_ray_lanes {
    const float *origin[3], *direction[3]; /* borrow */
    float t_min, t_max;
};
/* As pt_accel_intersect_many and pt_accel_occluded_many with the first `count` of them. */
void pt_accel_intersect_lanes(const struct pt_scene *scene, const struct pt_ray_lanes *rays, int count, int coherent,
                              struct pt_hit *const *hits);
void pt_accel_occluded_lanes(const struct pt_scene *scene, const struct pt_ray_lanes *rays, int count, uint8_t *occluded);

/* Calls `visit` for the primitives whose bounds come within `radius` of `centre` at `time`, perhaps for a few more. */
typedef void pt_accel_visit(void *user, int32_t shape, int32_t primitive, int32_t instance);
void pt_accel_near(const struct pt_scene *scene, pt_vec3 centre, float radius, float time, pt_accel_visit *visit,
                   void *user);

/* Object → render transform of instance `id` at `time`, the one its hits were found with. */
void pt_accel_instance_transform(const struct pt_scene *scene, int32_t id, float time, struct pt_mat34 *to_render);

#endif
