#include "host/frame.h"

#include <locale.h>
#include <math.h>
#include <stdio.h>

#include <lull/criterion_kit.h>

static const double WHITE_SCALE = 0.25;

static double grey_at(const struct lull_plane *mask, int32_t x, int32_t y)
{
    const void *e = (const char *)mask->data + x * mask->stride_x + y * mask->stride_y;
    double grey = (mask->type == LULL_TYPE_F64 ? *(const double *)e : (double)*(const float *)e) * mask->scale;
    return grey > 0.0 ? fmin(grey, 1.0) : 0.0;
}

int32_t lull_host_read_mask(const struct lull_plane *mask, struct lull_host_blocks *blocks, struct lull_error *err)
{
    if (!mask->data || mask->normaliser != LULL_NORM_ONE || mask->channels < 1 ||
        (mask->type != LULL_TYPE_F32 && mask->type != LULL_TYPE_F64))
        return lull_error_set(err, LULL_E_PLANE, "the mask: expected one channel of f32 or f64, LULL_NORM_ONE");
    int32_t code = lull_host_check_plane("the mask", mask, 1, err);
    if (code != LULL_OK)
        return code;
    for (uint32_t i = 0; i < blocks->count; i++) {
        struct lull_host_block *b = &blocks->list[i];
        double lightest = 0.0;
        for (int32_t y = b->y0; y < b->y1; y++)
            for (int32_t x = b->x0; x < b->x1; x++)
                lightest = fmax(lightest, grey_at(mask, x, y));
        b->step = (uint32_t)(lightest * LULL_HOST_STEPS + 0.5);
    }
    return LULL_OK;
}

double lull_host_mask_factor(uint32_t step) { return pow(WHITE_SCALE, (double)step / LULL_HOST_STEPS); }

int lull_host_number(double value, char text[32])
{
    locale_t c = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (c == (locale_t)0)
        return 0;
    locale_t before = uselocale(c);
    snprintf(text, 32, "%.17g", value);
    uselocale(before);
    freelocale(c);
    return 1;
}

int32_t lull_host_scale_quality(const struct lull_criterion *t, const struct lull_pair *pairs, uint32_t pair_count,
                                uint32_t step, char value[32], struct lull_pair *pair, struct lull_error *err)
{
    static const char *const names[] = {"error", "visible", "threshold"};
    double quality;
    const struct lull_param *p = lull_host_quality(t, pairs, pair_count, &quality);
    if (p) {
        quality *= lull_host_mask_factor(step);
        if (!lull_host_number(fmin(fmax(quality, p->min), p->max), value))
            return lull_host_no_memory(err, "mask");
        *pair = (struct lull_pair){p->name, value};
        return LULL_OK;
    }
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const char *text = lull_host_parameter(t, names[i], pairs, pair_count, &p);
        if (p && !text && p->max > p->min)
            return lull_error_set(err, LULL_E_VALUE,
                                  "criterion %s: a mask scales '%s', which has no value: give one, %s=VALUE", t->id,
                                  names[i], names[i]);
    }
    return lull_error_set(err, LULL_E_KEY,
                          "criterion %s has no quality parameter 'visible' or 'threshold' for a mask to scale", t->id);
}
