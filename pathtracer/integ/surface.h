/*
 * From a hit to a place on a surface: position with its error bound, normals, texture coordinates, tangents.
 * Inline, pure; `fx` is the kernel's compile-time effect set.
 */
#ifndef PT_INTEG_SURFACE_H
#define PT_INTEG_SURFACE_H

#include "geom/accel.h"
#include "geom/offset.h"
#include "geom/quadric.h"
#include "shade/light.h"
#include "shade/material.h"

struct pt_place {
    pt_vec3 p, error; /* render space; bound on the rounding of p, per axis */
    struct pt_surface s;
    const struct pt_shape *shape;
    int32_t primitive;
};

static inline pt_vec3 pt_corners_mix(pt_vec3 a, pt_vec3 b, pt_vec3 c, float u, float v)
{
    return v3_madd(v3_madd(v3_scale(a, 1.0f - u - v), u, b), v, c);
}

/* Plain maximum: faster than fmaxf, and corners are never NaN. */
static inline float pt_max3_abs(float a, float b, float c)
{
    a = fabsf(a);
    b = fabsf(b);
    c = fabsf(c);
    a = a > b ? a : b;
    return a > c ? a : c;
}

/* The corners of a hit triangle. */
struct pt_corners {
    const struct pt_vertex *a, *b, *c;
};

static inline struct pt_corners pt_mesh_corners(const struct pt_mesh *mesh, int32_t triangle)
{
    const uint32_t *index = mesh->indices + 3 * (size_t)triangle;
    return (struct pt_corners){mesh->vertices + index[0], mesh->vertices + index[1], mesh->vertices + index[2]};
}

static inline void pt_place_uv(const struct pt_mesh *mesh, struct pt_corners k, float u, float v, struct pt_surface *s)
{
    if (!mesh->has_uvs) { /* (0,0), (1,0), (1,1) */
        s->u = u + v;
        s->v = v;
        return;
    }
    float w = 1.0f - u - v;
    s->u = w * k.a->u + u * k.b->u + v * k.c->u;
    s->v = w * k.a->v + u * k.b->v + v * k.c->v;
}

/* Tangents from positions and texture coordinates (Pharr, Jakob & Humphreys 2016, §3.6.2); zero when those are
 * degenerate. */
static inline void pt_place_tangents(const struct pt_mesh *mesh, struct pt_corners k, struct pt_surface *s)
{
    pt_vec3 e1 = v3_sub(k.b->p, k.a->p), e2 = v3_sub(k.c->p, k.a->p);
    float u1 = 1.0f, v1 = 0.0f, u2 = 1.0f, v2 = 1.0f;
    if (mesh->has_uvs) {
        u1 = k.b->u - k.a->u;
        v1 = k.b->v - k.a->v;
        u2 = k.c->u - k.a->u;
        v2 = k.c->v - k.a->v;
    }
    float det = u1 * v2 - u2 * v1;
    if (det == 0.0f) {
        struct pt_frame frame = pt_frame_from_normal(s->n_geometric);
        s->dpdu = frame.s;
        s->dpdv = frame.t;
        return;
    }
    s->dpdu = v3_scale(v3_sub(v3_scale(e1, v2), v3_scale(e2, v1)), 1.0f / det);
    s->dpdv = v3_scale(v3_sub(v3_scale(e2, u1), v3_scale(e1, u2)), 1.0f / det);
}

static inline void pt_place_mesh(pt_effects fx, const struct pt_scene *scene, const struct pt_hit *hit, struct pt_place *at)
{
    const struct pt_shape *shape = at->shape;
    const struct pt_mesh *mesh = &scene->meshes[shape->data];
    const struct pt_corners k = pt_mesh_corners(mesh, hit->primitive);
    pt_vec3 a = k.a->p, b = k.b->p, c = k.c->p;
    struct pt_surface *s = &at->s;
    at->p = pt_corners_mix(a, b, c, hit->u, hit->v);
    at->error =
        v3_scale(v3(pt_max3_abs(a.x, b.x, c.x), pt_max3_abs(a.y, b.y, c.y), pt_max3_abs(a.z, b.z, c.z)), PT_OFFSET_ERROR);
    pt_vec3 n = v3_unit(hit->geometric);
    s->n_geometric = s->n_shading = shape->flip_normal ? v3_neg(n) : n;
    if (mesh->has_normals) {
        pt_vec3 ns = v3_norm(pt_corners_mix(k.a->n, k.b->n, k.c->n, hit->u, hit->v));
        if (!v3_is_black(ns)) {
            s->n_shading = ns;
            s->n_geometric = v3_dot(ns, s->n_geometric) < 0.0f ? v3_neg(s->n_geometric) : s->n_geometric;
        }
    }
    if (fx & (PT_FX_TEXTURE | PT_FX_ALPHA | PT_FX_BUMP))
        pt_place_uv(mesh, k, hit->u, hit->v, s);
    const struct pt_material *m = &scene->materials[shape->material];
    if ((fx & (PT_FX_BUMP | PT_FX_GLOSSY | PT_FX_MIX)) && (m->kind == PT_MATERIAL_MIX || pt_material_needs_tangents(fx, m)))
        pt_place_tangents(mesh, k, s);
}

static inline void pt_place_quadric(const struct pt_scene *scene, const struct pt_hit *hit, struct pt_place *at)
{
    const struct pt_quadric *q = &scene->quadrics[at->shape->data];
    struct pt_quadric_point point;
    pt_quadric_at(q, hit->geometric, &point);
    at->p = point.p;
    at->error = point.error;
    pt_vec3 n = v3_unit(point.n);
    at->s.n_geometric = at->s.n_shading = at->shape->flip_normal ? v3_neg(n) : n;
    pt_quadric_uv(q, hit->geometric, &at->s.u, &at->s.v, &at->s.dpdu, &at->s.dpdv);
}

/* Of a huge quadric the place on the ray is known far better than that on the surface: a ball of radius 1e5 as a floor. */
static inline void pt_place_on_ray(const struct pt_ray *ray, float t, struct pt_place *at)
{
    pt_vec3 o = ray->origin, way = v3_scale(ray->direction, t), e = at->error;
    pt_vec3 error = v3_scale(v3_add(v3_abs(o), v3_abs(way)), PT_OFFSET_ERROR);
    if (16.0f * (error.x + error.y + error.z) < e.x + e.y + e.z) {
        at->p = v3_add(o, way);
        at->error = error;
    }
}

/* Object → render space. Out of line in surface.c: only instances need it. */
void pt_place_instance(const struct pt_scene *scene, int32_t instance, float time, struct pt_place *at);

/* For a lamp with an alpha mask: the share of its light that the mask leaves where the sample was taken. A lamp of alpha 0
 * all over keeps its light though no ray can meet it, as in pbrt-v4: *light becomes one that no other strategy finds. */
float pt_place_lamp_alpha(const struct pt_scene *scene, struct pt_light_sample *light);

/* All of *at but for the fields that the effect set never reads. */
static inline void pt_place_at_hit(pt_effects fx, const struct pt_scene *scene, const struct pt_ray *ray,
                                   const struct pt_hit *hit, struct pt_place *at)
{
    at->shape = &scene->shapes[hit->shape];
    at->primitive = hit->primitive;
    const int quadric = (fx & PT_FX_QUADRIC) && at->shape->kind == PT_SHAPE_QUADRIC;
    if (quadric)
        pt_place_quadric(scene, hit, at);
    else
        pt_place_mesh(fx, scene, hit, at);
    if ((fx & PT_FX_INSTANCES) && hit->instance >= 0)
        pt_place_instance(scene, hit->instance, ray->time, at);
    else if (quadric)
        pt_place_on_ray(ray, hit->t, at);
}

#endif
