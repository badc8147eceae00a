/*
 * The criterion "observer": the model observer (observer/observer.h) in the renderer. From COLOR and HALF it makes the means
 * of the two halves of a block's samples as a display shows them; what differs between them is noise, what they share is
 * texture that hides noise. `error` is the visible noise over the limit at which people stop seeing it, `p_noisy` the share
 * of viewers who still do; a block stops when that is at most `visible`. No model, no history: an answer follows from the
 * block's pixels alone.
 */
#include <stdatomic.h>

#include "base/colour.h"
#include "observer/observer.h"
#include "observer/visibility.h"
#include "plugin/criteria.h"
#include "plugin/translate.h"

enum { P_VISIBLE, P_FIRST_SPP, P_GROWTH, P_COUNT };
enum { PLANES = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF) };

static const struct lull_param params[P_COUNT] = {
    [P_VISIBLE] =
        LULL_KIT_FLOAT("visible", "0.25", 1e-4, 0.9999, "stop when at most this share of viewers would still see noise"),
    [P_FIRST_SPP] = LULL_KIT_INT("first-spp", "16", 2, 1e15, "samples per pixel before the first judgement"),
    [P_GROWTH] = LULL_KIT_FLOAT("growth", "1.5", 1.01, 100, "largest ratio of samples between two checks of a block"),
};

struct worker { /* [3][P] linear light of each half, its L* */
    float *rgb[2], *lightness[2];
    double *scratch;
};

struct lull_instance {
    struct lull_kit kit;
    struct ggn_observer observer;
    double stop_error;
    atomic_flag warned; /* of halves that are none: once per frame */
    uint32_t workers;   /* of the open frame */
    size_t pixels_max;  /* of its largest block */
    int32_t width_max;  /* of its widest */
    struct worker *worker;
    float *pixels;   /* owns what the workers point into */
    double *scratch; /* likewise */
};

/* --- one block --------------------------------------------------------------------------------------------------------- */

/* The light that a display sends, in [0, 1], relative to its white. */
static float shown(const struct lull_kit *kit, double radiance)
{
    double v = kit->exposure * radiance;
    if (!(v > 0))
        return 0;
    if (v >= 1)
        return 1;
    if (kit->transfer == LULL_TRANSFER_LINEAR)
        v = base_srgb_eotf(v);
    else if (kit->transfer == LULL_TRANSFER_GAMMA && isfinite(kit->gamma) && kit->gamma > 0)
        v = base_srgb_eotf(pow(v, 1 / kit->gamma));
    return (float)v;
}

static int usable(const double a[3], const double m[3])
{
    return isfinite(a[0]) && isfinite(a[1]) && isfinite(a[2]) && isfinite(m[0]) && isfinite(m[1]) && isfinite(m[2]);
}

/* Fills w->rgb with the means of the two halves; n samples, of which h are in HALF. A pixel that is no number takes the
 * place of the one before it: neither noise nor texture. Returns whether the halves differ anywhere. */
static int read_halves(const struct lull_kit *kit, const struct lull_view *view, const struct lull_block *b,
                       struct worker *w, struct lull_kit_tally *tally)
{
    const double n = (double)b->spp, h = (double)b->half_spp;
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
                float *one = &w->rgb[0][c * plane + at], *other = &w->rgb[1][c * plane + at];
                *one = good ? shown(kit, a[c]) : at ? one[-1] : 0;
                *other = good ? shown(kit, (n * m[c] - h * a[c]) / (n - h)) : at ? other[-1] : 0;
                differ |= good && a[c] != m[c];
            }
        }
    return differ;
}

static double error_of(const struct lull_instance *in, const struct lull_block *b, struct worker *w)
{
    const int width = b->x1 - b->x0, height = b->y1 - b->y0;
    const size_t pixels = (size_t)lull_kit_pixels(b);
    const double n = (double)b->spp, h = (double)b->half_spp;
    const float split = (float)(sqrt(h * (n - h)) / n); /* 1/2 for equal halves: noise as strong as the mean's */

    for (int k = 0; k < 2; k++)
        ggn_visible_lightness(w->rgb[k], pixels, w->lightness[k]);
    double texture = ggn_visible_texture(w->lightness[0], w->lightness[1], width, height, w->scratch);
    for (size_t i = 0; i < pixels; i++)
        w->lightness[0][i] = split * (w->lightness[0][i] - w->lightness[1][i]);
    double noise = ggn_visible_noise(w->lightness[0], width, height, w->scratch, NULL);
    return ggn_observer_error(&in->observer, noise, texture, pixels);
}

/* A picture whose halves are the same everywhere has no noise, which is right for black or evenly lit blocks; one with
 * structure says that HALF is no half of the samples. */
static int has_structure(const struct worker *w, size_t pixels)
{
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 1; i < pixels; i++)
            if (w->rgb[0][c * pixels + i] != w->rgb[0][c * pixels])
                return 1;
    return 0;
}

static void warn(struct lull_instance *in, const char *what)
{
    const struct lull_host *host = in->kit.host;
    if (host && host->log && !atomic_flag_test_and_set(&in->warned))
        host->log(host, LULL_LOG_WARNING, what);
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    struct worker *w = &in->worker[worker < in->workers ? worker : 0];
    struct lull_kit_tally tally = {0};
    double error = (double)NAN;

    if (b->spp < in->kit.need.first_spp) {
        tally.early = 1;
    } else if (!b->half_spp || b->half_spp >= b->spp) {
        warn(in, "observer: HALF holds none or all of a block's samples, so that noise cannot be told; no block is stopped "
                 "by it");
        tally.early = 1;
    } else if (read_halves(&in->kit, view, b, w, &tally)) {
        error = error_of(in, b, w);
    } else if (has_structure(w, (size_t)lull_kit_pixels(b))) {
        warn(in, "observer: COLOR and HALF are the same in a block that is not of one colour: HALF must hold a fixed half "
                 "of the samples");
        tally.early = tally.bad = 1;
    } else {
        error = 0;
    }
    lull_kit_verdict(&in->kit, b, &tally, error, in->stop_error, 0, in->kit.value[P_GROWTH], d);
    if (d->action == LULL_CONTINUE && !isnan(d->predicted_spp)) /* the last steps are short: checks cost little here */
        lull_kit_continue(&in->kit, b, ggn_observer_next((double)b->spp, d->predicted_spp, in->kit.value[P_GROWTH]), d);
    if (!isnan(d->error))
        d->p_noisy = ggn_observer_p_noisy(&in->observer, d->error);
}

/* --- instance ---------------------------------------------------------------------------------------------------------- */

static void workers_release(struct lull_instance *in)
{
    free(in->worker);
    free(in->pixels);
    free(in->scratch);
    in->worker = NULL;
    in->pixels = NULL;
    in->scratch = NULL;
    in->workers = 0;
}

/* Scratch memory for blocks of up to `pixels` pixels and `width` columns; replaces that of an open frame. */
static int32_t workers_create(struct lull_instance *in, size_t pixels, int32_t width, struct lull_error *err)
{
    const size_t count = lull_kit_workers(&in->kit), doubles = ggn_visibility_scratch(width);
    const int fits = pixels <= PTRDIFF_MAX / (8 * sizeof(float)) / count;
    struct worker *worker = fits ? calloc(count, sizeof *worker) : NULL;
    float *planes = worker ? malloc(count * 8 * pixels * sizeof *planes) : NULL;
    double *scratch = planes ? malloc(count * doubles * sizeof *scratch) : NULL;

    if (!scratch) {
        free(worker);
        free(planes);
        return lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: out of memory");
    }
    for (size_t i = 0; i < count; i++) {
        float *at = planes + i * 8 * pixels;
        worker[i] = (struct worker){{at, at + 3 * pixels}, {at + 6 * pixels, at + 7 * pixels}, scratch + i * doubles};
    }
    workers_release(in);
    in->worker = worker;
    in->pixels = planes;
    in->scratch = scratch;
    in->workers = (uint32_t)count;
    in->pixels_max = pixels;
    in->width_max = width;
    return LULL_OK;
}

static int32_t check_block(const struct lull_instance *in, const struct lull_block *b, struct lull_error *err)
{
    if ((size_t)lull_kit_pixels(b) > in->pixels_max || b->x1 - b->x0 > in->width_max)
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u is none of the frame's", b->id);
    return LULL_OK;
}

static const struct lull_kit_rule rule;

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err)
{
    struct lull_instance *in = NULL;
    int32_t status = lull_kit_create(&rule, &ggn_plugin_observer, sizeof *in, host, pairs, pair_count, pair_stride, NULL,
                                     instance ? &in : NULL, err);

    if (status)
        return status;
    atomic_flag_clear(&in->warned);
    in->observer = ggn_observer_default;
    in->stop_error = ggn_observer_error_at(&in->observer, in->kit.value[P_VISIBLE]);
    *instance = in;
    return LULL_OK;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    int32_t status = lull_kit_frame_check(in, frame, err), width = 1;
    size_t pixels = 1;

    if (status)
        return status;
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        size_t n = (size_t)(r->x1 - r->x0) * (size_t)(r->y1 - r->y0);
        pixels = n > pixels ? n : pixels;
        width = r->x1 - r->x0 > width ? r->x1 - r->x0 : width;
    }
    status = workers_create(in, pixels, width, err);
    if (status)
        return status;
    atomic_flag_clear(&in->warned);
    lull_kit_frame_open(in, frame);
    return LULL_OK;
}

static void end_frame(struct lull_instance *in)
{
    if (!in)
        return;
    workers_release(in);
    lull_kit_end_frame(in);
}

static void destroy(struct lull_instance *in)
{
    end_frame(in);
    lull_kit_destroy(in);
}

static const struct lull_kit_rule rule = {
    .planes_required = PLANES, .planes_used = PLANES, .first_spp = "first-spp", .judge = judge, .check = check_block};

const struct lull_criterion ggn_plugin_observer = GP_TABLE(
    .create = create, .begin_frame = begin_frame, .evaluate = lull_kit_evaluate, .end_frame = end_frame, .destroy = destroy,
    .get_extension = lull_kit_get_extension, .id = "observer", .name = "Model observer",
    .description = "Noise that people would see, from the two halves of the samples: their difference in lightness, "
                   "slightly blurred and\n"
                   "pooled so that a few bright pixels count, against a limit that rises with the block's texture. `error` "
                   "is the visible\n"
                   "noise over that limit (1 = just not visible), fitted to human thresholds.");
