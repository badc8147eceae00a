/* What the processes of a job say to each other; private to job/. Structs travel as they are: all processes run the same
 * program on machines of the same kind. */
#ifndef JOB_MESSAGE_H
#define JOB_MESSAGE_H

#include "job/job.h"
#include "job/transport.h"

enum job_kind {
    JOB_HELLO,    /* to rank 0: ready; a job_hello */
    JOB_TASK,     /* from rank 0: a job_task */
    JOB_ANSWER,   /* to rank 0: a job_task with the answers in the place of the items */
    JOB_DONE,     /* from rank 0: no more tasks of this farm */
    JOB_END,      /* from rank 0, the last one: no more at all */
    JOB_FAREWELL, /* to rank 0, the last one: a job_farewell */
};

struct job_message {
    uint32_t kind, serial; /* serial: of the farm that it belongs to; of JOB_END the exit status */
};

struct job_hello {
    struct job_message head;
    int32_t threads;
    char settings[]; /* with its terminator */
};

struct job_farewell {
    struct job_message head;
    int32_t status;
    char text[516];
};

/* A message that has come. */
struct job_mail {
    int rank; /* of its sender */
    size_t size;
    struct job_message *message; /* the receiver's, who frees it */
};

/* A task that is with a worker. */
struct job_held {
    uint32_t first, count, serial; /* items; of the farm */
};
enum { JOB_HELD = 2 }; /* the one that a worker works on and the next */

struct job_worker {
    int threads; /* 0: no message from it yet */
    int gone;    /* its last message has come */
    struct job_farewell farewell;
    struct job_held held[JOB_HELD]; /* in the order in which they were sent */
    int held_count;
    double since_s; /* wall time since which it owes an answer */
};

struct job {
    struct job_transport *transport;
    double timeout_s;
    const volatile sig_atomic_t *interrupted;
    struct job_worker *workers; /* owns; [count] at rank 0, 0 unused */
    int threads;                /* of all workers */
    uint32_t serial;            /* farms so far */
    int lost;                   /* somebody is gone for good: there is no orderly end */
    int over, status;           /* rank 0 has ended the job; with which status, of a worker */
    struct job_traffic traffic;
    struct base_err failed;
};

/* Takes `message`, from malloc. */
int job_send(struct job *job, int rank, void *message, size_t size);
/* The next message, waiting for up to wait_s: 1 with *mail, 0 none, negative a failure. Not those about ends: a worker's
 * farewell with a reason is a failure, the end of the job sets job->over. */
int job_receive(struct job *job, double wait_s, struct job_mail *mail);
/* A message of its head alone. */
int job_send_head(struct job *job, int rank, enum job_kind kind, uint32_t serial);
/* A failure: the message of a process makes no sense. */
int job_nonsense(struct job *job, int rank);
/* A failure if a process of rank 0's host has died, which it names; of other hosts nothing is known. */
int job_find_dead(struct job *job);
/* A failure if rank 0 has waited too long for a worker, or its last message has come. */
int job_give_up(struct job *job, int rank, double waited_s);

#endif
