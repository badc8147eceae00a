#include "pbrt/spectra.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/options.h"
#include "pbrt/names.h"

/* CIE 1931 2° colour-matching functions, analytic fit: Wyman, Sloan and Shirley 2013, "Simple Analytic Approximations to the
 * CIE XYZ Color Matching Functions", JCGT 2(2), eq. 4. */
static double lobe(double nm, double mean, double below, double above)
{
    double t = (nm - mean) / (nm < mean ? below : above);
    return exp(-0.5 * t * t);
}
static double cie_x(double nm)
{
    return 1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) - 0.065 * lobe(nm, 501.1, 20.4, 26.2);
}
static double cie_y(double nm) { return 0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1); }
static double cie_z(double nm) { return 1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8); }

/* CIE standard illuminant D65 every 10 nm from 380 nm (CIE 15). */
static const double d65_10nm[] = {49.9755, 54.6482, 82.7549, 91.486,  93.4318, 86.6823, 104.865, 117.008, 117.812,
                                  114.861, 115.923, 108.811, 109.354, 107.802, 104.79,  107.689, 104.405, 104.046,
                                  100.0,   96.3342, 95.788,  88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992,
                                  80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.349,  61.604,  69.8856,
                                  75.087,  63.5927, 46.4182, 66.8054, 63.3828};

/* Lynch and Hunter 1985 in Palik's Handbook of Optical Constants of Solids: photon energy eV; n and k of
 * copper, silver and gold. */
static const struct {
    double ev, nk[3][2];
} noble_metals[] = {
    {3.2, {{1.180, 2.210}, {0.192, 1.810}, {1.674, 1.936}}}, {3.1, {{1.175, 2.130}, {0.173, 1.950}, {1.658, 1.956}}},
    {3.0, {{1.180, 2.210}, {0.173, 2.110}, {1.636, 1.958}}}, {2.9, {{1.175, 2.289}, {0.160, 2.260}, {1.616, 1.940}}},
    {2.8, {{1.170, 2.362}, {0.157, 2.400}, {1.562, 1.904}}}, {2.7, {{1.160, 2.433}, {0.144, 2.560}, {1.426, 1.846}}},
    {2.6, {{1.150, 2.504}, {0.132, 2.720}, {1.242, 1.796}}}, {2.5, {{1.135, 2.564}, {0.130, 2.880}, {0.916, 1.840}}},
    {2.4, {{1.120, 2.605}, {0.130, 3.070}, {0.608, 2.120}}}, {2.3, {{1.040, 2.583}, {0.129, 3.250}, {0.402, 2.540}}},
    {2.2, {{0.826, 2.599}, {0.120, 3.450}, {0.306, 2.880}}}, {2.1, {{0.468, 2.809}, {0.121, 3.660}, {0.236, 2.970}}},
    {2.0, {{0.272, 3.240}, {0.131, 3.880}, {0.194, 3.060}}}, {1.9, {{0.214, 3.670}, {0.140, 4.150}, {0.166, 3.150}}},
    {1.8, {{0.213, 4.050}, {0.140, 4.440}, {0.160, 3.800}}}, {1.7, {{0.223, 4.430}, {0.148, 4.740}, {0.164, 4.357}}},
    {1.6, {{0.250, 4.817}, {0.143, 5.090}, {0.176, 4.860}}},
};
enum { NOBLE_COUNT = sizeof noble_metals / sizeof noble_metals[0] };

/* Aluminium: Smith, Shiles and Inokuti 1985 in Palik's Handbook of Optical Constants of Solids: nm, n and nm, k. */
static const double al_eta[] = {400, 0.490, 450, 0.618, 500, 0.769, 550, 0.958, 600, 1.200, 650, 1.470, 700, 1.830};
static const double al_k[] = {400, 4.86, 450, 5.47, 500, 6.08, 550, 6.69, 600, 7.26, 650, 7.79, 700, 8.31};
/* Brass, 70 % copper and 30 % zinc: Querry 1985, at three wavelengths. */
static const double cuzn_eta[] = {450, 1.094, 550, 0.527, 650, 0.444};
static const double cuzn_k[] = {450, 1.829, 550, 2.765, 650, 3.695};

void pt_spd_constant(double value, struct pt_spd *out)
{
    for (int i = 0; i < PT_SPD_COUNT; i++)
        out->v[i] = value;
}

/* The lines through the pairs, and the end values beyond them. */
static double line_at(const double *pairs, size_t count, double nm)
{
    size_t k = 0;
    while (k + 1 < count && pairs[2 * (k + 1)] <= nm)
        k++;
    double nm0 = pairs[2 * k], v0 = pairs[2 * k + 1];
    if (nm < nm0 || k + 1 >= count)
        return v0;
    double nm1 = pairs[2 * k + 2], v1 = pairs[2 * k + 3];
    return v0 + (v1 - v0) * (nm - nm0) / (nm1 - nm0);
}

/* Their mean over the step around nm. */
static double mean_around(const double *pairs, size_t count, int extend, double nm)
{
    double from = nm - 0.5 * PT_SPD_STEP_NM, to = nm + 0.5 * PT_SPD_STEP_NM, sum = 0;
    if (!extend) {
        from = fmax(from, pairs[0]);
        to = fmin(to, pairs[2 * count - 2]);
    }
    if (!(from < to))
        return 0;
    double at = from, v = line_at(pairs, count, from);
    for (size_t i = 0; i < count && pairs[2 * i] < to; i++) {
        if (pairs[2 * i] <= from)
            continue;
        sum += 0.5 * (v + pairs[2 * i + 1]) * (pairs[2 * i] - at);
        at = pairs[2 * i];
        v = pairs[2 * i + 1];
    }
    return (sum + 0.5 * (v + line_at(pairs, count, to)) * (to - at)) / PT_SPD_STEP_NM;
}

void pt_spd_from_pairs(const double *pairs, size_t count, int extend, struct pt_spd *out)
{
    for (int i = 0; i < PT_SPD_COUNT; i++)
        out->v[i] = mean_around(pairs, count, extend, PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM);
}

/* Of the tables here, which are smooth. */
static void from_table(const double *pairs, size_t count, struct pt_spd *out)
{
    for (int i = 0; i < PT_SPD_COUNT; i++)
        out->v[i] = line_at(pairs, count, PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM);
}

static double planck(double nm, double kelvin)
{
    double m = nm * 1e-9;
    /* h c / k_B = 0.01438776877 m K (CODATA 2018); the leading constant cancels in the scaling. */
    return pow(m, -5) / expm1(0.01438776877 / (m * kelvin));
}

void pt_spd_blackbody(double kelvin, struct pt_spd *out)
{
    double peak = planck(2897771.955 / kelvin, kelvin); /* Wien's displacement law, nm K */
    for (int i = 0; i < PT_SPD_COUNT; i++)
        out->v[i] = planck(PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM, kelvin) / peak;
}

static int noble_metal(const char *metal, int is_k, struct pt_spd *out)
{
    static const char *const names[] = {"Cu", "Ag", "Au", NULL};
    const int which = base_word_index(names, metal, strlen(metal));
    double pairs[2 * NOBLE_COUNT];
    if (which < 0)
        return 0;
    for (int i = 0; i < NOBLE_COUNT; i++) {
        pairs[2 * i] = 1239.84198 / noble_metals[i].ev;
        pairs[2 * i + 1] = noble_metals[i].nk[which][is_k];
    }
    from_table(pairs, NOBLE_COUNT, out);
    return 1;
}

/* Magnesia: Stephens and Malitson 1952. Rutile, ordinary ray: Devore 1951. */
static double oxide_index(const char *oxide, double um)
{
    double l2 = um * um;
    if (strcmp(oxide, "MgO") == 0)
        return sqrt(1 + 1.111033 * l2 / (l2 - 0.0712465 * 0.0712465) + 0.8460085 * l2 / (l2 - 0.1375204 * 0.1375204) +
                    7.808527 * l2 / (l2 - 26.89302 * 26.89302));
    return sqrt(5.913 + 0.2441 / (l2 - 0.0803));
}

int pt_spd_named(const char *name, struct pt_spd *out)
{
    char metal[8], which[4];
    int end = 0;
    double glass = pt_glass_index(name);
    if (glass > 0) {
        pt_spd_constant(glass, out);
        return 1;
    }
    if (sscanf(name, "metal-%7[^-]-%3[a-z]%n", metal, which, &end) != 2 || name[end] != '\0')
        return 0;
    const int is_k = strcmp(which, "k") == 0;
    if (!is_k && strcmp(which, "eta") != 0)
        return 0;
    if (noble_metal(metal, is_k, out))
        return 1;
    if (strcmp(metal, "Al") == 0) {
        from_table(is_k ? al_k : al_eta, sizeof al_k / sizeof al_k[0] / 2, out);
        return 1;
    }
    if (strcmp(metal, "CuZn") == 0) {
        from_table(is_k ? cuzn_k : cuzn_eta, sizeof cuzn_k / sizeof cuzn_k[0] / 2, out);
        return 1;
    }
    if (strcmp(metal, "MgO") == 0 || strcmp(metal, "TiO2") == 0) {
        for (int i = 0; i < PT_SPD_COUNT; i++)
            out->v[i] = is_k ? 0 : oxide_index(metal, (PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM) * 1e-3);
        return 1;
    }
    return 0;
}

double pt_glass_index(const char *name)
{
    /* Schott's catalogue values n_d. */
    static const struct glass {
        const char *name;
        double nd;
    } glasses[] = {{"glass-BK7", 1.5168},  {"glass-BAF10", 1.67003}, {"glass-FK51A", 1.48656}, {"glass-LASF9", 1.85025},
                   {"glass-F5", 1.67270},  {"glass-SF5", 1.67270},   {"glass-F10", 1.72825},   {"glass-SF10", 1.72825},
                   {"glass-F11", 1.78472}, {"glass-SF11", 1.78472}};
    const struct glass *glass = pt_row(glasses, name);
    return glass ? glass->nd : 0;
}

int pt_illuminant_named(const char *name, pt_vec3 *rgb)
{
    /* CIE 15, chromaticities for the 2° observer. */
    static const struct illuminant {
        const char *name;
        double x, y;
    } lights[] = {{"stdillum-A", 0.44757, 0.40745},   {"stdillum-D50", 0.34567, 0.35850}, {"stdillum-D65", 0.31271, 0.32902},
                  {"stdillum-F1", 0.3131, 0.3371},    {"stdillum-F2", 0.3721, 0.3751},    {"stdillum-F3", 0.4091, 0.3941},
                  {"stdillum-F4", 0.4402, 0.4031},    {"stdillum-F5", 0.3138, 0.3452},    {"stdillum-F6", 0.3779, 0.3882},
                  {"stdillum-F7", 0.3129, 0.3292},    {"stdillum-F8", 0.3458, 0.3586},    {"stdillum-F9", 0.3741, 0.3727},
                  {"stdillum-F10", 0.3458, 0.3588},   {"stdillum-F11", 0.3805, 0.3769},   {"stdillum-F12", 0.4370, 0.4042},
                  {"illum-acesD60", 0.32168, 0.33767}};
    const struct illuminant *light = pt_row(lights, name);
    if (light)
        *rgb = pt_xyz_to_rgb(light->x / light->y, 1, (1 - light->x - light->y) / light->y);
    return light != NULL;
}

pt_vec3 pt_xyz_to_rgb(double x, double y, double z)
{
    /* IEC 61966-2-1. */
    return v3((float)(3.2404542 * x - 1.5371385 * y - 0.4985314 * z),
              (float)(-0.9692660 * x + 1.8760108 * y + 0.0415560 * z),
              (float)(0.0556434 * x - 0.2040259 * y + 1.0572252 * z));
}

static double d65_at(int i) { return i % 2 == 0 ? d65_10nm[i / 2] : 0.5 * (d65_10nm[i / 2] + d65_10nm[i / 2 + 1]); }

/* ∫ spd(λ) light(λ) (x̄, ȳ, z̄)(λ) dλ, and ∫ ȳ light; light = D65 or 1. */
static void integrate(const struct pt_spd *spd, int under_d65, double xyz[3], double *y_of_light)
{
    xyz[0] = xyz[1] = xyz[2] = *y_of_light = 0;
    for (int i = 0; i < PT_SPD_COUNT; i++) {
        double nm = PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM, light = under_d65 ? d65_at(i) : 1, v = spd ? spd->v[i] : 1;
        xyz[0] += v * light * cie_x(nm);
        xyz[1] += v * light * cie_y(nm);
        xyz[2] += v * light * cie_z(nm);
        *y_of_light += light * cie_y(nm);
    }
}

pt_vec3 pt_spd_reflectance_rgb(const struct pt_spd *spd)
{
    double xyz[3], white[3], y;
    integrate(spd, 1, xyz, &y);
    integrate(NULL, 1, white, &y);
    pt_vec3 rgb = pt_xyz_to_rgb(xyz[0] / y, xyz[1] / y, xyz[2] / y),
            w = pt_xyz_to_rgb(white[0] / y, white[1] / y, white[2] / y);
    /* The fitted curves put white 1 % off: scale so that white is white. */
    return v3(rgb.x / w.x, rgb.y / w.y, rgb.z / w.z);
}

pt_vec3 pt_spd_emission_rgb(const struct pt_spd *spd)
{
    double xyz[3], y;
    integrate(spd, 0, xyz, &y);
    return pt_xyz_to_rgb(xyz[0] / y, xyz[1] / y, xyz[2] / y);
}

double pt_spd_luminous_mean(const struct pt_spd *spd)
{
    double sum = 0, weight = 0;
    for (int i = 0; i < PT_SPD_COUNT; i++) {
        double y = cie_y(PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM);
        sum += y * spd->v[i];
        weight += y;
    }
    return sum / weight;
}

void pt_spd_conductor_rgb(const struct pt_spd *eta, const struct pt_spd *k, pt_vec3 *eta_rgb, pt_vec3 *k_rgb)
{
    struct pt_spd f0;
    double n[3] = {0}, weight[3] = {0};
    for (int i = 0; i < PT_SPD_COUNT; i++) {
        double e = eta->v[i], kk = k->v[i] * k->v[i], nm = PT_SPD_FIRST_NM + i * PT_SPD_STEP_NM;
        f0.v[i] = ((e - 1) * (e - 1) + kk) / ((e + 1) * (e + 1) + kk);
        /* The part of each RGB response that is positive. */
        pt_vec3 w = pt_xyz_to_rgb(cie_x(nm), cie_y(nm), cie_z(nm));
        const float channel[3] = {w.x, w.y, w.z};
        for (int c = 0; c < 3; c++) {
            double positive = fmax(0, (double)channel[c]) * d65_at(i);
            n[c] += positive * e;
            weight[c] += positive;
        }
    }
    pt_vec3 r = pt_spd_reflectance_rgb(&f0);
    const float reflectance[3] = {r.x, r.y, r.z};
    float out_n[3], out_k[3];
    for (int c = 0; c < 3; c++) {
        /* F0 = ((n-1)² + k²) / ((n+1)² + k²) solved for k with the mean n; where no k does it, k = 0 and n from F0. */
        double f = fmin(fmax((double)reflectance[c], 1e-4), 0.9999), e = n[c] / weight[c];
        double k2 = (f * (e + 1) * (e + 1) - (e - 1) * (e - 1)) / (1 - f);
        if (k2 < 0) {
            k2 = 0;
            e = (1 + sqrt(f)) / (1 - sqrt(f));
        }
        out_n[c] = (float)e;
        out_k[c] = (float)sqrt(k2);
    }
    *eta_rgb = v3(out_n[0], out_n[1], out_n[2]);
    *k_rgb = v3(out_k[0], out_k[1], out_k[2]);
}

int pt_colour_space_named(const char *name)
{
    static const char *const names[] = {"srgb", "dci-p3", "rec2020", "aces2065-1", NULL};
    return base_word_index(names, name, strlen(name));
}

pt_vec3 pt_colour_to_rec709(int space, pt_vec3 c)
{
    /* From the primaries; ITU-R BT.2087 for Rec.2020, SMPTE EG 432-1 primaries with D65 for P3, ST 2065-1 with Bradford
     * adaptation from its white for ACES. */
    static const float m[4][9] = {
        {1, 0, 0, 0, 1, 0, 0, 0, 1},
        {1.2249402f, -0.2249404f, 0.0f, -0.0420569f, 1.0420571f, 0.0f, -0.0196376f, -0.0786361f, 1.0982735f},
        {1.6604910f, -0.5876411f, -0.0728499f, -0.1245505f, 1.1328999f, -0.0083494f, -0.0181508f, -0.1005789f, 1.1187297f},
        {2.5216494f, -1.1368885f, -0.3849175f, -0.2752136f, 1.3697052f, -0.0943924f, -0.0159250f, -0.1478064f, 1.1638058f}};
    const float *a = m[space];
    return v3(a[0] * c.x + a[1] * c.y + a[2] * c.z, a[3] * c.x + a[4] * c.y + a[5] * c.z,
              a[6] * c.x + a[7] * c.y + a[8] * c.z);
}
