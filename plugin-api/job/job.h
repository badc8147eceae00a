/*
 * The processes of one job, as a launcher such as mpirun starts them: which of them this is, whether all have the same
 * settings, collectives, and an end that all reach. job/farm.h deals out work.
 *
 * Rank 0 talks to people; the others, its workers, tell it what goes wrong with them. Rank 0 finds out who is missing and
 * names it. The first failure stays: every later call fails at once. NULL is a job of one process, for which every call does
 * nothing and succeeds. Only the thread that opened a job may call what sends or receives.
 */
#ifndef JOB_JOB_H
#define JOB_JOB_H

#include <signal.h>
#include <stdint.h>

#include "base/err.h"

struct job;
struct job_transport;

/* *out is NULL when no launcher has started this process or it has started no other. Fails when one did and MPI is not
 * there: as many processes would each do the whole work. */
int job_open(struct job **out, struct base_err *err);
/* Over a transport that is there already. */
int job_create(struct job_transport *transport, struct job **out, struct base_err *err);
/* The end of this process's part. A worker hands its status and, where that is not 0, the reason (text) to rank 0, waits for
 * the end of the job and returns 0. Rank 0 returns the exit status of all: its own, else the first that is not 0, with its
 * reason in *err. A job that somebody can no longer follow ends here and now. Releases the job. */
int job_close(struct job *job, int status, const char *text, struct base_err *err);

/* From here on rank 0 gives up a process that owes it something for timeout_s (0: never), and when *interrupted (borrowed)
 * becomes set looks whether that is because a process has died. */
void job_watch(struct job *job, double timeout_s, const volatile sig_atomic_t *interrupted);

int job_rank(const struct job *job);  /* 0 without a job */
int job_count(const struct job *job); /* 1 without */
/* Threads for this process: the processors that it may use, or its share of the host's if that is less. */
int job_threads(const struct job *job);

/* What went to and fro at this process so far. */
struct job_traffic {
    uint64_t messages, bytes;
    double waiting_s; /* wall seconds in which it had nothing to do but wait */
};
struct job_traffic job_traffic(const struct job *job);

/* Every process says that it is ready with so many threads. Rank 0 waits for all and refuses (BASE_EINVAL) the first whose
 * lines of key=value are not its own; the others go on. */
int job_handshake(struct job *job, const char *settings, int threads, struct base_err *err);
int job_worker_threads(const struct job *job); /* of all but rank 0, after the handshake */

/* The first failure of any call so far, 0: none. */
int job_failed(const struct job *job, struct base_err *err);

/* "Open MPI v4.1.4 …", or why there is none. Static text. */
const char *job_mpi_version(void);

#endif
