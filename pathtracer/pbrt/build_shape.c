/* Shapes, objects and instances. */
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "pbrt/build.h"
#include "base/pi.h"
#include "pbrt/ply.h"
#include "shade/light_area.h"

/* What is further than so many times its size from the origin of the space in which it is kept loses visible precision in
 * float: it gets an origin of its own. */
static const double far_away = 256;

struct placement {
    struct pt_xform xform; /* the shape's own space → where its vertices are stored */
    int animated;          /* stored about `origin`; `at` places it */
    double origin[3];
    struct pt_xform at[2]; /* own → world at shutter open and close */
};

static double largest(const double v[3]) { return fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2]))); }

/* Bounds in a shape's own space. */
struct box {
    double low[3], high[3];
};

static void box_add(struct box *box, const double p[3], int is_first)
{
    for (int i = 0; i < 3; i++) {
        box->low[i] = is_first ? p[i] : fmin(box->low[i], p[i]);
        box->high[i] = is_first ? p[i] : fmax(box->high[i], p[i]);
    }
}

/* An origin for what lies in `box` and goes where `t` takes it, in that space; stays as it is if that is near enough. */
static void find_origin(const struct pt_xform *t, const struct box *box, double origin[3])
{
    struct box to = {{0}, {0}};
    double size = 0, far = 0;
    for (int corner = 0; corner < 8; corner++) {
        double p[3], q[3];
        for (int i = 0; i < 3; i++)
            p[i] = corner >> i & 1 ? box->high[i] : box->low[i];
        pt_xform_point(t, p, q);
        box_add(&to, q, corner == 0);
    }
    for (int i = 0; i < 3; i++) {
        size = fmax(size, to.high[i] - to.low[i]);
        far = fmax(far, fmax(fabs(to.low[i]), fabs(to.high[i])));
    }
    for (int i = 0; i < 3 && far > far_away * size; i++)
        origin[i] = (double)(float)(0.5 * (to.low[i] + to.high[i])); /* an instance stores it in float */
}

static struct placement place(struct pt_builder *b, const struct pt_params *p, const struct box *box)
{
    struct placement pl = {0};
    const double *origin = b->origin;
    pl.animated = pt_builder_at_shutter(b, b->state->ctm, pl.at);
    pl.xform = pl.at[0];
    if (b->open_object >= 0) {
        struct pt_object_info *info = (struct pt_object_info *)b->object_infos.items + b->open_object;
        if (pl.animated)
            pt_params_warn(p, NULL, "a moving shape within an object stays at its place at shutter open");
        pl.animated = 0;
        if (((struct pt_object *)b->objects.items)[b->open_object].shape_count == 0 && info->wanted.loc.line == 0)
            find_origin(&pl.xform, box, info->origin);
        origin = info->origin;
    } else if (pl.animated) {
        pl.xform = pt_xform_identity();
        find_origin(&pl.xform, box, pl.origin);
        origin = pl.origin;
    }
    for (int i = 0; i < 3; i++)
        pl.xform.m[i][3] -= origin[i];
    return pl;
}

/* Of a mesh its transform may make a flat one; nothing else is left. */
static int leave_out_flattened(struct pt_builder *b, struct pt_loc loc, const char *what)
{
    pt_diag_warn(&b->diag, loc, "a transform without an inverse (Scale 0) leaves nothing of %s", what);
    return b->diag.rc;
}

/* Whether rays from about the camera cannot be brought into its space, which Embree does in single precision: coordinates
 * beyond 1e18 are none to it. */
static int is_flat(const struct pt_builder *b, const struct pt_xform *at)
{
    const struct pt_xform t = pt_builder_to_render(b, *at);
    struct pt_xform inverse;
    double most = 0, away = 1e4;
    if (!pt_xform_invert(&t, &inverse) || fabs(pt_xform_det(&t)) < (double)FLT_MIN)
        return 1;
    for (int i = 0; i < 3; i++) {
        away = fmax(away, fabs(t.m[i][3]));
        most = fmax(most, largest(inverse.m[i]));
    }
    return !(most * away < 5e16);
}

/* Places an object that is kept about `origin`. What grows from nothing does so from a millionth of what it becomes: rays
 * have to find into its space at all times. */
static int add_instance(struct pt_builder *b, int32_t object, const struct pt_xform at[2], const double origin[3],
                        struct pt_loc loc)
{
    struct pt_instance instance = {.object = object, .animated = !pt_xform_equal(&at[0], &at[1])};
    const struct pt_xform shift = pt_xform_translate(origin[0], origin[1], origin[2]);
    const int flat[2] = {is_flat(b, &at[0]), is_flat(b, &at[1])};
    int turns = 0;
    if (!(fmax(fabs(pt_xform_det(&at[0])), fabs(pt_xform_det(&at[1]))) < (double)FLT_MAX))
        return pt_diag_fail(&b->diag, loc, "the scale of an instance is too large for floats");
    if (flat[0] && flat[1])
        return leave_out_flattened(b, loc, "an instance");
    for (int i = 0; i < 9; i++)
        turns |= at[0].m[i / 3][i % 3] != at[1].m[i / 3][i % 3];
    for (int i = 0; i < 2; i++) {
        struct pt_xform t = pt_builder_to_render(b, at[i]);
        for (int k = 0; k < 9 && flat[i]; k++)
            t.m[k / 3][k % 3] += 1e-6 * at[1 - i].m[k / 3][k % 3];
        if (!turns)
            t = pt_xform_mul(t, shift);
        instance.to_render[i] = pt_xform_to_mat34(t);
    }
    if (turns) /* not about the object's origin, but about the one that the file has */
        instance.origin = v3((float)origin[0], (float)origin[1], (float)origin[2]);
    pt_builder_effect(b, PT_FX_INSTANCES | (instance.animated ? PT_FX_MOTION : 0u), loc);
    return pt_list_add(b, &b->instances, &instance) < 0 ? b->diag.rc : 0;
}

/* What every shape has: material, alpha, media, side, light. */
static struct pt_shape common(struct pt_builder *b, struct pt_params *p)
{
    const struct pt_state *s = b->state;
    struct pt_shape shape = {.light = -1, .medium_in = s->medium_in, .medium_out = s->medium_out};
    shape.material = s->material >= 0 ? s->material : pt_build_default_material(b);
    shape.flip_normal = s->reverse_orientation != 0;
    shape.alpha = pt_build_float_input(b, p, "alpha", 1);
    if (shape.material >= 0) {
        const struct pt_material_info *info = &((struct pt_material_info *)b->material_infos.items)[shape.material];
        if (info->has_opacity)
            shape.alpha = pt_input_product(b, shape.alpha, info->opacity);
        shape.has_opacity = info->has_opacity;
    }
    shape.has_alpha = shape.alpha.texture || shape.alpha.value.x < 1;
    if (shape.has_alpha)
        pt_builder_effect(b, PT_FX_ALPHA | (shape.alpha.texture ? PT_FX_TEXTURE : 0u), p->loc);
    if (pt_params_find(p, "shadowalpha"))
        pt_params_warn(p, "shadowalpha", "shadowalpha is ignored: shadows follow alpha");
    pt_params_ignore(p, "shadowalpha");
    return shape;
}

static int is_interface(const struct pt_builder *b, int32_t material)
{
    return material >= 0 && ((struct pt_material *)b->materials.items)[material].kind == PT_MATERIAL_INTERFACE;
}

/* Stores a finished shape with its light, or as a moving object of its own. */
static int add_shape(struct pt_builder *b, struct pt_params *p, const struct placement *pl, struct pt_shape *shape,
                     double area)
{
    const struct pt_state *s = b->state;
    pt_params_check_used(p);
    if (b->diag.rc)
        return b->diag.rc;
    if (s->area.on && (b->open_object >= 0 || pl->animated))
        pt_diag_warn(&b->diag, s->area.loc, "area lights in objects and on moving shapes do not emit");
    else if (s->area.on && is_interface(b, shape->material)) /* as in pbrt-v4: rays go through it */
        pt_params_warn(p, NULL, "an area light of interface material does not emit");
    else if (s->area.on && !v3_is_black(s->area.emission))
        shape->light = pt_build_shape_light(b, &s->area, area);
    if (is_interface(b, shape->material))
        pt_builder_effect(b, PT_FX_INTERFACE, p->loc);
    if (b->open_object >= 0) {
        struct pt_object *o = &((struct pt_object *)b->objects.items)[b->open_object];
        o->shape_count++;
        pt_list_add(b, &b->object_shapes, shape);
    } else if (pl->animated) {
        struct pt_object object = {(int32_t)b->object_shapes.count, 1};
        pt_list_add(b, &b->object_infos, &(struct pt_object_info){0});
        int32_t id = pt_list_add(b, &b->objects, &object);
        pt_list_add(b, &b->object_shapes, shape);
        add_instance(b, id, pl->at, pl->origin, p->loc);
    } else {
        pt_list_add(b, &b->world_shapes, shape);
    }
    return b->diag.rc;
}

static double value(const double *d, const float *f, size_t i) { return d ? d[i] : (double)f[i]; }

/* Vertices in double, stored in float. 0 when one is not finite there. */
static int store_positions(const struct pt_soup *soup, const struct pt_xform *t, struct pt_vertex *out)
{
    for (size_t i = 0; i < soup->vertex_count; i++) {
        double p[3], q[3];
        for (size_t k = 0; k < 3; k++)
            p[k] = value(soup->pd, soup->pf, 3 * i + k);
        pt_xform_point(t, p, q);
        out[i].p = v3((float)q[0], (float)q[1], (float)q[2]);
        if (!isfinite(out[i].p.x) || !isfinite(out[i].p.y) || !isfinite(out[i].p.z))
            return 0;
    }
    return 1;
}

/* Normals keep the lengths that they are given with, which are their weights between the corners, as in pbrt; but not what
 * the transform does to all of them alike, and none may leave float's range when its length is squared. What has no length,
 * or a component that is no number, is no normal: zero. */
static void store_normals(const struct pt_soup *soup, const struct pt_xform *inverse, int negate, struct pt_vertex *out)
{
    const double most = fmax(largest(inverse->m[0]), fmax(largest(inverse->m[1]), largest(inverse->m[2])));
    for (size_t i = 0; i < soup->vertex_count; i++) {
        double n[3], o[3];
        for (size_t k = 0; k < 3; k++)
            n[k] = value(soup->nd, soup->nf, 3 * i + k) / most;
        for (size_t k = 0; k < 3; k++)
            o[k] = inverse->m[0][k] * n[0] + inverse->m[1][k] * n[1] + inverse->m[2][k] * n[2];
        double size = largest(o), by = negate ? -1 : 1;
        if (!(size > 0 && isfinite(o[0] + o[1] + o[2])))
            by = 0;
        else if (size < 1e-15 || size > 1e15)
            by /= size;
        out[i].n = by != 0 ? v3((float)(by * o[0]), (float)(by * o[1]), (float)(by * o[2])) : v3_splat(0);
    }
}

static double mesh_area(const struct pt_mesh *m)
{
    double area = 0;
    for (size_t i = 0; i < m->triangle_count; i++) {
        const uint32_t *index = m->indices + 3 * i;
        pt_vec3 p = m->vertices[index[0]].p, q = m->vertices[index[1]].p, r = m->vertices[index[2]].p;
        double e1[3] = {(double)q.x - (double)p.x, (double)q.y - (double)p.y, (double)q.z - (double)p.z};
        double e2[3] = {(double)r.x - (double)p.x, (double)r.y - (double)p.y, (double)r.z - (double)p.z};
        double c[3] = {e1[1] * e2[2] - e1[2] * e2[1], e1[2] * e2[0] - e1[0] * e2[2], e1[0] * e2[1] - e1[1] * e2[0]};
        area += 0.5 * sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    }
    return area;
}

static int store_mesh(struct pt_builder *b, struct pt_params *p, const struct pt_soup *soup, const struct pt_xform *t,
                      struct pt_mesh *m)
{
    struct pt_arena *arena = &b->scene->arena;
    struct pt_xform inverse;
    size_t n = soup->vertex_count;
    struct pt_vertex *vertices = pt_arena_alloc(arena, n + 1, sizeof *vertices); /* one more: to begin at a multiple of 32 */
    uint32_t *indices = pt_arena_alloc(arena, soup->triangle_count, 3 * sizeof *indices);
    int has_n = (soup->nd || soup->nf) && pt_xform_invert(t, &inverse), has_uv = soup->uvd || soup->uvf;
    if (!vertices || !indices)
        return pt_diag_nomem(&b->diag, "a mesh");
    vertices = (struct pt_vertex *)(((uintptr_t)vertices + sizeof *vertices - 1) & ~(uintptr_t)(sizeof *vertices - 1));
    if (!store_positions(soup, t, vertices))
        return pt_params_fail(p, soup->pd ? "P" : "filename", "a vertex is not finite after its transform");
    if (has_n)
        store_normals(soup, &inverse, b->state->reverse_orientation, vertices);
    for (size_t i = 0; has_uv && i < n; i++) {
        vertices[i].u = (float)value(soup->uvd, soup->uvf, 2 * i);
        vertices[i].v = (float)value(soup->uvd, soup->uvf, 2 * i + 1);
    }
    for (size_t i = 0; i < 3 * soup->triangle_count; i++)
        indices[i] = soup->indices_d ? (uint32_t)soup->indices_d[i] : soup->indices[i];
    *m = (struct pt_mesh){(uint32_t)n, (uint32_t)soup->triangle_count, vertices, indices, has_n, has_uv};
    return 0;
}

static int store_cut(struct pt_builder *b, struct pt_params *p, const struct pt_soup *soup, const struct placement *pl,
                     struct pt_mesh *m)
{
    const struct pt_xform to_render = pt_builder_to_render(b, pl->at[0]);
    struct pt_cut cut_up;
    int rc = pt_build_cut(soup, &to_render, &cut_up) ? store_mesh(b, p, &cut_up.soup, &pl->xform, m)
                                                     : pt_diag_nomem(&b->diag, "a mesh");
    if (!rc && cut_up.is_lost)
        pt_params_warn(p, NULL, "a triangle is more than 3e13 times as large as its distance: its place is not known there");
    pt_cut_release(&cut_up);
    return rc ? rc : b->diag.rc;
}

int pt_build_mesh(struct pt_builder *b, struct pt_params *p, const struct pt_soup *soup)
{
    struct pt_mesh mesh;
    struct box box = {{0}, {0}};
    if (soup->triangle_count == 0 || soup->vertex_count == 0) {
        pt_params_warn(p, NULL, "a mesh without triangles is left out");
        pt_params_ignore(p, "alpha shadowalpha");
        pt_params_check_used(p);
        return b->diag.rc;
    }
    if (soup->vertex_count > INT32_MAX || soup->triangle_count > INT32_MAX)
        return pt_params_fail(p, NULL, "a mesh of %zu triangles is too large", soup->triangle_count);
    for (size_t i = 0; i < soup->vertex_count; i++) {
        const double v[3] = {value(soup->pd, soup->pf, 3 * i), value(soup->pd, soup->pf, 3 * i + 1),
                             value(soup->pd, soup->pf, 3 * i + 2)};
        box_add(&box, v, i == 0);
    }
    struct placement pl = place(b, p, &box);
    struct pt_shape shape = common(b, p);
    if (b->diag.rc || store_cut(b, p, soup, &pl, &mesh) != 0)
        return b->diag.rc;
    shape.kind = PT_SHAPE_MESH;
    /* corners that a mirroring transform has moved go round the other way; a quadric's normal it carries along */
    if (pt_xform_det(&pl.xform) < 0)
        shape.flip_normal = !shape.flip_normal;
    shape.data = pt_list_add(b, &b->meshes, &mesh);
    return add_shape(b, p, &pl, &shape, b->state->area.on && b->state->area.power > 0 ? mesh_area(&mesh) : 0);
}

int pt_build_check_index(const struct pt_params *p, double v, size_t vertex_count)
{
    if (v >= 0 && v < (double)vertex_count)
        return 0;
    return pt_params_fail(p, "indices", "index %.0f out of range (expected 0 to %zu)", v,
                          vertex_count > 0 ? vertex_count - 1 : 0);
}

/* The vertices of triangles, each in [0, vertex_count). */
static int read_indices(struct pt_params *p, size_t vertex_count, const double **out, size_t *count)
{
    static const double triangle[3] = {0, 1, 2};
    *out = pt_params_ints(p, "indices", count);
    if (p->diag->rc)
        return p->diag->rc;
    if (!*out && vertex_count != 3)
        return pt_params_fail(p, NULL, "a trianglemesh of %zu vertices needs \"integer indices\"", vertex_count);
    if (!*out) {
        *out = triangle;
        *count = 3;
    }
    if (*count % 3 != 0)
        return pt_params_fail(p, "indices", "%zu indices (expected a multiple of 3)", *count);
    for (size_t i = 0; i < *count && !p->diag->rc; i++)
        pt_build_check_index(p, (*out)[i], vertex_count);
    return p->diag->rc;
}

static int is_empty(const struct pt_params *p, const char *name)
{
    const struct pt_param *list = pt_params_find(p, name);
    return list && list->count == 0;
}

static int make_triangle_mesh(struct pt_builder *b, struct pt_params *p)
{
    struct pt_soup soup = {0};
    size_t n_count, uv_count, index_count;
    soup.pd = pt_params_floats(p, "P", 3, &soup.vertex_count);
    /* So exporters write an object without faces; to pbrt-v4 three points without indices are a triangle. */
    if (!b->diag.rc && (is_empty(p, "P") || (is_empty(p, "indices") && (b->is_v3 || soup.vertex_count != 3)))) {
        pt_params_ignore(p, "indices N S uv st faceIndices discarddegenerateUVs");
        return pt_build_mesh(b, p, &(struct pt_soup){0});
    }
    if (!soup.pd)
        return pt_params_fail(p, NULL, "a trianglemesh needs \"point3 P\"");
    soup.nd = pt_params_floats(p, "N", 3, &n_count);
    const char *uv_name = pt_params_find(p, "uv") ? "uv" : pt_params_find(p, "st") ? "st" : "UV";
    soup.uvd = pt_params_floats(p, uv_name, 2, &uv_count);
    if (soup.nd && n_count != soup.vertex_count)
        return pt_params_fail(p, "N", "%zu normals for %zu vertices", n_count, soup.vertex_count);
    if (soup.uvd && uv_count != soup.vertex_count)
        return pt_params_fail(p, uv_name, "%zu texture coordinates for %zu vertices", uv_count, soup.vertex_count);
    if (read_indices(p, soup.vertex_count, &soup.indices_d, &index_count) != 0)
        return b->diag.rc;
    soup.triangle_count = index_count / 3;
    pt_params_ignore(p, "S faceIndices discarddegenerateUVs");
    return pt_build_mesh(b, p, &soup);
}

/* The arrays of the file go as soon as the mesh is stored: nothing large is kept twice for long. */
static int make_ply_mesh(struct pt_builder *b, struct pt_params *p)
{
    char path[2048];
    char *bytes = NULL;
    size_t size = 0;
    struct pt_ply ply = {0};
    struct base_err err = {0};
    const char *name = pt_params_string(p, "filename", NULL);
    if (!name)
        return pt_params_fail(p, NULL, "a plymesh needs \"string filename\"");
    struct pt_loc loc = pt_params_find(p, "filename")->loc;
    pt_builder_path(b, name, path, sizeof path);
    int rc = b->source->read(b->source->data, path, &bytes, &size, &err);
    if (!rc)
        rc = pt_ply_parse(path, bytes, size, &ply, &err);
    free(bytes);
    if (rc)
        return pt_diag_fail_code(&b->diag, rc == BASE_ENOMEM ? rc : BASE_EINVAL, loc, "cannot read %s", err.text);
    if (ply.corner_uvs)
        pt_diag_warn(&b->diag, loc, "%s: texture coordinates per face corner are ignored (expected those of vertices)",
                     path);
    if (pt_params_find(p, "displacement")) {
        pt_params_warn(p, "displacement", "displacement of a plymesh's vertices is ignored");
        pt_params_ignore(p, "displacement edgelength");
    }
    struct pt_soup soup = {.vertex_count = ply.vertex_count,
                           .triangle_count = ply.triangle_count,
                           .pf = ply.positions,
                           .nf = ply.normals,
                           .uvf = ply.uvs,
                           .indices = ply.indices};
    pt_build_mesh(b, p, &soup);
    pt_ply_release(&ply);
    return b->diag.rc;
}

static int add_quadric(struct pt_builder *b, struct pt_params *p, struct pt_quadric *q)
{
    const double r = (double)q->radius;
    const struct box box = {{-r, -r, (double)q->z_min}, {r, r, (double)q->z_max}};
    struct pt_xform inverse;
    struct placement pl = place(b, p, &box);
    struct pt_shape shape = common(b, p);
    q->phi_max = (float)(fmin(pt_params_float_in(p, "phimax", 360, 1e-3, 1e30), 360) * BASE_PI / 180);
    if (!pt_xform_invert(&pl.xform, &inverse)) {
        pt_params_check_used(p);
        return leave_out_flattened(b, p->loc, pt_params_kind(p));
    }
    q->to_render = pt_xform_to_mat34(pl.xform);
    q->from_render = pt_xform_to_mat34(inverse);
    if (b->diag.rc)
        return b->diag.rc;
    shape.kind = PT_SHAPE_QUADRIC;
    shape.data = pt_list_add(b, &b->quadrics, q);
    pt_builder_effect(b, PT_FX_QUADRIC, p->loc);
    return add_shape(b, p, &pl, &shape, b->state->area.on && b->state->area.power > 0 ? pt_light_quadric_area(q) : 0);
}

static int make_sphere(struct pt_builder *b, struct pt_params *p)
{
    double r = pt_params_float_in(p, "radius", 1, 1e-30, 1e30);
    double zmin = pt_params_float(p, "zmin", -r), zmax = pt_params_float(p, "zmax", r);
    double z0 = fmax(fmin(zmin, zmax), -r), z1 = fmin(fmax(zmin, zmax), r);
    if (!(z0 < z1))
        return pt_params_fail(p, pt_params_find(p, "zmin") ? "zmin" : "zmax",
                              "nothing of the sphere of radius %g is between zmin %g and zmax %g", r, zmin, zmax);
    struct pt_quadric q = {.kind = PT_QUADRIC_SPHERE, .radius = (float)r, .z_min = (float)z0, .z_max = (float)z1};
    return add_quadric(b, p, &q);
}

static int make_disk(struct pt_builder *b, struct pt_params *p)
{
    double r = pt_params_float_in(p, "radius", 1, 1e-30, 1e30), h = pt_params_float(p, "height", 0);
    double inner = pt_params_float_in(p, "innerradius", 0, 0, 1e30);
    if (!(inner < r))
        return pt_params_fail(p, "innerradius", "innerradius %g is not below radius %g", inner, r);
    struct pt_quadric q = {
        .kind = PT_QUADRIC_DISK, .radius = (float)r, .inner_radius = (float)inner, .z_min = (float)h, .z_max = (float)h};
    return add_quadric(b, p, &q);
}

static int make_cylinder(struct pt_builder *b, struct pt_params *p)
{
    double r = pt_params_float_in(p, "radius", 1, 1e-30, 1e30);
    double z0 = pt_params_float(p, "zmin", -1), z1 = pt_params_float(p, "zmax", 1);
    if (z0 == z1)
        return pt_params_fail(p, pt_params_find(p, "zmin") ? "zmin" : "zmax", "zmin and zmax are both %g", z0);
    struct pt_quadric q = {
        .kind = PT_QUADRIC_CYLINDER, .radius = (float)r, .z_min = (float)fmin(z0, z1), .z_max = (float)fmax(z0, z1)};
    return add_quadric(b, p, &q);
}

static int make_nurbs(struct pt_builder *b, struct pt_params *p)
{
    pt_params_warn(p, NULL, "shape \"%s\" is left out", pt_params_kind(p));
    return b->diag.rc;
}

int pt_build_shape(struct pt_builder *b, struct pt_params *p)
{
    static const struct shape_kind {
        const char *name;
        int (*make)(struct pt_builder *b, struct pt_params *p);
    } kinds[] = {{"plymesh", make_ply_mesh},
                 {"trianglemesh", make_triangle_mesh},
                 {"sphere", make_sphere},
                 {"disk", make_disk},
                 {"cylinder", make_cylinder},
                 {"loopsubdiv", pt_build_loop_subdiv},
                 {"bilinearmesh", pt_build_bilinear},
                 {"curve", pt_build_curve},
                 {"heightfield", pt_build_height_field},
                 {"cone", pt_build_revolved},
                 {"paraboloid", pt_build_revolved},
                 {"hyperboloid", pt_build_revolved},
                 {"nurbs", make_nurbs}};
    const struct shape_kind *kind = pt_row(kinds, pt_params_kind(p));
    return kind ? kind->make(b, p)
                : pt_diag_unknown(&b->diag, p->loc, "shape", pt_params_kind(p), "trianglemesh, plymesh, sphere, disk …",
                                  "it is left out");
}

/* An object without shapes so far. */
static int32_t add_object(struct pt_builder *b, const char *name, const struct pt_object_info *info)
{
    const struct pt_object object = {(int32_t)b->object_shapes.count, 0};
    const int32_t id = pt_list_add(b, &b->object_infos, info) < 0 ? -1 : pt_list_add(b, &b->objects, &object);
    if (id < 0 || pt_names_set(&b->object_names, name, id) != 0)
        pt_diag_nomem(&b->diag, "objects");
    return b->diag.rc ? -1 : id;
}

int pt_build_object_begin(struct pt_builder *b, const char *name, struct pt_loc loc)
{
    int32_t id = pt_names_get(&b->object_names, name);
    if (b->open_object >= 0)
        return pt_diag_fail(&b->diag, loc, "ObjectBegin within an object");
    struct pt_object_info *infos = b->object_infos.items;
    if (id >= 0 && infos[id].wanted.name) {
        infos[id].wanted.name = NULL;
        ((struct pt_object *)b->objects.items)[id].first_shape = (int32_t)b->object_shapes.count;
    } else {
        id = add_object(b, name, &(struct pt_object_info){0});
    }
    if (id >= 0)
        b->open_object = id;
    return b->diag.rc;
}

/* The object of an instance, or -1. pbrt-v4 looks for it at the end of the scene, pbrt-v3 leaves the instance out. */
static int32_t find_object(struct pt_builder *b, const char *name, struct pt_loc loc)
{
    const int32_t id = pt_names_get(&b->object_names, name);
    if (id >= 0)
        return id;
    if (b->is_v3) {
        pt_diag_warn(&b->diag, loc, "unknown object \"%s\": its instance is left out", name);
        return -1;
    }
    const struct pt_object_info info = {.wanted = {pt_arena_strdup(&b->scene->arena, name), loc}};
    if (!info.wanted.name)
        pt_diag_nomem(&b->diag, "objects");
    return b->diag.rc ? -1 : add_object(b, name, &info);
}

int pt_build_instance(struct pt_builder *b, const char *name, struct pt_loc loc)
{
    struct pt_xform at[2];
    if (b->open_object >= 0)
        return pt_diag_fail(&b->diag, loc, "ObjectInstance within an object");
    const int32_t object = find_object(b, name, loc);
    if (object < 0)
        return b->diag.rc;
    const struct pt_object_info *info = (struct pt_object_info *)b->object_infos.items + object;
    if (((struct pt_object *)b->objects.items)[object].shape_count == 0 && !info->wanted.name)
        return 0;
    pt_builder_at_shutter(b, b->state->ctm, at);
    return add_instance(b, object, at, info->origin, loc);
}

void pt_build_drop_instances(struct pt_builder *b)
{
    struct pt_instance *instances = b->instances.items;
    size_t kept = 0;
    for (size_t i = 0; i < b->instances.count; i++)
        if (((struct pt_object *)b->objects.items)[instances[i].object].shape_count > 0)
            instances[kept++] = instances[i];
    b->instances.count = kept;
}
