/* What rank 0 and the crew say to each other, and what rank 0 knows of it; private to crew*.c. Each message begins with its
 * kind. All processes run the same program on machines of the same kind: structs travel as they are. */
#ifndef PT_RENDER_CREW_MESSAGES_H
#define PT_RENDER_CREW_MESSAGES_H

#include <stdint.h>

#include "integ/integrator.h"
#include "render/crew.h"
#include "render/rows.h"

enum pt_crew_kind {
    PT_CREW_HELLO,  /* member: ready; what must be the same everywhere follows as text */
    PT_CREW_FAILED, /* member: it cannot go on; why follows as text */
    PT_CREW_ROWS,   /* rank 0: sample these; the member sends the same message back, done */
    PT_CREW_ASK,    /* rank 0: ask the criterion about these blocks; the member sends the message back with the answers */
    PT_CREW_END,    /* rank 0: there is no more to do */
    PT_CREW_BYE     /* member: its last message */
};

struct pt_crew_hello {
    uint32_t kind, threads;
    uint32_t judges, zero; /* judges: it has opened the criterion's frame */
    char text[];           /* the rest of the message, without terminator */
};

struct pt_crew_rows {
    uint32_t kind, serial; /* serial: which slice; an answer to an older one is thrown away */
    uint32_t planes, count;
    struct pt_integrator integrator;
    struct pt_row rows[]; /* [count], followed by the sums of each (pt_row_save) */
};

/* A block to be judged, and the answer. */
struct pt_crew_block {
    uint32_t index, final; /* in the list of blocks; final: as for pt_criterion_evaluate */
    struct lull_host_block block;
    struct lull_decision decision;
};

struct pt_crew_ask {
    uint32_t kind, serial;
    uint32_t planes, count;
    double thread_s;               /* answer: processor seconds that it took */
    char error[512];               /* answer: why the criterion failed; empty: it did not */
    struct pt_crew_block blocks[]; /* [count]; in the question followed by the sums of each, row by row */
};

/* --- rank 0's view ---------------------------------------------------------------------------------------------------- */

/* Parcels that are with one member at a time: the one that it works on and the next. */
enum { PT_CREW_PARCELS = 2 };

struct pt_crew_mate {
    int ready, threads;
    int parcels;    /* with it now */
    double since_s; /* wall time since which it owes an answer */
};

struct pt_crew {
    struct base_peers *peers; /* borrows */
    double timeout_s;
    struct pt_crew_mate *mates; /* owns; [peers->count], 0 unused */
    int threads;
    int judges; /* all of them have opened the criterion's frame */
    uint32_t serial;
    int lost; /* a member is gone: nobody can be sent home */
    struct pt_crew_traffic traffic;
};

/* Hands a parcel to a member, which then owes an answer. */
int pt_crew_send(struct pt_crew *crew, int rank, void *message, size_t size, struct base_err *err);
/* An answer is there, of `size` bytes; fails when it is a member's last words. */
int pt_crew_settle(struct pt_crew *crew, int rank, const void *message, size_t size, struct base_err *err);
/* 0 while everybody is there and nobody wants an end; PT_CREW_STOPPED, or the failure that names who is missing. */
int pt_crew_look_round(struct pt_crew *crew, int (*interrupted)(void *data), void *data, struct base_err *err);
int pt_crew_nonsense(const struct pt_crew *crew, int rank, struct base_err *err);

#endif
