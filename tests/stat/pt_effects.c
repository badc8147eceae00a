/* Every scene of ours: the kernel picked for it and the general one give the same bits, with either sampler, with
 * auxiliary planes and without; a scene without media
 * or textures never enters their code. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "integ/kernel_sets.h"
#include "pbrt/load.h"
#include "shade/medium.h"
#include "shade/texture.h"

enum { SIZE = 20, SPP = 3 };

static int same(const struct pt_path_result *a, const struct pt_path_result *b)
{
    return memcmp(&a->radiance, &b->radiance, sizeof a->radiance) == 0 &&
           memcmp(&a->albedo, &b->albedo, sizeof a->albedo) == 0 &&
           memcmp(&a->normal_world, &b->normal_world, sizeof a->normal_world) == 0 &&
           memcmp(&a->depth, &b->depth, sizeof a->depth) == 0;
}

static struct pt_scene *load(const char *path, struct pt_scene_defaults *defaults)
{
    struct pt_scene *scene = NULL;
    struct base_err err = {0};
    const struct pt_load_options options = {.width = SIZE, .height = SIZE};
    if (pt_scene_load(path, &options, &scene, defaults, &err) != 0)
        fail_msg("%s", err.text);
    return scene;
}

static void check_scene(const char *path)
{
    struct pt_scene_defaults defaults;
    struct pt_scene *scene = load(path, &defaults);
    const char *name;
    pt_effects effects = scene->effects;
    pt_kernel *kernel = pt_kernel_select(effects, NULL, &name);
    unsigned long long media = pt_medium_queries, textures = pt_texture_lookups;
    for (int32_t way = 0; way < 4; way++) {
        struct pt_integrator settings = defaults.integrator;
        settings.sampler = way & 1;
        settings.want_aux = way >> 1;
        for (uint32_t i = 0; i < SIZE * SPP; i++) {
            struct pt_path_result a[SIZE], b[SIZE];
            kernel(scene, &settings, 0, i % SIZE, SIZE, i / SIZE, a);
            pt_kernel_all(scene, &settings, 0, i % SIZE, SIZE, i / SIZE, b);
            for (int x = 0; x < SIZE; x++)
                if (!same(&a[x], &b[x]))
                    fail_msg("%s: kernel %s differs from the general one at pixel %d, %u sample %u", path, name, x, i % SIZE,
                             i / SIZE);
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

/* One scene for each thing that draws numbers. */
static const char *const drawing[] = {
    "alpha",  "bump",         "caustics", "coated",        "cornell-box", "defocus",     "delta-lights", "environment",
    "fog",    "glass",        "glossy",   "image-texture", "indirect",    "instances",   "many-lights",  "mix",
    "motion", "nested-smoke", "quadrics", "sky-image",     "smoke",       "soft-shadow", "texture"};
enum { SCENES = sizeof drawing / sizeof *drawing, Z_SPP = 64 };
/* 23 normal variables pass 4.5 in one of 6,000 tries. */
static const double Z_BOUND = 4.5;
/* Radiance of a sample beyond this is cut off with either sampler, or lamps in view would be the whole spread. */
static const float Z_CLAMP = 1.0f;

/* Mean luminance of the image and the variance of that mean, as if samples were independent: from the spread within each pixel. */
static double image_mean(const struct pt_scene *scene, const struct pt_integrator *settings, double *variance)
{
    pt_kernel *kernel = pt_kernel_select(scene->effects, NULL, NULL);
    double mean = 0.0;
    *variance = 0.0;
    for (uint32_t i = 0; i < SIZE * SIZE; i++) {
        double sum = 0.0, sum2 = 0.0;
        for (uint32_t s = 0; s < Z_SPP; s++) {
            struct pt_path_result r;
            kernel(scene, settings, i % SIZE, i / SIZE, 1, s, &r);
            double l = (double)v3_luminance(r.radiance);
            sum += l / Z_SPP;
            sum2 += l * l / Z_SPP;
        }
        mean += sum / (SIZE * SIZE);
        *variance += fmax(sum2 - sum * sum, 0.0) / (Z_SPP - 1) / ((double)(SIZE * SIZE) * (SIZE * SIZE));
    }
    return mean;
}

/* Sobol' points and independent numbers have the same mean whatever they are drawn for. */
static void sobol_changes_no_mean(void **state)
{
    (void)state;
    for (size_t i = 0; i < SCENES; i++) {
        char path[64];
        struct pt_scene_defaults defaults;
        double mean[2], variance[2];
        snprintf(path, sizeof path, "scenes/%s.pbrt", drawing[i]);
        struct pt_scene *scene = load(path, &defaults);
        struct pt_integrator settings = defaults.integrator;
        settings.max_component = Z_CLAMP;
        for (int32_t sampler = 0; sampler < 2; sampler++) {
            settings.sampler = sampler;
            mean[sampler] = image_mean(scene, &settings, &variance[sampler]);
        }
        double z = (mean[1] - mean[0]) / sqrt(variance[0] + variance[1]);
        if (!(fabs(z) < Z_BOUND && variance[0] > 0.0))
            fail_msg("%s: %g with Sobol' points, %g with independent ones, z = %.2f", path, mean[1], mean[0], z);
        pt_scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(all_scenes), cmocka_unit_test(sobol_changes_no_mean)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
