/* The hard cases of light transport, each with the property it must keep. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "geom/accel.h"
#include "support/pt_scenes.h"

static pt_vec3 mean_of(struct pt_scene *scene, const struct pt_integrator *settings, uint32_t spp, double *error)
{
    return test_mean(scene, settings, pt_kernel_select(scene->effects, NULL, NULL), spp, error);
}

static void assert_ratio(double value, double expected, double tolerance, const char *what)
{
    if (!(fabs(value - expected) <= tolerance * fabs(expected)))
        fail_msg("%s: %.8g instead of %.8g", what, value, expected);
}

/* A closed box whose walls emit 1 and reflect 0.999: after 1000 bounces Σ 0.999^k, k = 0 … 1000. A path that leaks through an
 * edge or stops early loses energy. */
static void closed_furnace(void **state)
{
    (void)state;
    struct pt_scene scene;
    double expected = (1.0 - pow(0.999, 1001.0)) / 0.001, error;
    for (int strategy = 0; strategy < 2; strategy++) {
        test_scene_begin(&scene);
        test_camera(&scene, v3(0.1f, 0.2f, 0.3f), v3(0, 0, -1), v3(0, 1, 0), 90.0f, strategy ? 8 : 16);
        int32_t white = test_add_diffuse(&scene, v3_splat(0.999f));
        test_add_area_light(&scene, test_add_box(&scene, white, v3(-1, -1, -1), v3(1, 1, 1), 1), v3_splat(1.0f), 0);
        test_scene_finish(&scene);
        struct pt_integrator settings = test_integrator(1000);
        settings.rr_depth = 2000;
        settings.strategy = strategy ? PT_STRATEGY_BSDF_ONLY : PT_STRATEGY_MIS;
        pt_vec3 l = mean_of(&scene, &settings, strategy ? 8 : 16, &error);
        printf("# figure furnace: radiance %.1f instead of %.1f\n", (double)l.y, expected);
        assert_ratio((double)l.y, expected, strategy ? 5e-4 : 5e-3, strategy ? "brute force" : "light sampling");
        test_scene_end(&scene);
    }
}

/* Radiance of a diffuse plane under a sphere light of radius r at height h straight above: ρ/π · π (r/h)² L. */
static void sphere_light(void **state)
{
    (void)state;
    static const float radii[] = {1e-8f, 1e-7f, 1e-6f, 1e-4f, 1e-2f, 1.0f, 1.9f};
    for (size_t i = 0; i < sizeof radii / sizeof *radii; i++) {
        struct pt_scene scene;
        test_scene_begin(&scene);
        test_camera(&scene, v3(0, 1e-2f, 0), v3(0, 0, 0), v3(0, 0, 1), 1.0f, 8);
        int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f)), black = test_add_diffuse(&scene, v3_splat(0.0f));
        test_add_quad(&scene, grey, v3(-10, 0, -10), v3(0, 0, 20), v3(20, 0, 0));
        test_add_area_light(&scene, test_add_sphere(&scene, black, v3(0, 2, 0), radii[i]), v3_splat(3.0f), 0);
        test_scene_finish(&scene);
        struct pt_integrator settings = test_integrator(1);
        double error, expected = 0.5 * 3.0 * (double)(radii[i] * radii[i]) / 4.0;
        pt_vec3 l = mean_of(&scene, &settings, 64, &error);
        if (!(fabs((double)l.y - expected) < 4.0 * error + 2e-4 * expected))
            fail_msg("sphere light of radius %g: %g ± %g instead of %g", (double)radii[i], (double)l.y, error, expected);
        test_scene_end(&scene);
    }
}

/* Point light of intensity I at height h: ρ/π · I/h². */
static void point_light(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(0, 1e-2f, 0), v3(0, 0, 0), v3(0, 0, 1), 0.1f, 4);
    int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f));
    test_add_quad(&scene, grey, v3(-10, 0, -10), v3(0, 0, 20), v3(20, 0, 0));
    struct pt_light point = {
        .kind = PT_LIGHT_POINT, .shape = -1, .image = -1, .emission = {7, 7, 7}, .position = {0, 2.0f - 1e-2f, 0}};
    test_add_light(&scene, &point);
    test_scene_finish(&scene);
    struct pt_integrator settings = test_integrator(1);
    pt_vec3 l = mean_of(&scene, &settings, 1, NULL);
    assert_ratio((double)l.y, 0.5 / 3.14159265358979 * 7.0 / 4.0, 1e-4, "point light");
    test_scene_end(&scene);
}

/* Square lights of 1e-4 and 1e4 units: a tiny one has the irradiance of a point; a huge one that of a hemisphere of light. */
static void lights_of_extreme_size(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct pt_scene scene;
        float size = i ? 1e4f : 1e-4f;
        test_scene_begin(&scene);
        test_camera(&scene, v3(0, 1e-2f, 0), v3(0, 0, 0), v3(0, 0, 1), 0.1f, 8);
        int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f)), black = test_add_diffuse(&scene, v3_splat(0.0f));
        test_add_quad(&scene, grey, v3(-10, 0, -10), v3(0, 0, 20), v3(20, 0, 0));
        int32_t lamp = test_add_quad(&scene, black, v3(-0.5f * size, 2, -0.5f * size), v3(size, 0, 0), v3(0, 0, size));
        test_add_area_light(&scene, lamp, v3_splat(i ? 1.0f : 1e8f), 0);
        test_scene_finish(&scene);
        struct pt_integrator settings = test_integrator(1);
        double error, expected = i ? 0.5 : 0.5 / 3.14159265358979 / 4.0;
        pt_vec3 l = mean_of(&scene, &settings, 64, &error);
        if (!(fabs((double)l.y - expected) < 4.0 * error + 1e-3 * expected))
            fail_msg("light of %g units: %g ± %g instead of %g", (double)size, (double)l.y, error, expected);
        test_scene_end(&scene);
    }
}

enum { SIZE = 32, SPP = 64 };

static void render(const struct pt_scene *scene, const struct pt_integrator *settings, double *mean, double *variance)
{
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        double sum = 0.0, sum2 = 0.0;
        for (uint32_t s = 0; s < SPP; s++) {
            struct pt_path_result r;
            kernel(scene, settings, i % SIZE, i / SIZE, 1, s, &r);
            double l = (double)v3_luminance(r.radiance);
            sum += l;
            sum2 += l * l;
        }
        mean[i] = sum / SPP;
        variance[i] = (sum2 / SPP - mean[i] * mean[i]) / SPP;
    }
}

/* The Cornell box scaled and shifted: the same image within noise, pixel by pixel (other random numbers), and no pixel that is
 * dark because of self-intersections. */
static void scale_and_shift(void **state)
{
    (void)state;
    static const struct {
        float scale;
        pt_vec3 shift;
    } cases[] = {
        {1e-4f, {0, 0, 0}}, {1e4f, {0, 0, 0}}, {1.0f, {1e5f, 0, 0}}, {1.0f, {-1e5f, 1e5f, 1e5f}}, {1e4f, {1e5f, -1e5f, 0}}};
    static double base[SIZE * SIZE], base_var[SIZE * SIZE], mean[SIZE * SIZE], var[SIZE * SIZE];
    struct pt_scene scene;
    struct pt_integrator settings = test_integrator(5);
    test_cornell(&scene, SIZE, 1.0f, v3_splat(0.0f));
    render(&scene, &settings, base, base_var);
    test_scene_end(&scene);
    for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
        settings.seed = 2 + (uint32_t)k;
        test_cornell(&scene, SIZE, cases[k].scale, cases[k].shift);
        render(&scene, &settings, mean, var);
        test_scene_end(&scene);
        double z2 = 0.0, total = 0.0, total_base = 0.0, spread = 0.0;
        for (int i = 0; i < SIZE * SIZE; i++) {
            double v = var[i] + base_var[i] + 1e-12;
            z2 += fmin(25.0, (mean[i] - base[i]) * (mean[i] - base[i]) / v) / (SIZE * SIZE);
            total += mean[i];
            total_base += base[i];
            spread += v;
        }
        if (fabs(total - total_base) > 4.5 * sqrt(spread))
            fail_msg("case %zu: energy %g instead of %g ± %g", k, total, total_base, sqrt(spread));
        /* coordinates shifted by 1e5 in float move the edges by up to 1/100 unit: a few pixels along them may differ */
        if (z2 > (cases[k].shift.x != 0.0f ? 1.6 : 1.25))
            fail_msg("case %zu: mean squared z-score %g", k, z2);
    }
}

/* Every triangle of the box twice, and degenerate ones (points, needles) strewn in: the same image within noise. */
static void duplicated_and_degenerate(void **state)
{
    (void)state;
    static double base[SIZE * SIZE], base_var[SIZE * SIZE], mean[SIZE * SIZE], var[SIZE * SIZE];
    struct pt_scene scene;
    struct pt_integrator settings = test_integrator(5);
    test_cornell(&scene, SIZE, 1.0f, v3_splat(0.0f));
    render(&scene, &settings, base, base_var);
    pt_accel_release(&scene);
    int32_t count = scene.shape_count;
    for (int32_t i = 0; i < count; i++)
        if (scene.shapes[i].light < 0)
            scene.shapes[scene.shape_count++] = scene.shapes[i];
    static const uint32_t indices[] = {0, 0, 0, 0, 1, 1, 0, 1, 2, 0, 1, 0};
    const float needle[9] = {0, 1, 0, 0.5f, 1, 0.5f, 1.0f, 1, 1.0f};
    test_add_mesh(&scene, 0, needle, 3, indices, 4);
    test_scene_finish(&scene);
    settings.seed = 9;
    render(&scene, &settings, mean, var);
    test_scene_end(&scene);
    double total = 0.0, total_base = 0.0, spread = 0.0, z2 = 0.0;
    for (int i = 0; i < SIZE * SIZE; i++) {
        assert_true(isfinite(mean[i]));
        total += mean[i];
        total_base += base[i];
        spread += var[i] + base_var[i];
        z2 += fmin(25.0, (mean[i] - base[i]) * (mean[i] - base[i]) / (var[i] + base_var[i] + 1e-12)) / (SIZE * SIZE);
    }
    assert_true(fabs(total - total_base) < 4.5 * sqrt(spread));
    assert_true(z2 < 1.25);
}

/* A light in the very plane of the ceiling, facing down, still lights the floor: half or all of it wins the tie with the
 * ceiling, but shadow rays must not be stopped by it. */
static void coplanar_light(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(0, 1, 0), v3(0, 0, 0), v3(0, 0, 1), 1.0f, 8);
    int32_t grey = test_add_diffuse(&scene, v3_splat(0.5f)), black = test_add_diffuse(&scene, v3_splat(0.0f));
    test_add_quad(&scene, grey, v3(-5, 0, -5), v3(0, 0, 10), v3(10, 0, 0));
    test_add_quad(&scene, black, v3(-5, 2, -5), v3(10, 0, 0), v3(0, 0, 10));
    int32_t lamp = test_add_quad(&scene, black, v3(-0.05f, 2, -0.05f), v3(0.1f, 0, 0), v3(0, 0, 0.1f));
    test_add_area_light(&scene, lamp, v3_splat(100.0f), 0);
    test_scene_finish(&scene);
    struct pt_integrator settings = test_integrator(1);
    double error;
    pt_vec3 l = mean_of(&scene, &settings, 64, &error);
    assert_ratio((double)l.y, 0.5 / 3.14159265358979 * 100.0 * 0.01 / 4.0, 0.01, "coplanar light");
    test_scene_end(&scene);
}

/* A plane seen at 1e-4 rad under a white sky: its radiance is its albedo at any angle, and nothing is NaN. */
static void grazing(void **state)
{
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        struct pt_scene scene;
        test_scene_begin(&scene);
        test_camera(&scene, v3(0, 1e-3f, 0), v3(0, 0, 10), v3(0, 1, 0), 1e-3f, 8);
        int32_t id = test_add_material(&scene, kind ? PT_BSDF_CONDUCTOR : PT_BSDF_DIFFUSE);
        scene.materials[id].roughness_u = scene.materials[id].roughness_v = (struct pt_input){0, {0.1f, 0.1f, 0.1f}};
        test_add_quad(&scene, id, v3(-1000, 0, -1000), v3(0, 0, 2000), v3(2000, 0, 0));
        struct pt_light sky = {.kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {1, 1, 1}};
        test_add_light(&scene, &sky);
        test_scene_finish(&scene);
        struct pt_integrator settings = test_integrator(4);
        double error;
        pt_vec3 l = mean_of(&scene, &settings, 64, &error);
        assert_true(v3_is_finite(l));
        if (kind == 0)
            assert_ratio((double)l.y, 0.5, 1e-5, "grazing diffuse");
        else
            assert_true(l.y > 0.5f && l.y <= 1.01f);
        test_scene_end(&scene);
    }
}

/* Glass of index 1 is not there; total internal reflection keeps all light inside the critical angle's cone. */
static void matched_and_total(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_cornell(&scene, SIZE, 1.0f, v3_splat(0.0f));
    struct pt_integrator settings = test_integrator(-1);
    settings.strategy = PT_STRATEGY_BSDF_ONLY;
    double base_error, error;
    pt_vec3 base = mean_of(&scene, &settings, 128, &base_error);
    pt_accel_release(&scene);
    int32_t glass = test_add_material(&scene, PT_BSDF_DIELECTRIC);
    scene.materials[glass].eta = 1.0f;
    test_add_sphere(&scene, glass, v3(0, 1, 0.2f), 0.5f);
    test_scene_finish(&scene);
    settings.seed = 5;
    pt_vec3 l = mean_of(&scene, &settings, 128, &error);
    assert_true(fabs((double)(v3_luminance(l) - v3_luminance(base))) < 4.5 * sqrt(error * error + base_error * base_error));
    test_scene_end(&scene);

    /* from inside glass, looking at its flat side beyond the critical angle: a mirror. The sky outside (radiance 1) must not be
     * seen, the emitting wall inside (radiance 2) must. */
    test_scene_begin(&scene);
    test_camera(&scene, v3(0, -0.5f, -3), v3(0, 0, 0), v3(0, 1, 0), 0.01f, 4);
    glass = test_add_material(&scene, PT_BSDF_DIELECTRIC);
    int32_t black = test_add_diffuse(&scene, v3_splat(0.0f));
    test_add_quad(&scene, glass, v3(-50, 0, -50), v3(0, 0, 100), v3(100, 0, 0));
    test_add_area_light(&scene, test_add_quad(&scene, black, v3(-50, -20, 6), v3(0, 20, 0), v3(100, 0, 0)), v3_splat(2.0f),
                        1);
    struct pt_light sky = {.kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {1, 1, 1}};
    test_add_light(&scene, &sky);
    test_scene_finish(&scene);
    settings = test_integrator(-1);
    l = mean_of(&scene, &settings, 16, NULL);
    assert_ratio((double)l.y, 2.0, 1e-4, "total internal reflection");
    test_scene_end(&scene);
}

/* Inside perfect mirrors with unlimited depth a path loses nothing, and must end all the same. */
static void endless_mirrors(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(0.1f, 0.2f, 0.3f), v3(0, 0, -1), v3(0, 1, 0), 90.0f, 4);
    int32_t mirror = test_add_material(&scene, PT_BSDF_DIELECTRIC);
    scene.materials[mirror].eta = 1e4f; /* reflects all but 4e-4 at normal incidence, and all from within */
    test_add_box(&scene, mirror, v3(-1, -1, -1), v3(1, 1, 1), 0);
    test_scene_finish(&scene);
    struct pt_integrator settings = test_integrator(-1);
    pt_vec3 l = mean_of(&scene, &settings, 4, NULL);
    assert_true(l.x == 0.0f && l.y == 0.0f && l.z == 0.0f);
    test_scene_end(&scene);
}

/* A light whose emission is NaN, another that is infinite: paths that meet them are not finite, all others are. */
static void bad_emission(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_cornell(&scene, SIZE, 1.0f, v3_splat(0.0f));
    pt_accel_release(&scene);
    int32_t black = 0;
    test_add_area_light(&scene, test_add_quad(&scene, black, v3(0.99f, 0.9f, -0.1f), v3(0, 0, 0.01f), v3(0, 0.01f, 0)),
                        v3(NAN, INFINITY, 1.0f), 1);
    test_scene_finish(&scene);
    struct pt_integrator settings = test_integrator(5);
    pt_kernel *kernel = pt_kernel_select(scene.effects, NULL, NULL);
    int bad = 0, good = 0;
    for (uint32_t i = 0; i < SIZE * SIZE * 4; i++) {
        struct pt_path_result r;
        kernel(&scene, &settings, i % SIZE, i / SIZE % SIZE, 1, i / (SIZE * SIZE), &r);
        if (v3_is_finite(r.radiance))
            good++;
        else
            bad++;
    }
    assert_true(bad > 0 && good > 0);
    test_scene_end(&scene);
}

/* A camera in the plane of the floor, and within it, sees the sky; a lamp all around instead, which another kernel draws. */
static void camera_in_a_plane(void **state)
{
    (void)state;
    for (int kind = 0; kind < 2; kind++) {
        struct pt_scene scene;
        test_scene_begin(&scene);
        test_camera(&scene, v3(1, 0, 2), v3(2, 0, 3), v3(0, 1, 0), 60.0f, 8);
        int32_t black = test_add_diffuse(&scene, v3_splat(0.0f));
        test_add_quad(&scene, black, v3(-1000, 0, -1000), v3(0, 0, 2000), v3(2000, 0, 0));
        struct pt_light sky = {.kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {1, 1, 1}};
        if (kind)
            test_add_light(&scene, &sky);
        else
            test_add_area_light(&scene, test_add_box(&scene, black, v3(-2000, -2000, -2000), v3(2000, 2000, 2000), 1),
                                v3_splat(1.0f), 0);
        test_scene_finish(&scene);
        struct pt_integrator settings = test_integrator(1);
        pt_vec3 l = mean_of(&scene, &settings, 4, NULL);
        assert_ratio((double)l.y, 1.0, 1e-6, kind ? "sky from within the floor" : "lamp from within the floor");
        test_scene_end(&scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(closed_furnace),    cmocka_unit_test(sphere_light),
        cmocka_unit_test(point_light),       cmocka_unit_test(lights_of_extreme_size),
        cmocka_unit_test(scale_and_shift),   cmocka_unit_test(duplicated_and_degenerate),
        cmocka_unit_test(coplanar_light),    cmocka_unit_test(grazing),
        cmocka_unit_test(matched_and_total), cmocka_unit_test(bad_emission),
        cmocka_unit_test(endless_mirrors),   cmocka_unit_test(camera_in_a_plane),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
