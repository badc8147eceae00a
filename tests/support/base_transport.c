#include "support/base_transport.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

struct message {
    struct message *next;
    int from;
    void *data;
    size_t size;
};

struct end {
    struct job_transport face; /* first */
    struct base_transport *all;
    struct message *first, *last; /* guarded by the lock of all, with all below */
};

struct base_transport {
    pthread_mutex_t lock;
    pthread_cond_t arrival;
    struct job_process list[BASE_TRANSPORT_MAX];
    struct end ends[BASE_TRANSPORT_MAX];
    int count, aborted;
    void (*nothing_came)(void *data); /* of rank 0, with data; NULL: nobody listens */
    void *data;
};

static int send_message(struct job_transport *face, int rank, void *data, size_t size, struct base_err *err)
{
    struct base_transport *all = ((struct end *)face)->all;
    struct end *to = &all->ends[rank];
    struct message *message = malloc(sizeof *message);
    if (!message) {
        free(data);
        return base_fail_nomem(err, "messages");
    }
    *message = (struct message){NULL, face->rank, data, size};
    pthread_mutex_lock(&all->lock);
    if (to->first)
        to->last->next = message;
    else
        to->first = message;
    to->last = message;
    pthread_cond_broadcast(&all->arrival);
    pthread_mutex_unlock(&all->lock);
    return 0;
}

static int receive_message(struct job_transport *face, double wait_s, int *rank, void **data, size_t *size,
                           struct base_err *err)
{
    struct end *end = (struct end *)face;
    struct base_transport *all = end->all;
    struct timespec until;
    (void)err;
    clock_gettime(CLOCK_REALTIME, &until);
    long ns = until.tv_nsec + (long)((wait_s > 0.0 ? wait_s : 0.0) * 1e9);
    until.tv_sec += ns / 1000000000;
    until.tv_nsec = ns % 1000000000;
    pthread_mutex_lock(&all->lock);
    while (!end->first && wait_s > 0.0 && pthread_cond_timedwait(&all->arrival, &all->lock, &until) == 0)
        continue;
    struct message *message = end->first;
    if (message)
        end->first = message->next;
    pthread_mutex_unlock(&all->lock);
    if (!message && face->rank == 0 && all->nothing_came)
        all->nothing_came(all->data);
    if (!message)
        return 0;
    *rank = message->from;
    *data = message->data;
    *size = message->size;
    free(message);
    return 1;
}

static void leave(struct job_transport *face) { (void)face; }

static void count_abort(struct job_transport *face, int status)
{
    struct base_transport *all = ((struct end *)face)->all;
    (void)status;
    pthread_mutex_lock(&all->lock);
    all->aborted++;
    pthread_mutex_unlock(&all->lock);
}

struct base_transport *base_transport_create(int count)
{
    static const struct job_transport_calls calls = {
        .send = send_message, .receive = receive_message, .close = leave, .abort = count_abort};
    struct base_transport *all = calloc(1, sizeof *all);
    if (!all)
        return NULL;
    pthread_mutex_init(&all->lock, NULL);
    pthread_cond_init(&all->arrival, NULL);
    all->count = count;
    for (int i = 0; i < count; i++) {
        all->list[i] = (struct job_process){"here", (long)getpid(), ""};
        snprintf(all->list[i].name, sizeof all->list[i].name, "rank %d on host here", i);
        all->ends[i] = (struct end){.face = {i, count, all->list, &calls}, .all = all};
    }
    return all;
}

struct job_transport *base_transport_of(struct base_transport *all, int rank) { return &all->ends[rank].face; }

struct job_process *base_transport_process(struct base_transport *all, int rank) { return &all->list[rank]; }

int base_transport_aborted(struct base_transport *all)
{
    pthread_mutex_lock(&all->lock);
    int n = all->aborted;
    pthread_mutex_unlock(&all->lock);
    return n;
}

void base_transport_listen(struct base_transport *all, void (*nothing_came)(void *data), void *data)
{
    all->nothing_came = nothing_came;
    all->data = data;
}

void base_transport_destroy(struct base_transport *all)
{
    for (int i = 0; i < all->count; i++)
        while (all->ends[i].first) {
            struct message *message = all->ends[i].first;
            all->ends[i].first = message->next;
            free(message->data);
            free(message);
        }
    pthread_cond_destroy(&all->arrival);
    pthread_mutex_destroy(&all->lock);
    free(all);
}
