/*
 * What carries the bytes of a job; for job/ and its implementations only. The one of the product is MPI (plugin-api/mpi), in
 * a shared object that only processes started by a launcher load; tests have threads in the place of processes.
 *
 * Messages from one process to another arrive in the order in which they were sent. One thread of a process calls all this.
 */
#ifndef JOB_TRANSPORT_H
#define JOB_TRANSPORT_H

#include <stddef.h>

#include "base/err.h"

struct job_process {
    char host[96];
    long pid;
    char name[160]; /* "rank 2 on host gamma (process 4711)" */
};

struct job_transport {
    int rank, count;                /* count >= 2 */
    const struct job_process *list; /* [count] */
    const struct job_transport_calls *calls;
};

struct job_transport_calls {
    /* Takes `data`, from malloc, also when it fails. Does not wait. */
    int (*send)(struct job_transport *t, int rank, void *data, size_t size, struct base_err *err);
    /* 1: a message, *data is the caller's to free; 0: none came within wait_s; negative: an error. */
    int (*receive)(struct job_transport *t, double wait_s, int *rank, void **data, size_t *size, struct base_err *err);
    /* Waits until all processes have called it. */
    void (*close)(struct job_transport *t);
    /* Ends every process now; returns if it cannot. */
    void (*abort)(struct job_transport *t, int status);
};

#endif
