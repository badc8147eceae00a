/*
 * The criterion "denoised", of denoised.so: when is the picture good that people keep, which is denoised? Each check
 * denoises both halves of a block's samples, together with those of its neighbours that are due (plugin/denoised/cover.h),
 * and estimates how visible the error of the kept picture is (plugin/denoised/block_view.h): from the difference of the
 * denoised halves, and from that of each from the other, noisy one. `error` is the larger of the two over the level at which
 * people stop seeing it. A block stops when a check finds it low enough for `visible`, and so did the one before, or the
 * trend is low as well, since one low error can be luck; or when the first one is far below the limit.
 *
 * The history of a block is its last check, with the trend: asked again at the same samples it answers the same, though its
 * neighbours, which the denoiser reads too, may have changed.
 */
#include "plugin/criteria.h"
#include "plugin/denoised/block_view.h"
#include "plugin/denoised/cover.h"
#include "plugin/translate.h"
#include "plugin/viewer.h"

static const double STEP = 1.25;              /* of samples from check to check, at least */
static const double CLEAR = 0.8, APART = 0.4; /* of the limit, below it: so low a first error needs no other */
static const double FALL = 0.4; /* the error falls as samples^-FALL: slower than noise, since part of it is bias */

enum { P_VISIBLE, P_ERROR, P_FIRST_SPP, P_GROWTH, P_PICTURE, P_QUALITY, P_LIBRARY, P_FPS, P_PPD, P_COUNT };
enum {
    REQUIRED = LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF),
    AUXILIARY = LULL_PLANE_BIT(LULL_PLANE_ALBEDO) | LULL_PLANE_BIT(LULL_PLANE_NORMAL)
};

static const struct lull_param params[P_COUNT] = {
    [P_VISIBLE] = LULL_KIT_FLOAT("visible", "0.35", 1e-4, 0.9999,
                                 "stop when at most this share of viewers would still see an error of the denoised picture"),
    [P_ERROR] = GP_PARAM_ERROR,
    [P_FIRST_SPP] =
        LULL_KIT_INT("first-spp", NULL, 2, 1e15,
                     "samples per pixel before the first judgement; without it 64, for an error above 2 128 over "
                     "that, 16 at least"),
    [P_GROWTH] = LULL_KIT_FLOAT("growth", "2", 1.5, 100, "largest ratio of samples between two checks of a block"),
    [P_PICTURE] = LULL_KIT_CHOICE("picture", "blend", "blend|denoised",
                                  "what is kept: the blend of noisy and denoised picture, or the denoised one alone"),
    [P_QUALITY] = LULL_KIT_CHOICE("quality", "high", "fast|balanced|high", "of the denoiser"),
    [P_LIBRARY] =
        LULL_KIT_FILE("library", NULL, "Open Image Denoise, or a folder that holds it; else LULL_OIDN and the usual places"),
    [P_FPS] = GP_PARAM_FPS,
    [P_PPD] = GP_PARAM_PPD,
};

struct past {     /* what is remembered of a block; saved as it is, without padding */
    uint64_t spp; /* of the last check; 0: none */
    uint64_t next_spp;
    double p_noisy, predicted_spp, error, halves, crossed; /* the last two in units of `error` */
    double trend; /* of the error at spp: half this check's, half what the trend before lets expect; NaN: none */
    int32_t action;
    uint32_t flags;
};

struct block {
    struct lull_rect rect;
    struct past past, pending;
    enum gd_halves halves; /* of one question */
};

struct frame {          /* what an open one needs; owns what it points to */
    atomic_flag warned; /* of halves that are none: once per frame */
    struct gd_form form;
    struct gd_look look;
    struct gd_block_view *seen; /* [workers] */
    uint32_t workers;
    struct block *block;          /* [blocks] */
    struct lull_kit_tally *tally; /* [blocks]: of one question, as all of these: */
    struct gd_group *groups;      /* [blocks] */
    uint32_t *next, *members;     /* [blocks]: links of groups, the blocks of one */
};

struct lull_instance {
    struct lull_kit kit;
    struct gp_viewer viewer;
    char *library; /* owns; NULL: the usual places */
    struct frame frame;
};

/* The larger of both errors, NaN where there is none; *now gets both. */
static double error_of(struct lull_instance *in, struct gd_block_view *seen, const struct lull_block *b,
                       struct lull_kit_tally *tally, struct past *now)
{
    const size_t pixels = (size_t)lull_kit_pixels(b);
    const struct block *of = &in->frame.block[b->id];
    *tally = in->frame.tally[b->id];
    if (of->halves != GD_HALVES_DIFFER)
        return now->halves = now->crossed =
                   gp_error_of_same(&in->kit, of->halves == GD_HALVES_STRUCTURED, &in->frame.warned,
                                    "denoised: COLOR and HALF are the same in a block that is not of one colour: HALF must "
                                    "hold a fixed half of the samples",
                                    tally);
    const struct ggn_kept_errors e =
        gd_block_view_errors(seen, &in->frame.look, &in->kit, b, in->kit.value[P_PICTURE] == 0, in->viewer.viewing);
    now->halves = ggn_observer_error(&ggn_observer_default, e.halves, pixels);
    now->crossed = ggn_observer_error(&ggn_observer_default, e.crossed, pixels);
    return fmax(now->halves, now->crossed);
}

/* The next check is at as many samples as the error tells, but at least STEP and at most `growth` times what there is: it is
 * not known better. now: the last check; gets the trend of this one. */
static void decide(const struct lull_instance *in, const struct lull_block *b, const struct lull_kit_tally *tally,
                   double error, struct past *now, struct lull_decision *d)
{
    const double spp = (double)b->spp, growth = in->kit.value[P_GROWTH];
    const int before = now->spp > 0 && !isnan(now->error);
    lull_kit_verdict(&in->kit, b, tally, error, in->viewer.stop_error, 0, growth, d);
    now->trend = before ? 0.5 * (d->error + now->trend * pow((double)now->spp / spp, FALL)) : d->error;
    const int confirmed = before ? fmin(now->error, now->trend) <= in->viewer.stop_error
                                 : d->error <= fmin(CLEAR * in->viewer.stop_error, in->viewer.stop_error - APART);
    if (d->action == LULL_STOP && !isnan(d->error) && !confirmed) {
        lull_kit_continue(&in->kit, b, STEP * spp, d);
        d->predicted_spp = (double)d->next_spp;
    } else if (d->action == LULL_CONTINUE && !isnan(d->predicted_spp)) {
        d->predicted_spp = spp * pow(d->error / in->viewer.stop_error, 1.0 / FALL);
        lull_kit_continue(&in->kit, b, fmin(fmax(d->predicted_spp, STEP * spp), growth * spp), d);
    }
    if (!isnan(d->error))
        d->p_noisy = ggn_observer_p_noisy(&ggn_observer_default, d->error);
}

/* Whether this block's samples are to be judged, which they have not been before. */
static int is_new(const struct lull_instance *in, const struct lull_block *b)
{
    return in->frame.block[b->id].past.spp != b->spp || b->spp == 0;
}

static int can_be_judged(const struct lull_instance *in, const struct lull_block *b)
{
    return b->spp >= in->kit.need.first_spp && gp_has_halves(b);
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    struct gd_block_view *seen = &in->frame.seen[worker < in->frame.workers ? worker : 0];
    struct past *now = &in->frame.block[b->id].pending;
    struct lull_kit_tally tally = {0};
    double error = (double)NAN;
    (void)view;
    *now = in->frame.block[b->id].past; /* the answer, if it is asked for again */
    if (is_new(in, b)) {
        now->halves = now->crossed = (double)NAN;
        if (can_be_judged(in, b))
            error = error_of(in, seen, b, &tally, now);
        else
            tally.early = 1;
        if (b->spp >= in->kit.need.first_spp && !gp_has_halves(b))
            gp_say_once(&in->kit, LULL_LOG_WARNING, &in->frame.warned,
                        "denoised: HALF holds none or all of a block's samples, so that errors cannot be told; no block is "
                        "stopped by it");
        decide(in, b, &tally, error, now, d);
        *now = (struct past){b->spp,      d->next_spp,  d->p_noisy, d->predicted_spp, d->error,
                             now->halves, now->crossed, now->trend, d->action,        d->flags};
    }
    d->action = now->action;
    d->flags = now->flags;
    d->next_spp = now->next_spp;
    d->p_noisy = now->p_noisy;
    d->predicted_spp = now->predicted_spp;
    d->error = now->error;
}

static void log_response(const struct lull_instance *in, const struct lull_block *b, const struct past *now)
{
    char line[160];
    if (isnan(now->error))
        return;
    snprintf(line, sizeof line, "denoised: block %u at %llu spp: error %.2f by its halves, %.2f crossed; stops at %.2f",
             b->id, (unsigned long long)b->spp, now->halves, now->crossed, in->viewer.stop_error);
    gp_log(&in->kit, LULL_LOG_DEBUG, line);
}

/* Denoises a group's blocks together, then judges each. */
static int32_t look_at(struct lull_instance *in, const struct lull_kit_batch *batch, const struct gd_group *group,
                       struct lull_error *err)
{
    struct frame *f = &in->frame;
    struct base_err why = {0};
    uint32_t count = 0;
    f->members[count++] = group->first;
    for (uint32_t i = group->first; i != group->last; i = f->next[i])
        f->members[count++] = f->next[i];
    if (gd_look_run(&f->look, &f->form, batch, &group->box, f->members, count, f->tally, &why))
        return gp_fail_from(err, LULL_E_INTERNAL, "evaluate", &why);
    return gp_judge(batch, f->members, count, err);
}

/* Finds the blocks that must be denoised, each a group of its own, and in members[] the others. Returns how many of each. */
static uint32_t sort_out(struct lull_instance *in, const struct lull_kit_batch *batch, uint32_t *others)
{
    uint32_t groups = 0;
    *others = 0;
    for (uint32_t i = 0; i < batch->count; i++) {
        const struct lull_block *b = lull_kit_at(batch->blocks, batch->block_stride, i);
        struct block *of = &in->frame.block[b->id];
        const int look = is_new(in, b) && can_be_judged(in, b);
        in->frame.tally[b->id] = (struct lull_kit_tally){0};
        if (look)
            of->halves = gd_halves_of(batch->view, b, &in->frame.tally[b->id]);
        if (look && of->halves == GD_HALVES_DIFFER)
            in->frame.groups[groups++] = (struct gd_group){gd_box_around(&of->rect, &in->frame.form.area), i, i};
        else
            in->frame.members[(*others)++] = i;
    }
    return groups;
}

/* Denoises neighbours together; fails when blocks could not be denoised. */
static int32_t answer(const struct lull_kit_batch *batch, struct lull_error *err)
{
    struct lull_instance *in = batch->in;
    uint32_t others;
    if (batch->count > in->kit.block_count)
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: more blocks than the frame has");
    uint32_t groups = sort_out(in, batch, &others);
    int32_t status = gp_judge(batch, in->frame.members, others, err);
    if (batch->view->all)
        groups = gd_cover(in->frame.groups, groups, in->frame.next, in->frame.form.most);
    for (uint32_t g = 0; g < groups && !status; g++)
        status = look_at(in, batch, &in->frame.groups[g], err);
    return status;
}

static void keep(struct lull_instance *in, const struct lull_block *b)
{
    struct block *of = &in->frame.block[b->id];
    if (of->past.spp != b->spp)
        log_response(in, b, &of->pending);
    of->past = of->pending;
}

static void frame_release(void *data)
{
    struct frame *f = data;
    for (uint32_t i = 0; i < f->workers; i++)
        gd_block_view_release(&f->seen[i]);
    free(f->seen);
    gd_look_close(&f->look);
    free(f->block);
    free(f->tally);
    free(f->groups);
    free(f->next);
}

static int blocks_create(struct frame *f, const struct lull_frame *frame, uint32_t workers, struct base_err *why)
{
    const size_t n = frame->block_count;
    f->seen = calloc(workers, sizeof *f->seen);
    f->block = calloc(n, sizeof *f->block);
    f->tally = malloc(n * sizeof *f->tally);
    f->groups = malloc(n * sizeof *f->groups);
    f->next = malloc(2 * n * sizeof *f->next);
    if (!f->seen || !f->block || !f->tally || !f->groups || !f->next)
        return base_fail_nomem(why, "the blocks");
    f->members = f->next + n;
    for (uint32_t i = 0; i < n; i++)
        f->block[i].rect = *lull_kit_rect(frame, i);
    return 0;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    const enum lull_oidn_quality quality = (enum lull_oidn_quality)(LULL_OIDN_FAST + (int)in->kit.value[P_QUALITY]);
    const uint32_t workers = lull_kit_workers(&in->kit);
    struct frame fresh = {.form = gd_form_of(frame, quality, workers)};
    struct base_err why = {0};
    int rc = blocks_create(&fresh, frame, workers, &why);
    if (!rc)
        rc = gd_look_open(&fresh.look, &fresh.form, in->library, &why);
    while (!rc && fresh.workers < workers)
        rc = gd_block_view_create(&fresh.seen[fresh.workers++], &fresh.form, &why);
    int32_t status = rc ? gp_fail_from(err, LULL_E_INTERNAL, "begin_frame", &why) : LULL_OK;
    status = gp_frame_open(in, frame, &fresh, status);
    if (status)
        return status;
    if ((frame->planes & AUXILIARY) != AUXILIARY)
        gp_log(&in->kit, LULL_LOG_WARNING,
               "denoised: without the planes ALBEDO and NORMAL the denoiser blurs textures: "
               "blocks take more samples");
    if (frame->flags & LULL_FRAME_SHARED)
        gp_log(&in->kit, LULL_LOG_WARNING,
               "denoised: the filter gives neighbouring pixels the same samples: the denoiser "
               "takes their noise for structure; use a filter within the pixel");
    return LULL_OK;
}

static int32_t check_block(const struct lull_instance *in, const struct lull_block *b, struct lull_error *err)
{
    return gp_check_block(b, &in->frame.block[b->id].rect, in->frame.block[b->id].past.spp, err);
}

/* Drafts are good enough earlier. With these first looks stops are no more often off than with 64 samples for all
 * (docs/results/denoised.md). */
static uint64_t first_spp(const struct lull_instance *in)
{
    const double given = in->kit.value[P_FIRST_SPP];
    return (uint64_t)(isnan(given) ? fmin(fmax(128 / in->viewer.stop_error, 16), 64) : given);
}

static int32_t init(struct lull_instance *in, const void *own, const char *const *text, struct lull_error *err)
{
    struct lull_oidn *oidn = NULL;
    struct base_err why = {0};
    (void)own;
    in->library = text[P_LIBRARY] ? strdup(text[P_LIBRARY]) : NULL;
    if (text[P_LIBRARY] && !in->library)
        return lull_kit_fail(err, LULL_E_MEMORY, "create: out of memory");
    if (lull_oidn_open(in->library, &oidn, &why)) /* else only begin_frame would find that there is none */
        return gp_fail_from(err, LULL_E_VALUE, "library", &why);
    lull_oidn_close(oidn);
    gp_viewer_init(&in->viewer, in->kit.value, P_VISIBLE, P_ERROR, P_FPS, P_PPD);
    in->kit.need.first_spp = first_spp(in);
    in->kit.need.halo = GD_REACH;
    in->kit.need.checks_hint = 5;
    in->kit.need.bytes_per_block = sizeof(struct block) + sizeof(struct lull_kit_tally) + sizeof(struct gd_group) +
                                   2 * sizeof(uint32_t) + sizeof(uint8_t);
    return LULL_OK;
}

static void release(struct lull_instance *in) { free(in->library); }

struct state_header {
    char magic[8];
    uint64_t blocks;
};

static struct state_header header_of(const struct lull_instance *in)
{
    return (struct state_header){{'d', 'e', 'n', 'o', 'i', 's', 'e', '2'}, in->kit.block_count};
}

static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    const struct state_header header = header_of(in);
    int32_t status = writer->write(writer, &header, sizeof header);
    for (uint32_t i = 0; i < in->kit.block_count && !status; i++)
        status = writer->write(writer, &in->frame.block[i].past, sizeof(struct past));
    return status ? lull_kit_fail(err, status, "save: the host could not write it") : LULL_OK;
}

static int plausible(const struct past *p)
{
    const double numbers[] = {p->predicted_spp, p->error, p->halves, p->crossed, p->trend};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        if (!isnan(numbers[i]) && !(numbers[i] >= 0))
            return 0;
    return (isnan(p->p_noisy) || (p->p_noisy >= 0 && p->p_noisy <= 1)) &&
           (p->action == LULL_STOP || p->action == LULL_CONTINUE) &&
           !(p->flags & ~(LULL_DECISION_TOO_EARLY | LULL_DECISION_BAD_INPUT)) && (!p->next_spp || p->next_spp > p->spp);
}

static int32_t load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    struct state_header header, wanted = header_of(in);
    if (reader->read(reader, &header, sizeof header) != LULL_OK || memcmp(&header, &wanted, sizeof header) != 0)
        return lull_kit_fail(err, LULL_E_IO, "load: the state is that of another criterion or frame");
    for (uint32_t i = 0; i < in->kit.block_count; i++)
        if (reader->read(reader, &in->frame.block[i].pending, sizeof(struct past)) != LULL_OK)
            return lull_kit_fail(err, LULL_E_IO, "load: the state ends early");
    for (uint32_t i = 0; i < in->kit.block_count; i++)
        if (!plausible(&in->frame.block[i].pending))
            return lull_kit_fail(err, LULL_E_IO, "load: the state of block %u is none", i);
    for (uint32_t i = 0; i < in->kit.block_count; i++)
        in->frame.block[i].past = in->frame.block[i].pending;
    return LULL_OK;
}

static const struct gp_rule rule = {
    .kit = {.planes_required = REQUIRED, .planes_used = REQUIRED | AUXILIARY, .judge = judge, .check = check_block},
    .size = sizeof(struct lull_instance),
    .frame_at = offsetof(struct lull_instance, frame),
    .frame_size = sizeof(struct frame),
    .init = init,
    .release = release,
    .begin_frame = begin_frame,
    .frame_release = frame_release,
    .answer = answer,
    .keep = keep,
    .save = save,
    .load = load,
};

GP_CRITERION(ggn_plugin_denoised, &rule, NULL, .version = "1.0", .id = "denoised", .name = "Denoised picture",
             .description =
                 "Error that people would see in the denoised picture, its bias included: both halves of the samples are\n"
                 "denoised (Open Image Denoise) and held against each other and against the other half, noisy. `error`\n"
                 "is the larger of the two over the limit of the model observer (1 = just not visible).");
