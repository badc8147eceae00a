/*
 * The criterion "ggn": a window of the block's last S display images goes through the Guided-Generative Network, whose
 * answer is the probability that the newest image still looks noisy. A block stops after `passes` checks in a row below
 * `visible`.
 *
 * Two cheap statistics stand beside the network. The *gate* compares the window's oldest and newest image: while their
 * difference says that the noise is far above what the model ever called clean in training, the block is plainly noisy and
 * the network is not asked; it says when to ask again. The *tail guard* looks at the half buffer: a block whose noise sits
 * in a few pixels has not met its rare bright paths often enough for any judgement by eye, and is not stopped.
 *
 * A model may also take the noise picture that the half buffer shows; without half buffer it judges without.
 */
#include "plugin/ggn.h"

#include "plugin/criteria.h"
#include "plugin/model_path.h"
#include "plugin/translate.h"

enum { P_MODEL, P_VISIBLE, P_PASSES, P_GATE, P_TAIL, P_GINI, P_FIRST_SPP, P_PRECISION, P_COUNT };

static const struct lull_param params[P_COUNT] = {
    [P_MODEL] = LULL_KIT_FILE("model", NULL,
                              "model file; without it lull-1.ggn beside the criterion, in ../share/lull or in the source "
                              "tree"),
    [P_VISIBLE] = LULL_KIT_FLOAT("visible", NULL, 0, 1,
                                 "stop when less than this share of viewers would still see noise; without it the model's "
                                 "own"),
    [P_PASSES] = LULL_KIT_INT("passes", NULL, 1, 16,
                              "checks in a row that must be below that share; without it the model's own"),
    [P_GATE] = LULL_KIT_BOOL("gate", "1", "spare the network while a block is plainly noisy (p_noisy is then not given)"),
    [P_TAIL] = LULL_KIT_FLOAT("tail", NULL, 0, 1e30,
                              "do not stop while the 99.9th percentile of the half-buffer difference exceeds this many "
                              "times the mean luminance, 0 = no such guard; without it the model's own"),
    [P_GINI] = LULL_KIT_FLOAT("gini", NULL, 0, 2,
                              "do not stop while the Gini coefficient of the half-buffer difference exceeds this and its "
                              "tail 0.2, 0 = no such guard; without it the model's own"),
    [P_FIRST_SPP] = LULL_KIT_INT("first-spp", NULL, 1, 1e9,
                                 "samples per pixel of the first image of a window; without it the model's own"),
    [P_PRECISION] = LULL_KIT_CHOICE("precision", "f32", "f32|bf16",
                                    "of the products in the networks; bf16 is f32 on processors without the instructions"),
};

/* --- instance ---------------------------------------------------------------------------------------------------------- */

static uint32_t hash_bytes(uint32_t h, const void *data, size_t size)
{
    const unsigned char *p = data;

    for (size_t i = 0; i < size; i++)
        h = (h ^ p[i]) * UINT32_C(16777619); /* FNV-1a */
    return h;
}

static int32_t load_model(struct lull_instance *in, const char *path, struct lull_error *err)
{
    struct base_err error = {0};
    struct ggn_policy *policy = &in->rule.policy;
    char found[5000];

    if (!path) {
        if (!gp_model_find(found, sizeof found))
            return lull_kit_fail(err, LULL_E_IO, "model: %.480s", found);
        path = found;
    }
    if (ggn_model_load(path, &in->model, &error) || ggn_policy_of(in->model, policy, &error))
        return gp_fail_from(err, "model", &error);
    in->rule.window = in->model->hyper.window;
    if (in->rule.window < 2 || in->rule.window > GGN_WINDOW_MAX)
        return lull_kit_fail(err, LULL_E_IO, "model: %.200s: windows of %d images", path, in->rule.window);
    for (int i = 0; i < P_COUNT; i++)
        if (!isnan(in->kit.value[i]))
            ggn_policy_adjust(policy, params[i].name, in->kit.value[i]);
    in->key = hash_bytes(UINT32_C(2166136261), &in->precision, sizeof in->precision);
    for (int net = 0; net < GGN_NETS; net++)
        in->key = hash_bytes(in->key, in->model->weights[net]->params, in->model->graph[net].n_params * sizeof(float));
    const double numbers[] = {policy->threshold, policy->passes,  policy->gate_noise,
                              policy->tail999,   policy->gini,    policy->first_spp};
    in->key = hash_bytes(in->key, numbers, sizeof numbers);
    return LULL_OK;
}

/* What the model asks of the host. */
static void refine_need(const struct lull_instance *in, struct lull_requirements *need)
{
    const struct ggn_hyper *hyper = &in->model->hyper;
    const struct ggn_policy *policy = &in->rule.policy;

    if (policy->tail999 > 0 || policy->gini > 0 || hyper->picture)
        need->planes_used |= LULL_PLANE_BIT(LULL_PLANE_HALF);
    need->block_width = (uint32_t)hyper->width;
    need->block_height = (uint32_t)hyper->height;
    need->checks_hint = policy->ratio > 1.001 ? (uint32_t)(log(200) / log(policy->ratio)) : 100;
    need->first_spp = (uint64_t)policy->first_spp;
    need->bytes_per_block = gp_history_block_bytes(in->rule.window, hyper->width, hyper->height);
}

static const struct lull_kit_rule rule;
static void destroy(struct lull_instance *in);

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err)
{
    const char *text[LULL_KIT_PARAM_MAX];
    struct lull_instance *in = NULL;
    int32_t status = lull_kit_create(&rule, &ggn_plugin_ggn, sizeof *in, host, pairs, pair_count, pair_stride, text,
                                     instance ? &in : NULL, err);

    if (status)
        return status;
    in->precision = (enum ggn_precision)in->kit.value[P_PRECISION];
    status = load_model(in, text[P_MODEL], err);
    if (status) {
        destroy(in);
        return status;
    }
    refine_need(in, &in->kit.need);
    *instance = in;
    return LULL_OK;
}

static void workers_release(struct gp_worker *worker, uint32_t count)
{
    for (uint32_t i = 0; worker && i < count; i++) {
        ggn_judge_destroy(worker[i].judge);
        free(worker[i].noise);
        free(worker[i].picture);
    }
    free(worker);
}

static size_t largest_block(const struct lull_frame *frame)
{
    size_t most = 0;

    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        size_t pixels = (size_t)((int64_t)r->x1 - r->x0) * (size_t)((int64_t)r->y1 - r->y0);
        most = pixels > most ? pixels : most;
    }
    return most;
}

/* Scratch for as many workers as can be busy. */
static struct gp_worker *workers_create(const struct lull_instance *in, uint32_t count, size_t pixels,
                                        struct lull_error *err)
{
    struct base_err error = {.code = BASE_ENOMEM, .text = "out of memory"};
    struct gp_worker *worker = calloc(count, sizeof *worker);
    int rc = worker ? 0 : BASE_ENOMEM;

    for (uint32_t i = 0; i < count && !rc; i++) {
        worker[i].noise = malloc(pixels * sizeof *worker[i].noise);
        worker[i].picture = malloc(pixels);
        worker[i].judge =
            worker[i].noise && worker[i].picture ? ggn_judge_create(in->model, in->precision, NULL, &error) : NULL;
        rc = worker[i].judge ? 0 : error.code;
    }
    if (!rc)
        return worker;
    gp_fail_from(err, "begin_frame", &error);
    workers_release(worker, count);
    return NULL;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    struct gp_history history = {0};
    int32_t status = lull_kit_frame_check(in, frame, err);

    if (status)
        return status;
    uint32_t count = lull_kit_workers(&in->kit);
    struct gp_worker *worker = workers_create(in, count, largest_block(frame), err);
    if (!worker)
        return err && LULL_HAS(struct lull_error, err, message) ? err->code : LULL_E_MEMORY;
    status = gp_history_create(&history, in->rule.window, frame, err);
    if (status) {
        workers_release(worker, count);
        return status;
    }
    gp_history_release(&in->history);
    workers_release(in->worker, in->workers);
    in->history = history;
    in->worker = worker;
    in->workers = count;
    lull_kit_frame_open(in, frame);
    in->rule.spp_max = frame->spp_max;
    in->display = gp_display_of(&in->kit);
    return LULL_OK;
}

static void end_frame(struct lull_instance *in)
{
    if (!in)
        return;
    gp_history_release(&in->history);
    workers_release(in->worker, in->workers);
    in->worker = NULL;
    in->workers = 0;
    lull_kit_end_frame(in);
}

static void destroy(struct lull_instance *in)
{
    if (!in)
        return;
    end_frame(in);
    ggn_model_destroy(in->model);
    lull_kit_destroy(in);
}

/* --- evaluate ---------------------------------------------------------------------------------------------------------- */

static int32_t check_block(const struct lull_instance *in, const struct lull_block *b, struct lull_error *err)
{
    const struct lull_rect *r = &in->history.rect[b->id];

    if (b->x0 != r->x0 || b->y0 != r->y0 || b->x1 != r->x1 || b->y1 != r->y1)
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u is none of the frame's", b->id);
    if (b->spp < in->history.head[b->id].stopper.asked_spp)
        return lull_kit_fail(err, LULL_E_INVALID, "evaluate: block %u has fewer samples than before", b->id);
    return LULL_OK;
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    const struct gp_head *head = &in->history.pending[b->id];
    const struct ggn_verdict *v = &head->stopper.verdict;

    gp_verdict(in, view, b, worker);
    d->action = v->stop ? LULL_STOP : LULL_CONTINUE;
    d->flags = (v->too_early ? LULL_DECISION_TOO_EARLY : 0) | (head->bad ? LULL_DECISION_BAD_INPUT : 0);
    d->next_spp = v->next_spp;
    d->p_noisy = v->p;
    d->predicted_spp = v->predicted_spp;
    d->error = v->noise;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    int32_t status = lull_kit_evaluate(in, view, blocks, block_stride, decisions, decision_stride, count, err);

    for (uint32_t i = 0; i < count && !status; i++) { /* a call that failed leaves no trace */
        const struct lull_block *b = lull_kit_at(blocks, block_stride, i);
        in->history.head[b->id] = in->history.pending[b->id];
    }
    return status;
}

static const struct lull_kit_rule rule = {
    .planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR),
    .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR),
    .judge = judge,
    .check = check_block,
};

/* --- state ------------------------------------------------------------------------------------------------------------- */

static int32_t state_save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    if (!in || !writer || !writer->write)
        return lull_kit_fail(err, LULL_E_INVALID, "save: an argument is missing");
    if (!in->kit.block_count)
        return lull_kit_fail(err, LULL_E_STATE, "save: no frame is open");
    return gp_history_save(&in->history, in->key, writer, err);
}

static int32_t state_load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    struct gp_history history = {0};

    if (!in || !reader || !reader->read)
        return lull_kit_fail(err, LULL_E_INVALID, "load: an argument is missing");
    if (!in->kit.block_count)
        return lull_kit_fail(err, LULL_E_STATE, "load: no frame is open");
    struct lull_frame frame = {
        .blocks = in->history.rect, .block_count = in->history.count, .block_stride = sizeof(struct lull_rect)};
    int32_t status = gp_history_create(&history, in->rule.window, &frame, err);
    if (!status)
        status = gp_history_load(&history, &in->rule, in->key, reader, err);
    if (status) {
        gp_history_release(&history);
        return status;
    }
    gp_history_release(&in->history);
    in->history = history;
    return LULL_OK;
}

static const struct lull_state state = {.struct_size = sizeof state, .save = state_save, .load = state_load};

static const void *get_extension(const char *id)
{
    return id && !strcmp(id, LULL_EXT_STATE) ? &state : NULL;
}

const struct lull_criterion ggn_plugin_ggn = {
    .struct_size = sizeof(struct lull_criterion),
    .api_minor = LULL_API_MINOR,
    .id = "ggn",
    .name = "Guided-Generative Network",
    .version = "1.0",
    .description = "Probability that a viewer still sees noise in the block, from the last images of it (Buisine, Teytaud,\n"
                   "Delepoulle, Renaud 2022). `error` is the root mean square of the noise in display units (1 = white).",
    .params = params,
    .param_count = P_COUNT,
    .param_stride = sizeof(struct lull_param),
    .thread_level = LULL_THREADS_INSTANCE,
    .capabilities = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT,
    .create = create,
    .requirements = lull_kit_requirements,
    .begin_frame = begin_frame,
    .evaluate = evaluate,
    .end_frame = end_frame,
    .destroy = destroy,
    .get_extension = get_extension,
};
