#include "sight/remaining.h"

#include <math.h>
#include <stdlib.h>

#include "base/colour.h"
#include "sight/visibility.h"

struct workspace { /* for one block */
    double *texture, *scratch;
    float *rgb, *image, *reference[2], *seen[2];
};

static void lightness_of(const struct pic_image *image, const struct ggn_remaining *b, float *rgb, float *lightness)
{
    size_t n = (size_t)b->width * (size_t)b->height, i = 0;
    for (int y = 0; y < b->height; y++) {
        const uint8_t *row = image->u8 + 3 * ((size_t)(b->y + y) * (size_t)image->width + (size_t)b->x);
        for (int x = 0; x < b->width; x++, i++)
            for (int c = 0; c < 3; c++)
                rgb[(size_t)c * n + i] = base_srgb_linear_f32[row[3 * x + c]];
    }
    ggn_visible_lightness(rgb, n, lightness);
}

/* Mean of the sixth power of the error over a patch, from its blurred differences to two references. */
static double sixth_moment(const float *g, const float *h, int width, const int patch[4])
{
    double sum = 0.0;
    for (int y = patch[1]; y < patch[3]; y++)
        for (int x = patch[0]; x < patch[2]; x++) {
            const size_t i = (size_t)y * (size_t)width + (size_t)x;
            const double m = 0.5 * ((double)g[i] + (double)h[i]), d = 0.5 * ((double)g[i] - (double)h[i]), mm = m * m,
                         dd = d * d;
            sum += mm * mm * mm - 15.0 * mm * dd * (mm - dd) - dd * dd * dd;
        }
    return fmax(0.0, sum) / ((double)(patch[2] - patch[0]) * (patch[3] - patch[1]));
}

/* Visible error from the blurred differences in units of what texture hides. */
static double between(const struct workspace *w, int width, int height)
{
    const size_t patches = ggn_visible_patches(width, height);
    double sum = 0.0;
    for (size_t k = 0; k < patches; k++) {
        int patch[4];
        ggn_visible_patch(width, height, k, w->texture, patch);
        sum += cbrt(sixth_moment(w->seen[0], w->seen[1], width, patch));
    }
    return sqrt(sum / (double)patches);
}

/* second: whether there is one. */
static void measure(const struct ggn_observer *observer, struct ggn_remaining *b, int second, struct workspace *w,
                    float *map, int stride)
{
    const size_t n = (size_t)b->width * (size_t)b->height;
    ggn_visible_texture(w->reference[0], w->reference[second], b->width, b->height, w->scratch, w->texture);
    for (int k = 0; k <= second; k++) {
        for (size_t i = 0; i < n; i++)
            w->reference[k][i] = w->image[i] - w->reference[k][i];
        b->error = ggn_visible_noise(w->reference[k], b->width, b->height, w->texture, w->scratch, w->seen[k]);
    }
    b->error = (second ? between(w, b->width, b->height) : b->error) / observer->level;
    for (int y = 0; map && y < b->height; y++)
        for (int x = 0; x < b->width; x++) {
            const size_t i = (size_t)y * (size_t)b->width + (size_t)x;
            const double seen = 0.5 * ((double)w->seen[0][i] + (double)w->seen[second][i]);
            map[(size_t)(b->y + y) * (size_t)stride + (size_t)(b->x + x)] = (float)(fabs(seen) / observer->level);
        }
}

int ggn_remaining_count(int width, int height, int block) { return ((width - 1) / block + 1) * ((height - 1) / block + 1); }

int ggn_remaining(const struct ggn_observer *observer, const struct pic_image *const references[2],
                  const struct pic_image *image, int block, struct ggn_remaining *blocks, float *map, struct base_err *err)
{
    const int width = block < image->width ? block : image->width, height = block < image->height ? block : image->height;
    const size_t n = (size_t)width * (size_t)height, patches = ggn_visible_patches(width, height);
    const size_t doubles = patches + ggn_visibility_scratch(width);
    double *memory = malloc(doubles * sizeof *memory + 8 * n * sizeof(float));
    if (!memory)
        return base_fail_nomem(err, "blocks of an image");
    float *at = (float *)(memory + doubles);
    struct workspace w = {.texture = memory,
                          .scratch = memory + patches,
                          .rgb = at,
                          .image = at + 3 * n,
                          .reference = {at + 4 * n, at + 5 * n},
                          .seen = {at + 6 * n, at + 7 * n}};
    for (int y = 0; y < image->height; y += block)
        for (int x = 0; x < image->width; x += block, blocks++) {
            int right = image->width - x, below = image->height - y;
            *blocks = (struct ggn_remaining){x, y, block < right ? block : right, block < below ? block : below, 0.0};
            for (int k = 0; k < 2 && references[k]; k++)
                lightness_of(references[k], blocks, w.rgb, w.reference[k]);
            lightness_of(image, blocks, w.rgb, w.image);
            measure(observer, blocks, references[1] != NULL, &w, map, image->width);
        }
    free(memory);
    return 0;
}
