#include "data/windows.h"

#include <math.h>
#include <stdlib.h>

#include "base/colour.h"
#include "model/window.h"
#include "nn/hash.h"

void ggn_windows_release(struct ggn_windows *w)
{
    free(w->list);
    free(w->first);
    *w = (struct ggn_windows){0};
}

int ggn_windows_create(struct ggn_windows *w, const struct ggn_series_set *set, const struct ggn_window_options *o,
                       struct base_err *err)
{
    size_t room = 1;
    *w = (struct ggn_windows){.set = set, .length = o->length};
    for (int i = 0; i < set->n; i++)
        room += (size_t)set->series[i].n_levels;
    w->list = malloc(room * sizeof *w->list);
    w->first = malloc(((size_t)set->n + 1) * sizeof *w->first);
    if (!w->list || !w->first) {
        ggn_windows_release(w);
        return base_fail_nomem(err, "windows");
    }
    for (int i = 0; i < set->n; i++) {
        const struct ggn_level_series *c = &set->series[i];
        w->first[i] = w->n;
        if (c->split != o->split || (c->synthetic && !o->synthetic))
            continue;
        for (int last = o->length - 1; last < c->n_levels; last++) {
            const double spp = c->spp[o->label_first ? last - o->length + 1 : last];
            const int noisy = c->has_label ? ggn_label_noisy(&c->label, spp) : -1;
            if (noisy < 0) /* not labelled */
                continue;
            const double p = o->soft && c->spread > 0 ? ggn_label_p_noisy(&c->label, spp, c->spread) : (double)NAN;
            w->list[w->n++] = (struct ggn_window){.series = i,
                                                  .last = last,
                                                  .label = p >= 0 && p <= 1 ? p : noisy,
                                                  .noisy = noisy,
                                                  .octave = log2(spp / c->label.threshold)};
        }
    }
    w->first[set->n] = w->n;
    return 0;
}

static double draw(uint32_t what, uint64_t step, int i, uint32_t seed)
{
    return ggn_hash_unit(what, ggn_hash((uint32_t)i, ggn_hash((uint32_t)(step >> 32), ggn_hash((uint32_t)step, seed))));
}

/* The k-th of the scenes (or, within `scene`, of the series) that have windows; their number when k < 0. */
static int nth_scene(const struct ggn_windows *w, int k)
{
    int n = 0;
    for (int s = 0; s < w->set->data.n_scenes; s++)
        for (int i = 0; i < w->set->n; i++)
            if (w->set->series[i].scene == s && w->first[i + 1] > w->first[i]) {
                if (n++ == k)
                    return s;
                break;
            }
    return n;
}

static int nth_series(const struct ggn_windows *w, int scene, int k)
{
    int n = 0;
    for (int i = 0; i < w->set->n; i++)
        if (w->set->series[i].scene == scene && w->first[i + 1] > w->first[i] && n++ == k)
            return i;
    return n;
}

/* Octaves over which the chance of a window falls by e with its distance from the threshold. */
static const double NEAR = 1.5;

int ggn_windows_draw(const struct ggn_windows *w, uint64_t step, int i, uint32_t seed)
{
    int scene = nth_scene(w, (int)(draw(1, step, i, seed) * nth_scene(w, -1)));
    int series = nth_series(w, scene, (int)(draw(2, step, i, seed) * nth_series(w, scene, -1)));
    const struct ggn_window *list = w->list + w->first[series];
    int n = w->first[series + 1] - w->first[series], any[2] = {0, 0};
    for (int k = 0; k < n; k++)
        any[list[k].noisy]++;
    int wanted = any[0] && any[1] ? draw(3, step, i, seed) < 0.5 : any[1] > 0;
    double total = 0;
    for (int k = 0; k < n; k++)
        total += list[k].noisy == wanted ? exp(-fabs(list[k].octave) / NEAR) : 0;
    double target = draw(4, step, i, seed) * total, sum = 0;
    int chosen = 0;
    for (int k = 0; k < n; k++) {
        if (list[k].noisy != wanted)
            continue;
        chosen = k;
        sum += exp(-fabs(list[k].octave) / NEAR);
        if (sum > target)
            break;
    }
    return w->first[series] + chosen;
}

struct ggn_augment ggn_augment_none(void) { return (struct ggn_augment){.gain = {1, 1, 1}}; }

struct ggn_augment ggn_augment_draw(uint64_t step, int i, uint32_t seed, const struct ggn_augment_options *o)
{
    struct ggn_augment a = {.flip_x = o->flips && draw(11, step, i, seed) < 0.5,
                            .flip_y = o->flips && draw(12, step, i, seed) < 0.5,
                            .transpose = o->flips && o->square && draw(13, step, i, seed) < 0.5,
                            .blind = draw(18, step, i, seed) >= o->noise_map};
    double exposure = o->jitter * (draw(14, step, i, seed) - 0.5);
    for (uint32_t c = 0; c < 3; c++)
        a.gain[c] = (float)exp2(exposure + 0.25 * o->jitter * (draw(15 + c, step, i, seed) - 0.5));
    return a;
}

/* Display value (0..1) of each 8-bit code after the gain. */
static void gain_table(float gain, float table[256])
{
    for (int i = 0; i < 256; i++)
        table[i] = gain == 1 ? (float)i / 255 : (float)base_srgb_oetf(fmin((double)gain * base_srgb_linear[i], 1));
}

/* Where pixel (x, y) of the result comes from: src[start + x · right + y · down], in rows that lie `row` apart. */
struct walk {
    ptrdiff_t start, right, down;
};

static struct walk walk_of(const struct ggn_augment *a, int width, int height, int row)
{
    const ptrdiff_t right = a->flip_x ? -1 : 1, down = a->flip_y ? -row : row;
    const ptrdiff_t start = (a->flip_x ? width - 1 : 0) + (a->flip_y ? (ptrdiff_t)(height - 1) * row : 0);
    return a->transpose ? (struct walk){start, down, right} : (struct walk){start, right, down};
}

static void plane_u8(const uint8_t *src, int width, int height, int row, const struct ggn_augment *a, const float table[256],
                     float *out)
{
    const struct walk w = walk_of(a, width, height, row);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++)
            *out++ = table[src[w.start + x * w.right + y * w.down]];
}

/* A denoised value between two codes is interpolated between what the gain makes of them. */
static void plane_u16(const uint16_t *src, int width, int height, const struct ggn_augment *a, const float table[256],
                      float *out)
{
    const struct walk w = walk_of(a, width, height, width);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            float v = (float)src[w.start + x * w.right + y * w.down] * (1 / 257.0F);
            int code = v < 254 ? (int)v : 254;
            *out++ = table[code] + (v - (float)code) * (table[code + 1] - table[code]);
        }
}

void ggn_window_planes(const struct ggn_level_series *series, int last, int length, int width, int height, int denoised,
                       const struct ggn_augment *augment, float difference, float *planes)
{
    const size_t pixels = (size_t)width * (size_t)height;
    float table[3][256];
    for (int c = 0; c < 3; c++)
        gain_table(augment->gain[c], table[c]);
    for (int k = 0; k < length; k++)
        for (size_t c = 0; c < 3; c++) {
            size_t at = (3 * (size_t)(last - length + 1 + k) + c) * pixels;
            float *out = planes + (3 * (size_t)k + c) * pixels;
            if (denoised)
                plane_u16(series->denoised + at, width, height, augment, table[c], out);
            else
                plane_u8(series->noisy + at, width, height, width, augment, table[c], out);
        }
    const float *newest = planes + 3 * (size_t)(length - 1) * pixels;
    for (int k = 0; k < length - 1 && difference > 0; k++) {
        float *image = planes + 3 * (size_t)k * pixels;
        for (size_t i = 0; i < 3 * pixels; i++)
            image[i] = difference * (image[i] - newest[i]);
    }
}

int ggn_noise_map_plane(const struct ggn_level_series *series, int last, int width, int height, const struct ggn_augment *a,
                        float *plane)
{
    if (!series->noise_map || !series->has_noise_map[last] || a->blind)
        return 0;
    const uint8_t *noise_map = series->noise_map + (size_t)last * (size_t)width * (size_t)height;
    double gain = base_luminance((double)a->gain[0], (double)a->gain[1], (double)a->gain[2]);
    float table[256];

    for (int i = 0; i < 256; i++)
        table[i] = (float)(pow(gain, 1 / 2.4) * i) * GGN_NOISE_MAP_GAIN;
    plane_u8(noise_map, width, height, width, a, table, plane);
    return 1;
}

void ggn_crop_planes(const struct ggn_level_series *series, int level, int width, int height, int x0, int y0, int crop_w,
                     int crop_h, const struct ggn_augment *augment, float *noisy, float *reference)
{
    const size_t pixels = (size_t)width * (size_t)height, corner = (size_t)y0 * (size_t)width + (size_t)x0;
    const size_t crop = (size_t)crop_w * (size_t)crop_h;
    float table[256];
    for (size_t c = 0; c < 3; c++) {
        const uint8_t *x = series->noisy + (3 * (size_t)level + c) * pixels, *y = series->reference + c * pixels;
        gain_table(augment->gain[c], table);
        plane_u8(x + corner, crop_w, crop_h, width, augment, table, noisy + c * crop);
        plane_u8(y + corner, crop_w, crop_h, width, augment, table, reference + c * crop);
    }
}
