/* Materials of pbrt-v4: the scattering models by their tables, mix and interface. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/options.h"
#include "pbrt/build.h"
#include "shade/bsdf_models.h"

/* pbrt-v3's fit from perceived roughness to GGX alpha (TrowbridgeReitzDistribution::RoughnessToAlpha). */
static double v3_alpha(double roughness)
{
    double x = log(fmax(roughness, 1e-3));
    return 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)));
}

static void read_roughness(struct pt_builder *b, struct pt_params *p, const char *prefix, double fallback,
                           struct pt_input *u, struct pt_input *v)
{
    char name[48];
    const char *const suffix[3] = {"roughness", "uroughness", "vroughness"};
    struct pt_input values[3];
    for (int i = 0; i < 3; i++) {
        snprintf(name, sizeof name, "%s%s", prefix, suffix[i]);
        const struct pt_param *given = pt_params_find(p, name);
        values[i] = i > 0 && !given ? values[0] : pt_build_float_input(b, p, name, fallback);
        if (given && !values[i].texture && values[i].value.x < 0)
            pt_diag_fail(&b->diag, given->loc, "\"%s\" is %g (expected 0 or more)", name, (double)values[i].value.x);
    }
    *u = values[1];
    *v = values[2];
}

void pt_build_roughness(struct pt_builder *b, struct pt_params *p, double fallback, int v3_rule, struct pt_material *m)
{
    read_roughness(b, p, "", fallback, &m->roughness_u, &m->roughness_v);
    m->remap_roughness = pt_params_bool(p, "remaproughness", 1);
    if (!v3_rule || !m->remap_roughness)
        return;
    if (m->roughness_u.texture || m->roughness_v.texture) {
        pt_params_warn(p,
                       m->roughness_u.texture && pt_params_find(p, "uroughness")   ? "uroughness"
                       : m->roughness_v.texture && pt_params_find(p, "vroughness") ? "vroughness"
                                                                                   : "roughness",
                       "textured roughness is remapped by pbrt-v4's rule");
        return;
    }
    /* v3 keeps 0 as a smooth surface. */
    double u = (double)m->roughness_u.value.x, v = (double)m->roughness_v.value.x;
    u = u > 0 ? v3_alpha(u) : 0;
    v = v > 0 ? v3_alpha(v) : 0;
    m->roughness_u = pt_input_grey(u);
    m->roughness_v = pt_input_grey(v);
    m->remap_roughness = 0;
}

int32_t pt_build_bump(struct pt_builder *b, struct pt_params *p, const char *name)
{
    if (!pt_params_find(p, name))
        return 0;
    return pt_build_float_input(b, p, name, 0).texture; /* a constant displaces nothing */
}

static struct pt_material_info *info_of(const struct pt_builder *b, int32_t id)
{
    return (struct pt_material_info *)b->material_infos.items + id;
}

int32_t pt_build_material_named(struct pt_builder *b, struct pt_loc loc, const char *name)
{
    int32_t id = pt_names_get(&b->named_materials, name);
    if (id >= 0 && !info_of(b, id)->wanted)
        return id;
    pt_diag_fail(&b->diag, loc, "unknown material \"%s\" (expected one made by MakeNamedMaterial before)", name);
    return -1;
}

/* --- kinds ------------------------------------------------------------------------------------------------------------ */

struct pt_input pt_build_reflectance(struct pt_making *c, const char *name, float fallback)
{
    return pt_build_colour_input(c->b, c->p, name, PT_USE_REFLECTANCE, v3_splat(fallback));
}

static void read_metal(struct pt_making *c, const char *prefix)
{
    char eta[32], k[32];
    snprintf(eta, sizeof eta, "%seta", prefix);
    snprintf(k, sizeof k, "%sk", prefix);
    c->m->conductor_by_colour = pt_params_find(c->p, "reflectance") != NULL;
    if (c->m->conductor_by_colour)
        c->m->reflectance = pt_build_reflectance(c, "reflectance", 0.5f);
    else
        pt_build_conductor(c->b, c->p, eta, k, &c->m->eta_rgb.value, &c->m->k_rgb.value);
}

static void scale_colours(struct pt_making *c, const struct pt_bsdf_read *reads, double scale)
{
    for (const struct pt_bsdf_read *r = reads; r->kind != PT_READ_END; r++) {
        struct pt_input *in = (struct pt_input *)((char *)c->m + r->field);
        if (r->kind == PT_READ_COLOUR)
            *in = pt_input_product(c->b, *in, pt_input_grey(scale));
    }
}

/* By the table of the model, so that a new model needs no code here. */
static void read_model(struct pt_making *c, const struct pt_bsdf_model *model)
{
    for (const struct pt_bsdf_read *r = model->reads; r->kind != PT_READ_END; r++) {
        struct pt_input *in = (struct pt_input *)((char *)c->m + r->field);
        switch (r->kind) {
        case PT_READ_COLOUR: *in = pt_build_reflectance(c, r->name, (float)r->fallback); break;
        case PT_READ_NUMBER: *in = pt_build_float_input(c->b, c->p, r->name, r->fallback); break;
        case PT_READ_ROUGHNESS:
            read_roughness(c->b, c->p, r->name, r->fallback, &c->m->roughness_u, &c->m->roughness_v);
            c->m->remap_roughness = pt_params_bool(c->p, "remaproughness", 1);
            break;
        case PT_READ_BASE_ROUGHNESS:
            read_roughness(c->b, c->p, r->name, r->fallback, &c->m->base_roughness_u, &c->m->base_roughness_v);
            break;
        case PT_READ_INDEX: c->m->eta = (float)pt_build_index(c->b, c->p, r->name, r->fallback); break;
        case PT_READ_METAL: read_metal(c, r->name); break;
        case PT_READ_SCALE:
            scale_colours(c, model->reads, (double)(float)pt_params_float_in(c->p, r->name, r->fallback, 0, 1e6));
            break;
        case PT_READ_UNSUPPORTED:
            if (pt_params_find(c->p, r->name) && pt_params_float(c->p, r->name, 0) != 0)
                pt_params_warn(c->p, r->name, "%s of a %s material is ignored", r->name, model->words);
            break;
        default: pt_params_ignore(c->p, r->name);
        }
    }
    /* Index-matched: nothing is bent or reflected, and light sampling may look through it. */
    if (c->m->kind == PT_BSDF_DIELECTRIC && c->m->eta == 1)
        c->m->kind = PT_MATERIAL_INTERFACE;
}

/* The share of hits that count. */
static struct pt_input opacity_of(const struct pt_builder *b, int32_t id)
{
    int is_interface = ((struct pt_material *)b->materials.items)[id].kind == PT_MATERIAL_INTERFACE;
    return is_interface ? pt_input_grey(0) : info_of(b, id)->opacity;
}

static int is_all(struct pt_input in, float value) { return !in.texture && in.value.x == value; }

/* Materials that a mix may be made of: they are asked one within the other. */
enum { MAX_MIXED = 4096 };

static void count_mixed(const struct pt_material *all, const struct pt_material *m, int *left)
{
    if (m->kind != PT_MATERIAL_MIX || --*left <= 0)
        return;
    count_mixed(all, &all[m->mix_a], left);
    count_mixed(all, &all[m->mix_b], left);
}

void pt_build_mix_opacity(struct pt_making *c)
{
    struct pt_material *m = c->m;
    if (c->b->diag.rc)
        return;
    int left = MAX_MIXED;
    count_mixed(c->b->materials.items, m, &left);
    if (left <= 0) {
        pt_params_fail(c->p, NULL, "a mix of more than %d mixes", MAX_MIXED - 1);
        return;
    }
    struct pt_input a = opacity_of(c->b, m->mix_a), b = opacity_of(c->b, m->mix_b);
    if (is_all(a, 1) && is_all(b, 1))
        return;
    if (!m->mix_amount.texture)
        m->mix_amount.value = v3_least(v3_most(m->mix_amount.value, v3_splat(0)), v3_splat(1));
    struct pt_input both = pt_input_mix(c->b, a, b, m->mix_amount);
    if (is_all(both, 0)) {
        m->kind = PT_MATERIAL_INTERFACE;
        return;
    }
    /* Of the hits that count, a share is b's. */
    if (is_all(a, 0))
        m->mix_a = m->mix_b;
    else if (is_all(b, 0))
        m->mix_b = m->mix_a;
    else if (!both.texture && !b.texture && !m->mix_amount.texture)
        m->mix_amount = pt_input_grey((double)(m->mix_amount.value.x * b.value.x / both.value.x));
    else
        pt_params_warn(c->p, NULL, "textured opacity within a mix is taken as that of all of it");
    c->info->has_opacity = 1;
    c->info->opacity = both;
}

static void read_mix(struct pt_making *c)
{
    struct pt_param *list = pt_params_find(c->p, "materials");
    c->m->kind = PT_MATERIAL_MIX;
    if (!list || list->type != PT_PARAM_STRING || list->count != 2) {
        pt_params_fail(c->p, "materials", "mix needs \"string materials\" with two names");
        return;
    }
    list->used = 1;
    c->m->mix_a = pt_build_material_named(c->b, list->loc, pt_params_string_at(c->p, list, 0));
    c->m->mix_b = pt_build_material_named(c->b, list->loc, pt_params_string_at(c->p, list, 1));
    c->m->mix_amount = pt_build_float_input(c->b, c->p, "amount", 0.5);
    pt_build_mix_opacity(c);
}

/* 0: perhaps a kind of v3, or one that is not simulated. */
static int build_v4(struct pt_making *c)
{
    static const char *const interface[] = {"interface", "none", "", NULL};
    for (int32_t i = 0; i < PT_BSDF_COUNT; i++)
        if (strcmp(pt_bsdf_models[i].file_name, c->kind) == 0) {
            c->m->kind = i;
            read_model(c, &pt_bsdf_models[i]);
            return 1;
        }
    if (strcmp(c->kind, "mix") == 0 && !pt_params_find(c->p, "namedmaterial1")) { /* else v3's */
        read_mix(c);
        return 1;
    }
    if (base_word_index(interface, c->kind, strlen(c->kind)) < 0)
        return 0;
    c->m->kind = PT_MATERIAL_INTERFACE;
    return 1;
}

static int32_t add(struct pt_builder *b, const struct pt_material *m, const struct pt_material_info *info)
{
    if (pt_list_add(b, &b->material_infos, info) < 0)
        return -1;
    return pt_list_add(b, &b->materials, m);
}

static int32_t build(struct pt_builder *b, const char *kind, struct pt_params *p)
{
    struct pt_material m = {.kind = PT_BSDF_DIFFUSE, .eta = 1.5f};
    struct pt_material_info info = {.loc = p->loc, .opacity = pt_input_grey(1)};
    struct pt_making c = {b, p, kind, &m, &info};
    pt_params_ignore(p, "type");
    if (!build_v4(&c) && !pt_build_material_v3(&c)) {
        if (pt_diag_unknown(&b->diag, pt_params_loc(p, "type"), "material", kind,
                            "diffuse, coateddiffuse, conductor, dielectric, mix …", "matte in its stead") != 0)
            return -1;
        c.kind = "matte";
        pt_build_material_v3(&c);
    }
    if (!m.bump)
        m.bump = pt_build_bump(b, p, "displacement");
    struct pt_param *map = pt_params_find(p, "normalmap");
    if (map && map->type == PT_PARAM_TEXTURE)
        m.normal_map = pt_build_colour_input(b, p, "normalmap", PT_USE_UNBOUNDED, v3_splat(0)).texture;
    else if (map)
        m.normal_map = pt_build_image_texture(b, map->loc, pt_params_string(p, "normalmap", ""), "linear");
    pt_params_check_used(p);
    return !b->diag.rc ? add(b, &m, &info) : -1;
}

static void keep_params(struct pt_builder *b, int32_t id, const char *kind, const struct pt_params *p)
{
    struct pt_params *copy = calloc(1, sizeof *copy);
    if (!copy) {
        pt_diag_nomem(&b->diag, "materials");
        return;
    }
    info_of(b, id)->params = copy;
    pt_params_clear(copy, &b->diag, p->loc);
    copy->kind = pt_params_keep(copy, kind, strlen(kind));
    pt_params_append(copy, p);
}

int32_t pt_build_material(struct pt_builder *b, const char *kind, struct pt_params *p)
{
    int32_t id = build(b, kind, p);
    if (id >= 0 && b->is_v3)
        keep_params(b, id, kind, p);
    return id;
}

int32_t pt_build_named_material(struct pt_builder *b, struct pt_loc loc, const char *name, int32_t before)
{
    int32_t id = pt_names_get(&b->named_materials, name);
    if (id >= 0)
        return id;
    if (b->is_v3) { /* pbrt-v3 says so and goes on */
        pt_diag_warn(&b->diag, loc, "unknown material \"%s\": the one of before stays", name);
        return before;
    }
    const struct pt_material unmade = {.kind = PT_BSDF_DIFFUSE, .eta = 1.5f};
    struct pt_material_info info = {.loc = loc, .opacity = pt_input_grey(1)};
    info.wanted = pt_arena_strndup(&b->scene->arena, name, strlen(name));
    id = info.wanted ? add(b, &unmade, &info) : -1;
    if (id < 0 || pt_names_set(&b->named_materials, name, id) != 0)
        pt_diag_nomem(&b->diag, "materials");
    return b->diag.rc ? -1 : id;
}

int pt_build_make_named_material(struct pt_builder *b, const char *name, const char *kind, struct pt_params *p)
{
    const int32_t id = pt_build_material(b, kind, p), wanted = pt_names_get(&b->named_materials, name);
    if (id < 0 || b->diag.rc)
        return b->diag.rc;
    if (wanted < 0 || !info_of(b, wanted)->wanted)
        return pt_builder_name(b, &b->named_materials, name, id);
    struct pt_material *all = b->materials.items;
    /* The shapes that have it took it for a surface. */
    if (all[id].kind == PT_MATERIAL_INTERFACE || info_of(b, id)->has_opacity)
        return pt_diag_fail(&b->diag, info_of(b, wanted)->loc,
                            "material \"%s\" lets rays through (expected it to be made before)", name);
    all[wanted] = all[id];
    *info_of(b, wanted) = *info_of(b, id);
    b->materials.count = b->material_infos.count = (size_t)id; /* it is the last, and nobody has it */
    return 0;
}

int pt_build_materials_check(struct pt_builder *b)
{
    for (size_t i = 0; i < b->material_infos.count; i++) {
        const struct pt_material_info *info = info_of(b, (int32_t)i);
        if (info->wanted)
            return pt_diag_fail(&b->diag, info->loc, "unknown material \"%s\" (expected one made by MakeNamedMaterial)",
                                info->wanted);
    }
    return b->diag.rc;
}

/* What v3's materials know and its shapes do not. */
static const char of_materials[] =
    "Kd Ks Kr Kt amount anisotropic beta_m beta_n bsdffile bumpmap clearcoat clearcoatgloss color difftrans eta eumelanin "
    "flatness g index k metallic mfp namedmaterial1 namedmaterial2 opacity pheomelanin reflect remaproughness roughness "
    "scale "
    "scatterdistance sheen sheentint sigma sigma_a sigma_s spectrans speculartint thin transmit uroughness vroughness";

int32_t pt_build_shape_material(struct pt_builder *b, int32_t id, struct pt_params *shape)
{
    struct pt_params both = {0};
    size_t asked = 0, taken = 0;
    for (size_t i = 0; i < shape->count; i++)
        asked += (size_t)pt_name_is_in(of_materials, pt_param_name(shape, &shape->items[i]));
    if (asked == 0)
        return id;
    const struct pt_params *own = id >= 0 ? info_of(b, id)->params : NULL;
    const char *kind = own ? pt_params_kind(own) : "matte";
    pt_params_clear(&both, &b->diag, shape->loc);
    both.kind = pt_params_keep(&both, kind, strlen(kind));
    pt_params_append(&both, shape);
    if (own)
        pt_params_append(&both, own);
    int32_t made = b->diag.rc ? -1 : build(b, pt_params_kind(&both), &both);
    for (size_t i = 0; i < shape->count && made >= 0; i++) {
        const char *name = pt_param_name(shape, &shape->items[i]);
        if (!pt_name_is_in(of_materials, name) || !pt_params_find(&both, name)->used)
            continue;
        shape->items[i].used = 1;
        taken++;
    }
    pt_params_release(&both);
    if (b->diag.rc || taken > 0)
        return b->diag.rc ? -1 : made;
    b->materials.count = b->material_infos.count = (size_t)made; /* it is the last, and nobody has it */
    return id;
}

int32_t pt_build_default_material(struct pt_builder *b)
{
    if (b->default_material < 0) {
        struct pt_material m = {.kind = PT_BSDF_DIFFUSE, .eta = 1.5f};
        struct pt_material_info info = {.opacity = pt_input_grey(1)};
        m.reflectance = pt_input_grey(0.5);
        b->default_material = add(b, &m, &info);
    }
    return b->default_material;
}
