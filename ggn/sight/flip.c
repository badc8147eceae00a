#include "sight/flip.h"

#include <math.h>
#include <stdlib.h>

#include "base/colour.h"
#include "base/pi.h"

/* Linear sRGB to XYZ in rationals (primaries and white of Rec. 709), rows X, Y, Z; the FLIP authors' matrix. */
static const double rgb_to_xyz[3][3] = {
    {10135552.0 / 24577794.0, 8788810.0 / 24577794.0, 4435075.0 / 24577794.0},
    {2613072.0 / 12288897.0, 8788810.0 / 12288897.0, 887015.0 / 12288897.0},
    {1425312.0 / 73733382.0, 8788810.0 / 73733382.0, 70074185.0 / 73733382.0},
};

/* Its inverse, and its white: the sums of its rows. */
static const double xyz_to_rgb[3][3] = {
    {3.2410032329763583, -1.5373989694887851, -0.49861588199636275},
    {-0.96922425220251629, 1.8759299836951757, 0.041554226340084724},
    {0.055639419851975416, -0.20401120612390991, 1.0571489771875331},
};
static const double white[3] = {0.9504285453771808, 1.0, 1.0889003707981277};

/* Linear RGB -> XYZ relative to the white. */
static void rgb_to_relative_xyz(const double rgb[3], double xyz[3])
{
    for (int i = 0; i < 3; i++)
        xyz[i] = (rgb_to_xyz[i][0] * rgb[0] + rgb_to_xyz[i][1] * rgb[1] + rgb_to_xyz[i][2] * rgb[2]) / white[i];
}

static double lab_f(double t)
{
    const double delta = 6.0 / 29.0;
    return t > delta * delta * delta ? cbrt(t) : t / (3.0 * delta * delta) + 4.0 / 29.0;
}

/* Linear RGB -> CIELAB with the Hunt effect: chroma fades with lightness (paper, section 4.1.3). */
static void rgb_to_hunt_lab(const double rgb[3], double lab[3])
{
    double xyz[3];
    rgb_to_relative_xyz(rgb, xyz);
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
static void to_ycxcz(const uint8_t *image, size_t n, float *planes[3])
{
    for (size_t i = 0; i < n; i++) {
        const uint8_t *code = image + 3 * i;
        double rgb[3] = {base_srgb_linear[code[0]], base_srgb_linear[code[1]], base_srgb_linear[code[2]]}, xyz[3];
        rgb_to_relative_xyz(rgb, xyz);
        planes[0][i] = (float)(116.0 * xyz[1] - 16.0);
        planes[1][i] = (float)(500.0 * (xyz[0] - xyz[1]));
        planes[2][i] = (float)(200.0 * (xyz[1] - xyz[2]));
    }
}

/* Taps of one-dimensional filters. */
enum { PPD_MOST = 1000, RADIUS_MOST = 136 }; /* the widest filter reaches 0.1351 degrees far */
struct filters {
    int radius;
    float taps[4][2 * RADIUS_MOST + 1]; /* the first 2 radius + 1 */
};

/* Sensitivity of the eye to contrast (paper, table 1 and eq. 3): achromatic, red-green, and blue-yellow as the sum of two,
 * each a Gaussian exp(-(pi x)^2 / b) of x in degrees along both axes. */
enum { ACHROMATIC, RED_GREEN, BLUE_YELLOW, BLUE_YELLOW_2 };

static void csf_init(struct filters *f, double ppd)
{
    static const double b[4] = {0.0047, 0.0053, 0.04, 0.025};
    double sum[4] = {0.0};
    f->radius = (int)ceil(3.0 * sqrt(0.04 / (2.0 * BASE_PI * BASE_PI)) * ppd);
    for (int k = 0; k < 4; k++)
        for (int i = -f->radius; i <= f->radius; i++) {
            double x = i / ppd, v = exp(-BASE_PI * BASE_PI * x * x / b[k]);
            f->taps[k][i + f->radius] = (float)v;
            sum[k] += v;
        }
    double k1 = 34.1 * sqrt(BASE_PI / 0.04), k2 = 13.5 * sqrt(BASE_PI / 0.025);
    double total = k1 * sum[2] * sum[2] + k2 * sum[3] * sum[3];
    for (int i = 0; i <= 2 * f->radius; i++) {
        for (int k = ACHROMATIC; k <= RED_GREEN; k++)
            f->taps[k][i] = (float)((double)f->taps[k][i] / sum[k]);
        f->taps[BLUE_YELLOW][i] = (float)((double)f->taps[BLUE_YELLOW][i] * sqrt(k1 / total));
        f->taps[BLUE_YELLOW_2][i] = (float)((double)f->taps[BLUE_YELLOW_2][i] * sqrt(k2 / total));
    }
}

/* Filters the planes and turns them into Hunt-adjusted Lab in place. tmp, tmp2: one plane each. */
static void perceive(const struct filters *f, float *planes[3], float *tmp, float *tmp2, int w, int h)
{
    size_t n = (size_t)w * (size_t)h;
    convolve(planes[0], tmp, planes[0], w, h, f->taps[ACHROMATIC], f->taps[ACHROMATIC], f->radius);
    convolve(planes[1], tmp, planes[1], w, h, f->taps[RED_GREEN], f->taps[RED_GREEN], f->radius);
    convolve(planes[2], tmp, tmp2, w, h, f->taps[BLUE_YELLOW_2], f->taps[BLUE_YELLOW_2], f->radius);
    convolve(planes[2], tmp, planes[2], w, h, f->taps[BLUE_YELLOW], f->taps[BLUE_YELLOW], f->radius);
    for (size_t i = 0; i < n; i++) {
        double y = ((double)planes[0][i] + 16.0) / 116.0;
        double bz = (double)planes[2][i] + (double)tmp2[i];
        double xyz[3] = {(y + (double)planes[1][i] / 500.0) * white[0], y * white[1], (y - bz / 200.0) * white[2]};
        double rgb[3], lab[3];
        for (int k = 0; k < 3; k++) {
            double v = xyz_to_rgb[k][0] * xyz[0] + xyz_to_rgb[k][1] * xyz[1] + xyz_to_rgb[k][2] * xyz[2];
            rgb[k] = v > 0.0 ? (v < 1.0 ? v : 1.0) : 0.0;
        }
        rgb_to_hunt_lab(rgb, lab);
        for (int k = 0; k < 3; k++)
            planes[k][i] = (float)lab[k];
    }
}

/* Edge and point detectors: first and second derivative of a Gaussian, positive and negative taps each summing to one. */
enum { BLUR, EDGE, POINT };

static void features_init(struct filters *f, double ppd)
{
    const double sd = 0.5 * 0.082 * ppd;
    const int r = f->radius = (int)ceil(3.0 * sd);
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
                f->taps[BLUR][x + r] = (float)(g / sum);
                f->taps[EDGE][x + r] = (float)(e / edge_sum);
                f->taps[POINT][x + r] = (float)(p / (p > 0.0 ? plus : minus));
            }
        }
}

/* magnitude[i] = |(detector along x, detector along y)| of the lightness plane. */
static void detect(const float *y, const struct filters *f, const float *detector, float *tmp, float *dx, float *magnitude,
                   int w, int h)
{
    convolve(y, tmp, dx, w, h, detector, f->taps[BLUR], f->radius);
    convolve(y, tmp, magnitude, w, h, f->taps[BLUR], detector, f->radius);
    for (size_t i = 0, n = (size_t)w * (size_t)h; i < n; i++)
        magnitude[i] = (float)hypot((double)dx[i], (double)magnitude[i]);
}

/* Eq. 5: difference[i] = (max(|edges|, |points|) / sqrt 2)^0.5. y: the two lightness planes; s: five planes of scratch. */
static void feature_difference(float *const y[2], const struct filters *f, float *const s[5], int w, int h,
                               float *difference)
{
    size_t n = (size_t)w * (size_t)h;
    for (int kind = 0; kind < 2; kind++) {
        const float *detector = f->taps[kind == 0 ? EDGE : POINT];
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

int ggn_flip(const uint8_t *reference, const uint8_t *test, int width, int height, double pixels_per_degree, float *map,
             struct ggn_flip_stats *stats, struct base_err *err)
{
    if (width < 1 || height < 1 || !(pixels_per_degree >= 1.0 && pixels_per_degree <= PPD_MOST))
        return base_fail(err, BASE_EINVAL, "FLIP: %dx%d at %g pixels per degree", width, height, pixels_per_degree);
    enum { PLANES = 14 };
    size_t n = (size_t)width * (size_t)height;
    struct filters csf, features;
    float *buffer = malloc(PLANES * n * sizeof *buffer), *p[PLANES];
    if (!buffer)
        return base_fail_nomem(err, "FLIP");
    csf_init(&csf, pixels_per_degree);
    features_init(&features, pixels_per_degree);
    for (int i = 0; i < PLANES; i++)
        p[i] = buffer + (size_t)i * n;
    float *lab[2][3] = {{p[0], p[1], p[2]}, {p[3], p[4], p[5]}};
    float *light[2] = {p[6], p[7]}, *scratch[5] = {p[8], p[9], p[10], p[11], p[12]}, *feature = p[13];
    for (int k = 0; k < 2; k++) {
        to_ycxcz(k == 0 ? reference : test, n, lab[k]);
        for (size_t i = 0; i < n; i++)
            light[k][i] = (float)(((double)lab[k][0][i] + 16.0) / 116.0);
        perceive(&csf, lab[k], scratch[0], scratch[1], width, height);
    }
    feature_difference(light, &features, scratch, width, height, feature);
    double green[3], blue[3], sum = 0.0, max = 0.0;
    rgb_to_hunt_lab((const double[3]){0.0, 1.0, 0.0}, green);
    rgb_to_hunt_lab((const double[3]){0.0, 0.0, 1.0}, blue);
    const double e_max = hyab_power(green, blue); /* the largest difference */
    /* An edge or point that appears or vanishes is seen where its colour alone is not: hence the power below 1. */
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
    free(buffer);
    return 0;
}
