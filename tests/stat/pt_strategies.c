/*
 * Whole paths with a known answer: each material lit with and without next-event estimation, and lossless fog of every kind
 * in a white world.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "support/pt_scenes.h"

enum { SIZE = 12, SPP = 120 };

static void begin(struct pt_scene *scene, float fov)
{
    test_scene_begin(scene);
    test_camera(scene, v3(0, 0, 4), v3(0, 0, 0), v3(0, 1, 0), fov, SIZE);
}

static void add_environment(struct pt_scene *scene, float radiance)
{
    struct pt_light light = {.kind = PT_LIGHT_ENV_CONSTANT, .emission = v3_splat(radiance), .shape = -1, .image = -1};
    test_add_light(scene, &light);
}

static void set_roughness(struct pt_material *m, float alpha)
{
    m->roughness_u.value = m->roughness_v.value = v3_splat(alpha);
}

static pt_vec3 render(struct pt_scene *scene, int depth, int strategy, uint32_t spp, double *error)
{
    struct pt_integrator settings = test_integrator(depth);
    settings.strategy = strategy;
    settings.rr_depth = 64;
    return test_mean(scene, &settings, pt_kernel_select(scene->effects, NULL, NULL), spp, error);
}

/* Fog of albedo 1 is invisible in a uniform world: bounded by an interface or by glass, homogeneous (grey and coloured) or a grid. */
static void lossless_media_vanish(void **state)
{
    (void)state;
    static const float density[2 * 2 * 2] = {0.2f, 3.0f, 1.0f, 0.0f, 2.0f, 0.5f, 4.0f, 1.0f};
    for (int i = 0; i < 4; i++) {
        struct pt_scene scene;
        begin(&scene, 25.0f);
        int32_t id = test_add_material(&scene, i == 2 ? PT_BSDF_DIELECTRIC : PT_MATERIAL_INTERFACE);
        int32_t shape = test_add_sphere(&scene, id, v3(0, 0, 0), 1.0f);
        int32_t medium =
            test_add_medium(&scene, v3_splat(0.0f), i == 1 ? v3(0.5f, 2.0f, 1.0f) : v3_splat(2.0f), i == 1 ? 0.7f : -0.3f);
        if (i == 3) {
            scene.media[medium].kind = PT_MEDIUM_GRID;
            scene.media[medium].nx = scene.media[medium].ny = scene.media[medium].nz = 2;
            scene.media[medium].density = density;
            /* render space has the camera, at world z = 4, in its origin */
            scene.media[medium].from_render = (struct pt_mat34){{0.5f, 0, 0, 0.5f, 0, 0.5f, 0, 0.5f, 0, 0, 0.5f, 2.5f}};
        }
        scene.shapes[shape].medium_in = medium;
        add_environment(&scene, 1.0f);
        test_scene_finish(&scene);
        double error;
        pt_vec3 mean = render(&scene, -1, PT_STRATEGY_MIS, SPP, &error);
        if (fabsf(mean.x - 1.0f) > 0.01f || fabsf(mean.y - 1.0f) > 0.01f || fabsf(mean.z - 1.0f) > 0.01f)
            fail_msg("medium %d: %g %g %g ± %g", i, (double)mean.x, (double)mean.y, (double)mean.z, error);
        test_scene_end(&scene);
    }
}

/* A floor and a sphere of one material under a lamp: light sampling + MIS against meeting the lamp by chance. */
static void light_sampling_changes_no_mean(void **state)
{
    (void)state;
    struct {
        const char *name;
        int32_t kind;
        float alpha, base_alpha, albedo;
    } cases[] = {
        {"diffuse", PT_BSDF_DIFFUSE, 0.0f, 0.0f, 0.0f},
        {"conductor", PT_BSDF_CONDUCTOR, 0.3f, 0.0f, 0.0f},
        {"dielectric", PT_BSDF_DIELECTRIC, 0.3f, 0.0f, 0.0f},
        {"diffuse transmission", PT_BSDF_DIFFUSE_TRANSMISSION, 0.0f, 0.0f, 0.0f},
        {"coated diffuse, smooth", PT_BSDF_COATED_DIFFUSE, 0.0f, 0.0f, 0.0f},
        {"coated diffuse", PT_BSDF_COATED_DIFFUSE, 0.2f, 0.0f, 0.0f},
        {"coated diffuse, cloudy", PT_BSDF_COATED_DIFFUSE, 0.2f, 0.0f, 0.8f},
        {"coated conductor", PT_BSDF_COATED_CONDUCTOR, 0.2f, 0.15f, 0.0f},
        {"coated conductor, smooth", PT_BSDF_COATED_CONDUCTOR, 0.0f, 0.25f, 0.0f},
    };
    enum { N = sizeof cases / sizeof cases[0] };
    for (int i = 0; i < N; i++) {
        struct pt_scene scene;
        begin(&scene, 30.0f);
        int32_t id = test_add_material(&scene, cases[i].kind), black = test_add_diffuse(&scene, v3_splat(0.0f));
        struct pt_material *m = &scene.materials[id];
        set_roughness(m, cases[i].alpha);
        m->base_roughness_u.value = m->base_roughness_v.value = v3_splat(cases[i].base_alpha);
        m->albedo.value = v3_splat(cases[i].albedo);
        m->thickness.value = v3_splat(cases[i].albedo > 0.0f ? 0.5f : 0.01f);
        test_add_sphere(&scene, id, v3(0, 0, 0), 0.7f);
        test_add_quad(&scene, id, v3(-2, -0.8f, 2), v3(4, 0, 0), v3(0, 0, -4));
        int32_t lamp = test_add_quad(&scene, black, v3(-2, 2.0f, -2), v3(4, 0, 0), v3(0, 0, 4));
        test_add_area_light(&scene, lamp, v3(1.0f, 1.0f, 1.0f), 0);
        test_scene_finish(&scene);
        double e_mis, e_bsdf;
        double mis = (double)v3_luminance(render(&scene, 3, PT_STRATEGY_MIS, 1600, &e_mis));
        double bsdf = (double)v3_luminance(render(&scene, 3, PT_STRATEGY_BSDF_ONLY, 2400, &e_bsdf));
        double z = (mis - bsdf) / sqrt(e_mis * e_mis + e_bsdf * e_bsdf);
        if (!(mis > 0.01) || fabs(z) > 4.0)
            fail_msg("%s: %g ± %g with, %g ± %g without light sampling, z = %g", cases[i].name, mis, e_mis, bsdf, e_bsdf, z);
        test_scene_end(&scene);
    }
}

/* A room open to one side, under a constant sky and under one with a sun: with a portal in its opening, without, and by chance
 * alone it is as bright. Some light comes past the portal. */
static void portals_change_no_mean(void **state)
{
    (void)state;
    static const float sky[3 * 8] = {1,    1,    2,    1,    1,    2,    20,   18,   15,   1, 1, 2,
                                     0.2f, 0.2f, 0.1f, 0.2f, 0.2f, 0.1f, 0.3f, 0.2f, 0.1f, 0, 0, 0};
    for (int image = 0; image < 2; image++) {
        double mean[3], error[3];
        for (int way = 0; way < 3; way++) {
            struct pt_scene scene;
            begin(&scene, 40.0f);
            int32_t grey = test_add_diffuse(&scene, v3_splat(0.6f));
            test_add_quad(&scene, grey, v3(-1, -1, 1), v3(2, 0, 0), v3(0, 0, -2));
            test_add_quad(&scene, grey, v3(-1, 1, 1), v3(2, 0, 0), v3(0, 0, -2));
            test_add_quad(&scene, grey, v3(-1, -1, -1), v3(2, 0, 0), v3(0, 2, 0));
            test_add_quad(&scene, grey, v3(-1, -1, 1), v3(0, 2, 0), v3(0, 0, -2));
            struct pt_light light = {.kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {1, 1, 1}};
            if (image) {
                light.kind = PT_LIGHT_ENV_IMAGE;
                light.image = scene.image_count;
                light.mapping = PT_ENV_LATLONG;
                light.from_render = (struct pt_mat34){{1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0}};
                scene.images[scene.image_count++] = (struct pt_image_map){4, 2, 3, PT_PIXEL_FLOAT, 1.0f, sky};
            }
            light.has_portal = way == 0; /* render space has the camera, at world z = 4, in its origin */
            light.portal = v3(1, -0.7f, -5);
            light.portal_u = v3(0, 1.6f, 0);
            light.portal_v = v3(0, 0, 1.8f);
            test_add_light(&scene, &light);
            test_scene_finish(&scene);
            mean[way] = (double)v3_luminance(
                render(&scene, 4, way < 2 ? PT_STRATEGY_MIS : PT_STRATEGY_BSDF_ONLY, 1600, &error[way]));
            test_scene_end(&scene);
        }
        assert_true(mean[2] > 0.01 && error[0] < 0.02 * mean[0]);
        for (int way = 0; way < 2; way++)
            if (fabs(mean[way] - mean[2]) > 4.0 * hypot(error[way], error[2]))
                fail_msg("image %d: %g ± %g %s portal, %g ± %g by chance", image, mean[way], error[way],
                         way ? "without" : "with", mean[2], error[2]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lossless_media_vanish),
        cmocka_unit_test(light_sampling_changes_no_mean),
        cmocka_unit_test(portals_change_no_mean),
    };
    print_message("seed 1\n");
    return cmocka_run_group_tests(tests, NULL, NULL);
}
