/*
 * Huge triangles, of a floor or a wall of cards, are cut up around the origin of render space, where the camera or what it
 * sees is: of a triangle, floats know a place only relative to its corners. An edge is cut in the middle when it is longer
 * than its distance from the origin. That depends on nothing but the edge, so that neighbours agree and no cracks arise.
 */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pbrt/build.h"

/* Triangles that are less than 2^this times as large as near stay whole: at 8e-7 of their size (geom/offset.h) the place is
 * known to 0.3 % of the distance. */
enum { KEPT_HALVINGS = 12 };
/* Beyond this, and what stands near it, doubles do not say where such a triangle is that is turned. */
static const double largest_size = 3e13;
/* Of the largest coordinate: edges that are shorter are never cut. A triangle that the origin touches would be cut for ever,
 * and says nothing of how near anything else is: it is none that is huge. */
static const double shortest = 1e-14;

struct corner {
    double p[3], n[3], uv[2]; /* as in the soup */
    double q[3];              /* in render space */
};

struct cutting {
    double min2;        /* the square of the shortest edge to cut */
    int deepest;        /* halvings that were wanted of a triangle */
    int touched;        /* more than shortest edges allow */
    struct pt_cut *out; /* NULL: count them only */
    size_t room[4];
    int failed; /* out of memory */
};

static void between(const struct corner *a, const struct corner *b, struct corner *out)
{
    for (int i = 0; i < 3; i++) {
        out->p[i] = 0.5 * (a->p[i] + b->p[i]);
        out->q[i] = 0.5 * (a->q[i] + b->q[i]);
        out->n[i] = 0.5 * (a->n[i] + b->n[i]);
    }
    for (int i = 0; i < 2; i++)
        out->uv[i] = 0.5 * (a->uv[i] + b->uv[i]);
}

static double dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* The same bits whichever end comes first. */
static int is_long(struct cutting *c, const struct corner *from, const struct corner *to)
{
    const double *a = from->q, *b = to->q;
    if (memcmp(a, b, sizeof from->q) > 0) {
        a = to->q;
        b = from->q;
    }
    const double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, length2 = dot(d, d);
    if (!(length2 > 0))
        return 0;
    const double t = fmin(1, fmax(0, -dot(a, d) / length2)), near[3] = {a[0] + t * d[0], a[1] + t * d[1], a[2] + t * d[2]};
    const int is_longer = length2 > dot(near, near);
    c->touched |= is_longer && !(length2 > c->min2);
    return is_longer && length2 > c->min2;
}

static void push(struct cutting *c, int array, double **items, size_t at, const double *v, size_t count)
{
    for (size_t i = 0; i < count && !c->failed; i++) {
        c->failed = !pt_grow((void **)items, &c->room[array], at + i, sizeof **items);
        if (!c->failed)
            (*items)[at + i] = v[i];
    }
}

static void keep(struct cutting *c, const struct corner *const corners[3])
{
    struct pt_cut *out = c->out;
    for (int k = 0; k < 3 && out && !c->failed; k++) {
        const size_t i = out->corners;
        push(c, 0, &out->p, 3 * i, corners[k]->p, 3);
        push(c, 1, &out->n, 3 * i, corners[k]->n, 3);
        push(c, 2, &out->uv, 2 * i, corners[k]->uv, 2);
        c->failed = c->failed || !pt_grow((void **)&out->indices, &c->room[3], i, sizeof *out->indices);
        if (!c->failed)
            out->indices[out->corners++] = (uint32_t)i;
    }
}

/* Edge k is that from corner k to the next. Each halving leaves edges half as long at most, so that the recursion ends. */
static void cut(struct cutting *c, const struct corner *k0, const struct corner *k1, const struct corner *k2, int depth)
{
    const struct corner *k[3] = {k0, k1, k2};
    struct corner m[3];
    int is_cut[3], count = 0, first = 0;
    for (int i = 0; i < 3; i++) {
        count += is_cut[i] = is_long(c, k[i], k[(i + 1) % 3]);
        between(k[i], k[(i + 1) % 3], &m[i]);
    }
    c->deepest = depth > c->deepest ? depth : c->deepest;
    if (count == 0 || c->failed || (!c->out && c->touched)) {
        keep(c, k);
        return;
    }
    /* So that edge `first` is the only one that is cut, or the one after the only one that is not. */
    while (count < 3 && !(is_cut[first] && (count == 1 || !is_cut[(first + 2) % 3])))
        first++;
    const int second = (first + 1) % 3, third = (first + 2) % 3;
    const struct corner *a = k[first], *b = k[second], *d = k[third], *ab = &m[first], *bd = &m[second], *da = &m[third];
    if (count == 1) {
        cut(c, a, ab, d, depth + 1);
        cut(c, ab, b, d, depth + 1);
        return;
    }
    cut(c, ab, b, bd, depth + 1);
    cut(c, a, ab, count == 2 ? bd : da, depth + 1);
    cut(c, count == 2 ? a : da, bd, d, depth + 1);
    if (count == 3)
        cut(c, ab, bd, da, depth + 1);
}

static double value(const double *d, const float *f, size_t i) { return d ? d[i] : f ? (double)f[i] : 0; }

/* The corner of a triangle. */
static size_t index_of(const struct pt_soup *soup, size_t corner)
{
    return soup->indices_d ? (size_t)soup->indices_d[corner] : soup->indices[corner];
}

static void position(const struct pt_soup *soup, size_t vertex, double p[3])
{
    for (size_t x = 0; x < 3; x++)
        p[x] = value(soup->pd, soup->pf, 3 * vertex + x);
}

/* Whether the triangle is further away than twice its edges, which grow by less than sqrt(stretch2): as nearly all are. */
static int is_small(const struct pt_soup *soup, size_t triangle, const struct pt_xform *to_render, double stretch2)
{
    double p[3][3], q[3], longest2 = 0;
    for (size_t j = 0; j < 3; j++)
        position(soup, index_of(soup, 3 * triangle + j), p[j]);
    for (int j = 1; j < 3; j++) {
        const double d[3] = {p[j][0] - p[0][0], p[j][1] - p[0][1], p[j][2] - p[0][2]};
        longest2 = fmax(longest2, dot(d, d));
    }
    pt_xform_point(to_render, p[0], q);
    return dot(q, q) > 9 * stretch2 * longest2;
}

static void cut_triangle(struct cutting *c, const struct pt_soup *soup, size_t triangle, const struct pt_xform *to_render)
{
    static const double uvs[3][2] = {{0, 0}, {1, 0}, {1, 1}}; /* of a triangle that has none */
    struct corner k[3];
    for (size_t j = 0; j < 3; j++) {
        const size_t at = index_of(soup, 3 * triangle + j);
        position(soup, at, k[j].p);
        for (size_t x = 0; x < 3; x++)
            k[j].n[x] = value(soup->nd, soup->nf, 3 * at + x);
        for (size_t x = 0; x < 2; x++)
            k[j].uv[x] = soup->uvd || soup->uvf ? value(soup->uvd, soup->uvf, 2 * at + x) : uvs[j][x];
        pt_xform_point(to_render, k[j].p, k[j].q);
    }
    cut(c, &k[0], &k[1], &k[2], 0);
}

/* Whether one of them is huge; *touched: whether the origin touches one. */
static int some_are_huge(struct cutting *c, const struct pt_soup *soup, const struct pt_xform *to_render, int *touched)
{
    double stretch2 = 0;
    int huge = 0;
    for (int i = 0; i < 9; i++)
        stretch2 += to_render->m[i / 3][i % 3] * to_render->m[i / 3][i % 3];
    for (size_t i = 0; i < soup->triangle_count; i++) {
        if (is_small(soup, i, to_render, stretch2))
            continue;
        c->deepest = c->touched = 0;
        cut_triangle(c, soup, i, to_render);
        huge |= !c->touched && c->deepest > KEPT_HALVINGS;
        *touched |= c->touched;
    }
    return huge;
}

int pt_build_cut(const struct pt_soup *soup, const struct pt_xform *to_render, struct pt_cut *out)
{
    struct cutting c = {0};
    double most = 0;
    *out = (struct pt_cut){.soup = *soup};
    for (size_t i = 0; i < soup->vertex_count; i++) {
        double p[3], q[3];
        position(soup, i, p);
        pt_xform_point(to_render, p, q);
        most = fmax(most, dot(q, q));
    }
    c.min2 = most * shortest * shortest;
    if (!isfinite(most)) /* refused by whom it is for */
        return 1;
    int touched = 0;
    const int huge = some_are_huge(&c, soup, to_render, &touched);
    out->is_lost = touched && most > largest_size * largest_size;
    if (!huge && !out->is_lost)
        return 1;
    c.out = out;
    for (size_t i = 0; i < soup->triangle_count && !c.failed; i++) {
        c.touched = 0;
        cut_triangle(&c, soup, i, to_render);
    }
    out->soup = (struct pt_soup){.vertex_count = out->corners,
                                 .triangle_count = out->corners / 3,
                                 .pd = out->p,
                                 .nd = soup->nd || soup->nf ? out->n : NULL,
                                 .uvd = out->uv,
                                 .indices = out->indices};
    return !c.failed;
}

void pt_cut_release(struct pt_cut *cut_up)
{
    free(cut_up->p);
    free(cut_up->n);
    free(cut_up->uv);
    free(cut_up->indices);
}

/* The same of a mesh that is stored in an object's space. */
static int cut_mesh(struct pt_builder *b, const struct pt_xform *to_render, struct pt_mesh *mesh)
{
    const size_t n = mesh->vertex_count;
    double *all = malloc(n * 8 * sizeof *all), *p = all, *normals = all + 3 * n, *uv = all + 6 * n;
    struct pt_soup soup = {.vertex_count = n, .triangle_count = mesh->triangle_count, .pd = p, .indices = mesh->indices};
    struct pt_cut cut_up = {0};
    struct pt_vertex *v = NULL;
    uint32_t *indices = NULL;
    for (size_t i = 0; all && i < 3 * n; i++) {
        const struct pt_vertex *from = &mesh->vertices[i / 3];
        p[i] = (double)(&from->p.x)[i % 3];
        normals[i] = (double)(&from->n.x)[i % 3];
        uv[2 * (i / 3)] = (double)from->u;
        uv[2 * (i / 3) + 1] = (double)from->v;
    }
    soup.nd = mesh->has_normals ? normals : NULL;
    soup.uvd = mesh->has_uvs ? uv : NULL;
    int ok = all && pt_build_cut(&soup, to_render, &cut_up);
    if (ok && cut_up.corners > 0) {
        v = pt_arena_alloc(&b->scene->arena, cut_up.corners + 1, sizeof *v); /* one more: to begin at a multiple of 32 */
        indices = pt_arena_alloc(&b->scene->arena, cut_up.corners, sizeof *indices);
        ok = v && indices;
    }
    if (ok && v) {
        v = (struct pt_vertex *)(((uintptr_t)v + sizeof *v - 1) & ~(uintptr_t)(sizeof *v - 1));
        for (size_t i = 0; i < 3 * cut_up.corners; i++) {
            (&v[i / 3].p.x)[i % 3] = (float)cut_up.p[i];
            (&v[i / 3].n.x)[i % 3] = (float)cut_up.n[i];
            v[i / 3].u = (float)cut_up.uv[2 * (i / 3)];
            v[i / 3].v = (float)cut_up.uv[2 * (i / 3) + 1];
        }
        memcpy(indices, cut_up.indices, cut_up.corners * sizeof *indices);
        *mesh = (struct pt_mesh){(uint32_t)cut_up.corners, (uint32_t)cut_up.corners / 3, v, indices, mesh->has_normals, 1};
    }
    pt_cut_release(&cut_up);
    free(all);
    return ok ? 0 : pt_diag_nomem(&b->diag, "a mesh");
}

/* Bounds in an object's space. */
struct bounds {
    double low[3], high[3];
};

static void add_point(struct bounds *to, const double p[3])
{
    for (int k = 0; k < 3; k++) {
        to->low[k] = fmin(to->low[k], p[k]);
        to->high[k] = fmax(to->high[k], p[k]);
    }
}

static const struct bounds nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static struct bounds bounds_of(const struct pt_mesh *mesh)
{
    struct bounds all = nothing;
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        const pt_vec3 v = mesh->vertices[i].p;
        add_point(&all, (double[3]){(double)v.x, (double)v.y, (double)v.z});
    }
    return all;
}

/* Whether bounds that are moved by t are as large against their distance as a triangle that is cut. */
static int may_be_huge(const struct bounds *own, const struct pt_xform *t)
{
    struct bounds moved = nothing;
    double away[3], size[3], q[3];
    for (int i = 0; i < 8; i++) {
        const double p[3] = {i & 1 ? own->high[0] : own->low[0], i & 2 ? own->high[1] : own->low[1],
                             i & 4 ? own->high[2] : own->low[2]};
        pt_xform_point(t, p, q);
        add_point(&moved, q);
    }
    for (int k = 0; k < 3; k++) {
        size[k] = moved.high[k] - moved.low[k];
        away[k] = fmax(0, fmax(moved.low[k], -moved.high[k])) * (1 << KEPT_HALVINGS);
    }
    return dot(size, size) > dot(away, away);
}

static void cut_instance(struct pt_builder *b, const struct pt_instance *instance, int end, const struct bounds *bounds)
{
    const struct pt_scene *s = b->scene;
    const struct pt_object *o = &s->objects[instance->object];
    const pt_vec3 by = instance->origin;
    struct pt_xform t;
    for (int k = 0; k < 12; k++)
        t.m[k / 4][k % 4] = (double)instance->to_render[end].m[k];
    t = pt_xform_mul(t, pt_xform_translate((double)by.x, (double)by.y, (double)by.z));
    for (int32_t i = o->first_shape; i < o->first_shape + o->shape_count && !b->diag.rc; i++) {
        const int32_t data = s->shapes[i].data;
        if (s->shapes[i].kind == PT_SHAPE_MESH && may_be_huge(&bounds[data], &t))
            cut_mesh(b, &t, &s->meshes[data]);
    }
}

static void scale_vector(float *x, float *y, float *z, float by)
{
    *x *= by;
    *y *= by;
    *z *= by;
}

/* Scales the space of an object, and what its instances do to it in turn. */
static void scale_object(struct pt_builder *b, int32_t object, float by)
{
    struct pt_scene *s = b->scene;
    const struct pt_object *o = &s->objects[object];
    for (int32_t i = o->first_shape; i < o->first_shape + o->shape_count; i++) {
        const int32_t data = s->shapes[i].data;
        if (s->shapes[i].kind == PT_SHAPE_QUADRIC) {
            struct pt_quadric *q = &s->quadrics[data];
            for (int k = 0; k < 12; k++) {
                q->to_render.m[k] *= by;
                q->from_render.m[k] /= k % 4 == 3 ? 1 : by;
            }
            continue;
        }
        struct pt_vertex *v = (struct pt_vertex *)s->meshes[data].vertices; /* in the arena of this scene */
        for (uint32_t k = 0; k < s->meshes[data].vertex_count; k++)
            scale_vector(&v[k].p.x, &v[k].p.y, &v[k].p.z, by);
    }
    for (int32_t i = 0; i < s->instance_count; i++) {
        struct pt_instance *n = &s->instances[i];
        if (n->object != object)
            continue;
        for (int k = 0; k < 24; k++)
            n->to_render[k / 12].m[k % 12] /= k % 4 == 3 ? 1 : by;
        scale_vector(&n->origin.x, &n->origin.y, &n->origin.z, by);
    }
}

/* Objects that instances make huge are kept large: Embree gives no place on a triangle whose area times the length of the
 * ray's direction is below 1e-18 in its space. By powers of two, which round nothing. */
static void scale_objects(struct pt_builder *b)
{
    for (int32_t i = 0; i < b->scene->instance_count; i++) {
        const struct pt_instance *n = &b->scene->instances[i];
        float most = 0;
        for (int k = 0; k < 12; k++)
            most = fmaxf(most, k % 4 == 3 ? 0 : fabsf(n->to_render[0].m[k]));
        if (most > 1 << KEPT_HALVINGS && most < FLT_MAX)
            scale_object(b, n->object, ldexpf(1, ilogbf(most)));
    }
}

int pt_build_cut_instances(struct pt_builder *b)
{
    const struct pt_scene *s = b->scene;
    if (s->instance_count == 0 || s->mesh_count == 0)
        return 0;
    scale_objects(b);
    struct bounds *bounds = malloc((size_t)s->mesh_count * sizeof *bounds);
    if (!bounds)
        return pt_diag_nomem(&b->diag, "a mesh");
    for (int32_t i = 0; i < s->mesh_count; i++)
        bounds[i] = bounds_of(&s->meshes[i]);
    for (int32_t i = 0; i < s->instance_count; i++)
        for (int end = 0; end <= s->instances[i].animated; end++)
            cut_instance(b, &s->instances[i], end, bounds);
    free(bounds);
    return b->diag.rc;
}
