/*
 * The crew: the other processes of an MPI job, as rank 0 sees them. Rank 0 has the only film, decides, shows progress,
 * writes; the crew samples rows and asks the criterion about blocks for it (crew_member.h), and keeps nothing.
 *
 * Who is idle is given the next rows of the slice with the sums that they have so far, and sends both back. A row is with
 * one process at a time, so that the film has the bytes that one process would give it (rows.h). Two parcels are with each
 * member, so that it need not wait for rank 0. One thread only: that which opened the peers.
 */
#ifndef PT_RENDER_CREW_H
#define PT_RENDER_CREW_H

#include "base/err.h"
#include "base/peers.h"
#include "base/threads.h"
#include "render/host.h"
#include "render/rows.h"

struct pt_crew;

/* What went to and fro so far. */
struct pt_crew_traffic {
    uint64_t messages, bytes; /* of rows, both ways together */
    double waiting_s;         /* wall seconds that rank 0 had nothing to sample and waited for others */
};

/* peers are borrowed until dismiss; a member that owes an answer for timeout_s is given up. */
int pt_crew_create(struct base_peers *peers, double timeout_s, struct pt_crew **out, struct base_err *err);
/* Waits until every member is ready. Refuses (BASE_EINVAL) a member whose lines of key=value are not those of `text`. */
int pt_crew_greet(struct pt_crew *crew, const char *text, struct base_err *err);
/* Sends everybody home and releases the crew; NULL is allowed. If a member was lost all processes end here and now, with
 * this exit status. */
void pt_crew_dismiss(struct pt_crew *crew, int status);

int pt_crew_processes(const struct pt_crew *crew); /* rank 0 included; 1 without crew (NULL) */
int pt_crew_threads(const struct pt_crew *crew);   /* of all members; 0 without crew */
const struct pt_crew_traffic *pt_crew_traffic(const struct pt_crew *crew);

/* Rows to be sampled. */
struct pt_crew_slice {
    struct pt_row_maker maker;
    struct pt_film *film;
    struct pt_row *rows;
    const uint32_t *order; /* [count] row to be done n-th */
    size_t count;
    int (*interrupted)(void *data); /* may be NULL; asked now and then */
    void *data;
};

/* Samples the rows, with the threads here and by the crew. PT_CREW_STOPPED when interrupted() said so, negative when a
 * member was lost: then the film is as it was before and so are the rows. */
enum { PT_CREW_STOPPED = 1 };
int pt_crew_sample(struct pt_crew *crew, struct base_threads *threads, const struct pt_crew_slice *slice,
                   struct base_err *err);

/* Blocks about which the criterion is to be asked: the arguments of pt_criterion_evaluate. */
struct pt_crew_question {
    struct lull_host_criterion *criterion;
    struct lull_host_frame *frame;
    const struct pt_film *film;
    const uint32_t *due;
    const uint8_t *final;
    uint32_t count;
    struct lull_decision *decisions;
    int (*interrupted)(void *data); /* may be NULL; asked now and then */
    void *data;
};

/* Can others answer as well? Yes if the criterion keeps no history of its own, its answers are a function of the block's
 * pixels, and every member has opened the frame. No without crew (NULL). */
int pt_crew_can_ask(const struct pt_crew *crew, const struct lull_host_criterion *criterion);
/* pt_criterion_evaluate by everybody. Fails as pt_crew_sample; what the criterion itself fails with is *said, and costs all
 * decisions. *thread_s: processor seconds of the others. */
int pt_crew_ask(struct pt_crew *crew, struct base_threads *threads, const struct pt_crew_question *question,
                double *thread_s, struct base_err *said, struct base_err *err);

#endif
