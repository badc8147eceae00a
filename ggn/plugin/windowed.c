#define _GNU_SOURCE /* dladdr */
#include "plugin/windowed.h"

#include <dlfcn.h>
#include <unistd.h>

#include "plugin/translate.h"

int gp_model_find(const char *name, const char *variable, char *path, size_t room)
{
    /* a prefix has us in lib/lull or lib/TRIPLET/lull; the tree in build/lib/lull and build/MODE/lib/lull */
    static const char *const places[] = {
        ".", "../share/lull", "../../share/lull", "../../../share/lull", "../../../ggn/models", "../../../../ggn/models"};
    static const char anchor = 0; /* an address inside this shared object */
    const char *named = variable ? getenv(variable) : NULL;
    char folder[4096] = ".";
    Dl_info info;
    if (named && *named) {
        snprintf(path, room, "%s", named);
        return 1;
    }
    if (dladdr(&anchor, &info) && info.dli_fname) {
        const char *slash = strrchr(info.dli_fname, '/');
        if (slash)
            snprintf(folder, sizeof folder, "%.*s", (int)(slash - info.dli_fname), info.dli_fname);
    }
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        int n = snprintf(path, room, "%s/%s/%s", folder, places[i], name);
        if (n > 0 && (size_t)n < room && access(path, R_OK) == 0)
            return 1;
    }
    snprintf(path, room,
             "no %s beside %.200s, in share/lull of its prefix or the source tree's ggn/models; give model=FILE%s%s", name,
             info.dli_fname ? info.dli_fname : "the criterion", variable ? " or set " : "", variable ? variable : "");
    return 0;
}

static int32_t init(struct lull_instance *in, const void *own, const char *const *text, struct lull_error *err)
{
    const char *path = text[0];
    char name[64], found[5000];
    in->ops = own;
    in->key = UINT32_C(2166136261);
    if (!path) {
        snprintf(name, sizeof name, "%s.ggn", in->ops->model);
        if (!gp_model_find(name, in->ops->variable, found, sizeof found))
            return lull_kit_fail(err, LULL_E_VALUE, "model: %.480s", found);
        path = found;
    }
    return in->ops->load(in, path, err);
}

static void release(struct lull_instance *in) { in->ops->model_destroy(in->model); }

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

static void frame_release(void *data)
{
    struct gp_windowed_frame *f = data;
    gp_history_release(&f->history);
    gp_history_release(&f->means);
    for (uint32_t i = 0; i < f->workers; i++)
        f->ops->worker_release(f->worker + i * f->ops->worker_size);
    free(f->worker);
}

/* Scratch for as many workers as can be busy. */
static int32_t workers_create(struct gp_windowed_frame *f, const struct lull_instance *in, const struct ggn_meter_room *room,
                              struct lull_error *err)
{
    struct base_err error = {.code = BASE_ENOMEM, .text = "out of memory"};
    const uint32_t count = lull_kit_workers(&in->kit);
    const size_t size = in->ops->worker_size;
    int rc;
    f->worker = calloc(count, size);
    rc = f->worker ? 0 : BASE_ENOMEM;
    while (!rc && f->workers < count)
        rc = in->ops->worker_init(f->worker + f->workers++ * size, in, room, &error);
    return rc ? gp_fail_from(err, LULL_E_IO, "begin_frame", &error) : LULL_OK;
}

/* What the model has not learned with. */
static void log_setting(const struct lull_instance *in, const struct lull_frame *frame)
{
    const struct lull_requirements *need = &in->kit.need;
    const struct ggn_setting learned = {(int)need->block_width, (int)need->block_height, GGN_TRANSFER_SRGB};
    struct ggn_setting here = {0, 0, gp_display_of(&in->kit).transfer};
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

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    const size_t bytes_per_pixel = 1024; /* more than history and scratch need of either */
    const struct gp_history_form form = {in->rule.window, "the history of", in->ops->slot, in};
    struct gp_windowed_frame fresh = {.ops = in->ops};
    struct ggn_meter_room room = {0};
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        ggn_meter_make_room(&room, r->x1 - r->x0, r->y1 - r->y0);
    }
    if (room.pixels > PTRDIFF_MAX / bytes_per_pixel)
        return lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: a block is too large for memory");
    int32_t status = workers_create(&fresh, in, &room, err);
    if (!status)
        status = gp_history_create(&fresh.history, &form, frame, err);
    if (!status && in->rule.reach > 0 && !(frame->planes & LULL_PLANE_BIT(LULL_PLANE_HALF)))
        status = gp_means_create(&fresh.means, frame, err);
    status = gp_frame_open(in, frame, &fresh, status);
    if (status)
        return status;
    if (in->frame.means.count)
        gp_log(&in->kit, LULL_LOG_INFO, "ggn: no plane HALF: noise is told from how the mean changes between checks");
    log_setting(in, frame);
    return LULL_OK;
}

long gp_windowed_read(const struct gp_block_view *seen, uint8_t *out)
{
    const struct lull_block *b = seen->block;
    const size_t w = (size_t)(b->x1 - b->x0), plane = w * (size_t)(b->y1 - b->y0);
    const struct ggn_display display = gp_display_of(&seen->in->kit);
    long bad = 0;
    struct lull_kit_span s;
    for (lull_kit_span_begin(&s, seen->view, b, LULL_PLANE_BIT(LULL_PLANE_COLOR)); lull_kit_span_next(&s);) {
        uint8_t *to = out + (size_t)(s.y - b->y0) * w + (size_t)(s.x - b->x0);
        for (int32_t i = 0; i < s.count; i++)
            for (int c = 0; c < 3; c++)
                to[(size_t)c * plane + (size_t)i] = ggn_preprocess(s.value[LULL_PLANE_COLOR][i][c], &display, &bad);
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
    gp_say_once(&in->kit, LULL_LOG_WARNING, &in->frame.late, text);
}

/* Fills in->frame.history.block[b->id].pending with the verdict on a checked block. */
static void read_block(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b, uint32_t worker)
{
    struct gp_head *head = &in->frame.history.block[b->id].pending;
    void *scratch = in->frame.worker + (worker < in->frame.workers ? worker : 0) * in->ops->worker_size;
    struct gp_block_view seen = {in, view, b, head, scratch};
    struct ggn_evidence evidence = in->ops->evidence;
    evidence.data = &seen;
    *head = in->frame.history.block[b->id].head;
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
    const struct gp_head *head = &in->frame.history.block[b->id].pending;
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
    return gp_check_block(b, &in->frame.history.block[b->id].rect, in->frame.history.block[b->id].head.stopper.asked_spp,
                          err);
}

static void keep(struct lull_instance *in, const struct lull_block *b)
{
    struct gp_history_block *of = &in->frame.history.block[b->id];
    if (in->frame.means.count && of->pending.measured)
        in->frame.means.block[b->id].head = in->frame.means.block[b->id].pending;
    of->head = of->pending;
}

/* lull.state/1: a header, then of each block its rectangle, its head and what is kept of its images. */
static const char MAGIC[8] = {'G', 'G', 'N', 'S', 'T', 'A', 'T', '3'};

struct state_header {
    char magic[8];
    uint32_t key, count, window, head_bytes;
};

static struct state_header header_of(const struct lull_instance *in)
{
    const struct gp_history *h = &in->frame.history;
    struct state_header header = {{0}, in->key, h->count, (uint32_t)h->form.window, (uint32_t)sizeof(struct gp_head)};
    memcpy(header.magic, MAGIC, sizeof MAGIC);
    return header;
}

static int32_t save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    const struct gp_history *h = &in->frame.history;
    const struct state_header header = header_of(in);
    int32_t status = writer->write(writer, &header, sizeof header);
    for (uint32_t id = 0; !status && id < h->count; id++) {
        struct gp_head head = h->block[id].head;

        head.made = 0; /* computed again on demand: the same bytes, and a smaller file */
        status = writer->write(writer, &h->block[id].rect, sizeof h->block[id].rect);
        if (!status)
            status = writer->write(writer, &head, sizeof head);
        for (uint32_t i = 0; !status && i < head.stopper.used; i++)
            status = writer->write(writer, gp_history_kept(h, id, head.order[i]), h->block[id].slot.kept);
    }
    if (status)
        return lull_kit_fail(err, status, "state: the host could not write it");
    return gp_means_save(&in->frame.means, writer, err);
}

/* Whether a head from a file may be trusted as an index into memory. */
static int head_valid(const struct gp_head *head, const struct ggn_stop_rule *rule)
{
    uint32_t seen = 0;
    for (int i = 0; i <= rule->window; i++) {
        if (head->order[i] > (uint32_t)rule->window || (seen >> head->order[i] & 1))
            return 0;
        seen |= UINT32_C(1) << head->order[i];
    }
    return !head->made && head->bad <= 1 && head->measured <= 1 && ggn_stopper_valid(rule, &head->stopper);
}

static int32_t load_blocks(struct gp_history *h, const struct ggn_stop_rule *rule, const struct lull_reader *reader,
                           struct lull_error *err)
{
    for (uint32_t id = 0; id < h->count; id++) {
        struct lull_rect rect;
        struct gp_head head;

        if (reader->read(reader, &rect, sizeof rect) || reader->read(reader, &head, sizeof head))
            return lull_kit_fail(err, LULL_E_IO, "state: it ends early, at block %u", id);
        if (memcmp(&rect, &h->block[id].rect, sizeof rect) || !head_valid(&head, rule))
            return lull_kit_fail(err, LULL_E_IO, "state: block %u does not fit the frame", id);
        for (uint32_t i = 0; i < head.stopper.used; i++)
            if (reader->read(reader, gp_history_kept(h, id, head.order[i]), h->block[id].slot.kept))
                return lull_kit_fail(err, LULL_E_IO, "state: it ends early, at block %u", id);
        h->block[id].head = head;
    }
    return LULL_OK;
}

static int32_t load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    struct state_header header, wanted = header_of(in);
    struct gp_history fresh;
    int32_t status = gp_history_like(&fresh, &in->frame.history, err);
    if (!status && reader->read(reader, &header, sizeof header))
        status = lull_kit_fail(err, LULL_E_IO, "state: it ends early");
    else if (!status && memcmp(&header, &wanted, sizeof header))
        status = lull_kit_fail(err, LULL_E_IO, "state: saved by another criterion, model, parameter set or frame");
    if (!status)
        status = load_blocks(&fresh, &in->rule, reader, err);
    if (!status)
        status = gp_means_load(&in->frame.means, reader, err);
    return gp_history_take(&in->frame.history, &fresh, status);
}

const struct gp_rule gp_windowed_rule = {
    .kit = {.planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR),
            .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR),
            .judge = judge,
            .check = check_block},
    .size = sizeof(struct lull_instance),
    .frame_at = offsetof(struct lull_instance, frame),
    .frame_size = sizeof(struct gp_windowed_frame),
    .init = init,
    .release = release,
    .begin_frame = begin_frame,
    .frame_release = frame_release,
    .keep = keep,
    .save = save,
    .load = load,
};
