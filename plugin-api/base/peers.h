/*
 * The processes of one job, as a launcher such as mpirun starts them: which of them this is, how many there are, and
 * messages of bytes between them. Rank 0 is the one that people talk to.
 *
 * The only implementation speaks MPI and lives in a shared object of its own (plugin-api/mpi), which is loaded only by a
 * process that a launcher has started: a program needs no MPI to be built or to run alone. Messages from one process to
 * another arrive in the order in which they were sent. Only the thread that opened the peers may call anything here but
 * name, rank, count and threads.
 */
#ifndef BASE_PEERS_H
#define BASE_PEERS_H

#include <stddef.h>

#include "base/err.h"

enum { BASE_PEERS_NAME = 160 };

/* Who a process is. */
struct base_peer {
    char host[96];
    long pid;
    char name[BASE_PEERS_NAME]; /* "rank 2 on host gamma (process 4711)" */
};

struct base_peers {
    int rank, count;                      /* count >= 2: who is alone has no peers */
    const struct base_peer *list;         /* [count]; read-only */
    const struct base_peers_calls *calls; /* private to base/peers.c and the implementation */
    void *context;                        /* likewise */
};

/* What an implementation does; as the functions below. */
struct base_peers_calls {
    int (*send)(struct base_peers *peers, int rank, void *data, size_t size, struct base_err *err);
    int (*receive)(struct base_peers *peers, double wait_s, int *rank, void **data, size_t *size, struct base_err *err);
    void (*close)(struct base_peers *peers);
    void (*abort)(struct base_peers *peers, int status);
    const char *(*version)(void);
};

/* *out is NULL when no launcher has started this process or it has started no other. Fails when it did and MPI is not there:
 * as many processes would each do the whole job. */
int base_peers_open(struct base_peers **out, struct base_err *err);
/* Waits until all processes have called it. NULL is allowed. */
void base_peers_close(struct base_peers *peers);
/* Ends every process now, whatever it is doing; returns if it cannot. */
void base_peers_abort(struct base_peers *peers, int status);

/* Hands `data` (from malloc, the peers' own from here on, also after a failure) to another process. Does not wait. */
int base_peers_send(struct base_peers *peers, int rank, void *data, size_t size, struct base_err *err);
/* The next message of any process, waiting for it up to wait_s. 1: there was one, *data is the caller's to free; 0: there
 * was none; negative: an error. */
int base_peers_receive(struct base_peers *peers, double wait_s, int *rank, void **data, size_t *size, struct base_err *err);

/* Threads for this process: the processors that it may use, or its share of the host's if that is less. NULL is allowed. */
int base_peers_threads(const struct base_peers *peers);
/* What is said of a process, and by every program in the same words; each fails and returns its code. */
/* Of one that is no more (BASE_EIO); 0 if all processes of this host are there. Of other hosts nothing is known. */
int base_peers_mourn(const struct base_peers *peers, struct base_err *err);
/* Of one that has not answered for so long (BASE_EIO). */
int base_peers_give_up(const struct base_peers *peers, int rank, double timeout_s, struct base_err *err);
/* Of one whose lines of key=value are not those of rank 0 (BASE_EINVAL): names the first that differs. */
int base_peers_differ(const struct base_peers *peers, int rank, const char *theirs, const char *ours, struct base_err *err);

/* "Open MPI v4.1.4 …", or why there is none. Static text. */
const char *base_peers_version(void);

#endif
