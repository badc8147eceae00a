/*
 * A criterion that writes down what the host does with it, line by line, into the file that LULL_DIARY names, and decides by a rule
 * that a test knows: block b stops at 16 (1 + b mod 3) samples and wants to be asked every 8. `diary-reopens` is the same and also
 * asks about stopped blocks; it opens each of them once.
 */
#include <lull/criterion.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

struct lull_instance {
    FILE *file;
    const struct lull_host *host;
    int reopens, frame_is_open;
    char opened[4096];
};

static int32_t create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count, uint32_t pair_stride,
                      struct lull_instance **instance, struct lull_error *err)
{
    (void)pairs, (void)pair_count, (void)pair_stride, (void)err;
    const char *path = getenv("LULL_DIARY");
    struct lull_instance *in = calloc(1, sizeof *in);
    if (!in)
        return LULL_E_MEMORY;
    in->file = fopen(path ? path : "/dev/null", "a");
    in->host = host;
    if (!in->file) {
        free(in);
        return LULL_E_IO;
    }
    fprintf(in->file, "create\n");
    *instance = in;
    return LULL_OK;
}

static int32_t create_reopening(const struct lull_host *host, const struct lull_pair *pairs, uint32_t pair_count,
                                uint32_t pair_stride, struct lull_instance **instance, struct lull_error *err)
{
    int32_t status = create(host, pairs, pair_count, pair_stride, instance, err);
    if (status == LULL_OK)
        (*instance)->reopens = 1;
    return status;
}

static int32_t requirements(const struct lull_instance *in, struct lull_requirements *req, struct lull_error *err)
{
    (void)in, (void)err;
    *req = (struct lull_requirements){.struct_size = req->struct_size,
                                      .planes_required = LULL_PLANE_BIT(LULL_PLANE_COLOR),
                                      .planes_used = LULL_PLANE_BIT(LULL_PLANE_COLOR),
                                      .first_spp = 4};
    return LULL_OK;
}

static int32_t begin_frame(struct lull_instance *in, const struct lull_frame *f, struct lull_error *err)
{
    (void)err;
    in->frame_is_open = 1;
    fprintf(in->file, "begin %ux%u blocks %u min %llu max %llu seed %llu budget %g clamp %g exposure %g flags %u\n",
            f->width, f->height, f->block_count, (unsigned long long)f->spp_min, (unsigned long long)f->spp_max,
            (unsigned long long)f->seed, f->time_budget_s, f->sample_clamp, f->exposure, f->flags);
    return LULL_OK;
}

/* Mean of the first channel. */
static double red_of(const struct lull_view *view, const struct lull_block *b)
{
    const struct lull_plane *p = &view->planes[LULL_PLANE_COLOR];
    double sum = 0;
    for (int32_t y = b->y0; y < b->y1; y++)
        for (int32_t x = b->x0; x < b->x1; x++) {
            const void *at = (const char *)p->data + (x - view->x0) * p->stride_x + (y - view->y0) * p->stride_y;
            sum += p->type == LULL_TYPE_F64 ? *(const double *)at : (double)*(const float *)at;
        }
    double n = p->normaliser == LULL_NORM_SPP ? (double)b->spp : 1;
    return sum * p->scale / n / ((double)(b->x1 - b->x0) * (b->y1 - b->y0));
}

static int32_t evaluate(struct lull_instance *in, const struct lull_view *view, const struct lull_block *blocks,
                        uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                        struct lull_error *err)
{
    (void)err;
    for (uint32_t i = 0; i < count; i++) {
        const void *at = (const char *)blocks + (size_t)i * block_stride;
        void *answer = (char *)decisions + (size_t)i * decision_stride;
        const struct lull_block *b = at;
        struct lull_decision *d = answer;
        uint64_t end = 16 * (1 + b->id % 3);
        int again = in->reopens && (b->flags & LULL_BLOCK_STOPPED) && !in->opened[b->id % 4096];
        if (again)
            in->opened[b->id % 4096] = 1;
        fprintf(in->file, "ask %u spp %llu flags %u at %d,%d,%d,%d red %.9g\n", b->id, (unsigned long long)b->spp, b->flags,
                b->x0, b->y0, b->x1, b->y1, red_of(view, b));
        d->action = b->spp >= end && !again ? LULL_STOP : LULL_CONTINUE;
        d->next_spp = d->action == LULL_CONTINUE ? b->spp + 8 : 0;
        d->p_noisy = 1.0 / (double)(b->id + 2);
        d->predicted_spp = (double)end;
        d->error = 1 / (double)b->spp;
    }
    if (in->host && in->host->log) {
        in->host->log(in->host, LULL_LOG_INFO, "nothing to worry about");
        in->host->log(in->host, LULL_LOG_WARNING, "watch out");
    }
    return LULL_OK;
}

static void end_frame(struct lull_instance *in)
{
    if (in->frame_is_open)
        fprintf(in->file, "end\n");
    in->frame_is_open = 0;
}

static void destroy(struct lull_instance *in)
{
    if (!in)
        return;
    fprintf(in->file, "destroy%s\n", in->frame_is_open ? " with an open frame" : "");
    fclose(in->file);
    free(in);
}

static const void *get_extension(const char *id)
{
    (void)id;
    return NULL;
}

#define DIARY(the_id, the_create, caps) \
    { \
        .struct_size = sizeof(struct lull_criterion), .api_minor = LULL_API_MINOR, .id = the_id, .name = "diary", \
        .version = "1", .description = "writes down what is done with it", .thread_level = LULL_THREADS_INSTANCE, \
        .capabilities = caps, .create = the_create, .requirements = requirements, .begin_frame = begin_frame, \
        .evaluate = evaluate, .end_frame = end_frame, .destroy = destroy, .get_extension = get_extension \
    }

static const struct lull_criterion diaries[2] = {DIARY("diary", create, LULL_CAP_DETERMINISTIC),
                                                 DIARY("diary-reopens", create_reopening, LULL_CAP_REOPENS)};

const struct lull_criterion *lull_criterion_entry_v1(uint32_t index) { return index < 2 ? &diaries[index] : NULL; }
