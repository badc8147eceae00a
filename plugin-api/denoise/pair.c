#include "denoise/pair.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Points each of `count` buffers to `size` floats of the memory at *next. */
static void lay_out(float **const buffers[], size_t count, size_t size, float **next)
{
    for (size_t i = 0; i < count; i++, *next += size)
        *buffers[i] = *next;
}

/* Both numbers of pixels are small enough for sums of what is allocated. */
static const size_t MOST = SIZE_MAX / sizeof(float) / 64;

static size_t pixels_of(const struct lull_oidn_form *form)
{
    const size_t width = (size_t)form->width, height = (size_t)form->height;
    return height > MOST / width ? MOST : width * height;
}

static int allocate(struct lull_denoised_pair *pair, const struct lull_oidn_form *form, struct base_err *err)
{
    float **const pictures[] = {&pair->half[0],     &pair->half[1], &pair->denoised[0],
                                &pair->denoised[1], &pair->albedo,  &pair->normal};
    const size_t count = 4u + (form->albedo != 0) + (form->normal != 0);
    pair->width = form->width;
    pair->height = form->height;
    pair->pixels = pair->room = pixels_of(form);
    if (pair->room < MOST)
        pair->memory = calloc(3 * count * pair->room, sizeof(float));
    if (!pair->memory)
        return base_fail_nomem(err, "pictures to denoise");
    float *next = pair->memory;
    lay_out(pictures, count, 3 * pair->room, &next);
    return 0;
}

int lull_denoised_open(struct lull_denoised_pair *pair, const char *library, const struct lull_oidn_form *form,
                       struct base_err *err)
{
    *pair = (struct lull_denoised_pair){0};
    /* First, since of what is too large this fails at once, but shared memory takes all that the machine has. */
    int rc = allocate(pair, form, err);
    if (!rc)
        rc = lull_oidn_open(library, &pair->oidn, err);
    if (!rc)
        rc = lull_oidn_prepare(pair->oidn, form, err);
    if (rc)
        lull_denoised_close(pair);
    return rc;
}

void lull_denoised_close(struct lull_denoised_pair *pair)
{
    lull_oidn_close(pair->oidn);
    free(pair->memory);
    free(pair->other[0]);
    *pair = (struct lull_denoised_pair){0};
}

int lull_denoised_part_open(struct lull_denoised_part *part, size_t pixels, const struct lull_denoised_pair *whole,
                            struct base_err *err)
{
    float **const pictures[] = {&part->half[0], &part->half[1], &part->denoised[0], &part->denoised[1]};
    float **const maps[] = {&part->error.gain,  &part->error.doubt, &part->error.moved, &part->error.agreed,
                            &part->error.noisy, &part->weight,      &part->apart,       &part->scratch};
    enum { MAPS = sizeof maps / sizeof maps[0] };
    *part = (struct lull_denoised_part){.pixels = pixels};
    if (pixels < MOST)
        part->memory = calloc((whole ? MAPS : 12u + MAPS) * pixels, sizeof(float));
    if (!part->memory) {
        *part = (struct lull_denoised_part){0};
        return base_fail_nomem(err, "what is kept of pictures to denoise");
    }
    float *next = part->memory;
    lay_out(pictures, whole ? 0 : 4, 3 * pixels, &next);
    lay_out(maps, MAPS, pixels, &next);
    for (int k = 0; k < 2 && whole; k++) {
        part->half[k] = whole->half[k];
        part->denoised[k] = whole->denoised[k];
    }
    part->width = whole ? whole->width : 0;
    part->height = whole ? whole->height : 0;
    return 0;
}

void lull_denoised_part_close(struct lull_denoised_part *part)
{
    free(part->memory);
    *part = (struct lull_denoised_part){0};
}

void lull_denoised_begin(struct lull_denoised_pair *pair, int32_t width, int32_t height)
{
    pair->width = width;
    pair->height = height;
    pair->pixels = (size_t)width * (size_t)height;
    lull_oidn_resize(pair->oidn, width, height);
    float *const pictures[] = {pair->half[0], pair->half[1], pair->albedo, pair->normal};
    for (int i = 0; i < 4; i++)
        if (pictures[i])
            memset(pictures[i], 0, 3 * pair->pixels * sizeof(float));
}

int lull_denoised_put(struct lull_denoised_pair *pair, size_t at, const double mean[3], const double half[3], double n,
                      double h)
{
    float *a = pair->half[0] + 3 * at, *b = pair->half[1] + 3 * at;
    const int split = h > 0.0 && h < n;
    int finite = 1;
    for (int c = 0; c < 3; c++) {
        a[c] = (float)(split ? half[c] : mean[c]);
        b[c] = (float)(split ? (n * mean[c] - h * half[c]) / (n - h) : mean[c]);
        finite &= isfinite(a[c]) && isfinite(b[c]);
    }
    return finite;
}

static void mirror(float *picture, int32_t width, int32_t height, struct lull_denoised_rect known)
{
    for (int32_t y = 0; y < height; y++) {
        const int32_t v = known.y0 + lull_oidn_mirrored(y - known.y0, known.y1 - known.y0);
        const int32_t skip = v == y ? known.x0 : INT32_MAX; /* what is known needs no mirror */
        for (int32_t x = skip == 0 ? known.x1 : 0; x < width; x = x + 1 == skip ? known.x1 : x + 1) {
            const int32_t u = known.x0 + lull_oidn_mirrored(x - known.x0, known.x1 - known.x0);
            memcpy(picture + 3 * ((size_t)y * (size_t)width + (size_t)x),
                   picture + 3 * ((size_t)v * (size_t)width + (size_t)u), 3 * sizeof *picture);
        }
    }
}

void lull_denoised_mirror(struct lull_denoised_pair *pair, struct lull_denoised_rect known)
{
    float *const pictures[] = {pair->half[0], pair->half[1], pair->albedo, pair->normal};
    for (int i = 0; i < 4; i++)
        if (pictures[i])
            mirror(pictures[i], pair->width, pair->height, known);
}

static int run(struct lull_denoised_pair *pair, float *const out[2], int prefiltered, int (*cancelled)(void *data),
               void *data, struct base_err *err)
{
    const struct lull_oidn_pictures pictures = {.color = {pair->half[0], pair->half[1]},
                                                .albedo = pair->albedo,
                                                .normal = pair->normal,
                                                .out = {out[0], out[1]},
                                                .prefiltered = prefiltered};
    return lull_oidn_run(pair->oidn, &pictures, cancelled, data, err);
}

int lull_denoised_run(struct lull_denoised_pair *pair, int (*cancelled)(void *data), void *data, struct base_err *err)
{
    return run(pair, pair->denoised, 0, cancelled, data, err);
}

int lull_denoised_again(struct lull_denoised_pair *pair, int (*cancelled)(void *data), void *data, struct base_err *err)
{
    if (!pair->albedo)
        return 0;
    if (!pair->other[0] && !(pair->other[0] = malloc(2 * 3 * pair->room * sizeof(float))))
        return base_fail_nomem(err, "pictures to denoise");
    pair->other[1] = pair->other[0] + 3 * pair->room;
    return run(pair, pair->other, 1, cancelled, data, err);
}

void lull_denoised_cut(struct lull_denoised_part *part, const struct lull_denoised_pair *pair,
                       struct lull_denoised_rect rect)
{
    const size_t row = (size_t)pair->width;
    part->width = rect.x1 - rect.x0;
    part->height = rect.y1 - rect.y0;
    part->pixels = (size_t)part->width * (size_t)part->height;
    for (int k = 0; k < 2; k++)
        for (int32_t y = 0; y < part->height; y++) {
            const size_t from = 3 * ((size_t)(rect.y0 + y) * row + (size_t)rect.x0), count = 3 * (size_t)part->width;
            const size_t to = (size_t)y * count;
            memcpy(part->half[k] + to, pair->half[k] + from, count * sizeof(float));
            memcpy(part->denoised[k] + to, pair->denoised[k] + from, count * sizeof(float));
        }
}

void lull_denoised_estimate(struct lull_denoised_part *part, size_t first, size_t n, const struct lull_estimate_in *in)
{
    const struct lull_estimate *all = &part->error;
    const struct lull_estimate some = {all->gain + first, all->doubt + first, all->moved + first, all->agreed + first,
                                       all->noisy + first};
    lull_estimate_pixels(in, n, &some);
}

void lull_denoised_mix(struct lull_denoised_part *part, const struct lull_denoised_pair *pair)
{
    lull_blend_shares(&part->error, part->width, part->height, part->scratch, part->weight);
    for (int k = 0; k < 2; k++)
        lull_blend_mix(pair->other[k], part->weight, part->pixels, part->denoised[k]);
}

void lull_denoised_weigh(struct lull_denoised_part *part)
{
    lull_blend_weights(&part->error, part->width, part->height, part->scratch, part->weight, part->apart);
    lull_blend_despeckle(part->apart, part->pixels, part->denoised[0], part->denoised[1]);
}

void lull_denoised_blend(const struct lull_denoised_part *part, const float *weight, float *const kept[2])
{
    for (int k = 0; k < 2; k++)
        lull_blend(part->half[k], part->denoised[k], weight, part->pixels, kept[k]);
}
