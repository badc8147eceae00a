#include <math.h>

#include "base/pi.h"
#include "integ/borders.h"
#include "integ/contact.h"
#include "shade/material.h"

/* Surfaces touch up to this multiple of the bounds on the rounding of their places; pt_contact_gather takes 1. */
#define NEAR 2.0f
/* … and a plane touches a round surface up to this share of its radius, two round ones up to the other: the arrow of the
 * steps in which these are compared. */
#define NEAR_ROUND 1e-4f
#define NEAR_STEP 1e-2f
/* A plane that touches a round surface of radius 1 is parallel to it (PT_PLACE_PARALLEL) up to this distance. */
#define NEAR_ANGLE 0.05f
/* A plane that touches a cylinder is parallel to its axis: cosine of its normal with that. */
#define ALONG 0.05f
/* What lies side by side in a plane overlaps by less than this share of the smaller, or the rounding of coordinates. */
#define BESIDE 1e-5f
#define BESIDE_ROUNDING 2e-7f

/* No scene takes more than seconds: MOST_PIECES of instances, at all times, are looked at, and MOST_PAIRS found near them,
 * of which those that are compared count as COMPARED. An instance and a shape take half of what is left at most. What is
 * beyond that is taken as apart. */
enum { CORNERS = 16, STEPS = 32, TIMES = 9, MOST_PIECES = 1 << 22, MOST_PAIRS = 1 << 28, COMPARED = 16 };
/* So many surfaces within a solid are looked through. */
enum { WITHIN = 64 };

/* A triangle, a disk as a polygon around it, or the whole of a sphere or cylinder; in render space. */
struct piece {
    int32_t shape, primitive, instance;
    int32_t corner_count; /* 0: round */
    pt_vec3 corners[CORNERS], n;
    const struct pt_quadric *quadric; /* NULL: a triangle */
    struct pt_mat34 from_own, to_own; /* of a quadric: its own space ↔ render space */
    pt_vec3 error;                    /* bound on the rounding of its places, per axis */
    pt_vec3 centre, half;             /* of a box around it */
    float reach;                      /* largest coordinate */
};

struct box {
    pt_vec3 least, most;
};

static const struct box everywhere = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};

struct search {
    struct pt_scene *scene;
    float time;
    struct piece piece; /* lets rays through, … */
    int transmits;      /* … by its material */
    int64_t left;       /* pieces of instances that may still be looked at */
    int64_t pairs;      /* pieces that may still be found near these */
    int32_t found;
};

static int lets_through(const struct pt_scene *scene, int32_t shape)
{
    return (pt_material_effects(scene, scene->shapes[shape].material) & PT_FX_TRANSMISSION) != 0;
}

/* a · b; rows of four, the last is 0 0 0 1. */
static struct pt_mat34 join(const struct pt_mat34 *a, const struct pt_mat34 *b)
{
    struct pt_mat34 out;
    for (int i = 0; i < 12; i++) {
        const float *row = &a->m[i / 4 * 4], *column = &b->m[i % 4];
        out.m[i] = row[0] * column[0] + row[1] * column[4] + row[2] * column[8] + (i % 4 == 3 ? row[3] : 0.0f);
    }
    return out;
}

/* By cofactors. */
static struct pt_mat34 inverse(const struct pt_mat34 *t)
{
    const float *m = t->m;
    pt_vec3 a = v3(m[0], m[4], m[8]), b = v3(m[1], m[5], m[9]), c = v3(m[2], m[6], m[10]);
    pt_vec3 bc = v3_cross(b, c), ca = v3_cross(c, a), ab = v3_cross(a, b), shift = v3(m[3], m[7], m[11]);
    float inv = 1.0f / v3_dot(a, bc);
    pt_vec3 rows[3] = {v3_scale(bc, inv), v3_scale(ca, inv), v3_scale(ab, inv)};
    struct pt_mat34 out;
    for (int i = 0; i < 3; i++) {
        out.m[4 * i] = rows[i].x;
        out.m[4 * i + 1] = rows[i].y;
        out.m[4 * i + 2] = rows[i].z;
        out.m[4 * i + 3] = -v3_dot(rows[i], shift);
    }
    return out;
}

static void put_corners(struct piece *piece, const struct pt_mesh *mesh, const struct pt_mat34 *to_render)
{
    if (!piece->quadric) {
        struct pt_corners k = pt_mesh_corners(mesh, piece->primitive);
        const pt_vec3 p[3] = {k.a->p, k.b->p, k.c->p};
        for (int i = 0; i < 3; i++)
            piece->corners[i] = pt_mat34_point(to_render, p[i]);
        piece->corner_count = 3;
    } else if (piece->quadric->kind == PT_QUADRIC_DISK) {
        for (int i = 0; i < CORNERS; i++) {
            float phi = 2.0f * PT_PI * (float)i / CORNERS, r = piece->quadric->radius / cosf(PT_PI / CORNERS);
            piece->corners[i] = pt_mat34_point(&piece->from_own, v3(r * cosf(phi), r * sinf(phi), piece->quadric->z_min));
        }
        piece->corner_count = CORNERS;
    }
}

/* Unit, of a flat polygon; 0 of one without area. */
static pt_vec3 polygon_normal(const pt_vec3 *p, int32_t count)
{
    pt_vec3 n = v3_splat(0.0f);
    for (int32_t i = 1; i + 1 < count; i++)
        n = v3_add(n, v3_cross(v3_sub(p[i], p[0]), v3_sub(p[i + 1], p[0])));
    return v3_unit(n);
}

static void piece_of(const struct pt_scene *scene, float time, int32_t id, int32_t primitive, int32_t instance,
                     struct piece *out)
{
    const struct pt_shape *shape = &scene->shapes[id];
    struct pt_mat34 to_render = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    pt_vec3 lower = v3_splat(INFINITY), upper = v3_splat(-INFINITY); /* in the shape's space */
    out->shape = id;
    out->primitive = primitive;
    out->instance = instance;
    out->corner_count = 0;
    out->quadric = NULL;
    if (instance >= 0)
        pt_accel_instance_transform(scene, instance, time, &to_render);
    const struct pt_mesh *mesh = NULL;
    if (shape->kind == PT_SHAPE_QUADRIC) {
        out->quadric = &scene->quadrics[shape->data];
        out->from_own = join(&to_render, &out->quadric->to_render);
        out->to_own = inverse(&out->from_own);
        pt_quadric_bounds(out->quadric, &lower, &upper);
    } else {
        mesh = &scene->meshes[shape->data];
        struct pt_corners k = pt_mesh_corners(mesh, primitive);
        lower = v3_least(k.a->p, v3_least(k.b->p, k.c->p));
        upper = v3_most(k.a->p, v3_most(k.b->p, k.c->p));
    }
    put_corners(out, mesh, &to_render);
    out->n = polygon_normal(out->corners, out->corner_count);
    pt_vec3 half = v3_scale(v3_sub(upper, lower), 0.5f), most = v3_most(v3_abs(lower), v3_abs(upper)), sum;
    const float *m = to_render.m;
    float *of_half = &out->half.x, *of_sum = &sum.x;
    for (int i = 0; i < 3; i++) {
        pt_vec3 row = v3(fabsf(m[4 * i]), fabsf(m[4 * i + 1]), fabsf(m[4 * i + 2]));
        of_half[i] = v3_dot(row, half);
        of_sum[i] = v3_dot(row, most) + fabsf(m[4 * i + 3]);
    }
    out->centre = pt_mat34_point(&to_render, v3_add(lower, half));
    out->reach = v3_max(sum);
    out->error = v3_scale(sum, instance >= 0 ? 2.0f * PT_OFFSET_ERROR : PT_OFFSET_ERROR); /* as pt_place_instance */
}

static float nearness(const struct piece *a, const struct piece *b, pt_vec3 n)
{
    return NEAR * v3_dot(v3_abs(n), v3_add(a->error, b->error));
}

struct extent {
    float low, high;
};

static struct extent extent_of(const pt_vec3 *p, int32_t count, pt_vec3 axis)
{
    struct extent e = {INFINITY, -INFINITY};
    for (int32_t i = 0; i < count; i++) {
        float x = v3_dot(p[i], axis);
        e.low = fminf(e.low, x);
        e.high = fmaxf(e.high, x);
    }
    return e;
}

/* Whether a lies in the plane of b. */
static int in_plane(const struct piece *a, const struct piece *b)
{
    struct extent e = extent_of(a->corners, a->corner_count, b->n);
    float height = v3_dot(b->corners[0], b->n), near = nearness(a, b, b->n);
    return e.low >= height - near && e.high <= height + near;
}

/* Whether an edge of a parts two polygons of one plane: the test of separating axes. */
static int parted(const struct piece *a, const struct piece *b)
{
    for (int32_t i = 0; i < a->corner_count; i++) {
        pt_vec3 edge = v3_sub(a->corners[(i + 1) % a->corner_count], a->corners[i]);
        pt_vec3 axis = v3_norm(v3_cross(a->n, edge));
        struct extent x = extent_of(a->corners, a->corner_count, axis), y = extent_of(b->corners, b->corner_count, axis);
        float beside = fmaxf(BESIDE * fminf(x.high - x.low, y.high - y.low), BESIDE_ROUNDING * fminf(a->reach, b->reach));
        if (fminf(x.high, y.high) - fmaxf(x.low, y.low) <= beside)
            return 1;
    }
    return 0;
}

static int flat_touch(const struct piece *a, const struct piece *b)
{
    return fabsf(v3_dot(a->n, b->n)) > PT_PLACE_PARALLEL && (in_plane(a, b) || in_plane(b, a)) && !parted(a, b) &&
           !parted(b, a);
}

/* Length in the own space of a that `near` has at most. */
static float own_length(const struct piece *a, float near)
{
    const float *m = a->to_own.m;
    float most = 0.0f;
    for (int i = 0; i < 12; i++)
        most = fmaxf(most, i % 4 == 3 ? 0.0f : fabsf(m[i]));
    return 2.0f * most * near;
}

static struct box meet(struct box a, struct box b)
{
    return (struct box){v3_most(a.least, b.least), v3_least(a.most, b.most)};
}

/* Around a box of the own space of a. */
static struct box box_from_own(const struct piece *a, struct box own)
{
    struct box box = {v3_splat(INFINITY), v3_splat(-INFINITY)};
    for (int i = 0; i < 8; i++) {
        pt_vec3 p = v3(i & 1 ? own.most.x : own.least.x, i & 2 ? own.most.y : own.least.y, i & 4 ? own.most.z : own.least.z);
        p = pt_mat34_point(&a->from_own, p);
        box = (struct box){v3_least(box.least, p), v3_most(box.most, p)};
    }
    return box;
}

/* Whether the plane of a polygon touches a sphere or cylinder, near the polygon; *box shrinks to where. */
static int round_flat_touch(const struct piece *a, const struct piece *b, struct box *box)
{
    const struct pt_quadric *q = a->quadric;
    pt_vec3 p[CORNERS];
    for (int32_t i = 0; i < b->corner_count; i++)
        p[i] = pt_mat34_point(&a->to_own, b->corners[i]);
    pt_vec3 n = polygon_normal(p, b->corner_count);
    const float near = NEAR_ROUND * q->radius + own_length(a, nearness(a, b, v3_splat(1.0f)));
    const float height = v3_dot(n, p[0]);
    if (!(fabsf(fabsf(height) - q->radius) <= near))
        return 0;
    struct pt_frame frame = pt_frame_from_normal(n);
    if (q->kind == PT_QUADRIC_CYLINDER) {
        if (fabsf(n.z) > ALONG)
            return 0;
        frame.s = v3(0.0f, 0.0f, 1.0f);
        frame.t = v3(-n.y, n.x, 0.0f);
    }
    struct extent s = extent_of(p, b->corner_count, frame.s), t = extent_of(p, b->corner_count, frame.t);
    const float low = q->kind == PT_QUADRIC_CYLINDER ? q->z_min : 0.0f,
                high = q->kind == PT_QUADRIC_CYLINDER ? q->z_max : 0.0f;
    if (!(s.low <= high + near && s.high >= low - near && t.low <= near && t.high >= -near))
        return 0;
    pt_vec3 reach = v3_splat(NEAR_ANGLE * q->radius + near), foot = v3_scale(n, height);
    struct box own = {v3_sub(foot, reach), v3_add(foot, reach)};
    if (q->kind == PT_QUADRIC_CYLINDER) {
        own.least.z = low - near;
        own.most.z = high + near;
    }
    *box = meet(*box, box_from_own(a, own));
    return 1;
}

/* Point (i, k) of a round surface, of STEPS + 1 each way, in its own space. */
static pt_vec3 round_point(const struct pt_quadric *q, int i, int k)
{
    float phi = q->phi_max * (float)i / STEPS, share = (float)k / STEPS, r = q->radius, z;
    if (q->kind == PT_QUADRIC_SPHERE) {
        float from = acosf(fmaxf(-1.0f, q->z_min / r)), to = acosf(fminf(1.0f, q->z_max / r));
        float theta = from + share * (to - from);
        z = r * cosf(theta);
        r *= sinf(theta);
    } else {
        z = q->z_min + share * (q->z_max - q->z_min);
    }
    return v3(r * cosf(phi), r * sinf(phi), z);
}

/* Whether b lies all on one side of the round surface a, and reaches it. */
static int round_touch(const struct piece *a, const struct piece *b)
{
    const struct pt_quadric *q = a->quadric;
    const float near = NEAR_STEP * q->radius + own_length(a, nearness(a, b, v3_splat(1.0f)));
    struct extent height = {INFINITY, -INFINITY}; /* over a */
    for (int j = 0; j < (STEPS + 1) * (STEPS + 1); j++) {
        pt_vec3 p = round_point(b->quadric, j % (STEPS + 1), j / (STEPS + 1));
        p = pt_mat34_point(&a->to_own, pt_mat34_point(&b->from_own, p));
        if (q->kind == PT_QUADRIC_CYLINDER) {
            if (p.z < q->z_min - near || p.z > q->z_max + near)
                continue;
            p.z = 0.0f;
        }
        float h = v3_len(p) - q->radius;
        height.low = fminf(height.low, h);
        height.high = fmaxf(height.high, h);
    }
    return fabsf(height.low) <= near || fabsf(height.high) <= near;
}

static int touch(const struct pt_scene *scene, const struct piece *a, const struct piece *b, struct box *box)
{
    if (a->corner_count && b->corner_count)
        return flat_touch(a, b);
    if (a->corner_count || b->corner_count)
        return a->corner_count ? round_flat_touch(b, a, box) : round_flat_touch(a, b, box);
    /* two parts of one glass join at their rims */
    if (scene->shapes[a->shape].material == scene->shapes[b->shape].material)
        return 0;
    return round_touch(a, b) || round_touch(b, a);
}

/* The middle of a piece as a hit. */
static struct pt_hit hit_in(const struct pt_scene *scene, const struct piece *piece)
{
    struct pt_hit hit = {.shape = piece->shape, .primitive = piece->primitive, .instance = piece->instance};
    const struct pt_quadric *q = piece->quadric;
    if (!q) {
        struct pt_corners k = pt_mesh_corners(&scene->meshes[scene->shapes[piece->shape].data], piece->primitive);
        hit.u = hit.v = 1.0f / 3.0f;
        hit.geometric = v3_unit(v3_cross(v3_sub(k.b->p, k.a->p), v3_sub(k.c->p, k.a->p)));
    } else if (q->kind == PT_QUADRIC_DISK) {
        float r = 0.5f * (q->inner_radius + q->radius), phi = 0.5f * q->phi_max;
        hit.geometric = v3(r * cosf(phi), r * sinf(phi), q->z_min);
    } else {
        hit.geometric = round_point(q, STEPS / 2, STEPS / 2);
    }
    return hit;
}

/* Whether a round surface is all around its axis, seen from without: what lies around it, too, may hide that from a ray. */
static int is_around(const struct piece *piece, const struct pt_place *at)
{
    const struct pt_quadric *q = piece->quadric;
    return q && !piece->corner_count && q->phi_max > 6.28f &&
           (q->kind == PT_QUADRIC_CYLINDER || q->z_max - q->z_min > 1.999f * q->radius) &&
           v3_dot(at->s.n_geometric, v3_sub(at->p, piece->centre)) > 0.0f;
}

/* Whether the side of a piece against its normal is within a solid: a ray that way comes out of the same shape or, once it
 * has left all that is in between, of the same material. */
static int is_solid(const struct pt_scene *scene, float time, const struct piece *piece, const struct piece *other)
{
    struct pt_hit hit = hit_in(scene, piece);
    const pt_vec3 *p = piece->corners, middle = v3_scale(v3_add(p[0], v3_add(p[1], p[2])), 1.0f / 3.0f);
    struct pt_ray ray = {piece->quadric ? piece->centre : middle, piece->n, 0.0f, INFINITY, time};
    struct pt_place at;
    pt_place_at_hit(PT_FX_ALL, scene, &ray, &hit, &at);
    ray.direction = v3_neg(at.s.n_geometric);
    ray.origin = v3_madd(at.p, 2.0f * nearness(piece, other, at.s.n_geometric), ray.direction);
    if (is_around(piece, &at))
        return 1;
    for (int i = 0, inside = 0; i < WITHIN && pt_accel_intersect(scene, &ray, &hit); i++) {
        pt_place_at_hit(PT_FX_ALL, scene, &ray, &hit, &at);
        const int leaves = v3_dot(ray.direction, at.s.n_geometric) > 0.0f;
        if (at.shape->material != scene->shapes[piece->shape].material)
            inside += leaves ? -1 : 1;
        else if (inside == 0 || (hit.shape == piece->shape && hit.instance == piece->instance))
            return leaves;
        ray.t_min = nextafterf(hit.t, INFINITY);
    }
    return 0;
}

static int has_box(const struct pt_shape *shape, struct box box)
{
    pt_vec3 a = v3_sub(box.least, shape->touch_least), b = v3_sub(shape->touch_most, box.most);
    return shape->touches && fminf(fminf(a.x, a.y), a.z) >= 0.0f && fminf(fminf(b.x, b.y), b.z) >= 0.0f;
}

static void mark(struct search *search, const struct piece *piece, const struct piece *other, struct box box)
{
    const struct pt_scene *scene = search->scene;
    struct pt_shape *shape = &search->scene->shapes[piece->shape];
    if (piece->instance >= 0) /* of an object: it is in other places, too */
        box = everywhere;
    shape->touch_least = shape->touches ? v3_least(shape->touch_least, box.least) : box.least;
    shape->touch_most = shape->touches ? v3_most(shape->touch_most, box.most) : box.most;
    shape->touches = 1;
    if (shape->layer == PT_LAYER_SHEET && lets_through(scene, piece->shape) && is_solid(scene, search->time, piece, other))
        shape->layer = PT_LAYER_SOLID;
}

static int moves(const struct pt_scene *scene, const struct piece *piece)
{
    return piece->instance >= 0 && scene->instances[piece->instance].animated;
}

static void compare(void *user, int32_t shape, int32_t primitive, int32_t instance)
{
    struct search *search = user;
    const struct pt_scene *scene = search->scene;
    const struct piece *a = &search->piece;
    const struct pt_shape *of_a = &scene->shapes[a->shape], *of_b = &scene->shapes[shape];
    /* What alpha lets through is met by its name: it only must come before the opaque. */
    if (--search->pairs < 0 || (shape == a->shape && instance == a->instance) ||
        (of_b->layer != PT_LAYER_OPAQUE && !search->transmits))
        return;
    search->pairs -= COMPARED;
    struct piece b;
    piece_of(scene, search->time, shape, primitive, instance, &b);
    pt_vec3 near = v3_scale(v3_add(a->error, b.error), NEAR), around_a = v3_add(a->half, near),
            around_b = v3_add(b.half, near);
    struct box box = meet((struct box){v3_sub(a->centre, around_a), v3_add(a->centre, around_a)},
                          (struct box){v3_sub(b.centre, around_b), v3_add(b.centre, around_b)});
    if (box.least.x > box.most.x || box.least.y > box.most.y || box.least.z > box.most.z ||
        (has_box(of_a, box) && has_box(of_b, box)) || !touch(scene, a, &b, &box))
        return;
    if (moves(scene, a) || moves(scene, &b))
        box = everywhere;
    search->found = 1;
    mark(search, a, &b, box);
    mark(search, &b, a, box);
}

/* How many pieces of the shape there are to look at: of those that rays pass through. */
static int64_t piece_count(const struct pt_scene *scene, int32_t id)
{
    const struct pt_shape *shape = &scene->shapes[id];
    if (shape->layer == PT_LAYER_OPAQUE || scene->materials[shape->material].kind == PT_MATERIAL_INTERFACE)
        return 0;
    return shape->kind == PT_SHAPE_MESH ? (int64_t)scene->meshes[shape->data].triangle_count : 1;
}

/* Looks at what is near the pieces of shapes at some times within the motion. */
static void search_shapes(struct search *search, int32_t first, int32_t count, int32_t instance, int times)
{
    for (int time = 0; time < times; time++) {
        search->time = times > 1 ? (float)time / (float)(times - 1) : 0.0f;
        for (int32_t id = first; id < first + count; id++) {
            const int64_t pieces = piece_count(search->scene, id), enough = search->pairs / 2;
            search->transmits = pieces && lets_through(search->scene, id);
            for (int64_t i = 0; i < pieces && search->pairs > enough; i++) {
                struct piece *piece = &search->piece;
                piece_of(search->scene, search->time, id, (int32_t)i, instance, piece);
                float radius = v3_len(piece->half) + nearness(piece, piece, v3_splat(1.0f));
                pt_accel_near(search->scene, piece->centre, radius, search->time, compare, search);
            }
        }
    }
}

static void search_instance(struct search *search, int32_t instance, int times)
{
    const struct pt_scene *scene = search->scene;
    const struct pt_object *object = &scene->objects[scene->instances[instance].object];
    int64_t pieces = 0;
    for (int32_t i = 0; i < object->shape_count; i++)
        pieces += piece_count(scene, object->first_shape + i);
    if (2 * pieces * times > search->left)
        times = 1;
    if (pieces == 0 || 2 * pieces * times > search->left)
        return;
    search->left -= pieces * times;
    search_shapes(search, object->first_shape, object->shape_count, instance, times);
}

/* Sets the layers; whether rays pass through any. */
static int set_layers(struct pt_scene *scene)
{
    int any = 0;
    for (int32_t i = 0; i < scene->shape_count; i++) {
        struct pt_shape *shape = &scene->shapes[i];
        int interface = scene->materials[shape->material].kind == PT_MATERIAL_INTERFACE;
        shape->touches = 0;
        shape->layer = interface && shape->medium_in != shape->medium_out        ? PT_LAYER_SOLID
                       : interface || shape->has_alpha || lets_through(scene, i) ? PT_LAYER_SHEET
                                                                                 : PT_LAYER_OPAQUE;
        any |= piece_count(scene, i) > 0;
    }
    return any;
}

int pt_contacts_find(struct pt_scene *scene, struct base_err *err)
{
    struct search search = {.scene = scene, .left = MOST_PIECES, .pairs = MOST_PAIRS};
    if (!set_layers(scene))
        return 0;
    int times = 1;
    for (int32_t i = 0; i < scene->instance_count; i++)
        if (scene->instances[i].animated)
            times = TIMES;
    search_shapes(&search, 0, scene->world_shape_count, -1, times);
    for (int32_t i = 0; i < scene->instance_count; i++)
        search_instance(&search, i, times);
    if (!search.found)
        return 0;
    scene->effects |= PT_FX_CONTACT;
    pt_accel_release(scene);
    return pt_accel_build(scene, err);
}
