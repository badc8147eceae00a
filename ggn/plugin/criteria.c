#include "plugin/criteria.h"

static const struct gp_rule *rule_of(const struct lull_instance *in)
{
    return (const struct gp_rule *)(const void *)lull_kit_read_of(in)->rule; /* which it begins with */
}

static void frame_replace(struct lull_instance *in, const void *fresh)
{
    const struct gp_rule *rule = rule_of(in);
    void *frame = (char *)in + rule->frame_at;
    rule->frame_release(frame);
    if (fresh)
        memcpy(frame, fresh, rule->frame_size);
    else
        memset(frame, 0, rule->frame_size);
}

int32_t gp_create(const struct gp_rule *rule, const struct lull_criterion *table, const void *own,
                  const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                  struct lull_instance **instance, struct lull_error *err)
{
    const char *text[LULL_KIT_PARAM_MAX];
    struct lull_instance *in = NULL;
    int32_t status = lull_kit_create(&rule->kit, table, rule->size, host, pairs, pair_count, pair_stride, text,
                                     instance ? &in : NULL, err);
    if (status)
        return status;
    status = rule->init(in, own, text, err);
    if (status)
        gp_destroy(in);
    else
        *instance = in;
    return status;
}

int32_t gp_begin_frame(struct lull_instance *in, const struct lull_frame *frame, struct lull_error *err)
{
    int32_t status = lull_kit_frame_check(in, frame, err);
    return status ? status : rule_of(in)->begin_frame(in, frame, err);
}

int32_t gp_frame_open(struct lull_instance *in, const struct lull_frame *frame, void *fresh, int32_t status)
{
    if (status) {
        rule_of(in)->frame_release(fresh);
        return status;
    }
    frame_replace(in, fresh);
    lull_kit_frame_open(in, frame);
    return LULL_OK;
}

/* Some blocks of a question. */
struct some {
    struct lull_kit_batch batch;
    const uint32_t *members;
};

static void judge_task(void *arg, uint64_t task, uint32_t worker)
{
    struct some *some = arg;
    lull_kit_task(&some->batch, some->members ? some->members[task] : task, worker);
}

int32_t gp_judge(const struct lull_kit_batch *batch, const uint32_t *members, uint32_t count, struct lull_error *err)
{
    const struct lull_host *host = lull_kit_read_of(batch->in)->host;
    struct some some = {*batch, members};
    if (host && host->parallel_for && count > 0) { /* for one block too: only the host knows which worker is free */
        int32_t status = host->parallel_for(host, count, judge_task, &some);
        return status == LULL_OK ? LULL_OK : lull_kit_fail(err, status, "evaluate: the host left out blocks");
    }
    for (uint32_t i = 0; i < count; i++)
        judge_task(&some, i, 0);
    return LULL_OK;
}

int32_t gp_evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                    uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                    struct lull_error *err)
{
    const struct lull_kit_batch batch = {in, view, blocks, decisions, block_stride, decision_stride, count};
    int32_t status = lull_kit_batch_check(&batch, err);
    if (status)
        return status;
    const struct gp_rule *rule = rule_of(in);
    status = rule->answer ? rule->answer(&batch, err) : gp_judge(&batch, NULL, count, err);
    for (uint32_t i = 0; i < count && !status; i++) /* a call that failed leaves no trace */
        rule->keep(in, lull_kit_at(blocks, block_stride, i));
    return status;
}

void gp_end_frame(struct lull_instance *in)
{
    if (in)
        frame_replace(in, NULL);
    lull_kit_end_frame(in);
}

void gp_destroy(struct lull_instance *in)
{
    gp_end_frame(in);
    if (in && rule_of(in)->release)
        rule_of(in)->release(in);
    lull_kit_destroy(in);
}

static int32_t state_save(const struct lull_instance *in, const struct lull_writer *writer, struct lull_error *err)
{
    if (writer && !LULL_HAS(struct lull_writer, writer, write))
        return lull_kit_fail(err, LULL_E_VERSION, "save: the host's struct is older than version 1.0");
    if (!in || !writer || !writer->write)
        return lull_kit_fail(err, LULL_E_INVALID, "save: an argument is missing");
    if (!lull_kit_read_of(in)->block_count)
        return lull_kit_fail(err, LULL_E_STATE, "save: no frame is open");
    return rule_of(in)->save(in, writer, err);
}

static int32_t state_load(struct lull_instance *in, const struct lull_reader *reader, struct lull_error *err)
{
    if (reader && !LULL_HAS(struct lull_reader, reader, read))
        return lull_kit_fail(err, LULL_E_VERSION, "load: the host's struct is older than version 1.0");
    if (!in || !reader || !reader->read)
        return lull_kit_fail(err, LULL_E_INVALID, "load: an argument is missing");
    if (!lull_kit_read_of(in)->block_count)
        return lull_kit_fail(err, LULL_E_STATE, "load: no frame is open");
    return rule_of(in)->load(in, reader, err);
}

const void *gp_get_extension(const char *id)
{
    static const struct lull_state state = {.struct_size = sizeof state, .save = state_save, .load = state_load};
    return id && !strcmp(id, LULL_EXT_STATE) ? &state : NULL;
}
