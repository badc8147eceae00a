/* Film, filter, sampler, integrator and camera: what the image is, before anything is in it. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/options.h"
#include "pbrt/build.h"

enum { MAX_SIDE = 65536 };
static const double max_pixels = 268435456.0; /* 2^28: 200 bytes a pixel are 50 GiB */

static int is_one_of(const char *kind, const char *const *names) { return base_word_index(names, kind, strlen(kind)) >= 0; }

static struct pt_loc shutter_loc(const struct pt_params *camera)
{
    return pt_params_loc(camera, pt_params_find(camera, "shutterclose") ? "shutterclose" : "shutteropen");
}

/* The camera's, but the film depends on it. Before the first and after the second of the transforms' times nothing moves. */
static void build_shutter(struct pt_builder *b, struct pt_params *p)
{
    b->shutter[0] = pt_params_float(p, "shutteropen", 0);
    b->shutter[1] = pt_params_float(p, "shutterclose", 1);
    if (!(b->shutter[1] >= b->shutter[0]))
        pt_diag_fail(&b->diag, shutter_loc(p), "the shutter closes at %g, before it opens at %g", b->shutter[1],
                     b->shutter[0]);
    const double open_s = b->shutter[1] - b->shutter[0], before = fmax(b->transform_times[0] - b->shutter[0], 0) / open_s,
                 after = fmax(b->shutter[1] - b->transform_times[1], 0) / open_s;
    if (before + after < 0.999999) { /* else nothing moves, or for no time that floats would tell */
        b->scene->still[0] = (float)before;
        b->scene->still[1] = (float)after;
    }
}

/* Of v4: as long as the shutter is open, unless the film says it, as early files did. */
static double exposure_time(struct pt_builder *b, struct pt_params *film)
{
    if (pt_params_find(film, "exposuretime"))
        return pt_params_float_in(film, "exposuretime", 1, 0, 1e6);
    const double open_s = b->shutter[1] - b->shutter[0];
    if (!(open_s > 0 && open_s <= 1e6))
        pt_diag_fail(&b->diag, shutter_loc(&b->header[PT_HEADER_CAMERA]),
                     "the shutter is open for %g s (expected more than 0, at most 1e6)", open_s);
    return open_s;
}

static void sort_pair(double edges[2])
{
    const double low = fmin(edges[0], edges[1]);
    edges[1] = fmax(edges[0], edges[1]);
    edges[0] = low;
}

/* A window in pixels is of the file's own size: as shares it fits the size that the options ask for. Of both kinds of window
 * pbrt takes the shares, and either may be given backwards (FilmBaseParameters). */
static void set_crop(struct pt_builder *b, struct pt_params *p, const int file_size[2])
{
    struct pt_scene_defaults *d = b->defaults;
    const int size[2] = {d->width, d->height};
    size_t n;
    const double *window = pt_params_floats(p, "cropwindow", 1, &n);
    double edges[4] = {0, 1, 0, 1};
    if (window && n != 4)
        pt_params_fail(p, "cropwindow", "cropwindow has %zu values (expected 4)", n);
    else if (window)
        memcpy(edges, window, sizeof edges);
    const double *bounds = pt_params_ints(p, "pixelbounds", &n);
    if (bounds && n != 4)
        pt_params_fail(p, "pixelbounds", "pixelbounds has %zu values (expected 4)", n);
    else if (bounds && window)
        pt_params_warn(p, "pixelbounds", "pixelbounds give way to the cropwindow");
    else if (bounds)
        for (int i = 0; i < 4; i++)
            edges[i] = bounds[i] / file_size[i / 2];
    sort_pair(edges);
    sort_pair(edges + 2);
    for (int i = 0; i < 4; i++) /* x0 x1 y0 y1 there, x0 y0 x1 y1 here */
        d->crop[i % 2 * 2 + i / 2] = (int)ceil(fmin(fmax(edges[i], 0), 1) * size[i / 2] - 1e-6);
    if (d->crop[0] >= d->crop[2] || d->crop[1] >= d->crop[3])
        pt_params_fail(p, window ? "cropwindow" : "pixelbounds",
                       "the crop window holds no pixel (expected x0 < x1 and y0 < y1 in it)");
}

/* Whatever the file says of exposure ends in one factor: v3 has a scale, v4 a sensor. */
static void build_film(struct pt_builder *b, struct pt_params *p)
{
    static const char *const kinds[] = {"rgb", "image", "gbuffer", "spectral", NULL};
    struct pt_scene_defaults *d = b->defaults;
    if (!is_one_of(pt_params_kind(p), kinds))
        pt_params_fail(p, NULL, "unknown film \"%s\" (expected rgb, image, gbuffer or spectral)", pt_params_kind(p));
    int file_size[2] = {pt_params_int_in(p, "xresolution", b->is_v3 ? 640 : 1280, 1, MAX_SIDE),
                        pt_params_int_in(p, "yresolution", b->is_v3 ? 480 : 720, 1, MAX_SIDE)};
    d->width = b->options->width > 0 ? b->options->width : file_size[0];
    d->height = b->options->height > 0 ? b->options->height : file_size[1];
    if ((double)d->width * d->height > max_pixels)
        pt_params_fail(p, "xresolution", "%d x %d pixels (expected at most 2^28 in all)", d->width, d->height);
    set_crop(b, p, file_size);
    snprintf(d->film_path, sizeof d->film_path, "%s", pt_params_string(p, "filename", ""));
    double scale = b->is_v3 ? pt_params_float_in(p, "scale", 1, 0, 1e12)
                            : exposure_time(b, p) * pt_params_float_in(p, "iso", 100, 0, 1e9) / 100;
    b->scene->radiance_scale = (float)scale;
    const char *sensor = pt_params_string(p, "sensor", "cie1931");
    if (strcmp(sensor, "cie1931") != 0)
        pt_params_warn(p, "sensor", "sensor \"%s\" is rendered as an ideal one", sensor);
    if (pt_params_find(p, "whitebalance") && pt_params_float(p, "whitebalance", 0) != 0)
        pt_params_warn(p, "whitebalance", "white balance is ignored");
    double limit = pt_params_float_in(p, "maxcomponentvalue", INFINITY, 1e-30, FLT_MAX);
    if (pt_params_find(p, "maxsampleluminance")) /* v3's, of a sample before the film's scale */
        limit = pt_params_float_in(p, "maxsampleluminance", limit, 1e-30, FLT_MAX) * (double)b->scene->radiance_scale;
    d->integrator.max_component = (float)limit;
    pt_params_ignore(p, "diagonal savefp16 writeframe type coordinatesystem nbuckets lambdamin lambdamax");
}

/* v3 and v4 differ in defaults, in what sigma is, and in the names of the radii. */
static void build_filter(struct pt_builder *b, struct pt_params *p)
{
    struct pt_integrator *it = &b->defaults->integrator;
    const char *kind = pt_params_kind(p);
    double fallback = 0.5, sigma = 0.5;
    if (strcmp(kind, "box") == 0) {
        it->filter = PT_FILTER_BOX;
    } else if (strcmp(kind, "triangle") == 0) {
        it->filter = PT_FILTER_TRIANGLE;
        fallback = 2;
    } else if (strcmp(kind, "gaussian") == 0) {
        it->filter = PT_FILTER_GAUSSIAN;
        fallback = b->is_v3 ? 2 : 1.5;
        /* v3 writes exp(-alpha x²). */
        double alpha = pt_params_float_in(p, "alpha", 2, 1e-6, 1e6);
        sigma = pt_params_float_in(p, "sigma", b->is_v3 ? sqrt(0.5 / alpha) : 0.5, 1e-3, 1e3);
    } else if (strcmp(kind, "mitchell") == 0 || strcmp(kind, "sinc") == 0) {
        pt_params_warn(p, NULL, "filter \"%s\" has negative lobes: a Gaussian of the same main lobe is used", kind);
        it->filter = PT_FILTER_GAUSSIAN;
        fallback = 2;
        pt_params_ignore(p, "B C tau");
    } else {
        pt_params_fail(p, NULL, "unknown filter \"%s\" (expected box, triangle, gaussian, mitchell or sinc)", kind);
    }
    double x = pt_params_float_in(p, "xradius", fallback, 1e-3, 100),
           y = pt_params_float_in(p, "yradius", fallback, 1e-3, 100);
    it->filter_x = (float)pt_params_float_in(p, "xwidth", x, 1e-3, 100);
    it->filter_y = (float)pt_params_float_in(p, "ywidth", y, 1e-3, 100);
    /* half the width of Mitchell's main lobe grows with the radius, that of the sinc does not */
    it->filter_sigma = strcmp(kind, "mitchell") == 0 ? 0.25f * it->filter_x : (float)sigma;
}

static void build_sampler(struct pt_builder *b, struct pt_params *p)
{
    static const char *const low_discrepancy[] = {"sobol",      "zsobol",         "paddedsobol", "halton",     "pmj02bn",
                                                  "02sequence", "lowdiscrepancy", "stratified",  "maxmindist", NULL};
    static const char *const random[] = {"independent", "random", "mlt", NULL};
    const char *kind = pt_params_kind(p);
    b->defaults->integrator.sampler = is_one_of(kind, random) ? PT_SAMPLER_INDEPENDENT : PT_SAMPLER_SOBOL;
    if (!is_one_of(kind, random) && !is_one_of(kind, low_discrepancy))
        pt_params_fail(p, NULL, "unknown sampler \"%s\" (expected independent, sobol, zsobol, halton, stratified …)", kind);
    int xs = pt_params_int_in(p, "xsamples", 4, 1, 65536), ys = pt_params_int_in(p, "ysamples", 4, 1, 16384);
    b->defaults->spp = pt_params_int_in(p, "pixelsamples", strcmp(kind, "stratified") == 0 ? xs * ys : 16, 1, 1 << 30);
    b->defaults->integrator.seed = (uint32_t)pt_params_int_in(p, "seed", (int)b->defaults->integrator.seed, 0, 2147483647);
    pt_params_ignore(p, "randomization dimensions jitter");
}

static void build_integrator(struct pt_builder *b, struct pt_params *p)
{
    static const char *const same[] = {"path", "volpath", "simplepath", "simplevolpath", NULL};
    static const char *const other[] = {"bdpt",     "mlt",     "sppm",           "lightpath",        "randomwalk", "ao",
                                        "function", "whitted", "directlighting", "ambientocclusion", NULL};
    struct pt_integrator *it = &b->defaults->integrator;
    const char *kind = pt_params_kind(p);
    if (is_one_of(kind, other))
        pt_params_warn(p, NULL, "integrator \"%s\" is replaced by path tracing", kind);
    else if (!is_one_of(kind, same))
        pt_params_fail(p, NULL, "unknown integrator \"%s\" (expected path, volpath …)", kind);
    it->max_depth = pt_params_int_in(p, "maxdepth", 5, -1, 1 << 20);
    it->rr_depth = 3;
    it->strategy = PT_STRATEGY_MIS;
    if (pt_params_bool(p, "regularize", 0))
        pt_params_warn(p, "regularize", "regularize is ignored: the image is the unbiased one");
    pt_params_ignore(p, "lightsampler lightsamplestrategy rrthreshold sampledirect samplelights samplebsdf iterations "
                        "numiterations photonsperiteration radius mutationsperpixel bootstrapsamples chains sigma "
                        "largestepprobability imagewritefrequency visualizestrategies visualizeweights pixelbounds seed "
                        "cossample maxdistance nsamples strategy illuminant");
}

static void set_screen(struct pt_builder *b, struct pt_params *p, struct pt_camera *c)
{
    double aspect = pt_params_float_in(p, "frameaspectratio", (double)c->width / c->height, 1e-4, 1e4);
    double x = aspect > 1 ? aspect : 1, y = aspect > 1 ? 1 : 1 / aspect;
    const double window[4] = {-x, x, -y, y};
    size_t n;
    const double *given = pt_params_floats(p, "screenwindow", 1, &n);
    if (given && (n != 4 || given[0] == given[1] || given[2] == given[3])) {
        pt_params_fail(p, "screenwindow", "screenwindow needs x0 x1 y0 y1 that span an area");
        given = NULL;
    }
    given = given ? given : window;
    const double scale = c->kind == PT_CAMERA_PERSPECTIVE ? tan(0.5 * (double)c->fov_deg * (BASE_PI / 180)) : 1;
    for (int i = 0; i < 4; i++) {
        const double middle = 0.5 * (given[i & 2] + given[i | 1]);
        c->screen[i] = (float)(given[i] - (b->camera_start > 0 ? middle : 0));
        b->window_middle[i / 2] = scale * middle;
    }
}

/* The options' camera instead of the file's; mirrored where that is, so that lettering stays legible. */
static void override_camera(struct pt_builder *b, struct pt_xform world_to_camera[2])
{
    const double *v = b->options->view.look_at_world;
    struct pt_xform t;
    if (!b->options->view.has_look_at || !pt_xform_look_at(v, v + 3, v + 6, &t))
        return;
    if (pt_xform_det(&world_to_camera[0]) < 0)
        t = pt_xform_mul(pt_xform_scale(-1, 1, 1), t);
    world_to_camera[0] = world_to_camera[1] = t;
}

/* Its space has its lens at the origin, or the middle of the window where its rays begin at a depth. */
static void place_camera(struct pt_builder *b, struct pt_params *p, struct pt_camera *c)
{
    struct pt_xform *world_to_camera = b->world_to_camera, to_world;
    const int perspective = c->kind == PT_CAMERA_PERSPECTIVE;
    const double start = b->camera_start, by = perspective ? start : 1;
    const double x = by * b->window_middle[0], y = by * b->window_middle[1];
    const double way[3] = {perspective ? x : 0, perspective ? y : 0, start};
    double world[3];
    pt_builder_at_shutter(b, b->camera_ctm, world_to_camera);
    override_camera(b, world_to_camera);
    c->animated = !pt_xform_equal(&world_to_camera[0], &world_to_camera[1]);
    for (int i = 0; i < 2; i++) {
        if (!pt_xform_invert(&world_to_camera[i], &to_world)) {
            pt_params_fail(p, NULL, "the camera's transform is singular");
            return;
        }
        if (start > 0)
            to_world = pt_xform_mul(to_world, pt_xform_translate(x, y, start));
        for (int k = 0; k < 3 && i == 0; k++)
            b->origin[k] = to_world.m[k][3];
        pt_xform_vector(&to_world, way, world);
        c->before = (float)sqrt(world[0] * world[0] + world[1] * world[1] + world[2] * world[2]);
        c->to_render[i] = pt_xform_to_mat34(pt_builder_to_render(b, to_world));
    }
}

/* v3 knows half of it, too, for exporters that write that (cameras/perspective.cpp). */
static double read_fov(struct pt_builder *b, struct pt_params *p)
{
    double fov = pt_params_float_in(p, "fov", 90, 1e-12, 179.9);
    double half = b->is_v3 ? pt_params_float(p, "halffov", 0) : 0;
    if (half > 179.9 / 2)
        pt_params_fail(p, "halffov", "parameter \"halffov\" is %g (expected at most %g)", half, 179.9 / 2);
    return half > 0 ? fmax(2 * half, 1e-12) : fov;
}

/* What the options replace is read all the same: it is checked, and counts as used. */
static void build_camera(struct pt_builder *b, struct pt_params *p)
{
    struct pt_camera *c = &b->scene->camera;
    const char *kind = pt_params_kind(p);
    c->width = b->defaults->width;
    c->height = b->defaults->height;
    c->kind = strcmp(kind, "orthographic") == 0 ? PT_CAMERA_ORTHOGRAPHIC : PT_CAMERA_PERSPECTIVE;
    if (strcmp(kind, "realistic") == 0 || strcmp(kind, "spherical") == 0 || strcmp(kind, "environment") == 0) {
        pt_params_warn(p, NULL, "camera \"%s\" is replaced by a perspective one", kind);
        pt_params_ignore(p, "lensfile aperturediameter focusdistance aperture mapping simpleweighting");
    } else if (c->kind == PT_CAMERA_PERSPECTIVE && strcmp(kind, "perspective") != 0) {
        pt_params_fail(p, NULL, "unknown camera \"%s\" (expected perspective or orthographic)", kind);
    }
    c->fov_deg = c->kind == PT_CAMERA_PERSPECTIVE ? (float)read_fov(b, p) : 0;
    if (b->options->view.fov_deg > 0) {
        if (c->kind == PT_CAMERA_ORTHOGRAPHIC)
            pt_params_fail(p, NULL, "the camera is orthographic, which --fov cannot change");
        c->fov_deg = (float)b->options->view.fov_deg;
    }
    set_screen(b, p, c);
    c->lens_radius = (float)pt_params_float_in(p, "lensradius", 0, 0, 1e9);
    const double focal_distance = pt_params_float_in(p, "focaldistance", 1e6, 1e-9, 1e30);
    c->focal_distance = (float)focal_distance;
    c->focus_beyond = (float)(focal_distance - b->camera_start);
    place_camera(b, p, c);
    c->start = (float)b->camera_start;
    c->middle_x = (float)b->window_middle[0];
    c->middle_y = (float)b->window_middle[1];
    c->medium = b->camera_medium;
    if (c->lens_radius > 0)
        pt_builder_effect(b, PT_FX_DEFOCUS, p->loc);
    if (c->animated)
        pt_builder_effect(b, PT_FX_MOTION, p->loc);
}

int pt_build_header(struct pt_builder *b)
{
    static const struct {
        const char *kinds[2]; /* of v4 and v3, where the file has none */
        void (*build)(struct pt_builder *b, struct pt_params *p);
    } parts[PT_HEADER_COUNT] = {[PT_HEADER_FILM] = {{"rgb", "rgb"}, build_film},
                                [PT_HEADER_FILTER] = {{"gaussian", "box"}, build_filter},
                                [PT_HEADER_SAMPLER] = {{"zsobol", "zsobol"}, build_sampler},
                                [PT_HEADER_INTEGRATOR] = {{"volpath", "path"}, build_integrator},
                                [PT_HEADER_CAMERA] = {{"perspective", "perspective"}, build_camera}};
    for (int i = 0; i < PT_HEADER_COUNT; i++)
        if (!b->header[i].text)
            pt_params_clear(&b->header[i], &b->diag, (struct pt_loc){NULL, 0, 0}, parts[i].kinds[b->is_v3]);
    build_shutter(b, &b->header[PT_HEADER_CAMERA]);
    for (int i = 0; i < PT_HEADER_COUNT; i++) {
        parts[i].build(b, &b->header[i]);
        pt_params_check_used(&b->header[i]);
        if (i == PT_HEADER_FILM && b->diag.rc) /* the others need its size */
            break;
    }
    return b->diag.rc;
}
