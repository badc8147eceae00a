/* Shapes that are turned into triangles: bilinear patches, curves, height fields, cones and the like. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/pi.h"

#include "pbrt/build.h"

/* Vertices and triangles under construction. */
struct grower {
    double *p, *n, *uv; /* owns */
    uint32_t *indices;  /* owns */
    size_t vertices, p_room, n_room, uv_room, corners, index_room;
    int failed; /* out of memory: what is added is lost */
};

static void push(struct grower *g, double **array, size_t *room, size_t at, const double *v, size_t count)
{
    for (size_t i = 0; i < count && !g->failed; i++) {
        g->failed = !pt_grow((void **)array, room, at + i, sizeof **array);
        if (!g->failed)
            (*array)[at + i] = v[i];
    }
}

static void add_vertex(struct grower *g, const double p[3], const double *n, double u, double v)
{
    const double uv[2] = {u, v};
    g->failed |= g->vertices >= INT32_MAX;
    push(g, &g->p, &g->p_room, 3 * g->vertices, p, 3);
    if (n)
        push(g, &g->n, &g->n_room, 3 * g->vertices, n, 3);
    push(g, &g->uv, &g->uv_room, 2 * g->vertices++, uv, 2);
}

/* Quad a b / c d as two triangles of one orientation. */
static void add_quad(struct grower *g, size_t a, size_t b, size_t c, size_t d)
{
    const size_t corners[6] = {a, b, d, a, d, c};
    for (int i = 0; i < 6 && !g->failed; i++) {
        g->failed = !pt_grow((void **)&g->indices, &g->index_room, g->corners, sizeof *g->indices);
        if (!g->failed)
            g->indices[g->corners++] = (uint32_t)corners[i];
    }
}

/* Quads between nx by ny vertices from `first` on. */
static void add_grid(struct grower *g, size_t first, size_t nx, size_t ny)
{
    for (size_t y = 0; y + 1 < ny; y++)
        for (size_t x = 0; x + 1 < nx; x++) {
            size_t a = first + y * nx + x;
            add_quad(g, a, a + 1, a + nx, a + nx + 1);
        }
}

static int finish(struct grower *g, struct pt_builder *b, struct pt_params *p)
{
    struct pt_soup soup = {.vertex_count = g->vertices,
                           .triangle_count = g->corners / 3,
                           .pd = g->p,
                           .nd = g->n,
                           .uvd = g->uv,
                           .indices = g->indices};
    if (g->failed)
        pt_diag_nomem(&b->diag, "a shape");
    else
        pt_build_mesh(b, p, &soup);
    free(g->p);
    free(g->n);
    free(g->uv);
    free(g->indices);
    return b->diag.rc;
}

/* Between what four corners have, `size` numbers each. */
static void lerp2(const double *const c[4], double u, double v, size_t size, double *out)
{
    for (size_t k = 0; k < size; k++)
        out[k] = (1 - v) * ((1 - u) * c[0][k] + u * c[1][k]) + v * ((1 - u) * c[2][k] + u * c[3][k]);
}

/* Whether what four corners have, `size` numbers each, runs evenly over the patch, so that two triangles have it exactly. */
static int is_even(const double *const c[4], size_t size)
{
    double off = 0, extent = 0;
    for (size_t k = 0; k < size; k++) {
        off = fmax(off, fabs(c[0][k] - c[1][k] - c[2][k] + c[3][k]));
        for (int i = 1; i < 4; i++)
            extent = fmax(extent, fabs(c[i][k] - c[0][k]));
    }
    return off <= 1e-5 * extent; /* rectangles of floats count */
}

/* Across a patch at (u, v), 0 where corners coincide. Bilinear as the patch, so that it is not to be made unit before it is
 * interpolated. */
static void patch_normal(const double *const c[4], double u, double v, double n[3])
{
    double d[3], e[3];
    for (size_t k = 0; k < 3; k++) {
        d[k] = (1 - v) * (c[1][k] - c[0][k]) + v * (c[3][k] - c[2][k]);
        e[k] = (1 - u) * (c[2][k] - c[0][k]) + u * (c[3][k] - c[1][k]);
    }
    pt_cross(d, e, n);
}

int pt_build_bilinear(struct pt_builder *b, struct pt_params *p)
{
    static const double identity[4] = {0, 1, 2, 3}, square[8] = {0, 0, 1, 0, 0, 1, 1, 1};
    size_t vertices, count, uv_count, n_count;
    const double *P = pt_params_floats(p, "P", 3, &vertices), *indices = pt_params_ints(p, "indices", &count);
    const double *uv = pt_params_floats(p, "uv", 2, &uv_count), *N = pt_params_floats(p, "N", 3, &n_count);
    struct grower g = {0};
    int bent = 0;
    if (b->diag.rc)
        return b->diag.rc;
    if (!P || (!indices && vertices != 4) || (indices && count % 4 != 0) || (uv && uv_count != vertices) ||
        (N && n_count != vertices))
        return pt_params_fail(p, "P", "a bilinearmesh needs \"point3 P\", four indices per patch, uv and N per vertex");
    if (!indices) {
        indices = identity;
        count = 4;
    }
    for (size_t i = 0; i < count; i++)
        if (pt_build_check_index(p, indices[i], vertices) != 0)
            return b->diag.rc;
    /* a mesh has normals everywhere or nowhere: one bent patch gives them to all */
    for (size_t i = 0; i < count && !N; i += 4) {
        const double *c[4];
        for (size_t k = 0; k < 4; k++)
            c[k] = P + 3 * (size_t)indices[i + k];
        bent |= !is_even(c, 3);
    }
    for (size_t i = 0; i < count; i += 4) {
        const double *c[4], *t[4], *n[4];
        for (size_t k = 0; k < 4; k++) {
            double v = indices[i + k];
            c[k] = P + 3 * (size_t)v;
            t[k] = uv ? uv + 2 * (size_t)v : square + 2 * k;
            n[k] = N ? N + 3 * (size_t)v : NULL;
        }
        size_t cuts = is_even(c, 3) && is_even(t, 2) && (!N || is_even(n, 3)) ? 1 : 8, first = g.vertices;
        for (size_t y = 0; y <= cuts; y++)
            for (size_t x = 0; x <= cuts; x++) {
                double u = (double)x / (double)cuts, v = (double)y / (double)cuts, q[3], m[3], st[2];
                lerp2(c, u, v, 3, q);
                lerp2(t, u, v, 2, st);
                if (N)
                    lerp2(n, u, v, 3, m);
                else
                    patch_normal(c, u, v, m);
                add_vertex(&g, q, N || bent ? m : NULL, st[0], st[1]);
            }
        add_grid(&g, first, cuts + 1, cuts + 1);
    }
    if (pt_params_find(p, "emissionfilename"))
        pt_params_warn(p, "emissionfilename", "the image of an emitting patch is ignored");
    pt_params_ignore(p, "emissionfilename faceIndices");
    return finish(&g, b, p);
}

/* Curves: tubes of six sides. */

enum { CURVE_SIDES = 6, CURVE_CUTS = 8 };

static void bezier(const double *c, int degree, double t, double p[3], double d[3])
{
    double q[4][3] = {{0}};
    for (int i = 0; i <= degree; i++)
        memcpy(q[i], c + 3 * i, sizeof q[i]);
    for (int level = degree; level > 0; level--) {
        if (level == 1)
            for (int k = 0; k < 3; k++)
                d[k] = q[1][k] - q[0][k];
        for (int i = 0; i < level; i++)
            for (int k = 0; k < 3; k++)
                q[i][k] = (1 - t) * q[i][k] + t * q[i + 1][k];
    }
    memcpy(p, q[0], sizeof q[0]);
}

/* Uniform b-spline segment to Bézier control points. */
static void spline_to_bezier(const double *c, int degree, double out[12])
{
    for (int k = 0; k < 3; k++) {
        double a = c[k], b = c[3 + k], d = c[6 + k];
        if (degree == 2) {
            out[k] = (a + b) / 2;
            out[3 + k] = b;
            out[6 + k] = (b + d) / 2;
        } else {
            double e = c[9 + k];
            out[k] = (a + 4 * b + d) / 6;
            out[3 + k] = (2 * b + d) / 3;
            out[6 + k] = (b + 2 * d) / 3;
            out[9 + k] = (b + 4 * d + e) / 6;
        }
    }
}

/* The way from a to b, unit; 0 where they are too near each other for the curve's size. */
static int way(const double a[3], const double b[3], double size, pt_vec3 *out)
{
    const double d[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, len = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    if (!(len > 1e-9 * size))
        return 0;
    *out = v3((float)(d[0] / len), (float)(d[1] / len), (float)(d[2] / len));
    return 1;
}

/* Which way a segment runs at t, whose derivative there is d. Where control points coincide at an end that is zero, and the
 * curve leaves towards the next that differs. Else, at a turning point, *axis stays. */
static void direct(const double *c, int degree, double t, const double d[3], pt_vec3 *axis)
{
    const double zero[3] = {0, 0, 0};
    const double *end = t < 1 ? c : c + 3 * degree;
    double size = 0;
    for (int i = 3; i < 3 * (degree + 1); i++)
        size = fmax(size, fabs(c[i] - c[i % 3]));
    if (way(zero, d, size, axis) || (t > 0 && t < 1))
        return;
    for (int i = 1; i <= degree; i++)
        if (t < 1 ? way(end, end + 3 * i, size, axis) : way(end - 3 * i, end, size, axis))
            return;
}

/* Turns the frame of a ring so that its normal is `axis`, and no further (parallel transport). */
static void turn_frame(struct pt_frame *f, pt_vec3 axis)
{
    pt_vec3 about = v3_cross(f->n, axis);
    float c = v3_dot(f->n, axis);
    /* Rodrigues' rotation of s; there is no one shortest turn to the opposite way */
    pt_vec3 s =
        c > -0.999f ? v3_madd(v3_madd(v3_cross(about, f->s), c, f->s), v3_dot(about, f->s) / (1.0f + c), about) : f->s;
    s = v3_norm(v3_madd(s, -v3_dot(s, axis), axis));
    *f = (struct pt_frame){s, v3_cross(axis, s), axis};
}

/* u runs along the curve, v around it. Quads join it to the ring before, unless it is the first of its segment. */
static void add_ring(struct grower *g, const double p[3], const struct pt_frame *f, double width, double u, int is_first)
{
    const size_t before = g->vertices - CURVE_SIDES;
    for (int i = 0; i < CURVE_SIDES; i++) {
        double a = 2 * BASE_PI * i / CURVE_SIDES;
        pt_vec3 out = v3_add(v3_scale(f->s, (float)cos(a)), v3_scale(f->t, (float)sin(a)));
        const double n[3] = {(double)out.x, (double)out.y, (double)out.z};
        const double q[3] = {p[0] + width / 2 * n[0], p[1] + width / 2 * n[1], p[2] + width / 2 * n[2]};
        add_vertex(g, q, n, u, (double)i / CURVE_SIDES);
    }
    for (size_t i = 0; i < CURVE_SIDES && !is_first; i++) {
        size_t a = before + i, next = before + (i + 1) % CURVE_SIDES;
        add_quad(g, a, next, a + CURVE_SIDES, next + CURVE_SIDES);
    }
}

int pt_build_curve(struct pt_builder *b, struct pt_params *p)
{
    size_t count;
    const char *basis = pt_params_string(p, "basis", "bezier");
    int degree = pt_params_int_in(p, "degree", 3, 2, 3), spline = strcmp(basis, "bspline") == 0;
    const double *P = pt_params_floats(p, "P", 3, &count);
    double width = pt_params_float_in(p, "width", 1, 0, 1e30), w0 = pt_params_float_in(p, "width0", width, 0, 1e30),
           w1 = pt_params_float_in(p, "width1", width, 0, 1e30);
    size_t corners = (size_t)degree + 1, step = spline ? 1 : (size_t)degree;
    struct grower g = {0};
    pt_params_ignore(p, "type N splitdepth");
    if (b->diag.rc)
        return b->diag.rc;
    if (!spline && strcmp(basis, "bezier") != 0)
        return pt_params_fail(p, "basis", "unknown curve basis \"%.40s\" (expected bezier or bspline)", basis);
    if (!P || count < corners || (count - corners) % step != 0)
        return pt_params_fail(p, "P", "a curve of degree %d needs %zu points and %zu more per segment", degree, corners,
                              step);
    pt_params_warn(p, NULL, "curves are rendered as tubes of %d sides", (int)CURVE_SIDES);
    size_t segments = (count - corners) / step + 1;
    pt_vec3 axis = v3(0, 0, 1);
    struct pt_frame frame = {0};
    for (size_t i = 0; i < segments && !g.failed; i++) {
        double c[12];
        if (spline)
            spline_to_bezier(P + 3 * i, degree, c);
        else
            memcpy(c, P + 3 * i * step, corners * 3 * sizeof *c);
        /* Each segment has rings of its own, because u is 0 where it begins, as in pbrt. */
        for (int k = 0; k <= CURVE_CUTS; k++) {
            double t = (double)k / CURVE_CUTS, v = ((double)i + t) / (double)segments, q[3], d[3] = {0, 0, 0};
            bezier(c, degree, t, q, d);
            direct(c, degree, t, d, &axis);
            if (i == 0 && k == 0)
                frame = pt_frame_from_normal(axis);
            else
                turn_frame(&frame, axis);
            add_ring(&g, q, &frame, (1 - v) * w0 + v * w1, t, k == 0);
        }
    }
    return finish(&g, b, p);
}

/* Height fields and surfaces of revolution (v3). */

int pt_build_height_field(struct pt_builder *b, struct pt_params *p)
{
    size_t count;
    int nu = pt_params_int_in(p, "nu", 0, 2, 1 << 14), nv = pt_params_int_in(p, "nv", 0, 2, 1 << 14);
    const double *z = pt_params_floats(p, pt_params_find(p, "Pz") ? "Pz" : "P", 1, &count);
    struct grower g = {0};
    if (b->diag.rc)
        return b->diag.rc;
    if (!z || nu < 2 || nv < 2 || count != (size_t)nu * (size_t)nv)
        return pt_params_fail(p, NULL, "a heightfield needs nu, nv and nu·nv heights");
    for (int y = 0; y < nv; y++)
        for (int x = 0; x < nu; x++) {
            const double q[3] = {x / (double)(nu - 1), y / (double)(nv - 1), z[(size_t)y * (size_t)nu + (size_t)x]};
            add_vertex(&g, q, NULL, q[0], q[1]);
        }
    add_grid(&g, 0, (size_t)nu, (size_t)nv);
    return finish(&g, b, p);
}

enum { AROUND = 64, ALONG = 16 };

/* Cone, paraboloid, hyperboloid: radius and height along v, turned about z. */
int pt_build_revolved(struct pt_builder *b, struct pt_params *p)
{
    const char *kind = pt_params_kind(p);
    double radius = pt_params_float_in(p, "radius", 1, 1e-30, 1e30),
           phi = fmin(pt_params_float_in(p, "phimax", 360, 1e-3, 1e30), 360) * BASE_PI / 180;
    double height = pt_params_float(p, "height", 1), zmin = pt_params_float(p, "zmin", 0),
           zmax = pt_params_float(p, "zmax", 1);
    double z0 = fmin(zmin, zmax), z1 = fmax(zmin, zmax);
    double p1[3] = {0, 0, 0}, p2[3] = {1, 1, 1};
    struct grower g = {0};
    pt_params_point(p, "p1", p1);
    pt_params_point(p, "p2", p2);
    if (!b->diag.rc)
        pt_params_warn(p, NULL, "shape \"%s\" is rendered as %d triangles", kind, (int)(2 * AROUND * ALONG));
    for (int j = 0; j <= ALONG; j++)
        for (int i = 0; i <= AROUND; i++) {
            double v = (double)j / ALONG, u = (double)i / AROUND, a = u * phi, c = cos(a), s = sin(a);
            double at[3] = {0, 0, 0}, along[3] = {0, 0, 0}; /* where phi is 0 */
            if (kind[0] == 'h') {
                for (int k = 0; k < 3; k++) {
                    at[k] = (1 - v) * p1[k] + v * p2[k];
                    along[k] = p2[k] - p1[k];
                }
            } else if (kind[0] == 'c') {
                at[0] = radius * (1 - v);
                at[2] = v * height;
                along[0] = -radius;
                along[2] = height;
            } else { /* r² grows with z */
                at[2] = z0 + v * (z1 - z0);
                at[0] = radius * sqrt(fmax(at[2] / z1, 0));
                along[0] = radius / (2 * sqrt(fabs(z1)));
                along[2] = sqrt(fmax(at[2], 0));
            }
            const double q[3] = {at[0] * c - at[1] * s, at[0] * s + at[1] * c, at[2]};
            const double e[3] = {along[0] * c - along[1] * s, along[0] * s + along[1] * c, along[2]};
            /* around: at the tip as just before it */
            const double d[3] = {kind[0] == 'h' ? -q[1] : -s, kind[0] == 'h' ? q[0] : c, 0};
            double n[3];
            pt_cross(d, e, n);
            add_vertex(&g, q, n, u, v);
        }
    add_grid(&g, 0, AROUND + 1, ALONG + 1);
    return finish(&g, b, p);
}
