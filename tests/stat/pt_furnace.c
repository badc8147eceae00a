/* Furnaces: radiance that must come out exactly, whatever happens on the way. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>

#include "support/pt_scenes.h"

static void add_environment(struct pt_scene *scene, float radiance)
{
    struct pt_light light = {.kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {radiance, radiance, radiance}};
    test_add_light(scene, &light);
}

static pt_vec3 mean_of(struct pt_scene *scene, int max_depth, uint32_t spp, double *error)
{
    struct pt_integrator settings = test_integrator(max_depth);
    return test_mean(scene, &settings, pt_kernel_select(scene->effects, NULL, NULL), spp, error);
}

/* A sphere that fills the view, in a white environment. */
static void sphere_scene(struct pt_scene *scene)
{
    test_scene_begin(scene);
    test_camera(scene, v3(0, 0, -4), v3(0, 0, 0), v3(0, 1, 0), 20.0f, 24);
    add_environment(scene, 1.0f);
}

static struct pt_input grey(float x) { return (struct pt_input){0, {x, x, x}}; }

/* --- what a rough metal gives back after one reflection ------------------------------------------------------------------ */

static double smith_lambda(double cosine, double alpha)
{
    double tan2 = 1.0 / (cosine * cosine) - 1.0;
    return 0.5 * (sqrt(1.0 + alpha * alpha * tan2) - 1.0);
}

/* Directional albedo of isotropic GGX without Fresnel's loss, height-correlated Smith masking (Heitz 2014, eq. 99): over half vectors h
 * drawn by D(h) cos h (Walter et al. 2007, eq. 35), the mean of G2 (wo·h) / (cos o · cos h), by the midpoint rule. */
static double metal_albedo(double cos_o, double alpha)
{
    enum { NU = 100, NP = 48 };
    double sin_o = sqrt(1.0 - cos_o * cos_o), sum = 0.0;
    for (int i = 0; i < NU; i++) {
        double u = (i + 0.5) / NU, cos_h = sqrt((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u)), sin_h = sqrt(1.0 - cos_h * cos_h);
        for (int k = 0; k < NP; k++) {
            double oh = sin_o * sin_h * cos(2.0 * 3.14159265358979 * (k + 0.5) / NP) + cos_o * cos_h, cos_i = 2.0 * oh * cos_h - cos_o;
            if (oh > 0.0 && cos_i > 0.0)
                sum += oh / (cos_o * cos_h * (1.0 + smith_lambda(cos_o, alpha) + smith_lambda(cos_i, alpha))) / (NU * NP);
        }
    }
    return sum;
}

/* The mean over the view of sphere_scene: a ray at the angle t from the axis meets the sphere at the incidence asin(4 sin t). */
static double metal_sphere(double alpha)
{
    enum { N = 40 };
    double edge = tan(10.0 * 3.14159265358979 / 180.0), sum = 0.0;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < N; k++) {
            double x = edge * (i + 0.5) / N, y = edge * (k + 0.5) / N, sin2 = (x * x + y * y) / (1.0 + x * x + y * y);
            sum += metal_albedo(sqrt(1.0 - 16.0 * sin2), alpha) / (N * N);
        }
    return sum;
}

static void rough_metals_lose_what_one_reflection_loses(void **state)
{
    (void)state;
    static const float alphas[] = {0.1f, 0.35f, 0.7f, 1.0f};
    for (int i = 0; i < 4; i++) {
        struct pt_scene scene;
        double error, want = metal_sphere((double)alphas[i]);
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, PT_BSDF_CONDUCTOR);
        scene.materials[id].reflectance = grey(1.0f);
        scene.materials[id].roughness_u = scene.materials[id].roughness_v = grey(alphas[i]);
        scene.materials[id].conductor_by_colour = 1;
        test_add_sphere(&scene, id, v3(0, 0, 0), 1.0f);
        test_scene_finish(&scene);
        double y = (double)v3_luminance(mean_of(&scene, -1, 128, &error));
        if (!(fabs(y - want) <= 4.0 * error + 5e-4)) /* … and the midpoint rule */
            fail_msg("alpha %g: %.5f ± %.5f, not %.5f", (double)alphas[i], y, error, want);
        test_scene_end(&scene);
    }
}

struct furnace {
    const char *name;
    int32_t kind;
    float roughness, eta;
    double least, most; /* mean radiance: single-scattering microfacets, and coatings with their few inner bounces, lose some */
};

/* No BSDF may return more than it gets; those that lose nothing must return all. */
static void every_bsdf(void **state)
{
    (void)state;
    static const struct furnace cases[] = {
        {"diffuse", PT_BSDF_DIFFUSE, 0.0f, 1.5f, 0.9999, 1.0001},
        {"mirror", PT_BSDF_CONDUCTOR, 0.0f, 1.5f, 0.999, 1.0001},
        {"rough metal 1e-4", PT_BSDF_CONDUCTOR, 1e-4f, 1.5f, 0.999, 1.001},
        {"rough metal 0.01", PT_BSDF_CONDUCTOR, 0.01f, 1.5f, 0.99, 1.001},
        {"rough metal 0.1", PT_BSDF_CONDUCTOR, 0.1f, 1.5f, 0.97, 1.001},
        {"rough metal 1", PT_BSDF_CONDUCTOR, 1.0f, 1.5f, 0.3, 1.001},
        {"glass", PT_BSDF_DIELECTRIC, 0.0f, 1.5f, 0.995, 1.005},
        {"matched glass", PT_BSDF_DIELECTRIC, 0.0f, 1.0f, 0.9999, 1.0001},
        {"bubble", PT_BSDF_DIELECTRIC, 0.0f, 0.667f, 0.995, 1.005},
        {"rough glass 1e-4", PT_BSDF_DIELECTRIC, 1e-4f, 1.5f, 0.99, 1.005},
        {"rough glass 0.1", PT_BSDF_DIELECTRIC, 0.1f, 1.5f, 0.95, 1.005},
        {"rough glass 1", PT_BSDF_DIELECTRIC, 1.0f, 1.5f, 0.3, 1.005},
        {"thin glass", PT_BSDF_THIN_DIELECTRIC, 0.0f, 1.5f, 0.995, 1.005},
        {"diffuse transmission", PT_BSDF_DIFFUSE_TRANSMISSION, 0.0f, 1.5f, 0.995, 1.005},
        {"coated diffuse", PT_BSDF_COATED_DIFFUSE, 0.0f, 1.5f, 0.8, 1.01},
        {"coated diffuse rough", PT_BSDF_COATED_DIFFUSE, 0.3f, 1.5f, 0.6, 1.01},
        {"coated metal", PT_BSDF_COATED_CONDUCTOR, 0.0f, 1.5f, 0.6, 1.01},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct pt_scene scene;
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, cases[i].kind);
        struct pt_material *m = &scene.materials[id];
        m->reflectance = grey(cases[i].kind == PT_BSDF_DIFFUSE_TRANSMISSION ? 0.4f : 1.0f);
        m->transmittance = grey(0.6f);
        m->roughness_u = m->roughness_v = m->base_roughness_u = m->base_roughness_v = grey(cases[i].roughness);
        m->conductor_by_colour = 1;
        m->eta = cases[i].eta;
        test_add_sphere(&scene, id, v3(0, 0, 0), 1.0f);
        test_scene_finish(&scene);
        double error;
        pt_vec3 l = mean_of(&scene, -1, 32, &error);
        double y = (double)v3_luminance(l);
        if (!(y >= cases[i].least - 4.0 * error && y <= cases[i].most + 4.0 * error))
            fail_msg("%s: %g ± %g is outside [%g, %g]", cases[i].name, y, error, cases[i].least, cases[i].most);
        test_scene_end(&scene);
    }
}

/* A box of a scattering medium that absorbs nothing, bounded by interfaces: light only changes direction. */
static void medium_furnace(void **state)
{
    (void)state;
    for (int i = 0; i < 3; i++) {
        struct pt_scene scene;
        sphere_scene(&scene);
        int32_t id = test_add_material(&scene, PT_MATERIAL_INTERFACE);
        int32_t medium = test_add_medium(&scene, v3_splat(0.0f), i == 2 ? v3(0.5f, 2.0f, 8.0f) : v3_splat(3.0f), i == 0 ? 0.0f : 0.8f);
        int32_t box = test_add_box(&scene, id, v3(-1, -1, -1), v3(1, 1, 1), 0);
        scene.shapes[box].medium_in = medium;
        test_scene_finish(&scene);
        double error;
        pt_vec3 l = mean_of(&scene, -1, 32, &error);
        assert_true(fabs((double)v3_luminance(l) - 1.0) < 4.0 * error + 1e-3);
        test_scene_end(&scene);
    }
}

/* Absorption only, straight through a slab of thickness 2: exp(-2 σ) per channel, seen from outside and lit through it. */
static void beer_lambert(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(0, 0, -4), v3(0, 0, 0), v3(0, 1, 0), 1e-3f, 4);
    add_environment(&scene, 1.0f);
    int32_t id = test_add_material(&scene, PT_MATERIAL_INTERFACE);
    int32_t medium = test_add_medium(&scene, v3(0.1f, 0.5f, 2.0f), v3_splat(0.0f), 0.0f);
    scene.shapes[test_add_box(&scene, id, v3(-1, -1, -1), v3(1, 1, 1), 0)].medium_in = medium;
    test_scene_finish(&scene);
    pt_vec3 l = mean_of(&scene, 5, 4, NULL);
    assert_true(fabsf(l.x - expf(-0.2f)) < 1e-5f);
    assert_true(fabsf(l.y - expf(-1.0f)) < 1e-5f);
    assert_true(fabsf(l.z - expf(-4.0f)) < 1e-5f);
    test_scene_end(&scene);
}

/* The same through next-event estimation: a point light behind the slab lights a diffuse wall head on; nested slabs add up. */
static void beer_lambert_on_shadow_rays(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_scene_begin(&scene);
    test_camera(&scene, v3(0, 0, -4), v3(0, 0, 4), v3(0, 1, 0), 1e-3f, 4);
    struct pt_light point = {.kind = PT_LIGHT_POINT, .shape = -1, .image = -1, .emission = {16, 16, 16}, .position = {0, 0, 0}};
    test_add_light(&scene, &point); /* at the camera: render space is recentred there */
    int32_t id = test_add_material(&scene, PT_MATERIAL_INTERFACE), white = test_add_diffuse(&scene, v3_splat(1.0f));
    int32_t outer = test_add_medium(&scene, v3(0.1f, 0.2f, 0.5f), v3_splat(0.0f), 0.0f);
    int32_t inner = test_add_medium(&scene, v3(0.0f, 0.3f, 1.0f), v3_splat(0.0f), 0.0f);
    scene.shapes[test_add_box(&scene, id, v3(-2, -2, -2), v3(2, 2, 2), 0)].medium_in = outer;
    int32_t core = test_add_box(&scene, id, v3(-1, -1, -1), v3(1, 1, 1), 0);
    scene.shapes[core].medium_in = inner;
    scene.shapes[core].medium_out = outer;
    test_add_quad(&scene, white, v3(-1, -1, 4), v3(0, 2, 0), v3(2, 0, 0));
    test_scene_finish(&scene);
    pt_vec3 l = mean_of(&scene, 1, 4, NULL);
    const float sigma_outer[3] = {0.1f, 0.2f, 0.5f}, sigma_inner[3] = {0.0f, 0.3f, 1.0f}, got[3] = {l.x, l.y, l.z};
    for (int i = 0; i < 3; i++) {
        /* 2 units of each medium, there and back */
        float expected = 16.0f / 64.0f / PT_PI * expf(-4.0f * (sigma_outer[i] + sigma_inner[i]));
        assert_true(fabsf(got[i] - expected) < 1e-3f * expected);
    }
    test_scene_end(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rough_metals_lose_what_one_reflection_loses), cmocka_unit_test(every_bsdf),
        cmocka_unit_test(medium_furnace), cmocka_unit_test(beer_lambert),
        cmocka_unit_test(beer_lambert_on_shadow_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
