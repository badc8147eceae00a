#include "sequence/planes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/colour.h"
#include "base/bytes.h"

/* Bytes of a pixel before compression, and which filters may be on it; zeros: not known. */
static const struct {
    uint32_t bytes, filters;
} planes[] = {
    [SEQ_PLANE_DISPLAY] = {3, SEQ_FILTER_AVERAGE | SEQ_FILTER_GREEN},
    [SEQ_PLANE_FINE] = {3, SEQ_FILTER_AVERAGE | SEQ_FILTER_GREEN},
    [SEQ_PLANE_HALF_LOG] = {1, 0},
    [SEQ_PLANE_MEAN_F16] = {6, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_HALF_F16] = {6, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_COLOR] = {12, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_WEIGHT] = {4, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_SPP] = {4, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_MOMENT2] = {4, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_HALF] = {12, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_ALBEDO] = {12, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_NORMAL] = {12, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_DEPTH] = {4, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_DROPPED] = {4, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_DROPPED_HALF] = {4, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_REST] = {12, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_DENOISED] = {12, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_DENOISED_HALF] = {12, SEQ_FILTER_SHUFFLE},
    [SEQ_PLANE_DENOISED_REST] = {12, SEQ_FILTER_SHUFFLE},
};
enum { PLANES = sizeof planes / sizeof *planes };

uint32_t seq_plane_channels(uint32_t plane)
{
    return plane < PLANES && plane >= SEQ_PLANE_COLOR ? planes[plane].bytes / (uint32_t)sizeof(float) : 0;
}

size_t seq_plane_raw_bytes(uint32_t plane, uint32_t width, uint32_t height)
{
    return plane < PLANES ? planes[plane].bytes * (size_t)width * height : 0;
}

uint32_t seq_plane_filters(uint32_t plane) { return plane < PLANES ? planes[plane].filters : 0; }

/* Little-endian values of `size` bytes <-> all lowest bytes first, all highest last. */
static int shuffle(uint8_t *data, size_t bytes, size_t size, int undo, struct base_err *err)
{
    uint8_t *copy = malloc(bytes);
    if (!copy)
        return base_fail_nomem(err, "plane");
    memcpy(copy, data, bytes);
    const size_t n = bytes / size;
    for (size_t k = 0; k < size; k++)
        for (size_t i = 0; i < n; i++) {
            if (undo)
                data[size * i + k] = copy[k * n + i];
            else
                data[k * n + i] = copy[size * i + k];
        }
    free(copy);
    return 0;
}

static uint8_t predict(const uint8_t *at, size_t x, size_t y, size_t width)
{
    unsigned left = x > 0 ? at[-1] : 0u, up = y > 0 ? *(at - width) : 0u;
    return (uint8_t)((left + up) / 2);
}

/* Undoes the difference (first pixel to last), or makes it (last to first, so that neighbours are still whole). */
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

int seq_plane_filter(uint32_t plane, uint32_t filter, uint8_t *data, uint32_t width, uint32_t height, int undo,
                     struct base_err *err)
{
    size_t pixels = (size_t)width * height;
    if ((filter & ~seq_plane_filters(plane)) != 0)
        return base_fail(err, BASE_EINVAL, "filter %u does not fit plane %u", filter, plane);
    if (filter & SEQ_FILTER_SHUFFLE)
        return shuffle(data, seq_plane_raw_bytes(plane, width, height),
                       seq_plane_channels(plane) ? sizeof(float) : sizeof(uint16_t), undo, err);
    if ((filter & SEQ_FILTER_GREEN) && !undo)
        green(data, pixels, 0);
    for (size_t c = 0; c < 3 && (filter & SEQ_FILTER_AVERAGE); c++)
        average(data + c * pixels, width, height, undo);
    if ((filter & SEQ_FILTER_GREEN) && undo)
        green(data, pixels, 1);
    return 0;
}

uint16_t seq_half_float(double value) { return isnan(value) ? 0 : base_f64_to_f16(fmin(fmax(value, -65504.0), 65504.0)); }

uint8_t seq_fine_encode(uint8_t display, double x)
{
    double lo = base_srgb_limit[display];
    if (display == 255) {
        double q = x > lo ? round(16.0 * log2(x / lo)) : 0.0;
        return (uint8_t)(q < 255.0 ? q : 255.0);
    }
    double q = floor(8.0 * (x - lo) / (base_srgb_limit[display + 1] - lo));
    return (uint8_t)(q > 0.0 ? (q < 7.0 ? q : 7.0) : 0.0);
}

double seq_fine_decode(uint8_t display, uint8_t fine)
{
    double lo = base_srgb_limit[display];
    if (display == 255)
        return lo * exp2(fine / 16.0);
    return lo + (fine + 0.5) / 8.0 * (base_srgb_limit[display + 1] - lo);
}

uint8_t seq_half_log_encode(double value)
{
    double a = fabs(value);
    if (!(a >= exp2(-19.875)))
        return 0;
    double m = round(4.0 * log2(a)) + 80.0;
    return (uint8_t)((m > 1.0 ? (m < 127.0 ? m : 127.0) : 1.0) + (value < 0.0 ? 128.0 : 0.0));
}

double seq_half_log_decode(uint8_t code)
{
    if ((code & 127) == 0)
        return 0.0;
    double a = exp2(((code & 127) - 80) / 4.0);
    return code & 128 ? -a : a;
}
