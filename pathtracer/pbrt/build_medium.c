/* Participating media. */
#include <math.h>
#include <string.h>

#include "pbrt/build.h"
#include "shade/phase_function.h"

int32_t pt_build_medium_ref(struct pt_builder *b, const char *name, struct pt_loc loc)
{
    if (name[0] == '\0')
        return -1;
    int32_t id = pt_names_get(&b->media_names, name);
    if (id >= 0)
        return id;
    const char *kept = pt_arena_strdup(&b->scene->arena, name);
    struct pt_medium medium = {.kind = PT_MEDIUM_HOMOGENEOUS};
    struct pt_medium_info info = {.wanted = {kept, loc}, .name = kept};
    if (!kept || pt_list_add(b, &b->medium_infos, &info) < 0 || (id = pt_list_add(b, &b->media, &medium)) < 0 ||
        pt_names_set(&b->media_names, name, id) != 0)
        pt_diag_nomem(&b->diag, "media");
    return id;
}

/* Whether an instance puts its object where ObjectBegin had it, at all times. */
static int stays(const struct pt_builder *b, const struct pt_instance *instance)
{
    if (instance->animated) /* perhaps a moving shape of its own, which has no offset */
        return 0;
    const double *origin = ((const struct pt_object_info *)b->object_infos.items)[instance->object].origin;
    struct pt_xform shift = pt_xform_translate(origin[0], origin[1], origin[2]);
    struct pt_mat34 there = pt_xform_to_mat34(pt_builder_to_render(b, shift));
    int same = 1;
    for (int i = 0; i < 12; i++) /* but for the rounding of turns there and back */
        same &= fabsf(instance->to_render[0].m[i] - there.m[i]) <= 1e-6f * fmaxf(1.0f, fabsf(there.m[i]));
    return same;
}

static void say_stays(struct pt_builder *b, int32_t medium)
{
    const struct pt_medium_info *info = medium >= 0 ? &((struct pt_medium_info *)b->medium_infos.items)[medium] : NULL;
    if (info && ((struct pt_medium *)b->media.items)[medium].kind == PT_MEDIUM_GRID)
        pt_diag_warn(&b->diag, info->defined, "grid medium \"%.40s\" stays where it was made while its object does not",
                     info->name);
}

/* The densities of a grid are looked up in the world, whatever the surface that the path went in by. */
void pt_build_check_grids(struct pt_builder *b)
{
    for (size_t i = 0; i < b->instances.count; i++) {
        const struct pt_instance *instance = (struct pt_instance *)b->instances.items + i;
        const struct pt_object *object = (struct pt_object *)b->objects.items + instance->object;
        if (stays(b, instance))
            continue;
        for (int32_t k = 0; k < object->shape_count; k++) {
            const struct pt_shape *shape = (struct pt_shape *)b->object_shapes.items + object->first_shape + k;
            if (shape->medium_in != shape->medium_out) {
                say_stays(b, shape->medium_in);
                say_stays(b, shape->medium_out);
            }
        }
    }
}

/* Jensen, Marschner, Levoy and Hanrahan 2001, "A Practical Model for Subsurface Light Transport", table 1, and, from "Lowfat
 * Milk" on, Narasimhan, Gupta, Donner, Ramamoorthi, Nayar and Jensen 2006, "Acquiring Scattering Properties of Participating
 * Media by Dilution"; 1/mm. */
static const struct preset {
    const char *name;
    pt_vec3 sigma_s, sigma_a;
} presets[] = {{"Apple", {2.29f, 2.39f, 1.97f}, {0.0030f, 0.0034f, 0.046f}},
               {"Chicken1", {0.15f, 0.21f, 0.38f}, {0.015f, 0.077f, 0.19f}},
               {"Chicken2", {0.19f, 0.25f, 0.32f}, {0.018f, 0.088f, 0.20f}},
               {"Cream", {7.38f, 5.47f, 3.15f}, {0.0002f, 0.0028f, 0.0163f}},
               {"Ketchup", {0.18f, 0.07f, 0.03f}, {0.061f, 0.97f, 1.45f}},
               {"Marble", {2.19f, 2.62f, 3.00f}, {0.0021f, 0.0041f, 0.0071f}},
               {"Potato", {0.68f, 0.70f, 0.55f}, {0.0024f, 0.0090f, 0.12f}},
               {"Skimmilk", {0.70f, 1.22f, 1.90f}, {0.0014f, 0.0025f, 0.0142f}},
               {"Skin1", {0.74f, 0.88f, 1.01f}, {0.032f, 0.17f, 0.48f}},
               {"Skin2", {1.09f, 1.59f, 1.79f}, {0.013f, 0.070f, 0.145f}},
               {"Spectralon", {11.6f, 20.4f, 14.9f}, {0, 0, 0}},
               {"Wholemilk", {2.55f, 3.21f, 3.77f}, {0.0011f, 0.0024f, 0.014f}},
               {"Lowfat Milk", {0.89187f, 1.5136f, 2.532f}, {0.002875f, 0.00575f, 0.0115f}},
               {"Reduced Milk", {2.4858f, 3.1669f, 4.5214f}, {0.0025556f, 0.0051111f, 0.012778f}},
               {"Regular Milk", {4.5513f, 5.8294f, 7.136f}, {0.0015333f, 0.0046f, 0.019933f}},
               {"Espresso", {0.72378f, 0.84557f, 1.0247f}, {4.7984f, 6.5751f, 8.8493f}},
               {"Mint Mocha Coffee", {0.31602f, 0.38538f, 0.48131f}, {3.772f, 5.8228f, 7.82f}},
               {"Lowfat Soy Milk", {0.30576f, 0.34233f, 0.61664f}, {0.0014375f, 0.0071875f, 0.035937f}},
               {"Regular Soy Milk", {0.59223f, 0.73866f, 1.4693f}, {0.0019167f, 0.0095833f, 0.065167f}},
               {"Lowfat Chocolate Milk", {0.64925f, 0.83916f, 1.1057f}, {0.0115f, 0.0368f, 0.1564f}},
               {"Regular Chocolate Milk", {1.4585f, 2.1289f, 2.9527f}, {0.010063f, 0.043125f, 0.14375f}},
               {"Coke", {8.9053e-05f, 8.372e-05f, 0}, {0.10014f, 0.16503f, 0.2468f}},
               {"Pepsi", {6.1697e-05f, 4.2564e-05f, 0}, {0.091641f, 0.14158f, 0.20729f}},
               {"Sprite", {6.0306e-06f, 6.4139e-06f, 6.5504e-06f}, {0.001886f, 0.0018308f, 0.0020025f}},
               {"Gatorade", {0.0024574f, 0.003007f, 0.0037325f}, {0.024794f, 0.019289f, 0.008878f}},
               {"Chardonnay", {1.7982e-05f, 1.3758e-05f, 1.2023e-05f}, {0.010782f, 0.011855f, 0.023997f}},
               {"White Zinfandel", {1.7501e-05f, 1.9069e-05f, 1.288e-05f}, {0.012072f, 0.016184f, 0.019843f}},
               {"Merlot", {2.1129e-05f, 0, 0}, {0.11632f, 0.25191f, 0.29434f}},
               {"Budweiser Beer", {2.4356e-05f, 2.4079e-05f, 1.0564e-05f}, {0.011492f, 0.024911f, 0.057786f}},
               {"Coors Light Beer", {5.0922e-05f, 4.301e-05f, 0}, {0.006164f, 0.013984f, 0.034983f}},
               {"Clorox", {0.0024035f, 0.0031373f, 0.003991f}, {0.0033542f, 0.014892f, 0.026297f}},
               {"Apple Juice", {0.00013612f, 0.00015836f, 0.000227f}, {0.012957f, 0.023741f, 0.052184f}},
               {"Cranberry Juice", {0.00010402f, 0.00011646f, 7.8139e-05f}, {0.039437f, 0.094223f, 0.12426f}},
               {"Grape Juice", {5.382e-05f, 0, 0}, {0.10404f, 0.23958f, 0.29325f}},
               {"Ruby Grapefruit Juice", {0.011002f, 0.010927f, 0.011036f}, {0.085867f, 0.18314f, 0.25262f}},
               {"White Grapefruit Juice", {0.22826f, 0.23998f, 0.32748f}, {0.0138f, 0.018831f, 0.056781f}},
               {"Shampoo", {0.0007176f, 0.0008303f, 0.0009016f}, {0.014107f, 0.045693f, 0.061717f}},
               {"Strawberry Shampoo", {0.00015671f, 0.00015947f, 1.518e-05f}, {0.01449f, 0.05796f, 0.075823f}},
               {"Head & Shoulders Shampoo", {0.023805f, 0.028804f, 0.034306f}, {0.084621f, 0.15688f, 0.20365f}},
               {"Lemon Tea Powder", {0.040224f, 0.045264f, 0.051081f}, {2.4288f, 4.5757f, 7.2127f}},
               {"Orange Powder", {0.00015617f, 0.00017482f, 0.0001762f}, {0.001449f, 0.003441f, 0.007863f}},
               {"Pink Lemonade Powder", {0.00012103f, 0.00013073f, 0.00012528f}, {0.001165f, 0.002366f, 0.003195f}},
               {"Cappuccino Powder", {1.8436f, 2.5851f, 2.1662f}, {35.844f, 49.547f, 61.084f}},
               {"Salt Powder", {0.027333f, 0.032451f, 0.031979f}, {0.28415f, 0.3257f, 0.34148f}},
               {"Sugar Powder", {0.00022272f, 0.00025513f, 0.000271f}, {0.012638f, 0.031051f, 0.050124f}},
               {"Suisse Mocha Powder", {2.7979f, 3.5452f, 4.3365f}, {17.502f, 27.004f, 35.433f}},
               {"Pacific Ocean Surface Water", {0.0001764f, 0.00032095f, 0.00019617f}, {0.031845f, 0.031324f, 0.030147f}}};

static int has_many(struct pt_params *p, const char *name)
{
    const struct pt_param *param = pt_params_find(p, name);
    return param && param->count > 1;
}

static void read_coefficients(struct pt_builder *b, struct pt_params *p, int is_grid, struct pt_medium *m)
{
    const char *name = pt_params_string(p, "preset", "");
    const struct preset *preset = pt_row(presets, name);
    /* pbrt's defaults: whole milk in a homogeneous medium, 1 in a grid. */
    if (!preset && (!is_grid || b->is_v3))
        preset = pt_row(presets, "Wholemilk");
    m->sigma_s = preset ? preset->sigma_s : v3_splat(1);
    m->sigma_a = preset ? preset->sigma_a : v3_splat(1);
    if (name[0] != '\0' && !pt_row(presets, name))
        pt_params_warn(p, "preset", "unknown medium preset \"%s\": whole milk is used", name);
    pt_build_colour(b, p, "sigma_a", PT_USE_UNBOUNDED, &m->sigma_a);
    pt_build_colour(b, p, "sigma_s", PT_USE_UNBOUNDED, &m->sigma_s);
    m->g = (float)pt_params_float_in(p, "g", 0, -PT_PHASE_G_MAX, PT_PHASE_G_MAX);
    pt_vec3 emission = v3_splat(0);
    int emits = pt_build_colour(b, p, "Le", PT_USE_LIGHT, &emission);
    if (emits && !(is_grid && has_many(p, "Lescale"))) /* else by read_glow */
        emission = v3_scale(emission, (float)pt_params_float_in(p, "Lescale", 1, 0, 1e12));
    pt_params_ignore(p, "Lescale");
    float scale = (float)pt_params_float_in(p, "scale", 1, 0, 1e12);
    m->sigma_a = v3_scale(m->sigma_a, scale);
    m->sigma_s = v3_scale(m->sigma_s, scale);
    m->emission = v3_mul(m->sigma_a, emission);
}

/* The mean free paths that a ray may have to cross in a grid: each is a step. What is denser is solid to the eye, and a step
 * must not be lost to the rounding of the way. */
static const double most_paths = 1e5;

static void bound_density(struct pt_params *p, const struct pt_xform *box, struct pt_medium *m)
{
    double size = 0, most = 0;
    for (int i = 0; i < 9; i++)
        size += box->m[i / 3][i % 3] * box->m[i / 3][i % 3]; /* its diagonal's square */
    for (size_t i = 0; i < (size_t)m->nx * (size_t)m->ny * (size_t)m->nz; i++)
        most = fmax(most, (double)m->density[i]);
    double paths = most * (double)v3_max(v3_add(m->sigma_a, m->sigma_s)) * sqrt(size);
    if (!(paths > most_paths))
        return;
    pt_params_warn(p, NULL, "a grid medium of %.3g mean free paths across is taken as one of %g", paths, most_paths);
    float scale = (float)(most_paths / paths);
    m->sigma_a = v3_scale(m->sigma_a, scale);
    m->sigma_s = v3_scale(m->sigma_s, scale);
    m->emission = v3_scale(m->emission, scale);
}

/* World → unit box of [p0, p1] → render's inverse. */
static int place_grid(struct pt_builder *b, struct pt_params *p, struct pt_medium *m)
{
    double p0[3] = {0, 0, 0}, p1[3] = {1, 1, 1};
    struct pt_xform at[2], inverse;
    pt_params_point(p, "p0", p0);
    pt_params_point(p, "p1", p1);
    if (pt_builder_at_shutter(b, b->state->ctm, at))
        pt_params_warn(p, NULL, "grid media do not move: the transform at shutter open is used");
    if (!(p0[0] != p1[0] && p0[1] != p1[1] && p0[2] != p1[2]))
        return pt_params_fail(p, pt_params_find(p, "p1") ? "p1" : "p0",
                              "the box of a grid medium is empty (expected p0 and p1 apart in all axes)");
    /* Any two corners name the box; the densities always run upwards. */
    struct pt_xform box = pt_xform_translate(fmin(p0[0], p1[0]), fmin(p0[1], p1[1]), fmin(p0[2], p1[2]));
    struct pt_xform size = pt_xform_scale(fabs(p1[0] - p0[0]), fabs(p1[1] - p0[1]), fabs(p1[2] - p0[2]));
    box = pt_builder_to_render(b, pt_xform_mul(at[0], pt_xform_mul(box, size)));
    if (!pt_xform_invert(&box, &inverse))
        return pt_params_fail(p, NULL, "singular transform of a medium");
    m->from_render = pt_xform_to_mat34(inverse);
    bound_density(p, &box, m);
    return 0;
}

/* v4's Lescale of a grid, one for each density. There is one emission for all here: that of the same whole. */
static int read_glow(struct pt_params *p, size_t expected, struct pt_medium *m)
{
    size_t n;
    if (pt_params_find(p, "temperature"))
        pt_params_warn(p, "temperature", "the temperature of a grid medium is ignored: it does not glow");
    pt_params_ignore(p, "temperature temperaturecutoff temperatureoffset temperaturescale");
    if (!has_many(p, "Lescale"))
        return 0;
    const double *scales = pt_params_floats(p, "Lescale", 1, &n);
    double sum = 0, weights = 0;
    if (n != expected)
        return pt_params_fail(p, "Lescale", "Lescale has %zu values (expected 1 or nx·ny·nz = %zu)", n, expected);
    int varies = 0;
    for (size_t i = 0; i < n; i++) {
        double density = (double)m->density[i];
        if (!(scales[i] >= 0 && scales[i] <= 1e12))
            return pt_params_fail(p, "Lescale", "Lescale %zu is %g (expected 0 to 1e+12)", i, scales[i]);
        sum += density * scales[i];
        weights += density;
        varies |= scales[i] != scales[0];
    }
    if (varies && !v3_is_black(m->emission))
        pt_params_warn(p, "Lescale", "Lescale of a grid medium is replaced by its mean");
    m->emission = v3_scale(m->emission, (float)(weights > 0 ? sum / weights : scales[0]));
    return 0;
}

/* The number of densities is checked before memory is taken: a file may say anything of nx, ny and nz. */
static int read_grid(struct pt_builder *b, struct pt_params *p, struct pt_medium *m)
{
    size_t n = 0;
    m->kind = PT_MEDIUM_GRID;
    m->nx = pt_params_int_in(p, "nx", 1, 1, 4096);
    m->ny = pt_params_int_in(p, "ny", 1, 1, 4096);
    m->nz = pt_params_int_in(p, "nz", 1, 1, 4096);
    const double *density = pt_params_floats(p, "density", 1, &n);
    size_t expected = (size_t)m->nx * (size_t)m->ny * (size_t)m->nz;
    if (b->diag.rc)
        return b->diag.rc;
    if (!density)
        return pt_params_fail(p, NULL, "a grid medium needs \"float density\"");
    if (n != expected)
        return pt_params_fail(p, "density", "density has %zu values (expected nx·ny·nz = %zu)", n, expected);
    float *kept = pt_arena_alloc(&b->scene->arena, n, sizeof *kept);
    if (!kept)
        return pt_diag_nomem(&b->diag, "a grid medium");
    for (size_t i = 0; i < n; i++) {
        if (density[i] < 0)
            return pt_params_fail(p, "density", "density %zu is %g (expected 0 or more)", i, density[i]);
        kept[i] = (float)density[i];
    }
    m->density = kept;
    read_glow(p, expected, m);
    return place_grid(b, p, m);
}

int pt_build_medium(struct pt_builder *b, struct pt_params *p)
{
    struct pt_medium m = {.kind = PT_MEDIUM_HOMOGENEOUS};
    const char *name = pt_params_kind(p), *type = pt_params_string(p, "type", "homogeneous");
    if (name[0] == '\0')
        return pt_params_fail(p, NULL, "MakeNamedMedium with an empty name");
    int is_grid = strcmp(type, "uniformgrid") == 0 || strcmp(type, "heterogeneous") == 0;
    int stand_in = strcmp(type, "rgbgrid") == 0 || strcmp(type, "cloud") == 0 || strcmp(type, "nanovdb") == 0;
    if (!is_grid && !stand_in && strcmp(type, "homogeneous") != 0)
        return pt_params_fail(p, "type", "unknown medium type \"%.63s\" (expected homogeneous or uniformgrid)", type);
    if (stand_in) {
        pt_params_warn(p, "type", "medium type \"%s\" is replaced by empty space", type);
        for (size_t i = 0; i < p->count; i++)
            p->items[i].used = 1;
    } else {
        read_coefficients(b, p, is_grid, &m);
        if (is_grid)
            read_grid(b, p, &m);
    }
    pt_params_check_used(p);
    int32_t id = pt_build_medium_ref(b, name, p->loc);
    if (b->diag.rc)
        return b->diag.rc;
    ((struct pt_medium *)b->media.items)[id] = m;
    struct pt_medium_info *info = (struct pt_medium_info *)b->medium_infos.items + id;
    info->wanted.name = NULL;
    info->defined = p->loc;
    return 0;
}
