/*
 * Every scene of scenes/ loads, and together they call for every effect; hard-scale and hard-shift scenes are one scene to
 * float precision; the scenes of other people in ../shared load as they are.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "pbrt/load.h"

static int is_scene(const struct dirent *entry)
{
    size_t n = strlen(entry->d_name);
    return n > 5 && strcmp(entry->d_name + n - 5, ".pbrt") == 0;
}

static struct pt_scene *load(const char *path)
{
    struct pt_scene *scene = NULL;
    struct pt_scene_defaults defaults;
    struct base_err err = {0};
    if (pt_scene_load(path, NULL, &scene, &defaults, &err) != 0)
        print_error("%s\n", err.text);
    return scene;
}

/* Number of scenes of a folder that do not load; *effects collects what the others call for. -1: no such folder. */
static int load_folder(const char *folder, pt_effects *effects, int *count)
{
    struct dirent **entries;
    int n = scandir(folder, &entries, is_scene, alphasort), bad = 0;
    if (n < 0)
        return -1;
    for (int i = 0; i < n; i++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", folder, entries[i]->d_name);
        /* parts of another scene, without a world of their own */
        if (strcmp(entries[i]->d_name, "geometry.pbrt") != 0 && strcmp(entries[i]->d_name, "materials.pbrt") != 0) {
            struct pt_scene *scene = load(path);
            bad += !scene;
            ++*count;
            if (scene)
                *effects |= scene->effects;
            pt_scene_destroy(scene);
        }
        free(entries[i]);
    }
    free(entries);
    return bad;
}

static void ours(void **state)
{
    (void)state;
    pt_effects effects = 0;
    int count = 0;
    assert_int_equal(load_folder("scenes", &effects, &count), 0);
    assert_true(count >= 30);
    for (int i = 0; i < PT_FX_COUNT; i++)
        if ((effects >> i & 1u) == 0)
            fail_msg("no scene calls for %s", pt_effects_name(i));
}

static void other_peoples(void **state)
{
    (void)state;
    static const char root[] = "../shared/scenes";
    DIR *dir = opendir(root);
    pt_effects effects = 0;
    int count = 0, bad = 0;
    if (!dir) {
        print_message("no ../shared/scenes here\n");
        skip();
    }
    for (struct dirent *e = readdir(dir); e != NULL; e = readdir(dir)) {
        char path[1024];
        snprintf(path, sizeof path, "%s/%s", root, e->d_name);
        if (e->d_name[0] != '.')
            bad += load_folder(path, &effects, &count) != 0;
    }
    closedir(dir);
    assert_int_equal(bad, 0);
    assert_true(count >= 22);
}

/* Vertices relative to the camera, in units of the scene's scale. */
static void one_scene_at_all_scales(void **state)
{
    (void)state;
    static const struct {
        const char *path;
        float scale;
    } others[] = {
        {"scenes/hard-scale-small.pbrt", 1e-4f}, {"scenes/hard-scale-large.pbrt", 1e4f}, {"scenes/hard-shift.pbrt", 1}};
    const float tolerance = 2e-6f; /* of coordinates up to 8: a few units in the last place of float */
    struct pt_scene *one = load("scenes/hard-scale-one.pbrt");
    assert_non_null(one);
    for (int k = 0; k < 3; k++) {
        struct pt_scene *other = load(others[k].path);
        assert_non_null(other);
        assert_int_equal(other->mesh_count, one->mesh_count);
        for (int32_t i = 0; i < one->mesh_count; i++)
            for (uint32_t v = 0; v < one->meshes[i].vertex_count; v++) {
                pt_vec3 a = one->meshes[i].vertices[v].p,
                        b = v3_scale(other->meshes[i].vertices[v].p, 1.0f / others[k].scale);
                if (!(fabsf(a.x - b.x) <= tolerance && fabsf(a.y - b.y) <= tolerance && fabsf(a.z - b.z) <= tolerance))
                    fail_msg("%s: mesh %d vertex %u is %.9g %.9g %.9g, expected %.9g %.9g %.9g", others[k].path, (int)i,
                             (unsigned)v, (double)b.x, (double)b.y, (double)b.z, (double)a.x, (double)a.y, (double)a.z);
            }
        pt_scene_destroy(other);
    }
    pt_scene_destroy(one);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(ours), cmocka_unit_test(other_peoples),
                                       cmocka_unit_test(one_scene_at_all_scales)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
