#include "observer/flip.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/colour.h"
#include "base/pi.h"

/* Linear sRGB to XYZ in rationals (primaries and white of Rec. 709), rows X, Y, Z; the FLIP authors' matrix. */
static const double rgb_to_xyz[3][3] = {
    {10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0},
    {2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0},
    {1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0},
};

struct colour {
    double white[3];
    double xyz_to_rgb[3][3];
};

static void invert3(double m[3][3], double inv[3][3])
{
    double det = 0.0;
    for (int i = 0; i < 3; i++)
        det += m[0][i] * (m[1][(i + 1) % 3] * m[2][(i + 2) % 3] - m[1][(i + 2) % 3] * m[2][(i + 1) % 3]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            inv[j][i] = (m[(i + 1) % 3][(j + 1) % 3] * m[(i + 2) % 3][(j + 2) % 3] -
                         m[(i + 1) % 3][(j + 2) % 3] * m[(i + 2) % 3][(j + 1) % 3]) /
                        det;
}

static void colour_init(struct colour *c)
{
    double m[3][3];
    memcpy(m, rgb_to_xyz, sizeof m);
    for (int i = 0; i < 3; i++)
        c->white[i] = m[i][0] + m[i][1] + m[i][2];
    invert3(m, c->xyz_to_rgb);
}

/* Linear RGB -> XYZ relative to the white. */
static void rgb_to_relative_xyz(const struct colour *c, const double rgb[3], double xyz[3])
{
    for (int i = 0; i < 3; i++)
        xyz[i] = (rgb_to_xyz[i][0] * rgb[0] + rgb_to_xyz[i][1] * rgb[1] + rgb_to_xyz[i][2] * rgb[2]) / c->white[i];
}

static double lab_f(double t)
{
    const double delta = 6.0 / 29.0;
    return t > delta * delta * delta ? cbrt(t) : t / (3.0 * delta * delta) + 4.0 / 29.0;
}

/* Linear RGB -> CIELAB with the Hunt effect: chroma fades with lightness (paper, section 4.1.3). */
static void rgb_to_hunt_lab(const struct colour *c, const double rgb[3], double lab[3])
{
    double xyz[3];
    rgb_to_relative_xyz(c, rgb, xyz);
    double fx = lab_f(xyz[0]), fy = lab_f(xyz[1]), fz = lab_f(xyz[2]);
    lab[0] = 116.0 * fy - 16.0;
    lab[1] = 0.01 * lab[0] * 500.0 * (fx - fy);
    lab[2] = 0.01 * lab[0] * 200.0 * (fy - fz);
}

/* HyAB distance (Abasi et al. 2019) to the power q_c = 0.7. */
static double hyab_power(const double a[3], const double b[3])
{
    return pow(fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]), 0.7);
}

/* Maps the colour difference to [0,1]: p_t = 0.95 of the range up to p_c = 0.4 of the largest difference. */
static double redistribute(double e, double e_max)
{
    double knee = 0.4 * e_max;
    return e < knee ? 0.95 / knee * e : 0.95 + (e - knee) / (e_max - knee) * 0.05;
}

/* One-dimensional Gaussian exp(-(pi x)^2 / b), x in degrees, not normalised. */
static void csf_taps(double b, double ppd, int radius, float *w, double *sum)
{
    *sum = 0.0;
    for (int i = -radius; i <= radius; i++) {
        double x = i / ppd;
        double v = exp(-BASE_PI * BASE_PI * x * x / b);
        w[i + radius] = (float)v;
        *sum += v;
    }
}

static int clamp_index(int i, int n) { return i < 0 ? 0 : i >= n ? n - 1 : i; }

/* One row: interior columns tap by tap (the inner loop runs over columns, so it vectorises), border columns one by one. */
static void convolve_row(const float *in, float *out, int w, const float *wx, int radius)
{
    int begin = radius < w ? radius : w, end = w - radius > begin ? w - radius : begin;
    for (int x = begin; x < end; x++)
        out[x] = 0.0f;
    for (int k = -radius; k <= radius; k++)
        for (int x = begin; x < end; x++)
            out[x] += wx[k + radius] * in[x + k];
    for (int x = 0; x < w; x = x + 1 == begin ? end : x + 1) {
        float s = 0.0f;
        for (int k = -radius; k <= radius; k++)
            s += wx[k + radius] * in[clamp_index(x + k, w)];
        out[x] = s;
    }
}

/* out = in convolved with wx along x and wy along y; borders repeat. tmp is [h][w]; out may be in. */
static void convolve(const float *in, float *tmp, float *out, int w, int h, const float *wx, const float *wy, int radius)
{
    size_t step = (size_t)w;
    for (int y = 0; y < h; y++)
        convolve_row(in + (size_t)y * step, tmp + (size_t)y * step, w, wx, radius);
    for (int y = 0; y < h; y++) {
        float *row = out + (size_t)y * step;
        for (int x = 0; x < w; x++)
            row[x] = 0.0f;
        for (int k = -radius; k <= radius; k++) {
            const float *from = tmp + (size_t)clamp_index(y + k, h) * step;
            for (int x = 0; x < w; x++)
                row[x] += wy[k + radius] * from[x];
        }
    }
}

/* YCxCz planes (linearised CIELAB) of an image. */
static void to_ycxcz(const struct colour *c, const uint8_t *image, size_t n, float *planes[3])
{
    for (size_t i = 0; i < n; i++) {
        const uint8_t *code = image + 3 * i;
        double rgb[3] = {base_srgb_linear[code[0]], base_srgb_linear[code[1]], base_srgb_linear[code[2]]}, xyz[3];
        rgb_to_relative_xyz(c, rgb, xyz);
        planes[0][i] = (float)(116.0 * xyz[1] - 16.0);
        planes[1][i] = (float)(500.0 * (xyz[0] - xyz[1]));
        planes[2][i] = (float)(200.0 * (xyz[1] - xyz[2]));
    }
}

/* Sensitivity of the eye to contrast (paper, table 1 and eq. 3): achromatic, red-green, blue-yellow. */
struct csf {
    int radius;
    float *a, *rg, *by1, *by2; /* 2r+1 taps each; by = by1 (x) by1 + by2 (x) by2 */
};

static int csf_init(struct csf *f, double ppd, struct base_err *err)
{
    f->radius = (int)ceil(3.0 * sqrt(0.04 / (2.0 * BASE_PI * BASE_PI)) * ppd);
    size_t n = 2 * (size_t)f->radius + 1;
    float *all = malloc(4 * n * sizeof *all);
    if (!all)
        return base_fail_nomem(err, "FLIP filters");
    f->a = all;
    f->rg = all + n;
    f->by1 = all + 2 * n;
    f->by2 = all + 3 * n;
    double sa, sr, s1, s2;
    csf_taps(0.0047, ppd, f->radius, f->a, &sa);
    csf_taps(0.0053, ppd, f->radius, f->rg, &sr);
    csf_taps(0.04, ppd, f->radius, f->by1, &s1);
    csf_taps(0.025, ppd, f->radius, f->by2, &s2);
    double k1 = 34.1 * sqrt(BASE_PI / 0.04), k2 = 13.5 * sqrt(BASE_PI / 0.025), total = k1 * s1 * s1 + k2 * s2 * s2;
    for (size_t i = 0; i < n; i++) {
        f->a[i] = (float)((double)f->a[i] / sa);
        f->rg[i] = (float)((double)f->rg[i] / sr);
        f->by1[i] = (float)((double)f->by1[i] * sqrt(k1 / total));
        f->by2[i] = (float)((double)f->by2[i] * sqrt(k2 / total));
    }
    return 0;
}

/* Filters the planes and turns them into Hunt-adjusted Lab in place. tmp, tmp2: one plane each. */
static void perceive(const struct colour *c, const struct csf *f, float *planes[3], float *tmp, float *tmp2, int w, int h)
{
    size_t n = (size_t)w * (size_t)h;
    convolve(planes[0], tmp, planes[0], w, h, f->a, f->a, f->radius);
    convolve(planes[1], tmp, planes[1], w, h, f->rg, f->rg, f->radius);
    convolve(planes[2], tmp, tmp2, w, h, f->by2, f->by2, f->radius);
    convolve(planes[2], tmp, planes[2], w, h, f->by1, f->by1, f->radius);
    for (size_t i = 0; i < n; i++) {
        double y = ((double)planes[0][i] + 16.0) / 116.0;
        double bz = (double)planes[2][i] + (double)tmp2[i];
        double xyz[3] = {(y + (double)planes[1][i] / 500.0) * c->white[0], y * c->white[1], (y - bz / 200.0) * c->white[2]};
        double rgb[3], lab[3];
        for (int k = 0; k < 3; k++) {
            double v = c->xyz_to_rgb[k][0] * xyz[0] + c->xyz_to_rgb[k][1] * xyz[1] + c->xyz_to_rgb[k][2] * xyz[2];
            rgb[k] = v > 0.0 ? (v < 1.0 ? v : 1.0) : 0.0;
        }
        rgb_to_hunt_lab(c, rgb, lab);
        for (int k = 0; k < 3; k++)
            planes[k][i] = (float)lab[k];
    }
}

/* Edge and point detectors: first and second derivative of a Gaussian, positive and negative taps each summing to one. */
struct features {
    int radius;
    float *g, *edge, *point;
};

static int features_init(struct features *f, double ppd, struct base_err *err)
{
    double sd = 0.5 * 0.082 * ppd;
    f->radius = (int)ceil(3.0 * sd);
    int r = f->radius;
    size_t n = 2 * (size_t)r + 1;
    float *all = malloc(3 * n * sizeof *all);
    if (!all)
        return base_fail_nomem(err, "FLIP filters");
    f->g = all;
    f->edge = all + n;
    f->point = all + 2 * n;
    double sum = 0.0, edge_sum = 0.0, plus = 0.0, minus = 0.0;
    for (int pass = 0; pass < 2; pass++)
        for (int x = -r; x <= r; x++) {
            double g = exp(-x * x / (2.0 * sd * sd)), e = -x * g, p = (x * x / (sd * sd) - 1.0) * g;
            if (pass == 0) {
                sum += g;
                edge_sum += e > 0.0 ? e : 0.0;
                plus += p > 0.0 ? p : 0.0;
                minus += p < 0.0 ? -p : 0.0;
            } else {
                f->g[x + r] = (float)(g / sum);
                f->edge[x + r] = (float)(e / edge_sum);
                f->point[x + r] = (float)(p / (p > 0.0 ? plus : minus));
            }
        }
    return 0;
}

/* magnitude[i] = |(detector along x, detector along y)| of the lightness plane. */
static void detect(const float *y, const struct features *f, const float *detector, float *tmp, float *dx, float *magnitude,
                   int w, int h)
{
    convolve(y, tmp, dx, w, h, detector, f->g, f->radius);
    convolve(y, tmp, magnitude, w, h, f->g, detector, f->radius);
    for (size_t i = 0, n = (size_t)w * (size_t)h; i < n; i++)
        magnitude[i] = (float)hypot((double)dx[i], (double)magnitude[i]);
}

/* Eq. 5: difference[i] = (max(|edges|, |points|) / sqrt 2)^0.5. y: the two lightness planes; s: five planes of scratch. */
static void feature_difference(float *const y[2], const struct features *f, float *const s[5], int w, int h,
                               float *difference)
{
    size_t n = (size_t)w * (size_t)h;
    for (int kind = 0; kind < 2; kind++) {
        const float *detector = kind == 0 ? f->edge : f->point;
        for (int k = 0; k < 2; k++)
            detect(y[k], f, detector, s[0], s[1], s[2 + k], w, h);
        for (size_t i = 0; i < n; i++) {
            double d = fabs((double)s[2][i] - (double)s[3][i]);
            if (kind == 0 || d > (double)difference[i])
                difference[i] = (float)d;
        }
    }
    for (size_t i = 0; i < n; i++)
        difference[i] = (float)sqrt((double)difference[i] / sqrt(2.0));
}

static double largest_difference(const struct colour *c)
{
    double lab[2][3];
    rgb_to_hunt_lab(c, (const double[3]){0.0, 1.0, 0.0}, lab[0]);
    rgb_to_hunt_lab(c, (const double[3]){0.0, 0.0, 1.0}, lab[1]);
    return hyab_power(lab[0], lab[1]);
}

int ggn_flip(const uint8_t *reference, const uint8_t *test, int width, int height, double pixels_per_degree, float *map,
             struct ggn_flip_stats *stats, struct base_err *err)
{
    if (width < 1 || height < 1 || !(pixels_per_degree >= 1.0 && pixels_per_degree <= 1000.0))
        return base_fail(err, BASE_EINVAL, "FLIP: %dx%d at %g pixels per degree", width, height, pixels_per_degree);
    enum { PLANES = 14 };
    size_t n = (size_t)width * (size_t)height;
    struct colour c;
    struct csf csf = {0};
    struct features features = {0};
    float *buffer = malloc(PLANES * n * sizeof *buffer);
    int rc = !buffer ? base_fail_nomem(err, "FLIP") : 0;
    if (!rc)
        rc = csf_init(&csf, pixels_per_degree, err);
    if (!rc)
        rc = features_init(&features, pixels_per_degree, err);
    if (rc)
        goto out;

    float *p[PLANES];
    for (int i = 0; i < PLANES; i++)
        p[i] = buffer + (size_t)i * n;
    float *lab[2][3] = {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}};
    float *light[2] = {p[6], p[7]}, *scratch[5] = {p[8], p[9], p[10], p[11], p[12]}, *feature = p[13];
    colour_init(&c);
    for (int k = 0; k < 2; k++) {
        to_ycxcz(&c, k == 0 ? reference : test, n, lab[k]);
        for (size_t i = 0; i < n; i++)
            light[k][i] = (float)(((double)lab[k][0][i] + 16.0) / 116.0);
        perceive(&c, &csf, lab[k], scratch[0], scratch[1], width, height);
    }
    feature_difference(light, &features, scratch, width, height, feature);
    /* An edge or point that appears or vanishes is seen where its colour alone is not: hence the power below 1. */
    double e_max = largest_difference(&c), sum = 0.0, max = 0.0;
    for (size_t i = 0; i < n; i++) {
        double a[3] = {(double)lab[0][0][i], (double)lab[0][1][i], (double)lab[0][2][i]};
        double b[3] = {(double)lab[1][0][i], (double)lab[1][1][i], (double)lab[1][2][i]};
        double e = pow(redistribute(hyab_power(a, b), e_max), 1.0 - (double)feature[i]);
        sum += e;
        max = e > max ? e : max;
        if (map)
            map[i] = (float)e;
    }
    *stats = (struct ggn_flip_stats){.mean = sum / (double)n, .max = max};
out:
    free(features.g);
    free(csf.a);
    free(buffer);
    return rc;
}
