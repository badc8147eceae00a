#include "job/farm.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "job/message.h"

/* Items per thread in one task, and what share of those left: few enough that nobody is left with many at the end. */
enum { MOST_ITEMS = 32, SHARES = 4 };
static const size_t MOST_BYTES = (size_t)64 << 20; /* of a task, unless one item weighs more */

/* How often a thread that works looks for messages; waits of one that does not, while others work and while nobody does. */
static const double LOOK_EVERY_S = 0.001, SHORT_WAIT_S = 0.0002, LONG_WAIT_S = 0.05;

struct farming {
    struct job *job;
    const struct job_farm *farm;
    int threads;        /* of rank 0 */
    atomic_size_t next; /* item */
    atomic_int stop;
    uint32_t away; /* items with workers */
    double look_s; /* wall time of the next look for messages */
    pthread_mutex_t lock;
    struct base_err failed; /* guarded by lock: what failed here */
};

static size_t at_most(size_t n, size_t most) { return n < most ? n : most; }

/* The next items for a process of so many threads; returns how many. */
static size_t take(struct farming *f, int threads, size_t *first)
{
    const struct job_farm *farm = f->farm;
    const size_t weight = farm->item_bytes > farm->answer_bytes ? farm->item_bytes : farm->answer_bytes;
    const size_t least = farm->whole ? 1 : (size_t)threads;
    const size_t most = (size_t)threads * (farm->whole ? 1 : MOST_ITEMS);
    size_t at = atomic_load(&f->next), n;
    do {
        if (at >= farm->count)
            return 0;
        n = (farm->count - at) * (size_t)threads / (size_t)(SHARES * (f->threads + f->job->threads));
        n = n < least ? least : at_most(n, most);
        n = at_most(n, weight ? MOST_BYTES / weight + 1 : n);
        n = at_most(n, farm->count - at);
    } while (!atomic_compare_exchange_weak(&f->next, &at, at + n));
    *first = at;
    return n;
}

static int send_task(struct farming *f, int rank, size_t first, size_t n)
{
    const struct job_farm *farm = f->farm;
    struct job_worker *w = &f->job->workers[rank];
    const size_t size = sizeof(struct job_task) + farm->common_bytes + n * farm->item_bytes;
    struct job_task *task = malloc(size);
    if (!task)
        return base_fail_nomem(&f->job->failed, "messages");
    *task = (struct job_task){.kind = JOB_TASK,
                              .serial = f->job->serial,
                              .whole = farm->whole != 0,
                              .first = (uint32_t)first,
                              .count = (uint32_t)n,
                              .common_bytes = farm->common_bytes,
                              .item_bytes = farm->item_bytes,
                              .answer_bytes = farm->answer_bytes};
    if (farm->common_bytes > 0)
        memcpy(task->bytes, farm->common, farm->common_bytes);
    for (size_t k = 0; k < n && farm->item_bytes > 0; k++)
        farm->pack(farm->data, (uint32_t)(first + k), job_task_item(task, (uint32_t)k));
    if (w->held_count == 0)
        w->since_s = base_clock_wall_s();
    w->held[w->held_count++] = (struct job_held){(uint32_t)first, (uint32_t)n, f->job->serial};
    f->away += (uint32_t)n;
    return job_send(f->job, rank, task, size);
}

/* A second task only where there is a first one for everybody. */
static int has_room(const struct farming *f, const struct job_worker *w)
{
    size_t next = atomic_load(&f->next), left = next < f->farm->count ? f->farm->count - next : 0;
    return w->held_count == 0 || (w->held_count < JOB_HELD && (!f->farm->whole || left > (size_t)f->job->transport->count));
}

static void deal(struct farming *f)
{
    size_t first, n;
    for (int rank = 1; rank < f->job->transport->count; rank++) {
        const struct job_worker *w = &f->job->workers[rank];
        while (!atomic_load(&f->stop) && has_room(f, w) && (n = take(f, w->threads, &first)) > 0)
            if (send_task(f, rank, first, n))
                atomic_store(&f->stop, 1);
    }
}

static int apply(struct farming *f, const struct job_mail *mail)
{
    const struct job_task *answer = (const struct job_task *)mail->message;
    const int rank = mail->rank;
    struct job_worker *w = &f->job->workers[rank];
    const struct job_held held = w->held[0];
    if (answer->kind != JOB_ANSWER || mail->size < sizeof *answer || w->held_count == 0 || answer->serial != held.serial ||
        answer->first != held.first || answer->count != held.count)
        return job_nonsense(f->job, rank);
    w->held[0] = w->held[1];
    w->held_count--;
    w->since_s = base_clock_wall_s();
    if (held.serial != f->job->serial) /* of a farm that was given up */
        return 0;
    if (mail->size != sizeof *answer + answer->count * f->farm->answer_bytes)
        return job_nonsense(f->job, rank);
    for (uint32_t k = 0; k < answer->count && f->farm->apply; k++)
        if (f->farm->apply(f->farm->data, held.first + k, answer->bytes + k * f->farm->answer_bytes))
            return job_nonsense(f->job, rank);
    f->away -= answer->count;
    return 0;
}

static int look_round(struct farming *f)
{
    struct job *job = f->job;
    const double now_s = base_clock_wall_s();
    if (job->interrupted && *job->interrupted)
        return job_find_dead(job) ? job->failed.code : JOB_STOPPED;
    for (int rank = 1; rank < job->transport->count && !job->failed.code; rank++)
        if (job->workers[rank].held_count > 0)
            job_give_up(job, rank, now_s - job->workers[rank].since_s);
    return job->failed.code;
}

/* Applies what has come in, waiting for it up to wait_s, and keeps everybody busy. */
static void attend(struct farming *f, double wait_s)
{
    for (int got = 1; got > 0; wait_s = 0.0) {
        struct job_mail mail;
        got = job_receive(f->job, wait_s, &mail);
        if (got > 0) {
            got = apply(f, &mail) ? -1 : 1;
            free(mail.message);
        }
    }
    if (look_round(f))
        atomic_store(&f->stop, 1);
    deal(f);
}

static void do_here(struct farming *f, size_t first, size_t n, int thread)
{
    struct base_err err = {0};
    if (f->farm->here(f->farm->data, (uint32_t)first, (uint32_t)n, thread, &err) == 0)
        return;
    pthread_mutex_lock(&f->lock);
    if (!f->failed.code)
        f->failed = err;
    pthread_mutex_unlock(&f->lock);
    atomic_store(&f->stop, 1);
}

/* One thread of rank 0 until no items are left; the first one serves the workers between two items. */
static void work_here(void *data, long index, int thread)
{
    struct farming *f = data;
    (void)index;
    while (!atomic_load(&f->stop)) {
        if (thread == 0 && f->job && base_clock_wall_s() >= f->look_s) {
            attend(f, 0.0);
            f->look_s = base_clock_wall_s() + LOOK_EVERY_S;
        }
        size_t at = atomic_fetch_add(&f->next, 1);
        if (at >= f->farm->count)
            return;
        do_here(f, at, 1, thread);
    }
}

/* Tasks that need all threads. */
static void work_whole(struct farming *f)
{
    size_t first;
    for (size_t n = 1; n > 0 && !atomic_load(&f->stop);) {
        attend(f, 0.0);
        n = take(f, f->threads, &first);
        if (n > 0)
            do_here(f, first, n, 0);
    }
}

int job_farm_run(struct job *job, struct base_threads *threads, const struct job_farm *farm, struct base_err *err)
{
    struct farming f = {.job = job, .farm = farm, .threads = base_threads_count(threads)};
    if (job_failed(job, err))
        return job->failed.code;
    pthread_mutex_init(&f.lock, NULL);
    if (job)
        job->serial++;
    if (farm->whole && job)
        work_whole(&f);
    else if (farm->whole)
        do_here(&f, 0, farm->count, 0);
    else
        base_threads_for(threads, f.threads, work_here, &f);
    const double start_s = base_clock_wall_s();
    while (f.away > 0 && !atomic_load(&f.stop))
        attend(&f, LONG_WAIT_S);
    if (job)
        job->traffic.waiting_s += base_clock_wall_s() - start_s;
    pthread_mutex_destroy(&f.lock);
    if (job_failed(job, err))
        return job->failed.code;
    if (f.failed.code)
        return base_fail(err, f.failed.code, "%s", f.failed.text);
    return atomic_load(&f.stop) ? JOB_STOPPED : 0;
}

/* A task on its way through a worker. */
struct queued {
    struct job_task *task, *answer; /* own */
    uint32_t begun, done;           /* items */
};

struct serving {
    struct job *job;
    const struct job_service *service;
    pthread_mutex_t lock;
    pthread_cond_t work;
    struct queued queue[JOB_HELD]; /* guarded by lock, with all below: tasks in the order of their arrival, a ring */
    uint32_t first, count;
    int over; /* by a message of rank 0, or something has failed */
    struct base_err failed;
    double look_s; /* wall time of the next look for messages; of the thread that serves */
};

static struct queued *queued(struct serving *s, uint32_t k) { return &s->queue[(s->first + k) % JOB_HELD]; }

static void give_up(struct serving *s, const struct base_err *why)
{
    pthread_mutex_lock(&s->lock);
    if (!s->failed.code)
        s->failed = *why;
    s->over = 1;
    pthread_cond_broadcast(&s->work);
    pthread_mutex_unlock(&s->lock);
}

static void do_items(struct serving *s, struct queued *q, uint32_t k, uint32_t n, int thread)
{
    struct base_err err = {0};
    unsigned char *answer = q->answer->bytes + k * q->task->answer_bytes;
    if (s->service->work(s->service->data, q->task, k, n, answer, thread, &err))
        give_up(s, &err);
    pthread_mutex_lock(&s->lock);
    q->done += n;
    pthread_mutex_unlock(&s->lock);
}

/* Takes the message over unless it fails. */
static int accept(struct serving *s, const struct job_mail *mail)
{
    struct job_task *task = (struct job_task *)mail->message;
    if (mail->size < sizeof *task || s->count == JOB_HELD ||
        mail->size != sizeof *task + task->common_bytes + task->count * task->item_bytes)
        return job_nonsense(s->job, 0);
    struct job_task *answer = malloc(sizeof *answer + task->count * task->answer_bytes);
    if (!answer)
        return base_fail_nomem(&s->job->failed, "a task");
    *answer = *task;
    answer->kind = JOB_ANSWER;
    pthread_mutex_lock(&s->lock);
    *queued(s, s->count++) = (struct queued){.task = task, .answer = answer};
    pthread_cond_broadcast(&s->work);
    pthread_mutex_unlock(&s->lock);
    return 0;
}

/* Sends back what is finished, in the order of arrival. */
static int send_finished(struct serving *s)
{
    for (int rc = 0;;) {
        pthread_mutex_lock(&s->lock);
        const struct queued q = *queued(s, 0);
        const int finished = s->count > 0 && q.done == q.task->count && !s->failed.code;
        if (finished) {
            s->first++;
            s->count--;
            pthread_cond_broadcast(&s->work);
        }
        pthread_mutex_unlock(&s->lock);
        if (!finished || rc)
            return rc;
        rc = job_send(s->job, 0, q.answer, sizeof *q.answer + q.task->count * q.task->answer_bytes);
        free(q.task);
    }
}

/* Takes what has come in, waiting for it up to wait_s. */
static int receive(struct serving *s, double wait_s)
{
    int got = 1, over = 0;
    for (; got > 0 && !over; wait_s = 0.0) {
        struct job_mail mail;
        got = job_receive(s->job, wait_s, &mail);
        if (got <= 0 || (mail.message->kind == JOB_TASK && accept(s, &mail) == 0))
            continue;
        over = mail.message->kind == JOB_DONE || s->job->failed.code || job_nonsense(s->job, 0);
        free(mail.message);
    }
    pthread_mutex_lock(&s->lock);
    s->over |= over || s->job->over;
    if (s->over)
        pthread_cond_broadcast(&s->work);
    pthread_mutex_unlock(&s->lock);
    return s->job->failed.code;
}

/* After the end of the farm messages are for others. */
static void serve_now(struct serving *s, double wait_s)
{
    pthread_mutex_lock(&s->lock);
    const int over = s->over;
    pthread_mutex_unlock(&s->lock);
    if (over)
        return;
    if (send_finished(s) != 0 || receive(s, wait_s) != 0)
        give_up(s, &s->job->failed);
}

/* The next item that nobody has begun, *k of a task; NULL if there is none. Called with the lock held. */
static struct queued *begin_item(struct serving *s, uint32_t *k)
{
    for (uint32_t i = 0; i < s->count && !s->over; i++) {
        struct queued *q = queued(s, i);
        if (q->task->whole)
            break;
        if (q->begun < q->task->count) {
            *k = q->begun++;
            return q;
        }
    }
    return NULL;
}

/* Is there no more to do for single threads? Called with the lock held. */
static int is_done(struct serving *s) { return s->over || (s->count > 0 && queued(s, 0)->task->whole); }

/* One thread until the end or until there is a task for all; the first one serves between two items. */
static void work(void *data, long n, int thread)
{
    struct serving *s = data;
    (void)n;
    for (int done = 0; !done;) {
        uint32_t k;
        if (thread == 0 && base_clock_wall_s() >= s->look_s) {
            serve_now(s, 0.0);
            s->look_s = base_clock_wall_s() + LOOK_EVERY_S;
        }
        pthread_mutex_lock(&s->lock);
        struct queued *q = begin_item(s, &k);
        while (!q && !is_done(s) && thread > 0) {
            pthread_cond_wait(&s->work, &s->lock);
            q = begin_item(s, &k);
        }
        const double wait_s = s->count > 0 ? SHORT_WAIT_S : LONG_WAIT_S;
        done = !q && is_done(s);
        pthread_mutex_unlock(&s->lock);
        if (q)
            do_items(s, q, k, 1, thread);
        else if (!done)
            serve_now(s, wait_s);
    }
}

int job_serve(struct job *job, struct base_threads *threads, const struct job_service *service, struct base_err *err)
{
    struct serving s = {.job = job, .service = service};
    if (job_failed(job, err))
        return job->failed.code;
    pthread_mutex_init(&s.lock, NULL);
    pthread_cond_init(&s.work, NULL);
    while (!s.over) {
        base_threads_for(threads, base_threads_count(threads), work, &s);
        if (!s.over) {
            do_items(&s, queued(&s, 0), 0, queued(&s, 0)->task->count, 0);
            serve_now(&s, 0.0);
        }
    }
    for (uint32_t k = 0; k < s.count; k++) {
        free(queued(&s, k)->task);
        free(queued(&s, k)->answer);
    }
    pthread_cond_destroy(&s.work);
    pthread_mutex_destroy(&s.lock);
    return s.failed.code ? base_fail(err, s.failed.code, "%s", s.failed.text) : 0;
}

int job_share(struct job *job, struct base_threads *threads, const struct job_farm *farm, const struct job_service *service,
              struct base_err *err)
{
    if (job_rank(job) > 0) {
        int rc = job_serve(job, threads, service, err);
        return rc || !job->over ? rc : base_fail(err, BASE_EIO, "rank 0 has ended"); /* it says why */
    }
    int rc = job_farm_run(job, threads, farm, err);
    for (int rank = 1; rank < job_count(job) && !rc; rank++)
        rc = job_send_head(job, rank, JOB_DONE, job->serial);
    return rc;
}
