#include "plugin/undersampled.h"

#include "base/colour.h"
#include "sight/visibility.h"
#include "plugin/translate.h"

enum { COLOR = LULL_PLANE_BIT(LULL_PLANE_COLOR), MOMENT2 = LULL_PLANE_BIT(LULL_PLANE_MOMENT2) };
enum { ENOUGH = 100 * 100 }; /* pixels: larger blocks were held although they were right */
static const double SAMPLES = 2.4, STEP = 1.0 / 6, FLOAT_STEP = 0x1p-22;
static const double LONE = 4; /* L*: a pixel that differs so much is just seen in 60x60 black ones (sight/visibility.h) */

struct sums {
    double shown, largest; /* of luminance, 1 is white; of squared deviations of a pixel's samples */
};

static double lightness_of(double shown)
{
    const float v = (float)shown, rgb[3] = {v, v, v};
    float lightness;
    ggn_visible_lightness(rgb, 1, &lightness);
    return (double)lightness;
}

static double shown_lightness(const struct lull_kit *kit, double radiance)
{
    return lightness_of((double)gp_shown(kit, radiance));
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

struct pictures {
    struct lull_rect area;
    float *const *rgb;
};

struct shown { /* luminance of a pixel; 1 is white */
    double mean, deviation;
};

static int is_in(struct lull_rect r, int32_t x, int32_t y) { return x >= r.x0 && x < r.x1 && y >= r.y0 && y < r.y1; }

static struct shown shown_at(const struct pictures *of, int32_t x, int32_t y)
{
    const size_t width = (size_t)(of->area.x1 - of->area.x0), plane = width * (size_t)(of->area.y1 - of->area.y0);
    const size_t at = (size_t)(y - of->area.y0) * width + (size_t)(x - of->area.x0);
    double y_of[2];
    for (int k = 0; k < 2; k++) {
        const float *rgb = of->rgb[k] + at;
        y_of[k] = base_luminance((double)rgb[0], (double)rgb[plane], (double)rgb[2 * plane]);
    }
    return (struct shown){(y_of[0] + y_of[1]) / 2, fabs(y_of[0] - y_of[1]) / 2};
}

/* Whether so much noise would be seen in a pixel of `own` that has none and touches this one. */
static int reaches_over(const struct pictures *of, struct lull_rect own, int32_t x, int32_t y, double deviation)
{
    for (int32_t v = y - 1; v <= y + 1; v++)
        for (int32_t u = x - 1; u <= x + 1; u++) {
            if (!is_in(own, u, v))
                continue;
            const struct shown in = shown_at(of, u, v);
            if (!(in.deviation > 0) && lightness_of(in.mean + deviation) - lightness_of(in.mean) > LONE)
                return 1;
        }
    return 0;
}

int gp_undersampled_edge(struct lull_rect own, struct lull_rect area, float *const rgb[2])
{
    const struct pictures of = {area, rgb};
    for (int32_t y = own.y0 - 1; y <= own.y1; y++)
        for (int32_t x = own.x0 - 1; x <= own.x1; x = is_in(own, x + 1, y) ? own.x1 : x + 1) /* around the block */
            if (is_in(area, x, y) && reaches_over(&of, own, x, y, shown_at(&of, x, y).deviation))
                return 1;
    return 0;
}
