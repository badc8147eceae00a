/*
 * Shading normals far off the surface: normal maps, bumps and coarse meshes with smooth normals. No model gives more than
 * comes in, glass gives all of it back, and light sampling changes no mean.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "sample/rng.h"
#include "support/pt_scenes.h"

enum { SIZE = 24, MAP = 8 };
enum tilt { NORMAL_MAP, BUMP, COARSE_MESH, TILTS };
static const char *const tilt_names[TILTS] = {"normal map", "bump", "coarse mesh"};

/* A texture of MAP × MAP: normals of up to 60 degrees off, or heights. Its number. */
static int32_t add_map(struct pt_scene *scene, enum tilt tilt)
{
    int channels = tilt == NORMAL_MAP ? 3 : 1;
    float *px = pt_arena_alloc(&scene->arena, (size_t)(channels * MAP * MAP), sizeof *px);
    struct pt_rng rng = pt_rng_make(7);
    assert_non_null(px);
    for (int i = 0; i < MAP * MAP; i++) {
        float theta = PT_PI / 3.0f * pt_rng_float(&rng), phi = 2.0f * PT_PI * pt_rng_float(&rng);
        const float n[3] = {sinf(theta) * cosf(phi), sinf(theta) * sinf(phi), cosf(theta)};
        for (int k = 0; k < channels; k++)
            px[channels * i + k] = tilt == NORMAL_MAP ? 0.5f + 0.5f * n[k] : 0.3f * theta;
    }
    scene->images[scene->image_count] = (struct pt_image_map){MAP, MAP, channels, PT_PIXEL_FLOAT, 1.0f, px};
    scene->textures[scene->texture_count++] = (struct pt_texture){
        .kind = PT_TEXTURE_IMAGE, .image = scene->image_count++, .wrap = PT_WRAP_REPEAT, .scale = 1, .su = 1, .sv = 1};
    return scene->texture_count;
}

/* A ball of radius 1 whose shading normals are not those of its surface. */
static void add_ball(struct pt_scene *scene, int32_t material, enum tilt tilt)
{
    static const float p[] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
    static const uint32_t faces[] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    if (tilt != COARSE_MESH) {
        *(tilt == BUMP ? &scene->materials[material].bump : &scene->materials[material].normal_map) = add_map(scene, tilt);
        test_add_sphere(scene, material, v3(0, 0, 0), 1.0f);
        return;
    }
    struct pt_mesh *mesh = &scene->meshes[scene->shapes[test_add_mesh(scene, material, p, 6, faces, 8)].data];
    struct pt_vertex *vertices = pt_arena_alloc(&scene->arena, 6, sizeof *vertices);
    assert_non_null(vertices);
    for (int i = 0; i < 6; i++) {
        vertices[i] = mesh->vertices[i];
        vertices[i].n = v3(p[3 * i], p[3 * i + 1], p[3 * i + 2]);
    }
    mesh->vertices = vertices;
    mesh->has_normals = 1;
}

static struct pt_input grey(float x) { return (struct pt_input){0, {x, x, x}}; }

static void set_model(struct pt_material *m, float alpha, float eta)
{
    m->roughness_u = m->roughness_v = m->base_roughness_u = m->base_roughness_v = grey(alpha);
    m->eta = eta;
    m->conductor_by_colour = 1;
    m->reflectance = grey(m->kind == PT_BSDF_DIFFUSE_TRANSMISSION ? 0.4f : 1.0f);
    m->transmittance = grey(0.6f);
}

/* Every path of a furnace of radiance 1, without roulette, brings 1 at most; where nothing is lost it brings 1. What remains
 * are roundings of a path's factors. */
static const double ROUNDING = 1e-4;

static void nothing_is_brighter_than_the_furnace(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int32_t kind;
        float alpha, eta;
        double least; /* mean of a picture */
    } cases[] = {
        {"glass", PT_BSDF_DIELECTRIC, 0.0f, 1.5f, 0.999},
        {"glass, inside out", PT_BSDF_DIELECTRIC, 0.0f, 0.6f, 0.999},
        {"rough glass", PT_BSDF_DIELECTRIC, 0.15f, 1.5f, 0.8},
        {"very rough glass", PT_BSDF_DIELECTRIC, 0.6f, 1.8f, 0.3},
        {"thin glass", PT_BSDF_THIN_DIELECTRIC, 0.0f, 1.5f, 0.999},
        {"diffuse", PT_BSDF_DIFFUSE, 0.0f, 1.5f, 0.9},
        {"diffuse transmission", PT_BSDF_DIFFUSE_TRANSMISSION, 0.0f, 1.5f, 0.9},
        {"mirror", PT_BSDF_CONDUCTOR, 0.0f, 1.5f, 0.9},
        {"rough metal", PT_BSDF_CONDUCTOR, 0.3f, 1.5f, 0.4},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (enum tilt tilt = 0; tilt < TILTS; tilt++) {
            struct pt_scene scene;
            struct pt_integrator settings = test_integrator(400);
            double sum = 0.0;
            test_scene_begin(&scene);
            test_camera(&scene, v3(0.3f, 0.4f, -4), v3(0, 0, 0), v3(0, 1, 0), 30.0f, SIZE);
            int32_t id = test_add_material(&scene, cases[i].kind);
            set_model(&scene.materials[id], cases[i].alpha, cases[i].eta);
            add_ball(&scene, id, tilt);
            struct pt_light light = {.kind = PT_LIGHT_ENV_CONSTANT, .shape = -1, .image = -1, .emission = {1, 1, 1}};
            test_add_light(&scene, &light);
            test_scene_finish(&scene);
            settings.rr_depth = 400;
            pt_kernel *kernel = pt_kernel_select(scene.effects, NULL, NULL);
            for (int k = 0; k < SIZE * SIZE * 16; k++) {
                struct pt_path_result r;
                kernel(&scene, &settings, (uint32_t)(k % SIZE), (uint32_t)(k / SIZE % SIZE), 1, (uint32_t)(k / SIZE / SIZE),
                       &r);
                sum += (double)r.radiance.y / (SIZE * SIZE * 16);
                if (!((double)r.radiance.y <= 1.0 + ROUNDING))
                    fail_msg("%s, %s: a path of %g", cases[i].name, tilt_names[tilt], (double)r.radiance.y);
            }
            if (!(sum >= cases[i].least))
                fail_msg("%s, %s: mean %g", cases[i].name, tilt_names[tilt], sum);
            test_scene_end(&scene);
        }
}

/* Rough glass above a floor, under a lamp: light sampling + MIS against meeting the lamp by chance. */
static void light_sampling_changes_no_mean(void **state)
{
    (void)state;
    for (enum tilt tilt = 0; tilt < TILTS; tilt++) {
        double mean[2], error[2];
        for (int strategy = 0; strategy < 2; strategy++) {
            struct pt_scene scene;
            struct pt_integrator settings = test_integrator(5);
            settings.strategy = strategy ? PT_STRATEGY_BSDF_ONLY : PT_STRATEGY_MIS;
            settings.rr_depth = 64;
            test_scene_begin(&scene);
            test_camera(&scene, v3(0, 0, 4), v3(0, 0, 0), v3(0, 1, 0), 30.0f, 12);
            int32_t id = test_add_material(&scene, PT_BSDF_DIELECTRIC), black = test_add_diffuse(&scene, v3_splat(0.0f));
            set_model(&scene.materials[id], 0.4f, 1.5f);
            add_ball(&scene, id, tilt);
            test_add_area_light(&scene, test_add_quad(&scene, black, v3(-3, 2, -3), v3(6, 0, 0), v3(0, 0, 6)),
                                v3_splat(1.0f), 0);
            test_add_area_light(&scene, test_add_quad(&scene, black, v3(-3, -2, -4), v3(0, 4, 0), v3(6, 0, 0)),
                                v3_splat(0.5f), 1);
            test_scene_finish(&scene);
            mean[strategy] = (double)v3_luminance(
                test_mean(&scene, &settings, pt_kernel_select(scene.effects, NULL, NULL), 1200, &error[strategy]));
            test_scene_end(&scene);
        }
        double z = (mean[0] - mean[1]) / hypot(error[0], error[1]);
        if (!(mean[0] > 0.01) || error[0] > 0.01 * mean[0] || fabs(z) > 4.0)
            fail_msg("%s: %g ± %g with, %g ± %g without light sampling", tilt_names[tilt], mean[0], error[0], mean[1],
                     error[1]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_is_brighter_than_the_furnace),
        cmocka_unit_test(light_sampling_changes_no_mean),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
