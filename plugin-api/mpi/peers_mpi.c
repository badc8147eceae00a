#include "mpi/peers_mpi.h"

#include <limits.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"

/* Waiting sleeps, and longer the longer it lasts: MPI would spin, which costs a processor where there are fewer of them than
 * processes. */
static const long FIRST_NAP_NS = 20000, LONGEST_NAP_NS = 500000;

/* A message on its way; its memory is free once MPI has it. */
struct parcel {
    MPI_Request request;
    void *data;
};

/* One that has begun to come. Its rest may never: its sender may hang half way, and who waits must be able to give up. */
struct arrival {
    MPI_Request request;
    void *data; /* owns; NULL: nothing is coming */
    int rank, size;
};

struct peers {
    struct base_peers face; /* first: what callers see */
    struct base_peer *list; /* owns; [count] */
    MPI_Comm world;
    struct parcel *sent; /* owns; [room] */
    size_t count, room;
    struct arrival coming;
};

static void forget_sent(struct peers *p)
{
    size_t left = 0;
    for (size_t i = 0; i < p->count; i++) {
        int done = 0;
        MPI_Test(&p->sent[i].request, &done, MPI_STATUS_IGNORE);
        if (done)
            free(p->sent[i].data);
        else
            p->sent[left++] = p->sent[i];
    }
    p->count = left;
}

static int send_parcel(struct base_peers *face, int rank, void *data, size_t size, struct base_err *err)
{
    struct peers *p = (struct peers *)face;
    forget_sent(p);
    if (p->count == p->room) {
        size_t room = p->room ? 2 * p->room : 16;
        struct parcel *grown = realloc(p->sent, room * sizeof *grown);
        if (!grown) {
            free(data);
            return base_fail_nomem(err, "messages");
        }
        p->sent = grown;
        p->room = room;
    }
    struct parcel *parcel = &p->sent[p->count];
    parcel->data = data;
    if (size > INT_MAX || MPI_Isend(data, (int)size, MPI_BYTE, rank, 0, p->world, &parcel->request) != MPI_SUCCESS) {
        free(data);
        return base_fail(err, BASE_EIO, "cannot send %zu bytes to %s", size, face->list[rank].name);
    }
    p->count++;
    return 0;
}

static int begin_to_take(struct peers *p, MPI_Message *message, const MPI_Status *status, struct base_err *err)
{
    struct arrival a = {.rank = status->MPI_SOURCE};
    MPI_Get_count(status, MPI_BYTE, &a.size);
    a.data = malloc(a.size > 0 ? (size_t)a.size : 1);
    if (!a.data)
        return base_fail_nomem(err, "messages");
    if (MPI_Imrecv(a.data, a.size, MPI_BYTE, message, &a.request) != MPI_SUCCESS) {
        free(a.data);
        return base_fail(err, BASE_EIO, "cannot receive from %s", p->face.list[a.rank].name);
    }
    p->coming = a;
    return 0;
}

/* Looks once: 1 when a whole message is there, which p->coming then holds, 0 not yet. */
static int look(struct peers *p, struct base_err *err)
{
    int there = 0;
    MPI_Message message;
    MPI_Status status;
    forget_sent(p);
    if (!p->coming.data) {
        if (MPI_Improbe(MPI_ANY_SOURCE, 0, p->world, &there, &message, &status) != MPI_SUCCESS)
            return base_fail(err, BASE_EIO, "MPI has lost the other processes");
        int rc = there ? begin_to_take(p, &message, &status, err) : 0;
        if (rc || !there)
            return rc;
    }
    if (MPI_Test(&p->coming.request, &there, MPI_STATUS_IGNORE) != MPI_SUCCESS)
        return base_fail(err, BASE_EIO, "cannot receive from %s", p->face.list[p->coming.rank].name);
    return there != 0;
}

static int receive_parcel(struct base_peers *face, double wait_s, int *rank, void **data, size_t *size, struct base_err *err)
{
    struct peers *p = (struct peers *)face;
    double until_s = base_clock_wall_s() + wait_s;
    for (long nap_ns = FIRST_NAP_NS;; nap_ns = nap_ns < LONGEST_NAP_NS ? 2 * nap_ns : nap_ns) {
        int rc = look(p, err);
        if (rc > 0) {
            *rank = p->coming.rank;
            *data = p->coming.data;
            *size = (size_t)p->coming.size;
            p->coming.data = NULL;
        }
        if (rc != 0 || base_clock_wall_s() >= until_s)
            return rc;
        nanosleep(&(struct timespec){.tv_nsec = nap_ns}, NULL);
    }
}

static void release(struct peers *p)
{
    free(p->sent);
    free(p->list);
    free(p);
}

static void close_all(struct base_peers *face)
{
    struct peers *p = (struct peers *)face;
    while (p->count > 0) {
        forget_sent(p);
        nanosleep(&(struct timespec){.tv_nsec = FIRST_NAP_NS}, NULL);
    }
    MPI_Comm_free(&p->world);
    MPI_Finalize();
    release(p);
}

static void abort_all(struct base_peers *face, int status)
{
    (void)face;
    MPI_Abort(MPI_COMM_WORLD, status);
}

const char *base_peers_version_mpi(void)
{
    static char text[MPI_MAX_LIBRARY_VERSION_STRING];
    int n = 0;
    MPI_Get_library_version(text, &n); /* allowed before MPI_Init */
    text[strcspn(text, ",\n")] = '\0';
    return text;
}

/* Everybody tells everybody who he is. */
static int introduce(struct peers *p, struct base_err *err)
{
    static const struct base_peers_calls calls = {send_parcel, receive_parcel, close_all, abort_all, base_peers_version_mpi};
    struct base_peer self = {.pid = (long)getpid()};
    MPI_Comm_rank(p->world, &p->face.rank);
    MPI_Comm_size(p->world, &p->face.count);
    if (gethostname(self.host, sizeof self.host - 1) != 0)
        snprintf(self.host, sizeof self.host, "unknown");
    snprintf(self.name, sizeof self.name, "rank %d on host %s (process %ld)", p->face.rank, self.host, self.pid);
    p->list = calloc((size_t)p->face.count, sizeof *p->list);
    if (!p->list)
        return base_fail_nomem(err, "list of processes");
    p->face.list = p->list;
    p->face.calls = &calls;
    MPI_Allgather(&self, sizeof self, MPI_BYTE, p->list, sizeof self, MPI_BYTE, p->world);
    return 0;
}

int base_peers_open_mpi(struct base_peers **out, struct base_err *err)
{
    int provided = 0;
    struct peers *p = calloc(1, sizeof *p);
    if (!p)
        return base_fail_nomem(err, "list of processes");
    /* Open MPI gives up the processor at every look for messages where there are fewer processors than processes, also on
     * behalf of a process that has other work to do. Who waits here sleeps; who works goes on. */
    setenv("OMPI_MCA_mpi_yield_when_idle", "0", 0);
    if (MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided) != MPI_SUCCESS || provided < MPI_THREAD_FUNNELED) {
        free(p);
        return base_fail(err, BASE_EIO, "MPI does not start, or allows no threads");
    }
    MPI_Comm_dup(MPI_COMM_WORLD, &p->world); /* plugins may use MPI themselves */
    MPI_Comm_set_errhandler(p->world, MPI_ERRORS_RETURN);
    int rc = introduce(p, err);
    if (rc || p->face.count < 2) {
        MPI_Finalize();
        release(p);
        return rc;
    }
    *out = &p->face;
    return 0;
}
