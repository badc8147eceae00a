#include "plugin/pair.h"

#include "plugin/rect.h"
#include "plugin/translate.h"
#include "sequence/simulate.h"

static const double FLOAT_STEP = 0x1p-22; /* means that are nearer than their rounding are the same */

enum { COLOR = LULL_PLANE_BIT(LULL_PLANE_COLOR), HALF = LULL_PLANE_BIT(LULL_PLANE_HALF) };
enum { MOMENTS = COLOR | LULL_PLANE_BIT(LULL_PLANE_MOMENT2) | LULL_PLANE_BIT(LULL_PLANE_SPP) };

/* From where two pictures come, and where they go. */
struct pair {
    const struct gp_sight *of;
    struct lull_rect area;
    float *const *rgb; /* two of [3][P], of its pixels */
    uint32_t planes;
    /* One pixel of a span as two colours, in linear radiance; 0: it holds no numbers. */
    int (*colours)(const struct pair *p, const struct lull_kit_span *s, int32_t i, double one[3], double other[3]);
    double deviations;
};

static int usable(const double a[3], const double b[3])
{
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]) && isfinite(b[0]) && isfinite(b[1]) && isfinite(b[2]);
}

static int both_halves(const struct pair *p, const struct lull_kit_span *s, int32_t i, double one[3], double other[3])
{
    const double n = (double)s->block->spp, h = (double)s->block->half_spp; /* h of the n samples are in HALF */
    const double *m = s->value[LULL_PLANE_COLOR][i], *a = s->value[LULL_PLANE_HALF][i];
    (void)p;
    for (int c = 0; c < 3; c++) {
        one[c] = a[c];
        other[c] = a[c] != m[c] ? (n * m[c] - h * a[c]) / (n - h) : a[c];
    }
    return usable(a, m);
}

static int both_sides(const struct pair *p, const struct lull_kit_span *s, int32_t i, double one[3], double other[3])
{
    const double n = s->planes & LULL_PLANE_BIT(LULL_PLANE_SPP) ? s->value[LULL_PLANE_SPP][i][0] : (double)s->block->spp;
    const double *m = s->value[LULL_PLANE_COLOR][i], moment2 = s->value[LULL_PLANE_MOMENT2][i][0];
    const double y = lull_kit_luminance(p->of->kit, m), spread = moment2 - y * y;
    const double share = n >= 2 && y > 0 && spread > FLOAT_STEP * moment2 ? p->deviations * sqrt(spread / (n - 1)) / y : 0;
    for (int c = 0; c < 3; c++) {
        one[c] = m[c] * (1 + share);
        other[c] = m[c] * fmax(1 - share, 0);
    }
    return usable(one, other) && isfinite(moment2);
}

/* The pixels of `rect`, which belong to block b. Returns whether the colours differ anywhere. */
static int read_part(const struct pair *p, const struct lull_block *b, struct lull_rect rect, struct lull_kit_tally *tally)
{
    const size_t width = (size_t)(p->area.x1 - p->area.x0), plane = width * (size_t)(p->area.y1 - p->area.y0);
    struct lull_block part = *b;
    struct lull_kit_span s;
    int differ = 0;
    part.x0 = rect.x0, part.y0 = rect.y0, part.x1 = rect.x1, part.y1 = rect.y1;
    for (lull_kit_span_begin(&s, p->of->view, &part, p->planes); lull_kit_span_next(&s);)
        for (int32_t i = 0; i < s.count; i++) {
            const size_t at = (size_t)(s.y - p->area.y0) * width + (size_t)(s.x + i - p->area.x0);
            double one[3], other[3];
            const int good = p->colours(p, &s, i, one, other);
            tally->valid += good;
            tally->bad += !good;
            for (size_t c = 0; c < 3; c++) {
                float *a = &p->rgb[0][c * plane + at], *z = &p->rgb[1][c * plane + at];
                *a = good ? gp_shown(p->of->kit, one[c]) : at ? a[-1] : 0;
                *z = good ? gp_shown(p->of->kit, other[c]) : at ? z[-1] : 0;
                differ |= good && one[c] != other[c];
            }
        }
    return differ;
}

/* All pixels of the area that belong to a block with samples; the rest is black in both pictures. */
static int read_around(const struct pair *p, struct lull_kit_tally *tally)
{
    const struct lull_rect area = p->area;
    const struct lull_view *view = p->of->view;
    const struct lull_block *b = p->of->block;
    const size_t values = 3 * (size_t)(area.x1 - area.x0) * (size_t)(area.y1 - area.y0);
    int differ = 0;
    memset(p->rgb[0], 0, values * sizeof(float));
    memset(p->rgb[1], 0, values * sizeof(float));
    for (uint32_t i = 0; i < (view->all ? view->all_count : 1); i++) {
        const struct lull_block *o = view->all ? lull_kit_at(view->all, view->all_stride, i) : b;
        o = o->id == b->id ? b : o;
        const struct lull_rect r = gp_rect_common(gp_rect_of(o), area);
        if (o->spp > 0 && (!(p->planes & HALF) || gp_has_halves(o)) && r.x0 < r.x1 && r.y0 < r.y1)
            differ |= read_part(p, o, r, tally);
    }
    return differ;
}

static int read_pair(const struct pair *p, struct lull_kit_tally *tally)
{
    const struct lull_rect own = gp_rect_of(p->of->block);
    return gp_rect_same(p->area, own) ? read_part(p, p->of->block, own, tally) : read_around(p, tally);
}

int gp_pair_of_halves(const struct gp_sight *of, struct lull_rect area, float *const rgb[2], struct lull_kit_tally *tally)
{
    const struct pair p = {of, area, rgb, COLOR | HALF, both_halves, 0};
    return read_pair(&p, tally);
}

int gp_pair_of_moments(const struct gp_sight *of, struct lull_rect area, double deviations, float *const rgb[2])
{
    const struct pair p = {of, area, rgb, MOMENTS, both_sides, deviations};
    struct lull_kit_tally ignored = {0}; /* the same pixels are no numbers in other pairs */
    return read_pair(&p, &ignored);
}

static int pair_of_means(const struct gp_sight *of, struct gp_history *means, float *const rgb[2],
                         struct lull_kit_tally *tally)
{
    const struct lull_block *b = of->block;
    uint64_t spp_base;
    float *keep;
    const float *base = gp_means_begin(means, b->id, b->spp, &keep, &spp_base);
    const double scale = base ? seq_means_scale((double)spp_base, (double)b->spp) : 0;
    const size_t plane = (size_t)lull_kit_pixels(b);
    struct lull_kit_span s;
    size_t at = 0;
    int differ = 0;
    for (lull_kit_span_begin(&s, of->view, b, COLOR); lull_kit_span_next(&s);)
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
                *one = good ? gp_shown(of->kit, m[c] + d[c]) : at ? one[-1] : 0;
                *other = good ? gp_shown(of->kit, m[c] - d[c]) : at ? other[-1] : 0;
                differ |= good && fabs(d[c]) > FLOAT_STEP * scale * fabs(m[c]);
            }
        }
    return base ? differ : -1;
}

int gp_pair_of_block(const struct gp_sight *of, struct gp_history *means, const char *who, atomic_flag *warned,
                     float *const rgb[2], struct lull_kit_tally *tally, double *split)
{
    const struct lull_block *b = of->block;
    char text[160];
    *split = 0.5;
    if (means->count)
        return pair_of_means(of, means, rgb, tally);
    if (!gp_has_halves(b)) {
        snprintf(text, sizeof text,
                 "%s: HALF holds none or all of a block's samples, so that noise cannot be told; no block is stopped by it",
                 who);
        gp_say_once(of->kit, LULL_LOG_WARNING, warned, text);
        return -1;
    }
    *split *= seq_half_scale((double)b->spp, (double)b->half_spp);
    return gp_pair_of_halves(of, gp_rect_of(b), rgb, tally);
}

int gp_pair_has_structure(const float *rgb, size_t pixels)
{
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 1; i < pixels; i++)
            if (rgb[c * pixels + i] != rgb[c * pixels])
                return 1;
    return 0;
}
