/*
 * The criterion "ggn": a window of the block's last S display images goes through the Guided-Generative Network, whose answer
 * is the probability that the newest image still looks noisy. A block stops after `passes` checks in a row below `threshold`.
 *
 * Two cheap statistics stand beside the network. The *gate* compares the window's oldest and newest image: while their
 * difference says that the noise is far above what the model ever called clean in training, the block is plainly noisy and the
 * network is not asked; it says when to ask again. The *tail guard* looks at the half buffer: a block whose noise sits in a few
 * pixels has not met its rare bright paths often enough for any judgement by eye, and is not stopped.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plugin/criteria.h"
#include "plugin/model_path.h"
#include "plugin/network.h"
#include "plugin/text.h"

enum { P_MODEL, P_THRESHOLD, P_PASSES, P_GATE, P_TAIL, P_GINI, P_FIRST_SPP, P_PRECISION, P_COUNT };

static const struct lull_param params[P_COUNT] = {
    [P_MODEL] = {.name = "model", .type = LULL_PARAM_FILE,
                 .help = "model file; without it lull-1.ggn beside the criterion, in ../share/lull or in the source tree"},
    [P_THRESHOLD] = {.name = "threshold", .type = LULL_PARAM_FLOAT, .min = 0, .max = 1,
                     .help = "stop when the probability of visible noise is below this; without it the model's own"},
    [P_PASSES] = {.name = "passes", .type = LULL_PARAM_INT, .min = 1, .max = 16,
                  .help = "checks in a row that must be below the threshold; without it the model's own"},
    [P_GATE] = {.name = "gate", .type = LULL_PARAM_BOOL, .default_value = "1",
                .help = "spare the network while a block is plainly noisy (p_noisy is then not given)"},
    [P_TAIL] = {.name = "tail", .type = LULL_PARAM_FLOAT, .min = 0, .max = 1e30,
                .help = "do not stop while the 99.9th percentile of the half-buffer difference exceeds this many times the mean "
                        "luminance, 0 = no such guard; without it the model's own"},
    [P_GINI] = {.name = "gini", .type = LULL_PARAM_FLOAT, .min = 0, .max = 2,
                .help = "do not stop while the Gini coefficient of the half-buffer difference exceeds this and its tail 0.2, 0 = no such guard; "
                        "without it the model's own"},
    [P_FIRST_SPP] = {.name = "first-spp", .type = LULL_PARAM_INT, .min = 1, .max = 1e9,
                     .help = "samples per pixel of the first image of a window; without it the model's own"},
    [P_PRECISION] = {.name = "precision", .type = LULL_PARAM_CHOICE, .choices = "f32|bf16", .default_value = "f32",
                     .help = "of the products in the networks; bf16 is f32 on processors without the instructions"},
};

/* --- instance ---------------------------------------------------------------------------------------------------------- */

/* What create was given. */
struct given {
    struct ggn_policy policy;
    const char *model;
    int gate, precision;
    int is[P_COUNT]; /* by parameter: whether it was */
};

static int32_t set_pair(struct given *g, const struct lull_pair *pair, struct lull_error *err)
{
    double value = 0;

    if (!pair->key || !pair->value)
        return gp_fail(err, LULL_E_INVALID, "create: a key or value is missing");
    int32_t index = gp_param(params, P_COUNT, pair->key, pair->value, &value, err);
    if (index < 0)
        return index;
    g->is[index] = 1;
    switch (index) {
    case P_MODEL:
        g->model = pair->value;
        break;
    case P_THRESHOLD:
        g->policy.threshold = value;
        break;
    case P_PASSES:
        g->policy.passes = (int)value;
        break;
    case P_GATE:
        g->gate = value != 0;
        break;
    case P_TAIL:
        g->policy.tail999 = value;
        break;
    case P_GINI:
        g->policy.gini = value;
        break;
    case P_PRECISION:
        g->precision = (int)value;
        break;
    default:
        g->policy.first_spp = value;
    }
    return LULL_OK;
}

/* The model's own policy where no parameter was given. */
static struct ggn_policy policy_merge(const struct ggn_policy *own, const struct given *g)
{
    struct ggn_policy merged = *own;

    merged.threshold = g->is[P_THRESHOLD] ? g->policy.threshold : own->threshold;
    merged.passes = g->is[P_PASSES] ? g->policy.passes : own->passes;
    merged.tail999 = g->is[P_TAIL] ? g->policy.tail999 : own->tail999;
    merged.gini = g->is[P_GINI] ? g->policy.gini : own->gini;
    merged.first_spp = g->is[P_FIRST_SPP] ? g->policy.first_spp : own->first_spp;
    return merged;
}

static uint32_t hash_bytes(uint32_t h, const void *data, size_t size)
{
    const unsigned char *p = data;

    for (size_t i = 0; i < size; i++)
        h = (h ^ p[i]) * UINT32_C(16777619); /* FNV-1a */
    return h;
}

static void destroy(struct lull_instance *in);

static int32_t load_model(struct lull_instance *in, const struct given *given, struct lull_error *err)
{
    struct base_err error = {0};
    char found[5000];
    const char *path = given->model;

    if (!path) {
        if (!gp_model_find(found, sizeof found))
            return gp_fail(err, LULL_E_IO, "model: %.480s", found);
        path = found;
    }
    struct ggn_policy own;
    if (ggn_model_load(path, &in->model, &error) || ggn_policy_of(in->model, &own, &error))
        return gp_fail_from(err, "model", &error);
    in->window = in->model->hyper.window;
    if (in->window < 2 || in->window > GP_WINDOW_MAX)
        return gp_fail(err, LULL_E_IO, "model: %.200s: windows of %d images", path, in->window);
    in->policy = policy_merge(&own, given);
    const int32_t choices[] = {in->gate, (int32_t)in->precision};
    in->key = hash_bytes(UINT32_C(2166136261), choices, sizeof choices);
    for (int net = 0; net < GGN_NETS; net++)
        in->key = hash_bytes(in->key, in->model->weights[net]->params, in->model->graph[net].n_params * sizeof(float));
    const double numbers[] = {in->policy.threshold, in->policy.passes, in->policy.tail999, in->policy.gini, in->policy.first_spp};
    in->key = hash_bytes(in->key, numbers, sizeof numbers);
    return LULL_OK;
}

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err)
{
    struct given given = {.gate = 1, .precision = GGN_PRECISION_F32};

    if (!instance || (pair_count && !pairs))
        return gp_fail(err, LULL_E_INVALID, "create: an argument is missing");
    if ((host && !LULL_HAS(struct lull_host, host, get_extension)) || (pair_count && pair_stride < sizeof *pairs))
        return gp_fail(err, LULL_E_VERSION, "create: the host's structs are older than version 1.0");
    for (uint32_t i = 0; i < pair_count; i++) {
        const void *at = (const char *)pairs + (size_t)i * pair_stride;
        int32_t status = set_pair(&given, at, err);
        if (status)
            return status;
    }
    struct lull_instance *in = calloc(1, sizeof *in);
    if (!in)
        return gp_fail(err, LULL_E_MEMORY, "create: out of memory");
    in->host = host;
    in->gate = given.gate;
    in->precision = (enum ggn_precision)given.precision;
    int32_t status = load_model(in, &given, err);
    if (status) {
        destroy(in);
        return status;
    }
    *instance = in;
    return LULL_OK;
}

static int32_t requirements(const struct lull_instance *in, struct lull_requirements *req, struct lull_error *err)
{
    if (!in || !req)
        return gp_fail(err, LULL_E_INVALID, "requirements: an argument is missing");
    if (!LULL_HAS(struct lull_requirements, req, bytes_per_block))
        return gp_fail(err, LULL_E_VERSION, "requirements: the host's struct is older than version 1.0");
    int guard = in->policy.tail999 > 0 || in->policy.gini > 0;
    const struct ggn_hyper *hyper = &in->model->hyper;
    *req = (struct lull_requirements){
        .struct_size = req->struct_size,
        .flags = LULL_REQ_FLEXIBLE,
        .planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR),
        .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR) | (guard ? LULL_PLANE_BIT(LULL_PLANE_HALF) : 0),
        .block_width = (uint32_t)hyper->width,
        .block_height = (uint32_t)hyper->height,
        .checks_hint = in->policy.ratio > 1.001 ? (uint32_t)(log(200) / log(in->policy.ratio)) : 100,
        .first_spp = (uint64_t)in->policy.first_spp,
        .bytes_per_block = gp_history_block_bytes(in->window, hyper->width, hyper->height),
    };
    return LULL_OK;
}

static void workers_release(struct gp_worker *worker, uint32_t count)
{
    for (uint32_t i = 0; worker && i < count; i++)
        ggn_judge_destroy(worker[i].judge);
    free(worker);
}

/* Scratch for as many workers as can be busy. */
static struct gp_worker *workers_create(const struct lull_instance *in, uint32_t count, struct lull_error *err)
{
    struct base_err error = {0};
    struct gp_worker *worker = calloc(count, sizeof *worker);

    if (!worker) {
        gp_fail(err, LULL_E_MEMORY, "begin_frame: out of memory");
        return NULL;
    }
    for (uint32_t i = 0; i < count; i++) {
        worker[i].judge = ggn_judge_create(in->model, in->precision, NULL, &error);
        if (!worker[i].judge) {
            gp_fail_from(err, "begin_frame", &error);
            workers_release(worker, count);
            return NULL;
        }
    }
    return worker;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    struct gp_history history = {0};

    if (!in || !frame)
        return gp_fail(err, LULL_E_INVALID, "begin_frame: an argument is missing");
    int32_t status = gp_frame_check(frame, LULL_PLANE_BIT(LULL_PLANE_COLOR), err);
    if (status)
        return status;
    if (in->open && !(frame->flags & LULL_FRAME_RESTART))
        return gp_fail(err, LULL_E_STATE, "begin_frame: a frame is open");
    uint32_t count = in->host && in->host->parallel_for && in->host->max_workers > 1 ? in->host->max_workers : 1;
    struct gp_worker *worker = in->worker ? NULL : workers_create(in, count, err);
    if (!worker && !in->worker)
        return err && LULL_HAS(struct lull_error, err, message) ? err->code : LULL_E_MEMORY;
    status = gp_history_create(&history, in->window, frame, err);
    if (status) {
        workers_release(worker, count);
        return status;
    }
    gp_history_release(&in->history);
    in->history = history;
    if (worker) {
        in->worker = worker;
        in->workers = count;
    }
    in->display = gp_display_of(frame);
    for (int c = 0; c < 3; c++)
        in->luminance[c] = isfinite(frame->rgb_to_xyz[3 + c]) ? frame->rgb_to_xyz[3 + c] : 1.0 / 3;
    in->spp_max = frame->spp_max;
    in->open = 1;
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
    in->open = 0;
}

static void destroy(struct lull_instance *in)
{
    if (!in)
        return;
    end_frame(in);
    ggn_model_destroy(in->model);
    free(in);
}

/* --- evaluate ---------------------------------------------------------------------------------------------------------- */

struct batch {
    struct lull_instance *in;
    const struct lull_view *view;
    const char *blocks;
    uint32_t block_stride;
};

static const struct lull_block *batch_block(const struct batch *b, uint64_t i)
{
    const void *at = b->blocks + i * b->block_stride;

    return at;
}

static void judge_block(void *arg, uint64_t task, uint32_t worker)
{
    const struct batch *batch = arg;

    gp_verdict(batch->in, batch->view, batch_block(batch, task), worker);
}

static int32_t check_blocks(const struct batch *batch, uint32_t count, struct lull_error *err)
{
    const struct lull_view *v = batch->view;

    for (uint32_t i = 0; i < count; i++) {
        const struct lull_block *b = batch_block(batch, i);
        const struct lull_rect *r = b->id < batch->in->history.count ? &batch->in->history.rect[b->id] : NULL;
        if (!r || b->x0 != r->x0 || b->y0 != r->y0 || b->x1 != r->x1 || b->y1 != r->y1)
            return gp_fail(err, LULL_E_INVALID, "evaluate: block %u is none of the frame's", b->id);
        if (b->x0 < v->x0 || b->y0 < v->y0 || b->x1 > v->x1 || b->y1 > v->y1)
            return gp_fail(err, LULL_E_INVALID, "evaluate: block %u is not in the view", b->id);
        if (b->spp < batch->in->history.head[b->id].asked_spp)
            return gp_fail(err, LULL_E_INVALID, "evaluate: block %u has fewer samples than before", b->id);
    }
    return LULL_OK;
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    if (!in || !view || (count && (!blocks || !decisions)))
        return gp_fail(err, LULL_E_INVALID, "evaluate: an argument is missing");
    if (count && (block_stride < sizeof *blocks || decision_stride < sizeof *decisions))
        return gp_fail(err, LULL_E_VERSION, "evaluate: the host's structs are older than version 1.0");
    if (!in->open)
        return gp_fail(err, LULL_E_STATE, "evaluate: no frame is open");
    struct batch batch = {in, view, (const char *)blocks, block_stride};
    int32_t status = gp_view_check(view, LULL_PLANE_BIT(LULL_PLANE_COLOR) | LULL_PLANE_BIT(LULL_PLANE_HALF),
                                   LULL_PLANE_BIT(LULL_PLANE_COLOR), err);
    if (!status)
        status = check_blocks(&batch, count, err);
    if (status)
        return status;
    if (in->host && in->host->parallel_for && count) {
        status = in->host->parallel_for(in->host, count, judge_block, &batch);
        if (status)
            return gp_fail(err, status, "evaluate: the host left out blocks");
    } else {
        for (uint32_t i = 0; i < count; i++)
            judge_block(&batch, i, 0);
    }
    for (uint32_t i = 0; i < count; i++) {
        void *at = (char *)decisions + (size_t)i * decision_stride;
        struct lull_decision *d = at;
        uint32_t id = batch_block(&batch, i)->id;
        const struct gp_answer *a = &in->history.pending[id].answer;
        in->history.head[id] = in->history.pending[id];
        d->action = a->action;
        d->flags = a->flags;
        d->next_spp = a->next_spp;
        d->p_noisy = a->p_noisy;
        d->predicted_spp = a->predicted_spp;
        d->error = a->error;
    }
    return LULL_OK;
}

/* --- state ------------------------------------------------------------------------------------------------------------- */

static int32_t state_save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    if (!in || !writer || !writer->write)
        return gp_fail(err, LULL_E_INVALID, "save: an argument is missing");
    if (!in->open)
        return gp_fail(err, LULL_E_STATE, "save: no frame is open");
    return gp_history_save(&in->history, in->key, writer, err);
}

static int32_t state_load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    struct gp_history history = {0};

    if (!in || !reader || !reader->read)
        return gp_fail(err, LULL_E_INVALID, "load: an argument is missing");
    if (!in->open)
        return gp_fail(err, LULL_E_STATE, "load: no frame is open");
    struct lull_frame frame = {.blocks = in->history.rect, .block_count = in->history.count, .block_stride = sizeof(struct lull_rect)};
    int32_t status = gp_history_create(&history, in->window, &frame, err);
    if (!status)
        status = gp_history_load(&history, in->key, reader, err);
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

const struct lull_criterion ggn_plugin_network = {
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
    .requirements = requirements,
    .begin_frame = begin_frame,
    .evaluate = evaluate,
    .end_frame = end_frame,
    .destroy = destroy,
    .get_extension = get_extension,
};
