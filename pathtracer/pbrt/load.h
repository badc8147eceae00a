/*
 * From a scene file to something that can be rendered: the only way in for the renderer.
 */
#ifndef PT_PBRT_LOAD_H
#define PT_PBRT_LOAD_H

#include "base/log.h"
#include "pbrt/source.h"
#include "scene/scene.h"
#include "scene/settings.h"

/* What replaces the scene's own camera (--look-at, --fov); all zero = nothing. The camera then stands still; its lens,
 * medium and handedness stay the file's, and so does what the file places in the space of its camera. */
struct pt_view {
    int has_look_at;
    double look_at_world[9]; /* eye, point looked at, up, as for LookAt; not degenerate */
    double fov_deg;          /* over the screen range [-1, 1] (the short side), (0, 180); 0 = the file's */
};

struct pt_load_options {
    int strict;        /* unsupported features are errors, not warnings */
    int width, height; /* > 0: replaces the film's resolution before the camera is set up (--size) */
    struct pt_view view;
    int light_selection;        /* enum pt_light_selection */
    pt_effects forced;          /* effects to turn on whether needed or not (--effects=all) */
    struct base_inputs *inputs; /* gets every file that is read; may be NULL */
    struct base_log *log;       /* notes of warnings; may be NULL */
};

/* What the file says about the image and how to render it; the command line may override it. */
struct pt_scene_defaults {
    int width, height;
    int crop[4];                     /* x0, y0, x1, y1 in pixels, end exclusive */
    int spp;                         /* pixelsamples of the file's sampler, 0 if it has none */
    char film_path[1024];            /* "filename" of the film, "" if none */
    struct pt_integrator integrator; /* from Integrator, Sampler, PixelFilter, Film */
};

/* Loads `path` and builds it for rendering. On failure (BASE_EINVAL: err has `file:line:column: what is wrong`) *out is
 * untouched and nothing is left allocated. The scene is read-only afterwards and may be used from any thread. */
int pt_scene_load(const char *path, const struct pt_load_options *options, struct pt_scene **out,
                  struct pt_scene_defaults *defaults, struct base_err *err);
/* The same with the bytes from elsewhere than the disk: for tests and fuzzers. */
int pt_scene_load_source(const char *path, const struct pt_source *source, const struct pt_load_options *options,
                         struct pt_scene **out, struct pt_scene_defaults *defaults, struct base_err *err);
void pt_scene_destroy(struct pt_scene *scene);

#endif
