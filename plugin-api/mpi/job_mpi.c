/* job/transport.h over MPI 3, in a shared object of its own that only processes started by a launcher load. */
#include "job/transport.h"

#include <limits.h>
#include <mpi.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "base/clock.h"

__attribute__((visibility("default"))) int job_mpi_open(struct job_transport **out, struct base_err *err);
__attribute__((visibility("default"))) const char *job_mpi_library(void);

/* Waiting sleeps, and longer the longer it lasts: MPI would spin, which costs a processor where there are fewer of them than
 * processes. */
static const long FIRST_NAP_NS = 20000, LONGEST_NAP_NS = 500000;

/* A message on its way; its memory is free once MPI has it. */
struct sending {
    MPI_Request request;
    void *data;
};

/* One that has begun to come. Its rest may never: its sender may hang half way, and who waits must be able to give up. */
struct arrival {
    MPI_Request request;
    void *data; /* owns; NULL: nothing is coming */
    int rank, size;
};

struct mpi {
    struct job_transport face; /* first: what callers see */
    struct job_process *list;  /* owns; [count] */
    MPI_Comm world;
    struct sending *sent; /* owns; [room] */
    size_t count, room;
    struct arrival coming;
};

static void forget_sent(struct mpi *m)
{
    size_t left = 0;
    for (size_t i = 0; i < m->count; i++) {
        int done = 0;
        MPI_Test(&m->sent[i].request, &done, MPI_STATUS_IGNORE);
        if (done)
            free(m->sent[i].data);
        else
            m->sent[left++] = m->sent[i];
    }
    m->count = left;
}

static int send_message(struct job_transport *face, int rank, void *data, size_t size, struct base_err *err)
{
    struct mpi *m = (struct mpi *)face;
    forget_sent(m);
    if (m->count == m->room) {
        size_t room = m->room ? 2 * m->room : 16;
        struct sending *grown = realloc(m->sent, room * sizeof *grown);
        if (!grown) {
            free(data);
            return base_fail_nomem(err, "messages");
        }
        m->sent = grown;
        m->room = room;
    }
    struct sending *s = &m->sent[m->count];
    s->data = data;
    if (size > INT_MAX || MPI_Isend(data, (int)size, MPI_BYTE, rank, 0, m->world, &s->request) != MPI_SUCCESS) {
        free(data);
        return base_fail(err, BASE_EIO, "cannot send %zu bytes to %s", size, face->list[rank].name);
    }
    m->count++;
    return 0;
}

static int begin_to_receive(struct mpi *m, MPI_Message *message, const MPI_Status *status, struct base_err *err)
{
    struct arrival a = {.rank = status->MPI_SOURCE};
    MPI_Get_count(status, MPI_BYTE, &a.size);
    a.data = malloc(a.size > 0 ? (size_t)a.size : 1);
    if (!a.data)
        return base_fail_nomem(err, "messages");
    if (MPI_Imrecv(a.data, a.size, MPI_BYTE, message, &a.request) != MPI_SUCCESS) {
        free(a.data);
        return base_fail(err, BASE_EIO, "cannot receive from %s", m->face.list[a.rank].name);
    }
    m->coming = a;
    return 0;
}

/* Looks once: 1 when a whole message is there, which m->coming then holds, 0 not yet. */
static int look(struct mpi *m, struct base_err *err)
{
    int there = 0;
    MPI_Message message;
    MPI_Status status;
    forget_sent(m);
    if (!m->coming.data) {
        if (MPI_Improbe(MPI_ANY_SOURCE, 0, m->world, &there, &message, &status) != MPI_SUCCESS)
            return base_fail(err, BASE_EIO, "MPI has lost the other processes");
        int rc = there ? begin_to_receive(m, &message, &status, err) : 0;
        if (rc || !there)
            return rc;
    }
    if (MPI_Test(&m->coming.request, &there, MPI_STATUS_IGNORE) != MPI_SUCCESS)
        return base_fail(err, BASE_EIO, "cannot receive from %s", m->face.list[m->coming.rank].name);
    return there != 0;
}

static int receive_message(struct job_transport *face, double wait_s, int *rank, void **data, size_t *size,
                           struct base_err *err)
{
    struct mpi *m = (struct mpi *)face;
    double until_s = base_clock_wall_s() + wait_s;
    for (long nap_ns = FIRST_NAP_NS;; nap_ns = nap_ns < LONGEST_NAP_NS ? 2 * nap_ns : nap_ns) {
        int rc = look(m, err);
        if (rc > 0) {
            *rank = m->coming.rank;
            *data = m->coming.data;
            *size = (size_t)m->coming.size;
            m->coming.data = NULL;
        }
        if (rc != 0 || base_clock_wall_s() >= until_s)
            return rc;
        nanosleep(&(struct timespec){.tv_nsec = nap_ns}, NULL);
    }
}

static void release(struct mpi *m)
{
    free(m->sent);
    free(m->list);
    free(m);
}

static void close_all(struct job_transport *face)
{
    struct mpi *m = (struct mpi *)face;
    while (m->count > 0) {
        forget_sent(m);
        nanosleep(&(struct timespec){.tv_nsec = FIRST_NAP_NS}, NULL);
    }
    MPI_Comm_free(&m->world);
    MPI_Finalize();
    release(m);
}

static void abort_all(struct job_transport *face, int status)
{
    (void)face;
    MPI_Abort(MPI_COMM_WORLD, status);
}

const char *job_mpi_library(void)
{
    static char text[MPI_MAX_LIBRARY_VERSION_STRING];
    int n = 0;
    MPI_Get_library_version(text, &n); /* allowed before MPI_Init */
    text[strcspn(text, ",\n")] = '\0';
    return text;
}

/* Everybody tells everybody who it is. */
static int introduce(struct mpi *m, struct base_err *err)
{
    static const struct job_transport_calls calls = {
        .send = send_message, .receive = receive_message, .close = close_all, .abort = abort_all};
    struct job_process self = {.pid = (long)getpid()};
    MPI_Comm_rank(m->world, &m->face.rank);
    MPI_Comm_size(m->world, &m->face.count);
    if (gethostname(self.host, sizeof self.host - 1) != 0)
        snprintf(self.host, sizeof self.host, "unknown");
    snprintf(self.name, sizeof self.name, "rank %d on host %s (process %ld)", m->face.rank, self.host, self.pid);
    m->list = calloc((size_t)m->face.count, sizeof *m->list);
    if (!m->list)
        return base_fail_nomem(err, "list of processes");
    m->face.list = m->list;
    m->face.calls = &calls;
    MPI_Allgather(&self, sizeof self, MPI_BYTE, m->list, sizeof self, MPI_BYTE, m->world);
    return 0;
}

int job_mpi_open(struct job_transport **out, struct base_err *err)
{
    int provided = 0;
    struct mpi *m = calloc(1, sizeof *m);
    if (!m)
        return base_fail_nomem(err, "list of processes");
    /* Open MPI gives up the processor at every look for messages where there are fewer processors than processes, also on
     * behalf of a process that has other work to do. Who waits here sleeps; who works goes on. */
    setenv("OMPI_MCA_mpi_yield_when_idle", "0", 0);
    if (MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &provided) != MPI_SUCCESS || provided < MPI_THREAD_FUNNELED) {
        free(m);
        return base_fail(err, BASE_EIO, "MPI does not start, or allows no threads");
    }
    MPI_Comm_dup(MPI_COMM_WORLD, &m->world); /* plugins may use MPI themselves */
    MPI_Comm_set_errhandler(m->world, MPI_ERRORS_RETURN);
    int rc = introduce(m, err);
    if (rc || m->face.count < 2) {
        MPI_Finalize();
        release(m);
        return rc;
    }
    *out = &m->face;
    return 0;
}
