#include "sight/viewing.h"

#include <math.h>
#include <stddef.h>

/* log2 of S_s and of S_t / S_s at 2^(k - 3) cycles per degree, of 37 cd/m^2: the middle grey of a display whose white is 200
 * cd/m^2. From ColorVideoVDP's tables of castleCSF, by scripts/lablib/cvvdp.py --sensitivities. */
enum { OCTAVES = 10, FIRST_OCTAVE = -3 };
static const double sustained[OCTAVES] = {4.1136, 5.1115, 6.1033, 7.1694, 8.0139, 8.0456, 7.1619, 5.4363, 3.0284, -0.0010};
static const double transient[OCTAVES] = {2.3522,  1.8897,  1.2757,  0.4554,  -0.3103,
                                          -0.6921, -0.7827, -0.6038, -0.1087, 0.8052};

/* Responses of the two temporal filters at `hz` (there, sigma_tf and beta_tf). */
static double sustained_response(double hz) { return exp(-pow(hz, 1.3314) / 5.79336); }

static double transient_response(double hz)
{
    double off = pow(hz, 0.1898) - pow(5.0, 0.1898);
    return exp(-off * off / 0.12314);
}

/* |F|^2 of the filter with that response: 0.25 s of taps, an odd number n; by Parseval from its n frequencies. */
static double squared_taps(double (*response)(double hz), double fps)
{
    const int half = (int)ceil(0.125 * fps);
    double sum = response(0.0) * response(0.0);
    for (int k = 1; k <= half; k++) {
        double r = response(0.5 * fps * k / half);
        sum += 2.0 * r * r;
    }
    return sum / (2 * half + 1);
}

static double log_at(const double table[OCTAVES], double cycles_per_degree)
{
    double at = fmin(fmax(log2(cycles_per_degree) - FIRST_OCTAVE, 0.0), OCTAVES - 1.0);
    int k = (int)fmin(at, OCTAVES - 2.0);
    return table[k] + (at - k) * (table[k + 1] - table[k]);
}

/* Whole millionths: the functions of other C libraries differ in their last bits. */
static double rounded(double v) { return round(1e6 * v) * 1e-6; }

void ggn_viewing_init(struct ggn_viewing *v, double fps, double pixels_per_degree)
{
    const double slow = squared_taps(sustained_response, fps), fast = squared_taps(transient_response, fps);
    for (int k = 0; k < GGN_VIEWING_BANDS; k++) {
        const double cycles = sqrt(0.125) * exp2(-k), more = exp2(log_at(transient, pixels_per_degree * cycles));
        v->still[k] =
            rounded(exp2(log_at(sustained, pixels_per_degree * cycles) - log_at(sustained, GGN_VIEWING_PPD * cycles)));
        v->gain[k] = v->still[k] * rounded(sqrt(slow + fast * more * more));
    }
}

/* Puts the means of 2x2 pixels in the place of the picture; returns the mean square of what they leave. */
static double halve(float *at, int width, int height)
{
    const size_t row = (size_t)width, columns = row / 2, rows = (size_t)height / 2;
    double left = 0.0;
    for (size_t y = 0; y < rows; y++)
        for (size_t x = 0; x < columns; x++) {
            const float *p = at + 2 * y * row + 2 * x;
            const double v[4] = {(double)p[0], (double)p[1], (double)p[row], (double)p[row + 1]};
            const double mean = 0.25 * (v[0] + v[1] + v[2] + v[3]);
            for (int i = 0; i < 4; i++)
                left += 0.25 * (v[i] - mean) * (v[i] - mean);
            at[y * columns + x] = (float)mean; /* never beyond p */
        }
    return left / (double)(columns * rows);
}

double ggn_viewing_gain(const struct ggn_viewing *v, float *noise, int width, int height, double *still)
{
    double seen = 0.0, standing = 0.0, all = 0.0, rest = 0.0;
    int k = 0;
    for (; width > 1 && height > 1 && k + 1 < GGN_VIEWING_BANDS; k++, width /= 2, height /= 2) {
        const double band = halve(noise, width, height);
        all += band;
        seen += band * v->gain[k] * v->gain[k];
        standing += band * v->still[k] * v->still[k];
    }
    for (size_t i = 0; i < (size_t)width * (size_t)height; i++) /* the largest squares, and what they have in common */
        rest += (double)noise[i] * (double)noise[i];
    rest /= (double)width * (double)height;
    all += rest;
    seen += rest * v->gain[k] * v->gain[k];
    standing += rest * v->still[k] * v->still[k];
    if (still)
        *still = all > 0.0 ? sqrt(standing / all) : v->still[0];
    return all > 0.0 ? sqrt(seen / all) : v->gain[0];
}
