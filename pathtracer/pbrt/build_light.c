/* Lights. pbrt-v4's meaning of "scale", "power" and "illuminance" is that of its lights.cpp. */
#include <math.h>
#include <string.h>

#include "base/pi.h"
#include "pbrt/build.h"
#include "shade/texture.h"

/* "L" or "I" with both kinds of scale (v4: float, v3: colour), as RGB. */
static pt_vec3 scaled_colour(struct pt_builder *b, struct pt_params *p, const char *name)
{
    pt_vec3 value = v3_splat(1), by = v3_splat(1);
    struct pt_param *scale = pt_params_find(p, "scale");
    pt_build_colour(b, p, name, PT_USE_LIGHT, &value);
    if (scale && scale->type != PT_PARAM_FLOAT && scale->type != PT_PARAM_INTEGER)
        pt_build_colour(b, p, "scale", PT_USE_UNBOUNDED, &by);
    else
        by = v3_splat((float)pt_params_float_in(p, "scale", 1, 0, 3e38));
    return v3_mul(value, by);
}

struct context {
    struct pt_builder *b;
    struct pt_params *p;
    struct pt_xform ctm; /* at shutter open */
    struct pt_light *light;
};

static void place(const struct context *c, const double p[3], pt_vec3 *out)
{
    double q[3];
    struct pt_xform t = pt_builder_to_render(c->b, c->ctm);
    pt_xform_point(&t, p, q);
    *out = v3((float)q[0], (float)q[1], (float)q[2]);
}

static void read_position(struct context *c)
{
    double from[3] = {0, 0, 0};
    pt_params_point(c->p, "from", from);
    place(c, from, &c->light->position);
}

/* ctm · (to - from), unit. */
static void read_direction(struct context *c)
{
    double from[3] = {0, 0, 0}, to[3] = {0, 0, 1}, w[3];
    pt_params_point(c->p, "from", from);
    pt_params_point(c->p, "to", to);
    const double d[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
    pt_xform_vector(&c->ctm, d, w);
    if (!pt_normalize(w))
        pt_params_fail(c->p, pt_params_find(c->p, "to") ? "to" : "from",
                       "the light points nowhere (expected \"from\" and \"to\" apart)");
    else
        c->light->direction = v3((float)w[0], (float)w[1], (float)w[2]);
}

static void make_point(struct context *c)
{
    double power = pt_params_float(c->p, "power", -1);
    c->light->emission = scaled_colour(c->b, c->p, "I");
    if (power > 0)
        c->light->emission = v3_scale(c->light->emission, (float)(power / (4 * BASE_PI)));
    read_position(c);
}

static void make_spot(struct context *c)
{
    double power = pt_params_float(c->p, "power", -1);
    double cone = pt_params_float_in(c->p, "coneangle", 30, 1e-3, 180),
           delta = pt_params_float_in(c->p, "conedeltaangle", 5, 0, 180);
    double cos_total = cos(cone * BASE_PI / 180), cos_start = cos(fmax(cone - delta, 0) * BASE_PI / 180);
    c->light->emission = scaled_colour(c->b, c->p, "I");
    if (power > 0) /* flux of the smooth fall-off: 2π ((1 - cos start) + (cos start - cos total) / 2) */
        c->light->emission =
            v3_scale(c->light->emission, (float)(power / (2 * BASE_PI * ((1 - cos_start) + (cos_start - cos_total) / 2))));
    read_position(c);
    read_direction(c);
    c->light->cos_total = cos_total;
    c->light->cos_start = cos_start;
    c->light->is_quartic = c->b->is_v3;
}

static void make_distant(struct context *c)
{
    double illuminance = pt_params_float(c->p, "illuminance", -1);
    c->light->emission = scaled_colour(c->b, c->p, "L");
    if (illuminance > 0)
        c->light->emission = v3_scale(c->light->emission, (float)illuminance);
    read_direction(c);
}

/* How far a transform may be from a rotation before its inverse is no longer taken to be its transpose. */
static const double rotation_slack = 1e-6;

/* Without translation, of determinant 1 or -1. */
static struct pt_xform unscaled(struct pt_xform t)
{
    double size = cbrt(fabs(pt_xform_det(&t)));
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++)
            t.m[i][j] /= size;
        t.m[i][3] = 0;
    }
    return t;
}

/* Render → light: as in pbrt-v4 the image is looked up where the inverse transform takes a direction, stretched if it is. */
static int light_space(struct context *c)
{
    struct pt_xform inverse;
    if (!pt_xform_invert(&c->ctm, &inverse))
        return pt_params_fail(c->p, NULL, "singular transform of a light");
    inverse = unscaled(inverse);
    struct pt_xform back = unscaled(c->ctm);
    double off = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            off = fmax(off, fabs(back.m[i][j] - inverse.m[j][i]));
    c->light->from_render = pt_xform_to_mat34(inverse);
    c->light->to_render = pt_xform_to_mat34(back);
    c->light->is_stretched = off > rotation_slack;
    return 0;
}

/* The image as three floats >= 0 per pixel, which light selection and lookup expect. */
static int32_t float_rgb(struct pt_builder *b, int32_t id)
{
    struct pt_image_map map = ((struct pt_image_map *)b->images.items)[id];
    size_t n = (size_t)map.width * (size_t)map.height;
    int ready = map.type == PT_PIXEL_FLOAT && map.channels == 3;
    for (size_t i = 0; ready && i < 3 * n; i++)
        ready = ((const float *)map.pixels)[i] >= 0;
    if (ready)
        return id;
    pt_vec3 *pixels = pt_arena_alloc(&b->scene->arena, n, sizeof *pixels);
    if (!pixels) {
        pt_diag_nomem(&b->diag, "an environment map");
        return -1;
    }
    for (size_t i = 0; i < n; i++)
        pixels[i] =
            v3_most(pt_image_texel(&map, PT_WRAP_CLAMP, PT_CHANNEL_RGB, (int64_t)i % map.width, (int64_t)i / map.width),
                    v3_splat(0));
    map.type = PT_PIXEL_FLOAT;
    map.channels = 3;
    map.pixels = pixels;
    return pt_list_add(b, &b->images, &map);
}

/* v4's "portal": the corners of a rectangle in the world, in order around it, however the light is turned. Any parallelogram
 * will do here. */
static void make_portal(struct context *c)
{
    size_t n;
    struct pt_light *light = c->light;
    const struct pt_param *given = pt_params_find(c->p, "portal");
    const double *xyz = pt_params_floats(c->p, "portal", 3, &n);
    if (!given)
        return;
    pt_vec3 corner[4];
    float area = 0.0f, off = 0.0f;
    struct context world = {.b = c->b, .ctm = pt_xform_identity()};
    if (n == 4) {
        for (size_t i = 0; i < 4; i++)
            place(&world, xyz + 3 * i, &corner[i]);
        light->portal = corner[0];
        light->portal_u = v3_sub(corner[1], corner[0]);
        light->portal_v = v3_sub(corner[3], corner[0]);
        area = v3_len(v3_cross(light->portal_u, light->portal_v));
        off = v3_len(v3_sub(v3_sub(corner[2], corner[1]), light->portal_v));
    }
    if (!(area > 0.0f) || !isfinite(area) || !(off < 0.01f * sqrtf(area))) {
        pt_diag_fail(&c->b->diag, given->loc, "a portal is the 4 corners of a rectangle, in order around it");
        return;
    }
    light->has_portal = 1;
}

/* Its light is that of an image or even; v3 calls the file mapname. */
static void make_infinite(struct context *c)
{
    struct pt_params *p = c->p;
    const char *key = pt_params_find(p, "mapname") ? "mapname" : "filename", *file = pt_params_string(p, key, "");
    double illuminance = pt_params_float(p, "illuminance", -1);
    c->light->emission = scaled_colour(c->b, p, "L");
    make_portal(c);
    if (file[0] == '\0') {
        if (illuminance > 0) /* of an upward patch under the whole sky of radiance 1; "L" and "scale" come on top */
            c->light->emission = v3_scale(c->light->emission, (float)(illuminance / BASE_PI));
        return;
    }
    struct pt_loc loc = pt_params_find(p, key)->loc;
    int32_t id = pt_build_image_map(c->b, loc, file, NULL, PT_IMAGE_LIGHT);
    if (id < 0 || (id = float_rgb(c->b, id)) < 0)
        return;
    const struct pt_image_map *map = &((struct pt_image_map *)c->b->images.items)[id];
    c->light->kind = PT_LIGHT_ENV_IMAGE;
    c->light->image = id;
    /* v4 maps are square and equal-area, v3 maps (mapname) of latitude and longitude, mostly twice as wide as high; v4 files
     * with a v3 map exist. */
    int is_v4 = map->width == map->height && strcmp(key, "filename") == 0;
    c->light->mapping = is_v4 ? PT_ENV_EQUAL_AREA : PT_ENV_LATLONG;
    if (map->width != map->height && map->width != 2 * map->height)
        pt_diag_warn(&c->b->diag, loc, "environment map of %d x %d pixels is taken as latitude and longitude", map->width,
                     map->height);
    if (illuminance > 0)
        pt_params_warn(p, "illuminance", "illuminance of an image light is ignored");
    light_space(c);
}

static int add_light(struct pt_builder *b, const struct pt_light *light, struct pt_loc loc)
{
    if (b->lights.count == 1)
        pt_builder_effect(b, PT_FX_MANY_LIGHTS, loc);
    return pt_list_add(b, &b->lights, light);
}

int pt_build_light(struct pt_builder *b, struct pt_params *p)
{
    static const struct light_kind {
        const char *name;
        int32_t kind;
        pt_effects needs;
        void (*make)(struct context *c);
        const char *instead, *ignored; /* what stands in for one with an image, and what that does not read */
    } kinds[] = {{"point", PT_LIGHT_POINT, PT_FX_DELTA_LIGHT, make_point, NULL, ""},
                 {"spot", PT_LIGHT_SPOT, PT_FX_DELTA_LIGHT, make_spot, NULL, ""},
                 {"distant", PT_LIGHT_DISTANT, PT_FX_DELTA_LIGHT, make_distant, NULL, ""},
                 {"infinite", PT_LIGHT_ENV_CONSTANT, PT_FX_ENVIRONMENT, make_infinite, NULL, ""},
                 {"exinfinite", PT_LIGHT_ENV_CONSTANT, PT_FX_ENVIRONMENT, make_infinite, NULL, ""},
                 {"projection", PT_LIGHT_SPOT, PT_FX_DELTA_LIGHT, make_spot, "spot", "fov mapname filename"},
                 {"goniometric", PT_LIGHT_POINT, PT_FX_DELTA_LIGHT, make_point, "point", "mapname filename"}};
    const struct light_kind *kind = pt_row(kinds, pt_params_kind(p));
    struct pt_light light = {.shape = -1, .image = -1};
    struct pt_xform at[2];
    if (pt_builder_at_shutter(b, b->state->ctm, at))
        pt_params_warn(p, NULL, "lights do not move: the transform at shutter open is used");
    struct context c = {b, p, at[0], &light};
    if (!kind)
        return pt_diag_unknown(&b->diag, p->loc, "light", pt_params_kind(p), "point, spot, distant, infinite …",
                               "it is left out");
    light.kind = kind->kind;
    pt_builder_effect(b, kind->needs, p->loc);
    if (kind->instead)
        pt_params_warn(p, NULL, "light \"%s\" is replaced by a %s light without its image", kind->name, kind->instead);
    pt_params_ignore(p, kind->ignored);
    kind->make(&c);
    pt_params_ignore(p, "nsamples samples");
    pt_params_check_used(p);
    if (!b->diag.rc && !v3_is_black(light.emission))
        add_light(b, &light, p->loc);
    return b->diag.rc;
}

/* Mean colour of an image. */
static pt_vec3 mean_of(const struct pt_image_map *map)
{
    double sum[3] = {0}, n = (double)map->width * map->height;
    for (int32_t y = 0; y < map->height; y++)
        for (int32_t x = 0; x < map->width; x++) {
            pt_vec3 c = v3_most(pt_image_texel(map, PT_WRAP_CLAMP, PT_CHANNEL_RGB, x, y), v3_splat(0));
            sum[0] += (double)c.x;
            sum[1] += (double)c.y;
            sum[2] += (double)c.z;
        }
    return v3((float)(sum[0] / n), (float)(sum[1] / n), (float)(sum[2] / n));
}

/* The lamp sends as much as with its image, but evenly; a "power" is that of both. */
static void even_out(struct pt_builder *b, struct pt_params *p, struct pt_area_light *light)
{
    struct pt_loc loc = pt_params_loc(p, "filename");
    pt_diag_warn(&b->diag, loc, "the image of an area light is replaced by even light");
    int32_t id = pt_build_image_map(b, loc, pt_params_string(p, "filename", ""), NULL, PT_IMAGE_LIGHT);
    if (id < 0)
        return;
    pt_vec3 mean = mean_of((struct pt_image_map *)b->images.items + id);
    float y = v3_luminance(mean);
    light->emission = v3_mul(light->emission, light->power > 0 && y > 0 ? v3_scale(mean, 1 / y) : mean);
}

int pt_build_area_light(struct pt_builder *b, struct pt_params *p, struct pt_area_light *out)
{
    const char *kind = pt_params_kind(p);
    struct pt_area_light light = {.on = 1, .loc = p->loc};
    *out = (struct pt_area_light){0}; /* whatever becomes of this one, that of before ends */
    if (strcmp(kind, "diffuse") != 0 && strcmp(kind, "area") != 0)
        return pt_diag_unknown(&b->diag, p->loc, "area light", kind, "diffuse", "it is left out");
    light.emission = scaled_colour(b, p, "L");
    light.two_sided = pt_params_bool(p, "twosided", 0);
    light.power = pt_params_float(p, "power", -1);
    if (pt_params_find(p, "filename"))
        even_out(b, p, &light);
    pt_params_ignore(p, "nsamples samples");
    pt_params_check_used(p);
    if (!b->diag.rc)
        *out = light;
    return b->diag.rc;
}

int32_t pt_build_shape_light(struct pt_builder *b, const struct pt_area_light *source, double area)
{
    struct pt_light light = {
        .kind = PT_LIGHT_AREA, .two_sided = source->two_sided, .image = -1, .emission = source->emission};
    light.shape = (int32_t)b->world_shapes.count;
    if (source->power > 0 && area > 0)
        light.emission = v3_scale(light.emission, (float)(source->power / ((source->two_sided ? 2 : 1) * area * BASE_PI)));
    return add_light(b, &light, source->loc);
}
