#include "observer/remaining.h"

#include <math.h>
#include <stdlib.h>

#include "base/colour.h"
#include "model/visibility.h"

struct workspace { /* for one block; owns */
    float *rgb, *image, *reference, *seen;
    double *texture, *scratch;
};

static void release(struct workspace *w)
{
    free(w->rgb);
    free(w->image);
    free(w->reference);
    free(w->seen);
    free(w->texture);
    free(w->scratch);
}

static int init(struct workspace *w, int width, int height, struct base_err *err)
{
    size_t n = (size_t)width * (size_t)height;
    *w = (struct workspace){.rgb = malloc(3 * n * sizeof *w->rgb),
                            .image = malloc(n * sizeof *w->image),
                            .reference = malloc(n * sizeof *w->reference),
                            .seen = malloc(n * sizeof *w->seen),
                            .texture = malloc(ggn_visible_patches(width, height) * sizeof *w->texture),
                            .scratch = malloc(ggn_visibility_scratch(width) * sizeof *w->scratch)};
    if (w->rgb && w->image && w->reference && w->seen && w->texture && w->scratch)
        return 0;
    release(w);
    return base_fail_nomem(err, "blocks of an image");
}

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

static void measure(const struct ggn_observer *observer, struct ggn_remaining *b, struct workspace *w, float *map,
                    int stride)
{
    size_t n = (size_t)b->width * (size_t)b->height;
    ggn_visible_texture(w->reference, w->reference, b->width, b->height, w->scratch, w->texture);
    for (size_t i = 0; i < n; i++)
        w->image[i] -= w->reference[i];
    b->error = ggn_visible_noise(w->image, b->width, b->height, w->texture, w->scratch, map ? w->seen : NULL);
    b->error /= observer->level;
    for (int y = 0; map && y < b->height; y++)
        for (int x = 0; x < b->width; x++)
            map[(size_t)(b->y + y) * (size_t)stride + (size_t)(b->x + x)] =
                (float)(fabs((double)w->seen[(size_t)y * (size_t)b->width + (size_t)x]) / observer->level);
}

int ggn_remaining_count(int width, int height, int block) { return ((width - 1) / block + 1) * ((height - 1) / block + 1); }

int ggn_remaining(const struct ggn_observer *observer, const struct pic_image *reference, const struct pic_image *image,
                  int block, struct ggn_remaining *blocks, float *map, struct base_err *err)
{
    struct workspace w;
    int rc = init(&w, block < image->width ? block : image->width, block < image->height ? block : image->height, err);
    if (rc)
        return rc;
    for (int y = 0; y < image->height; y += block)
        for (int x = 0; x < image->width; x += block, blocks++) {
            int right = image->width - x, below = image->height - y;
            *blocks = (struct ggn_remaining){x, y, block < right ? block : right, block < below ? block : below, 0.0};
            lightness_of(reference, blocks, w.rgb, w.reference);
            lightness_of(image, blocks, w.rgb, w.image);
            measure(observer, blocks, &w, map, image->width);
        }
    release(&w);
    return 0;
}
