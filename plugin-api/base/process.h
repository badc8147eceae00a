/*
 * A program that works for this process as often as it is asked, on memory that both share. What may hang, crash, allocate
 * or end its process does so there, and is an error here.
 *
 * The program finds the memory as descriptor BASE_PROCESS_MEMORY, of whatever size it has then; a socket as
 * BASE_PROCESS_CALLER, from which a byte asks and which takes the same byte as the answer; and as BASE_PROCESS_LIFE the end
 * of a pipe that hangs up when this process ends. It leads a process group of its own: signals from a terminal do not reach
 * it. It runs from the first question on; one that has ended is started anew by the next.
 *
 * Calls on one struct base_process must not overlap; different ones may. Asking allocates nothing but a process.
 */
#ifndef BASE_PROCESS_H
#define BASE_PROCESS_H

#include <stddef.h>
#include <sys/types.h>

#include "base/err.h"

enum { BASE_PROCESS_MEMORY = 3, BASE_PROCESS_CALLER, BASE_PROCESS_LIFE };

struct base_process {
    const char *name; /* borrows; for messages */
    void *memory;     /* [bytes], shared */
    size_t bytes;
    int memory_fd; /* -1: there is none */
    pid_t pid;     /* 0: it does not run */
    int caller_fd, life_fd;
    unsigned char asked; /* the last question */
};

#define BASE_PROCESS_NONE \
    { \
        .memory_fd = -1, .caller_fd = -1, .life_fd = -1 \
    }

int base_process_init(struct base_process *child, const char *name, struct base_err *err);
/* Memory of so many bytes, zero where it grows. BASE_ENOMEM, and it is as before. */
int base_process_resize(struct base_process *child, size_t bytes, struct base_err *err);
/* Whether it runs. Of one that has ended nothing is left then. */
int base_process_runs(struct base_process *child);

/* One question, to the program of these arguments, the first of which is looked for on PATH. limit_s: seconds that it may
 * take, 0: any. cancelled(data), which may be NULL, is asked 50 times a second. BASE_ENOMEM; BASE_EIO: it cannot be run;
 * BASE_EINVAL: it ended, or gave another answer than it should, or none in time; BASE_ECANCELLED. After a failure it does
 * not run any more. */
int base_process_ask(struct base_process *child, char *const *arguments, double limit_s, int (*cancelled)(void *data),
                     void *data, struct base_err *err);
/* Ends it, and what it has started. */
void base_process_end(struct base_process *child);
void base_process_release(struct base_process *child);

#endif
