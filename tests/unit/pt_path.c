/* The kernels: the same bits whichever covers the scene, no code of absent effects, planes and traces. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* What is fetched ahead changes no picture: it is written down here, where the headers are compiled with this instead. */
static const void *fetched[64];
static int fetched_count;
static void note_fetch(const void *address) { fetched[fetched_count++ % 64] = address; }
#define __builtin_prefetch(address) note_fetch(address)

#include "geom/accel.h"
#include "integ/kernel_sets.h"
#include "integ/run.h"
#include "integ/trace.h"
#include "shade/bsdf.h"
#include "shade/medium.h"
#include "shade/texture.h"
#include "support/pt_captured.h"
#include "support/pt_scenes.h"

static struct pt_input grey(float x) { return (struct pt_input){0, {x, x, x}}; }

/* All but media: glass, metal, coating, a texture with alpha, lens, point light. */
static void rich_scene(struct pt_scene *scene, int media)
{
    static const unsigned char checks[4] = {255, 30, 90, 200};
    test_scene_begin(scene);
    test_camera(scene, v3(0, 2, -6), v3(0, 0.5f, 0), v3(0, 1, 0), 40.0f, 24);
    scene->camera.lens_radius = 0.05f;
    scene->camera.focal_distance = 6.0f;
    scene->images[scene->image_count++] = (struct pt_image_map){2, 2, 1, PT_PIXEL_U8_LINEAR, 1.0f, checks};
    scene->textures[scene->texture_count++] =
        (struct pt_texture){.kind = PT_TEXTURE_IMAGE, .image = 0, .scale = 1.0f, .su = 3.0f, .sv = 3.0f};
    int32_t metal = test_add_material(scene, PT_BSDF_CONDUCTOR), coat = test_add_material(scene, PT_BSDF_COATED_DIFFUSE);
    int32_t glass = test_add_material(scene, PT_BSDF_DIELECTRIC), black = test_add_diffuse(scene, v3_splat(0.0f));
    int32_t textured = test_add_diffuse(scene, v3_splat(0.5f));
    scene->materials[textured].reflectance.texture = 1;
    scene->materials[metal].roughness_u = grey(0.2f);
    scene->materials[metal].roughness_v = grey(0.3f);
    scene->materials[coat].roughness_u = scene->materials[coat].roughness_v = grey(0.25f);
    test_add_quad(scene, textured, v3(-3, 0, -2), v3(0, 0, 5), v3(6, 0, 0));
    test_add_sphere(scene, glass, v3(0, 0.8f, 0), 0.7f);
    test_add_sphere(scene, metal, v3(-1.4f, 0.6f, 0), 0.5f);
    test_add_sphere(scene, coat, v3(1.4f, 0.6f, 0), 0.5f);
    int32_t leaf = test_add_quad(scene, textured, v3(-2, 0, 2), v3(4, 0, 0), v3(0, 2, 0));
    scene->shapes[leaf].has_alpha = 1;
    scene->shapes[leaf].alpha.texture = 1;
    test_add_area_light(scene, test_add_sphere(scene, black, v3(-1.5f, 2.5f, 0.5f), 0.5f), v3(8, 6, 4), 0);
    struct pt_light point = {.kind = PT_LIGHT_POINT, .shape = -1, .image = -1, .emission = {6, 6, 9}, .position = {2, 2, 4}};
    test_add_light(scene, &point);
    if (media) {
        scene->camera.medium = test_add_medium(scene, v3_splat(0.02f), v3(0.05f, 0.04f, 0.03f), 0.4f);
        int32_t id = test_add_material(scene, PT_MATERIAL_INTERFACE);
        int32_t box = test_add_box(scene, id, v3(-2, 0.1f, -1.8f), v3(-1, 1, -1), 0);
        scene->shapes[box].medium_in = test_add_medium(scene, v3(0.3f, 0.1f, 0.0f), v3_splat(1.0f), 0.0f);
        scene->shapes[box].medium_out = scene->camera.medium;
    }
    test_scene_finish(scene);
}

static void assert_same_path(const struct pt_path_result *got, const struct pt_path_result *expected)
{
    assert_memory_equal(&got->radiance, &expected->radiance, sizeof got->radiance);
    assert_memory_equal(&got->albedo, &expected->albedo, sizeof got->albedo);
    assert_memory_equal(&got->normal_world, &expected->normal_world, sizeof got->normal_world);
    assert_memory_equal(&got->depth, &expected->depth, sizeof got->depth);
}

/* Runs of 24, 17 and 7 paths of every kernel that covers the scene against the general one path by path, bit for bit. */
static void compare_kernels(const struct pt_scene *scene, pt_kernel *const *kernels, int count)
{
    for (int sampler = 0; sampler < 2; sampler++) {
        struct pt_integrator settings = test_integrator(6);
        settings.sampler = sampler;
        settings.want_aux = 1;
        for (uint32_t i = 0; i < 24 * 4; i++) {
            uint32_t y = i % 24, sample = i / 24;
            struct pt_path_result expected[24], got[24];
            for (uint32_t x = 0; x < 24; x++)
                pt_kernel_all(scene, &settings, x, y, 1, sample, &expected[x]);
            for (int k = -1; k < count; k++) {
                pt_kernel *kernel = k < 0 ? pt_kernel_all : kernels[k];
                int first = i % 2 ? 24 : 17;
                memset(got, 0, sizeof got);
                kernel(scene, &settings, 0, y, first, sample, got);
                if (first < 24)
                    kernel(scene, &settings, (uint32_t)first, y, 24 - first, sample, got + first);
                for (uint32_t x = 0; x < 24; x++) {
                    assert_same_path(&got[x], &expected[x]);
                    assert_int_equal(got[x].rays, expected[x].rays);
                }
            }
        }
    }
}

static void diffuse_kernel_is_exact(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_cornell(&scene, 24, 1.0f, v3_splat(0.0f));
    assert_true(pt_kernel_select(scene.effects, NULL, NULL) == pt_kernel_diffuse);
    compare_kernels(&scene,
                    (pt_kernel *const[]){pt_kernel_diffuse, pt_kernel_specular, pt_kernel_surfaces, pt_kernel_no_media}, 4);
    test_scene_end(&scene);
}

static void surface_kernels_are_exact(void **state)
{
    (void)state;
    struct pt_scene scene;
    rich_scene(&scene, 0);
    assert_true(pt_kernel_select(scene.effects, NULL, NULL) == pt_kernel_no_media);
    compare_kernels(&scene, (pt_kernel *const[]){pt_kernel_no_media}, 1);
    test_scene_end(&scene);
}

/* Fog and nested media without interfaces: occlusion queries there, nearest hits in the general kernel, the same answer. */
static void media_kernel_is_exact(void **state)
{
    (void)state;
    struct pt_scene scene;
    test_cornell(&scene, 24, 1.0f, v3_splat(0.0f));
    pt_accel_release(&scene);
    scene.camera.medium = test_add_medium(&scene, v3(0.1f, 0.2f, 0.3f), v3(0.1f, 0.05f, 0.0f), 0.3f);
    int32_t glass = test_add_material(&scene, PT_BSDF_DIELECTRIC);
    int32_t ball = test_add_sphere(&scene, glass, v3(0, 1, 0.2f), 0.4f);
    scene.shapes[ball].medium_out = scene.camera.medium;
    scene.shapes[ball].medium_in = test_add_medium(&scene, v3(2, 1, 0), v3_splat(0.0f), 0.0f);
    test_scene_finish(&scene);
    assert_true(pt_kernel_select(scene.effects, NULL, NULL) == pt_kernel_media);
    compare_kernels(&scene, (pt_kernel *const[]){pt_kernel_media}, 1);
    test_scene_end(&scene);
}

/* Whatever is needed is covered, and never by more than the general kernel. */
static void selection_covers(void **state)
{
    (void)state;
    for (pt_effects needed = 0; needed <= PT_FX_ALL; needed += 37) {
        pt_effects covers = 0;
        const char *name = NULL;
        assert_non_null(pt_kernel_select(needed, &covers, &name));
        assert_non_null(name);
        assert_int_equal(needed & ~covers, 0);
    }
}

/* Counted, not assumed: what the scene does not call for is not executed, by the general kernel either. */
static void absent_effects_run_no_code(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_integrator settings = test_integrator(6);
    test_cornell(&scene, 16, 1.0f, v3_splat(0.0f));
    unsigned long long media = pt_medium_queries, textures = pt_texture_lookups;
    test_mean(&scene, &settings, pt_kernel_select(scene.effects, NULL, NULL), 4, NULL);
    test_mean(&scene, &settings, pt_kernel_all, 4, NULL);
    assert_true(pt_medium_queries == media && pt_texture_lookups == textures);
    test_scene_end(&scene);
    rich_scene(&scene, 1);
    test_mean(&scene, &settings, pt_kernel_select(scene.effects, NULL, NULL), 4, NULL);
    assert_true(pt_medium_queries > media && pt_texture_lookups > textures);
    test_scene_end(&scene);
}

static void planes(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_integrator settings = test_integrator(3);
    struct pt_path_result r;
    test_cornell(&scene, 24, 1.0f, v3_splat(0.0f));
    settings.want_aux = 1;
    pt_kernel_diffuse(&scene, &settings, 12, 3, 1, 0, &r); /* the back wall */
    assert_true(fabsf(r.albedo.x - 0.725f) < 1e-6f && fabsf(r.albedo.y - 0.71f) < 1e-6f);
    assert_true(r.normal_world.z > 0.999f); /* towards the camera */
    assert_true(r.depth > 7.7f && r.depth < 8.0f);
    test_scene_end(&scene);
    /* what scatters in fog before it meets a surface has no depth: the way from there to a wall is none */
    test_cornell(&scene, 24, 1.0f, v3_splat(0.0f));
    scene.camera.medium = test_add_medium(&scene, v3_splat(0.0f), v3_splat(0.1f), 0.0f);
    int without = 0;
    for (uint32_t i = 0; i < 64; i++) {
        pt_kernel_all(&scene, &settings, 12, 3, 1, i, &r);
        assert_true(isinf(r.depth) || (r.depth > 7.7f && r.depth < 8.0f));
        without += isinf(r.depth);
    }
    assert_true(without > 20 && without < 50); /* 1 - exp(-0.78) of them */
    test_scene_end(&scene);
}

/* The traced path ends with the value that the kernel returns. */
static void trace_tells_the_same_path(void **state)
{
    (void)state;
    struct pt_scene scene;
    struct pt_integrator settings = test_integrator(4);
    struct pt_path_result r;
    struct captured messages;
    char expected[256];
    rich_scene(&scene, 1);
    pt_kernel_all(&scene, &settings, 12, 14, 1, 3, &r);
    capture_begin(&messages);
    pt_kernel_trace(&scene, &settings, 12, 14, 3, messages.log.out, NULL);
    capture_end(&messages);
    snprintf(expected, sizeof expected, "\nend: pixel value (%g, %g, %g)\n", (double)r.radiance.x, (double)r.radiance.y,
             (double)r.radiance.z);
    assert_string_equal(messages.text + strlen(messages.text) - strlen(expected), expected);
    assert_true(captured_lines(&messages) >= 3);
    test_scene_end(&scene);
}

/* Every line of --debug-path, word for word, and what it counts. */
static void trace_says_what_it_is_told(void **state)
{
    (void)state;
    static const char lines[] =
        "camera: origin (1, -2, 3.5) direction (4, 5e-07, -6) time 0.25\n"
        "1: conductor at (7, 8, 9) normal (0.5, -1, 0.25) material 3 primitive 11 throughput (0.1, 0.2, 0.3)\n"
        "   light towards (-1, 2, 0.125) adds (10, 20, 30)\n"
        "   emission met, weight 0.75, adds (11, 21, 31)\n"
        "2: scattered in medium 4 at (0.1, 0.2, 0.3) throughput (0.4, 0.5, 0.6)\n"
        "3: thin dielectric at (7, 8, 9) normal (0.5, -1, 0.25) material 3 primitive 11 throughput (1, 1, 1)\n"
        "end: pixel value (12, 22, 32)\n";
    struct captured messages;
    capture_begin(&messages);
    struct pt_trace trace = {.out = messages.log.out};
    const struct pt_shape shape = {.material = 3};
    const struct pt_place at = {
        .p = {7, 8, 9}, .s = {.n_geometric = {0.5f, -1, 0.25f}, .n_shading = {9, 9, 9}}, .shape = &shape, .primitive = 11};
    const struct pt_ray ray = {{1, -2, 3.5f}, {4, 5e-7f, -6}, 0, 100, 0.25f};
    const struct pt_bsdf metal = {.kind = PT_BSDF_CONDUCTOR}, pane = {.kind = PT_BSDF_THIN_DIELECTRIC};
    pt_trace_camera(&trace, &ray);
    pt_trace_surface(&trace, &at, &metal, v3(0.1f, 0.2f, 0.3f));
    pt_trace_light(&trace, v3(-1, 2, 0.125f), v3(10, 20, 30));
    pt_trace_emission(&trace, 0.75f, v3(11, 21, 31));
    pt_trace_scatter(&trace, 4, v3(0.1f, 0.2f, 0.3f), v3(0.4f, 0.5f, 0.6f));
    pt_trace_surface(&trace, &at, &pane, v3_splat(1));
    pt_trace_end(&trace, v3(12, 22, 32));
    capture_end(&messages);
    assert_string_equal(messages.text, lines);
    assert_int_equal(trace.vertex, 3);
    for (int i = 0; i < PT_MET_COUNT; i++)
        assert_int_equal(trace.met[i], i == PT_BSDF_CONDUCTOR || i == PT_BSDF_THIN_DIELECTRIC || i == PT_MET_MEDIUM);
}

/* The upper left of the four texels that a bilinear lookup reads and the one below it, or nothing where they wrap. */
static void texels_are_fetched_that_are_read(void **state)
{
    (void)state;
    enum { W = 5, H = 4 };
    static const float floats[W * H * 4];
    static const uint8_t bytes[W * H * 4];
    for (int k = 0; k < 6; k++) {
        struct pt_image_map image = {W,
                                     H,
                                     k % 3 == 0 ? 1 : k % 3 + 2,
                                     k < 3 ? PT_PIXEL_FLOAT : PT_PIXEL_U8_SRGB,
                                     1,
                                     k < 3 ? (const void *)floats : (const void *)bytes};
        struct pt_texture t[2] = {{.kind = PT_TEXTURE_CHECKERBOARD},
                                  {.kind = PT_TEXTURE_IMAGE, .scale = 1, .su = 2, .sv = -3, .du = 0.125f, .dv = 0.5f}};
        struct pt_scene scene = {.images = &image, .textures = t, .image_count = 1, .texture_count = 2};
        size_t texel = (size_t)image.channels * (k < 3 ? sizeof(float) : 1);
        int met = 0;
        for (int i = 0; i < 400; i++) {
            float u = -1.0f + 0.1037f * (float)(i % 20), v = -0.8f + 0.0871f * (float)(i / 20);
            double s = 2 * (double)u + 0.125, w = 1 - (-3 * (double)v + 0.5);
            double x = floor((s - floor(s)) * W - 0.5), y = floor((w - floor(w)) * H - 0.5);
            fetched_count = 0;
            pt_texture_fetch(&scene, 1, u, v);
            assert_int_equal(fetched_count, 0);
            pt_texture_fetch(&scene, 2, u, v);
            if (x < 0 || y < 0 || y >= H - 1) {
                assert_int_equal(fetched_count, 0);
                continue;
            }
            const char *first = (const char *)image.pixels + ((size_t)y * W + (size_t)x) * texel;
            assert_int_equal(fetched_count, 2);
            assert_ptr_equal(fetched[0], first);
            assert_ptr_equal(fetched[1], first + W * texel);
            met++;
        }
        assert_in_range(met, 100, 380);
    }
}

/* Of each path that has met a mesh: its indices, then its corners, then its texels; of small scenes nothing. */
static void hits_are_fetched_in_waves(void **state)
{
    (void)state;
    static const float texels[4 * 4];
    static const uint32_t twice[2][6] = {{0, 1, 2, 0, 2, 3}, {1, 2, 3, 1, 3, 0}};
    static const float corners[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    struct pt_scene scene;
    struct pt_hit hit[4], *hits[4];
    test_scene_begin(&scene);
    int32_t plain = test_add_diffuse(&scene, v3_splat(0.5f)), textured = test_add_diffuse(&scene, v3_splat(0.5f));
    scene.images[scene.image_count++] = (struct pt_image_map){4, 4, 1, PT_PIXEL_FLOAT, 1, texels};
    scene.textures[scene.texture_count++] = (struct pt_texture){.kind = PT_TEXTURE_IMAGE, .scale = 1, .su = 1, .sv = 1};
    scene.materials[textured].reflectance.texture = 1;
    int32_t a = test_add_mesh(&scene, plain, corners, 4, twice[0], 2),
            b = test_add_mesh(&scene, textured, corners, 4, twice[1], 2);
    int32_t ball = test_add_sphere(&scene, textured, v3(0, 0, 0), 1);
    const int32_t met[4] = {b, -1, ball, a};
    for (int i = 0; i < 4; i++) {
        hits[i] = &hit[i];
        hit[i] = (struct pt_hit){.shape = met[i], .primitive = 1, .u = 0.25f, .v = 0.5f};
    }
    const struct pt_mesh *first = &scene.meshes[scene.shapes[b].data], *second = &scene.meshes[scene.shapes[a].data];
    /* without texture coordinates u = 0.75, v = 0.5: texel 2.5 across, 1.5 down */
    const void *expected[10] = {first->indices + 3, second->indices + 3, first->vertices + 1,  first->vertices + 3,
                                first->vertices,    second->vertices,    second->vertices + 2, second->vertices + 3,
                                texels + 4 + 2,     texels + 8 + 2};
    for (int k = 0; k < 4; k++) {
        scene.stats.triangles = k == 0 ? PT_FETCH_TRIANGLES - 1 : PT_FETCH_TRIANGLES;
        fetched_count = 0;
        pt_fetch_hits(k == 3 ? PT_FX_ALL & ~PT_FX_TEXTURE : PT_FX_ALL, &scene, hits + (k == 2), k == 2 ? 2 : 4);
        assert_int_equal(fetched_count, k == 0 || k == 2 ? 0 : k == 3 ? 8 : 10);
        for (int i = 0; i < fetched_count; i++)
            assert_ptr_equal(fetched[i], expected[i]);
    }
    test_scene_finish(&scene);
    test_scene_end(&scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(diffuse_kernel_is_exact),    cmocka_unit_test(surface_kernels_are_exact),
        cmocka_unit_test(selection_covers),           cmocka_unit_test(media_kernel_is_exact),
        cmocka_unit_test(absent_effects_run_no_code), cmocka_unit_test(planes),
        cmocka_unit_test(trace_says_what_it_is_told), cmocka_unit_test(texels_are_fetched_that_are_read),
        cmocka_unit_test(hits_are_fetched_in_waves),  cmocka_unit_test(trace_tells_the_same_path),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
