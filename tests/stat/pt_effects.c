/* Every scene of ours: the kernel picked for it and the general one give the same bits, with either sampler; a scene without media
 * or textures never enters their code. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glob.h>
#include <string.h>

#include "integ/kernel_sets.h"
#include "pbrt/load.h"
#include "shade/medium.h"
#include "shade/texture.h"

enum { SIZE = 20, SPP = 3 };

static int same(const struct pt_path_result *a, const struct pt_path_result *b)
{
    return memcmp(&a->radiance, &b->radiance, sizeof a->radiance) == 0 && memcmp(&a->albedo, &b->albedo, sizeof a->albedo) == 0 &&
           memcmp(&a->normal_world, &b->normal_world, sizeof a->normal_world) == 0 && memcmp(&a->depth, &b->depth, sizeof a->depth) == 0;
}

static void check_scene(const char *path)
{
    struct pt_scene *scene;
    struct pt_scene_defaults defaults;
    struct base_err err = {0};
    const struct pt_load_options options = {.width = SIZE, .height = SIZE, .quiet = 1};
    if (pt_scene_load(path, &options, &scene, &defaults, &err) != 0)
        fail_msg("%s", err.text);
    const char *name;
    pt_effects effects = scene->effects;
    pt_kernel *kernel = pt_kernel_select(effects, NULL, &name);
    unsigned long long media = pt_medium_queries, textures = pt_texture_lookups;
    for (int32_t sampler = 0; sampler < 2; sampler++) {
        struct pt_integrator settings = defaults.integrator;
        settings.sampler = sampler;
        settings.want_aux = 1;
        for (uint32_t i = 0; i < SIZE * SIZE * SPP; i++) {
            struct pt_path_result a, b;
            kernel(scene, &settings, i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE), &a);
            pt_kernel_all(scene, &settings, i % SIZE, i / SIZE % SIZE, i / (SIZE * SIZE), &b);
            if (!same(&a, &b))
                fail_msg("%s: kernel %s differs from the general one at pixel %u, %u sample %u", path, name, i % SIZE,
                         i / SIZE % SIZE, i / (SIZE * SIZE));
        }
    }
    if (!(effects & PT_FX_MEDIA) && pt_medium_queries != media)
        fail_msg("%s has no media but their code was run", path);
    if (!(effects & PT_FX_TEXTURE) && pt_texture_lookups != textures)
        fail_msg("%s has no textures but their code was run", path);
    pt_scene_destroy(scene);
}

static void all_scenes(void **state)
{
    (void)state;
    glob_t found;
    assert_int_equal(glob("scenes/*.pbrt", 0, NULL, &found), 0);
    for (size_t i = 0; i < found.gl_pathc; i++)
        check_scene(found.gl_pathv[i]);
    globfree(&found);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(all_scenes)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
