#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "geom/accel.h"
#include "geom/quadric.h"
#include "integ/surface.h"
#include "support/pt_scenes.h"

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
    assert_int_equal(pt_accel_intersect(&scene, &ray, 0, &hit), 1);
    assert_near(hit.t, 2.0f, 1e-6f);
    assert_int_equal(hit.shape, 0);
    assert_int_equal(hit.instance, -1);
    assert_vec_near(v3_norm(hit.geometric), v3(0, 0, 1), 1e-6f);
    struct pt_place at;
    pt_place_at_hit(PT_FX_ALL, &scene, &ray, &hit, &at);
    assert_vec_near(at.p, v3(0.25f, -0.5f, 2.0f), 1e-6f);
    assert_vec_near(at.s.n_geometric, v3(0, 0, 1), 1e-6f);
    /* going on from the distance of a hit must not meet the same surface */
    ray.t_min = pt_ray_beyond(hit.t);
    assert_int_equal(pt_accel_intersect(&scene, &ray, 0, &hit), 0);
    ray.t_min = 0.0f;
    assert_int_equal(pt_accel_occluded(&scene, &ray), 1);
    ray.t_max = 1.9f;
    assert_int_equal(pt_accel_occluded(&scene, &ray), 0);
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
    assert_int_equal(pt_accel_intersect(&scene, &ray, 0, &hit), 0);
    assert_int_equal(pt_accel_occluded(&scene, &ray), 0);
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
    assert_int_equal(pt_quadric_intersect(&q, v3(-3, 0, 0), v3(1, 0, 0), 0.0f, INFINITY, &t, &p), 1);
    assert_near(t, 2.0f, 1e-6f);
    assert_int_equal(pt_quadric_intersect(&q, v3(-3, 0, 0), v3(1, 0, 0), 2.0f, INFINITY, &t, &p), 1);
    assert_near(t, 4.0f, 1e-6f);
    pt_quadric_uv(&q, v3(0, 1, 0), &u, &v, &du, &dv);
    assert_near(u, 0.25f, 1e-6f);
    assert_near(v, 0.5f, 1e-6f);
    assert_vec_near(du, v3(-2.0f * PT_PI, 0, 0), 1e-5f);
    q.z_max = 0.5f;
    assert_int_equal(pt_quadric_intersect(&q, v3(0, 0, 5), v3(0, 0, -1), 0.0f, INFINITY, &t, &p), 1);
    assert_near(t, 6.0f, 1e-6f);
    q = (struct pt_quadric){PT_QUADRIC_CYLINDER, 1.0f, 0.0f, -1.0f, 1.0f, PT_PI, id, id};
    assert_int_equal(pt_quadric_intersect(&q, v3(0, -5, 0), v3(0, 1, 0), 0.0f, INFINITY, &t, &p), 1);
    assert_near(t, 6.0f, 1e-6f); /* y < 0 is cut away */
    assert_int_equal(pt_quadric_intersect(&q, v3(0, -5, 2), v3(0, 1, 0), 0.0f, INFINITY, &t, &p), 0);
    q = (struct pt_quadric){PT_QUADRIC_DISK, 1.0f, 0.5f, 2.0f, 2.0f, 2.0f * PT_PI, id, id};
    assert_int_equal(pt_quadric_intersect(&q, v3(0.75f, 0, 0), v3(0, 0, 1), 0.0f, INFINITY, &t, &p), 1);
    assert_near(t, 2.0f, 1e-6f);
    assert_int_equal(pt_quadric_intersect(&q, v3(0.25f, 0, 0), v3(0, 0, 1), 0.0f, INFINITY, &t, &p), 0);
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
    scene.instances[scene.instance_count++] = (struct pt_instance){0, 0, {turned, turned}};
    scene.instances[scene.instance_count++] = (struct pt_instance){0, 1, {turned, shifted}};
    scene.instances[1].to_render[0].m[7] = scene.instances[1].to_render[1].m[7] = 20.0f;
    test_scene_finish(&scene);

    struct pt_ray ray = ray_to(v3(0, 0.5f, 10.5f), v3(1, 0, 0));
    struct pt_place at;
    assert_int_equal(pt_accel_intersect(&scene, &ray, 0, &hit), 1);
    assert_int_equal(hit.instance, 0);
    assert_int_equal(hit.shape, 1);
    pt_place_at_hit(PT_FX_ALL, &scene, &ray, &hit, &at);
    assert_vec_near(at.p, v3(4, 0.5f, 10.5f), 1e-5f);
    assert_vec_near(at.s.n_geometric, v3(1, 0, 0), 1e-5f);

    for (int i = 0; i <= 4; i++) {
        ray = ray_to(v3(0, 20.5f, 10.5f), v3(1, 0, 0));
        ray.time = (float)i / 4.0f;
        assert_int_equal(pt_accel_intersect(&scene, &ray, 0, &hit), 1);
        assert_int_equal(hit.instance, 1);
        assert_near(hit.t, 4.0f + (float)i, 1e-4f);
        pt_place_at_hit(PT_FX_ALL, &scene, &ray, &hit, &at);
        assert_vec_near(at.p, v3(4.0f + (float)i, 20.5f, 10.5f), 1e-4f);
        assert_vec_near(at.s.n_geometric, v3(1, 0, 0), 1e-5f);
    }
    ray = ray_to(v3(0, 10, 0), v3(0, 0, 1));
    assert_int_equal(pt_accel_intersect(&scene, &ray, 0, &hit), 1);
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
        missed += !pt_accel_intersect(&scene, &ray, 0, &hit);
    }
    assert_int_equal(missed, 0);
    test_scene_end(&scene);
}

static void matrices_invert(void **state)
{
    (void)state;
    struct pt_mat34 t = {{1, 2, 0.5f, 3, -1, 0.25f, 4, 5, 0.5f, 0.75f, -2, 7}}, inv, flat = {{1, 2, 3, 0, 2, 4, 6, 0, 0, 0, 1, 0}};
    assert_int_equal(pt_mat34_invert(&t, &inv), 1);
    pt_vec3 p = v3(0.3f, -4.0f, 2.0f);
    assert_vec_near(pt_mat34_point(&inv, pt_mat34_point(&t, p)), p, 1e-5f);
    assert_int_equal(pt_mat34_invert(&flat, &inv), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triangles_have_right_hand_normals), cmocka_unit_test(empty_scene_has_no_hits), cmocka_unit_test(quadrics),
        cmocka_unit_test(instances), cmocka_unit_test(meshes_are_watertight), cmocka_unit_test(matrices_invert),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
