/*
 * The criterion "observer": the model observer (sight/observer.h) in the renderer. Two witnesses tell how visible a
 * block's noise is, and their weighted root mean square decides (sight/visibility.h):
 *
 * - A pair of pictures, as a display shows them: their difference is noise, their common part the texture that hides noise.
 *   With the plane HALF they are the means of the two halves of the samples. Without it they are the mean plus and minus the
 *   noise that an earlier value of the same mean shows (plugin/means.h).
 * - The second moments of the samples, where the host has MOMENT2. They know how strong the noise of each pixel is, not only
 *   one draw of it, so that two halves which agree by luck stop nothing.
 *
 * A block smaller than 200x200 pixels is little evidence that rare light was met. It stops only where the 200x200 pixels
 * about it show at most three times the limit. One smaller than 100x100 also waits until a sample as bright as its brightest
 * no longer matters to its mean (plugin/undersampled.h). Where bright noise of the pixels beyond a block's edges may reach
 * over them, the block stops only if it shows no more than the limit together with those pixels.
 *
 * `error` is the visible noise over the level at which people stop seeing it, `p_noisy` the share of viewers who still do; a
 * block stops when that is at most `visible`, or `error` at most the parameter of that name. With `fps` the noise is that of
 * one frame of many, with `ppd` that of a display with so many pixels per degree. No model.
 */
#include "sight/measure.h"
#include "sight/visibility.h"
#include "plugin/criteria.h"
#include "plugin/means.h"
#include "plugin/pair.h"
#include "plugin/rect.h"
#include "plugin/translate.h"
#include "plugin/viewer.h"
#include "plugin/undersampled.h"
#include "sequence/simulate.h"

enum { P_VISIBLE, P_ERROR, P_FIRST_SPP, P_GROWTH, P_FPS, P_PPD, P_COUNT };
enum {
    COLOR = LULL_PLANE_BIT(LULL_PLANE_COLOR),
    PLANES = COLOR | LULL_PLANE_BIT(LULL_PLANE_HALF) | LULL_PLANE_BIT(LULL_PLANE_MOMENT2) | LULL_PLANE_BIT(LULL_PLANE_SPP)
};
enum { WINDOW = 200 };            /* pixels, the side of a block that is evidence enough by itself */
enum { BORDER = 2 };              /* pixels, the reach of the eye's blur (sight/visibility.h) */
static const double AROUND = 3.0; /* a smaller one stops only where its surroundings show at most so many times the limit */

static const struct lull_param params[P_COUNT] = {
    [P_VISIBLE] =
        LULL_KIT_FLOAT("visible", "0.35", 1e-4, 0.9999, "stop when at most this share of viewers would still see noise"),
    [P_ERROR] = GP_PARAM_ERROR,
    [P_FIRST_SPP] = LULL_KIT_INT("first-spp", "16", 2, 1e15, "samples per pixel before the first judgement"),
    [P_GROWTH] = LULL_KIT_FLOAT("growth", "1.5", 1.01, 100, "largest ratio of samples between two checks of a block"),
    [P_FPS] = GP_PARAM_FPS,
    [P_PPD] = GP_PARAM_PPD,
};

struct frame {
    atomic_flag warned;      /* of planes that say nothing about noise: once per frame */
    atomic_flag held;        /* likewise, of blocks that wait for light alone */
    struct gp_history means; /* without HALF */
    struct lull_rect area;   /* around all blocks */
    struct ggn_meter_room room;
    struct ggn_meter *meter; /* [workers] */
    uint32_t workers;
};

struct lull_instance {
    struct lull_kit kit;
    struct gp_viewer viewer;
    struct frame frame;
};

/* A side of what surrounds a small block: WINDOW pixels about it, as far as the frame reaches. */
static void widen(int32_t *from, int32_t *to, int32_t first, int32_t last)
{
    const int32_t more = WINDOW - (*to - *from);
    *from = gp_most(first, *from - more / 2);
    *to = gp_least(last, *to + more - more / 2);
}

static struct lull_rect window_of(const struct lull_rect *frame, struct lull_rect r)
{
    if (r.x1 - r.x0 < WINDOW)
        widen(&r.x0, &r.x1, frame->x0, frame->x1);
    if (r.y1 - r.y0 < WINDOW)
        widen(&r.y0, &r.y1, frame->y0, frame->y1);
    return r;
}

static int32_t within(int64_t at, int32_t first, int32_t last)
{
    return at < first ? first : at > last ? last : (int32_t)at;
}

/* A block and BORDER pixels about it, as far as the frame reaches. */
static struct lull_rect border_of(const struct lull_rect *frame, struct lull_rect r)
{
    return (struct lull_rect){
        within((int64_t)r.x0 - BORDER, frame->x0, frame->x1), within((int64_t)r.y0 - BORDER, frame->y0, frame->y1),
        within((int64_t)r.x1 + BORDER, frame->x0, frame->x1), within((int64_t)r.y1 + BORDER, frame->y0, frame->y1)};
}

/* A block that is asked about. */
struct question {
    struct lull_instance *in;
    struct gp_sight of;
    struct ggn_meter *w;
};

static void see_both(struct ggn_meter *w, size_t pixels)
{
    for (int k = 0; k < 2; k++)
        ggn_visible_lightness(w->rgb[k], pixels, w->lightness[k]);
}

/* Visible noise of the two pictures of w, whose difference is made as strong as the noise of the mean by `split`; the
 * texture they share stays in w. *gain: of the noise, where it is that of one frame of many. */
static double noise_of_difference(const struct question *q, int width, int height, double split, double *gain)
{
    const size_t pixels = (size_t)width * (size_t)height;
    const struct ggn_viewing *viewing = q->in->viewer.viewing;
    struct ggn_meter *w = q->w;
    see_both(w, pixels);
    ggn_visible_texture(w->lightness[0], w->lightness[1], width, height, w->scratch, w->texture);
    for (size_t i = 0; i < pixels; i++)
        w->lightness[0][i] = (float)split * (w->lightness[0][i] - w->lightness[1][i]);
    double noise =
        ggn_visible_noise(w->lightness[0], width, height, w->texture, w->scratch, viewing ? w->lightness[1] : NULL);
    *gain = viewing ? ggn_viewing_gain(viewing, w->lightness[1], width, height, NULL) : 1;
    return noise;
}

/* Visible noise that second moments let expect before w's texture; 0: they tell of none. One standard deviation to either
 * side of a mean; two, halved, where one lies beyond white, as after two lucky hits of a lamp smaller than the pixel. */
static double noise_of_moments(const struct question *q, struct lull_rect area)
{
    const int width = area.x1 - area.x0, height = area.y1 - area.y0;
    const size_t pixels = (size_t)width * (size_t)height;
    struct ggn_meter *w = q->w;
    if (!gp_pair_of_moments(&q->of, area, 1, w->rgb))
        return 0;
    see_both(w, pixels);
    for (size_t i = 0; i < pixels; i++)
        w->blurred[i] = 0.5f * (w->lightness[0][i] - w->lightness[1][i]);
    gp_pair_of_moments(&q->of, area, 2, w->rgb);
    see_both(w, pixels);
    for (size_t i = 0; i < pixels; i++) {
        const float d = fmaxf(w->blurred[i], 0.25f * (w->lightness[0][i] - w->lightness[1][i]));
        w->blurred[i] = d * d;
    }
    return ggn_visible_expected(w->blurred, width, height, w->texture, w->scratch);
}

static int has_moments(const struct question *q)
{
    return lull_kit_plane(q->of.view, LULL_PLANE_MOMENT2) && q->of.block->spp >= 2;
}

/* The error of an area, whose two pictures are in w; differ: anywhere. Where only second moments tell of noise, as when both
 * halves have hit a small lamp equally often, they decide alone. NaN: neither tells of any. */
static double error_of(const struct question *q, struct lull_rect area, int differ, double split)
{
    const int width = area.x1 - area.x0, height = area.y1 - area.y0, moments = has_moments(q);
    double gain, expected = 0;
    if (!differ && !moments)
        return (double)NAN;
    double noise = noise_of_difference(q, width, height, split, &gain);
    if (moments)
        expected = noise_of_moments(q, area);
    if (!differ && expected == 0)
        return (double)NAN;
    if (moments)
        noise = differ ? ggn_visible_together(noise, expected) : expected;
    return ggn_observer_error(&ggn_observer_default, gain * noise, (size_t)width * (size_t)height);
}

/* That of the block, or of one in which nothing tells of noise. */
static double error_of_block(const struct question *q, struct lull_kit_tally *tally)
{
    struct frame *f = &q->in->frame;
    const struct lull_block *b = q->of.block;
    const char *same = f->means.count ? "observer: COLOR has not changed since an earlier check of a block that is not of "
                                        "one colour: it must hold the mean of all samples"
                                      : "observer: COLOR and HALF are the same in a block that is not of one colour: HALF "
                                        "must hold a fixed half of the samples";
    double split;
    const int differ = gp_pair_of_block(&q->of, &f->means, "observer", &f->warned, q->w->rgb, tally, &split);
    if (differ < 0) {
        tally->early = 1;
        return (double)NAN;
    }
    const int structure = !differ && gp_pair_has_structure(q->w->rgb[0], (size_t)lull_kit_pixels(b));
    const double error = error_of(q, gp_rect_of(b), differ, split);
    return isnan(error) ? gp_error_of_same(q->of.kit, structure, &f->warned, same, tally) : error;
}

/* Whether there is scratch memory for an area; not for those of blocks that are none of the frame's. */
static int has_room(const struct ggn_meter_room *room, struct lull_rect area)
{
    const int32_t width = area.x1 - area.x0, height = area.y1 - area.y0;
    return width > 0 && height > 0 && width <= room->width && (size_t)width * (size_t)height <= room->pixels &&
           ggn_visible_patches(width, height) <= room->patches;
}

/* The error of an area around a block; 0 where it is the block, or tells of no noise. */
static double error_of_area(const struct question *q, struct lull_rect area)
{
    const struct lull_block *b = q->of.block;
    struct lull_kit_tally ignored = {0};
    if (gp_rect_same(gp_rect_of(b), area) || !has_room(&q->in->frame.room, area))
        return 0;
    const int differ = gp_pair_of_halves(&q->of, area, q->w->rgb, &ignored);
    const double error = error_of(q, area, differ, 0.5 * seq_half_scale((double)b->spp, (double)b->half_spp));
    return isnan(error) ? 0 : error;
}

/* What the surroundings of a block let expect of it: whether a few samples of a few pixels have met rare light is luck, and
 * those beside it had other luck. 0 where there are none. */
static double error_around(const struct question *q)
{
    const struct lull_rect area = window_of(&q->in->frame.area, gp_rect_of(q->of.block));
    return q->of.view->all ? error_of_area(q, area) / AROUND : 0;
}

/* What a block shows together with the pixels at its edges, where light of those may reach over them unseen; 0 elsewhere. */
static double error_at_edges(const struct question *q)
{
    const struct lull_rect own = gp_rect_of(q->of.block), area = border_of(&q->in->frame.area, own);
    if (!has_room(&q->in->frame.room, area) || !q->of.view->all || !has_moments(q))
        return 0;
    gp_pair_of_moments(&q->of, area, 1, q->w->rgb);
    return gp_undersampled_edge(own, area, q->w->rgb) ? error_of_area(q, area) : 0;
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    const struct question q = {in, {&in->kit, view, b}, &in->frame.meter[worker < in->frame.workers ? worker : 0]};
    struct lull_kit_tally tally = {0};
    double error = (double)NAN;
    if (b->spp < in->kit.need.first_spp)
        tally.early = 1;
    else
        error = error_of_block(&q, &tally);
    /* What surrounds a block, and what it may not have met, is read where it matters: before a stop, and where the answer is
     * all that is wanted. */
    if (!in->frame.means.count && (error <= in->viewer.stop_error || (b->flags & LULL_BLOCK_FINAL && !isnan(error)))) {
        const double seen = fmax(error, fmax(error_around(&q), error_at_edges(&q)));
        const double undersampled = gp_undersampled_error(&in->kit, view, b);
        if (seen <= in->viewer.stop_error && undersampled > in->viewer.stop_error)
            gp_say_once(&in->kit, LULL_LOG_INFO, &in->frame.held,
                        "blocks below 100x100 pixels go on though no noise is seen: a few samples like their "
                        "brightest would be");
        error = fmax(seen, undersampled);
    }
    lull_kit_verdict(&in->kit, b, &tally, error, in->viewer.stop_error, 0, in->kit.value[P_GROWTH], d);
    if (d->action == LULL_CONTINUE && !isnan(d->predicted_spp)) /* the last steps are short: checks cost little here */
        lull_kit_continue(&in->kit, b, ggn_observer_next((double)b->spp, d->predicted_spp, in->kit.value[P_GROWTH]), d);
    if (!isnan(d->error))
        d->p_noisy = ggn_observer_p_noisy(&ggn_observer_default, d->error);
}

static void keep(struct lull_instance *in, const struct lull_block *b)
{
    if (in->frame.means.count && b->spp >= in->kit.need.first_spp)
        in->frame.means.block[b->id].head = in->frame.means.block[b->id].pending;
}

static void frame_release(void *data)
{
    struct frame *f = data;
    for (uint32_t i = 0; i < f->workers; i++)
        ggn_meter_release(&f->meter[i]);
    free(f->meter);
    gp_history_release(&f->means);
}

static int32_t check_block(const struct lull_instance *in, const struct lull_block *b, struct lull_error *err)
{
    const size_t bytes = 3 * (size_t)lull_kit_pixels(b) * sizeof(float);
    if (!has_room(&in->frame.room, gp_rect_of(b)) ||
        (in->frame.means.count && bytes != in->frame.means.block[b->id].slot.kept))
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u is none of the frame's", b->id);
    return LULL_OK;
}

static int32_t init(struct lull_instance *in, const void *own, const char *const *text, struct lull_error *err)
{
    (void)own;
    (void)text;
    (void)err;
    gp_viewer_init(&in->viewer, in->kit.value, P_VISIBLE, P_ERROR, P_FPS, P_PPD);
    in->kit.need.halo = WINDOW / 2;
    return LULL_OK;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    const uint32_t workers = lull_kit_workers(&in->kit);
    struct frame fresh = {.area = gp_rect_of_frame(frame), .meter = calloc(workers, sizeof *fresh.meter)};
    int good = fresh.meter != NULL;
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect own = *lull_kit_rect(frame, i),
                               around[] = {window_of(&fresh.area, own), border_of(&fresh.area, own)};
        for (int k = 0; k < 2; k++)
            ggn_meter_make_room(&fresh.room, around[k].x1 - around[k].x0, around[k].y1 - around[k].y0);
    }
    int32_t status = frame->planes & LULL_PLANE_BIT(LULL_PLANE_HALF) ? LULL_OK : gp_means_create(&fresh.means, frame, err);
    while (good && fresh.workers < workers)
        good = !ggn_meter_init(&fresh.meter[fresh.workers++], &fresh.room, NULL);
    if (!status && !good)
        status = lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: out of memory");
    status = gp_frame_open(in, frame, &fresh, status);
    if (!status && in->frame.means.count)
        gp_log(&in->kit, LULL_LOG_INFO, "observer: no plane HALF: noise is told from how the mean changes between checks");
    return status;
}

/* Of a frame with HALF nothing is saved. */
static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    return gp_means_save(&in->frame.means, writer, err);
}

static int32_t load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    return gp_means_load(&in->frame.means, reader, err);
}

static const struct gp_rule rule = {
    .kit = {.planes_required = COLOR, .planes_used = PLANES, .first_spp = "first-spp", .judge = judge, .check = check_block},
    .size = sizeof(struct lull_instance),
    .frame_at = offsetof(struct lull_instance, frame),
    .frame_size = sizeof(struct frame),
    .init = init,
    .begin_frame = begin_frame,
    .frame_release = frame_release,
    .keep = keep,
    .save = save,
    .load = load,
};

GP_CRITERION(ggn_plugin_observer, &rule, NULL, .version = "1.1", .id = "observer", .name = "Model observer",
             .description =
                 "Noise that people would see, from the two halves of the samples (without half buffers, from how the\n"
                 "mean changes between checks) and from their second moments: lightness, slightly blurred and pooled so\n"
                 "that a few bright pixels count, against a limit that rises with the texture. `error` is the visible\n"
                 "noise over that limit (1 = just not visible), fitted to human thresholds. Small blocks also wait for\n"
                 "what surrounds them, those below 100x100 pixels until no single sample matters, for up to a tenth more\n"
                 "samples in all.");
