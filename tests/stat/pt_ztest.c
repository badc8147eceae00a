/*
 * Light sampling with MIS against brute force, tile by tile: the z-scores of the differences must look like noise. With k tests
 * at family error rate 1e-4 the bound on |z| is Šidák's, from the normal quantile of 1 - (1 - 1e-4)^(1/k).
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glob.h>
#include <math.h>

#include "geom/accel.h"
#include "pbrt/load.h"
#include "scene/settings.h"
#include "support/pt_scenes.h"
#include "support/pt_mat34.h"

enum { TILES = 8 }; /* per side */

struct moments {
    double sum, sum2, n;
};

static void accumulate(const struct pt_scene *scene, int strategy, int sampler, uint32_t seed, uint32_t spp,
                       struct moments tiles[TILES * TILES][3])
{
    struct pt_integrator settings = test_integrator(5);
    settings.strategy = strategy;
    settings.sampler = sampler;
    settings.seed = seed;
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    int size = scene->camera.width;
    for (int y = 0; y < size; y++)
        for (int x = 0; x < size; x++)
            for (uint32_t s = 0; s < spp; s++) {
                struct pt_path_result r;
                kernel(scene, &settings, (uint32_t)x, (uint32_t)y, 1, s, &r);
                const float l[3] = {r.radiance.x, r.radiance.y, r.radiance.z};
                struct moments *m = tiles[y * TILES / size * TILES + x * TILES / size];
                for (int c = 0; c < 3; c++) {
                    m[c].sum += (double)l[c];
                    m[c].sum2 += (double)l[c] * (double)l[c];
                    m[c].n += 1.0;
                }
            }
}

/* |z| that k independent tests exceed with probability `family` altogether: bisection on erfc. */
static double sidak(int k, double family)
{
    double p = -expm1(log1p(-family) / k), lo = 0.0, hi = 40.0;
    for (int i = 0; i < 100; i++) {
        double z = 0.5 * (lo + hi);
        if (erfc(z / sqrt(2.0)) > p)
            lo = z;
        else
            hi = z;
    }
    return hi;
}

static struct moments a[TILES * TILES][3], b[TILES * TILES][3];

static void clear(void)
{
    for (int i = 0; i < TILES * TILES; i++)
        for (int c = 0; c < 3; c++)
            a[i][c] = b[i][c] = (struct moments){0};
}

/* The tiles of a against those of b. */
static void judge(const char *name)
{
    double bound = sidak(3 * TILES * TILES, 1e-4), worst = 0.0;
    for (int i = 0; i < TILES * TILES; i++)
        for (int c = 0; c < 3; c++) {
            double ma = a[i][c].sum / a[i][c].n, mb = b[i][c].sum / b[i][c].n;
            double va = (a[i][c].sum2 / a[i][c].n - ma * ma) / a[i][c].n,
                   vb = (b[i][c].sum2 / b[i][c].n - mb * mb) / b[i][c].n;
            double spread = sqrt(fmax(va + vb, 1e-20));
            worst = fmax(worst, fabs(ma - mb) / fmax(spread, 1e-6 * fmax(ma, mb)));
        }
    if (worst > bound)
        fail_msg("%s: a z-score of %.2f beyond %.2f", name, worst, bound);
}

static void compare(const struct pt_scene *scene, uint32_t spp_mis, uint32_t spp_brute, const char *name)
{
    clear();
    accumulate(scene, PT_STRATEGY_MIS, PT_SAMPLER_INDEPENDENT, 1, spp_mis, a);
    accumulate(scene, PT_STRATEGY_BSDF_ONLY, PT_SAMPLER_INDEPENDENT, 2, spp_brute, b);
    judge(name);
}

static void cornell(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_cornell(&scene, 32, 1.0f, v3_splat(0.0f));
    compare(&scene, 64, 512, "cornell box");
    test_scene_end(&scene);
}

static struct pt_input grey(float x) { return (struct pt_input){0, {x, x, x}}; }

/* Spheres as lights of two sizes, over rough metal and coated floors, an image environment above. */
static void glossy_scene(struct pt_scene *scene)
{
    test_scene_begin(scene);
    test_camera(scene, v3(0, 2, -6), v3(0, 0.5f, 0), v3(0, 1, 0), 40.0f, 32);
    int32_t metal = test_add_material(scene, PT_BSDF_CONDUCTOR), coat = test_add_material(scene, PT_BSDF_COATED_DIFFUSE);
    int32_t glass = test_add_material(scene, PT_BSDF_DIELECTRIC), black = test_add_diffuse(scene, v3_splat(0.0f));
    scene->materials[metal].roughness_u = grey(0.2f);
    scene->materials[metal].roughness_v = grey(0.3f);
    scene->materials[coat].roughness_u = scene->materials[coat].roughness_v = grey(0.25f);
    scene->materials[glass].roughness_u = scene->materials[glass].roughness_v = grey(0.3f);
    test_add_quad(scene, metal, v3(-3, 0, -2), v3(0, 0, 5), v3(3, 0, 0));
    test_add_quad(scene, coat, v3(0, 0, -2), v3(0, 0, 5), v3(3, 0, 0));
    test_add_sphere(scene, glass, v3(0, 0.8f, 0), 0.7f);
    test_add_area_light(scene, test_add_sphere(scene, black, v3(-1.5f, 1.5f, 1.5f), 0.5f), v3(8, 6, 4), 0);
    test_add_area_light(scene, test_add_sphere(scene, black, v3(2.0f, 1.0f, 1.0f), 0.25f), v3(4, 8, 12), 0);
}

static void glossy(void **state)
{
    (void)state;
    struct pt_scene scene;
    glossy_scene(&scene);
    test_scene_finish(&scene);
    compare(&scene, 256, 3072, "glossy surfaces");
    test_scene_end(&scene);
}

static void environment(void **state)
{
    (void)state;
    struct pt_scene scene;
    glossy_scene(&scene);
    enum { W = 16, H = 8 };
    float *px = pt_arena_alloc(&scene.arena, 3 * W * H, sizeof *px);
    assert_non_null(px);
    for (int i = 0; i < 3 * W * H; i++)
        px[i] = 0.2f + (i / 3 == 2 * W + 5 ? 12.0f : 0.0f) + 0.1f * (float)(i % 3);
    scene.images[scene.image_count++] = (struct pt_image_map){W, H, 3, PT_PIXEL_FLOAT, 1.0f, px};
    struct pt_light sky = {.kind = PT_LIGHT_ENV_IMAGE,
                           .shape = -1,
                           .mapping = PT_ENV_LATLONG,
                           .emission = {1, 1, 1},
                           .from_render = {{1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0}}};
    test_add_light(&scene, &sky);
    test_scene_finish(&scene);
    compare(&scene, 256, 3072, "environment");
    test_scene_end(&scene);
}

/* The Cornell box filled with fog, and a denser coloured block of it behind interfaces. */
static void fog(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_cornell(&scene, 32, 1.0f, v3_splat(0.0f));
    pt_accel_release(&scene);
    scene.camera.medium = test_add_medium(&scene, v3(0.02f, 0.03f, 0.05f), v3_splat(0.1f), 0.5f);
    int32_t inner = test_add_medium(&scene, v3(0.2f, 0.3f, 0.5f), v3(2.0f, 1.0f, 0.5f), -0.3f);
    int32_t id = test_add_material(&scene, PT_MATERIAL_INTERFACE);
    int32_t box = test_add_box(&scene, id, v3(-0.9f, 0.9f, 0.2f), v3(0.9f, 1.5f, 0.9f), 0);
    scene.shapes[box].medium_in = inner;
    scene.shapes[box].medium_out = scene.camera.medium;
    test_scene_finish(&scene);
    compare(&scene, 128, 1024, "fog");
    test_scene_end(&scene);
}

/* Lamps of all kinds and powers, some in the wall's plane, some turned away, over surfaces that reflect, transmit and shine;
 * a weak lamp in a box of its own, so that the strong ones do not drown it. */
static void lamps(struct pt_scene *scene)
{
    test_scene_begin(scene);
    test_camera(scene, v3(0, 2, -6), v3(0, 1.0f, 0), v3(0, 1, 0), 40.0f, 32);
    int32_t floor = test_add_diffuse(scene, v3(0.7f, 0.6f, 0.5f)), black = test_add_diffuse(scene, v3_splat(0.0f));
    int32_t paper = test_add_material(scene, PT_BSDF_DIFFUSE_TRANSMISSION),
            metal = test_add_material(scene, PT_BSDF_CONDUCTOR);
    scene->materials[metal].roughness_u = scene->materials[metal].roughness_v = grey(0.35f);
    test_add_quad(scene, floor, v3(-4, 0, -4), v3(0, 0, 8), v3(8, 0, 0));
    test_add_quad(scene, metal, v3(-4, 0, 3), v3(0, 4, 0), v3(8, 0, 0));
    test_add_quad(scene, paper, v3(-2.5f, 0.1f, 1.5f), v3(0.3f, 1.6f, 0), v3(1.8f, 0, 0.4f));
    test_add_sphere(scene, floor, v3(1.2f, 0.6f, 0.3f), 0.6f);
    for (int i = 0; i < 9; i++) {
        pt_vec3 p = v3(-3.0f + 0.75f * (float)i, i % 2 ? 3.0f : 1.2f, i % 3 ? 2.0f : -0.5f);
        pt_vec3 x = v3(0.5f, 0, 0), z = v3(0, 0.1f * (float)i, 0.5f);
        float power = i == 4 ? 0.0f : 1.0f + (float)(i % 4);
        test_add_area_light(scene, test_add_quad(scene, black, p, i % 4 ? x : z, i % 4 ? z : x), v3(power, 2, power),
                            i % 3 == 1);
    }
    for (int i = 0; i < 4; i++) {
        int32_t id = test_add_sphere(scene, black, v3(-2.0f + 1.3f * (float)i, 0.5f + 0.3f * (float)i, 1.0f), 0.25f);
        struct pt_quadric *q = &scene->quadrics[scene->shapes[id].data];
        for (int k = 0; k < 3; k++) /* two are ellipsoids that lean */
            q->to_render.m[4 * k + 1] += i % 2 ? 0.6f * q->to_render.m[4 * k] : 0.0f;
        assert_int_equal(pt_mat34_invert(&q->to_render, &q->from_render), 1);
        test_add_area_light(scene, id, v3(6, 5, (float)i), 0);
    }
}

static void many_lights(void **state)
{
    (void)state;
    struct pt_scene scene;
    lamps(&scene);
    test_scene_finish(&scene);
    assert_non_null(scene.light_tree);
    compare(&scene, 256, 3072, "many lamps");
    test_scene_end(&scene);
}

/* In fog, where lamps are gathered from all sides, and under a sky that shares the selection with them. */
static void many_lights_in_fog(void **state)
{
    (void)state;
    struct pt_scene scene;
    lamps(&scene);
    scene.camera.medium = test_add_medium(&scene, v3(0.01f, 0.02f, 0.03f), v3_splat(0.15f), 0.4f);
    for (int32_t i = 0; i < scene.shape_count; i++)
        scene.shapes[i].medium_in = scene.shapes[i].medium_out = scene.camera.medium;
    test_scene_finish(&scene);
    assert_non_null(scene.light_tree);
    compare(&scene, 128, 1536, "many lamps in fog");
    test_scene_end(&scene);
}

/* Lights without size cannot be met by chance: the hierarchy against selection by power. A lamp of enormous power stands behind
 * the metal, where nothing sees it. */
static void delta_lights_by_both_selections(void **state)
{
    (void)state;
    clear();
    for (int32_t selection = 0; selection < 2; selection++) {
        struct pt_scene scene;
        lamps(&scene);
        for (int i = 0; i < 6; i++) {
            struct pt_light light = {.kind = i < 3   ? PT_LIGHT_POINT
                                             : i < 5 ? PT_LIGHT_SPOT
                                                     : PT_LIGHT_DISTANT,
                                     .shape = -1,
                                     .image = -1,
                                     .emission = {1.0f + (float)i, 2, 1},
                                     .position = v3((float)i - 2.5f, 0, 7),
                                     .direction = v3_norm(v3(0.2f, -1.0f, 0.1f)),
                                     .cos_total = 0.75f,
                                     .cos_start = 0.85f};
            test_add_light(&scene, &light);
        }
        int32_t hidden = test_add_quad(&scene, 1, v3(-0.5f, 1, 4), v3(0, 1, 0), v3(-1, 0, 0));
        test_add_area_light(&scene, hidden, v3_splat(1e4f), 0);
        scene.light_selection = selection;
        test_scene_finish(&scene);
        assert_true((scene.light_tree != NULL) == (selection == PT_LIGHT_SELECTION_HIERARCHY));
        accumulate(&scene, PT_STRATEGY_MIS, PT_SAMPLER_INDEPENDENT, 5 + (uint32_t)selection, 600, selection ? b : a);
        test_scene_end(&scene);
    }
    judge("lights without size");
}

static struct pt_scene *load(const char *path, int32_t selection)
{
    enum { SIZE = 32 };
    const struct pt_load_options options = {.width = SIZE, .height = SIZE, .light_selection = selection};
    struct pt_scene_defaults defaults;
    struct pt_scene *scene = NULL;
    struct base_err err = {0};
    if (pt_scene_load(path, &options, &scene, &defaults, &err) != 0)
        fail_msg("%s", err.text);
    return scene;
}

/* Every scene of ours that has a hierarchy, against selection by power. */
static void scenes_by_both_selections(void **state)
{
    (void)state;
    glob_t found;
    int compared = 0;
    assert_int_equal(glob("scenes/*.pbrt", 0, NULL, &found), 0);
    for (size_t i = 0; i < found.gl_pathc; i++) {
        struct pt_scene *hierarchy = load(found.gl_pathv[i], PT_LIGHT_SELECTION_HIERARCHY);
        if (hierarchy->light_tree) {
            struct pt_scene *power = load(found.gl_pathv[i], PT_LIGHT_SELECTION_POWER);
            assert_null(power->light_tree);
            clear();
            accumulate(hierarchy, PT_STRATEGY_MIS, PT_SAMPLER_INDEPENDENT, 7, 32, a);
            accumulate(power, PT_STRATEGY_MIS, PT_SAMPLER_INDEPENDENT, 8, 32, b);
            judge(found.gl_pathv[i]);
            pt_scene_destroy(power);
            compared++;
        }
        pt_scene_destroy(hierarchy);
    }
    globfree(&found);
    assert_true(compared >= 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cornell),
        cmocka_unit_test(glossy),
        cmocka_unit_test(environment),
        cmocka_unit_test(fog),
        cmocka_unit_test(many_lights),
        cmocka_unit_test(many_lights_in_fog),
        cmocka_unit_test(delta_lights_by_both_selections),
        cmocka_unit_test(scenes_by_both_selections),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
