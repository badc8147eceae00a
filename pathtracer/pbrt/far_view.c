/*
 * A view from afar: a window that is narrow against the way to what is seen. There the camera's rays begin just before what
 * is seen, and the origin of render space is there, so that floats hold it. Where that is shows only when all of the scene
 * is built: it is then read once more.
 */
#include <math.h>
#include <string.h>

#include "geom/accel.h"
#include "pbrt/build.h"
#include "shade/camera.h"

/* Of a wider window, against the way to it, nothing is lost that shows: 8e-7 of the way (geom/offset.h) is below a pixel. */
static const double narrow = 1e-3;
/* Of floats, relative to the largest coordinate, with room for the sums of a transform. */
static const double rounding = 1e-6;
/* What is nearer, in windows, is near enough. */
static const double near_enough = 100;

/* What the camera sees, in its space and with room for filter, lens and rounding: all points where each of five functions
 * a[k]·(x, y, z, 1) is >= 0. */
struct view {
    struct pt_xform from_render;
    double window, window_per_z; /* its longer side at depth z is their sum, z times the latter */
    double slack;                /* of rounding */
    double a[5][4];
};

static double window_at(const struct view *v, double z) { return v->window + v->window_per_z * z; }

static void make_view(const struct pt_builder *b, int end, struct view *v)
{
    const struct pt_camera *c = &b->scene->camera;
    const int perspective = c->kind == PT_CAMERA_PERSPECTIVE;
    const pt_vec3 most = v3_most(v3_abs(b->scene->bounds_min), v3_abs(b->scene->bounds_max));
    double scale = 0, size[2];
    *v = (struct view){.a = {{0, 0, 1, 0}}};
    v->from_render = pt_xform_mul(b->world_to_camera[end], pt_xform_translate(b->origin[0], b->origin[1], b->origin[2]));
    for (int i = 0; i < 9; i++)
        scale = fmax(scale, fabs(v->from_render.m[i / 3][i % 3]));
    v->slack = rounding * scale * (double)v3_max(most);
    for (int i = 0; i < 2; i++) {
        const double middle = b->window_middle[i];
        size[i] = fabs(i == 0 ? (double)c->dx * c->width : (double)c->dy * c->height);
        for (int side = 0; side < 2; side++) {
            double *a = v->a[1 + 2 * i + side], sign = side ? -1 : 1;
            a[i] = sign;
            a[perspective ? 2 : 3] = size[i] - sign * middle; /* twice the window, for its filter */
            a[2] += (double)(c->lens_radius / c->focal_distance);
            a[3] += (double)c->lens_radius + v->slack;
        }
    }
    *(perspective ? &v->window_per_z : &v->window) = fmax(size[0], size[1]);
}

/* The least z of what the camera sees of a triangle; INFINITY: nothing. Sutherland and Hodgman 1974. */
static double nearest_of_triangle(const struct view *v, double p[3][3])
{
    double in[9][3], out[9][3], nearest = INFINITY;
    int n = 3;
    memcpy(in, p, sizeof(double[3][3]));
    for (int k = 0; k < 5 && n > 0; k++) {
        const double *a = v->a[k];
        int kept = 0;
        for (int i = 0; i < n; i++) {
            const double *from = in[i], *to = in[(i + 1) % n];
            double f = a[0] * from[0] + a[1] * from[1] + a[2] * from[2] + a[3];
            double g = a[0] * to[0] + a[1] * to[1] + a[2] * to[2] + a[3];
            if (f >= 0)
                memcpy(out[kept++], from, sizeof *out);
            for (int j = 0; j < 3 && (f >= 0) != (g >= 0); j++)
                out[kept][j] = from[j] + f / (f - g) * (to[j] - from[j]);
            kept += (f >= 0) != (g >= 0);
        }
        n = kept;
        memcpy(in, out, sizeof in);
    }
    for (int i = 0; i < n; i++)
        nearest = fmin(nearest, in[i][2]);
    return nearest;
}

/* The same of a box, which is hollow or full: from within it is at 0. `t`: its space → the camera's. */
static double nearest_of_box(const struct view *v, const struct pt_xform *t, const double low[3], const double high[3])
{
    static const int faces[12][3] = {{0, 1, 3}, {0, 3, 2}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                     {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 3, 7}, {1, 7, 5}};
    double corners[8][3], nearest = INFINITY, eye[3], at[3] = {-v->a[1][3] + v->a[2][3], -v->a[3][3] + v->a[4][3], 0};
    struct pt_xform inverse;
    int within = pt_xform_invert(t, &inverse);
    at[0] /= 2;
    at[1] /= 2;
    for (int i = 0; i < 8; i++) {
        const double p[3] = {i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]};
        pt_xform_point(t, p, corners[i]);
    }
    if (within)
        pt_xform_point(&inverse, at, eye);
    for (int i = 0; i < 3; i++)
        within = within && eye[i] >= low[i] && eye[i] <= high[i];
    for (int i = 0; i < 12; i++) {
        double p[3][3];
        for (int k = 0; k < 3; k++)
            memcpy(p[k], corners[faces[i][k]], sizeof p[k]);
        nearest = fmin(nearest, nearest_of_triangle(v, p));
    }
    return within ? 0 : nearest;
}

static struct pt_xform then(const struct pt_xform *second, const struct pt_mat34 *first)
{
    struct pt_xform t;
    for (int i = 0; i < 12; i++)
        t.m[i / 4][i % 4] = (double)first->m[i];
    return pt_xform_mul(*second, t);
}

/* Of a ball or pipe that the view begins in: where the rays at the corners of the window leave it, which all others do
 * later, since it is convex. 0: the view begins elsewhere. */
static double nearest_of_hollow(const struct view *v, const struct pt_xform *t, const struct pt_quadric *q)
{
    const double along = q->kind == PT_QUADRIC_SPHERE, r = (double)q->radius;
    struct pt_xform inverse;
    double nearest = INFINITY;
    if (q->kind == PT_QUADRIC_DISK || !pt_xform_invert(t, &inverse))
        return 0;
    for (int k = 0; k < 4; k++) {
        const double *x = v->a[1 + k % 2], *y = v->a[3 + k / 2], sx = k % 2 ? 1 : -1, sy = k / 2 ? 1 : -1;
        double p[3], d[3];
        pt_xform_point(&inverse, (double[3]){sx * x[3], sy * y[3], 0}, p);
        pt_xform_vector(&inverse, (double[3]){sx * x[2], sy * y[2], 1}, d);
        const double a = d[0] * d[0] + d[1] * d[1] + along * d[2] * d[2];
        const double b = p[0] * d[0] + p[1] * d[1] + along * p[2] * d[2];
        const double c = p[0] * p[0] + p[1] * p[1] + along * p[2] * p[2] - r * r;
        if (!(c < 0))
            return 0;
        nearest = fmin(nearest, a > 0 ? (sqrt(b * b - a * c) - b) / a : INFINITY);
    }
    return nearest;
}

static double nearest_of_shape(const struct view *v, const struct pt_scene *scene, const struct pt_shape *shape,
                               const struct pt_xform *t)
{
    if (shape->kind == PT_SHAPE_QUADRIC) {
        const struct pt_quadric *q = &scene->quadrics[shape->data];
        const double r = (double)q->radius, low[3] = {-r, -r, (double)q->z_min}, high[3] = {r, r, (double)q->z_max};
        const struct pt_xform all = then(t, &q->to_render);
        return fmax(nearest_of_hollow(v, &all, q), nearest_of_box(v, &all, low, high));
    }
    const struct pt_mesh *mesh = &scene->meshes[shape->data];
    double nearest = INFINITY;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        double p[3][3];
        for (int k = 0; k < 3; k++) {
            const pt_vec3 at = mesh->vertices[mesh->indices[3 * i + (size_t)k]].p;
            pt_xform_point(t, (double[3]){(double)at.x, (double)at.y, (double)at.z}, p[k]);
        }
        nearest = fmin(nearest, nearest_of_triangle(v, p));
    }
    return nearest;
}

/* Of all of the scene, at all times. */
static double nearest_of_all(const struct pt_builder *b, const struct view *v)
{
    const struct pt_scene *s = b->scene;
    double nearest = INFINITY;
    int moves = s->camera.animated;
    for (int32_t i = 0; i < s->instance_count; i++)
        moves |= s->instances[i].animated;
    if (moves) { /* by the bounds, which know of it */
        for (int i = 0; i < 8; i++) {
            const double p[3] = {(double)(i & 1 ? s->bounds_max.x : s->bounds_min.x),
                                 (double)(i & 2 ? s->bounds_max.y : s->bounds_min.y),
                                 (double)(i & 4 ? s->bounds_max.z : s->bounds_min.z)};
            double q[3];
            pt_xform_point(&v->from_render, p, q);
            nearest = fmin(nearest, q[2]);
        }
        return nearest;
    }
    for (int32_t i = 0; i < s->world_shape_count; i++)
        nearest = fmin(nearest, nearest_of_shape(v, s, &s->shapes[i], &v->from_render));
    for (int32_t i = 0; i < s->instance_count; i++) {
        const struct pt_object *o = &s->objects[s->instances[i].object];
        const struct pt_xform t = then(&v->from_render, &s->instances[i].to_render[0]);
        for (int32_t k = 0; k < o->shape_count; k++)
            nearest = fmin(nearest, nearest_of_shape(v, s, &s->shapes[o->first_shape + k], &t));
    }
    return nearest;
}

/* Warns where a pixel is smaller than the rounding of what is seen in it: at five places of the window. */
static void check_pixels(struct pt_builder *b, const struct view *v)
{
    const struct pt_camera *c = &b->scene->camera;
    for (int i = 0; i < 5; i++) {
        struct pt_ray ray;
        struct pt_hit hit;
        const float x = i == 0 ? 0.5f : i & 1 ? 0.25f : 0.75f, y = i == 0 ? 0.5f : i & 2 ? 0.25f : 0.75f;
        pt_camera_ray(PT_FX_ALL, c, x * (float)c->width, y * (float)c->height, 0.5f, 0.5f, 0.5f, &ray);
        if (!pt_accel_intersect(b->scene, &ray, &hit))
            continue;
        const double way = (double)(hit.t + v3_max(v3_abs(ray.origin)));
        const double pixel = window_at(v, b->camera_start + way) / fmax(c->width, c->height);
        if (pixel < 0.2 * rounding * way) {
            b->diag.log = b->options->log;
            pt_diag_warn(&b->diag, b->header[PT_HEADER_CAMERA].loc,
                         "a pixel of this view is %.2g wide where floats are only good to %.2g: the picture is not sharp",
                         pixel, 0.2 * rounding * way);
            return;
        }
    }
}

double pt_build_far_view(struct pt_builder *b)
{
    const struct pt_camera *c = &b->scene->camera;
    double nearest = INFINITY, start = b->camera_start, next;
    struct view v;
    make_view(b, 0, &v);
    const double most = start + v.slack / rounding; /* the depth of anything */
    if (window_at(&v, most) >= narrow * most)
        return start;
    for (int end = 0; end <= c->animated; end++) {
        make_view(b, end, &v);
        nearest = fmin(nearest, nearest_of_all(b, &v));
    }
    next = nearest - v.slack;
    if (next > 0 && next < INFINITY && c->medium < 0 && window_at(&v, next) < narrow * next &&
        fabs(next - start) > near_enough * window_at(&v, next))
        return next;
    check_pixels(b, &v);
    return start;
}
