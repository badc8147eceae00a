#include "pbrt/load.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "geom/accel.h"
#include "pbrt/build.h"

static const struct pt_load_options no_options;

void pt_scene_destroy(struct pt_scene *scene)
{
    if (!scene)
        return;
    pt_accel_release(scene);
    pt_arena_release(&scene->arena);
    free(scene);
}

int pt_scene_load_source(const char *path, const struct pt_source *source, const struct pt_load_options *options,
                         struct pt_scene **out, struct pt_scene_defaults *defaults, struct base_err *err)
{
    struct pt_scene_defaults found = {0};
    struct pt_scene *scene = calloc(1, sizeof *scene);
    struct pt_builder *b = calloc(1, sizeof *b);
    int rc;
    double start_s = base_clock_wall_s();
    if (!scene || !b) {
        rc = base_fail_nomem(err, "the scene");
        goto out;
    }
    pt_builder_init(b, scene, &found, options ? options : &no_options, source, err);
    const char *slash = strrchr(path, '/');
    size_t length = slash ? (size_t)(slash - path) + 1 : 0;
    if (length >= sizeof b->directory) {
        rc = base_fail(err, BASE_EINVAL, "%.64s...: the path is too long", path);
        goto out;
    }
    memcpy(b->directory, path, length);
    rc = pt_pbrt_read(b, path);
    /* Textures are read while the file is parsed, but their time has a row of its own. */
    scene->stats.parse_s = base_clock_wall_s() - start_s - scene->stats.texture_s;
    start_s = base_clock_wall_s();
    if (!rc)
        rc = pt_builder_finish(b);
    scene->stats.build_s = base_clock_wall_s() - start_s - scene->stats.accel_s;
    if (!rc) {
        *out = scene;
        *defaults = found;
        scene = NULL;
    }
out:
    if (b)
        pt_builder_release(b);
    free(b);
    pt_scene_destroy(scene);
    return rc;
}

int pt_scene_load(const char *path, const struct pt_load_options *options, struct pt_scene **out,
                  struct pt_scene_defaults *defaults, struct base_err *err)
{
    const struct pt_source files = pt_source_files(options ? options->inputs : NULL);
    return pt_scene_load_source(path, &files, options, out, defaults, err);
}
