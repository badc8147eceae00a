#include "render/farm.h"

#include <stdlib.h>

static size_t aligned(size_t bytes) { return (bytes + 7) / 8 * 8; }

/* What the rows of a slice have in common. */
struct sampling_task {
    _Alignas(8) uint32_t planes;
    struct pt_integrator integrator;
};

/* A row as it travels, there and back; its sums follow. */
struct row_item {
    struct pt_row row;
    unsigned char sums[];
};

struct sampling {
    const struct pt_farm_slice *slice;
    unsigned char *before; /* owns; [count][stride] the sums of each row that was begun; NULL: no workers */
    unsigned char *begun;  /* owns; [count], likewise */
    size_t stride;
};

static void pack_row(void *data, uint32_t i, void *item)
{
    const struct sampling *s = data;
    struct row_item *to = item;
    to->row = s->slice->rows[i];
    pt_row_save(s->slice->film, &to->row, to->sums);
}

/* With workers, who may be lost, the sums before the slice are kept until its end. */
static struct pt_row *begin_row(const struct sampling *s, uint32_t i)
{
    if (s->before) {
        pt_row_save(s->slice->film, &s->slice->rows[i], s->before + i * s->stride);
        s->begun[i] = 1;
    }
    return &s->slice->rows[i];
}

static int sample_here(void *data, uint32_t first, uint32_t n, int thread, struct base_err *err)
{
    const struct sampling *s = data;
    for (uint32_t i = first; i < first + n; i++)
        pt_row_sample(&s->slice->context, s->slice->film, begin_row(s, i));
    (void)thread;
    (void)err;
    return 0;
}

static int apply_row(void *data, uint32_t i, const void *answer)
{
    const struct sampling *s = data;
    const struct row_item *from = answer;
    const struct pt_row *sent = &s->slice->rows[i];
    if (from->row.y != sent->y || from->row.x0 != sent->x0 || from->row.x1 != sent->x1)
        return BASE_EINVAL;
    struct pt_row *row = begin_row(s, i);
    *row = from->row;
    pt_row_restore(s->slice->film, row, from->sums);
    return 0;
}

static void undo(const struct sampling *s)
{
    for (size_t i = 0; i < s->slice->count; i++) {
        struct pt_row *row = &s->slice->rows[i];
        if (!s->begun[i])
            continue;
        pt_row_restore(s->slice->film, row, s->before + i * s->stride);
        *row = (struct pt_row){
            .block = row->block, .y = row->y, .x0 = row->x0, .x1 = row->x1, .from = row->from, .to = row->to};
    }
}

int pt_farm_sample(struct job *job, struct base_threads *threads, const struct pt_farm_slice *slice, struct base_err *err)
{
    const struct sampling_task common = {slice->film->planes, *slice->context.integrator};
    struct sampling s = {.slice = slice};
    int rc = 0;
    for (size_t i = 0; job && i < slice->count; i++) {
        size_t bytes = aligned(pt_row_bytes(&slice->rows[i], slice->film->planes));
        s.stride = bytes > s.stride ? bytes : s.stride;
    }
    s.before = job ? malloc(slice->count * s.stride) : NULL;
    s.begun = job ? calloc(slice->count, 1) : NULL;
    const struct job_farm farm = {.count = (uint32_t)slice->count,
                                  .common_bytes = sizeof common,
                                  .item_bytes = sizeof(struct row_item) + s.stride,
                                  .answer_bytes = sizeof(struct row_item) + s.stride,
                                  .common = &common,
                                  .pack = pack_row,
                                  .here = sample_here,
                                  .apply = apply_row,
                                  .data = &s};
    if (job && (!s.before || !s.begun))
        rc = base_fail_nomem(err, "rows with workers");
    else if ((rc = job_farm_run(job, threads, &farm, err)) != 0)
        undo(&s);
    free(s.before);
    free(s.begun);
    return rc;
}

/* A worker samples one row in a film of its own, from its sums to its sums. */
static int sample_row(void *data, struct job_task *task, uint32_t k, uint32_t n, void *to, int thread, struct base_err *err)
{
    const struct sampling_task *common = job_task_common(task);
    const struct row_item *item = job_task_item(task, k);
    struct row_item *answer = to;
    struct pt_sampler_context context = *(const struct pt_sampler_context *)data;
    struct pt_film film = {0};
    (void)n;
    (void)thread;
    context.integrator = &common->integrator;
    answer->row = item->row;
    int rc = pt_film_init(&film, item->row.x0, item->row.y, item->row.x1, item->row.y + 1, common->planes, err);
    if (rc)
        return rc;
    pt_row_restore(&film, &item->row, item->sums);
    pt_row_sample(&context, &film, &answer->row);
    pt_row_save(&film, &item->row, answer->sums);
    pt_film_release(&film);
    return 0;
}

int pt_farm_serve(struct job *job, struct base_threads *threads, const struct pt_sampler_context *context,
                  struct base_err *err)
{
    struct pt_sampler_context own = *context;
    const struct job_service service = {sample_row, &own};
    return job_serve(job, threads, &service, err);
}
