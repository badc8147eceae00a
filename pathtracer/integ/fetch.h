/* What the hits of a run need from memory, asked for before the first is looked at. */
#ifndef PT_INTEG_FETCH_H
#define PT_INTEG_FETCH_H

#include "integ/surface.h"

/* Smaller scenes are in the caches: there is nothing to fetch. */
#define PT_FETCH_TRIANGLES 10000

static inline const struct pt_mesh *pt_hit_mesh(const struct pt_scene *scene, const struct pt_hit *hit)
{
    if (hit->shape < 0 || scene->shapes[hit->shape].kind != PT_SHAPE_MESH)
        return NULL;
    return &scene->meshes[scene->shapes[hit->shape].data];
}

/* The texels of the texture that most hits read first. */
static inline void pt_fetch_texels(const struct pt_scene *scene, struct pt_hit *const *hits, int count)
{
    for (int i = 0; i < count; i++) {
        const struct pt_hit *hit = hits[i];
        const struct pt_mesh *mesh = pt_hit_mesh(scene, hit);
        int32_t texture = mesh ? scene->materials[scene->shapes[hit->shape].material].reflectance.texture : 0;
        if (!texture)
            continue;
        struct pt_surface s;
        pt_place_uv(mesh, pt_mesh_corners(mesh, hit->primitive), hit->u, hit->v, &s);
        pt_texture_fetch(scene, texture, s.u, s.v);
    }
}

/* Indices, then vertices, then texels: where one waits for another, that of all paths was asked for before. */
static inline void pt_fetch_hits(pt_effects fx, const struct pt_scene *scene, struct pt_hit *const *hits, int count)
{
    if (scene->stats.triangles < PT_FETCH_TRIANGLES)
        return;
    for (int i = 0; i < count; i++) {
        const struct pt_mesh *mesh = pt_hit_mesh(scene, hits[i]);
        if (mesh)
            __builtin_prefetch(mesh->indices + 3 * (size_t)hits[i]->primitive);
    }
    for (int i = 0; i < count; i++) {
        const struct pt_mesh *mesh = pt_hit_mesh(scene, hits[i]);
        if (!mesh)
            continue;
        struct pt_corners k = pt_mesh_corners(mesh, hits[i]->primitive);
        __builtin_prefetch(k.a);
        __builtin_prefetch(k.b);
        __builtin_prefetch(k.c);
    }
    if (fx & PT_FX_TEXTURE)
        pt_fetch_texels(scene, hits, count);
}

#endif
