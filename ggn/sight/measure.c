#include "sight/measure.h"

#include <math.h>
#include <stdlib.h>

#include "sight/visibility.h"

static const double GAUSSIAN_PEAK = 0.651; /* log2(15)/6 */
static const double LEAST_OCTAVES = -20;

void ggn_meter_release(struct ggn_meter *m)
{
    free(m->memory);
    *m = (struct ggn_meter){0};
}

void ggn_meter_make_room(struct ggn_meter_room *room, int width, int height)
{
    const size_t pixels = (size_t)width * (size_t)height, patches = ggn_visible_patches(width, height);
    room->pixels = pixels > room->pixels ? pixels : room->pixels;
    room->patches = patches > room->patches ? patches : room->patches;
    room->width = width > room->width ? width : room->width;
}

int ggn_meter_init(struct ggn_meter *m, const struct ggn_meter_room *room, struct base_err *err)
{
    const size_t pixels = room->pixels, patches = room->patches, doubles = patches + ggn_visibility_scratch(room->width);
    double *memory = pixels < PTRDIFF_MAX / 256 ? malloc(doubles * sizeof *memory + 9 * pixels * sizeof(float)) : NULL;
    if (!memory)
        return base_fail_nomem(err, "the noise of a block");
    float *at = (float *)(memory + doubles);
    *m = (struct ggn_meter){.rgb = {at, at + 3 * pixels},
                            .lightness = {at + 6 * pixels, at + 7 * pixels},
                            .blurred = at + 8 * pixels,
                            .texture = memory,
                            .scratch = memory + patches,
                            .memory = memory};
    return 0;
}

/* Means over the patches and over the block. */
static void summarise(const struct ggn_meter *m, int width, int height, struct ggn_measure *out)
{
    const size_t patches = ggn_visible_patches(width, height);
    double squares = 0, highest = 0;
    int rect[4];
    out->texture = 0;
    for (size_t k = 0; k < patches; k++) {
        double sum = 0, sixth = 0;
        out->texture += log2(ggn_visible_patch(width, height, k, m->texture, rect)) / (double)patches;
        for (int y = rect[1]; y < rect[3]; y++)
            for (int x = rect[0]; x < rect[2]; x++) {
                double b = (double)m->blurred[(size_t)y * (size_t)width + (size_t)x], square = b * b;
                sum += square;
                sixth += square * square * square;
            }
        squares += sum;
        highest = fmax(highest, sixth / ((double)(rect[2] - rect[0]) * (rect[3] - rect[1])));
    }
    double rms = sqrt(squares / ((double)width * height));
    out->peak = out->visible > 0 ? log2(out->visible / rms) : GAUSSIAN_PEAK;
    out->uneven = out->visible > 0 ? fmax(0, log2(sqrt(cbrt(highest)) / out->visible)) : 0;
}

double ggn_measure_visible(const struct ggn_meter *m, int width, int height, double split, int keep_texture,
                           double *lightness)
{
    const size_t pixels = (size_t)width * (size_t)height;
    double sum = 0;
    for (int k = 0; k < 2; k++)
        ggn_visible_lightness(m->rgb[k], pixels, m->lightness[k]);
    if (!keep_texture)
        ggn_visible_texture(m->lightness[0], m->lightness[1], width, height, m->scratch, m->texture);
    for (size_t i = 0; i < pixels; i++) {
        sum += (double)m->lightness[0][i] + (double)m->lightness[1][i];
        m->lightness[0][i] = (float)split * (m->lightness[0][i] - m->lightness[1][i]);
    }
    *lightness = sum / (200 * (double)pixels);
    return ggn_visible_noise(m->lightness[0], width, height, m->texture, m->scratch, m->blurred);
}

void ggn_measure(const struct ggn_meter *m, int width, int height, double split, int keep_texture, struct ggn_measure *out,
                 uint8_t *map)
{
    const size_t pixels = (size_t)width * (size_t)height;
    out->visible = ggn_measure_visible(m, width, height, split, keep_texture, &out->lightness);
    summarise(m, width, height, out);
    for (size_t i = 0; map && i < pixels; i++)
        map[i] = (uint8_t)fmin(GGN_VISIBLE_CODES * fabs((double)m->blurred[i]) + 0.5, 255);
}

double ggn_measure_octaves(double error) { return error < exp2(LEAST_OCTAVES) ? LEAST_OCTAVES : log2(error); }

/* By how much log2 r has fallen short of its fall with the samples. */
static double drift(const struct ggn_measure *a, const struct ggn_measure *b, double n_a, double n_b)
{
    return a->visible > 0 && b->visible > 0 ? log2(b->visible / a->visible) + 0.5 * log2(n_b / n_a) : 0;
}

void ggn_measure_scalars(const struct ggn_measure *window, const double *spp, int length, double error,
                         float scalars[GGN_SCALARS])
{
    const struct ggn_measure *last = &window[length - 1];
    const double values[GGN_SCALARS] = {error,
                                        drift(&window[0], last, spp[0], spp[length - 1]),
                                        length > 1 ? drift(last - 1, last, spp[length - 2], spp[length - 1]) : 0,
                                        last->texture - 2,
                                        last->lightness - 0.5,
                                        last->peak - GAUSSIAN_PEAK,
                                        last->uneven};
    for (int i = 0; i < GGN_SCALARS; i++) /* tame: what is far away is one thing */
        scalars[i] = isfinite(values[i]) ? (float)fmin(fmax(values[i], -4), 4) : 0;
}

double ggn_residual_correction(double network, double reach)
{
    return isnan(network) ? reach : reach * tanh(network / reach);
}
