#include "render/host.h"

#include <math.h>
#include <stdlib.h>

#include "base/clock.h"
#include "base/colour.h"
#include "render/host_planes.h"

int pt_criterion_fail(const struct pt_criterion *c, const char *what, int32_t code, const struct lull_error *said,
                      struct base_err *err)
{
    return base_fail(err, code == LULL_E_MEMORY ? BASE_ENOMEM : BASE_EINVAL, "criterion %s: %s%s", c->table->id, what,
                     said->message);
}

int pt_criterion_create(const struct lull_criterion *table, const struct lull_pair *pairs, uint32_t pair_count,
                        struct base_threads *threads, void (*warn)(void *data, const char *line), void *warn_data,
                        struct pt_criterion **out, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    struct pt_criterion *c = calloc(1, sizeof *c);
    if (!c)
        return base_fail_nomem(err, "criterion");
    c->table = table;
    c->services = (struct pt_host_services){table->id, threads, warn, warn_data};
    c->host = pt_host_services_table(&c->services);
    int32_t code = table->create(&c->host, pairs, pair_count, sizeof *pairs, &c->dialled[0], &e);
    if (code == LULL_OK) {
        c->needs.struct_size = sizeof c->needs;
        code = table->requirements(c->dialled[0], &c->needs, &e);
    }
    if (code != LULL_OK) {
        int rc = pt_criterion_fail(c, "", code, &e, err);
        pt_criterion_destroy(c);
        return rc;
    }
    *out = c;
    return 0;
}

int pt_criterion_set_mask(struct pt_criterion *c, const struct pt_mask *mask, const struct lull_pair *pairs,
                          uint32_t pair_count, struct base_err *err)
{
    char value[32];
    struct lull_pair dial;
    c->mask = mask;
    c->pairs = pairs;
    c->pair_count = pair_count;
    return pt_mask_dial(c->table, pairs, pair_count, 0, value, &dial, err);
}

/* An instance like the first one, its dial scaled for this step of the mask. */
static int create_dialled(struct pt_criterion *c, int step, struct base_err *err)
{
    struct lull_error e = {.struct_size = sizeof e};
    char value[32];
    struct lull_pair *pairs = calloc(c->pair_count + 1, sizeof *pairs);
    if (!pairs)
        return base_fail_nomem(err, "criterion");
    for (uint32_t i = 0; i < c->pair_count; i++)
        pairs[i] = c->pairs[i];
    int rc = pt_mask_dial(c->table, c->pairs, c->pair_count, step, value, &pairs[c->pair_count], err);
    if (!rc) { /* a later pair wins */
        int32_t code = c->table->create(&c->host, pairs, c->pair_count + 1, sizeof *pairs, &c->dialled[step], &e);
        if (code != LULL_OK)
            rc = pt_criterion_fail(c, "", code, &e, err);
    }
    free(pairs);
    return rc;
}

static void release_frame(struct pt_criterion *c)
{
    free(c->all);
    free(c->due);
    free(c->rects);
    free(c->spp);
    free(c->step);
    free(c->answers);
}

void pt_criterion_destroy(struct pt_criterion *c)
{
    if (!c)
        return;
    for (int s = 0; s <= PT_MASK_STEPS; s++) {
        if (c->dialled[s] && c->open)
            c->table->end_frame(c->dialled[s]);
        if (c->dialled[s])
            c->table->destroy(c->dialled[s]);
    }
    release_frame(c);
    free(c);
}

static int allocate_frame(struct pt_criterion *c, const struct pt_blocks *blocks, const struct pt_film *film,
                          struct base_err *err)
{
    release_frame(c);
    c->all = calloc(blocks->count, sizeof *c->all);
    c->due = calloc(blocks->count, sizeof *c->due);
    c->rects = calloc(blocks->count, sizeof *c->rects);
    c->step = calloc(blocks->count, sizeof *c->step);
    c->answers = calloc(blocks->count, sizeof *c->answers);
    int counts = (c->needs.planes_required & (LULL_PLANE_BIT(LULL_PLANE_SPP) | LULL_PLANE_BIT(LULL_PLANE_WEIGHT))) != 0;
    if (counts)
        c->spp = calloc(film->pixels, sizeof *c->spp);
    if (!c->all || !c->due || !c->rects || !c->step || !c->answers || (counts && !c->spp))
        return base_fail_nomem(err, "blocks of the criterion");
    return 0;
}

int pt_criterion_begin(struct pt_criterion *c, const struct pt_criterion_frame *frame, const struct pt_blocks *blocks,
                       const struct pt_film *film, struct base_err *err)
{
    const struct lull_requirements *needs = &c->needs;
    if (!(needs->flags & LULL_REQ_FLEXIBLE) && needs->block_width > 0 && needs->block_height > 0 &&
        ((int)needs->block_width != blocks->block_width || (int)needs->block_height != blocks->block_height))
        return base_fail(err, BASE_EINVAL, "criterion %s judges blocks of %ux%u pixels only: use --block %ux%u",
                         c->table->id,
                       needs->block_width, needs->block_height, needs->block_width, needs->block_height);
    int rc = allocate_frame(c, blocks, film, err);
    if (rc)
        return rc;
    for (uint32_t i = 0; i < blocks->count; i++) {
        const struct pt_block *b = &blocks->list[i];
        c->rects[i] = (struct lull_rect){b->x0, b->y0, b->x1, b->y1};
        c->step[i] = (uint8_t)(c->mask ? pt_mask_step(c->mask, b) : 0);
        if (!c->dialled[c->step[i]] && (rc = create_dialled(c, c->step[i], err)) != 0)
            return rc;
    }
    struct lull_frame f = {
        .struct_size = sizeof f,
        .flags = (frame->deterministic ? LULL_FRAME_DETERMINISTIC : 0) | (frame->independent ? LULL_FRAME_INDEPENDENT : 0) |
                 (c->open ? LULL_FRAME_RESTART : 0),
        .width = (uint32_t)frame->width,
        .height = (uint32_t)frame->height,
        .blocks = c->rects,
        .block_count = blocks->count,
        .block_stride = sizeof c->rects[0],
        .planes = pt_host_planes(film, c->spp, c->planes),
        .transfer = LULL_TRANSFER_SRGB,
        .exposure = 1.0,
        .sample_clamp = frame->sample_clamp,
        .time_budget_s = frame->time_budget_s,
        .spp_min = frame->spp_min,
        .spp_max = frame->spp_max,
        .seed = frame->seed,
        .rgb_to_xyz = BASE_RGB_TO_XYZ,
    };
    struct lull_error e = {.struct_size = sizeof e};
    for (int s = 0; s <= PT_MASK_STEPS; s++) {
        int32_t code = c->dialled[s] ? c->table->begin_frame(c->dialled[s], &f, &e) : LULL_OK;
        if (code != LULL_OK)
            return pt_criterion_fail(c, "", code, &e, err);
    }
    c->open = 1;
    c->begin_s = base_clock_wall_s();
    return 0;
}

static struct lull_block block_state(const struct pt_block *b, uint32_t index, int has_half)
{
    return (struct lull_block){.id = index, .flags = b->reason != PT_REASON_NONE ? LULL_BLOCK_STOPPED : 0, .x0 = b->x0,
                               .y0 = b->y0, .x1 = b->x1, .y1 = b->y1, .spp = b->spp,
                               .half_spp = has_half ? pt_film_half_spp(b->spp) : 0, .thread_s = b->thread_s};
}

/* Asks the instance of one step about those of the due blocks that are its own. final as in pt_criterion_evaluate. */
static int32_t evaluate_step(struct pt_criterion *c, int step, const struct lull_view *view, const uint32_t *due,
                             uint32_t count, const uint8_t *final, struct lull_decision *decisions, struct lull_error *e)
{
    uint32_t n = 0;
    for (uint32_t k = 0; k < count; k++) {
        if (c->step[due[k]] != step)
            continue;
        c->due[n] = c->all[due[k]];
        if (final[k])
            c->due[n].flags |= LULL_BLOCK_FINAL;
        c->answers[n++] = decisions[k];
    }
    if (n == 0)
        return LULL_OK;
    int32_t code = c->table->evaluate(c->dialled[step], view, c->due, sizeof c->due[0], c->answers, sizeof c->answers[0], n,
                                      e);
    n = 0;
    for (uint32_t k = 0; k < count && code == LULL_OK; k++)
        if (c->step[due[k]] == step)
            decisions[k] = c->answers[n++];
    return code;
}

const struct lull_decision pt_criterion_undecided = {.action = LULL_CONTINUE, .p_noisy = NAN, .predicted_spp = NAN,
                                                     .error = NAN};

int pt_criterion_evaluate(struct pt_criterion *c, struct pt_film *film, const struct pt_blocks *blocks, const uint32_t *due,
                          uint32_t count, const uint8_t *final, struct lull_decision *decisions, struct base_err *err)
{
    int rc = 0, has_half = film->half != NULL;
    struct pt_film_patch patch = {0};

    for (uint32_t i = 0; i < blocks->count; i++)
        c->all[i] = block_state(&blocks->list[i], i, has_half);
    for (uint32_t k = 0; k < count; k++)
        decisions[k] = pt_criterion_undecided;
    for (uint32_t i = 0; i < blocks->count && !rc; i++) {
        const struct pt_block *b = &blocks->list[i];
        if (b->dropped > 0)
            rc = pt_film_patch(film, b->x0, b->y0, b->x1, b->y1, b->spp, &patch, err);
    }
    if (rc)
        goto out;
    if (c->spp)
        pt_host_fill_spp(film, blocks, c->spp);
    struct lull_view view = {.struct_size = sizeof view, .x0 = film->x0, .y0 = film->y0, .x1 = film->x1, .y1 = film->y1,
                             .planes = c->planes, .plane_count = LULL_PLANE_COUNT, .plane_stride = sizeof c->planes[0],
                             .all = c->all, .all_count = blocks->count, .all_stride = sizeof c->all[0],
                             .elapsed_s = base_clock_wall_s() - c->begin_s};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = LULL_OK;
    for (int s = 0; s <= PT_MASK_STEPS && code == LULL_OK; s++)
        code = evaluate_step(c, s, &view, due, count, final, decisions, &e);
    if (code != LULL_OK) {
        for (uint32_t k = 0; k < count; k++)
            decisions[k] = pt_criterion_undecided;
        rc = pt_criterion_fail(c, "", code, &e, err);
    }
out:
    pt_film_unpatch(film, &patch);
    return rc;
}
