#include "pbrt/params.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/options.h"

static const struct {
    const char *name;
    int type;
} type_names[] = {
    {"integer", PT_PARAM_INTEGER}, {"float", PT_PARAM_FLOAT},       {"point2", PT_PARAM_POINT2},
    {"vector2", PT_PARAM_VECTOR2}, {"point3", PT_PARAM_POINT3},     {"vector3", PT_PARAM_VECTOR3},
    {"point", PT_PARAM_POINT3},    {"vector", PT_PARAM_VECTOR3},    {"normal", PT_PARAM_NORMAL},
    {"normal3", PT_PARAM_NORMAL},  {"bool", PT_PARAM_BOOL},         {"string", PT_PARAM_STRING},
    {"texture", PT_PARAM_TEXTURE}, {"rgb", PT_PARAM_RGB},           {"color", PT_PARAM_RGB},
    {"xyz", PT_PARAM_XYZ},         {"spectrum", PT_PARAM_SPECTRUM}, {"blackbody", PT_PARAM_BLACKBODY},
};

/* Names that pbrt gives a meaning somewhere: out of place they change nothing, so they warn; any other name is a mistake. */
static const char known_names[] =
    " accelerator alpha amount angle B C Kd Ks Kr Kt L I Le Lescale N P Pw S T albedo alphatexture amplitude anisotropy "
    "aperture aperturediameter basis bsdffile bssrdf bumpmap camera conductor.eta conductor.k conductor.roughness "
    "conductor.uroughness conductor.vroughness coneangle conedeltaangle crop cropwindow ctm degree density detaillevel "
    "diagonal dimension displacement displayserver edgelength emissionfilename encoding eta eumelanin eta.eta "
    "exposuretime faceIndices filename filter filteradius filtertype flatness focaldistance focallength fov "
    "frameaspectratio from g gamma halffov height illuminance imagefile index indices inside innerradius interface.eta "
    "interface.roughness interface.uroughness interface.vroughness invert iso k lensfile lensradius levels "
    "lightsamplestrategy lightsampler mapname mapping materials maxanisotropy maxcomponentvalue maxdepth maxnodeprims "
    "maxprims maxsampleluminance mediumname mfp minsamples namedmaterial1 namedmaterial2 nlevels nsamples normalmap "
    "normals nu nv nx ny nz octaves offset omega opacity order outside outsidesamples p p0 p1 phimax pheomelanin "
    "photonsperiteration pixelbounds pixelsamples portal power preset radius randomization randomize reflect reflectance "
    "regularize remaproughness rgbfilename roughness rrthreshold samples saturation scale screenwindow seed sensor "
    "shadowalpha shutterclose shutteropen sigma sigma_a sigma_s sigma_t simpleaperture specialfloats spectrum splitdepth "
    "splitmethod st strategy tau temperature tex tex1 tex2 texture textures thickness to tolerance toneMap transmit "
    "transmittance trilinear twosided type u0 u1 udelta umax umin uorder uroughness uscale uv uvs uknots v0 v00 v01 v1 "
    "v10 v11 v2 value variation vdelta vertices vmax vmin vorder vroughness vscale vknots vtx whitebalance width width0 "
    "width1 wrap xradius xresolution xsamples xwidth yradius yresolution ysamples ywidth zmax zmin Pz color metallic "
    "speculartint sheen sheentint clearcoat clearcoatgloss spectrans scatterdistance difftrans flatness specTrans beta_m "
    "beta_n eccentricity visualizevoxels multiscatter Lemitted temperaturecutoff temperatureoffset temperaturescale "
    "numiterations iterations imagewritefrequency mutationsperpixel bootstrapsamples chains largestepprobability "
    "initialsamples savefp16 crease nointerior maxwavelength jitter dichromatic writeframe infinitelights lights shadow "
    "dispersion ";

/* Remembers a string and returns its offset in text. */
static size_t keep(struct pt_params *params, const char *text, size_t length)
{
    while (params->text_room - params->text_count <= length)
        if (!pt_grow((void **)&params->text, &params->text_room, params->text_room, 1)) {
            pt_diag_nomem(params->diag, "parameters");
            return 0;
        }
    size_t at = params->text_count;
    if (length > 0)
        memcpy(params->text + at, text, length);
    params->text[at + length] = '\0';
    params->text_count += length + 1;
    return at;
}

void pt_params_clear(struct pt_params *params, struct pt_diag *diag, struct pt_loc loc, const char *kind)
{
    params->diag = diag;
    params->loc = loc;
    params->count = params->number_count = params->text_count = 0;
    params->kind = keep(params, kind, strlen(kind));
}

void pt_params_release(struct pt_params *params)
{
    free(params->items);
    free(params->numbers);
    free(params->text);
    *params = (struct pt_params){0};
}

const char *pt_params_kind(const struct pt_params *params) { return params->text ? params->text + params->kind : ""; }

const char *pt_param_name(const struct pt_params *params, const struct pt_param *param)
{
    return params->text + param->name;
}

int pt_param_has(const struct pt_params *params, const struct pt_param *param, size_t count)
{
    if (param->count == count)
        return 1;
    pt_diag_fail(params->diag, param->loc, "parameter \"%s\" has %zu values (expected %zu)", pt_param_name(params, param),
                 param->count, count);
    return 0;
}

const char *pt_params_string_at(const struct pt_params *params, const struct pt_param *param, size_t i)
{
    return params->text + (size_t)params->numbers[param->first + i];
}

/* Tokens are quoted in messages up to this length. */
static int clip(size_t length) { return length < 40 ? (int)length : 40; }

struct declaration { /* offsets in the token's text */
    size_t type, type_end, name, name_end;
    int kind; /* enum pt_param_type; -1: unknown */
};

/* `"type name"` */
static struct declaration split_declaration(const struct pt_token *t)
{
    static const char blanks[] = " \t";
    struct declaration d = {.kind = -1, .name_end = t->length};
    d.type = strspn(t->text, blanks);
    d.type_end = d.type + strcspn(t->text + d.type, blanks);
    d.name = d.type_end + strspn(t->text + d.type_end, blanks);
    while (d.name_end > d.name && strchr(blanks, t->text[d.name_end - 1]))
        d.name_end--;
    const size_t length = d.type_end - d.type;
    for (size_t i = 0; i < sizeof type_names / sizeof type_names[0]; i++)
        if (strlen(type_names[i].name) == length && memcmp(type_names[i].name, t->text + d.type, length) == 0)
            d.kind = type_names[i].type;
    return d;
}

int pt_params_declares(const struct pt_token *t)
{
    const struct declaration d = split_declaration(t);
    return d.name < d.name_end;
}

static int read_declaration(struct pt_params *params, const struct pt_token *t, struct pt_param *out)
{
    const struct declaration d = split_declaration(t);
    if (d.name == d.name_end)
        return pt_diag_fail(params->diag, t->loc, "parameter \"%.*s\" (expected \"type name\")", clip(t->length), t->text);
    if (d.kind < 0)
        return pt_diag_fail(params->diag, t->loc,
                            "unknown parameter type \"%.*s\" (expected integer, float, point2, vector2, point3, vector3, "
                            "normal, bool, string, texture, rgb, spectrum or blackbody)",
                            clip(d.type_end - d.type), t->text + d.type);
    out->type = d.kind;
    out->loc = t->loc;
    out->name = keep(params, t->text + d.name, d.name_end - d.name);
    return params->diag->rc;
}

static int wants_text(int type) { return type == PT_PARAM_STRING || type == PT_PARAM_TEXTURE; }

static int add_number(struct pt_params *params, struct pt_param *p, double value)
{
    if (!pt_grow((void **)&params->numbers, &params->number_room, params->number_count, sizeof *params->numbers))
        return pt_diag_nomem(params->diag, "parameters");
    params->numbers[params->number_count++] = value;
    p->count++;
    return params->diag->rc;
}

static int add_string(struct pt_params *params, struct pt_param *p, const char *text, size_t length)
{
    p->is_text = 1;
    return add_number(params, p, (double)keep(params, text, length));
}

static const char *const bool_words[] = {"false", "true", NULL};

static int add_value(struct pt_params *params, struct pt_param *p, const struct pt_token *t)
{
    const char *name = pt_param_name(params, p);
    int text = t->kind == PT_TOKEN_STRING;
    if (p->type == PT_PARAM_BOOL) {
        const int word = base_word_index(bool_words, t->text, t->length);
        if (word >= 0)
            return add_number(params, p, word);
        return pt_diag_fail(params->diag, t->loc, "value of \"bool %s\" is \"%.*s\" (expected true or false)", name,
                            clip(t->length), t->text);
    }
    if (wants_text(p->type) != text && !(p->type == PT_PARAM_SPECTRUM && text))
        return pt_diag_fail(params->diag, t->loc, "value of \"%s\" is %s (expected %s)", name,
                            text ? "a string" : "not a string", text ? "a number" : "a quoted string");
    if (p->type == PT_PARAM_SPECTRUM && p->count > 0 && p->is_text != text)
        return pt_diag_fail(params->diag, t->loc, "\"spectrum %s\" mixes names and numbers", name);
    if (text)
        return add_string(params, p, t->text, t->length);
    double value;
    if (!pt_number_parse(t->text, t->length, &value))
        return pt_diag_fail(params->diag, t->loc, "value of \"%s\" is \"%.*s\" (expected a finite number)", name,
                            clip(t->length), t->text);
    return add_number(params, p, value);
}

/* Whether the values of `p` end before `t`: something else begins, of parameters without text also the next one. */
static int values_end(const struct pt_lexer *lexer, const struct pt_param *p, const struct pt_token *t)
{
    if (t->kind != PT_TOKEN_STRING || wants_text(p->type))
        return pt_lexer_has_ended(lexer, t);
    const struct declaration d = split_declaration(t);
    return d.kind >= 0 && d.name < d.name_end;
}

/* One value, or several in brackets. */
static int read_values(struct pt_params *params, struct pt_lexer *lexer, struct pt_param *p)
{
    struct pt_token t = pt_lexer_next(lexer);
    if (t.kind == PT_TOKEN_CLOSE || values_end(lexer, p, &t))
        return pt_diag_fail(params->diag, p->loc, "parameter \"%s\" has no value", pt_param_name(params, p));
    p->first = params->number_count;
    if (t.kind == PT_TOKEN_WORD || t.kind == PT_TOKEN_STRING)
        return add_value(params, p, &t);
    if (t.kind == PT_TOKEN_BAD)
        return params->diag->rc;
    struct pt_loc open = t.loc;
    for (;;) {
        t = pt_lexer_next(lexer);
        if (t.kind == PT_TOKEN_CLOSE)
            return 0;
        if (t.kind == PT_TOKEN_BAD)
            return params->diag->rc;
        if (t.kind == PT_TOKEN_OPEN || values_end(lexer, p, &t))
            return pt_diag_fail(params->diag, open, "values of \"%s\" have no closing ]", pt_param_name(params, p));
        int rc = add_value(params, p, &t);
        if (rc)
            return rc;
    }
}

static int add_param(struct pt_params *params, const struct pt_param *p)
{
    if (!pt_grow((void **)&params->items, &params->room, params->count, sizeof *params->items))
        return pt_diag_nomem(params->diag, "parameters");
    params->items[params->count++] = *p;
    return 0;
}

/* Of a parameter that is given again pbrt takes the last one, but pbrt-v3 a texture before a value. */
static void replace(struct pt_params *params, struct pt_param *before, const struct pt_param *again)
{
    const int stays = before->type == PT_PARAM_TEXTURE && again->type != PT_PARAM_TEXTURE;
    pt_diag_warn(params->diag, again->loc, "parameter \"%s\" is given twice: the %s counts", pt_param_name(params, again),
                 stays ? "texture" : "last one");
    if (!stays)
        *before = *again;
}

int pt_params_read(struct pt_params *params, struct pt_lexer *lexer)
{
    while (pt_lexer_peek(lexer).kind == PT_TOKEN_STRING) {
        struct pt_token t = pt_lexer_next(lexer);
        struct pt_param p = {0};
        int rc = read_declaration(params, &t, &p);
        if (!rc)
            rc = read_values(params, lexer, &p);
        if (rc)
            return rc;
        struct pt_param *before = pt_params_find(params, pt_param_name(params, &p));
        if (before)
            replace(params, before, &p);
        else if (add_param(params, &p) != 0)
            return params->diag->rc;
    }
    return params->diag->rc;
}

int pt_params_append(struct pt_params *params, const struct pt_params *from)
{
    for (size_t i = 0; i < from->count && !params->diag->rc; i++) {
        const struct pt_param *src = &from->items[i];
        const char *name = pt_param_name(from, src);
        if (pt_params_find(params, name))
            continue;
        struct pt_param p = *src;
        p.name = keep(params, name, strlen(name));
        p.inherited = 1;
        p.used = 0;
        p.count = 0;
        p.first = params->number_count;
        for (size_t k = 0; k < src->count && !params->diag->rc; k++) {
            const char *s = src->is_text ? pt_params_string_at(from, src, k) : NULL;
            if (s)
                add_string(params, &p, s, strlen(s));
            else
                add_number(params, &p, from->numbers[src->first + k]);
        }
        add_param(params, &p);
    }
    return params->diag->rc;
}

int pt_name_is_in(const char *names, const char *name)
{
    size_t n = strlen(name);
    if (n == 0 || strchr(name, ' '))
        return 0;
    for (const char *at = strstr(names, name); at; at = strstr(at + 1, name))
        if ((at == names || at[-1] == ' ') && (at[n] == ' ' || at[n] == '\0'))
            return 1;
    return 0;
}

void pt_params_ignore(struct pt_params *params, const char *names)
{
    for (size_t i = 0; i < params->count; i++)
        if (pt_name_is_in(names, pt_param_name(params, &params->items[i])))
            params->items[i].used = 1;
}

void pt_params_check_used(struct pt_params *params)
{
    for (size_t i = 0; i < params->count && !params->diag->rc; i++) {
        const struct pt_param *p = &params->items[i];
        const char *name = pt_param_name(params, p);
        if (p->used || p->inherited)
            continue;
        if (params->diag->is_v3 || pt_name_is_in(known_names, name))
            pt_diag_warn(params->diag, p->loc, "parameter \"%s\" has no effect on \"%s\"", name, pt_params_kind(params));
        else
            pt_diag_fail(params->diag, p->loc, "unknown parameter \"%s\" of \"%s\"", name, pt_params_kind(params));
    }
}

struct pt_loc pt_params_loc(const struct pt_params *params, const char *name)
{
    const struct pt_param *p = name ? pt_params_find(params, name) : NULL;
    return p ? p->loc : params->loc;
}

struct pt_param *pt_params_find(const struct pt_params *params, const char *name)
{
    for (size_t i = 0; i < params->count; i++)
        if (strcmp(params->text + params->items[i].name, name) == 0)
            return &params->items[i];
    return NULL;
}

static const char *type_name(int type)
{
    for (size_t i = 0; i < sizeof type_names / sizeof type_names[0]; i++)
        if (type_names[i].type == type)
            return type_names[i].name;
    return "?";
}

/* Finds, marks, and checks the type against a bit set; NULL when absent or wrong. */
static struct pt_param *take(struct pt_params *params, const char *name, unsigned types, const char *expected)
{
    struct pt_param *p = pt_params_find(params, name);
    if (!p)
        return NULL;
    p->used = 1;
    if ((types >> p->type & 1u) == 0) {
        pt_diag_fail(params->diag, p->loc, "parameter \"%s\" has type %s (expected %s)", name, type_name(p->type), expected);
        return NULL;
    }
    return p;
}

static struct pt_param *take_one(struct pt_params *params, const char *name, unsigned types, const char *expected)
{
    struct pt_param *p = take(params, name, types, expected);
    return p && pt_param_has(params, p, 1) ? p : NULL;
}

enum {
    NUMBERS = 1u << PT_PARAM_FLOAT | 1u << PT_PARAM_INTEGER,
    TRIPLES = 1u << PT_PARAM_POINT3 | 1u << PT_PARAM_VECTOR3 | 1u << PT_PARAM_NORMAL,
    PAIRS = 1u << PT_PARAM_POINT2 | 1u << PT_PARAM_VECTOR2
};

/* The scene is stored in float. */
static int fits_float(struct pt_params *params, const struct pt_param *p, double v)
{
    if (fabs(v) <= FLT_MAX)
        return 1;
    pt_diag_fail(params->diag, p->loc, "parameter \"%s\" has the value %g, too large for a float", pt_param_name(params, p),
                 v);
    return 0;
}

double pt_params_float(struct pt_params *params, const char *name, double fallback)
{
    const struct pt_param *p = take_one(params, name, NUMBERS, "float");
    if (!p || !fits_float(params, p, params->numbers[p->first]))
        return fallback;
    return params->numbers[p->first];
}

int pt_params_expect_in(struct pt_params *params, const char *name, double v, double low, double high)
{
    if (v >= low && v <= high)
        return 1;
    pt_params_fail(params, name, "parameter \"%s\" is %g (expected %g to %g)", name, v, low, high);
    return 0;
}

double pt_params_float_in(struct pt_params *params, const char *name, double fallback, double low, double high)
{
    double v = pt_params_float(params, name, fallback);
    return !pt_params_find(params, name) || pt_params_expect_in(params, name, v, low, high) ? v : fallback;
}

int pt_params_int_in(struct pt_params *params, const char *name, int fallback, int low, int high)
{
    const struct pt_param *p = take_one(params, name, NUMBERS, "integer");
    if (!p)
        return fallback;
    double v = params->numbers[p->first];
    if (v == floor(v) && v >= low && v <= high)
        return (int)v;
    pt_diag_fail(params->diag, p->loc, "parameter \"%s\" is %g (expected a whole number from %d to %d)", name, v, low, high);
    return fallback;
}

int pt_params_bool(struct pt_params *params, const char *name, int fallback)
{
    const struct pt_param *p = take_one(params, name, 1u << PT_PARAM_BOOL | 1u << PT_PARAM_STRING, "bool");
    if (!p)
        return fallback;
    if (!p->is_text)
        return params->numbers[p->first] != 0;
    const char *s = pt_params_string_at(params, p, 0);
    const int word = base_word_index(bool_words, s, strlen(s));
    if (word >= 0)
        return word;
    pt_diag_fail(params->diag, p->loc, "parameter \"%s\" is \"%.40s\" (expected true or false)", name, s);
    return fallback;
}

const char *pt_params_string(struct pt_params *params, const char *name, const char *fallback)
{
    const struct pt_param *p = take_one(params, name, 1u << PT_PARAM_STRING, "string");
    return p ? pt_params_string_at(params, p, 0) : fallback;
}

int pt_params_point(struct pt_params *params, const char *name, double xyz[3])
{
    const struct pt_param *p = take(params, name, TRIPLES, "point3 or vector3");
    if (!p || !pt_param_has(params, p, 3))
        return 0;
    for (int i = 0; i < 3; i++) {
        xyz[i] = params->numbers[p->first + (size_t)i];
        fits_float(params, p, xyz[i]);
    }
    return 1;
}

const double *pt_params_floats(struct pt_params *params, const char *name, size_t components, size_t *count)
{
    static const char *const expected[] = {"", "float", "point2 or float", "point3, vector3 or normal"};
    unsigned types = components == 1 ? NUMBERS : components == 2 ? PAIRS | NUMBERS : TRIPLES;
    const struct pt_param *p = take(params, name, types, expected[components]);
    *count = 0;
    if (!p || p->count == 0)
        return NULL;
    if (p->count % components != 0) {
        pt_diag_fail(params->diag, p->loc, "parameter \"%s\" has %zu values (expected a multiple of %zu)", name, p->count,
                     components);
        return NULL;
    }
    for (size_t i = 0; i < p->count; i++)
        if (!fits_float(params, p, params->numbers[p->first + i]))
            return NULL;
    *count = p->count / components;
    return params->numbers + p->first;
}

const double *pt_params_ints(struct pt_params *params, const char *name, size_t *count)
{
    const struct pt_param *p = take(params, name, NUMBERS, "integer");
    *count = 0;
    if (!p || p->count == 0)
        return NULL;
    for (size_t i = 0; i < p->count; i++) {
        double v = params->numbers[p->first + i];
        if (v != floor(v) || v < -2147483648.0 || v > 2147483647.0) {
            pt_diag_fail(params->diag, p->loc, "value %zu of \"%s\" is %g (expected a whole number)", i, name, v);
            return NULL;
        }
    }
    *count = p->count;
    return params->numbers + p->first;
}
