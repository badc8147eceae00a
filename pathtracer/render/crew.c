#include "render/crew.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "render/crew_messages.h"

/* Rows per thread in one parcel, and what share of those left: few enough that nobody is left with many at the end. */
enum { MOST_ROWS = 32, SHARES = 4 };
static const size_t MOST_BYTES = (size_t)64 << 20; /* of their sums, unless one row weighs more */

/* How often rank 0 looks for messages while it samples. */
static const double LOOK_EVERY_S = 0.001;

/* One slice while it is being sampled. */
struct sampling {
    struct pt_crew *crew;
    const struct pt_crew_slice *slice;
    atomic_size_t next;    /* in slice->order */
    atomic_int stop;       /* give up: interrupted or failed */
    size_t away;           /* rows with members */
    unsigned char *before; /* owns; [count][stride] the sums of each row that was begun */
    unsigned char *begun;  /* owns; [count] */
    size_t stride;
    double look_s; /* wall time of the next look for messages */
    int rc;
    struct base_err *err;
};

int pt_crew_create(struct base_peers *peers, double timeout_s, struct pt_crew **out, struct base_err *err)
{
    struct pt_crew *crew = calloc(1, sizeof *crew);
    struct pt_crew_mate *mates = calloc((size_t)peers->count, sizeof *mates);
    if (!crew || !mates) {
        free(crew);
        free(mates);
        return base_fail_nomem(err, "crew");
    }
    crew->peers = peers;
    crew->timeout_s = timeout_s;
    crew->judges = 1;
    crew->mates = mates;
    *out = crew;
    return 0;
}

int pt_crew_processes(const struct pt_crew *crew) { return crew ? crew->peers->count : 1; }

int pt_crew_threads(const struct pt_crew *crew) { return crew ? crew->threads : 0; }

const struct pt_crew_traffic *pt_crew_traffic(const struct pt_crew *crew) { return &crew->traffic; }

static const char *name_of(const struct pt_crew *crew, int rank) { return crew->peers->list[rank].name; }

int pt_crew_nonsense(const struct pt_crew *crew, int rank, struct base_err *err)
{
    return base_fail(err, BASE_EIO, "%s said something that makes no sense", name_of(crew, rank));
}

/* --- the beginning and the end ---------------------------------------------------------------------------------------- */

/* A message before work begins. */
static int hear(struct pt_crew *crew, int rank, const struct pt_crew_hello *hello, size_t size, const char *ours,
                struct base_err *err)
{
    size_t n = size >= sizeof *hello ? size - sizeof *hello : 0;
    char *text = size >= sizeof *hello ? strndup(hello->text, n) : NULL;
    int rc = 0;
    if (!text)
        rc = pt_crew_nonsense(crew, rank, err);
    else if (hello->kind == PT_CREW_FAILED)
        rc = base_fail(err, BASE_EINVAL, "%s: %s", name_of(crew, rank), text);
    else if (strcmp(text, ours) != 0)
        rc = base_peers_differ(crew->peers, rank, text, ours, err);
    free(text);
    if (rc)
        return rc;
    crew->mates[rank].ready = 1;
    crew->mates[rank].threads = (int)hello->threads;
    crew->threads += (int)hello->threads;
    crew->judges &= (int)hello->judges;
    return 0;
}

static int lose(struct pt_crew *crew, struct base_err *err, int rank)
{
    crew->lost = 1;
    return base_peers_give_up(crew->peers, rank, crew->timeout_s, err);
}

int pt_crew_greet(struct pt_crew *crew, const char *text, struct base_err *err)
{
    double until_s = base_clock_wall_s() + crew->timeout_s;
    for (int met = 1; met < crew->peers->count; met++) {
        int rank = 0;
        void *data = NULL;
        size_t size = 0;
        int got = base_peers_receive(crew->peers, until_s - base_clock_wall_s(), &rank, &data, &size, err);
        if (got < 0)
            return got;
        for (rank = got ? rank : 1; !got && crew->mates[rank].ready;)
            rank++;
        if (!got)
            return lose(crew, err, rank);
        int rc = hear(crew, rank, data, size, text, err);
        free(data);
        if (rc)
            return rc;
    }
    return 0;
}

static int send_end(struct pt_crew *crew, int rank, struct base_err *err)
{
    uint32_t *end = malloc(sizeof *end);
    if (!end)
        return base_fail_nomem(err, "messages");
    *end = PT_CREW_END;
    return base_peers_send(crew->peers, rank, end, sizeof *end, err);
}

/* Everybody answers the end with a last message; what was still on its way comes before it. */
static int part(struct pt_crew *crew)
{
    struct base_err err = {0};
    int rc = 0;
    for (int rank = 1; rank < crew->peers->count && !rc; rank++)
        rc = send_end(crew, rank, &err);
    for (int left = crew->peers->count - 1; left > 0 && !rc;) {
        int rank = 0;
        void *data = NULL;
        size_t size = 0;
        uint32_t kind = PT_CREW_FAILED;
        if (base_peers_receive(crew->peers, crew->timeout_s, &rank, &data, &size, &err) <= 0)
            return BASE_EIO;
        if (size >= sizeof kind)
            memcpy(&kind, data, sizeof kind);
        left -= kind == PT_CREW_BYE;
        free(data);
    }
    return rc;
}

void pt_crew_dismiss(struct pt_crew *crew, int status)
{
    if (!crew)
        return;
    if (crew->lost || part(crew) != 0)
        base_peers_abort(crew->peers, status);
    free(crew->mates);
    free(crew);
}

/* --- parcels -------------------------------------------------------------------------------------------------------- */

int pt_crew_send(struct pt_crew *crew, int rank, void *message, size_t size, struct base_err *err)
{
    struct pt_crew_mate *m = &crew->mates[rank];
    if (m->parcels++ == 0)
        m->since_s = base_clock_wall_s();
    crew->traffic.messages++;
    crew->traffic.bytes += size;
    return base_peers_send(crew->peers, rank, message, size, err);
}

int pt_crew_settle(struct pt_crew *crew, int rank, const void *message, size_t size, struct base_err *err)
{
    struct pt_crew_mate *m = &crew->mates[rank];
    const struct pt_crew_hello *why = message;
    if (size > sizeof *why && why->kind == PT_CREW_FAILED)
        return base_fail(err, BASE_EIO, "%s: %.*s", name_of(crew, rank), (int)(size - sizeof *why), why->text);
    m->parcels--;
    m->since_s = base_clock_wall_s();
    crew->traffic.messages++;
    crew->traffic.bytes += size;
    return size < sizeof(struct pt_crew_rows) ? pt_crew_nonsense(crew, rank, err) : 0;
}

/* mpirun ends every process when one has died: then that is why we are asked to stop. */
int pt_crew_look_round(struct pt_crew *crew, int (*interrupted)(void *data), void *data, struct base_err *err)
{
    double now_s = base_clock_wall_s();
    if (interrupted && interrupted(data)) {
        int rc = base_peers_mourn(crew->peers, err);
        crew->lost = rc != 0;
        return rc ? rc : PT_CREW_STOPPED;
    }
    for (int rank = 1; rank < crew->peers->count; rank++)
        if (crew->mates[rank].parcels > 0 && now_s - crew->mates[rank].since_s > crew->timeout_s)
            return lose(crew, err, rank);
    return 0;
}

/* --- dealing out rows ------------------------------------------------------------------------------------------------ */

static void fail_with(struct sampling *s, int rc)
{
    if (!s->rc)
        s->rc = rc;
    atomic_store(&s->stop, 1);
}

/* The next rows for a member; returns how many, *first is their place in the order. */
static size_t take_rows(struct sampling *s, int member_threads, int all_threads, size_t *first)
{
    size_t at = atomic_load(&s->next), n, count = s->slice->count;
    do {
        if (at >= count)
            return 0;
        n = (count - at) * (size_t)member_threads / (size_t)(SHARES * all_threads);
        size_t least = (size_t)member_threads, most = (size_t)member_threads * MOST_ROWS;
        n = n < least ? least : n > most ? most : n;
        n = n * s->stride > MOST_BYTES ? MOST_BYTES / s->stride + 1 : n;
        n = n < count - at ? n : count - at;
    } while (!atomic_compare_exchange_weak(&s->next, &at, at + n));
    *first = at;
    return n;
}

static int send_rows(struct sampling *s, int rank, size_t first, size_t n)
{
    const struct pt_crew_slice *slice = s->slice;
    size_t size = sizeof(struct pt_crew_rows) + n * sizeof(struct pt_row);
    for (size_t i = 0; i < n; i++)
        size += pt_row_bytes(&slice->rows[slice->order[first + i]], slice->film->planes);
    struct pt_crew_rows *message = malloc(size);
    if (!message)
        return base_fail_nomem(s->err, "messages");
    *message =
        (struct pt_crew_rows){PT_CREW_ROWS, s->crew->serial, slice->film->planes, (uint32_t)n, *slice->maker.integrator};
    unsigned char *sums = (unsigned char *)(message->rows + n);
    for (size_t i = 0; i < n; i++) {
        const struct pt_row *row = &slice->rows[slice->order[first + i]];
        message->rows[i] = *row;
        message->rows[i].place = slice->order[first + i];
        pt_row_save(slice->film, row, sums);
        sums += pt_row_bytes(row, slice->film->planes);
    }
    s->away += n;
    return pt_crew_send(s->crew, rank, message, size, s->err);
}

static void deal(struct sampling *s, int all_threads)
{
    for (int rank = 1; rank < s->crew->peers->count && !atomic_load(&s->stop); rank++) {
        struct pt_crew_mate *m = &s->crew->mates[rank];
        size_t first, n;
        while (m->parcels < PT_CREW_PARCELS && (n = take_rows(s, m->threads, all_threads, &first)) > 0) {
            int rc = send_rows(s, rank, first, n);
            if (rc) {
                fail_with(s, rc);
                return;
            }
        }
    }
}

/* The sums before the slice are kept until its end. */
static void remember(struct sampling *s, uint32_t index)
{
    pt_row_save(s->slice->film, &s->slice->rows[index], s->before + index * s->stride);
    s->begun[index] = 1;
}

/* Does the answer describe rows that were sent? */
static int is_answer(const struct sampling *s, const struct pt_crew_rows *m, size_t size)
{
    size_t wanted = sizeof *m;
    if (size < wanted || m->kind != PT_CREW_ROWS || m->planes != s->slice->film->planes || m->count > s->away ||
        size - wanted < m->count * sizeof(struct pt_row))
        return 0;
    for (uint32_t i = 0; i < m->count; i++) {
        const struct pt_row *theirs = &m->rows[i];
        if (theirs->place >= s->slice->count)
            return 0;
        const struct pt_row *ours = &s->slice->rows[theirs->place];
        if (theirs->y != ours->y || theirs->x0 != ours->x0 || theirs->x1 != ours->x1)
            return 0;
        wanted += sizeof(struct pt_row) + pt_row_bytes(theirs, m->planes);
    }
    return size == wanted;
}

static int take_answer(struct sampling *s, int rank, const struct pt_crew_rows *m, size_t size)
{
    int rc = pt_crew_settle(s->crew, rank, m, size, s->err);
    if (rc || (m->kind == PT_CREW_ROWS && m->serial != s->crew->serial))
        return rc;
    if (!is_answer(s, m, size))
        return pt_crew_nonsense(s->crew, rank, s->err);
    const unsigned char *sums = (const unsigned char *)(m->rows + m->count);
    for (uint32_t i = 0; i < m->count; i++) {
        struct pt_row *row = &s->slice->rows[m->rows[i].place];
        remember(s, m->rows[i].place);
        *row = m->rows[i];
        row->place = 0;
        pt_row_restore(s->slice->film, row, sums);
        sums += pt_row_bytes(row, m->planes);
    }
    s->away -= m->count;
    return 0;
}

/* Takes what has come in, waiting for it up to wait_s, and keeps everybody busy. */
static void attend(struct sampling *s, int all_threads, double wait_s)
{
    for (int got = 1; got > 0 && !atomic_load(&s->stop); wait_s = 0.0) {
        int rank = 0;
        void *data = NULL;
        size_t size = 0;
        got = base_peers_receive(s->crew->peers, wait_s, &rank, &data, &size, s->err);
        if (got > 0)
            got = take_answer(s, rank, data, size) ? -1 : 1;
        free(data);
        if (got < 0)
            fail_with(s, s->err->code);
    }
    int rc = atomic_load(&s->stop) ? 0 : pt_crew_look_round(s->crew, s->slice->interrupted, s->slice->data, s->err);
    if (rc)
        fail_with(s, rc);
    deal(s, all_threads);
}

struct here {
    struct sampling *sampling;
    int all_threads;
};

/* One thread of rank 0 until no rows are left; the first one serves the crew between two rows. */
static void sample_here(void *data, long n, int worker)
{
    struct here *here = data;
    struct sampling *s = here->sampling;
    (void)n;
    for (;;) {
        if (worker == 0 && base_clock_wall_s() >= s->look_s) {
            attend(s, here->all_threads, 0.0);
            s->look_s = base_clock_wall_s() + LOOK_EVERY_S;
        }
        if (atomic_load(&s->stop))
            return;
        size_t at = atomic_fetch_add(&s->next, 1);
        if (at >= s->slice->count)
            return;
        uint32_t index = s->slice->order[at];
        remember(s, index);
        pt_row_sample(&s->slice->maker, s->slice->film, &s->slice->rows[index]);
    }
}

static void undo(struct sampling *s)
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

int pt_crew_sample(struct pt_crew *crew, struct base_threads *threads, const struct pt_crew_slice *slice,
                   struct base_err *err)
{
    struct sampling s = {.crew = crew, .slice = slice, .err = err};
    struct here here = {&s, base_threads_count(threads) + crew->threads};
    for (size_t i = 0; i < slice->count; i++) {
        size_t bytes = pt_row_bytes(&slice->rows[i], slice->film->planes);
        s.stride = bytes > s.stride ? bytes : s.stride;
    }
    s.before = malloc(slice->count * s.stride);
    s.begun = calloc(slice->count, 1);
    if (!s.before || !s.begun) {
        s.rc = base_fail_nomem(err, "rows with the crew");
        goto out;
    }
    crew->serial++;
    base_threads_for(threads, base_threads_count(threads), sample_here, &here);
    double start_s = base_clock_wall_s();
    while (s.away > 0 && !atomic_load(&s.stop))
        attend(&s, here.all_threads, 0.05);
    crew->traffic.waiting_s += base_clock_wall_s() - start_s;
    if (s.rc)
        undo(&s);
out:
    free(s.before);
    free(s.begun);
    return s.rc;
}
