/* pbrt-v3's materials in terms of v4's, and what stands in for materials that are not simulated. */
#include <string.h>

#include "pbrt/build.h"

static int is_black(struct pt_input in) { return !in.texture && v3_is_black(in.value); }

static void clear_coat(struct pt_making *c)
{
    c->m->kind = PT_BSDF_COATED_DIFFUSE;
    c->m->thickness = pt_input_grey(0.01);
}

/* Metal by its colour instead of an index. */
static void coloured_metal(struct pt_making *c, struct pt_input colour)
{
    c->m->kind = PT_BSDF_CONDUCTOR;
    c->m->conductor_by_colour = 1;
    c->m->reflectance = colour;
}

static double index_of(struct pt_making *c, double fallback)
{
    return pt_build_index(c->b, c->p, pt_params_find(c->p, "index") ? "index" : "eta", fallback);
}

static void make_matte(struct pt_making *c)
{
    c->m->reflectance = pt_build_reflectance(c, "Kd", 0.5f);
    struct pt_input sigma = pt_build_float_input(c->b, c->p, "sigma", 0);
    if (sigma.texture || sigma.value.x != 0)
        pt_params_warn(c->p, "sigma", "sigma of a matte material is ignored: plain diffuse");
}

/* Ks of these v3 models is the strength of the coat; the coat here is glass of index 1.5 (as pbrt-v4's own upgrade does). */
static void make_plastic(struct pt_making *c)
{
    int substrate = strcmp(c->kind, "substrate") == 0;
    c->m->reflectance = pt_build_reflectance(c, "Kd", substrate ? 0.5f : 0.25f);
    struct pt_input ks = pt_build_reflectance(c, "Ks", substrate ? 0.5f : 0.25f);
    pt_build_roughness(c->b, c->p, 0.1, 1, c->m);
    if (is_black(ks))
        return;
    clear_coat(c);
}

/* A share that v3 gives as a colour is one number here. */
static struct pt_input read_share(struct pt_making *c, const char *name, float fallback)
{
    struct pt_input in = pt_build_reflectance(c, name, fallback);
    if (in.texture)
        return pt_input_luminance(c->b, in);
    if (in.value.x != in.value.y || in.value.y != in.value.z)
        pt_params_warn(c->p, name, "a coloured %s is taken as a grey one", name);
    return pt_input_grey((double)v3_luminance(in.value));
}

/* What glass lets through is all but what it reflects. */
static void say_clear(struct pt_making *c, struct pt_input kt)
{
    if (kt.texture || v3_luminance(kt.value) < 0.999f)
        pt_params_warn(c->p, "Kt", "Kt of an uber material without Kd is taken as 1");
}

/* A sum of four lobes there. Here it is the one that stands alone, or else a coated diffuse surface. */
static void make_uber(struct pt_making *c)
{
    struct pt_input kd = pt_build_reflectance(c, "Kd", 0.25f), ks = pt_build_reflectance(c, "Ks", 0.25f),
                    kr = pt_build_reflectance(c, "Kr", 0), kt = pt_build_reflectance(c, "Kt", 0);
    double eta = index_of(c, 1.5);
    pt_build_roughness(c->b, c->p, 0.1, 1, c->m);
    c->m->eta = (float)eta;
    struct pt_param *opacity = pt_params_find(c->p, "opacity");
    if (opacity) {
        c->info->opacity = read_share(c, "opacity", 1);
        c->info->has_opacity = c->info->opacity.texture || c->info->opacity.value.x < 1;
    }
    if (!is_black(kt) && is_black(kd)) {
        say_clear(c, kt);
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

static void make_metal(struct pt_making *c)
{
    c->m->kind = PT_BSDF_CONDUCTOR;
    pt_build_roughness(c->b, c->p, 0.01, 1, c->m);
    pt_build_conductor(c->b, c->p, "eta", "k", &c->m->eta_rgb.value, &c->m->k_rgb.value);
}

static void make_mirror(struct pt_making *c)
{
    coloured_metal(c, pt_build_reflectance(c, "Kr", 0.9f));
    pt_params_ignore(c->p, "remaproughness roughness");
}

static void make_shiny_metal(struct pt_making *c)
{
    coloured_metal(c, pt_build_reflectance(c, "Kr", 1));
    pt_params_ignore(c->p, "Ks");
    pt_build_roughness(c->b, c->p, 0.1, 1, c->m);
}

static void make_glass(struct pt_making *c)
{
    struct pt_input kr = pt_build_reflectance(c, "Kr", 1), kt = pt_build_reflectance(c, "Kt", 1);
    c->m->kind = PT_BSDF_DIELECTRIC;
    pt_build_roughness(c->b, c->p, 0, 1, c->m);
    c->m->eta = (float)index_of(c, 1.5);
    if (kr.texture || kt.texture || v3_luminance(kr.value) < 0.999f || v3_luminance(kt.value) < 0.999f)
        pt_params_warn(c->p, pt_params_find(c->p, "Kr") ? "Kr" : "Kt", "Kr and Kt of glass are taken as 1");
}

static void make_translucent(struct pt_making *c)
{
    struct pt_input kd = pt_build_reflectance(c, "Kd", 0.25f), ks = pt_build_reflectance(c, "Ks", 0.25f);
    c->m->kind = PT_BSDF_DIFFUSE_TRANSMISSION;
    c->m->reflectance = pt_input_product(c->b, kd, pt_build_reflectance(c, "reflect", 0.5f));
    c->m->transmittance = pt_input_product(c->b, kd, pt_build_reflectance(c, "transmit", 0.5f));
    pt_build_roughness(c->b, c->p, 0.1, 1, c->m);
    if (!is_black(ks))
        pt_params_warn(c->p, "Ks", "Ks of a translucent material is ignored");
}

/* pbrt-v3 mixes matte where there is no material of that name. */
static int32_t mixed(struct pt_making *c, const char *parameter)
{
    const struct pt_param *param = pt_params_find(c->p, parameter);
    const char *name = pt_params_string(c->p, parameter, "");
    if (!c->b->is_v3 || pt_names_get(&c->b->named_materials, name) >= 0)
        return pt_build_material_named(c->b, param->loc, name);
    pt_diag_warn(&c->b->diag, param->loc, "unknown material \"%s\": matte in its stead", name);
    return pt_build_default_material(c->b);
}

/* v3 gives the share of the first material, v4 that of the second. */
static void make_mix(struct pt_making *c)
{
    struct pt_param *first = pt_params_find(c->p, "namedmaterial1"), *second = pt_params_find(c->p, "namedmaterial2");
    c->m->kind = PT_MATERIAL_MIX;
    if (!first || !second || first->type != PT_PARAM_STRING || second->type != PT_PARAM_STRING) {
        pt_params_fail(c->p, NULL, "mix needs \"string namedmaterial1\" and \"string namedmaterial2\"");
        return;
    }
    c->m->mix_b = mixed(c, "namedmaterial1");
    c->m->mix_a = mixed(c, "namedmaterial2");
    struct pt_param *amount = pt_params_find(c->p, "amount");
    c->m->mix_amount = amount && amount->type == PT_PARAM_FLOAT ? pt_build_float_input(c->b, c->p, "amount", 0.5)
                                                                : read_share(c, "amount", 0.5f);
    pt_build_mix_opacity(c);
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

static void stand_in(struct pt_making *c, const struct stand_in *s)
{
    pt_params_warn(c->p, NULL, "material \"%s\"%s is replaced by a %sdiffuse one", c->kind, s->note,
                   s->is_coated ? "coated " : "");
    c->m->reflectance = pt_input_grey((double)s->grey);
    for (int i = 0; i < 2 && s->colours[i]; i++)
        if (i == 0 || pt_params_find(c->p, s->colours[i]))
            c->m->reflectance = pt_build_reflectance(c, s->colours[i], s->grey);
    c->m->roughness_u = c->m->roughness_v = pt_input_grey(s->roughness);
    if (s->index > 0) {
        pt_build_roughness(c->b, c->p, s->roughness, 0, c->m);
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

int pt_build_material_v3(struct pt_making *c)
{
    static const struct {
        const char *name;
        void (*make)(struct pt_making *c);
    } kinds[] = {{"matte", make_matte},       {"plastic", make_plastic},
                 {"substrate", make_plastic}, {"uber", make_uber},
                 {"metal", make_metal},       {"mirror", make_mirror},
                 {"glass", make_glass},       {"translucent", make_translucent},
                 {"mix", make_mix},           {"shinymetal", make_shiny_metal}};
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++)
        if (strcmp(kinds[i].name, c->kind) == 0) {
            kinds[i].make(c);
            c->m->bump = pt_build_bump(c->b, c->p, "bumpmap");
            return 1;
        }
    for (size_t i = 0; i < sizeof stand_ins / sizeof stand_ins[0]; i++)
        if (strcmp(stand_ins[i].name, c->kind) == 0) {
            stand_in(c, &stand_ins[i]);
            if (stand_ins[i].is_of_v3)
                c->m->bump = pt_build_bump(c->b, c->p, "bumpmap");
            return 1;
        }
    return 0;
}
