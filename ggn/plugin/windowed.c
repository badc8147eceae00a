#include "plugin/windowed.h"

#include "model/setting.h"
#include "plugin/model_path.h"
#include "plugin/translate.h"

static const struct lull_kit_rule rule;

/* The model that the first parameter names, or the default one. */
static int32_t load_model(struct lull_instance *in, int kind, const char *id, const char *path, struct lull_error *err)
{
    char name[64], found[5000];

    if (!path) {
        snprintf(name, sizeof name, "%s.ggn", in->ops->model ? in->ops->model : id);
        if (!gp_model_find(name, in->ops->variable, found, sizeof found))
            return lull_kit_fail(err, LULL_E_VALUE, "model: %.480s", found);
        path = found;
    }
    return in->ops->load(in, kind, path, err);
}

int32_t gp_windowed_create(const struct gp_block_view_ops *ops, int kind, const struct lull_criterion *table,
                           const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                           uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err)
{
    const char *text[LULL_KIT_PARAM_MAX];
    struct lull_instance *in = NULL;
    int32_t status =
        lull_kit_create(&rule, table, sizeof *in, host, pairs, pair_count, pair_stride, text, instance ? &in : NULL, err);

    if (status)
        return status;
    in->ops = ops;
    in->key = UINT32_C(2166136261);
    status = load_model(in, kind, table->id, text[0], err);
    if (status) {
        gp_windowed_destroy(in);
        return status;
    }
    *instance = in;
    return LULL_OK;
}

void gp_windowed_hash(struct lull_instance *in, const void *data, size_t size)
{
    const unsigned char *p = data;

    for (size_t i = 0; i < size; i++)
        in->key = (in->key ^ p[i]) * UINT32_C(16777619); /* FNV-1a */
}

void gp_windowed_ready(struct lull_instance *in, const struct lull_param *params, uint32_t count, int width, int height)
{
    struct ggn_policy *policy = &in->rule.policy;
    struct lull_requirements *need = &in->kit.need;

    for (uint32_t i = 0; i < count; i++)
        if (!isnan(in->kit.value[i]))
            ggn_policy_adjust(policy, params[i].name, in->kit.value[i]);
    if (policy->n_levels)
        gp_windowed_hash(in, policy->level, (size_t)policy->n_levels * sizeof *policy->level);
    const double numbers[] = {policy->threshold, policy->passes, policy->first_spp, in->rule.reach};
    gp_windowed_hash(in, numbers, sizeof numbers);
    if (in->rule.reach > 0)
        need->planes_used |= LULL_PLANE_BIT(LULL_PLANE_HALF);
    need->block_width = (uint32_t)width;
    need->block_height = (uint32_t)height;
    need->checks_hint = policy->ratio > 1.001 ? (uint32_t)(log(200) / log(policy->ratio)) : 100;
    need->first_spp = (uint64_t)policy->first_spp;
    need->bytes_per_block = gp_history_block_bytes(in->rule.window, in->ops->slot(in, width, height));
}

static void workers_release(const struct gp_block_view_ops *ops, void **worker, uint32_t count)
{
    for (uint32_t i = 0; worker && i < count; i++)
        ops->worker_destroy(worker[i]);
    free(worker);
}

/* Scratch for as many workers as can be busy. */
static int32_t workers_create(const struct lull_instance *in, uint32_t count, const struct ggn_meter_room *room, void ***out,
                              struct lull_error *err)
{
    struct base_err error = {.code = BASE_ENOMEM, .text = "out of memory"};
    void **worker = calloc(count, sizeof *worker);
    int good = worker != NULL;

    for (uint32_t i = 0; i < count && good; i++)
        good = (worker[i] = in->ops->worker_create(in, room, &error)) != NULL;
    *out = worker;
    if (good)
        return LULL_OK;
    workers_release(in->ops, worker, count);
    return gp_fail_from(err, LULL_E_IO, "begin_frame", &error);
}

static void frame_release(struct lull_instance *in)
{
    gp_history_release(&in->history);
    gp_means_release(&in->means);
    workers_release(in->ops, in->worker, in->workers);
}

/* What the model has not learned with. */
static void log_setting(const struct lull_instance *in, const struct lull_frame *frame)
{
    const struct lull_requirements *need = &in->kit.need;
    const struct ggn_setting learned = {(int)need->block_width, (int)need->block_height, GGN_TRANSFER_SRGB};
    struct ggn_setting here = {0, 0, in->display.transfer};
    char difference[200], text[400];

    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        here.width = r->x1 - r->x0 > here.width ? r->x1 - r->x0 : here.width;
        here.height = r->y1 - r->y0 > here.height ? r->y1 - r->y0 : here.height;
    }
    if (!ggn_setting_difference(&learned, &here, difference, sizeof difference))
        return;
    snprintf(text, sizeof text, "the model is asked about what it has not learned: %s", difference);
    gp_log(&in->kit, in->rule.reach > 0 ? LULL_LOG_DEBUG : LULL_LOG_WARNING, text);
}

int32_t gp_windowed_begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    struct gp_history history = {0};
    struct gp_means means = {0};
    void **worker;
    int32_t status = lull_kit_frame_check(in, frame, err);

    if (status)
        return status;
    const uint32_t count = lull_kit_workers(&in->kit);
    const size_t bytes_per_pixel = 1024; /* more than history and scratch need of either */
    struct ggn_meter_room room = {0};
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        ggn_meter_make_room(&room, r->x1 - r->x0, r->y1 - r->y0);
    }
    if (room.pixels > PTRDIFF_MAX / bytes_per_pixel)
        return lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: a block is too large for memory");
    status = workers_create(in, count, &room, &worker, err);
    if (status)
        return status;
    status = gp_history_create(&history, in->rule.window, frame, in->ops->slot, in, err);
    if (!status && in->rule.reach > 0 && !(frame->planes & LULL_PLANE_BIT(LULL_PLANE_HALF)))
        status = gp_means_create(&means, frame, err);
    if (status) {
        gp_history_release(&history);
        workers_release(in->ops, worker, count);
        return status;
    }
    frame_release(in);
    in->history = history;
    in->means = means;
    atomic_flag_clear(&in->warned);
    atomic_flag_clear(&in->late);
    in->worker = worker;
    in->workers = count;
    lull_kit_frame_open(in, frame);
    if (in->means.count)
        gp_log(&in->kit, LULL_LOG_INFO, "ggn: no plane HALF: noise is told from how the mean changes between checks");
    in->display = gp_display_of(&in->kit);
    log_setting(in, frame);
    return LULL_OK;
}

void gp_windowed_end_frame(struct lull_instance *in)
{
    if (!in)
        return;
    frame_release(in);
    in->worker = NULL;
    in->workers = 0;
    lull_kit_end_frame(in);
}

void gp_windowed_destroy(struct lull_instance *in)
{
    if (!in)
        return;
    gp_windowed_end_frame(in);
    in->ops->model_destroy(in->model);
    lull_kit_destroy(in);
}

long gp_windowed_read(const struct gp_block_view *seen, uint8_t *out)
{
    const struct lull_block *b = seen->block;
    const size_t w = (size_t)(b->x1 - b->x0), plane = w * (size_t)(b->y1 - b->y0);
    long bad = 0;
    struct lull_kit_span s;

    for (lull_kit_span_begin(&s, seen->view, b, LULL_PLANE_BIT(LULL_PLANE_COLOR)); lull_kit_span_next(&s);) {
        uint8_t *to = out + (size_t)(s.y - b->y0) * w + (size_t)(s.x - b->x0);
        for (int32_t i = 0; i < s.count; i++)
            for (int c = 0; c < 3; c++)
                to[(size_t)c * plane + (size_t)i] =
                    ggn_preprocess(s.value[LULL_PLANE_COLOR][i][c], &seen->in->display, &bad);
    }
    return bad;
}

/* Logs once that a host asks further apart than the model has learned: its windows show other images. The law of a residual
 * model needs none. */
static void log_late(struct lull_instance *in, const struct ggn_stopper *before, uint64_t spp)
{
    if (in->rule.reach > 0 || !before->used)
        return;
    const double last = (double)before->spp[before->used - 1], next = ggn_policy_next(&in->rule.policy, last);
    if ((double)spp - last <= 1.5 * (next - last))
        return;
    char text[200];
    snprintf(
        text, sizeof text,
        "the model is asked at %llu samples behind %.0f, where it has learned %.0f: the host's checks are further apart",
        (unsigned long long)spp, last, next);
    gp_say_once(&in->kit, LULL_LOG_WARNING, &in->late, text);
}

/* Fills in->history.block[b->id].pending with the verdict on a checked block. */
static void read_block(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, uint32_t worker)
{
    struct gp_head *head = &in->history.block[b->id].pending;
    struct gp_block_view seen = {in, view, b, head, in->worker[worker < in->workers ? worker : 0]};
    struct ggn_evidence evidence = in->ops->evidence;

    evidence.data = &seen;
    *head = in->history.block[b->id].head;
    const struct ggn_stopper before = head->stopper;
    const int what = ggn_stopper_ask(&in->rule, &head->stopper, b->spp);
    if (what == GGN_LOOK_IMAGE)
        log_late(in, &before, b->spp);
    head->measured = what != GGN_LOOK_NONE;
    if (what == GGN_LOOK_NONE)
        return;
    if (in->ops->measure)
        in->ops->measure(&seen);
    if (what == GGN_LOOK_IMAGE) {
        uint32_t slot = gp_head_push(head, in->rule.window, before.used);
        head->bad = in->ops->read(&seen, slot) > 0;
    }
    ggn_stopper_decide(&in->rule, &head->stopper, &evidence);
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    const struct gp_head *head = &in->history.block[b->id].pending;
    const struct ggn_verdict *v = &head->stopper.verdict;

    read_block(in, view, b, worker);
    d->action = v->stop ? LULL_STOP : LULL_CONTINUE;
    d->flags = (v->too_early ? LULL_DECISION_TOO_EARLY : 0) | (head->bad ? LULL_DECISION_BAD_INPUT : 0);
    d->next_spp = v->next_spp;
    d->p_noisy = v->p;
    d->predicted_spp = v->predicted_spp;
    d->error = v->noise;
}

static int32_t check_block(const struct lull_instance *in, const struct lull_block *b, struct lull_error *err)
{
    return gp_check_block(b, &in->history.block[b->id].rect, in->history.block[b->id].head.stopper.asked_spp, err);
}

int32_t gp_windowed_evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                             uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride,
                             uint32_t count, struct lull_error *err)
{
    int32_t status = lull_kit_evaluate(in, view, blocks, block_stride, decisions, decision_stride, count, err);

    for (uint32_t i = 0; i < count && !status; i++) { /* a call that failed leaves no trace */
        const struct lull_block *b = lull_kit_at(blocks, block_stride, i);
        if (in->means.count && in->history.block[b->id].pending.measured)
            gp_means_commit(&in->means, b->id);
        in->history.block[b->id].head = in->history.block[b->id].pending;
    }
    return status;
}

static const struct lull_kit_rule rule = {
    .planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR),
    .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR),
    .judge = judge,
    .check = check_block,
};

static int32_t state_save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    int32_t status = gp_save_check(in, writer, err);
    if (!status)
        status = gp_history_save(&in->history, in->key, writer, err);
    return status ? status : gp_means_save(&in->means, writer, err);
}

static int32_t state_load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    struct gp_history history = {0};
    int32_t status = gp_load_check(in, reader, err);

    if (status)
        return status;
    struct lull_frame frame = {
        .blocks = &in->history.block->rect, .block_count = in->history.count, .block_stride = sizeof *in->history.block};
    status = gp_history_create(&history, in->rule.window, &frame, in->ops->slot, in, err);
    if (!status)
        status = gp_history_load(&history, &in->rule, in->key, reader, err);
    if (!status)
        status = gp_means_load(&in->means, reader, err);
    if (status) {
        gp_history_release(&history);
        return status;
    }
    gp_history_release(&in->history);
    in->history = history;
    return LULL_OK;
}

static const struct lull_state state = {.struct_size = sizeof state, .save = state_save, .load = state_load};

const void *gp_windowed_get_extension(const char *id) { return id && !strcmp(id, LULL_EXT_STATE) ? &state : NULL; }
