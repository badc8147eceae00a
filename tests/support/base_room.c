#include "support/base_room.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

struct letter {
    struct letter *next;
    int from;
    void *data;
    size_t size;
};

struct seat {
    struct base_peers face; /* first */
    struct base_room *room;
    struct letter *first, *last; /* guarded by the room's lock */
};

struct base_room {
    pthread_mutex_t lock;
    pthread_cond_t arrival;
    struct base_peer list[BASE_ROOM_MAX];
    struct seat seats[BASE_ROOM_MAX];
    int count, aborted, in_vain;
};

static int post(struct base_peers *face, int rank, void *data, size_t size, struct base_err *err)
{
    struct base_room *room = ((struct seat *)face)->room;
    struct seat *to = &room->seats[rank];
    struct letter *letter = malloc(sizeof *letter);
    if (!letter) {
        free(data);
        return base_fail_nomem(err, "letters");
    }
    *letter = (struct letter){NULL, face->rank, data, size};
    pthread_mutex_lock(&room->lock);
    if (to->first)
        to->last->next = letter;
    else
        to->first = letter;
    to->last = letter;
    pthread_cond_broadcast(&room->arrival);
    pthread_mutex_unlock(&room->lock);
    return 0;
}

static int collect(struct base_peers *face, double wait_s, int *rank, void **data, size_t *size, struct base_err *err)
{
    struct seat *seat = (struct seat *)face;
    struct base_room *room = seat->room;
    struct timespec until;
    (void)err;
    clock_gettime(CLOCK_REALTIME, &until);
    long ns = until.tv_nsec + (long)((wait_s > 0.0 ? wait_s : 0.0) * 1e9);
    until.tv_sec += ns / 1000000000;
    until.tv_nsec = ns % 1000000000;
    pthread_mutex_lock(&room->lock);
    while (!seat->first && wait_s > 0.0 && pthread_cond_timedwait(&room->arrival, &room->lock, &until) == 0)
        continue;
    struct letter *letter = seat->first;
    if (letter)
        seat->first = letter->next;
    else
        room->in_vain += wait_s > 0.0;
    pthread_mutex_unlock(&room->lock);
    if (!letter)
        return 0;
    *rank = letter->from;
    *data = letter->data;
    *size = letter->size;
    free(letter);
    return 1;
}

static void leave(struct base_peers *face) { (void)face; }

static void count_abort(struct base_peers *face, int status)
{
    struct base_room *room = ((struct seat *)face)->room;
    (void)status;
    pthread_mutex_lock(&room->lock);
    room->aborted++;
    pthread_mutex_unlock(&room->lock);
}

static const char *version(void) { return "threads"; }

struct base_room *base_room_create(int count)
{
    static const struct base_peers_calls calls = {post, collect, leave, count_abort, version};
    struct base_room *room = calloc(1, sizeof *room);
    if (!room)
        return NULL;
    pthread_mutex_init(&room->lock, NULL);
    pthread_cond_init(&room->arrival, NULL);
    room->count = count;
    for (int i = 0; i < count; i++) {
        room->list[i] = (struct base_peer){"here", (long)getpid(), ""};
        snprintf(room->list[i].name, sizeof room->list[i].name, "rank %d on host here", i);
        room->seats[i] = (struct seat){.face = {i, count, room->list, &calls, NULL}, .room = room};
    }
    return room;
}

struct base_peers *base_room_of(struct base_room *room, int rank) { return &room->seats[rank].face; }

int base_room_aborted(struct base_room *room)
{
    pthread_mutex_lock(&room->lock);
    int n = room->aborted;
    pthread_mutex_unlock(&room->lock);
    return n;
}

int base_room_in_vain(struct base_room *room)
{
    pthread_mutex_lock(&room->lock);
    int n = room->in_vain;
    pthread_mutex_unlock(&room->lock);
    return n;
}

void base_room_destroy(struct base_room *room)
{
    for (int i = 0; i < room->count; i++)
        while (room->seats[i].first) {
            struct letter *letter = room->seats[i].first;
            room->seats[i].first = letter->next;
            free(letter->data);
            free(letter);
        }
    pthread_cond_destroy(&room->arrival);
    pthread_mutex_destroy(&room->lock);
    free(room);
}
