/* The pbrt directives: reads scene text and feeds the builder. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/options.h"
#include "pbrt/build.h"
#include "pbrt/spectra.h"

enum { NAME_MAX_BYTES = 1024, STATE_DEPTH = 1024 };

struct frame {
    struct pt_state state;
    char kind; /* 'A'ttribute, 'T'ransform, 'O'bject, 'I'mport */
    struct pt_loc loc;
    size_t named; /* pt_builder.name_undo.count when it was opened */
};

struct parser {
    struct pt_builder *b;
    struct pt_lexer lexer;
    struct pt_state state;
    struct pt_list frames;  /* struct frame */
    struct pt_list systems; /* struct pt_xform[2]: named coordinate systems */
    struct pt_names system_names;
    const struct directive *directive; /* the current one, its place, and what was read before it runs: */
    struct pt_loc loc;
    char name[NAME_MAX_BYTES];
    double numbers[16];
    struct pt_params params;
    struct pt_list attributes; /* struct pt_params *: owns what states point to */
    int in_world, ended;
};

/* Whose parameters are read before a directive runs, with those of an Attribute. */
enum directive_reads {
    READ_NOTHING,
    READ_PLAIN,
    READ_FOR_SHAPE, /* and on in the order of enum pt_attribute */
    READ_FOR_LIGHT,
    READ_FOR_MATERIAL,
    READ_FOR_MEDIUM
};

struct directive {
    const char *name;
    int (*run)(struct parser *p); /* NULL: the choice is ours */
    int in_world;                 /* refused before WorldBegin */
    /* what goes into parser.name, .numbers or .params first, or none of them: */
    const char *text; /* a quoted string, called so in errors */
    int numbers;      /* so many */
    enum directive_reads reads;
    /* of directives that share their function: */
    char block; /* frame.kind of what it opens or closes */
    enum pt_header header;
    int replaces; /* the transform instead of adding to it */
};

/* Messages with the place of the directive. */
#define pt_parser_fail(p, ...) pt_diag_fail(&(p)->b->diag, (p)->loc, __VA_ARGS__)
#define pt_parser_warn(p, ...) pt_diag_warn(&(p)->b->diag, (p)->loc, __VA_ARGS__)

/* Kind and parameter list into p->params, with those of Attribute `target` added (-1: none). */
static int read_entity(struct parser *p, int target)
{
    char kind[NAME_MAX_BYTES];
    struct pt_params *params = &p->params;
    int rc = pt_lexer_string(&p->lexer, "name of what follows", kind, sizeof kind);
    if (rc)
        return rc;
    pt_params_clear(params, &p->b->diag, p->loc, kind);
    rc = pt_params_read(params, &p->lexer);
    if (!rc && target >= 0 && p->state.attributes[target])
        rc = pt_params_append(params, p->state.attributes[target]);
    return rc;
}

/* Whether names that are given in such a block end with it. */
static int has_names(const struct parser *p, char kind) { return p->b->is_v3 && (kind == 'A' || kind == 'O'); }

/* Opens the directive's block. */
static int push(struct parser *p)
{
    const struct frame f = {p->state, p->directive->block, p->loc, p->b->name_undo.count};
    if (p->frames.count >= STATE_DEPTH)
        return pt_parser_fail(p, "blocks nested more than %d deep", STATE_DEPTH);
    if (pt_list_add(p->b, &p->frames, &f) < 0)
        return p->b->diag.rc;
    p->b->name_scopes += has_names(p, f.kind);
    return 0;
}

static const char *begin_name(char kind)
{
    return kind == 'A' ? "AttributeBegin" : kind == 'T' ? "TransformBegin" : kind == 'O' ? "ObjectBegin" : "Import";
}

/* The block that was opened last and is still open, or NULL. */
static const struct frame *innermost(const struct parser *p)
{
    return p->frames.count > 0 ? (const struct frame *)p->frames.items + p->frames.count - 1 : NULL;
}

static int fail_open(struct parser *p)
{
    const struct frame *top = innermost(p);
    const int elsewhere = strcmp(top->loc.file, p->loc.file) != 0;
    return pt_parser_fail(p, "%s where the %s of %s%s%d is still open", p->directive->name, begin_name(top->kind),
                          elsewhere ? top->loc.file : "line ", elsewhere ? ":" : "", top->loc.line);
}

/* In pbrt-v3 an object is an attribute block, too, and the end of either closes the one that was opened last. */
static int closes(const struct parser *p, char kind, char opened)
{
    return kind == opened || (has_names(p, kind) && has_names(p, opened));
}

/* Closes it. */
static int pop(struct parser *p)
{
    const char kind = p->directive->block, *end_name = p->directive->name;
    const struct frame *top = innermost(p);
    if (!top && p->b->is_v3) { /* pbrt-v3 says so and goes on */
        pt_parser_warn(p, "%s without %s is ignored", end_name, begin_name(kind));
        return p->b->diag.rc;
    }
    if (!top || top->kind == 'I')
        return pt_parser_fail(p, "%s without %s", end_name, begin_name(kind));
    if (!closes(p, kind, top->kind))
        return fail_open(p);
    /* In v4 TransformBegin is an old name of AttributeBegin, which belongs into the world. */
    if (kind == 'T' && (p->b->is_v3 || !p->in_world)) {
        memcpy(p->state.ctm, top->state.ctm, sizeof p->state.ctm);
        p->state.active = top->state.active;
    } else {
        p->state = top->state;
    }
    if (has_names(p, kind)) {
        pt_builder_forget_names(p->b, top->named);
        p->b->name_scopes--;
    }
    p->frames.count--;
    return 0;
}

/* Names a coordinate system. */
static int save_system(struct parser *p, const char *name, const struct pt_xform ctm[2])
{
    int32_t id = pt_list_add(p->b, &p->systems, (const struct pt_xform(*)[2])ctm);
    if (id < 0 || pt_names_set(&p->system_names, name, id) != 0)
        return pt_diag_nomem(&p->b->diag, "coordinate systems");
    return 0;
}

/* A transform may flatten what comes (Scale 0 hides things in animations): who needs its inverse sees to that. */
static int concat(struct parser *p, struct pt_xform t)
{
    for (int i = 0; i < 2; i++) {
        if ((p->state.active >> i & 1) == 0)
            continue;
        struct pt_xform next = p->directive->replaces ? t : pt_xform_mul(p->state.ctm[i], t);
        for (int k = 0; k < 12; k++)
            if (!isfinite(next.m[k / 4][k % 4]))
                return pt_parser_fail(p, "the transform is out of range (expected finite numbers)");
        p->state.ctm[i] = next;
    }
    return 0;
}

static int do_identity(struct parser *p) { return concat(p, pt_xform_identity()); }

static int do_translate(struct parser *p)
{
    return concat(p, pt_xform_translate(p->numbers[0], p->numbers[1], p->numbers[2]));
}

static int do_scale(struct parser *p) { return concat(p, pt_xform_scale(p->numbers[0], p->numbers[1], p->numbers[2])); }

static int do_rotate(struct parser *p)
{
    const double *v = p->numbers;
    if (v[1] == 0 && v[2] == 0 && v[3] == 0)
        return pt_parser_fail(p, "Rotate about the axis 0 0 0 (expected a direction)");
    return concat(p, pt_xform_rotate(v[0], v[1], v[2], v[3]));
}

static int do_look_at(struct parser *p)
{
    struct pt_xform t;
    if (!pt_xform_look_at(p->numbers, p->numbers + 3, p->numbers + 6, &t))
        return pt_parser_fail(p, "LookAt is degenerate (expected eye and target apart, up not along the view)");
    return concat(p, t);
}

static int do_transform(struct parser *p)
{
    struct pt_xform t;
    if (!pt_xform_from16(p->numbers, &t))
        return pt_parser_fail(p, "%s is not affine (expected 0 0 0 1 as every fourth number)", p->directive->name);
    return concat(p, t);
}

static int do_coordinate_system(struct parser *p) { return save_system(p, p->name, p->state.ctm); }

static int do_coord_sys_transform(struct parser *p)
{
    const int32_t id = pt_names_get(&p->system_names, p->name);
    if (id < 0) { /* pbrt says so and goes on */
        pt_parser_warn(p, "unknown coordinate system \"%s\": the transform stays", p->name);
        return p->b->diag.rc;
    }
    const struct pt_xform(*systems)[2] = p->systems.items;
    /* Of both times, whatever ActiveTransform says: so pbrt does. */
    memcpy(p->state.ctm, systems[id], sizeof p->state.ctm);
    return 0;
}

static int do_active_transform(struct parser *p)
{
    struct pt_token t = pt_lexer_next(&p->lexer);
    /* by the bits of pt_state.active, from 1 on */
    static const char *const words[] = {"StartTime", "EndTime", "All", NULL};
    const int word = base_word_index(words, t.text, t.length);
    if (word < 0)
        return pt_diag_fail(&p->b->diag, pt_lexer_fault(&p->lexer, &t), "ActiveTransform needs StartTime, EndTime or All");
    p->state.active = (unsigned)word + 1;
    return 0;
}

static int do_transform_times(struct parser *p)
{
    if (p->in_world || !(p->numbers[1] >= p->numbers[0]))
        return pt_parser_fail(p, "TransformTimes must come before WorldBegin, start before end");
    memcpy(p->b->transform_times, p->numbers, sizeof p->b->transform_times);
    return 0;
}

static int do_object_begin(struct parser *p)
{
    int rc = pt_build_object_begin(p->b, p->name, p->loc);
    return rc ? rc : push(p);
}

static int do_object_end(struct parser *p)
{
    if (p->b->open_object < 0)
        return pt_parser_fail(p, "ObjectEnd without ObjectBegin");
    int rc = pop(p);
    if (!rc)
        p->b->open_object = -1;
    return rc;
}

static int do_object_instance(struct parser *p) { return pt_build_instance(p->b, p->name, p->loc); }

static int do_reverse_orientation(struct parser *p)
{
    p->state.reverse_orientation = !p->state.reverse_orientation;
    return 0;
}

static int do_header(struct parser *p)
{
    static const char *const names[PT_HEADER_COUNT] = {"Film", "PixelFilter", "Sampler", "Integrator", "Camera"};
    const enum pt_header which = p->directive->header;
    if (p->in_world)
        return pt_parser_fail(p, "%s after WorldBegin", names[which]);
    int rc = read_entity(p, -1);
    if (rc)
        return rc;
    struct pt_params old = p->b->header[which];
    p->b->header[which] = p->params;
    p->params = old;
    return 0;
}

static int do_film(struct parser *p)
{
    int rc = do_header(p);
    if (!rc && strcmp(pt_params_kind(&p->b->header[PT_HEADER_FILM]), "image") == 0)
        p->b->is_v3 = p->b->diag.is_v3 = 1;
    return rc;
}

static int do_camera(struct parser *p)
{
    struct pt_xform inverse[2];
    int rc = do_header(p);
    if (rc)
        return rc;
    memcpy(p->b->camera_ctm, p->state.ctm, sizeof p->state.ctm);
    p->b->camera_medium = p->state.medium_out;
    for (int i = 0; i < 2; i++)
        if (!pt_xform_invert(&p->state.ctm[i], &inverse[i]))
            return pt_parser_fail(p, "the camera's transform is singular");
    return save_system(p, "camera", inverse);
}

static int do_world_begin(struct parser *p)
{
    if (p->in_world)
        return pt_parser_fail(p, "WorldBegin occurs twice");
    if (innermost(p))
        return fail_open(p);
    p->in_world = 1;
    p->state.ctm[0] = p->state.ctm[1] = pt_xform_identity();
    p->state.active = 3;
    int rc = save_system(p, "world", p->state.ctm);
    return rc ? rc : pt_build_header(p->b);
}

static int do_world_end(struct parser *p)
{
    p->ended = 1;
    return innermost(p) && !p->b->is_v3 ? fail_open(p) : 0;
}

static int do_shape(struct parser *p)
{
    const int32_t material = p->state.material;
    if (p->b->is_v3)
        p->state.material = pt_build_shape_material(p->b, material, &p->params);
    int rc = p->b->diag.rc ? p->b->diag.rc : pt_build_shape(p->b, &p->params);
    p->state.material = material;
    return rc;
}

static int do_light_source(struct parser *p) { return pt_build_light(p->b, &p->params); }

static int do_area_light_source(struct parser *p) { return pt_build_area_light(p->b, &p->params, &p->state.area); }

static int do_material(struct parser *p)
{
    p->state.material = pt_build_material(p->b, pt_params_kind(&p->params), &p->params);
    return p->b->diag.rc;
}

static int do_make_named_material(struct parser *p)
{
    const char *name = pt_params_kind(&p->params), *type = pt_params_string(&p->params, "type", NULL);
    if (!type)
        return pt_parser_fail(p, "MakeNamedMaterial \"%s\" without \"string type\"", name);
    return pt_build_make_named_material(p->b, name, type, &p->params);
}

static int do_named_material(struct parser *p)
{
    p->state.material = pt_build_named_material(p->b, p->loc, p->name, p->state.material);
    return p->b->diag.rc;
}

static int do_texture(struct parser *p)
{
    char type[64];
    int rc = pt_lexer_string(&p->lexer, "texture type", type, sizeof type);
    if (!rc)
        rc = read_entity(p, PT_ATTR_TEXTURE);
    return rc ? rc : pt_build_texture(p->b, p->name, type, &p->params);
}

static int do_make_named_medium(struct parser *p) { return pt_build_medium(p->b, &p->params); }

static int do_medium_interface(struct parser *p)
{
    char outside[NAME_MAX_BYTES];
    int rc = 0;
    strcpy(outside, p->name);
    if (pt_lexer_peek(&p->lexer).kind == PT_TOKEN_STRING)
        rc = pt_lexer_string(&p->lexer, "medium name", outside, sizeof outside);
    if (rc)
        return rc;
    p->state.medium_in = pt_build_medium_ref(p->b, p->name, p->loc);
    p->state.medium_out = pt_build_medium_ref(p->b, outside, p->loc);
    return p->b->diag.rc;
}

static int do_attribute(struct parser *p)
{
    /* in the order of enum pt_attribute */
    static const char *const targets[] = {"shape", "light", "material", "medium", "texture", NULL};
    const char *kind = pt_params_kind(&p->params);
    const int target = base_word_index(targets, kind, strlen(kind));
    if (target < 0)
        return pt_parser_fail(p, "Attribute \"%s\" (expected shape, light, material, medium or texture)", kind);
    for (size_t i = 0; i < p->params.count; i++)
        p->params.items[i].colour_space = 1 + p->state.colour_space;
    struct pt_params *copy = calloc(1, sizeof *copy);
    if (!copy || pt_list_add(p->b, &p->attributes, &copy) < 0) {
        free(copy);
        return pt_diag_nomem(&p->b->diag, "attributes");
    }
    pt_params_clear(copy, &p->b->diag, p->loc, targets[target]);
    pt_params_append(copy, &p->params);
    if (p->state.attributes[target]) /* new values win over those set before */
        pt_params_append(copy, p->state.attributes[target]);
    p->state.attributes[target] = copy;
    return p->b->diag.rc;
}

static int do_color_space(struct parser *p)
{
    char name[64];
    int rc = pt_lexer_string(&p->lexer, "colour space", name, sizeof name);
    if (rc)
        return rc;
    int space = pt_colour_space_named(name);
    if (space < 0)
        return pt_parser_fail(p, "unknown colour space \"%s\" (expected srgb, dci-p3, rec2020 or aces2065-1)", name);
    p->state.colour_space = space;
    return 0;
}

/* pbrt-v4's: a name, of which it ignores case, '-' and '_', and one value. */
static int read_option(struct parser *p)
{
    static const char known[] = "disablepixeljitter disabletexturefiltering disablewavelengthjitter displacementedgescale "
                                "forcediffuse msereferenceimage msereferenceout pixelstats rendercoordsys wavefront";
    char name[NAME_MAX_BYTES], plain[NAME_MAX_BYTES] = "";
    size_t n = 0;
    int rc = pt_lexer_string(&p->lexer, "option", name, sizeof name);
    if (rc)
        return rc;
    for (const char *at = name; *at; at++)
        if (*at != '-' && *at != '_' && *at != ' ' && *at != '\t')
            plain[n++] = *at >= 'A' && *at <= 'Z' ? (char)(*at - 'A' + 'a') : *at;
    if (strcmp(plain, "seed") == 0)
        return pt_lexer_option(&p->lexer, name, &p->b->defaults->integrator.seed);
    if (!pt_name_is_in(known, plain))
        return pt_parser_fail(p, "unknown option \"%.40s\"", name);
    rc = pt_lexer_option(&p->lexer, name, NULL);
    if (!rc)
        pt_parser_warn(p, "Option \"%s\" is ignored", name);
    return rc ? rc : p->b->diag.rc;
}

static int do_option(struct parser *p)
{
    const struct pt_token first = pt_lexer_peek(&p->lexer);
    if (first.kind != PT_TOKEN_STRING || !pt_params_declares(&first)) /* v4 has the name alone */
        return read_option(p);
    pt_params_clear(&p->params, &p->b->diag, p->loc, "");
    int rc = pt_params_read(&p->params, &p->lexer);
    for (size_t i = 0; i < p->params.count && !rc; i++) {
        const char *name = pt_param_name(&p->params, &p->params.items[i]);
        if (strcmp(name, "seed") == 0)
            p->b->defaults->integrator.seed = (uint32_t)pt_params_int_in(&p->params, "seed", 0, 0, 2147483647);
        else
            pt_diag_warn(&p->b->diag, p->params.items[i].loc, "Option \"%s\" is ignored", name);
        rc = p->b->diag.rc;
    }
    return rc;
}

static int do_include(struct parser *p)
{
    char path[2 * NAME_MAX_BYTES];
    const int scoped = p->directive->block == 'I';
    pt_builder_path(p->b, p->name, path, sizeof path);
    int rc = scoped ? push(p) : 0;
    return rc ? rc : pt_lexer_include(&p->lexer, path, p->loc, scoped);
}

static const struct directive directives[] = {
    {"Shape", do_shape, .in_world = 1, .reads = READ_FOR_SHAPE},
    {"AttributeBegin", push, .in_world = 1, .block = 'A'},
    {"AttributeEnd", pop, .block = 'A'},
    {"ObjectInstance", do_object_instance, .in_world = 1, .text = "object name"},
    {"NamedMaterial", do_named_material, .in_world = 1, .text = "material name"},
    {"Material", do_material, .in_world = 1, .reads = READ_FOR_MATERIAL},
    {"MakeNamedMaterial", do_make_named_material, .in_world = 1, .reads = READ_FOR_MATERIAL},
    {"Texture", do_texture, .in_world = 1, .text = "texture name"},
    {"ObjectBegin", do_object_begin, .in_world = 1, .text = "object name", .block = 'O'},
    {"ObjectEnd", do_object_end, .block = 'O'},
    {"Include", do_include, .text = "file name"},
    {"Import", do_include, .in_world = 1, .text = "file name", .block = 'I'},
    {"LightSource", do_light_source, .in_world = 1, .reads = READ_FOR_LIGHT},
    {"AreaLightSource", do_area_light_source, .in_world = 1, .reads = READ_FOR_LIGHT},
    {"TransformBegin", push, .block = 'T'},
    {"TransformEnd", pop, .block = 'T'},
    {.name = "ReverseOrientation", .run = do_reverse_orientation},
    {"MakeNamedMedium", do_make_named_medium, .reads = READ_FOR_MEDIUM},
    {"MediumInterface", do_medium_interface, .text = "medium name"},
    {"Attribute", do_attribute, .reads = READ_PLAIN},
    {.name = "ColorSpace", .run = do_color_space},
    {.name = "Option", .run = do_option},
    {"Film", do_film, .header = PT_HEADER_FILM},
    {"Camera", do_camera, .header = PT_HEADER_CAMERA},
    {"Sampler", do_header, .header = PT_HEADER_SAMPLER},
    {"Integrator", do_header, .header = PT_HEADER_INTEGRATOR},
    {"SurfaceIntegrator", do_header, .header = PT_HEADER_INTEGRATOR},
    {"VolumeIntegrator", .reads = READ_PLAIN},
    {"Renderer", .reads = READ_PLAIN},
    {"PixelFilter", do_header, .header = PT_HEADER_FILTER},
    {"Accelerator", .reads = READ_PLAIN},
    {.name = "WorldBegin", .run = do_world_begin},
    {"WorldEnd", do_world_end, .in_world = 1},
    {"Transform", do_transform, .numbers = 16, .replaces = 1},
    {"ConcatTransform", do_transform, .numbers = 16},
    {"Translate", do_translate, .numbers = 3},
    {"Rotate", do_rotate, .numbers = 4},
    {"Scale", do_scale, .numbers = 3},
    {"Identity", do_identity, .replaces = 1},
    {"LookAt", do_look_at, .numbers = 9},
    {"CoordinateSystem", do_coordinate_system, .text = "name"},
    {"CoordSysTransform", do_coord_sys_transform, .text = "name"},
    {.name = "ActiveTransform", .run = do_active_transform},
    {"TransformTimes", do_transform_times, .numbers = 2},
};

static const struct directive *find_directive(const struct pt_token *t)
{
    for (size_t i = 0; i < sizeof directives / sizeof directives[0] && t->kind == PT_TOKEN_WORD; i++)
        if (strlen(directives[i].name) == t->length && memcmp(directives[i].name, t->text, t->length) == 0)
            return &directives[i];
    return NULL;
}

static int is_directive(const struct pt_token *t) { return find_directive(t) != NULL; }

static int run_directive(struct parser *p, const struct pt_token *t)
{
    p->loc = t->loc;
    const struct directive *d = find_directive(t);
    if (!d)
        return pt_diag_fail(&p->b->diag, t->loc, "unknown directive \"%.*s\" (expected Shape, Material, AttributeBegin …)",
                            t->length < 40 ? (int)t->length : 40, t->text);
    if (d->in_world && !p->in_world)
        return pt_diag_fail(&p->b->diag, t->loc, "%s before WorldBegin", d->name);
    p->directive = d;
    int rc = d->text                    ? pt_lexer_string(&p->lexer, d->text, p->name, sizeof p->name)
             : d->numbers > 0           ? pt_lexer_numbers(&p->lexer, d->name, d->numbers, p->numbers)
             : d->reads != READ_NOTHING ? read_entity(p, (int)d->reads - READ_FOR_SHAPE)
                                        : 0;
    return rc || !d->run ? rc : d->run(p);
}

static int finish(struct parser *p, struct pt_loc loc)
{
    const struct frame *top = innermost(p);
    if (p->b->open_object >= 0 || (top && !p->b->is_v3))
        return pt_diag_fail(&p->b->diag, top ? top->loc : loc, "%s is never closed", begin_name(top ? top->kind : 'O'));
    if (top) /* pbrt-v3 says so and renders */
        pt_diag_warn(&p->b->diag, top->loc, "%s is never closed", begin_name(top->kind));
    if (!p->in_world)
        return pt_diag_fail(&p->b->diag, loc, "the file ends without WorldBegin");
    return pt_builder_check(p->b);
}

static int run(struct parser *p)
{
    for (;;) {
        struct pt_token t = pt_lexer_next(&p->lexer);
        if (t.kind == PT_TOKEN_END)
            return finish(p, t.loc);
        if (t.kind == PT_TOKEN_BAD)
            return p->b->diag.rc;
        if (t.kind == PT_TOKEN_FILE_END) {
            const struct frame *top = innermost(p);
            if (top->kind != 'I')
                return pt_diag_fail(&p->b->diag, top->loc, "%s is never closed in its file", begin_name(top->kind));
            p->state = top->state;
            p->frames.count--;
            continue;
        }
        if (p->ended) {
            pt_diag_warn(&p->b->diag, t.loc, "text after WorldEnd is ignored");
            return finish(p, t.loc);
        }
        int rc = run_directive(p, &t);
        if (rc || p->b->diag.rc)
            return rc ? rc : p->b->diag.rc;
    }
}

int pt_pbrt_read(struct pt_builder *b, const char *path)
{
    struct parser p = {.b = b, .state = {.active = 3, .material = -1, .medium_in = -1, .medium_out = -1}};
    p.lexer =
        (struct pt_lexer){.source = b->source, .diag = &b->diag, .arena = &b->scene->arena, .is_directive = is_directive};
    p.state.ctm[0] = p.state.ctm[1] = pt_xform_identity();
    b->state = &p.state;
    int rc = pt_lexer_include(&p.lexer, path, (struct pt_loc){NULL, 0, 0}, 0);
    if (!rc)
        rc = run(&p);
    struct pt_params **attributes = p.attributes.items;
    for (size_t i = 0; i < p.attributes.count; i++) {
        pt_params_release(attributes[i]);
        free(attributes[i]);
    }
    free(p.attributes.items);
    free(p.frames.items);
    free(p.systems.items);
    pt_names_release(&p.system_names);
    pt_params_release(&p.params);
    pt_lexer_release(&p.lexer);
    b->state = NULL;
    return rc;
}
