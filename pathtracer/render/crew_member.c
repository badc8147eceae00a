#include "render/crew_member.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "render/crew_messages.h"

/* Waits of the thread that serves while others work, and while nobody does. */
static const double SHORT_WAIT_S = 0.0002, LONG_WAIT_S = 0.05;
/* How often it looks for messages while it samples. */
static const double LOOK_EVERY_S = 0.001;

/* Rows from one message. */
struct parcel {
    struct parcel *next;
    struct pt_crew_rows *rows; /* owns */
    size_t size;
    unsigned char *sums;  /* in rows: of the row that is begun next */
    uint32_t begun, done; /* rows */
};

struct member {
    struct base_peers *peers;
    const struct pt_crew_tools *tools;
    pthread_mutex_t lock;
    pthread_cond_t work;
    struct parcel *first, *last;               /* guarded by lock, with all below: parcels in the order of their arrival */
    int over;                                  /* rank 0 has said so, or something has failed */
    struct pt_crew_ask *asks[PT_CREW_PARCELS]; /* own; blocks to be judged, for which the threads leave the rows */
    int ask_count;
    struct base_err failed;
    double look_s; /* wall time of the next look for messages; of the thread that serves */
};

static int send_text(struct base_peers *peers, uint32_t kind, const struct pt_crew_tools *tools, const char *text,
                     struct base_err *err)
{
    size_t size = sizeof(struct pt_crew_hello) + strlen(text);
    struct pt_crew_hello *hello = malloc(size);
    if (!hello)
        return base_fail_nomem(err, "messages");
    *hello = (struct pt_crew_hello){.kind = kind,
                                    .threads = tools ? (uint32_t)base_threads_count(tools->threads) : 0,
                                    .judges = tools && tools->render && tools->render->criterion};
    memcpy(hello->text, text, strlen(text));
    return base_peers_send(peers, 0, hello, size, err);
}

int pt_crew_member_join(struct base_peers *peers, const struct pt_crew_tools *tools, const char *text, struct base_err *err)
{
    return send_text(peers, PT_CREW_HELLO, tools, text, err);
}

int pt_crew_member_fail(struct base_peers *peers, const struct base_err *why, struct base_err *err)
{
    return send_text(peers, PT_CREW_FAILED, NULL, why->text, err);
}

static void give_up(struct member *m, const struct base_err *why)
{
    pthread_mutex_lock(&m->lock);
    if (!m->failed.code)
        m->failed = *why;
    m->over = 1;
    pthread_cond_broadcast(&m->work);
    pthread_mutex_unlock(&m->lock);
}

/* The next row that nobody has begun; NULL if there is none. Called with the lock held. */
static struct parcel *begin_row(struct member *m, struct pt_row **row, unsigned char **sums)
{
    for (struct parcel *p = m->first; p; p = p->next) {
        if (p->begun == p->rows->count)
            continue;
        *row = &p->rows->rows[p->begun++];
        *sums = p->sums;
        p->sums += pt_row_bytes(*row, p->rows->planes);
        return p;
    }
    return NULL;
}

/* Samples one row in place: in a film of its own, from its sums to its sums. */
static void do_row(struct member *m, struct parcel *p, struct pt_row *row, unsigned char *sums)
{
    struct pt_row_maker maker = m->tools->maker;
    struct pt_film film = {0};
    struct base_err err = {0};
    maker.integrator = &p->rows->integrator;
    if (pt_film_init(&film, row->x0, row->y, row->x1, row->y + 1, p->rows->planes, &err) != 0) {
        give_up(m, &err);
    } else {
        pt_row_restore(&film, row, sums);
        pt_row_sample(&maker, &film, row);
        pt_row_save(&film, row, sums);
        pt_film_release(&film);
    }
    pthread_mutex_lock(&m->lock);
    p->done++;
    pthread_mutex_unlock(&m->lock);
}

/* --- the thread that serves ------------------------------------------------------------------------------------------- */

static int accept(struct member *m, void *data, size_t size, struct base_err *err)
{
    struct parcel *p = calloc(1, sizeof *p);
    if (!p) {
        free(data);
        return base_fail_nomem(err, "rows to be sampled");
    }
    p->rows = data;
    p->size = size;
    p->sums = (unsigned char *)(p->rows->rows + p->rows->count);
    pthread_mutex_lock(&m->lock);
    if (m->last)
        m->last->next = p;
    else
        m->first = p;
    m->last = p;
    pthread_cond_broadcast(&m->work);
    pthread_mutex_unlock(&m->lock);
    return 0;
}

/* Sends back what is finished, in the order of arrival. */
static int send_finished(struct member *m, struct base_err *err)
{
    int rc = 0;
    for (;;) {
        pthread_mutex_lock(&m->lock);
        struct parcel *p = m->first;
        int finished = p && p->done == p->rows->count && !m->failed.code;
        if (finished) {
            m->first = p->next;
            m->last = m->first ? m->last : NULL;
        }
        pthread_mutex_unlock(&m->lock);
        if (!finished || rc)
            return rc;
        rc = base_peers_send(m->peers, 0, p->rows, p->size, err);
        free(p);
    }
}

/* Something for all threads: an end, or blocks to be judged. */
static void call_off(struct member *m, int over, struct pt_crew_ask *ask)
{
    pthread_mutex_lock(&m->lock);
    m->over |= over;
    if (ask)
        m->asks[m->ask_count++] = ask;
    pthread_cond_broadcast(&m->work);
    pthread_mutex_unlock(&m->lock);
}

static int receive(struct member *m, double wait_s, struct base_err *err)
{
    int got = 1, rc = 0;
    for (; got > 0 && !rc; wait_s = 0.0) {
        int rank = 0;
        uint32_t kind = PT_CREW_END;
        void *data = NULL;
        size_t size = 0;
        got = base_peers_receive(m->peers, wait_s, &rank, &data, &size, err);
        if (got > 0 && size >= sizeof kind)
            memcpy(&kind, data, sizeof kind);
        if (got < 0) {
            rc = got;
        } else if (got > 0 && kind == PT_CREW_ROWS) {
            rc = accept(m, data, size, err);
        } else if (got > 0 && kind == PT_CREW_ASK && m->ask_count < PT_CREW_PARCELS) {
            call_off(m, 0, data);
        } else if (got > 0) {
            free(data);
            call_off(m, kind == PT_CREW_END, NULL);
            got = kind != PT_CREW_END;
        }
    }
    return rc;
}

static void serve_now(struct member *m, double wait_s)
{
    struct base_err err = {0};
    if (send_finished(m, &err) != 0 || receive(m, wait_s, &err) != 0)
        give_up(m, &err);
}

/* One thread until the end or until there are blocks to be judged; the first one serves between two rows. */
static void work(void *data, long n, int worker)
{
    struct member *m = data;
    (void)n;
    for (int over = 0; !over;) {
        struct pt_row *row = NULL;
        unsigned char *sums = NULL;
        if (worker == 0 && base_clock_wall_s() >= m->look_s) {
            serve_now(m, 0.0);
            m->look_s = base_clock_wall_s() + LOOK_EVERY_S;
        }
        pthread_mutex_lock(&m->lock);
        struct parcel *p = m->over ? NULL : begin_row(m, &row, &sums);
        while (!p && !m->over && m->ask_count == 0 && worker > 0) {
            pthread_cond_wait(&m->work, &m->lock);
            p = m->over ? NULL : begin_row(m, &row, &sums);
        }
        double wait_s = m->first ? SHORT_WAIT_S : LONG_WAIT_S;
        over = m->over || (!p && m->ask_count > 0);
        pthread_mutex_unlock(&m->lock);
        if (p)
            do_row(m, p, row, sums);
        else if (!over)
            serve_now(m, wait_s);
    }
}

/* Puts the blocks into the film and asks; the message becomes the answer. */
static void judge(const struct pt_crew_tools *tools, struct pt_crew_ask *ask)
{
    struct pt_render *r = tools->render;
    const unsigned char *sums = (const unsigned char *)(ask->blocks + ask->count);
    double start_s = base_clock_process_s();
    for (uint32_t k = 0; k < ask->count; k++) {
        const struct lull_host_block *b = &ask->blocks[k].block;
        r->blocks->list[ask->blocks[k].index] = *b;
        for (int y = b->y0; y < b->y1; y++) {
            struct pt_row row = {.y = y, .x0 = b->x0, .x1 = b->x1};
            pt_row_restore(&r->film, &row, sums);
            sums += pt_row_bytes(&row, r->film.planes);
        }
    }
    struct base_err err = {0};
    uint32_t *due = calloc(ask->count, sizeof *due);
    uint8_t *final = calloc(ask->count, sizeof *final);
    struct lull_decision *decisions = calloc(ask->count, sizeof *decisions);
    for (uint32_t k = 0; k < ask->count && due && final; k++) {
        due[k] = ask->blocks[k].index;
        final[k] = (uint8_t)ask->blocks[k].final;
    }
    if (!due || !final || !decisions)
        base_fail_nomem(&err, "blocks to be judged");
    else if (pt_criterion_evaluate(r->criterion, r->frame, &r->film, due, ask->count, final, decisions, &err) == 0)
        for (uint32_t k = 0; k < ask->count; k++)
            ask->blocks[k].decision = decisions[k];
    snprintf(ask->error, sizeof ask->error, "%s", err.text);
    ask->thread_s = base_clock_process_s() - start_s;
    free(due);
    free(final);
    free(decisions);
}

static void answer(struct member *m)
{
    struct base_err err = {0};
    for (int i = 0; i < m->ask_count; i++) {
        struct pt_crew_ask *ask = m->asks[i];
        judge(m->tools, ask);
        if (base_peers_send(m->peers, 0, ask, sizeof *ask + ask->count * sizeof(struct pt_crew_block), &err) != 0)
            give_up(m, &err);
    }
    m->ask_count = 0;
}

/* The end is awaited also after a failure: rank 0 says when nobody needs anybody any more. */
static int say_goodbye(struct base_peers *peers, int over, struct base_err *err)
{
    while (!over) {
        int rank = 0;
        uint32_t kind = PT_CREW_END;
        void *data = NULL;
        size_t size = 0;
        int got = base_peers_receive(peers, LONG_WAIT_S, &rank, &data, &size, err);
        if (got < 0)
            return got;
        if (got > 0 && size >= sizeof kind)
            memcpy(&kind, data, sizeof kind);
        over = got > 0 && kind == PT_CREW_END;
        free(data);
    }
    uint32_t *bye = malloc(sizeof *bye);
    if (!bye)
        return base_fail_nomem(err, "messages");
    *bye = PT_CREW_BYE;
    return base_peers_send(peers, 0, bye, sizeof *bye, err);
}

int pt_crew_member_serve(struct base_peers *peers, const struct pt_crew_tools *tools, struct base_err *err)
{
    struct member m = {.peers = peers, .tools = tools};
    struct base_err unheard = {0};
    int rc = 0;
    if (!tools)
        return say_goodbye(peers, 0, err);
    pthread_mutex_init(&m.lock, NULL);
    pthread_cond_init(&m.work, NULL);
    while (!m.over) {
        base_threads_for(tools->threads, base_threads_count(tools->threads), work, &m);
        answer(&m);
    }
    while (m.first) {
        struct parcel *p = m.first;
        m.first = p->next;
        free(p->rows);
        free(p);
    }
    if (m.failed.code) {
        rc = base_fail(err, m.failed.code, "%s", m.failed.text);
        pt_crew_member_fail(peers, &m.failed, &unheard);
    }
    pthread_cond_destroy(&m.work);
    pthread_mutex_destroy(&m.lock);
    return say_goodbye(peers, !m.failed.code, rc ? &unheard : err) != 0 && !rc ? err->code : rc;
}
