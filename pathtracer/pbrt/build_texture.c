/* Textures, the images they read, and parameters that may be textured. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/colour.h"
#include "base/files.h"
#include "base/options.h"
#include "picture/read.h"
#include "pbrt/build.h"
#include "shade/texture.h"

struct pt_input pt_input_grey(double value) { return (struct pt_input){0, v3_splat((float)value)}; }

/* Of the texture with this id; black after a failure (-1). */
static struct pt_input input_of(int32_t id) { return (struct pt_input){.texture = id + 1}; }

/* Encoding of an 8- or 16-bit file: 0 sRGB, 1 linear, else the exponent. -1 when not understood. */
static double parse_encoding(const char *encoding)
{
    double gamma;
    if (!encoding || strcmp(encoding, "sRGB") == 0 || strcmp(encoding, "srgb") == 0)
        return 0;
    if (strcmp(encoding, "linear") == 0)
        return 1;
    if (strncmp(encoding, "gamma ", 6) == 0 && pt_number_parse(encoding + 6, strlen(encoding + 6), &gamma) && gamma > 0.05 &&
        gamma < 20)
        return gamma;
    return -1;
}

/* The first channels that the renderer keeps, 1, 3 or 4, as pbrt-v4 does: alpha beside grey goes, alpha of formats that pbrt
 * reads by stb_image goes (Image::Read), and alpha that is 1 everywhere goes (MIPMap::CreateFromFile). */
static int choose_channels(const char *path, const struct pic_image *image)
{
    static const char *const without_alpha[] = {"tga", "bmp", "psd", "gif"};
    size_t n = (size_t)image->width * (size_t)image->height, c = (size_t)image->channels;
    if (image->channels < 4)
        return image->channels < 3 ? 1 : 3;
    for (size_t i = 0; i < sizeof without_alpha / sizeof without_alpha[0]; i++)
        if (base_file_has_ending(path, without_alpha[i]))
            return 3;
    int opaque = 1;
    for (size_t i = 0; i < n && opaque; i++)
        opaque = image->u8 ? image->u8[i * c + c - 1] == 255 : image->f32[i * c + c - 1] >= 1;
    return opaque ? 3 : 4;
}

static int convert(struct pt_builder *b, const char *path, const struct pic_image *image, double encoding,
                   struct pt_image_map *out)
{
    const int channels = choose_channels(path, image);
    size_t n = (size_t)image->width * (size_t)image->height, c = (size_t)image->channels, k = (size_t)channels;
    *out = (struct pt_image_map){image->width, image->height, channels, PT_PIXEL_FLOAT, 1, NULL};
    if (image->u8) {
        uint8_t *pixels = pt_arena_alloc(&b->scene->arena, n, k);
        for (size_t i = 0; pixels && i < n; i++)
            for (size_t j = 0; j < k; j++)
                pixels[i * k + j] = image->u8[i * c + j];
        out->type = encoding == 0 ? PT_PIXEL_U8_SRGB : PT_PIXEL_U8_LINEAR;
        out->gamma = encoding > 0 ? (float)encoding : 1;
        out->pixels = pixels;
    } else {
        float *pixels = pt_arena_alloc(&b->scene->arena, n, k * sizeof *pixels);
        for (size_t i = 0; pixels && i < n; i++)
            for (size_t j = 0; j < k; j++) {
                float v = image->f32[i * c + j];
                if (!image->is_float_file && j < 3 && encoding != 1)
                    v = encoding == 0 ? (float)base_srgb_eotf((double)v) : powf(v, (float)encoding);
                /* An infinite pixel is a half float that overflowed: the largest half. */
                pixels[i * k + j] = isfinite(v) ? v : v > 0 ? 65504.0f : 0;
            }
        out->pixels = pixels;
    }
    return out->pixels ? 0 : pt_diag_nomem(&b->diag, "a texture");
}

/* What is no light, in a picture of light, is 0 and said: an infinite pixel would outshine all others. */
static void check_light(struct pt_builder *b, struct pt_loc loc, const char *path, const struct pic_image *image)
{
    size_t n = image->f32 ? (size_t)image->width * (size_t)image->height : 0, c = (size_t)image->channels, bad = 0,
           first = 0;
    for (size_t i = 0; i < n; i++) {
        int is_light = 1;
        for (float *v = image->f32 + i * c, *end = v + (c < 3 ? 1 : 3); v < end; v++)
            if (!(isfinite(*v) && *v >= 0)) {
                is_light = 0;
                *v = 0;
            }
        if (!is_light && bad++ == 0)
            first = i;
    }
    size_t width = (size_t)image->width;
    if (bad > 0)
        pt_diag_warn(&b->diag, loc,
                     "%s: %zu of its %zu pixels are infinite, NaN or negative, the first at x = %zu, y = %zu: "
                     "that is taken as 0",
                     path, bad, n, first % width, first / width);
}

int32_t pt_build_image_map(struct pt_builder *b, struct pt_loc loc, const char *name, const char *encoding,
                           enum pt_image_use use)
{
    char path[2048], own_key[2200];
    const char *const key = own_key + 1;
    double code = parse_encoding(encoding), start_s = base_clock_wall_s();
    struct pic_image image = {0};
    struct pt_image_map map;
    struct base_err err = {0};
    int32_t id = -1;
    if (code < 0) {
        pt_diag_fail(&b->diag, loc, "unknown encoding \"%.40s\" (expected sRGB, linear or gamma X)", encoding);
        return -1;
    }
    if (name[0] == '\0') {
        pt_diag_fail(&b->diag, loc, "an image without a file name");
        return -1;
    }
    pt_builder_path(b, name, path, sizeof path);
    /* Many textures of a scene name one file: it is read once for each encoding, and one whose colours mean something else
     * than the same numbers in Rec. 709, or that are light, once for each use. */
    snprintf(own_key, sizeof own_key, "%c%g %s", "cdl"[use], code, path);
    if ((id = pt_names_get(&b->image_names, own_key)) >= 0 ||
        (use != PT_IMAGE_LIGHT && (id = pt_names_get(&b->image_names, key)) >= 0))
        return id;
    int rc;
    /* A real file is opened by the image library itself, without a copy of its bytes. */
    if (b->source->files) {
        rc = b->source->note(b->source->data, path, &err);
        if (!rc)
            rc = pic_read(path, &image, &err);
    } else {
        char *bytes = NULL;
        size_t size = 0;
        rc = b->source->read(b->source->data, path, &bytes, &size, &err);
        if (!rc)
            rc = pic_read_memory(path, bytes, size, &image, &err);
        free(bytes);
    }
    if (!rc && image.is_part)
        pt_diag_warn(&b->diag, loc, "%s: its pixels are not those of its whole picture: others are black, or left out",
                     path);
    const int is_own = !rc && (image.has_primaries || use == PT_IMAGE_LIGHT); /* as numbers it is another image */
    if (!rc && use == PT_IMAGE_LIGHT)
        check_light(b, loc, path, &image);
    if (!rc && use != PT_IMAGE_DATA)
        rc = pic_to_rec709(path, &image, &err);
    if (rc)
        pt_diag_fail_code(&b->diag, rc == BASE_ENOMEM ? rc : BASE_EINVAL, loc, "cannot read %s", err.text);
    else if (convert(b, path, &image, code, &map) == 0 && (id = pt_list_add(b, &b->images, &map)) >= 0 &&
             pt_names_set(&b->image_names, is_own ? own_key : key, id) != 0)
        pt_diag_nomem(&b->diag, "a texture");
    pic_release(&image);
    b->scene->stats.texture_s += base_clock_wall_s() - start_s;
    return !b->diag.rc ? id : -1;
}

int32_t pt_build_image_texture(struct pt_builder *b, struct pt_loc loc, const char *name, const char *encoding)
{
    struct pt_texture t = {.kind = PT_TEXTURE_IMAGE, .scale = 1, .su = 1, .sv = 1};
    t.image = pt_build_image_map(b, loc, name, encoding, PT_IMAGE_DATA);
    return t.image < 0 ? 0 : pt_list_add(b, &b->textures, &t) + 1;
}

static struct pt_input named_texture(struct pt_builder *b, struct pt_params *p, struct pt_param *param, int is_float,
                                     pt_vec3 fallback)
{
    param->used = 1;
    if (param->count != 1) {
        pt_diag_fail(&b->diag, param->loc, "\"%s\" names %zu textures (expected 1)", pt_param_name(p, param), param->count);
        return pt_input_grey(0);
    }
    const char *name = pt_params_string_at(p, param, 0);
    int32_t id = pt_names_get(is_float ? &b->float_textures : &b->colour_textures, name);
    if (id < 0 && b->is_v3) { /* pbrt-v3 says so and goes on (TextureParams) */
        pt_diag_warn(&b->diag, param->loc, "unknown %s texture \"%s\": \"%s\" keeps its default",
                     is_float ? "float" : "spectrum", name, pt_param_name(p, param));
        return (struct pt_input){0, fallback};
    }
    if (id < 0) {
        int other = pt_names_get(is_float ? &b->colour_textures : &b->float_textures, name) >= 0;
        pt_diag_fail(&b->diag, param->loc, other ? "texture \"%s\" is a %s texture (expected %s)" : "unknown texture \"%s\"",
                     name, is_float ? "spectrum" : "float", is_float ? "float" : "spectrum");
        return pt_input_grey(0);
    }
    const struct pt_texture *t = &((struct pt_texture *)b->textures.items)[id];
    /* A constant is its value: nothing is looked up while rendering. */
    return t->kind == PT_TEXTURE_CONSTANT ? t->in[0] : input_of(id);
}

struct pt_input pt_build_float_input(struct pt_builder *b, struct pt_params *p, const char *name, double fallback)
{
    struct pt_param *param = pt_params_find(p, name);
    if (param && param->type == PT_PARAM_TEXTURE)
        return named_texture(b, p, param, 1, v3_splat((float)fallback));
    return pt_input_grey(pt_params_float(p, name, fallback));
}

struct pt_input pt_build_colour_input(struct pt_builder *b, struct pt_params *p, const char *name, enum pt_colour_use use,
                                      pt_vec3 fallback)
{
    struct pt_param *param = pt_params_find(p, name);
    if (param && param->type == PT_PARAM_TEXTURE)
        return named_texture(b, p, param, 0, fallback);
    pt_build_colour(b, p, name, use, &fallback);
    return (struct pt_input){0, fallback};
}

struct pt_input pt_input_product(struct pt_builder *b, struct pt_input x, struct pt_input y)
{
    if (!x.texture && !y.texture)
        return (struct pt_input){0, v3_mul(x.value, y.value)};
    if (!x.texture && x.value.x == 1 && x.value.y == 1 && x.value.z == 1)
        return y;
    if (!y.texture && y.value.x == 1 && y.value.y == 1 && y.value.z == 1)
        return x;
    struct pt_texture t = {.kind = PT_TEXTURE_SCALE, .scale = 1, .su = 1, .sv = 1, .in = {x, y}};
    return input_of(pt_list_add(b, &b->textures, &t));
}

struct pt_input pt_input_mix(struct pt_builder *b, struct pt_input x, struct pt_input y, struct pt_input amount)
{
    if (!x.texture && !y.texture && !amount.texture)
        return (struct pt_input){0,
                                 v3_add(v3_mul(v3_sub(v3_splat(1), amount.value), x.value), v3_mul(amount.value, y.value))};
    struct pt_texture t = {.kind = PT_TEXTURE_MIX, .scale = 1, .su = 1, .sv = 1, .in = {x, y, amount}};
    return input_of(pt_list_add(b, &b->textures, &t));
}

struct pt_input pt_input_luminance(struct pt_builder *b, struct pt_input in)
{
    if (!in.texture)
        return pt_input_grey((double)v3_luminance(in.value));
    struct pt_texture t = ((struct pt_texture *)b->textures.items)[in.texture - 1];
    if (t.kind == PT_TEXTURE_IMAGE)
        t.channel = PT_CHANNEL_LUMINANCE;
    for (int i = 0; i < 4; i++)
        t.in[i] = pt_input_luminance(b, t.in[i]);
    return input_of(pt_list_add(b, &b->textures, &t));
}

struct context {
    struct pt_builder *b;
    struct pt_params *p;
    int is_float;
};

static struct pt_input input(struct context *c, const char *name, double fallback)
{
    if (c->is_float)
        return pt_build_float_input(c->b, c->p, name, fallback);
    return pt_build_colour_input(c->b, c->p, name, PT_USE_UNBOUNDED, v3_splat((float)fallback));
}

/* Index of the word that a parameter has, 0 when it is absent. -1 after a failure. */
static int read_word(struct pt_params *p, const char *name, const char *const *words, const char *expected)
{
    const char *word = pt_params_string(p, name, words[0]);
    const int index = base_word_index(words, word, strlen(word));
    if (index < 0)
        pt_params_fail(p, name, "unknown %s \"%.40s\" (expected %s)", name, word, expected);
    return index;
}

static void read_mapping(struct context *c, struct pt_texture *t)
{
    static const char *const mappings[] = {"uv", "spherical", "cylindrical", "planar", NULL};
    struct pt_params *p = c->p;
    const int mapping = read_word(p, "mapping", mappings, "uv, spherical, cylindrical or planar");
    if (mapping > 0)
        pt_params_warn(p, "mapping", "mapping \"%s\" is replaced by the shape's own uv", mappings[mapping]);
    t->su = (float)pt_params_float(p, "uscale", 1);
    t->sv = (float)pt_params_float(p, "vscale", 1);
    t->du = (float)pt_params_float(p, "udelta", 0);
    t->dv = (float)pt_params_float(p, "vdelta", 0);
    pt_params_ignore(p, "v1 v2");
}

static void make_constant(struct context *c, struct pt_texture *t) { t->in[0] = input(c, "value", 1); }

static void make_scale(struct context *c, struct pt_texture *t)
{
    const int is_v4 = pt_params_find(c->p, "tex") || pt_params_find(c->p, "scale");
    t->in[0] = input(c, is_v4 ? "tex" : "tex1", 1);
    t->in[1] = is_v4 ? pt_build_float_input(c->b, c->p, "scale", 1) : input(c, "tex2", 1);
    if (!t->in[0].texture && !t->in[1].texture) {
        t->kind = PT_TEXTURE_CONSTANT;
        t->in[0] = pt_input_product(c->b, t->in[0], t->in[1]);
    }
}

static void make_mix(struct context *c, struct pt_texture *t)
{
    t->in[0] = input(c, "tex1", 0);
    t->in[1] = input(c, "tex2", 1);
    t->in[2] = pt_build_float_input(c->b, c->p, "amount", 0.5);
    if (!t->in[0].texture && !t->in[1].texture && !t->in[2].texture) {
        t->kind = PT_TEXTURE_CONSTANT;
        t->in[0] = pt_input_mix(c->b, t->in[0], t->in[1], t->in[2]);
    }
}

static void make_direction_mix(struct context *c, struct pt_texture *t)
{
    pt_params_warn(c->p, NULL, "texture \"directionmix\" is replaced by an even mix");
    pt_params_ignore(c->p, "dir");
    make_mix(c, t);
}

static void make_checkerboard(struct context *c, struct pt_texture *t)
{
    t->in[0] = input(c, "tex1", 1);
    t->in[1] = input(c, "tex2", 0);
    read_mapping(c, t);
    if (pt_params_int_in(c->p, "dimension", 2, 2, 3) == 3)
        pt_params_warn(c->p, "dimension", "a checkerboard of dimension 3 is drawn on the shape's uv instead");
    pt_params_ignore(c->p, "aamode");
}

static void make_bilerp(struct context *c, struct pt_texture *t)
{
    static const char *const corners[4] = {"v00", "v01", "v10", "v11"};
    for (int i = 0; i < 4; i++)
        t->in[i] = input(c, corners[i], i % 2);
    read_mapping(c, t);
}

static void make_imagemap(struct context *c, struct pt_texture *t)
{
    static const char *const wraps[] = {"repeat", "black", "clamp", "octahedralsphere", NULL}; /* by enum pt_wrap */
    /* pbrt-v4's: what is no single texel is bilinear here */
    static const char *const filters[] = {"bilinear", "point", "trilinear", "EWA", "ewa", NULL};
    struct pt_params *p = c->p;
    const char *file = pt_params_string(p, "filename", ""), *encoding = pt_params_string(p, "encoding", NULL);
    struct pt_param *gamma = pt_params_find(p, "gamma");
    if (gamma && gamma->type == PT_PARAM_BOOL) /* v3 */
        encoding = pt_params_bool(p, "gamma", 1) ? "sRGB" : "linear";
    else
        pt_params_ignore(p, "gamma");
    t->wrap = read_word(p, "wrap", wraps, "repeat, black or clamp");
    t->is_nearest = read_word(p, "filter", filters, "point, bilinear, trilinear or ewa") == 1;
    t->scale = (float)pt_params_float(p, "scale", 1);
    t->invert = pt_params_bool(p, "invert", 0);
    t->is_signed = c->is_float && !t->invert;
    read_mapping(c, t);
    pt_params_ignore(p, "maxanisotropy trilinear");
    t->image = -1;
    if (!c->b->diag.rc)
        t->image = pt_build_image_map(c->b, pt_params_loc(p, "filename"), file, encoding,
                                      c->is_float ? PT_IMAGE_DATA : PT_IMAGE_COLOUR);
    if (t->image >= 0 && c->is_float) {
        const struct pt_image_map *m = &((struct pt_image_map *)c->b->images.items)[t->image];
        if (c->b->is_v3) /* knows no alpha of images */
            t->channel = m->channels >= 3 ? PT_CHANNEL_LUMINANCE : 0;
        else
            t->channel = m->channels == 4 ? PT_CHANNEL_ALPHA : m->channels == 3 ? PT_CHANNEL_MEAN : 0;
    }
}

/* Patterns that are not simulated: their mean keeps the brightness of the picture about right. */
static void make_stand_in(struct context *c, struct pt_texture *t)
{
    const char *kind = pt_params_kind(c->p);
    struct pt_input inside = input(c, "inside", 1), outside = input(c, "outside", 0);
    pt_params_warn(c->p, NULL, "texture \"%s\" is replaced by a constant", kind);
    t->in[0] = strcmp(kind, "dots") == 0 && !inside.texture && !outside.texture
                   ? (struct pt_input){0, v3_scale(v3_add(inside.value, outside.value), 0.5f)}
                   : pt_input_grey(0.5);
    read_mapping(c, t);
    pt_params_ignore(c->p, "octaves roughness scale variation filename encoding gamma invert");
}

/* Textures that one lookup may ask for: they are asked one within the other. */
enum { MAX_LOOKUPS = 4096 };

static void count_lookups(const struct pt_texture *all, const struct pt_texture *t, int *left)
{
    for (int i = 0; i < 4 && *left > 0; i++)
        if (t->in[i].texture) {
            --*left;
            count_lookups(all, &all[t->in[i].texture - 1], left);
        }
}

int pt_build_texture(struct pt_builder *b, const char *name, const char *class_name, struct pt_params *p)
{
    static const struct texture_class {
        const char *name;
        int32_t kind;
        void (*make)(struct context *c, struct pt_texture *t);
    } kinds[] = {{"imagemap", PT_TEXTURE_IMAGE, make_imagemap},
                 {"scale", PT_TEXTURE_SCALE, make_scale},
                 {"mix", PT_TEXTURE_MIX, make_mix},
                 {"constant", PT_TEXTURE_CONSTANT, make_constant},
                 {"checkerboard", PT_TEXTURE_CHECKERBOARD, make_checkerboard},
                 {"bilerp", PT_TEXTURE_BILERP, make_bilerp},
                 {"directionmix", PT_TEXTURE_MIX, make_direction_mix}};
    static const char *const stand_ins[] = {"dots", "fbm", "wrinkled", "windy", "marble", "ptex", "uv", NULL};
    const char *kind = pt_params_kind(p);
    int is_float = strcmp(class_name, "float") == 0;
    if (!is_float && strcmp(class_name, "spectrum") != 0 && strcmp(class_name, "color") != 0 &&
        strcmp(class_name, "rgb") != 0)
        return pt_params_fail(p, NULL, "texture \"%s\" of type \"%s\" (expected float or spectrum)", name, class_name);
    struct context c = {b, p, is_float};
    struct pt_texture t = {.kind = PT_TEXTURE_CONSTANT, .scale = 1, .su = 1, .sv = 1};
    const struct texture_class *made_so = pt_row(kinds, kind);
    if (made_so) {
        t.kind = made_so->kind;
        made_so->make(&c, &t);
    } else if (base_word_index(stand_ins, kind, strlen(kind)) >= 0) {
        make_stand_in(&c, &t);
    } else {
        return pt_diag_unknown(&b->diag, p->loc, "texture class", kind, "imagemap, scale, mix, constant, checkerboard …",
                               "it is left out");
    }
    pt_params_check_used(p);
    if (b->diag.rc)
        return b->diag.rc;
    int left = MAX_LOOKUPS;
    count_lookups(b->textures.items, &t, &left);
    if (left == 0)
        return pt_params_fail(p, NULL, "texture \"%.63s\" is made of more than %d others", name, MAX_LOOKUPS - 1);
    int32_t id = pt_list_add(b, &b->textures, &t);
    return id < 0 ? b->diag.rc : pt_builder_name(b, is_float ? &b->float_textures : &b->colour_textures, name, id);
}
