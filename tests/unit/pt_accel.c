#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "geom/accel.h"
#include "geom/quadric.h"
#include "integ/surface.h"
#include "sample/rng.h"
#include "support/pt_scenes.h"
#include "support/pt_mat34.h"

static struct pt_ray ray_to(pt_vec3 origin, pt_vec3 direction)
{
    return (struct pt_ray){origin, direction, 0.0f, INFINITY, 0.0f};
}

static void assert_near(float a, float b, float tolerance)
{
    if (!(fabsf(a - b) <= tolerance))
        fail_msg("%.9g is not within %g of %.9g", (double)a, (double)tolerance, (double)b);
}

static void assert_vec_near(pt_vec3 a, pt_vec3 b, float tolerance)
{
    assert_near(a.x, b.x, tolerance);
    assert_near(a.y, b.y, tolerance);
    assert_near(a.z, b.z, tolerance);
}

/* One ray at a time. */
static int occluded_one(const struct pt_scene *scene, const struct pt_ray *ray)
{
    uint8_t occluded;
    pt_accel_occluded_many(scene, &ray, 1, &occluded);
    return occluded;
}

static void triangles_have_right_hand_normals(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_hit hit;
    test_scene_begin(&scene);
    int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f));
    test_add_quad(&scene, grey, v3(-1, -1, 2), v3(2, 0, 0), v3(0, 2, 0));
    test_scene_finish(&scene);
    struct pt_ray ray = ray_to(v3(0.25f, -0.5f, 0.0f), v3(0, 0, 1));
    assert_int_equal(pt_accel_intersect(&scene, &ray, &hit), 1);
    assert_near(hit.t, 2.0f, 1e-6f);
    assert_int_equal(hit.shape, 0);
    assert_int_equal(hit.instance, -1);
    assert_vec_near(v3_norm(hit.geometric), v3(0, 0, 1), 1e-6f);
    struct pt_place at;
    pt_place_at_hit(PT_FX_ALL, &scene, &ray, &hit, &at);
    assert_vec_near(at.p, v3(0.25f, -0.5f, 2.0f), 1e-6f);
    assert_vec_near(at.s.n_geometric, v3(0, 0, 1), 1e-6f);
    assert_int_equal(occluded_one(&scene, &ray), 1);
    ray.t_max = 1.9f;
    assert_int_equal(occluded_one(&scene, &ray), 0);
    test_scene_end(&scene);
}

/* A ray through a sphere in front of three cards at one place, in any order of these: it meets each of the two walls and of the
 * cards once. */
static void what_was_passed_is_met_no_more(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_hit hit;
    struct pt_passed passed = {0};
    test_scene_begin(&scene);
    int32_t none = test_add_material(&scene, PT_MATERIAL_INTERFACE);
    test_add_sphere(&scene, none, v3(0, 0, 2), 1e-4f);
    for (int i = 0; i < 3; i++)
        test_add_quad(&scene, none, v3(-1, -1, 3), v3(2, 0, 0), v3(0, 2, 0));
    test_scene_finish(&scene);
    struct pt_ray ray = ray_to(v3(0, 0, 0), v3(1e-6f, 2e-6f, 1));
    assert_int_equal(pt_accel_intersect(&scene, &ray, &hit), 1);
    int met[4] = {0};
    for (int i = 0; i < 5; i++) {
        assert_int_equal(hit.shape < 1, i < 2);
        met[hit.shape]++;
        pt_ray_pass(&ray, &passed, &hit);
        assert_int_equal(pt_accel_intersect_behind(&scene, &ray, &passed, &hit), i < 4);
    }
    for (int i = 0; i < 4; i++)
        assert_int_equal(met[i], i == 0 ? 2 : 1);
    test_scene_end(&scene);
}

/* What a ray begins in is not met where that is wanted, by one ray, by many and by those in lanes; what is right behind it is. */
static void start_is_not_met(void **state)
{
    (void)state;
    enum { N = 16 };
    struct pt_scene scene;
    struct pt_hit hits[N];
    struct pt_ray rays[N];
    const struct pt_ray *list[N];
    struct pt_hit *found[N];
    uint8_t occluded[2][N];
    _Alignas(64) float zero[N] = {0}, x[N], z[N];
    test_scene_begin(&scene);
    int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f));
    test_add_quad(&scene, grey, v3(-1000, -1000, 0), v3(2000, 0, 0), v3(0, 2000, 0));
    test_add_quad(&scene, grey, v3(-1e-3f, -1e-3f, 0), v3(2e-3f, 0, 0), v3(0, 2e-3f, 0));
    test_add_quad(&scene, grey, v3(-5, -5, 1e-12f), v3(2, 0, 0), v3(0, 10, 0));
    test_scene_finish(&scene);
    for (int i = 0; i < N; i++) {
        x[i] = 0.1f * (float)i;
        z[i] = i % 2 ? 1.0f : -1.0f;
        rays[i] = ray_to(v3_splat(0.0f), v3(x[i], 0, z[i]));
        assert_int_equal(pt_accel_intersect(&scene, &rays[i], &hits[i]), 1);
        rays[i].t_min = PT_RAY_OFF_START;
        list[i] = &rays[i];
        found[i] = &hits[i];
        assert_int_equal(pt_accel_intersect(&scene, &rays[i], &hits[i]), 0);
        assert_int_equal(occluded_one(&scene, &rays[i]), 0);
    }
    struct pt_ray_lanes lanes = {{zero, zero, zero}, {x, zero, z}, PT_RAY_OFF_START, INFINITY};
    for (int coherent = 0; coherent < 2; coherent++)
        for (int kind = 0; kind < 2; kind++) {
            if (kind)
                pt_accel_intersect_lanes(&scene, &lanes, N, coherent, found);
            else
                pt_accel_intersect_many(&scene, list, N, coherent, found);
            for (int i = 0; i < N; i++)
                assert_int_equal(hits[i].shape, -1);
        }
    pt_accel_occluded_many(&scene, list, N, occluded[0]);
    pt_accel_occluded_lanes(&scene, &lanes, N, occluded[1]);
    for (int i = 0; i < 2 * N; i++)
        assert_int_equal(occluded[i / N][i % N], 0);
    rays[0] = ray_to(v3(-4, 0, 0), v3(0, 0, 1));
    assert_int_equal(pt_accel_intersect(&scene, &rays[0], &hits[0]), 1);
    test_scene_end(&scene);
}

static void empty_scene_has_no_hits(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_hit hit;
    test_scene_begin(&scene);
    test_scene_finish(&scene);
    struct pt_ray ray = ray_to(v3(0, 0, 0), v3(0, 0, 1));
    assert_int_equal(pt_accel_intersect(&scene, &ray, &hit), 0);
    assert_int_equal(occluded_one(&scene, &ray), 0);
    test_scene_end(&scene);
}

/* The bounds of a sheet have no thickness; it still has a place. */
static void bounds_of_a_sheet(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_add_quad(&scene, test_add_diffuse(&scene, v3_splat(0.5f)), v3(2, -1, 3), v3(0, 4, 0), v3(0, 0, 5));
    test_scene_finish(&scene);
    assert_vec_near(scene.bounds_min, v3(2, -1, 3), 1e-5f);
    assert_vec_near(scene.bounds_max, v3(2, 3, 8), 1e-5f);
    test_scene_end(&scene);
}

/* Known hits of a whole sphere, a clipped one, a half cylinder and an annulus. */
static void quadrics(void **state)
{
    (void)state;
    const struct pt_mat34 id = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    struct pt_quadric q = {PT_QUADRIC_SPHERE, 1.0f, 0.0f, -1.0f, 1.0f, 2.0f * PT_PI, id, id};
    float t, u, v;
    pt_vec3 p, du, dv;
    assert_int_equal(pt_quadric_intersect(&q, v3(-3, 0, 0), v3(1, 0, 0), 0.0f, INFINITY, 0, &t, &p), 1);
    assert_near(t, 2.0f, 1e-6f);
    assert_int_equal(pt_quadric_intersect(&q, v3(-3, 0, 0), v3(1, 0, 0), 2.0f, INFINITY, 0, &t, &p), 2);
    assert_near(t, 4.0f, 1e-6f);
    pt_quadric_uv(&q, v3(0, 1, 0), &u, &v, &du, &dv);
    assert_near(u, 0.25f, 1e-6f);
    assert_near(v, 0.5f, 1e-6f);
    assert_vec_near(du, v3(-2.0f * PT_PI, 0, 0), 1e-5f);
    q.z_max = 0.5f;
    assert_int_equal(pt_quadric_intersect(&q, v3(0, 0, 5), v3(0, 0, -1), 0.0f, INFINITY, 0, &t, &p), 2);
    assert_near(t, 6.0f, 1e-6f);
    q = (struct pt_quadric){PT_QUADRIC_CYLINDER, 1.0f, 0.0f, -1.0f, 1.0f, PT_PI, id, id};
    assert_int_equal(pt_quadric_intersect(&q, v3(0, -5, 0), v3(0, 1, 0), 0.0f, INFINITY, 0, &t, &p), 2);
    assert_near(t, 6.0f, 1e-6f); /* y < 0 is cut away */
    assert_int_equal(pt_quadric_intersect(&q, v3(0, -5, 2), v3(0, 1, 0), 0.0f, INFINITY, 0, &t, &p), 0);
    q = (struct pt_quadric){PT_QUADRIC_DISK, 1.0f, 0.5f, 2.0f, 2.0f, 2.0f * PT_PI, id, id};
    assert_int_equal(pt_quadric_intersect(&q, v3(0.75f, 0, 0), v3(0, 0, 1), 0.0f, INFINITY, 0, &t, &p), 1);
    assert_near(t, 2.0f, 1e-6f);
    assert_int_equal(pt_quadric_intersect(&q, v3(0.25f, 0, 0), v3(0, 0, 1), 0.0f, INFINITY, 0, &t, &p), 0);
}

/* A point of the surface by pbrt's parameters, in double and the quadric's own space. */
static void surface_point(const struct pt_quadric *q, double u, double v, double p[3])
{
    double phi = u * (double)q->phi_max, r = (double)q->radius, z0 = (double)q->z_min, z1 = (double)q->z_max;
    if (q->kind == PT_QUADRIC_SPHERE) {
        double theta0 = acos(z0 / r), theta = theta0 + v * (acos(z1 / r) - theta0);
        p[2] = r * cos(theta);
        r *= sin(theta);
    } else if (q->kind == PT_QUADRIC_CYLINDER) {
        p[2] = z0 + v * (z1 - z0);
    } else {
        p[2] = z0;
        r -= v * (r - (double)q->inner_radius);
    }
    p[0] = r * cos(phi);
    p[1] = r * sin(phi);
}

/* Bounds hold the surface and are not much wider than its box, under any affine map; u, v and their tangents are pbrt's. */
static void quadric_surfaces(void **state)
{
    (void)state;
    struct pt_rng rng = pt_rng_make(3);
    for (int k = 0; k < 600; k++) {
        struct pt_quadric q = {.kind = k % 3, .radius = 0.5f + pt_rng_float(&rng), .phi_max = (k % 2 ? 1.0f : 2.0f) * PT_PI};
        q.z_min = q.kind == PT_QUADRIC_SPHERE ? k % 5 ? -q.radius : -0.3f : -0.5f;
        q.z_max = q.kind == PT_QUADRIC_SPHERE ? k % 7 ? q.radius : 0.2f : q.kind == PT_QUADRIC_DISK ? q.z_min : 0.75f;
        q.inner_radius = q.kind == PT_QUADRIC_DISK ? 0.25f * q.radius : 0.0f;
        for (int i = 0; i < 12; i++)
            q.to_render.m[i] = 2.0f * pt_rng_float(&rng) - 1.0f;
        if (!pt_mat34_invert(&q.to_render, &q.from_render))
            continue;
        pt_vec3 lower, upper, seen_lower = v3_splat(INFINITY), seen_upper = v3_splat(-INFINITY);
        pt_quadric_bounds(&q, &lower, &upper);
        for (int i = 0; i < 32 * 32; i++) {
            double u = (i % 32 + 0.5) / 32, v = (i / 32 + 0.5) / 32, p[3];
            surface_point(&q, u, v, p);
            pt_vec3 own = v3((float)p[0], (float)p[1], (float)p[2]), at = pt_mat34_point(&q.to_render, own), du, dv;
            float gu, gv;
            assert_true(at.x >= lower.x && at.y >= lower.y && at.z >= lower.z && at.x <= upper.x && at.y <= upper.y &&
                        at.z <= upper.z);
            seen_lower = v3(fminf(seen_lower.x, at.x), fminf(seen_lower.y, at.y), fminf(seen_lower.z, at.z));
            seen_upper = v3(fmaxf(seen_upper.x, at.x), fmaxf(seen_upper.y, at.y), fmaxf(seen_upper.z, at.z));
            pt_quadric_uv(&q, own, &gu, &gv, &du, &dv);
            assert_near(gu, (float)u, 1e-5f);
            assert_near(gv, (float)v, 1e-4f);
            double a[3], b[3], d[2][3];
            for (int which = 0; which < 2; which++) {
                surface_point(&q, u + (which ? 0 : 1e-6), v + (which ? 1e-6 : 0), a);
                surface_point(&q, u - (which ? 0 : 1e-6), v - (which ? 1e-6 : 0), b);
                for (int c = 0; c < 3; c++)
                    d[which][c] = (a[c] - b[c]) / 2e-6;
            }
            for (int which = 0; which < 2; which++)
                assert_vec_near(
                    which ? dv : du,
                    pt_mat34_vector(&q.to_render, v3((float)d[which][0], (float)d[which][1], (float)d[which][2])), 2e-3f);
        }
        pt_vec3 room = v3_sub(upper, lower), used = v3_sub(seen_upper, seen_lower);
        assert_true(room.x < 4.0f * used.x + 0.1f && room.y < 4.0f * used.y + 0.1f && room.z < 4.0f * used.z + 0.1f);
    }
}

/* One triangle pair as an object, placed by a turn of 90° about y, a scale of 2 and a shift; then moving. */
static void instances(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_hit hit;
    test_scene_begin(&scene);
    int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f));
    test_add_quad(&scene, grey, v3(-50, -50, 30), v3(100, 0, 0), v3(0, 100, 0));
    scene.world_shape_count = 1;
    test_add_quad(&scene, grey, v3(-1, -1, 0), v3(2, 0, 0), v3(0, 2, 0));
    scene.objects[scene.object_count++] = (struct pt_object){1, 1};
    struct pt_mat34 turned = {{0, 0, 2, 4, 0, 2, 0, 0, -2, 0, 0, 10}}, shifted = turned;
    shifted.m[3] = 8.0f;
    scene.instances[scene.instance_count++] = (struct pt_instance){0, 0, {turned, turned}, v3_splat(0.0f)};
    scene.instances[scene.instance_count++] = (struct pt_instance){0, 1, {turned, shifted}, v3_splat(0.0f)};
    scene.instances[1].to_render[0].m[7] = scene.instances[1].to_render[1].m[7] = 20.0f;
    test_scene_finish(&scene);

    struct pt_ray ray = ray_to(v3(0, 0.5f, 10.5f), v3(1, 0, 0));
    struct pt_place at;
    assert_int_equal(pt_accel_intersect(&scene, &ray, &hit), 1);
    assert_int_equal(hit.instance, 0);
    assert_int_equal(hit.shape, 1);
    pt_place_at_hit(PT_FX_ALL, &scene, &ray, &hit, &at);
    assert_vec_near(at.p, v3(4, 0.5f, 10.5f), 1e-5f);
    assert_vec_near(at.s.n_geometric, v3(1, 0, 0), 1e-5f);

    for (int i = 0; i <= 4; i++) {
        ray = ray_to(v3(0, 20.5f, 10.5f), v3(1, 0, 0));
        ray.time = (float)i / 4.0f;
        assert_int_equal(pt_accel_intersect(&scene, &ray, &hit), 1);
        assert_int_equal(hit.instance, 1);
        assert_near(hit.t, 4.0f + (float)i, 1e-4f);
        pt_place_at_hit(PT_FX_ALL, &scene, &ray, &hit, &at);
        assert_vec_near(at.p, v3(4.0f + (float)i, 20.5f, 10.5f), 1e-4f);
        assert_vec_near(at.s.n_geometric, v3(1, 0, 0), 1e-5f);
    }
    ray = ray_to(v3(0, 10, 0), v3(0, 0, 1));
    assert_int_equal(pt_accel_intersect(&scene, &ray, &hit), 1);
    assert_int_equal(hit.shape, 0);
    assert_int_equal(hit.instance, -1);
    test_scene_end(&scene);
}

/* Rays from inside through every edge and corner of a closed mesh: none may slip out. */
static void meshes_are_watertight(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_hit hit;
    test_scene_begin(&scene);
    test_add_box(&scene, test_add_diffuse(&scene, v3_splat(0.5f)), v3(-1, -1, -1), v3(1, 1, 1), 1);
    test_scene_finish(&scene);
    int missed = 0;
    for (int i = 0; i < 20000; i++) {
        float s = (float)(i % 1000) / 500.0f - 1.0f;
        int axis = i / 1000 % 3, corner = i / 3000 % 4;
        float e[3] = {s, corner & 1 ? 1.0f : -1.0f, corner & 2 ? 1.0f : -1.0f};
        struct pt_ray ray = ray_to(v3(0.1f, -0.2f, 0.3f), v3(0, 0, 0));
        ray.direction = v3_sub(v3(e[axis], e[(axis + 1) % 3], e[(axis + 2) % 3]), ray.origin);
        missed += !pt_accel_intersect(&scene, &ray, &hit);
    }
    assert_int_equal(missed, 0);
    test_scene_end(&scene);
}

static float number(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) * 0x1p-24f;
}

enum { RAYS = 37, MOVING = 2 }; /* no multiple of a packet; the shape of the instance */

static void compare_many(const struct pt_scene *scene, int count, int coherent, uint32_t *state)
{
    struct pt_ray rays[RAYS];
    const struct pt_ray *list[RAYS];
    struct pt_hit hits[RAYS], *got[RAYS];
    uint8_t occluded[RAYS];
    for (int i = 0; i < count; i++) {
        pt_vec3 to = v3(4.0f * number(state) - 2.0f, 4.0f * number(state) - 2.0f, 5.0f);
        rays[i] = ray_to(v3(0.1f, 0.2f, -4.0f), v3_sub(to, v3(0.1f, 0.2f, -4.0f)));
        rays[i].time = number(state);
        rays[i].t_min = 0.3f * number(state);
        rays[i].t_max = 0.5f + number(state);
        list[i] = &rays[i];
        got[i] = &hits[i];
    }
    pt_accel_intersect_many(scene, list, count, coherent, got);
    pt_accel_occluded_many(scene, list, count, occluded);
    for (int i = 0; i < count; i++) {
        struct pt_hit one;
        assert_int_equal(pt_accel_intersect(scene, &rays[i], &one), hits[i].shape >= 0);
        assert_int_equal(occluded_one(scene, &rays[i]), occluded[i]);
        assert_int_equal(one.shape, hits[i].shape);
        if (one.shape < 0)
            continue;
        assert_int_equal(one.primitive, hits[i].primitive);
        assert_int_equal(one.instance, hits[i].instance);
        assert_int_equal(one.instance, one.shape == MOVING ? 0 : -1);
        assert_memory_equal(&one.t, &hits[i].t, sizeof one.t);
        assert_memory_equal(&one.geometric, &hits[i].geometric, sizeof one.geometric);
        if (scene->shapes[one.shape].kind == PT_SHAPE_MESH) {
            assert_memory_equal(&one.u, &hits[i].u, sizeof one.u);
            assert_memory_equal(&one.v, &hits[i].v, sizeof one.v);
        }
    }
}

static void compare_lanes(const struct pt_scene *scene, int count, int coherent, uint32_t *state)
{
    float d[3][48], o[3][48];
    struct pt_hit hits[RAYS], *got[RAYS];
    uint8_t occluded[RAYS];
    for (int i = 0; i < count; i++) {
        got[i] = &hits[i];
        const pt_vec3 to = v3(4.0f * number(state) - 2.0f, 4.0f * number(state) - 2.0f, 9.0f);
        d[0][i] = to.x, d[1][i] = to.y, d[2][i] = to.z;
        o[0][i] = 0.1f, o[1][i] = 0.2f, o[2][i] = -4.0f;
    }
    const struct pt_ray_lanes rays = {{o[0], o[1], o[2]}, {d[0], d[1], d[2]}, 0.0f, 0.5f + number(state)};
    pt_accel_intersect_lanes(scene, &rays, count, coherent, got);
    pt_accel_occluded_lanes(scene, &rays, count, occluded);
    for (int i = 0; i < count; i++) {
        const struct pt_ray ray = {v3(o[0][i], o[1][i], o[2][i]), v3(d[0][i], d[1][i], d[2][i]), 0.0f, rays.t_max, 0.0f};
        struct pt_hit one;
        pt_accel_intersect(scene, &ray, &one);
        assert_int_equal(one.shape, hits[i].shape);
        assert_int_equal(occluded_one(scene, &ray), occluded[i]);
        if (one.shape >= 0)
            assert_memory_equal(&one.t, &hits[i].t, sizeof one.t);
    }
}

/* Triangles, a quadric and an instance that moves: many rays together meet what each would meet alone. */
static void many_rays_are_as_single_ones(void **state)
{
    (void)state;
    struct pt_scene scene;
    uint32_t seed = 1;
    test_scene_begin(&scene);
    int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f));
    test_add_quad(&scene, grey, v3(-2, -2, 3), v3(3, 0, 0), v3(0, 3, 0.5f));
    test_add_sphere(&scene, grey, v3(-0.5f, 0.5f, 1), 0.6f);
    scene.world_shape_count = 2;
    test_add_quad(&scene, grey, v3(-0.5f, -0.5f, 0), v3(1, 0, 0), v3(0, 1, 0));
    scene.objects[scene.object_count++] = (struct pt_object){2, 1};
    struct pt_mat34 here = {{1, 0, 0, 0.2f, 0, 1, 0, -0.3f, 0, 0, 1, 0}}, there = here;
    there.m[3] = 0.9f;
    scene.instances[scene.instance_count++] = (struct pt_instance){0, 1, {here, there}, v3_splat(0.0f)};
    test_scene_finish(&scene);
    for (int count = 1; count <= RAYS; count++)
        for (int coherent = 0; coherent < 2; coherent++)
            for (int round = 0; round < 20; round++) {
                compare_many(&scene, count, coherent, &seed);
                compare_lanes(&scene, count, coherent, &seed);
            }
    test_scene_end(&scene);
}

static void matrices_invert(void **state)
{
    (void)state;
    struct pt_mat34 t = {{1, 2, 0.5f, 3, -1, 0.25f, 4, 5, 0.5f, 0.75f, -2, 7}}, inv,
                    flat = {{1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0}};
    assert_int_equal(pt_mat34_invert(&t, &inv), 1);
    pt_vec3 p = v3(0.3f, -4.0f, 2.0f);
    assert_vec_near(pt_mat34_point(&inv, pt_mat34_point(&t, p)), p, 1e-5f);
    assert_int_equal(pt_mat34_invert(&flat, &inv), 0);
}

/* Blocks are zeroed, apart and at multiples of 16; large ones go by themselves and do not close the one being filled. */
static void arenas_give_room(void **state)
{
    (void)state;
    struct pt_arena arena = {0};
    unsigned char *at[200], *last = NULL;
    size_t sizes[200], total = 0;
    assert_null(pt_arena_alloc(&arena, 0, 8));
    assert_null(pt_arena_alloc(&arena, 8, 0));
    assert_null(pt_arena_alloc(&arena, SIZE_MAX / 4, 8));
    assert_null(pt_arena_alloc(&arena, SIZE_MAX / 16 + 1, 8));
    assert_int_equal(arena.bytes, 0);
    for (int i = 0; i < 200; i++) {
        int large = i % 50 == 7;
        sizes[i] = large ? (1u << 18) + 1 + (size_t)i : (size_t)(i * i % 4001 + 1);
        at[i] = pt_arena_alloc(&arena, sizes[i], 1);
        assert_non_null(at[i]);
        assert_int_equal((uintptr_t)at[i] % 16, 0);
        for (size_t k = 0; k < sizes[i]; k++)
            assert_int_equal(at[i][k], 0);
        memset(at[i], 1 + i, sizes[i]);
        size_t rounded = (sizes[i] + 15) / 16 * 16;
        total += rounded;
        assert_int_equal(arena.bytes, total);
        if (!large && i > 0 && i < 60) /* 60 small ones fit one block of 2^18 */
            assert_ptr_equal(at[i], last);
        last = large ? last : at[i] + rounded;
    }
    for (int i = 0; i < 200; i++)
        for (size_t k = 0; k < sizes[i]; k++)
            assert_int_equal(at[i][k], (unsigned char)(1 + i));
    char *copy = pt_arena_strdup(&arena, "abcd");
    assert_string_equal(copy, "abcd");
    unsigned char *whole = pt_arena_alloc(&arena, (1u << 18) / 8, 8);
    memset(whole, 7, 1u << 18);
    pt_arena_release(&arena);
    assert_true(arena.bytes == 0 && !arena.chunks);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_have_right_hand_normals),
        cmocka_unit_test(what_was_passed_is_met_no_more),
        cmocka_unit_test(start_is_not_met),
        cmocka_unit_test(empty_scene_has_no_hits),
        cmocka_unit_test(bounds_of_a_sheet),
        cmocka_unit_test(quadrics),
        cmocka_unit_test(quadric_surfaces),
        cmocka_unit_test(instances),
        cmocka_unit_test(meshes_are_watertight),
        cmocka_unit_test(many_rays_are_as_single_ones),
        cmocka_unit_test(matrices_invert),
        cmocka_unit_test(arenas_give_room),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
