/*
 * From a scene file to something that can be rendered: the only way in for the renderer.
 */
#ifndef PT_PBRT_LOAD_H
#define PT_PBRT_LOAD_H

#include "base/err.h"
#include "integ/integrator.h"

struct pt_scene;

/* What replaces the scene's own camera (--look-at, --fov); all zero = nothing. The camera then stands still; its lens, medium
 * and handedness stay the file's, and so does what the file places in the space of its camera. */
struct pt_view {
    int has_look_at;
    double look_at_world[9];  /* eye, point looked at, up, as for LookAt; not degenerate */
    double fov_deg;           /* over the screen range [-1, 1] (the short side), (0, 180); 0 = the file's */
};

struct pt_load_options {
    int strict;           /* unsupported features are errors, not warnings */
    int width, height;    /* > 0: replaces the film's resolution before the camera is set up (--size) */
    struct pt_view view;
    pt_effects forced;    /* effects to turn on whether needed or not (--effects=all) */
    int quiet;            /* no progress notes */
    void (*warn)(void *data, const char *line); /* one line per warning or note; may be NULL */
    void *warn_data;
};

/* What the file says about the image and how to render it; the command line may override it. */
struct pt_scene_defaults {
    int width, height;
    int crop[4];                      /* x0, y0, x1, y1 in pixels, end exclusive */
    int spp;                          /* pixelsamples of the file's sampler, 0 if it has none */
    char film_path[1024];             /* "filename" of the film, "" if none */
    struct pt_integrator integrator;  /* from Integrator, Sampler, PixelFilter, Film */
};

struct pt_effect_reason {
    int on;           /* in the scene's effect set */
    int line;         /* first scene line that asks for it, 0 if forced or none */
    char file[256];
};

/* Loads `path` and builds it for rendering. On failure (BASE_EINVAL: err has `file:line:column: what is wrong`) *out is
 * untouched and nothing is left allocated. The scene is read-only afterwards and may be used from any thread. */
int pt_scene_load(const char *path, const struct pt_load_options *options, struct pt_scene **out,
                  struct pt_scene_defaults *defaults, struct base_err *err);
void pt_scene_destroy(struct pt_scene *scene);

pt_effects pt_scene_effects(const struct pt_scene *scene);
/* i in [0, PT_FX_COUNT) */
const struct pt_effect_reason *pt_scene_effect_reason(const struct pt_scene *scene, int i);

struct pt_scene_stats {
    long long triangles, quadrics, instances, lights, materials, textures;
    long long bytes;          /* memory of the scene, acceleration structure included */
    double parse_s, build_s, accel_s, texture_s;
};
void pt_scene_get_stats(const struct pt_scene *scene, struct pt_scene_stats *stats);

#endif
