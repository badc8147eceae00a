/*
 * The criteria "svd-entropy", "attributes" and "noise-mask": the published models before the network (baselines/baseline.h)
 * in the renderer. An image leaves only its numbers behind; the block stops after `passes` checks in a row below `visible`.
 */
#include "baselines/baseline.h"
#include "baselines/lstm.h"
#include "plugin/translate.h"
#include "plugin/windowed.h"

enum { P_MODEL, P_VISIBLE, P_PASSES, P_FIRST_SPP, P_COUNT };

static const struct lull_param params[P_COUNT] = {
    [P_MODEL] = LULL_KIT_FILE("model", NULL,
                              "file that ggn baseline wrote; without it NAME.ggn (NAME: the criterion's) beside the "
                              "criterion, in ../share/lull or in the source tree"),
    [P_VISIBLE] = LULL_KIT_FLOAT("visible", NULL, 0, 1,
                                 "stop when the probability that noise is still seen is less than this; without it the "
                                 "model's own"),
    [P_PASSES] = LULL_KIT_INT("passes", NULL, 1, 16, "checks in a row that must be below that; without it the model's own"),
    [P_FIRST_SPP] = LULL_KIT_INT("first-spp", NULL, 1, 1e9,
                                 "samples per pixel of the first image that counts; without it the model's own"),
};

struct worker {
    struct ggn_baseline_reader *reader;
    uint8_t *codes; /* [3][pixels of the largest block] */
};

static struct gp_slot slot_of(const void *of, int32_t width, int32_t height)
{
    const struct lull_instance *in = of;
    return (struct gp_slot){.kept = sizeof(double) * ggn_baseline_feature_count(in->model, width, height)};
}

static void worker_release(void *data)
{
    struct worker *w = data;
    ggn_baseline_reader_destroy(w->reader);
    free(w->codes);
}

static int worker_init(void *data, const struct lull_instance *in, const struct ggn_meter_room *room, struct base_err *err)
{
    struct worker *w = data;
    w->codes = malloc(3 * room->pixels);
    w->reader = w->codes ? ggn_baseline_reader_create(in->model, err) : NULL;
    return w->reader ? 0 : err->code;
}

static void model_destroy(void *model)
{
    if (model)
        ggn_baseline_release(model);
    free(model);
}

static long read_image(const struct gp_block_view *seen, uint32_t slot)
{
    const struct worker *w = seen->worker;
    const struct lull_block *b = seen->block;
    long broken = gp_windowed_read(seen, w->codes);
    ggn_baseline_extract(w->reader, w->codes, b->x1 - b->x0, b->y1 - b->y0,
                         gp_history_kept(&seen->in->frame.history, b->id, slot));
    return broken;
}

static double window_logit(void *data)
{
    const struct gp_block_view *seen = data;
    const struct worker *w = seen->worker;
    const struct lull_block *b = seen->block;
    const double *features[GGN_WINDOW_MAX];
    for (int i = 0; i < seen->in->rule.window; i++)
        features[i] = gp_history_kept(&seen->in->frame.history, b->id, seen->head->order[i]);
    return ggn_baseline_logit(w->reader, features, b->x1 - b->x0, b->y1 - b->y0);
}

static void hash_model(struct lull_instance *in, const struct ggn_baseline *b)
{
    const struct ggn_svm *s = &b->svm;
    gp_windowed_hash(in, &b->kind, sizeof b->kind);
    if (b->lstm)
        gp_windowed_hash(in, b->lstm, ggn_lstm_parameters(b->features) * sizeof *b->lstm);
    else
        gp_windowed_hash(in, s->values, sizeof *s->values * ggn_svm_values(s));
}

static int32_t load(struct lull_instance *in, const char *path, struct lull_error *err)
{
    struct base_err error = {0};
    struct ggn_baseline *b = calloc(1, sizeof *b);
    in->model = b;
    if (!b)
        return lull_kit_fail(err, LULL_E_MEMORY, "create: out of memory");
    if (ggn_baseline_load(b, path, (enum ggn_baseline_kind)in->ops->kind, &error))
        return gp_fail_from(err, LULL_E_IO, "model", &error);
    in->rule = (struct ggn_stop_rule){.policy = b->policy, .window = b->window};
    hash_model(in, b);
    gp_windowed_ready(in, params, P_COUNT, b->width, b->height);
    return LULL_OK;
}

#define BASELINE(its_kind, table, identity, title, eye) \
    static const struct gp_block_view_ops its_kind##_ops = {.model = identity, \
                                                            .kind = its_kind, \
                                                            .load = load, \
                                                            .slot = slot_of, \
                                                            .worker_size = sizeof(struct worker), \
                                                            .worker_init = worker_init, \
                                                            .worker_release = worker_release, \
                                                            .model_destroy = model_destroy, \
                                                            .read = read_image, \
                                                            .evidence = {NULL, window_logit, NULL}}; \
    GP_CRITERION(table, &gp_windowed_rule, &its_kind##_ops, .version = "1.0", .id = identity, .name = title, \
                 .description = "Probability that noise is still seen in the block, from " eye ".")

BASELINE(GGN_SVD_ENTROPY, ggn_plugin_svd_entropy, "svd-entropy", "SVD-entropy LSTM",
         "the entropy of the singular values of\n20x20 pixels over six images, by an LSTM (Buisine et al. 2021)");
BASELINE(GGN_ATTRIBUTES_SVM, ggn_plugin_attributes, "attributes", "26 attributes + SVM",
         "what 13 filters take off the\nlightness, by a support vector machine (Constantin et al. 2015)");
BASELINE(GGN_MASK_SVM, ggn_plugin_noise_mask, "noise-mask", "Noise mask + SVM",
         "the noise masks of the image and of\na smoothed one, by a support vector machine (Takouachet et al. 2017)");
