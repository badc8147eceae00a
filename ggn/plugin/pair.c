#include "plugin/pair.h"

#include "plugin/translate.h"
#include "sequence/simulate.h"

static const double FLOAT_STEP = 0x1p-22; /* means that are nearer than their rounding are the same */

enum { COLOR = LULL_PLANE_BIT(LULL_PLANE_COLOR), PLANES = COLOR | LULL_PLANE_BIT(LULL_PLANE_HALF) };

static int usable(const double a[3], const double m[3])
{
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]) && isfinite(m[0]) && isfinite(m[1]) && isfinite(m[2]);
}

int gp_pair_of_halves(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *b,
                      float *const rgb[2], struct lull_kit_tally *tally)
{
    const double n = (double)b->spp, h = (double)b->half_spp; /* h of the n samples are in HALF */
    const size_t plane = (size_t)lull_kit_pixels(b);
    struct lull_kit_span s;
    size_t at = 0;
    int differ = 0;

    for (lull_kit_span_begin(&s, view, b, PLANES); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++, at++) {
            const double *m = s.value[LULL_PLANE_COLOR][i], *a = s.value[LULL_PLANE_HALF][i];
            int good = usable(a, m);
            tally->valid += good;
            tally->bad += !good;
            for (size_t c = 0; c < 3; c++) {
                float *one = &rgb[0][c * plane + at], *other = &rgb[1][c * plane + at];
                *one = good ? gp_shown(kit, a[c]) : at ? one[-1] : 0;
                *other = good ? gp_shown(kit, (n * m[c] - h * a[c]) / (n - h)) : at ? other[-1] : 0;
                differ |= good && a[c] != m[c];
            }
        }
    return differ;
}

int gp_pair_of_means(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *b, const float *base,
                     uint64_t spp_base, float *keep, float *const rgb[2], struct lull_kit_tally *tally)
{
    const double scale = base ? seq_means_scale((double)spp_base, (double)b->spp) : 0;
    const size_t plane = (size_t)lull_kit_pixels(b);
    struct lull_kit_span s;
    size_t at = 0;
    int differ = 0;

    for (lull_kit_span_begin(&s, view, b, COLOR); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++, at++) {
            const double *m = s.value[LULL_PLANE_COLOR][i];
            double d[3];
            for (size_t c = 0; c < 3; c++) {
                d[c] = base ? scale * (m[c] - (double)base[c * plane + at]) : 0;
                if (keep)
                    keep[c * plane + at] = (float)m[c];
            }
            int good = usable(d, m);
            tally->valid += good;
            tally->bad += !good;
            for (size_t c = 0; c < 3; c++) {
                float *one = &rgb[0][c * plane + at], *other = &rgb[1][c * plane + at];
                *one = good ? gp_shown(kit, m[c] + d[c]) : at ? one[-1] : 0;
                *other = good ? gp_shown(kit, m[c] - d[c]) : at ? other[-1] : 0;
                differ |= good && fabs(d[c]) > FLOAT_STEP * scale * fabs(m[c]);
            }
        }
    return differ;
}

int gp_pair_has_structure(const float *rgb, size_t pixels)
{
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 1; i < pixels; i++)
            if (rgb[c * pixels + i] != rgb[c * pixels])
                return 1;
    return 0;
}
