/* Materials: pbrt-v4's by the tables of the scattering models, pbrt-v3's in their terms, and what stands in for the rest. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/options.h"
#include "pbrt/build.h"
#include "shade/bsdf.h"
#include "shade/phase_function.h"

/* A material while its parameters are read. */
struct making {
    struct pt_builder *b;
    struct pt_params *p;
    const char *kind;
    struct pt_material *m;
    struct pt_material_info *info;
};

/* pbrt-v3's fit from perceived roughness to GGX alpha (TrowbridgeReitzDistribution::RoughnessToAlpha). It keeps 0
 * as a smooth surface. */
static double v3_alpha(double roughness)
{
    double x = log(fmax(roughness, 1e-3));
    return roughness <= 0 ? 0 : 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)));
}

static void read_roughness(struct making *c, const char *prefix, double fallback, struct pt_input *u, struct pt_input *v)
{
    char name[48];
    const char *const suffix[3] = {"roughness", "uroughness", "vroughness"};
    struct pt_input values[3];
    for (int i = 0; i < 3; i++) {
        snprintf(name, sizeof name, "%s%s", prefix, suffix[i]);
        const struct pt_param *given = pt_params_find(c->p, name);
        values[i] = i > 0 && !given ? values[0] : pt_build_float_input(c->b, c->p, name, fallback);
        if (given && !values[i].texture && values[i].value.x < 0)
            pt_diag_fail(&c->b->diag, given->loc, "\"%s\" is %g (expected 0 or more)", name, (double)values[i].value.x);
    }
    *u = values[1];
    *v = values[2];
}

static void read_surface_roughness(struct making *c, const char *prefix, double fallback, int v3_rule)
{
    struct pt_params *p = c->p;
    struct pt_material *m = c->m;
    read_roughness(c, prefix, fallback, &m->roughness_u, &m->roughness_v);
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
    m->roughness_u = pt_input_grey(v3_alpha((double)m->roughness_u.value.x));
    m->roughness_v = pt_input_grey(v3_alpha((double)m->roughness_v.value.x));
    m->remap_roughness = 0;
}

/* Number of the displacement texture, 0 = none. */
static int32_t read_bump(struct making *c, const char *name)
{
    return pt_build_float_input(c->b, c->p, name, 0).texture; /* a constant displaces nothing */
}

static struct pt_material_info *info_of(const struct pt_builder *b, int32_t id)
{
    return (struct pt_material_info *)b->material_infos.items + id;
}

/* A material of a mix, made before; else matte, as in pbrt-v3, or -1 after a failure. */
static int32_t find_mixed(struct pt_builder *b, struct pt_loc loc, const char *name, int or_matte)
{
    int32_t id = pt_names_get(&b->named_materials, name);
    if (id >= 0 && !info_of(b, id)->wanted.name)
        return id;
    if (or_matte) {
        pt_diag_warn(&b->diag, loc, "unknown material \"%s\": matte in its stead", name);
        return pt_build_default_material(b);
    }
    pt_diag_fail(&b->diag, loc, "unknown material \"%s\" (expected one made by MakeNamedMaterial before)", name);
    return -1;
}

/* May be textured; the fallback, grey, when absent. */
static struct pt_input read_reflectance(struct making *c, const char *name, float fallback)
{
    return pt_build_colour_input(c->b, c->p, name, PT_USE_REFLECTANCE, v3_splat(fallback));
}

static void read_metal(struct making *c, const char *prefix)
{
    char eta[32], k[32];
    snprintf(eta, sizeof eta, "%seta", prefix);
    snprintf(k, sizeof k, "%sk", prefix);
    c->m->conductor_by_colour = pt_params_find(c->p, "reflectance") != NULL;
    if (c->m->conductor_by_colour)
        c->m->reflectance = read_reflectance(c, "reflectance", 0.5f);
    else
        pt_build_conductor(c->b, c->p, eta, k, &c->m->eta_rgb.value, &c->m->k_rgb.value);
}

static void scale_colours(struct making *c, const struct pt_bsdf_read *reads, double scale)
{
    for (const struct pt_bsdf_read *r = reads; r->kind != PT_READ_END; r++) {
        struct pt_input *in = (struct pt_input *)((char *)c->m + r->field);
        if (r->kind == PT_READ_COLOUR)
            *in = pt_input_product(c->b, *in, pt_input_grey(scale));
    }
}

/* By the table of the model, so that a new model needs no code here. */
static void read_model(struct making *c, const struct pt_bsdf_model *model)
{
    for (const struct pt_bsdf_read *r = model->reads; r->kind != PT_READ_END; r++) {
        struct pt_input *in = (struct pt_input *)((char *)c->m + r->field);
        switch (r->kind) {
        case PT_READ_COLOUR: *in = read_reflectance(c, r->name, (float)r->fallback); break;
        case PT_READ_NUMBER: *in = pt_build_float_input(c->b, c->p, r->name, r->fallback); break;
        case PT_READ_ASYMMETRY:
            *in = pt_build_float_input(c->b, c->p, r->name, r->fallback);
            if (!in->texture)
                pt_params_expect_in(c->p, r->name, (double)in->value.x, -PT_PHASE_G_MAX, PT_PHASE_G_MAX);
            break;
        case PT_READ_ROUGHNESS: read_surface_roughness(c, r->name, r->fallback, 0); break;
        case PT_READ_BASE_ROUGHNESS:
            read_roughness(c, r->name, r->fallback, &c->m->base_roughness_u, &c->m->base_roughness_v);
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

/* When its materials and amount are read: what of them lets rays through becomes its opacity. */
static void set_mix_opacity(struct making *c)
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

static void read_mix(struct making *c)
{
    struct pt_param *list = pt_params_find(c->p, "materials");
    c->m->kind = PT_MATERIAL_MIX;
    if (!list || list->type != PT_PARAM_STRING || list->count != 2) {
        pt_params_fail(c->p, "materials", "mix needs \"string materials\" with two names");
        return;
    }
    list->used = 1;
    c->m->mix_a = find_mixed(c->b, list->loc, pt_params_string_at(c->p, list, 0), 0);
    c->m->mix_b = find_mixed(c->b, list->loc, pt_params_string_at(c->p, list, 1), 0);
    c->m->mix_amount = pt_build_float_input(c->b, c->p, "amount", 0.5);
    set_mix_opacity(c);
}

/* 0: perhaps a kind of v3, or one that is not simulated. */
static int build_v4(struct making *c)
{
    static const char *const interface[] = {"interface", "none", "", NULL};
    const struct pt_bsdf_model *model = pt_row(pt_bsdf_models, c->kind);
    if (model) {
        c->m->kind = (int32_t)(model - pt_bsdf_models);
        read_model(c, model);
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

/* Kinds of v3 in terms of v4's. */

static int is_black(struct pt_input in) { return !in.texture && v3_is_black(in.value); }
static int is_clear(struct pt_input in) { return !in.texture && v3_luminance(in.value) >= 0.999f; }

static void clear_coat(struct making *c)
{
    c->m->kind = PT_BSDF_COATED_DIFFUSE;
    c->m->thickness = pt_input_grey(0.01);
}

/* Metal by its colour instead of an index. */
static void coloured_metal(struct making *c, struct pt_input colour)
{
    c->m->kind = PT_BSDF_CONDUCTOR;
    c->m->conductor_by_colour = 1;
    c->m->reflectance = colour;
}

static double index_of(struct making *c, double fallback)
{
    return pt_build_index(c->b, c->p, pt_params_find(c->p, "index") ? "index" : "eta", fallback);
}

static void make_matte(struct making *c)
{
    c->m->reflectance = read_reflectance(c, "Kd", 0.5f);
    struct pt_input sigma = pt_build_float_input(c->b, c->p, "sigma", 0);
    if (sigma.texture || sigma.value.x != 0)
        pt_params_warn(c->p, "sigma", "sigma of a matte material is ignored: plain diffuse");
}

/* Ks of these v3 models is the strength of the coat; the coat here is glass of index 1.5 (as pbrt-v4's own upgrade does). */
static void make_plastic(struct making *c)
{
    int substrate = strcmp(c->kind, "substrate") == 0;
    c->m->reflectance = read_reflectance(c, "Kd", substrate ? 0.5f : 0.25f);
    struct pt_input ks = read_reflectance(c, "Ks", substrate ? 0.5f : 0.25f);
    read_surface_roughness(c, "", 0.1, 1);
    if (is_black(ks))
        return;
    clear_coat(c);
}

/* A share that v3 gives as a colour is one number here. */
static struct pt_input read_share(struct making *c, const char *name, float fallback)
{
    struct pt_input in = read_reflectance(c, name, fallback);
    if (in.texture)
        return pt_input_luminance(c->b, in);
    if (in.value.x != in.value.y || in.value.y != in.value.z)
        pt_params_warn(c->p, name, "a coloured %s is taken as a grey one", name);
    return pt_input_grey((double)v3_luminance(in.value));
}

/* A sum of four lobes there. Here it is the one that stands alone, or else a coated diffuse surface. */
static void make_uber(struct making *c)
{
    struct pt_input kd = read_reflectance(c, "Kd", 0.25f), ks = read_reflectance(c, "Ks", 0.25f),
                    kr = read_reflectance(c, "Kr", 0), kt = read_reflectance(c, "Kt", 0);
    double eta = index_of(c, 1.5);
    read_surface_roughness(c, "", 0.1, 1);
    c->m->eta = (float)eta;
    struct pt_param *opacity = pt_params_find(c->p, "opacity");
    if (opacity) {
        c->info->opacity = read_share(c, "opacity", 1);
        c->info->has_opacity = c->info->opacity.texture || c->info->opacity.value.x < 1;
    }
    if (!is_black(kt) && is_black(kd)) {
        if (!is_clear(kt)) /* what glass lets through is all but what it reflects */
            pt_params_warn(c->p, "Kt", "Kt of an uber material without Kd is taken as 1");
        c->m->kind = PT_BSDF_DIELECTRIC;
        c->m->roughness_u = c->m->roughness_v = pt_input_grey(0);
    } else if (!is_black(kr) && is_black(kd) && is_black(ks)) {
        coloured_metal(c, kr);
        c->m->roughness_u = c->m->roughness_v = pt_input_grey(0);
    } else {
        if (!is_black(kr) || !is_black(kt))
            pt_params_warn(c->p, is_black(kr) ? "Kt" : "Kr", "Kr and Kt of an uber material with Kd are ignored");
        c->m->reflectance = kd;
        if (!is_black(ks) || !is_black(kr))
            clear_coat(c);
    }
}

static void make_metal(struct making *c)
{
    c->m->kind = PT_BSDF_CONDUCTOR;
    read_surface_roughness(c, "", 0.01, 1);
    pt_build_conductor(c->b, c->p, "eta", "k", &c->m->eta_rgb.value, &c->m->k_rgb.value);
}

static void make_mirror(struct making *c)
{
    coloured_metal(c, read_reflectance(c, "Kr", 0.9f));
    pt_params_ignore(c->p, "remaproughness roughness");
}

static void make_shiny_metal(struct making *c)
{
    coloured_metal(c, read_reflectance(c, "Kr", 1));
    pt_params_ignore(c->p, "Ks");
    read_surface_roughness(c, "", 0.1, 1);
}

static void make_glass(struct making *c)
{
    struct pt_input kr = read_reflectance(c, "Kr", 1), kt = read_reflectance(c, "Kt", 1);
    c->m->kind = PT_BSDF_DIELECTRIC;
    read_surface_roughness(c, "", 0, 1);
    c->m->eta = (float)index_of(c, 1.5);
    if (!is_clear(kr) || !is_clear(kt))
        pt_params_warn(c->p, pt_params_find(c->p, "Kr") ? "Kr" : "Kt", "Kr and Kt of glass are taken as 1");
}

static void make_translucent(struct making *c)
{
    struct pt_input kd = read_reflectance(c, "Kd", 0.25f), ks = read_reflectance(c, "Ks", 0.25f);
    c->m->kind = PT_BSDF_DIFFUSE_TRANSMISSION;
    c->m->reflectance = pt_input_product(c->b, kd, read_reflectance(c, "reflect", 0.5f));
    c->m->transmittance = pt_input_product(c->b, kd, read_reflectance(c, "transmit", 0.5f));
    read_surface_roughness(c, "", 0.1, 1);
    if (!is_black(ks))
        pt_params_warn(c->p, "Ks", "Ks of a translucent material is ignored");
}

/* v3 gives the share of the first material, v4 that of the second. */
static void make_mix(struct making *c)
{
    struct pt_param *first = pt_params_find(c->p, "namedmaterial1"), *second = pt_params_find(c->p, "namedmaterial2");
    c->m->kind = PT_MATERIAL_MIX;
    if (!first || !second || first->type != PT_PARAM_STRING || second->type != PT_PARAM_STRING) {
        pt_params_fail(c->p, NULL, "mix needs \"string namedmaterial1\" and \"string namedmaterial2\"");
        return;
    }
    c->m->mix_b = find_mixed(c->b, first->loc, pt_params_string(c->p, "namedmaterial1", ""), c->b->is_v3);
    c->m->mix_a = find_mixed(c->b, second->loc, pt_params_string(c->p, "namedmaterial2", ""), c->b->is_v3);
    struct pt_param *amount = pt_params_find(c->p, "amount");
    c->m->mix_amount = amount && amount->type == PT_PARAM_FLOAT ? pt_build_float_input(c->b, c->p, "amount", 0.5)
                                                                : read_share(c, "amount", 0.5f);
    set_mix_opacity(c);
}

/* What is not simulated: a diffuse surface of about its colour, mostly with a coat. */
struct stand_in {
    const char *name, *note; /* note: what the warning says besides */
    const char *colours[2];  /* parameters, of which the last one that is given counts */
    float grey;              /* else */
    double roughness, index; /* index: by default, and roughness, too; 0: nothing is read of either */
    int is_coated, is_of_v3; /* of v3: has a bumpmap */
    const char *ignored;
};

static void stand_in(struct making *c, const struct stand_in *s)
{
    pt_params_warn(c->p, NULL, "material \"%s\"%s is replaced by a %sdiffuse one", c->kind, s->note,
                   s->is_coated ? "coated " : "");
    c->m->reflectance = pt_input_grey((double)s->grey);
    for (int i = 0; i < 2 && s->colours[i]; i++)
        if (i == 0 || pt_params_find(c->p, s->colours[i]))
            c->m->reflectance = read_reflectance(c, s->colours[i], s->grey);
    c->m->roughness_u = c->m->roughness_v = pt_input_grey(s->roughness);
    if (s->index > 0) {
        read_surface_roughness(c, "", s->roughness, 0);
        c->m->eta = (float)pt_build_index(c->b, c->p, "eta", s->index);
    }
    pt_params_ignore(c->p, s->ignored);
    if (s->is_coated)
        clear_coat(c);
}

static const char not_of_kd[] = "Kr Kt mfp eta scale uroughness vroughness roughness remaproughness g sigma_a sigma_s name",
                  not_of_disney[] = "metallic speculartint anisotropic sheen sheentint clearcoat clearcoatgloss spectrans "
                                    "scatterdistance thin flatness difftrans";
static const struct stand_in stand_ins[] = {
    {"subsurface", "", {"reflectance"}, 0.6f, 0, 1.33, 1, 0, "mfp sigma_a sigma_s scale g name filename"},
    {"hair", "", {"color", "reflectance"}, 0.2f, 0, 0, 0, 0, "sigma_a eumelanin pheomelanin eta beta_m beta_n alpha"},
    {"measured", "", {NULL}, 0.5f, 0.1, 0, 1, 0, "filename"},
    {"kdsubsurface", "", {"Kd"}, 0.5f, 0, 0, 0, 1, not_of_kd},
    {"disney", "", {"color"}, 0.5f, 0.5, 1.5, 1, 1, not_of_disney},
    {"fourier", " (a measured table)", {NULL}, 0.5f, 0.05, 0, 1, 1, "bsdffile"},
};

/* 0: unknown. */
static int build_v3(struct making *c)
{
    static const struct v3_kind {
        const char *name;
        void (*make)(struct making *c);
    } kinds[] = {{"matte", make_matte},       {"plastic", make_plastic},
                 {"substrate", make_plastic}, {"uber", make_uber},
                 {"metal", make_metal},       {"mirror", make_mirror},
                 {"glass", make_glass},       {"translucent", make_translucent},
                 {"mix", make_mix},           {"shinymetal", make_shiny_metal}};
    const struct v3_kind *kind = pt_row(kinds, c->kind);
    const struct stand_in *other = pt_row(stand_ins, c->kind);
    if (kind)
        kind->make(c);
    else if (other)
        stand_in(c, other);
    if (kind || (other && other->is_of_v3))
        c->m->bump = read_bump(c, "bumpmap");
    return kind || other;
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
    struct making c = {b, p, kind, &m, &info};
    pt_params_ignore(p, "type");
    if (!build_v4(&c) && !build_v3(&c)) {
        if (pt_diag_unknown(&b->diag, pt_params_loc(p, "type"), "material", kind,
                            "diffuse, coateddiffuse, conductor, dielectric, mix …", "matte in its stead") != 0)
            return -1;
        c.kind = "matte";
        build_v3(&c);
    }
    if (!m.bump)
        m.bump = read_bump(&c, "displacement");
    struct pt_param *map = pt_params_find(p, "normalmap");
    if (map && map->type == PT_PARAM_TEXTURE)
        m.normal_map = pt_build_colour_input(b, p, "normalmap", PT_USE_UNBOUNDED, v3_splat(0)).texture;
    else if (map)
        m.normal_map = pt_build_image_texture(b, map->loc, pt_params_string(p, "normalmap", ""), "linear");
    pt_params_check_used(p);
    return !b->diag.rc ? add(b, &m, &info) : -1;
}

int32_t pt_build_material(struct pt_builder *b, const char *kind, struct pt_params *p)
{
    int32_t id = build(b, kind, p);
    if (id >= 0 && b->is_v3) {
        pt_params_clear(&info_of(b, id)->params, &b->diag, p->loc, kind);
        pt_params_append(&info_of(b, id)->params, p);
    }
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
    struct pt_material_info info = {.wanted = {pt_arena_strdup(&b->scene->arena, name), loc}, .opacity = pt_input_grey(1)};
    id = info.wanted.name ? add(b, &unmade, &info) : -1;
    if (id < 0 || pt_names_set(&b->named_materials, name, id) != 0)
        pt_diag_nomem(&b->diag, "materials");
    return b->diag.rc ? -1 : id;
}

int pt_build_make_named_material(struct pt_builder *b, const char *name, const char *kind, struct pt_params *p)
{
    const int32_t id = pt_build_material(b, kind, p), wanted = pt_names_get(&b->named_materials, name);
    if (id < 0 || b->diag.rc)
        return b->diag.rc;
    if (wanted < 0 || !info_of(b, wanted)->wanted.name)
        return pt_builder_name(b, &b->named_materials, name, id);
    struct pt_material *all = b->materials.items;
    /* The shapes that have it took it for a surface. */
    if (all[id].kind == PT_MATERIAL_INTERFACE || info_of(b, id)->has_opacity)
        return pt_diag_fail(&b->diag, info_of(b, wanted)->wanted.loc,
                            "material \"%s\" lets rays through (expected it to be made before)", name);
    all[wanted] = all[id];
    *info_of(b, wanted) = *info_of(b, id);
    b->materials.count = b->material_infos.count = (size_t)id; /* it is the last, and nobody has it */
    return 0;
}

/* What v3's materials know and its shapes do not. */
static const char of_materials[] =
    "Kd Ks Kr Kt amount anisotropic beta_m beta_n bsdffile bumpmap clearcoat clearcoatgloss color difftrans eta eumelanin "
    "flatness g index k metallic mfp namedmaterial1 namedmaterial2 opacity pheomelanin reflect remaproughness roughness "
    "scale scatterdistance sheen sheentint sigma sigma_a sigma_s spectrans speculartint thin transmit uroughness vroughness";

int32_t pt_build_shape_material(struct pt_builder *b, int32_t id, struct pt_params *shape)
{
    struct pt_params both = {0};
    size_t asked = 0, taken = 0;
    for (size_t i = 0; i < shape->count; i++)
        asked += (size_t)pt_name_is_in(of_materials, pt_param_name(shape, &shape->items[i]));
    if (asked == 0)
        return id;
    const struct pt_params *own = id >= 0 && info_of(b, id)->params.text ? &info_of(b, id)->params : NULL;
    const char *kind = own ? pt_params_kind(own) : "matte";
    pt_params_clear(&both, &b->diag, shape->loc, kind);
    pt_params_append(&both, shape);
    if (own)
        pt_params_append(&both, own);
    /* Only building it shows which of them its kind reads. */
    int32_t made = b->diag.rc ? -1 : build(b, kind, &both);
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
