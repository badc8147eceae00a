/* Asking the criterion by everybody: whole blocks travel, answers come back. */
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "render/crew_messages.h"

/* The most that a parcel of blocks weighs, unless one block alone weighs more. */
static const size_t MOST_BYTES = (size_t)64 << 20;

struct asking {
    struct pt_crew *crew;
    const struct pt_crew_question *q;
    uint32_t next, away; /* blocks: not dealt out yet; with others */
    double thread_s;
    struct base_err *said, *err;
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

int pt_crew_can_ask(const struct pt_crew *crew, const struct lull_host_criterion *criterion)
{
    const uint32_t pure = LULL_CAP_DETERMINISTIC | LULL_CAP_BATCH_INVARIANT;
    if (!crew || !crew->judges)
        return 0;
    const struct lull_criterion *t = lull_host_table(criterion);
    return !has_history(criterion) && lull_host_needs(criterion)->halo == 0 && (t->capabilities & pure) == pure;
}

static const struct lull_host_blocks *blocks_of(const struct pt_crew_question *q) { return lull_host_blocks_of(q->frame); }

static struct pt_row row_of(const struct lull_host_block *b, int y)
{
    return (struct pt_row){.y = y, .x0 = b->x0, .x1 = b->x1};
}

static size_t block_bytes(const struct asking *a, uint32_t k)
{
    const struct lull_host_block *b = &blocks_of(a->q)->list[a->q->due[k]];
    struct pt_row row = row_of(b, b->y0);
    return sizeof(struct pt_crew_block) + (size_t)(b->y1 - b->y0) * pt_row_bytes(&row, a->q->film->planes);
}

/* How many of the blocks left go to a process of so many threads. */
static uint32_t share(const struct asking *a, int threads)
{
    uint32_t left = a->q->count - a->next, n = left / (uint32_t)(2 * a->crew->peers->count);
    n = n < (uint32_t)threads ? n : (uint32_t)threads;
    n = n > 0 ? n : left > 0;
    size_t bytes = 0;
    for (uint32_t k = 0; k < n; k++) {
        bytes += block_bytes(a, a->next + k);
        if (bytes > MOST_BYTES && k > 0)
            return k;
    }
    return n;
}

static int send_blocks(struct asking *a, int rank, uint32_t n)
{
    const struct pt_crew_question *q = a->q;
    size_t size = sizeof(struct pt_crew_ask);
    for (uint32_t k = 0; k < n; k++)
        size += block_bytes(a, a->next + k);
    struct pt_crew_ask *message = malloc(size);
    if (!message)
        return base_fail_nomem(a->err, "messages");
    *message = (struct pt_crew_ask){.kind = PT_CREW_ASK, .serial = a->crew->serial, .planes = q->film->planes, .count = n};
    unsigned char *sums = (unsigned char *)(message->blocks + n);
    for (uint32_t k = 0; k < n; k++) {
        uint32_t at = a->next + k;
        const struct lull_host_block *b = &blocks_of(q)->list[q->due[at]];
        message->blocks[k] = (struct pt_crew_block){.index = q->due[at], .final = q->final[at], .block = *b};
        for (int y = b->y0; y < b->y1; y++) {
            struct pt_row row = row_of(b, y);
            pt_row_save(q->film, &row, sums);
            sums += pt_row_bytes(&row, q->film->planes);
        }
    }
    a->next += n;
    a->away += n;
    return pt_crew_send(a->crew, rank, message, size, a->err);
}

static int deal(struct asking *a)
{
    int rc = 0;
    for (int rank = 1; rank < a->crew->peers->count && !rc; rank++) {
        const struct pt_crew_mate *m = &a->crew->mates[rank];
        uint32_t enough = (uint32_t)a->crew->peers->count; /* for a second parcel: everybody can have a first one */
        while (a->next < a->q->count && !rc &&
               (m->parcels == 0 || (m->parcels < PT_CREW_PARCELS && a->q->count - a->next > enough)))
            rc = send_blocks(a, rank, share(a, m->threads));
    }
    return rc;
}

/* Where a block stands in the question; they are in rising order. count if it is not there. */
static uint32_t place_of(const struct pt_crew_question *q, uint32_t index)
{
    uint32_t low = 0, high = q->count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (q->due[middle] < index)
            low = middle + 1;
        else
            high = middle;
    }
    return low < q->count && q->due[low] == index ? low : q->count;
}

static int take_answer(struct asking *a, int rank, const struct pt_crew_ask *m, size_t size)
{
    int rc = pt_crew_settle(a->crew, rank, m, size, a->err);
    if (rc || m->kind == PT_CREW_ROWS) /* rows: of a slice that was given up */
        return rc;
    if (m->kind != PT_CREW_ASK || size < sizeof *m || m->count > a->away ||
        size != sizeof *m + m->count * sizeof(struct pt_crew_block))
        return pt_crew_nonsense(a->crew, rank, a->err);
    for (uint32_t k = 0; k < m->count; k++) {
        uint32_t at = place_of(a->q, m->blocks[k].index);
        if (at == a->q->count)
            return pt_crew_nonsense(a->crew, rank, a->err);
        a->q->decisions[at] = m->blocks[k].decision;
    }
    if (m->error[0] != '\0' && !a->said->code)
        base_fail(a->said, BASE_EINVAL, "%.*s", (int)sizeof m->error - 1, m->error);
    a->away -= m->count;
    a->thread_s += m->thread_s;
    return 0;
}

static int attend(struct asking *a, double wait_s)
{
    int rc = 0;
    for (int got = 1; got > 0 && !rc; wait_s = 0.0) {
        int rank = 0;
        void *data = NULL;
        size_t size = 0;
        got = base_peers_receive(a->crew->peers, wait_s, &rank, &data, &size, a->err);
        rc = got > 0 ? take_answer(a, rank, data, size) : got;
        free(data);
    }
    return rc ? rc : pt_crew_look_round(a->crew, a->q->interrupted, a->q->data, a->err);
}

/* Some of the blocks left are asked about here. */
static void ask_here(struct asking *a, int threads)
{
    const struct pt_crew_question *q = a->q;
    struct base_err err = {0};
    uint32_t n = share(a, threads), first = a->next;
    a->next += n;
    if (n > 0 &&
        pt_criterion_evaluate(q->criterion, q->frame, q->film, q->due + first, n, q->final + first, q->decisions + first,
                              &err) != 0 &&
        !a->said->code)
        *a->said = err;
}

int pt_crew_ask(struct pt_crew *crew, struct base_threads *threads, const struct pt_crew_question *question,
                double *thread_s, struct base_err *said, struct base_err *err)
{
    struct asking a = {.crew = crew, .q = question, .said = said, .err = err};
    int rc = 0;
    crew->serial++;
    while (!rc && (a.next < question->count || a.away > 0)) {
        rc = deal(&a);
        if (!rc && a.next < question->count)
            ask_here(&a, base_threads_count(threads));
        if (!rc)
            rc = attend(&a, a.next < question->count ? 0.0 : 0.05);
    }
    for (uint32_t k = 0; k < question->count && said->code; k++)
        question->decisions[k] = lull_host_undecided();
    *thread_s = a.thread_s;
    return rc;
}
