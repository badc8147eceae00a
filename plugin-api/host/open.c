#include "host/frame.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "base/colour.h"

static int32_t copy_pairs(struct lull_host_criterion *c, const struct lull_pair *pairs, uint32_t count,
                          struct lull_error *err)
{
    c->pairs = calloc((size_t)count + 1, sizeof *c->pairs);
    if (!c->pairs)
        return lull_host_no_memory(err, "criterion");
    c->pair_count = count;
    for (uint32_t i = 0; i < count; i++) {
        c->pairs[i].key = strdup(pairs[i].key);
        c->pairs[i].value = strdup(pairs[i].value);
        if (!c->pairs[i].key || !c->pairs[i].value)
            return lull_host_no_memory(err, "criterion");
    }
    return LULL_OK;
}

static void give_back(const struct lull_host_services *services)
{
    if (services && services->struct_size >= sizeof *services && services->release)
        services->release(services->context);
}

/* Of a step of the mask: beyond the first one its quality parameter is scaled. Nothing is believed of what a failed create
 * leaves behind. */
static int32_t make_instance(struct lull_host_criterion *c, uint32_t step, struct lull_error *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_instance *made = NULL;
    struct lull_process_state before;
    char value[32];
    uint32_t count = c->pair_count;
    int32_t code = LULL_OK;
    if (step > 0) /* a later pair wins */
        code = lull_host_scale_quality(c->table, c->pairs, c->pair_count, step, value, &c->pairs[count++], err);
    if (code != LULL_OK)
        return code;
    lull_signal_state_read(&before);
    code = c->table->create(&c->host, c->pairs, count, sizeof *c->pairs, &made, &e);
    lull_host_leave(c, &before, "create");
    if (code != LULL_OK)
        return lull_host_blame(c, "", code, &e, err);
    if (!made)
        return lull_error_set(err, LULL_E_INTERNAL, "criterion %s: create made no instance", c->table->id);
    c->instances[step] = made;
    return LULL_OK;
}

static int32_t ask_needs(struct lull_host_criterion *c, struct lull_error *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_process_state before;
    lull_thread_state_read(&before);
    c->needs.struct_size = sizeof c->needs;
    const int32_t code = c->table->requirements(c->instances[0], &c->needs, &e);
    c->needs.struct_size = sizeof c->needs;
    lull_host_leave(c, &before, "requirements");
    return code == LULL_OK ? code : lull_host_blame(c, "", code, &e, err);
}

static int is_set(const struct lull_criterion *t, const char *name, const struct lull_pair *pairs, uint32_t count)
{
    const struct lull_param *known;
    uint32_t i = 0;
    lull_host_parameter(t, name, NULL, 0, &known);
    while (i < count && strcmp(pairs[i].key, name) != 0)
        i++;
    return known && known->type == LULL_PARAM_FLOAT && i < count;
}

/* Of two limits only one would count. */
static int32_t check_limits(const struct lull_criterion *t, const struct lull_pair *pairs, uint32_t count,
                            struct lull_error *err)
{
    if (is_set(t, "error", pairs, count) && is_set(t, "visible", pairs, count))
        return lull_error_set(err, LULL_E_VALUE,
                              "criterion %s: error and visible each say when a block stops: leave out one", t->id);
    return LULL_OK;
}

int32_t lull_host_create(const struct lull_host_services *services, const struct lull_criterion *table,
                         const struct lull_pair *pairs, uint32_t pair_count, struct lull_host_criterion **out,
                         struct lull_error *err)
{
    int32_t code = lull_host_given(err, "table", table, "out", out, NULL);
    if (code == LULL_OK)
        code = lull_table_check(table, err);
    if (code == LULL_OK)
        code = lull_host_check_services(services, err);
    if (code == LULL_OK)
        code = lull_host_check_pairs(pairs, pair_count, err);
    if (code == LULL_OK)
        code = check_limits(table, pairs, pair_count, err);
    struct lull_host_criterion *c = code == LULL_OK ? calloc(1, sizeof *c) : NULL;
    if (!c) {
        give_back(services);
        return code != LULL_OK ? code : lull_host_no_memory(err, "criterion");
    }
    c->table = table;
    pthread_mutex_init(&c->messages_lock, NULL);
    code = lull_host_offer(c, services, err);
    if (code == LULL_OK)
        code = copy_pairs(c, pairs, pair_count, err);
    if (code == LULL_OK)
        code = make_instance(c, 0, err);
    if (code == LULL_OK)
        code = ask_needs(c, err);
    if (code != LULL_OK) {
        lull_host_close(c);
        return code;
    }
    *out = c;
    return lull_host_pass_warning(c, err);
}

/* Messages from the search of a criterion that no log takes. */
static void keep_first(void *context, int32_t level, const char *text)
{
    char *kept = context;
    if (level <= LULL_LOG_WARNING && kept[0] == '\0')
        snprintf(kept, sizeof(struct lull_error), "%s", text);
}

int32_t lull_host_open(const struct lull_host_services *services, const char *spec, const struct lull_pair *pairs,
                       uint32_t pair_count, struct lull_host_criterion **out, struct lull_error *err)
{
    char kept[sizeof(struct lull_error)] = "";
    struct lull_search search = {.log = keep_first, .log_context = kept};
    struct lull_found found;
    int32_t code = lull_host_check_services(services, err);
    if (code == LULL_OK && services && services->log)
        search = (struct lull_search){.log = services->log, .log_context = services->context};
    if (code == LULL_OK)
        code = lull_open(&search, spec, &found, err);
    if (code != LULL_OK) {
        give_back(services);
        return code;
    }
    code = lull_host_create(services, found.criterion, pairs, pair_count, out, err);
    if (code == LULL_OK && kept[0] != '\0' && atomic_load(&(*out)->warning_state) == LULL_WARNING_NONE)
        lull_error_set(err, LULL_OK, "%s", kept);
    return code;
}

void lull_host_close(struct lull_host_criterion *c)
{
    if (!c)
        return;
    struct lull_process_state before;
    lull_thread_state_read(&before);
    for (int s = 0; s <= LULL_HOST_STEPS; s++) {
        if (c->instances[s] && c->open)
            c->table->end_frame(c->instances[s]);
        if (c->instances[s])
            c->table->destroy(c->instances[s]);
    }
    lull_host_leave(c, &before, "destroy");
    free(c->all);
    for (uint32_t i = 0; c->pairs && i < c->pair_count; i++) {
        free((void *)(uintptr_t)c->pairs[i].key);
        free((void *)(uintptr_t)c->pairs[i].value);
    }
    free(c->pairs);
    lull_host_withdraw(c);
    pthread_mutex_destroy(&c->messages_lock);
    free(c);
}

const struct lull_criterion *lull_host_table(const struct lull_host_criterion *c) { return c ? c->table : NULL; }

const struct lull_requirements *lull_host_needs(const struct lull_host_criterion *c) { return c ? &c->needs : NULL; }

const char *lull_host_parameter(const struct lull_criterion *t, const char *name, const struct lull_pair *pairs,
                                uint32_t pair_count, const struct lull_param **found)
{
    const struct lull_param *p = NULL;
    for (uint32_t i = 0; i < t->param_count && !p; i++) {
        const struct lull_param *candidate = (const void *)((const char *)t->params + (size_t)i * t->param_stride);
        p = strcmp(candidate->name, name) == 0 ? candidate : NULL;
    }
    const char *text = p ? p->default_value : NULL;
    for (uint32_t i = 0; p && i < pair_count; i++)
        if (strcmp(pairs[i].key, name) == 0)
            text = pairs[i].value;
    if (found)
        *found = p;
    return text;
}

static int32_t fits(const struct lull_host_criterion *c, const struct lull_host_blocks *b, struct lull_error *err)
{
    const struct lull_requirements *n = &c->needs;
    if ((n->flags & LULL_REQ_FLEXIBLE) || n->block_width == 0 || n->block_height == 0 || b->columns == 0 ||
        ((int64_t)n->block_width == b->block_width && (int64_t)n->block_height == b->block_height))
        return LULL_OK;
    return lull_error_set(err, LULL_E_UNSUPPORTED, "criterion %s judges blocks of %ux%u pixels only", c->table->id,
                          n->block_width, n->block_height);
}

static struct lull_frame describe(const struct lull_host_frame *f, const struct lull_host_criterion *c,
                                  const struct lull_rect *rects)
{
    const struct lull_host_config *g = &f->config;
    const uint32_t passed_on = LULL_FRAME_DETERMINISTIC | LULL_FRAME_INDEPENDENT | LULL_FRAME_SHARED;
    struct lull_frame frame = {.struct_size = sizeof frame,
                               .flags = (g->flags & passed_on) | (c->open ? LULL_FRAME_RESTART : 0),
                               .width = g->width,
                               .height = g->height,
                               .blocks = rects,
                               .block_count = f->blocks.count,
                               .block_stride = sizeof *rects,
                               .planes = g->planes | (lull_host_wants_counts(c) ? LULL_HOST_COUNTS : 0),
                               .transfer = g->transfer,
                               .gamma = g->gamma,
                               .exposure = g->exposure,
                               .sample_clamp = g->sample_clamp,
                               .time_budget_s = g->time_budget_s,
                               .spp_min = g->spp_min,
                               .spp_max = g->spp_max,
                               .seed = g->seed};
    memcpy(frame.rgb_to_xyz, g->rgb_to_xyz, sizeof frame.rgb_to_xyz);
    return frame;
}

static int32_t begin_instances(struct lull_host_criterion *c, const struct lull_host_frame *f, struct lull_error *err)
{
    const struct lull_host_blocks *b = &f->blocks;
    struct lull_error e = {.struct_size = sizeof e};
    struct lull_rect *rects = calloc(b->count, sizeof *rects);
    if (!rects)
        return lull_host_no_memory(err, "blocks of the criterion");
    int32_t code = LULL_OK;
    for (uint32_t i = 0; i < b->count && code == LULL_OK; i++) {
        const struct lull_host_block *k = &b->list[i];
        rects[i] = (struct lull_rect){k->x0, k->y0, k->x1, k->y1};
        if (!c->instances[k->step])
            code = make_instance(c, k->step, err);
    }
    struct lull_frame frame = describe(f, c, rects);
    struct lull_process_state before;
    lull_thread_state_read(&before);
    for (int s = 0; s <= LULL_HOST_STEPS && code == LULL_OK; s++) {
        code = c->instances[s] ? c->table->begin_frame(c->instances[s], &frame, &e) : LULL_OK;
        if (code != LULL_OK)
            code = lull_host_blame(c, "", code, &e, err);
    }
    lull_host_leave(c, &before, "begin_frame");
    free(rects);
    return code;
}

int32_t lull_host_join(const struct lull_host_frame *f, struct lull_host_criterion *c, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "frame", f, "criterion", c, NULL);
    if (code != LULL_OK)
        return code;
    if (c->open) /* what was said before a first frame belongs to it */
        c->message_count = 0;
    c->frame = NULL;
    code = fits(c, &f->blocks, err);
    if (code != LULL_OK)
        return code;
    free(c->all);
    c->block_count = f->blocks.count;
    c->all = calloc(c->block_count, 2 * sizeof *c->all + sizeof *c->answers);
    if (!c->all)
        return lull_host_no_memory(err, "blocks of the criterion");
    c->due = c->all + c->block_count;
    c->answers = (struct lull_decision *)(c->due + c->block_count);
    code = begin_instances(c, f, err);
    if (code != LULL_OK)
        return code;
    c->open = 1;
    c->frame = f;
    c->begin_s = base_clock_wall_s();
    return LULL_OK;
}

/* Samples at the first check. */
static uint64_t first_check(const struct lull_host_frame *f)
{
    const struct lull_host_config *g = &f->config;
    if (g->flags & LULL_HOST_UNIFORM)
        return g->spp_max;
    uint64_t useful = f->criterion->needs.first_spp, spp = useful > g->spp_min ? useful : g->spp_min;
    return lull_host_next_check(&f->blocks, spp - 1, spp);
}

static int32_t fill_frame(struct lull_host_frame *f, const struct lull_plane *mask, struct lull_error *err)
{
    struct lull_host_blocks *b = &f->blocks;
    struct lull_host_criterion *c = f->criterion;
    char value[32];
    struct lull_pair quality;
    int32_t code = LULL_OK;
    f->decisions = calloc(b->count, sizeof *f->decisions + sizeof *f->due + sizeof *f->final);
    uint32_t room = LULL_HOST_ANSWERS_IN_ALL / b->count / 2 * 2;
    f->answer_room = room < LULL_HOST_ANSWERS ? room : LULL_HOST_ANSWERS;
    f->answers = calloc((size_t)b->count * f->answer_room + 1, sizeof *f->answers);
    f->answer_count = calloc(b->count, sizeof *f->answer_count);
    if (!f->decisions || !f->answers || !f->answer_count)
        return lull_host_no_memory(err, "blocks");
    f->due = (uint32_t *)(f->decisions + b->count);
    f->final = (uint8_t *)(f->due + b->count);
    if (mask) /* a criterion without a quality parameter is refused whatever the mask shows */
        code = lull_host_scale_quality(c->table, c->pairs, c->pair_count, 0, value, &quality, err);
    if (mask && code == LULL_OK)
        code = lull_host_read_mask(mask, b, err);
    if (code == LULL_OK && c)
        code = lull_host_join(f, c, err);
    for (uint32_t i = 0; i < b->count && code == LULL_OK; i++)
        b->list[i].next_spp = first_check(f);
    return code;
}

/* With what its zeros stand for, and without what is read but once. */
static struct lull_host_config understood(const struct lull_host_config *given)
{
    static const double srgb[9] = BASE_RGB_TO_XYZ;
    struct lull_host_config g = *given;
    int is_given = 0;
    g.layout = NULL;
    g.mask = NULL;
    g.exposure = g.exposure > 0.0 ? g.exposure : 1.0;
    for (int i = 0; i < 9; i++)
        is_given |= g.rgb_to_xyz[i] != 0.0;
    if (!is_given)
        memcpy(g.rgb_to_xyz, srgb, sizeof srgb);
    return g;
}

int32_t lull_host_begin(const struct lull_host_config *config, struct lull_host_criterion *criterion,
                        struct lull_host_frame **out, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "config", config, "out", out, NULL);
    if (code == LULL_OK)
        code = lull_host_check_config(config, criterion, err);
    if (code != LULL_OK)
        return code;
    struct lull_host_frame *f = calloc(1, sizeof *f);
    if (!f)
        return lull_host_no_memory(err, "frame");
    f->config = understood(config);
    f->criterion = criterion;
    code = lull_host_lay_out(config, criterion ? &criterion->needs : NULL, !criterion, &f->blocks, err);
    if (code == LULL_OK)
        code = fill_frame(f, config->mask, err);
    if (code != LULL_OK) {
        lull_host_end(f);
        return code;
    }
    *out = f;
    return criterion ? lull_host_pass_warning(criterion, err) : LULL_OK;
}

void lull_host_end(struct lull_host_frame *f)
{
    if (!f)
        return;
    free(f->blocks.list);
    free(f->decisions);
    free(f->answers);
    free(f->answer_count);
    free(f);
}

struct lull_host_blocks *lull_host_blocks_of(struct lull_host_frame *f) { return f ? &f->blocks : NULL; }

struct lull_host_totals *lull_host_totals_of(struct lull_host_frame *f) { return f ? &f->totals : NULL; }
