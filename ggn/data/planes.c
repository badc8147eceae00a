#include "data/planes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/colour.h"

size_t ggn_plane_raw_bytes(uint32_t plane, uint32_t width, uint32_t height)
{
    size_t pixels = (size_t)width * height;
    switch (plane) {
    case GGN_PLANE_DISPLAY:
    case GGN_PLANE_FINE:
        return 3 * pixels;
    case GGN_PLANE_HALF_LOG:
        return pixels;
    case GGN_PLANE_MEAN_F16:
    case GGN_PLANE_HALF_F16:
        return 6 * pixels;
    default:
        return 0;
    }
}

uint32_t ggn_plane_filters(uint32_t plane)
{
    switch (plane) {
    case GGN_PLANE_DISPLAY:
    case GGN_PLANE_FINE:
        return GGN_FILTER_AVERAGE | GGN_FILTER_GREEN;
    case GGN_PLANE_MEAN_F16:
    case GGN_PLANE_HALF_F16:
        return GGN_FILTER_SHUFFLE;
    default:
        return 0;
    }
}

/* Little-endian 16-bit values <-> all low bytes, then all high bytes. */
static int shuffle(uint8_t *data, size_t bytes, int forward, struct base_err *err)
{
    uint8_t *copy = malloc(bytes);
    if (!copy)
        return base_fail_nomem(err, "plane");
    memcpy(copy, data, bytes);
    size_t n = bytes / 2;
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < 2; k++) {
            if (forward)
                data[k * n + i] = copy[2 * i + k];
            else
                data[2 * i + k] = copy[k * n + i];
        }
    free(copy);
    return 0;
}

static uint8_t predict(const uint8_t *at, size_t x, size_t y, size_t width)
{
    unsigned left = x > 0 ? at[-1] : 0u, up = y > 0 ? *(at - width) : 0u;
    return (uint8_t)((left + up) / 2);
}

/* sign +1 undoes the difference (first pixel to last), -1 makes it (last to first, so that neighbours are still whole). */
static void average(uint8_t *channel, size_t width, size_t height, int undo)
{
    size_t n = width * height;
    for (size_t k = 0; k < n; k++) {
        size_t i = undo ? k : n - 1 - k;
        uint8_t p = predict(channel + i, i % width, i / width, width);
        channel[i] = (uint8_t)(undo ? channel[i] + p : channel[i] - p);
    }
}

static void green(uint8_t *data, size_t pixels, int undo)
{
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c += 2) {
            uint8_t *v = &data[c * pixels + i], g = data[pixels + i];
            *v = (uint8_t)(undo ? *v + g : *v - g);
        }
}

int ggn_plane_unfilter(uint32_t plane, uint32_t filter, uint8_t *data, uint32_t width, uint32_t height, struct base_err *err)
{
    size_t pixels = (size_t)width * height;
    if ((filter & ~ggn_plane_filters(plane)) != 0)
        return base_fail(err, BASE_EINVAL, "filter %u does not fit plane %u", filter, plane);
    if (filter & GGN_FILTER_SHUFFLE)
        return shuffle(data, ggn_plane_raw_bytes(plane, width, height), 0, err);
    if (filter & GGN_FILTER_AVERAGE)
        for (size_t c = 0; c < 3; c++)
            average(data + c * pixels, width, height, 1);
    if (filter & GGN_FILTER_GREEN)
        green(data, pixels, 1);
    return 0;
}

int ggn_plane_filter(uint32_t plane, uint32_t filter, uint8_t *data, uint32_t width, uint32_t height, struct base_err *err)
{
    size_t pixels = (size_t)width * height;
    if ((filter & ~ggn_plane_filters(plane)) != 0)
        return base_fail(err, BASE_EINVAL, "filter %u does not fit plane %u", filter, plane);
    if (filter & GGN_FILTER_SHUFFLE)
        return shuffle(data, ggn_plane_raw_bytes(plane, width, height), 1, err);
    if (filter & GGN_FILTER_GREEN)
        green(data, pixels, 0);
    if (filter & GGN_FILTER_AVERAGE)
        for (size_t c = 0; c < 3; c++)
            average(data + c * pixels, width, height, 0);
    return 0;
}

float ggn_half_to_float(uint16_t half)
{
    int exponent = half >> 10 & 31, mantissa = half & 1023;
    double value = exponent == 0    ? ldexp(mantissa, -24)
                   : exponent == 31 ? (mantissa == 0 ? (double)INFINITY : (double)NAN)
                                    : ldexp(1024 + mantissa, exponent - 25);
    return (float)(half & 0x8000 ? -value : value);
}

uint16_t ggn_half_from_float(float value)
{
    if (isnan(value))
        return 0;
    uint16_t sign = signbit(value) ? 0x8000 : 0;
    double a = fabs((double)value);
    if (a >= 65504.0)
        return (uint16_t)(sign | 0x7bff);
    if (a < ldexp(1.0, -14)) /* subnormal, or rounds up to the smallest normal, whose bits follow on */
        return (uint16_t)(sign | (uint16_t)lrint(ldexp(a, 24)));
    int exponent;
    double fraction = frexp(a, &exponent); /* a = fraction 2^exponent, fraction in [1/2, 1) */
    long mantissa = lrint(ldexp(fraction, 11)); /* 1024 .. 2048; 2048 carries into the exponent by itself */
    long bits = ((long)(exponent + 13) << 10) + mantissa;
    return (uint16_t)(sign | (uint16_t)(bits > 0x7bff ? 0x7bff : bits));
}

/* Linear bounds of the display codes: code d stands for [edge[d], edge[d+1]). */
static double code_edge(int d)
{
    return d <= 0 ? 0.0 : base_srgb_eotf((d - 0.5) / 255.0);
}

uint8_t ggn_fine_encode(uint8_t display, double x)
{
    double lo = code_edge(display);
    if (display == 255) {
        double q = x > lo ? round(16.0 * log2(x / lo)) : 0.0;
        return (uint8_t)(q < 255.0 ? q : 255.0);
    }
    double q = floor(8.0 * (x - lo) / (code_edge(display + 1) - lo));
    return (uint8_t)(q > 0.0 ? (q < 7.0 ? q : 7.0) : 0.0);
}

double ggn_fine_decode(uint8_t display, uint8_t fine)
{
    double lo = code_edge(display);
    if (display == 255)
        return lo * exp2(fine / 16.0);
    return lo + (fine + 0.5) / 8.0 * (code_edge(display + 1) - lo);
}

uint8_t ggn_halflog_encode(double value)
{
    double a = fabs(value);
    if (!(a >= exp2(-19.875)))
        return 0;
    double m = round(4.0 * log2(a)) + 80.0;
    return (uint8_t)((m > 1.0 ? (m < 127.0 ? m : 127.0) : 1.0) + (value < 0.0 ? 128.0 : 0.0));
}

double ggn_halflog_decode(uint8_t code)
{
    if ((code & 127) == 0)
        return 0.0;
    double a = exp2(((code & 127) - 80) / 4.0);
    return code & 128 ? -a : a;
}
