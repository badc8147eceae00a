/*
 * The criterion "ggn": a window of the block's last S display images goes through the Guided-Generative Network, whose
 * answer is the probability that the newest image still looks noisy. A block stops after `passes` checks in a row below
 * `visible`.
 *
 * A *residual* model begins with what `observer` measures, from the half buffer or without one from how the mean changes:
 * the network only corrects it. `error` is then the visible noise over what is just visible.
 */
#include "model/inference.h"
#include "sight/measure.h"
#include "sight/observer.h"
#include "plugin/pair.h"
#include "plugin/translate.h"
#include "plugin/windowed.h"

enum { P_MODEL, P_VISIBLE, P_PASSES, P_FIRST_SPP, P_COUNT };

static const struct lull_param params[P_COUNT] = {
    [P_MODEL] = LULL_KIT_FILE("model", NULL,
                              "model file; without it lull-3.ggn beside the criterion, in ../share/lull or in the source "
                              "tree"),
    [P_VISIBLE] = LULL_KIT_FLOAT("visible", NULL, 0, 1,
                                 "stop when less than this share of viewers would still see noise; without it the model's "
                                 "own"),
    [P_PASSES] =
        LULL_KIT_INT("passes", NULL, 1, 16, "checks in a row that must be below that share; without it the model's own"),
    [P_FIRST_SPP] = LULL_KIT_INT("first-spp", NULL, 1, 1e9,
                                 "samples per pixel of the first image of a window; without it the model's own"),
};

struct worker {
    struct ggn_inference *inference;
    uint8_t *noise_map;     /* [pixels of the largest block], for models with the noise map */
    struct ggn_meter meter; /* of a residual model */
    struct ggn_measure measure;
};

static size_t values_of(const struct lull_block *b) { return 3 * (size_t)lull_kit_pixels(b); }

/* The noisy image, 8 bit, and the denoised one, 16 bit; of a residual model also what was measured. */
static struct gp_slot slot_of(const void *of, int32_t width, int32_t height)
{
    const struct lull_instance *in = of;
    const size_t values = 3 * (size_t)width * (size_t)height;
    return (struct gp_slot){.made = 2 * values, .kept = values + (in->rule.reach > 0 ? sizeof(struct ggn_measure) : 0)};
}

static void worker_release(void *data)
{
    struct worker *w = data;
    ggn_inference_destroy(w->inference);
    ggn_meter_release(&w->meter);
    free(w->noise_map);
}

static int worker_init(void *data, const struct lull_instance *in, const struct ggn_meter_room *room, struct base_err *err)
{
    struct worker *w = data;
    w->noise_map = malloc(room->pixels);
    if (w->noise_map && (in->rule.reach <= 0 || !ggn_meter_init(&w->meter, room, err)))
        w->inference = ggn_inference_create(in->model, NULL, err);
    return w->inference ? 0 : err->code;
}

static void model_destroy(void *model) { ggn_model_destroy(model); }

/* Where a slot keeps what was measured of its image; not aligned. */
static unsigned char *measured(const struct gp_block_view *seen, uint32_t slot)
{
    return (unsigned char *)gp_history_kept(&seen->in->frame.history, seen->block->id, slot) + values_of(seen->block);
}

static long read_image(const struct gp_block_view *seen, uint32_t slot)
{
    const struct worker *w = seen->worker;
    if (seen->in->rule.reach > 0)
        memcpy(measured(seen, slot), &w->measure, sizeof w->measure);
    return gp_windowed_read(seen, gp_history_kept(&seen->in->frame.history, seen->block->id, slot));
}

static void measure_block(const struct gp_block_view *seen)
{
    struct lull_instance *in = seen->in;
    const struct lull_block *b = seen->block;
    const struct gp_sight of = {&in->kit, seen->view, b};
    struct worker *w = seen->worker;
    float *const *rgb = w->meter.rgb;
    struct lull_kit_tally tally = {0};
    double split;
    w->measure = (struct ggn_measure){.visible = (double)NAN};
    if (in->rule.reach <= 0)
        return;
    const int differ = gp_pair_of_block(&of, &in->frame.means, "ggn", &in->frame.warned, rgb, &tally, &split);
    if (differ < 0)
        return;
    memset(w->noise_map, 0, (size_t)lull_kit_pixels(b));
    if (differ)
        ggn_measure(&w->meter, b->x1 - b->x0, b->y1 - b->y0, split, 0, &w->measure, w->noise_map);
    else
        w->measure.visible =
            gp_error_of_same(&in->kit, gp_pair_has_structure(rgb[0], (size_t)lull_kit_pixels(b)), &in->frame.warned,
                             "ggn: the planes say that a block has no noise, yet it is not of one colour: "
                             "HALF must hold a fixed half of the samples, COLOR the mean of all",
                             &tally);
}

static double law(void *data)
{
    const struct gp_block_view *seen = data;
    const struct worker *w = seen->worker;
    return ggn_measure_octaves(
        ggn_observer_error(&ggn_observer_default, w->measure.visible, (size_t)lull_kit_pixels(seen->block)));
}

/* The scalars of the window whose newest image has just been measured. */
static void scalars_of(struct gp_block_view *seen, float scalars[GGN_SCALARS])
{
    const struct ggn_stopper *s = &seen->head->stopper;
    struct ggn_measure window[GGN_WINDOW_MAX];
    double spp[GGN_WINDOW_MAX];
    for (uint32_t i = 0; i < s->used; i++) {
        memcpy(&window[i], measured(seen, seen->head->order[i]), sizeof window[i]);
        spp[i] = (double)s->spp[i];
    }
    ggn_measure_scalars(window, spp, (int)s->used, law(seen), scalars);
}

/* Denoises the images that have not been denoised yet. The noise map is that of the visible noise, already measured. */
static double window_logit(void *data)
{
    struct gp_block_view *seen = data;
    const struct gp_history *history = &seen->in->frame.history;
    const struct ggn_model *model = seen->in->model;
    const struct worker *worker = seen->worker;
    const uint8_t *noise_map = model->hyper.noise_map && model->hyper.reach > 0 ? worker->noise_map : NULL;
    const uint8_t *noisy[GGN_WINDOW_MAX];
    const uint16_t *denoised[GGN_WINDOW_MAX];
    const struct lull_block *b = seen->block;
    int w = b->x1 - b->x0, h = b->y1 - b->y0;
    float scalars[GGN_SCALARS] = {0};
    if (seen->in->rule.reach > 0)
        scalars_of(seen, scalars);
    for (int i = 0; i < seen->in->rule.window; i++) {
        uint32_t slot = seen->head->order[i];
        uint16_t *to = gp_history_made(history, b->id, slot);
        noisy[i] = gp_history_kept(history, b->id, slot);
        denoised[i] = to;
        if (!(seen->head->made >> slot & 1))
            ggn_inference_denoise(worker->inference, noisy[i], to, w, h);
        seen->head->made |= UINT32_C(1) << slot;
    }
    return ggn_inference_logit(worker->inference, noisy, denoised, noise_map, scalars, w, h);
}

static int32_t load(struct lull_instance *in, const char *path, struct lull_error *err)
{
    struct base_err error = {0};
    struct ggn_model *model = NULL;
    int rc = ggn_model_load(path, &model, &error);
    in->model = model;
    if (rc || ggn_policy_of(model, &in->rule.policy, &error))
        return gp_fail_from(err, LULL_E_IO, "model", &error);
    in->rule.window = model->hyper.window;
    in->rule.reach = model->hyper.reach;
    if (in->rule.window < 2 || in->rule.window > GGN_WINDOW_MAX)
        return lull_kit_fail(err, LULL_E_IO, "model: %.200s: windows of %d images", path, in->rule.window);
    for (int net = 0; net < GGN_NETS; net++)
        gp_windowed_hash(in, model->weights[net]->params, model->graph[net].n_params * sizeof(float));
    gp_windowed_ready(in, params, P_COUNT, model->hyper.width, model->hyper.height);
    return LULL_OK;
}

static const struct gp_block_view_ops ops = {.model = "lull-3",
                                             .variable = "LULL_MODEL",
                                             .load = load,
                                             .slot = slot_of,
                                             .worker_size = sizeof(struct worker),
                                             .worker_init = worker_init,
                                             .worker_release = worker_release,
                                             .model_destroy = model_destroy,
                                             .measure = measure_block,
                                             .read = read_image,
                                             .evidence = {NULL, window_logit, law}};

GP_CRITERION(
    ggn_plugin_ggn, &gp_windowed_rule, &ops, .version = "1.0", .id = "ggn", .name = "Guided-Generative Network",
    .description =
        "Probability that a viewer still sees noise in the block, from the last images of it (Buisine, Teytaud,\n"
        "Delepoulle, Renaud 2022). `error`, of a model with residual, is the visible noise over what is just visible.");
