/*
 * The criterion "observer": the model observer (observer/observer.h) in the renderer. It makes two images of a block, as a
 * display shows them: their difference is noise, their common part the texture that hides noise. With the plane HALF they
 * are the means of the two halves of the samples, and an answer follows from the block's pixels alone. Without it they are
 * the mean plus and minus the noise that an earlier value of the same mean shows (plugin/means.h). `error` is the visible
 * noise over the level at which people stop seeing it, `p_noisy` the share of viewers who still do; a block stops when that
 * is at most `visible`. With `fps` the noise is that of one frame of many. No model.
 */
#include "observer/observer.h"
#include "model/visibility.h"
#include "plugin/criteria.h"
#include "plugin/means.h"
#include "plugin/moving.h"
#include "plugin/pair.h"
#include "plugin/translate.h"
#include "sequence/simulate.h"

enum { P_VISIBLE, P_FIRST_SPP, P_GROWTH, P_FPS, P_PPD, P_COUNT };
enum { COLOR = LULL_PLANE_BIT(LULL_PLANE_COLOR), PLANES = COLOR | LULL_PLANE_BIT(LULL_PLANE_HALF) };

static const struct lull_param params[P_COUNT] = {
    [P_VISIBLE] =
        LULL_KIT_FLOAT("visible", "0.35", 1e-4, 0.9999, "stop when at most this share of viewers would still see noise"),
    [P_FIRST_SPP] = LULL_KIT_INT("first-spp", "16", 2, 1e15, "samples per pixel before the first judgement"),
    [P_GROWTH] = LULL_KIT_FLOAT("growth", "1.5", 1.01, 100, "largest ratio of samples between two checks of a block"),
    [P_FPS] = GP_PARAM_FPS,
    [P_PPD] = GP_PARAM_PPD,
};

struct worker { /* [3][P] linear light of each half, its L*; [patches] */
    float *rgb[2], *lightness[2];
    double *texture, *scratch;
};

struct largest { /* of the blocks of a frame */
    size_t pixels, patches;
    int32_t width;
};

struct lull_instance {
    struct lull_kit kit;
    struct ggn_observer observer;
    struct ggn_temporal temporal;
    double stop_error;
    atomic_flag warned;    /* of planes that say nothing about noise: once per frame */
    struct gp_means means; /* of a frame without HALF */
    uint32_t workers;      /* of the open frame */
    struct largest largest;
    struct worker *worker;
    float *pixels;   /* owns what the workers point into */
    double *scratch; /* likewise */
};

/* --- one block --------------------------------------------------------------------------------------------------------- */

/* split: of the two pictures' difference, to noise as strong as the mean's. */
static double error_of(const struct lull_instance *in, const struct lull_block *b, double split, struct worker *w)
{
    const int width = b->x1 - b->x0, height = b->y1 - b->y0;
    const size_t pixels = (size_t)lull_kit_pixels(b);

    for (int k = 0; k < 2; k++)
        ggn_visible_lightness(w->rgb[k], pixels, w->lightness[k]);
    ggn_visible_texture(w->lightness[0], w->lightness[1], width, height, w->scratch, w->texture);
    for (size_t i = 0; i < pixels; i++)
        w->lightness[0][i] = (float)split * (w->lightness[0][i] - w->lightness[1][i]);
    const int moving = gp_is_moving(&in->kit, P_FPS);
    double noise =
        ggn_visible_noise(w->lightness[0], width, height, w->texture, w->scratch, moving ? w->lightness[1] : NULL);
    if (moving)
        noise *= ggn_temporal_gain(&in->temporal, w->lightness[1], width, height);
    return ggn_observer_error(&in->observer, noise, pixels);
}

/* What the two pictures of w say; differ: they are not the same everywhere. `same` is the warning if they should not be. */
static double verdict_on(struct lull_instance *in, const struct lull_block *b, int differ, double split, const char *same,
                         struct worker *w, struct lull_kit_tally *tally)
{
    if (differ)
        return error_of(in, b, split, w);
    return gp_error_of_same(&in->kit, gp_pair_has_structure(w->rgb[0], (size_t)lull_kit_pixels(b)), &in->warned, same,
                            tally);
}

static double error_of_halves(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                              struct worker *w, struct lull_kit_tally *tally)
{
    if (!gp_has_halves(b)) {
        gp_warn_once(
            &in->kit, &in->warned,
            "observer: HALF holds none or all of a block's samples, so that noise cannot be told; no block is stopped "
            "by it");
        tally->early = 1;
        return (double)NAN;
    }
    int differ = gp_pair_of_halves(&in->kit, view, b, w->rgb, tally);
    return verdict_on(in, b, differ, 0.5 * seq_half_scale((double)b->spp, (double)b->half_spp),
                      "observer: COLOR and HALF are the same in a block that is not of one colour: HALF must hold a fixed "
                      "half of the samples",
                      w, tally);
}

static double error_of_means(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                             struct worker *w, struct lull_kit_tally *tally)
{
    uint64_t spp_base;
    float *keep;
    const float *base = gp_means_begin(&in->means, b->id, b->spp, &keep, &spp_base);
    int differ = gp_pair_of_means(&in->kit, view, b, base, spp_base, keep, w->rgb, tally);

    if (!base) {
        tally->early = 1;
        return (double)NAN;
    }
    return verdict_on(in, b, differ, 0.5,
                      "observer: COLOR has not changed since an earlier check of a block that is not of one colour: it "
                      "must hold the mean of all samples",
                      w, tally);
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    struct worker *w = &in->worker[worker < in->workers ? worker : 0];
    struct lull_kit_tally tally = {0};
    double error = (double)NAN;

    if (b->spp < in->kit.need.first_spp)
        tally.early = 1;
    else
        error = (in->means.count ? error_of_means : error_of_halves)(in, view, b, w, &tally);
    lull_kit_verdict(&in->kit, b, &tally, error, in->stop_error, 0, in->kit.value[P_GROWTH], d);
    if (d->action == LULL_CONTINUE && !isnan(d->predicted_spp)) /* the last steps are short: checks cost little here */
        lull_kit_continue(&in->kit, b, ggn_observer_next((double)b->spp, d->predicted_spp, in->kit.value[P_GROWTH]), d);
    if (!isnan(d->error))
        d->p_noisy = ggn_observer_p_noisy(&in->observer, d->error);
}

/* As lull_kit_evaluate; a call that failed leaves no trace in the means. */
static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    int32_t status = lull_kit_evaluate(in, view, blocks, block_stride, decisions, decision_stride, count, err);

    for (uint32_t i = 0; i < count && !status && in->means.count; i++) {
        const struct lull_block *b = lull_kit_at(blocks, block_stride, i);
        if (b->spp >= in->kit.need.first_spp)
            gp_means_commit(&in->means, b->id);
    }
    return status;
}

/* --- instance ---------------------------------------------------------------------------------------------------------- */

static void workers_release(struct lull_instance *in)
{
    free(in->worker);
    free(in->pixels);
    free(in->scratch);
    gp_means_release(&in->means);
    in->worker = NULL;
    in->pixels = NULL;
    in->scratch = NULL;
    in->workers = 0;
}

/* Scratch memory for blocks of up to this size; replaces that of an open frame. */
static int32_t workers_create(struct lull_instance *in, const struct largest *most, struct lull_error *err)
{
    const size_t count = lull_kit_workers(&in->kit), pixels = most->pixels;
    const size_t doubles = most->patches + ggn_visibility_scratch(most->width);
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
        double *texture = scratch + i * doubles;
        worker[i] =
            (struct worker){{at, at + 3 * pixels}, {at + 6 * pixels, at + 7 * pixels}, texture, texture + most->patches};
    }
    workers_release(in);
    in->worker = worker;
    in->pixels = planes;
    in->scratch = scratch;
    in->workers = (uint32_t)count;
    in->largest = *most;
    return LULL_OK;
}

static int32_t check_block(const struct lull_instance *in, const struct lull_block *b, struct lull_error *err)
{
    const int32_t width = b->x1 - b->x0;
    if ((size_t)lull_kit_pixels(b) > in->largest.pixels || width > in->largest.width ||
        ggn_visible_patches(width, b->y1 - b->y0) > in->largest.patches)
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u is none of the frame's", b->id);
    if (in->means.count && (size_t)lull_kit_pixels(b) * 3 != gp_means_values(&in->means, b->id))
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
    gp_temporal_init(&in->temporal, &in->kit, P_FPS, P_PPD);
    *instance = in;
    return LULL_OK;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    int32_t status = lull_kit_frame_check(in, frame, err);
    struct largest most = {.pixels = 1, .patches = 1, .width = 1};

    if (status)
        return status;
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        const int32_t width = r->x1 - r->x0, height = r->y1 - r->y0;
        const size_t pixels = (size_t)width * (size_t)height, patches = ggn_visible_patches(width, height);
        most.pixels = pixels > most.pixels ? pixels : most.pixels;
        most.patches = patches > most.patches ? patches : most.patches;
        most.width = width > most.width ? width : most.width;
    }
    struct gp_means means = {0};
    if (!(frame->planes & LULL_PLANE_BIT(LULL_PLANE_HALF)))
        status = gp_means_create(&means, frame, err);
    if (!status)
        status = workers_create(in, &most, err);
    if (status) {
        gp_means_release(&means);
        return status;
    }
    in->means = means;
    atomic_flag_clear(&in->warned);
    lull_kit_frame_open(in, frame);
    if (in->means.count)
        gp_log(&in->kit, LULL_LOG_INFO, "observer: no plane HALF: noise is told from how the mean changes between checks");
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
    .planes_required = COLOR, .planes_used = PLANES, .first_spp = "first-spp", .judge = judge, .check = check_block};

/* --- state: of a frame with HALF there is none ------------------------------------------------------------------------- */

static int32_t state_save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    int32_t status = gp_save_check(in, writer, err);
    return status ? status : gp_means_save(&in->means, writer, err);
}

static int32_t state_load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    int32_t status = gp_load_check(in, reader, err);
    return status ? status : gp_means_load(&in->means, reader, err);
}

static const struct lull_state state = {.struct_size = sizeof state, .save = state_save, .load = state_load};

static const void *get_extension(const char *id) { return id && !strcmp(id, LULL_EXT_STATE) ? &state : NULL; }

const struct lull_criterion ggn_plugin_observer =
    GP_TABLE(.create = create, .begin_frame = begin_frame, .evaluate = evaluate, .end_frame = end_frame, .destroy = destroy,
             .get_extension = get_extension, .id = "observer", .name = "Model observer",
             .description =
                 "Noise that people would see, from the two halves of the samples, or, without half buffers, from how\n"
                 "the mean changes between checks: lightness, slightly blurred and pooled so that a few bright pixels\n"
                 "count, against a limit that rises with the texture. `error` is the visible noise over that limit\n"
                 "(1 = just not visible), fitted to human thresholds.");
