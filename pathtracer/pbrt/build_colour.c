/* Colours and indices of refraction from parameters: rgb, xyz, spectra by list, name or file, black bodies. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "pbrt/build.h"
#include "pbrt/spectra.h"

static int by_wavelength(const void *a, const void *b)
{
    const double *x = a, *y = b;
    const int k = x[0] == y[0]; /* then by value */
    return (x[k] > y[k]) - (x[k] < y[k]);
}

/* A spectrum of pairs: where its wavelengths do not rise, pbrt-v3 sorts them (here in place) and v4 refuses it. `file` is ""
 * or names the file that they are from. */
static int read_pairs(struct pt_builder *b, const struct pt_param *param, const char *file, double *pairs, size_t count,
                      int extend, struct pt_spd *out)
{
    size_t i = 1;
    while (i < count && (pairs[2 * i] > pairs[2 * i - 2] || (b->is_v3 && pairs[2 * i] == pairs[2 * i - 2])))
        i++;
    if (i < count && !b->is_v3)
        return pt_diag_fail(&b->diag, param->loc, "%s%swavelength %g after %g (expected rising ones)", file,
                            *file ? ": " : "", pairs[2 * i], pairs[2 * i - 2]);
    if (i < count)
        qsort(pairs, count, 2 * sizeof *pairs, by_wavelength);
    pt_spd_from_pairs(pairs, count, extend, out);
    return 0;
}

/* Pairs of a .spd file: numbers separated by blanks, # to the end of the line is a comment. */
static int read_spd_file(struct pt_builder *b, const struct pt_param *param, const char *name, int extend,
                         struct pt_spd *out)
{
    char path[2048];
    char *bytes = NULL;
    const char *at;
    size_t size = 0, room = 0, n = 0, length;
    double *numbers = NULL;
    struct base_lines lines;
    struct base_err err = {0};
    pt_builder_path(b, name, path, sizeof path);
    if (b->source->read(b->source->data, path, &bytes, &size, &err) != 0)
        return pt_diag_fail(&b->diag, param->loc, "spectrum \"%s\" is neither a known name nor a readable file", name);
    base_lines_init(&lines, path, bytes, size);
    while (!b->diag.rc && !base_lines_next(&lines, &at, &length, &err) && at)
        for (const char *end = at + length; at < end && *at != '#' && !b->diag.rc;) {
            const char *start = at;
            while (at < end && !strchr("# \t,", *at))
                at++;
            if (at == start)
                at++;
            else if (!pt_grow((void **)&numbers, &room, n, sizeof *numbers))
                pt_diag_nomem(&b->diag, "spectrum");
            else if (!pt_number_parse(start, (size_t)(at - start), &numbers[n++]))
                pt_diag_fail(&b->diag, param->loc, "%s:%zu: \"%.*s\" (expected a number)", path, lines.number,
                             at - start < 30 ? (int)(at - start) : 30, start);
        }
    if (!b->diag.rc && err.code)
        pt_diag_fail(&b->diag, param->loc, "%s", err.text);
    if (!b->diag.rc && (n < 2 || n % 2 != 0))
        pt_diag_fail(&b->diag, param->loc, "%s: %zu numbers (expected pairs of wavelength and value)", path, n);
    if (!b->diag.rc)
        read_pairs(b, param, path, numbers, n / 2, extend, out);
    free(numbers);
    free(bytes);
    return b->diag.rc;
}

static double *values_of(const struct pt_params *p, const struct pt_param *param)
{
    return param->count > 0 && !param->is_text ? p->numbers + param->first : NULL;
}

/* SPECTRUM and BLACKBODY parameters. `extend`: see pt_spd_from_pairs. */
static int read_spectrum(struct pt_builder *b, struct pt_params *p, struct pt_param *param, int extend, struct pt_spd *out)
{
    double *v = values_of(p, param);
    pt_spd_constant(0, out);
    if (param->type == PT_PARAM_BLACKBODY) {
        if (param->count < 1 || param->count > 2 || !(v[0] >= 100 && v[0] <= 1e6))
            return pt_diag_fail(&b->diag, param->loc, "blackbody needs a temperature from 100 to 1e6 kelvin");
        pt_spd_blackbody(v[0], out);
        for (int i = 0; i < PT_SPD_COUNT && param->count == 2; i++)
            out->v[i] *= v[1];
        return 0;
    }
    if (param->is_text) {
        const char *name = pt_params_string_at(p, param, 0);
        if (param->count != 1)
            return pt_diag_fail(&b->diag, param->loc, "spectrum has %zu names (expected 1)", param->count);
        return pt_spd_named(name, out) ? 0 : read_spd_file(b, param, name, extend, out);
    }
    if (param->count == 1) { /* pbrt-v4: a constant */
        pt_spd_constant(v[0], out);
        return 0;
    }
    if (param->count == 0 || param->count % 2 != 0)
        return pt_diag_fail(&b->diag, param->loc, "spectrum has %zu numbers (expected pairs of wavelength and value)",
                            param->count);
    return read_pairs(b, param, "", v, param->count / 2, extend, out);
}

static pt_vec3 light_colour(struct pt_builder *b, const struct pt_param *param, const struct pt_spd *spd)
{
    /* without the negative light of what is out of Rec.709 */
    pt_vec3 rgb = v3_most(pt_spd_emission_rgb(spd), v3_splat(0));
    float y = v3_luminance(rgb);
    int v3_pair = param->type == PT_PARAM_BLACKBODY && param->count == 2;
    /* pbrt-v4 scales lights so that a spectrum of any strength emits luminance 1; "scale" then sets it. */
    if (!b->is_v3 && !v3_pair && y > 0)
        rgb = v3_scale(rgb, 1 / y);
    return rgb;
}

static int check_colour(struct pt_builder *b, const struct pt_params *p, const struct pt_param *param,
                        enum pt_colour_use use, pt_vec3 *rgb)
{
    const double *given = values_of(p, param);
    int is_negative = 0;
    for (size_t i = 0; i < param->count && (param->type == PT_PARAM_RGB || param->type == PT_PARAM_FLOAT); i++)
        is_negative |= given[i] < 0;
    if (!v3_is_finite(*rgb))
        return pt_diag_fail(&b->diag, param->loc, "a colour that is not finite");
    if (use == PT_USE_REFLECTANCE && (fminf(rgb->x, fminf(rgb->y, rgb->z)) < -1e-3f || v3_max(*rgb) > 1.001f) &&
        param->type == PT_PARAM_RGB)
        pt_diag_warn(&b->diag, param->loc, "reflectances beyond 0 … 1 are clamped");
    if (use != PT_USE_REFLECTANCE && is_negative)
        pt_diag_warn(&b->diag, param->loc, "\"%s\" is negative, which is taken as 0", pt_param_name(p, param));
    if (use == PT_USE_REFLECTANCE)
        *rgb = v3_least(*rgb, v3_splat(1));
    /* Spectral colours may leave Rec.709; negative light does not exist. */
    *rgb = v3_most(*rgb, v3_splat(0));
    return 0;
}

int pt_build_colour(struct pt_builder *b, struct pt_params *p, const char *name, enum pt_colour_use use, pt_vec3 *out)
{
    struct pt_param *param = pt_params_find(p, name);
    struct pt_spd spd;
    pt_vec3 rgb = {0, 0, 0};
    if (!param)
        return 0;
    param->used = 1;
    const double *v = values_of(p, param);
    const int space = param->colour_space > 0 ? param->colour_space - 1 : b->state->colour_space;
    switch (param->type) {
    case PT_PARAM_RGB:
    case PT_PARAM_XYZ:
        if (!pt_param_has(p, param, 3))
            return 0;
        rgb = param->type == PT_PARAM_XYZ ? pt_xyz_to_rgb(v[0], v[1], v[2])
                                          : pt_colour_to_rec709(space, v3((float)v[0], (float)v[1], (float)v[2]));
        break;
    case PT_PARAM_FLOAT: /* a grey, as v2 files and quick tests have it */
        if (!pt_param_has(p, param, 1))
            return 0;
        rgb = v3_splat((float)v[0]);
        break;
    case PT_PARAM_SPECTRUM:
        if (use == PT_USE_LIGHT && param->is_text && param->count == 1 &&
            pt_illuminant_named(pt_params_string_at(p, param, 0), &rgb))
            break;
        /* fall through */
    case PT_PARAM_BLACKBODY:
        if (read_spectrum(b, p, param, b->is_v3, &spd) != 0)
            return 0;
        rgb = use == PT_USE_LIGHT ? light_colour(b, param, &spd) : pt_spd_reflectance_rgb(&spd);
        break;
    default:
        pt_diag_fail(&b->diag, param->loc, "parameter \"%s\" is not a colour (expected rgb, spectrum or blackbody)", name);
        return 0;
    }
    if (check_colour(b, p, param, use, &rgb) != 0)
        return 0;
    *out = rgb;
    return 1;
}

/* A spectrum, or its name written as a string. */
static int is_spectrum(const struct pt_param *param)
{
    return param && (param->type == PT_PARAM_SPECTRUM || param->type == PT_PARAM_STRING);
}

void pt_build_conductor(struct pt_builder *b, struct pt_params *p, const char *eta_name, const char *k_name,
                        pt_vec3 *eta_rgb, pt_vec3 *k_rgb)
{
    static const char *const copper[2] = {"metal-Cu-eta", "metal-Cu-k"};
    const char *const names[2] = {eta_name, k_name};
    pt_vec3 *const rgb[2] = {eta_rgb, k_rgb};
    struct pt_spd spd[2];
    for (int i = 0; i < 2; i++) {
        struct pt_param *param = pt_params_find(p, names[i]);
        pt_spd_named(copper[i], &spd[i]);
        if (is_spectrum(param)) {
            param->used = 1;
            read_spectrum(b, p, param, 1, &spd[i]);
        }
    }
    pt_spd_conductor_rgb(&spd[0], &spd[1], eta_rgb, k_rgb);
    for (int i = 0; i < 2; i++)
        if (!is_spectrum(pt_params_find(p, names[i])))
            pt_build_colour(b, p, names[i], PT_USE_UNBOUNDED, rgb[i]);
    /* An index of 0 divides by zero in Fresnel's equations. */
    *eta_rgb = v3_most(*eta_rgb, v3_splat(1e-3f));
}

double pt_build_index(struct pt_builder *b, struct pt_params *p, const char *name, double fallback)
{
    struct pt_param *param = pt_params_find(p, name);
    struct pt_spd spd;
    double eta = fallback;
    if (!param)
        return fallback;
    param->used = 1;
    if (is_spectrum(param)) {
        if (read_spectrum(b, p, param, 1, &spd) != 0)
            return fallback;
        eta = pt_spd_luminous_mean(&spd);
        if (param->count > 1 || (param->is_text && pt_glass_index(pt_params_string_at(p, param, 0)) > 0))
            pt_diag_warn(&b->diag, param->loc, "dispersion is not simulated: one index of refraction for all wavelengths");
    } else if (param->type == PT_PARAM_TEXTURE) {
        pt_diag_warn(&b->diag, param->loc, "a textured index of refraction is replaced by %g", fallback);
    } else if (param->type == PT_PARAM_RGB && param->count == 3) {
        eta = p->numbers[param->first + 1];
    } else {
        eta = pt_params_float(p, name, fallback);
    }
    if (!(eta >= 0.1 && eta <= 10)) {
        pt_diag_fail(&b->diag, param->loc, "index of refraction %g (expected 0.1 to 10)", eta);
        return fallback;
    }
    return eta;
}
