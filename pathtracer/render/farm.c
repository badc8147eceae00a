#include "render/farm.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"

enum work { ROWS, QUESTIONS };

static size_t aligned(size_t bytes) { return (bytes + 7) / 8 * 8; }

/* --- rows ------------------------------------------------------------------------------------------------------------- */

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
    unsigned char *before; /* owns; [count][stride] the sums of each row that was begun */
    unsigned char *begun;  /* owns; [count] */
    size_t stride;
};

static void pack_row(void *data, uint32_t i, void *item)
{
    const struct sampling *s = data;
    struct row_item *to = item;
    to->row = s->slice->rows[s->slice->order[i]];
    pt_row_save(s->slice->film, &to->row, to->sums);
}

/* The sums before the slice are kept until its end. */
static struct pt_row *begin_row(const struct sampling *s, uint32_t i)
{
    const uint32_t index = s->slice->order[i];
    pt_row_save(s->slice->film, &s->slice->rows[index], s->before + index * s->stride);
    s->begun[index] = 1;
    return &s->slice->rows[index];
}

static int sample_here(void *data, uint32_t first, uint32_t n, int thread, struct base_err *err)
{
    const struct sampling *s = data;
    for (uint32_t i = first; i < first + n; i++)
        pt_row_sample(&s->slice->maker, s->slice->film, begin_row(s, i));
    (void)thread;
    (void)err;
    return 0;
}

static int apply_row(void *data, uint32_t i, const void *answer)
{
    const struct sampling *s = data;
    const struct row_item *from = answer;
    const struct pt_row *sent = &s->slice->rows[s->slice->order[i]];
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
    const struct sampling_task common = {slice->film->planes, *slice->maker.integrator};
    struct sampling s = {.slice = slice};
    int rc = 0;
    for (size_t i = 0; i < slice->count; i++) {
        size_t bytes = aligned(pt_row_bytes(&slice->rows[i], slice->film->planes));
        s.stride = bytes > s.stride ? bytes : s.stride;
    }
    s.before = malloc(slice->count * s.stride);
    s.begun = calloc(slice->count, 1);
    const struct job_farm farm = {.work = ROWS,
                                  .count = (uint32_t)slice->count,
                                  .common_bytes = sizeof common,
                                  .item_bytes = sizeof(struct row_item) + s.stride,
                                  .answer_bytes = sizeof(struct row_item) + s.stride,
                                  .common = &common,
                                  .pack = pack_row,
                                  .here = sample_here,
                                  .apply = apply_row,
                                  .data = &s};
    if (!s.before || !s.begun)
        rc = base_fail_nomem(err, "rows with workers");
    else if ((rc = job_farm_run(job, threads, &farm, err)) != 0)
        undo(&s);
    free(s.before);
    free(s.begun);
    return rc;
}

/* A worker samples one row in a film of its own, from its sums to its sums. */
static int sample_row(const struct pt_farm_tools *tools, struct job_task *task, uint32_t k, struct row_item *answer,
                      struct base_err *err)
{
    const struct sampling_task *common = job_task_common(task);
    const struct row_item *item = job_task_item(task, k);
    struct pt_row_maker maker = tools->maker;
    struct pt_film film = {0};
    maker.integrator = &common->integrator;
    answer->row = item->row;
    int rc = pt_film_init(&film, item->row.x0, item->row.y, item->row.x1, item->row.y + 1, common->planes, err);
    if (rc)
        return rc;
    pt_row_restore(&film, &item->row, item->sums);
    pt_row_sample(&maker, &film, &answer->row);
    pt_row_save(&film, &item->row, answer->sums);
    pt_film_release(&film);
    return 0;
}

/* --- questions to the criterion --------------------------------------------------------------------------------------- */

/* A block to be judged; the sums of its rows follow. */
struct block_item {
    uint32_t index, final; /* in the list of blocks; final: as for pt_criterion_evaluate */
    struct lull_host_block block;
    unsigned char sums[];
};

struct block_answer {
    struct lull_decision decision;
    double thread_s; /* processor seconds that it took */
    char error[512]; /* why the criterion failed; empty: it did not */
};

struct asking {
    const struct pt_farm_question *q;
    double thread_s;
    struct base_err *said;
};

static int32_t refuse_bytes(const struct lull_writer *writer, const void *data, uint64_t size)
{
    (void)writer;
    (void)data;
    return size > 0 ? LULL_E_IO : LULL_OK;
}

/* Do answers in the open frame hang on earlier ones? Then there is something to save. */
static int has_history(const struct lull_host_criterion *criterion)
{
    const struct lull_writer writer = {.struct_size = sizeof writer, .write = refuse_bytes};
    return lull_host_save_history(criterion, &writer, NULL) != LULL_OK;
}

int pt_farm_can_ask(const struct job *job, const struct lull_host_criterion *criterion)
{
    const uint32_t pure = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT;
    if (!job_workers_able(job))
        return 0;
    const struct lull_criterion *t = lull_host_table(criterion);
    return !has_history(criterion) && lull_host_needs(criterion)->halo == 0 && (t->capabilities & pure) == pure;
}

static struct pt_row row_of(const struct lull_host_block *b, int y)
{
    return (struct pt_row){.y = y, .x0 = b->x0, .x1 = b->x1};
}

static void pack_block(void *data, uint32_t i, void *item)
{
    const struct pt_farm_question *q = ((const struct asking *)data)->q;
    struct block_item *to = item;
    to->index = q->due[i];
    to->final = q->final[i];
    to->block = lull_host_blocks_of(q->frame)->list[q->due[i]];
    unsigned char *sums = to->sums;
    for (int y = to->block.y0; y < to->block.y1; y++) {
        const struct pt_row row = row_of(&to->block, y);
        pt_row_save(q->film, &row, sums);
        sums += pt_row_bytes(&row, q->film->planes);
    }
}

static int ask_here(void *data, uint32_t first, uint32_t n, int thread, struct base_err *err)
{
    const struct asking *a = data;
    const struct pt_farm_question *q = a->q;
    struct base_err why = {0};
    if (pt_criterion_evaluate(q->criterion, q->frame, q->film, q->due + first, n, q->final + first, q->decisions + first,
                              &why) != 0 &&
        !a->said->code)
        *a->said = why;
    (void)thread;
    (void)err;
    return 0;
}

static int apply_answer(void *data, uint32_t i, const void *answer)
{
    struct asking *a = data;
    const struct block_answer *from = answer;
    a->q->decisions[i] = from->decision;
    a->thread_s += from->thread_s;
    if (from->error[0] != '\0' && !a->said->code)
        base_fail(a->said, BASE_EINVAL, "%.*s", (int)sizeof from->error - 1, from->error);
    return 0;
}

int pt_farm_ask(struct job *job, struct base_threads *threads, const struct pt_farm_question *question, double *thread_s,
                struct base_err *said, struct base_err *err)
{
    struct asking a = {.q = question, .said = said};
    size_t most = 0;
    for (uint32_t k = 0; k < question->count; k++) {
        const struct lull_host_block *b = &lull_host_blocks_of(question->frame)->list[question->due[k]];
        const struct pt_row row = row_of(b, b->y0);
        size_t bytes = aligned((size_t)(b->y1 - b->y0) * pt_row_bytes(&row, question->film->planes));
        most = bytes > most ? bytes : most;
    }
    const struct job_farm farm = {.work = QUESTIONS,
                                  .whole = 1,
                                  .count = question->count,
                                  .item_bytes = sizeof(struct block_item) + most,
                                  .answer_bytes = sizeof(struct block_answer),
                                  .pack = pack_block,
                                  .here = ask_here,
                                  .apply = apply_answer,
                                  .data = &a};
    int rc = job_farm_run(job, threads, &farm, err);
    for (uint32_t k = 0; k < question->count && said->code; k++)
        question->decisions[k] = lull_host_undecided();
    *thread_s = a.thread_s;
    return rc;
}

/* A worker puts the blocks of a task into its film and asks. */
static int answer_task(const struct pt_farm_tools *tools, struct job_task *task, struct block_answer *answers,
                       struct base_err *err)
{
    const double start_s = base_clock_process_s();
    struct base_err why = {0};
    uint32_t *due = calloc(task->count, sizeof *due);
    uint8_t *final = calloc(task->count, sizeof *final);
    struct lull_decision *decisions = calloc(task->count, sizeof *decisions);
    const int rc = due && final && decisions ? 0 : base_fail_nomem(err, "blocks to be judged");
    for (uint32_t k = 0; k < task->count && !rc; k++) {
        const struct block_item *item = job_task_item(task, k);
        const unsigned char *sums = item->sums;
        due[k] = item->index;
        final[k] = (uint8_t)item->final;
        lull_host_blocks_of(tools->frame)->list[item->index] = item->block;
        for (int y = item->block.y0; y < item->block.y1; y++) {
            const struct pt_row row = row_of(&item->block, y);
            pt_row_restore(tools->film, &row, sums);
            sums += pt_row_bytes(&row, tools->film->planes);
        }
    }
    if (!rc)
        pt_criterion_evaluate(tools->criterion, tools->frame, tools->film, due, task->count, final, decisions, &why);
    for (uint32_t k = 0; k < task->count && !rc; k++) {
        answers[k] = (struct block_answer){.decision = decisions[k]};
        snprintf(answers[k].error, sizeof answers[k].error, "%s", why.text);
    }
    if (!rc)
        answers[0].thread_s = base_clock_process_s() - start_s;
    free(due);
    free(final);
    free(decisions);
    return rc;
}

/* --- serving ---------------------------------------------------------------------------------------------------------- */

static int work(void *data, struct job_task *task, uint32_t k, uint32_t n, void *answer, int thread, struct base_err *err)
{
    (void)n;
    (void)thread;
    return task->work == ROWS ? sample_row(data, task, k, answer, err) : answer_task(data, task, answer, err);
}

int pt_farm_serve(struct job *job, struct base_threads *threads, const struct pt_farm_tools *tools, struct base_err *err)
{
    const struct job_service service = {work, (void *)(size_t)tools};
    return job_serve(job, threads, &service, err);
}
