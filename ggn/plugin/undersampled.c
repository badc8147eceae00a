#include "plugin/undersampled.h"

#include "model/visibility.h"
#include "plugin/translate.h"

enum { COLOR = LULL_PLANE_BIT(LULL_PLANE_COLOR), MOMENT2 = LULL_PLANE_BIT(LULL_PLANE_MOMENT2) };
enum { ENOUGH = 100 * 100 }; /* pixels: larger blocks were held although they were right */
static const double SAMPLES = 2.4, STEP = 1.0 / 6, FLOAT_STEP = 0x1p-22;

struct sums {
    double shown, largest; /* of luminance, 1 is white; of squared deviations of a pixel's samples */
};

static double shown_lightness(const struct lull_kit *kit, double radiance)
{
    const float v = gp_shown(kit, radiance), rgb[3] = {v, v, v};
    float lightness;
    ggn_visible_lightness(rgb, 1, &lightness);
    return (double)lightness;
}

/* The change of radiance that makes STEP of L* at this mean; infinite beyond white. */
static double step_at(const struct lull_kit *kit, double radiance)
{
    const double from = radiance / 1.01, to = radiance * 1.01;
    return STEP * (to - from) / fmax(shown_lightness(kit, to) - shown_lightness(kit, from), 0);
}

static struct sums sum(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *b)
{
    struct sums sums = {0};
    struct lull_kit_span s;
    for (lull_kit_span_begin(&s, view, b, COLOR | MOMENT2); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            const double y = lull_kit_luminance(kit, s.value[LULL_PLANE_COLOR][i]);
            const double moment2 = s.value[LULL_PLANE_MOMENT2][i][0], spread = moment2 - y * y;
            if (!isfinite(spread) || !(y > 0))
                continue;
            sums.shown += fmin(kit->exposure * y, 1);
            if (spread > FLOAT_STEP * moment2)
                sums.largest = fmax(sums.largest, (double)b->spp * spread);
        }
    return sums;
}

double gp_undersampled_error(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *b)
{
    const double pixels = lull_kit_pixels(b);
    if (pixels >= ENOUGH || !lull_kit_plane(view, LULL_PLANE_MOMENT2))
        return 0;
    const struct sums sums = sum(kit, view, b);
    if (!(sums.largest > 0))
        return 0;
    const double step = step_at(kit, sums.shown / pixels / kit->exposure);
    return sqrt(SAMPLES * sqrt(sums.largest) / (pixels * step * (double)b->spp));
}
