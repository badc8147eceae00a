#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "sample/rng.h"
#include "shade/camera.h"
#include "support/pt_scenes.h"

static void assert_vec_near(pt_vec3 a, pt_vec3 b, float tolerance)
{
    if (!(v3_len(v3_sub(a, b)) <= tolerance))
        fail_msg("(%g, %g, %g) is not (%g, %g, %g)", (double)a.x, (double)a.y, (double)a.z, (double)b.x, (double)b.y,
                 (double)b.z);
}

static struct pt_camera square_camera(void)
{
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(1, 2, 3), v3(1, 2, 4), v3(0, 1, 0), 90.0f, 100);
    struct pt_camera camera = scene.camera;
    test_scene_end(&scene);
    pt_camera_init(&camera);
    return camera;
}

/* The test camera looks along +z with +y up; x is on the right hand: right = z × up = -x of the world. */
static void perspective(void **state)
{
    (void)state;
    struct pt_camera camera = square_camera();
    struct pt_ray ray;
    pt_camera_ray(PT_FX_ALL, &camera, 50.0f, 50.0f, 0.5f, 0.5f, 0.0f, &ray);
    assert_vec_near(ray.origin, v3(0, 0, 0), 0.0f);
    assert_vec_near(ray.direction, v3(0, 0, 1), 1e-6f);
    pt_camera_ray(PT_FX_ALL, &camera, 0.0f, 0.0f, 0.5f, 0.5f, 0.0f, &ray);
    assert_vec_near(ray.direction, v3_norm(v3(1, 1, 1)), 1e-6f); /* upper left */
    pt_camera_ray(PT_FX_ALL, &camera, 100.0f, 100.0f, 0.5f, 0.5f, 0.0f, &ray);
    assert_vec_near(ray.direction, v3_norm(v3(-1, -1, 1)), 1e-6f);
}

static void orthographic(void **state)
{
    (void)state;
    struct pt_camera camera = square_camera();
    camera.kind = PT_CAMERA_ORTHOGRAPHIC;
    pt_camera_init(&camera);
    struct pt_ray ray;
    pt_camera_ray(PT_FX_ALL, &camera, 0.0f, 100.0f, 0.5f, 0.5f, 0.0f, &ray);
    assert_vec_near(ray.direction, v3(0, 0, 1), 1e-6f);
    assert_vec_near(ray.origin, v3(1, -1, 0), 1e-6f);
}

/* All rays of one raster point meet in the plane in focus, whatever the point on the lens. */
static void lens_focuses(void **state)
{
    (void)state;
    struct pt_camera camera = square_camera();
    camera.lens_radius = 0.25f;
    camera.focal_distance = 5.0f;
    struct pt_rng rng = pt_rng_make(1);
    float widest = 0.0f;
    for (int i = 0; i < 1000; i++) {
        struct pt_ray ray;
        float a = pt_rng_float(&rng), b = pt_rng_float(&rng);
        pt_camera_ray(PT_FX_ALL, &camera, 20.0f, 70.0f, a, b, 0.0f, &ray);
        float t = 5.0f / ray.direction.z;
        assert_vec_near(v3_madd(ray.origin, t, ray.direction), v3(3.0f, -2.0f, 5.0f), 1e-4f);
        widest = fmaxf(widest, v3_len(ray.origin));
    }
    assert_true(widest <= 0.2500001f && widest > 0.24f);
}

static void moving_camera(void **state)
{
    (void)state;
    struct pt_camera camera = square_camera();
    camera.animated = 1;
    camera.to_render[0] = (struct pt_mat34){{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}};
    camera.to_render[1] = (struct pt_mat34){{0, 0, 1, 4, 0, 1, 0, 0, -1, 0, 0, 0}}; /* 90° about y, and a shift */
    struct pt_ray ray;
    pt_camera_ray(PT_FX_ALL, &camera, 50.0f, 50.0f, 0.5f, 0.5f, 0.5f, &ray);
    assert_vec_near(ray.origin, v3(2, 0, 0), 1e-5f);
    assert_vec_near(ray.direction, v3_norm(v3(1, 0, 1)), 1e-5f);
    pt_camera_ray(PT_FX_ALL, &camera, 50.0f, 50.0f, 0.5f, 0.5f, 1.0f, &ray);
    assert_vec_near(ray.direction, v3(1, 0, 0), 1e-5f);
}

/* Standard deviation along x over a fine grid of u against the filter's own, by quadrature. */
static void filters(void **state)
{
    (void)state;
    struct pt_integrator s = test_integrator(1);
    const float radius[3] = {0.5f, 1.5f, 1.5f};
    const double expected[3] = {0.5 / sqrt(3.0), 1.5 / sqrt(6.0), 0.0};
    for (int kind = 0; kind < 3; kind++) {
        s.filter = kind;
        s.filter_x = s.filter_y = radius[kind];
        double sum = 0.0, sum2 = 0.0, quad = 0.0, quad2 = 0.0;
        enum { N = 100000 };
        for (int i = 0; i < N; i++) {
            float dx, dy, u = ((float)i + 0.5f) / N, quarter = 0.25f;
            pt_filter_sample(&s, 1, &u, &quarter, &dx, &dy);
            assert_true(fabsf(dx) <= radius[kind] && fabsf(dy) <= radius[kind] && dy <= 0.0f);
            sum += (double)dx / N;
            sum2 += (double)dx * (double)dx / N;
            double x = ((double)u * 2.0 - 1.0) * 1.5, w = exp(-x * x / (2.0 * 0.25));
            quad += w;
            quad2 += w * x * x;
        }
        double want = kind == PT_FILTER_GAUSSIAN ? sqrt(quad2 / quad) : expected[kind];
        assert_true(fabs(sum) < 1e-4);
        assert_true(fabs(sqrt(sum2) - want) < 1e-3);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(perspective),   cmocka_unit_test(orthographic), cmocka_unit_test(lens_focuses),
        cmocka_unit_test(moving_camera), cmocka_unit_test(filters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
