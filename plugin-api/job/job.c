#include "job/job.h"

#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/identity.h"
#include "base/module.h"
#include "base/threads.h"
#include "job/message.h"

/* Longest wait between two looks whether everybody is still there; how long a roll call lasts. */
static const double LOOK_S = 0.05, ROLL_CALL_S = 1.0;
/* Waits between two looks whether a collective is over. */
static const double FIRST_NAP_S = 2e-5, LONGEST_NAP_S = 5e-4;

/* --- opening -------------------------------------------------------------------------------------------------------- */

static const char MODULE[] = "lull-mpi.so";

/* What launchers leave in the environment: Open MPI, any with PMIx, MPICH and Slurm. */
static int was_launched(void)
{
    static const char *const marks[] = {"OMPI_COMM_WORLD_RANK", "PMIX_RANK", "PMI_RANK"};
    for (size_t i = 0; i < sizeof marks / sizeof marks[0]; i++)
        if (getenv(marks[i]))
            return 1;
    return 0;
}

static int launched_alone(void)
{
    const char *count = getenv("OMPI_COMM_WORLD_SIZE");
    count = count ? count : getenv("PMI_SIZE");
    return count && strcmp(count, "1") == 0;
}

int job_open(struct job **out, struct base_err *err)
{
    int (*open)(struct job_transport * *out, struct base_err * err) = NULL;
    struct job_transport *transport = NULL;
    *out = NULL;
    if (!was_launched() || launched_alone())
        return 0;
    void *symbol = base_module_symbol(MODULE, "job_mpi_open", 1); /* MPI libraries load parts of themselves */
    memcpy(&open, &symbol, sizeof open);
    if (!open)
        return base_fail(err, BASE_EINVAL,
                         "started by an MPI launcher, but this program has no MPI (its lib/lull/modules/lull-mpi.so): "
                         "build it with MPI installed, or start it without the launcher");
    int rc = open(&transport, err);
    return rc || !transport ? rc : job_create(transport, out, err);
}

const char *job_mpi_version(void)
{
    const char *(*version)(void) = NULL;
    void *symbol = base_module_symbol(MODULE, "job_mpi_library", 1);
    memcpy(&version, &symbol, sizeof version);
    return version ? version() : "none (built without it)";
}

int job_create(struct job_transport *transport, struct job **out, struct base_err *err)
{
    struct job *job = calloc(1, sizeof *job);
    struct job_worker *workers = calloc((size_t)transport->count, sizeof *workers);
    if (!job || !workers) {
        free(job);
        free(workers);
        transport->calls->abort(transport, 1); /* nobody could be told otherwise */
        return base_fail_nomem(err, "a job of several processes");
    }
    *job = (struct job){.transport = transport, .workers = workers};
    *out = job;
    return 0;
}

void job_watch(struct job *job, double timeout_s, const volatile sig_atomic_t *interrupted)
{
    if (!job)
        return;
    job->timeout_s = timeout_s;
    job->interrupted = interrupted;
}

/* --- who is who ------------------------------------------------------------------------------------------------------ */

int job_rank(const struct job *job) { return job ? job->transport->rank : 0; }

int job_count(const struct job *job) { return job ? job->transport->count : 1; }

int job_worker_threads(const struct job *job) { return job ? job->threads : 0; }

struct job_traffic job_traffic(const struct job *job) { return job ? job->traffic : (struct job_traffic){0}; }

static const char *name_of(const struct job *job, int rank) { return job->transport->list[rank].name; }

static int same_host(const struct job_transport *t, int rank)
{
    return strcmp(t->list[rank].host, t->list[t->rank].host) == 0;
}

int job_threads(const struct job *job)
{
    int available = base_threads_available(), processes = 0;
    if (!job)
        return available;
    for (int i = 0; i < job->transport->count; i++)
        processes += same_host(job->transport, i);
    long share = sysconf(_SC_NPROCESSORS_ONLN) / processes;
    return share < 1 ? 1 : share < available ? (int)share : available;
}

/* --- failures -------------------------------------------------------------------------------------------------------- */

int job_failed(const struct job *job, struct base_err *err)
{
    return job && job->failed.code ? base_fail(err, job->failed.code, "%s", job->failed.text) : 0;
}

int job_nonsense(struct job *job, int rank)
{
    return base_fail(&job->failed, BASE_EIO, "%s said something that makes no sense", name_of(job, rank));
}

int job_give_up(struct job *job, int rank, double waited_s)
{
    if (job->workers[rank].gone)
        return base_fail(&job->failed, BASE_EINVAL, "%s: ended too early", name_of(job, rank));
    if (job->timeout_s <= 0 || waited_s <= job->timeout_s)
        return 0;
    job->lost = 1;
    return base_fail(&job->failed, BASE_EIO, "%s has not answered for %g s (--rank-timeout)", name_of(job, rank),
                     job->timeout_s);
}

int job_find_dead(struct job *job, struct base_err *err)
{
    for (int i = 1; job && job->transport->rank == 0 && i < job->transport->count; i++)
        if (same_host(job->transport, i) && kill((pid_t)job->transport->list[i].pid, 0) != 0 && errno == ESRCH) {
            job->lost = 1;
            base_fail(&job->failed, BASE_EIO, "%s has died", name_of(job, i));
            return job_failed(job, err);
        }
    return 0;
}

/* Rank 0 has waited for `rank` so long. */
static int look_round(struct job *job, int rank, double waited_s)
{
    int rc = job->interrupted && *job->interrupted ? job_find_dead(job, NULL) : 0;
    return rc ? rc : job_give_up(job, rank, waited_s);
}

/* --- messages -------------------------------------------------------------------------------------------------------- */

int job_send(struct job *job, int rank, void *message, size_t size)
{
    job->traffic.messages++;
    job->traffic.bytes += size;
    return job->transport->calls->send(job->transport, rank, message, size, &job->failed);
}

static int send_copy(struct job *job, int rank, const void *message, size_t size)
{
    void *copy = malloc(size);
    if (!copy)
        return base_fail_nomem(&job->failed, "messages");
    return job_send(job, rank, memcpy(copy, message, size), size);
}

int job_send_head(struct job *job, int rank, enum job_kind kind, uint32_t serial)
{
    const struct job_message head = {(uint32_t)kind, serial};
    return send_copy(job, rank, &head, sizeof head);
}

static int hear_farewell(struct job *job, int rank, const void *message, size_t size)
{
    struct job_farewell *f = &job->workers[rank].farewell;
    if (size != sizeof *f)
        return job_nonsense(job, rank);
    memcpy(f, message, sizeof *f);
    job->workers[rank].gone = 1;
    if (f->status == 0 || job->over)
        return 0;
    return base_fail(&job->failed, f->status == 1 ? BASE_ENOMEM : BASE_EINVAL, "%s: %s", name_of(job, rank),
                     f->text[0] ? f->text : "ended too early");
}

/* The next message from the transport; as job_receive. */
static int receive_new(struct job *job, double wait_s, int *rank, struct job_message **message, size_t *size)
{
    void *data = NULL;
    int got = job->transport->calls->receive(job->transport, wait_s, rank, &data, size, &job->failed);
    *message = data;
    if (got <= 0)
        return got;
    const int worker = job->transport->rank > 0;
    const uint32_t kind = *size < sizeof **message ? JOB_FAREWELL : (*message)->kind;
    job->traffic.messages++;
    job->traffic.bytes += *size;
    if (kind != JOB_PRESENT && kind != JOB_END && kind != JOB_FAREWELL)
        return 1;
    int rc = 0;
    if (worker && kind == JOB_END) {
        job->over = 1;
        job->status = (int)(*message)->serial;
    } else if (worker && kind == JOB_PRESENT) {
        rc = job_send_head(job, 0, JOB_PRESENT, 0);
    } else if (kind == JOB_PRESENT) {
        job->workers[*rank].present = 1;
    } else {
        rc = worker ? job_nonsense(job, *rank) : hear_farewell(job, *rank, data, *size);
    }
    free(data);
    return rc;
}

int job_receive(struct job *job, double wait_s, int *rank, struct job_message **message, size_t *size)
{
    struct job_kept *k = job->kept;
    if (!k)
        return receive_new(job, wait_s, rank, message, size);
    *rank = k->rank;
    *message = k->message;
    *size = k->size;
    job->kept = k->next;
    free(k);
    return 1;
}

/* Keeps what comes within wait_s for later, unless it is about presence or ends. */
static int keep_new(struct job *job, double wait_s)
{
    struct job_kept new = {0}, **last = &job->kept;
    int got = receive_new(job, wait_s, &new.rank, &new.message, &new.size);
    if (got <= 0)
        return got;
    while (*last)
        last = &(*last)->next;
    *last = malloc(sizeof new);
    if (!*last) {
        free(new.message);
        return base_fail_nomem(&job->failed, "messages");
    }
    **last = new;
    return 1;
}

/* --- the handshake --------------------------------------------------------------------------------------------------- */

static int say_hello(struct job *job, const char *settings, int threads)
{
    size_t size = sizeof(struct job_hello) + strlen(settings) + 1;
    struct job_hello *hello = malloc(size);
    if (!hello)
        return base_fail_nomem(&job->failed, "messages");
    *hello = (struct job_hello){.head.kind = JOB_HELLO, .threads = threads};
    memcpy(hello->settings, settings, size - sizeof *hello);
    return job_send(job, 0, hello, size);
}

static int hear_hello(struct job *job, int rank, const struct job_message *message, size_t size, const char *ours)
{
    static const struct base_identity_words words = {" has", " has no", "rank 0"};
    const struct job_hello *hello = (const struct job_hello *)message;
    const struct base_identity here = {.text = (char *)(size_t)ours, .size = strlen(ours)}; /* every key decides */
    struct base_err why = {0};
    if (message->kind != JOB_HELLO || size <= sizeof *hello || ((const char *)message)[size - 1] != '\0' ||
        hello->threads < 1 || job->workers[rank].threads > 0)
        return job_nonsense(job, rank);
    if (base_identity_compare(&here, hello->settings, strlen(hello->settings), name_of(job, rank), &words, NULL, &why) != 0)
        return base_fail(&job->failed, BASE_EINVAL, "%s: give all hosts the same files", why.text);
    job->workers[rank].threads = hello->threads;
    job->threads += hello->threads;
    return 0;
}

/* The first worker that rank 0 has not heard of; count: it has heard of all. */
static int unheard(const struct job *job)
{
    int rank = 1;
    while (rank < job->transport->count && job->workers[rank].threads > 0)
        rank++;
    return rank;
}

int job_handshake(struct job *job, const char *settings, int threads, struct base_err *err)
{
    if (job && job->transport->rank > 0) {
        say_hello(job, settings, threads);
    } else if (job) {
        const double start_s = base_clock_wall_s();
        while (unheard(job) < job->transport->count && !job->failed.code) {
            int rank;
            struct job_message *message;
            size_t size;
            int got = job_receive(job, LOOK_S, &rank, &message, &size);
            if (got > 0) {
                hear_hello(job, rank, message, size, settings);
                free(message);
            } else if (got == 0) {
                look_round(job, unheard(job), base_clock_wall_s() - start_s);
            }
        }
    }
    return job_failed(job, err);
}

/* --- collectives --------------------------------------------------------------------------------------------------- */

/* A collective lasts too long: asks who waits for it too, and gives up the first who does not say so. */
static int call_roll(struct job *job)
{
    const double start_s = base_clock_wall_s();
    int rank, absent = 1;
    for (rank = 1; rank < job->transport->count && !job->failed.code; rank++) {
        job->workers[rank].present = 0;
        job_send_head(job, rank, JOB_PRESENT, 0);
    }
    while (!job->failed.code && absent < job->transport->count && base_clock_wall_s() - start_s < ROLL_CALL_S) {
        keep_new(job, LOOK_S);
        for (absent = 1; absent < job->transport->count && job->workers[absent].present;)
            absent++;
    }
    return job->failed.code || absent == job->transport->count ? job->failed.code
                                                               : job_give_up(job, absent, 2 * job->timeout_s);
}

/* A worker that waits for a collective. Rank 0 may have ended after its own part, in order or not: then the rest comes
 * soon. */
static int wait_on(struct job *job, double *since_s)
{
    if (!job->over)
        *since_s = base_clock_wall_s();
    else if (job->status != 0 && base_clock_wall_s() - *since_s > ROLL_CALL_S)
        base_fail(&job->failed, BASE_EIO, "rank 0 has ended"); /* nobody reads it: rank 0 says why */
    return job->failed.code;
}

/* While nothing has come of a collective. */
static int attend(struct job *job, double nap_s, double *since_s)
{
    keep_new(job, nap_s);
    if (job->failed.code || job->transport->rank > 0)
        return job->failed.code ? job->failed.code : wait_on(job, since_s);
    if (job->interrupted && *job->interrupted && job_find_dead(job, NULL))
        return job->failed.code;
    if (job->timeout_s <= 0 || base_clock_wall_s() - *since_s <= job->timeout_s)
        return 0;
    *since_s = base_clock_wall_s(); /* if all are there it is slow, no more */
    return call_roll(job);
}

/* Waits until the collective that has been begun is over. */
static int finish(struct job *job, size_t bytes)
{
    const double start_s = base_clock_wall_s();
    double since_s = start_s, nap_s = FIRST_NAP_S;
    int done = job->failed.code;
    while (done == 0) {
        done = job->transport->calls->test(job->transport, &job->failed);
        if (done == 0)
            done = attend(job, nap_s, &since_s);
        nap_s = nap_s < LONGEST_NAP_S ? 2 * nap_s : nap_s;
    }
    job->lost |= done < 0; /* the collective cannot be left */
    job->traffic.messages++;
    job->traffic.bytes += bytes;
    job->traffic.waiting_s += base_clock_wall_s() - start_s;
    return job->failed.code;
}

int job_broadcast(struct job *job, void *data, size_t size)
{
    if (!job || job->failed.code)
        return job ? job->failed.code : 0;
    job->transport->calls->broadcast(job->transport, data, size, &job->failed);
    return finish(job, size);
}

/* --- the end ---------------------------------------------------------------------------------------------------------- */

/* A worker: its last message, and the end that rank 0 says. */
static void say_farewell(struct job *job, int status, const char *text)
{
    struct job_farewell f = {.head.kind = JOB_FAREWELL, .status = status};
    snprintf(f.text, sizeof f.text, "%s", text && status ? text : "");
    job->failed.code = 0;
    send_copy(job, 0, &f, sizeof f);
    while (!job->over && !job->failed.code) {
        int rank;
        struct job_message *message;
        size_t size;
        if (job_receive(job, LOOK_S, &rank, &message, &size) > 0)
            free(message);
    }
}

/* Rank 0 has no more to say; the others end when they are done. */
static int hear_farewells(struct job *job, int status, struct base_err *err)
{
    const int count = job->transport->count;
    const double start_s = base_clock_wall_s();
    job->failed = (struct base_err){0};
    job->over = 1;
    for (int r = 1; r < count && !job->failed.code; r++)
        job_send_head(job, r, JOB_END, (uint32_t)status);
    for (int r = 1; r < count && !job->failed.code;) {
        int rank;
        struct job_message *message;
        size_t size;
        if (job->workers[r].gone)
            r++;
        else if (job_receive(job, LOOK_S, &rank, &message, &size) > 0)
            free(message); /* on its way when the end was said */
        else if (!job->workers[r].gone)
            look_round(job, r, base_clock_wall_s() - start_s);
    }
    for (int r = 1; r < count && status == 0 && !job->failed.code; r++) {
        status = job->workers[r].farewell.status;
        if (status)
            base_fail(err, BASE_EINVAL, "%s",
                      job->workers[r].farewell.text[0] ? job->workers[r].farewell.text : "interrupted");
    }
    return job_failed(job, err) && status == 0 ? 2 : status;
}

int job_close(struct job *job, int status, const char *text, struct base_err *err)
{
    if (!job)
        return status;
    if (job->transport->rank > 0)
        say_farewell(job, status, text);
    else if (!job->lost)
        status = hear_farewells(job, status, err);
    if (job->lost)
        job->transport->calls->abort(job->transport, job->transport->rank > 0 ? job->status : status);
    status = job->transport->rank > 0 ? 0 : status;
    job->transport->calls->close(job->transport);
    for (struct job_kept *k = job->kept, *next; k; k = next) {
        next = k->next;
        free(k->message);
        free(k);
    }
    free(job->workers);
    free(job);
    return status;
}
