#include "job/job.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/identity.h"
#include "base/module.h"
#include "base/threads.h"
#include "job/message.h"

static const double LOOK_S = 0.05; /* longest wait between two looks whether everybody is still there */

static const char MODULE[] = "lull-mpi.so";

/* Whether a launcher has started this process and others, by what Open MPI, any with PMIx, MPICH and Slurm leave in the
 * environment. */
static int was_launched(void)
{
    const char *count = getenv("OMPI_COMM_WORLD_SIZE");
    count = count ? count : getenv("PMI_SIZE");
    if (count && strcmp(count, "1") == 0)
        return 0;
    return getenv("OMPI_COMM_WORLD_RANK") || getenv("PMIX_RANK") || getenv("PMI_RANK");
}

int job_open(struct job **out, struct base_err *err)
{
    int (*open)(struct job_transport * *out, struct base_err * err) = NULL;
    struct job_transport *transport = NULL;
    *out = NULL;
    if (!was_launched())
        return 0;
    struct base_err why = {0};
    void *symbol = base_module_symbol(MODULE, "job_mpi_open", 1, &why); /* MPI libraries load parts of themselves */
    memcpy(&open, &symbol, sizeof open);
    if (why.code == BASE_ENOMEM)
        return base_fail_nomem(err, MODULE);
    if (!open)
        return base_fail(err, BASE_EINVAL,
                         "started by an MPI launcher, but this program has no MPI (%.200s): build it with MPI installed, or "
                         "start it without the launcher",
                         why.text);
    int rc = open(&transport, err);
    return rc || !transport ? rc : job_create(transport, out, err);
}

const char *job_mpi_version(void)
{
    const char *(*version)(void) = NULL;
    void *symbol = base_module_symbol(MODULE, "job_mpi_library", 1, NULL);
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
    const long online = sysconf(_SC_NPROCESSORS_ONLN), quota = base_threads_quota("");
    const long share = (online < quota ? online : quota) / processes;
    return share < 1 ? 1 : share < available ? (int)share : available;
}

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

int job_find_dead(struct job *job)
{
    for (int i = 1; i < job->transport->count; i++)
        if (same_host(job->transport, i) && kill((pid_t)job->transport->list[i].pid, 0) != 0 && errno == ESRCH) {
            job->lost = 1;
            return base_fail(&job->failed, BASE_EIO, "%s has died", name_of(job, i));
        }
    return 0;
}

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

static int receive_farewell(struct job *job, const struct job_mail *mail)
{
    struct job_farewell *f = &job->workers[mail->rank].farewell;
    if (mail->size != sizeof *f)
        return job_nonsense(job, mail->rank);
    memcpy(f, mail->message, sizeof *f);
    job->workers[mail->rank].gone = 1;
    if (f->status == 0 || job->over)
        return 0;
    return base_fail(&job->failed, f->status == 1 ? BASE_ENOMEM : BASE_EINVAL, "%s: %s", name_of(job, mail->rank),
                     f->text[0] ? f->text : "ended too early");
}

int job_receive(struct job *job, double wait_s, struct job_mail *mail)
{
    void *data = NULL;
    int got = job->transport->calls->receive(job->transport, wait_s, &mail->rank, &data, &mail->size, &job->failed);
    mail->message = data;
    if (got <= 0)
        return got;
    const int worker = job->transport->rank > 0;
    const uint32_t kind = mail->size < sizeof *mail->message ? JOB_FAREWELL : mail->message->kind;
    job->traffic.messages++;
    job->traffic.bytes += mail->size;
    if (kind != JOB_END && kind != JOB_FAREWELL)
        return 1;
    int rc = 0;
    if (worker && kind == JOB_END) {
        job->over = 1;
        job->status = (int)mail->message->serial;
    } else {
        rc = worker ? job_nonsense(job, mail->rank) : receive_farewell(job, mail);
    }
    free(data);
    return rc;
}

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

static int receive_hello(struct job *job, const struct job_mail *mail, const char *ours)
{
    static const struct base_identity_words words = {" has", " has no", "rank 0"};
    const struct job_hello *hello = (const struct job_hello *)mail->message;
    const int rank = mail->rank;
    const struct base_identity here = {.text = (char *)(size_t)ours, .size = strlen(ours)}; /* every key decides */
    struct base_err why = {0};
    if (hello->head.kind != JOB_HELLO || mail->size <= sizeof *hello || ((const char *)hello)[mail->size - 1] != '\0' ||
        hello->threads < 1 || job->workers[rank].threads > 0)
        return job_nonsense(job, rank);
    if (base_identity_compare(&here, hello->settings, strlen(hello->settings), name_of(job, rank), &words, NULL, &why) != 0)
        return base_fail(&job->failed, BASE_EINVAL, "%s: give all hosts the same files", why.text);
    job->workers[rank].threads = hello->threads;
    job->threads += hello->threads;
    return 0;
}

/* Rank 0 takes messages until the first one of each worker has come, of whom it wants the same settings; NULL: the last one
 * of each. */
static void await_all(struct job *job, const char *settings)
{
    const double start_s = base_clock_wall_s();
    for (int r = 1; r < job->transport->count && !job->failed.code;) {
        const struct job_worker *w = &job->workers[r];
        struct job_mail mail;
        if (settings ? w->threads > 0 : w->gone) {
            r++;
            continue;
        }
        int got = job_receive(job, LOOK_S, &mail);
        if (got > 0) {
            if (settings)
                receive_hello(job, &mail, settings);
            free(mail.message); /* at the end: it was on its way when rank 0 ended the job */
        } else if (got == 0 && (settings || !w->gone) && !(job->interrupted && *job->interrupted && job_find_dead(job))) {
            job_give_up(job, r, base_clock_wall_s() - start_s);
        }
    }
}

int job_handshake(struct job *job, const char *settings, int threads, struct base_err *err)
{
    if (job && job->transport->rank > 0)
        say_hello(job, settings, threads);
    else if (job)
        await_all(job, settings);
    return job_failed(job, err);
}

/* A worker: its last message, and the end that rank 0 says. */
static void say_farewell(struct job *job, int status, const char *text)
{
    struct job_farewell f = {.head.kind = JOB_FAREWELL, .status = status};
    snprintf(f.text, sizeof f.text, "%s", text && status ? text : "");
    job->failed.code = 0;
    send_copy(job, 0, &f, sizeof f);
    while (!job->over && !job->failed.code) {
        struct job_mail mail;
        if (job_receive(job, LOOK_S, &mail) > 0)
            free(mail.message);
    }
}

/* Rank 0 has no more to say; the others end when they are done. */
static int receive_farewells(struct job *job, int status, struct base_err *err)
{
    const int count = job->transport->count;
    job->failed = (struct base_err){0};
    job->over = 1;
    for (int r = 1; r < count && !job->failed.code; r++)
        job_send_head(job, r, JOB_END, (uint32_t)status);
    await_all(job, NULL);
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
        status = receive_farewells(job, status, err);
    if (job->lost)
        job->transport->calls->abort(job->transport, job->transport->rank > 0 ? job->status : status);
    status = job->transport->rank > 0 ? 0 : status;
    job->transport->calls->close(job->transport);
    free(job->workers);
    free(job);
    return status;
}
