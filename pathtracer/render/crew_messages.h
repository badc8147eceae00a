/* What rank 0 and the crew say to each other; private to crew.c and crew_member.c. Each message begins with its kind. All
 * processes run the same program on machines of the same kind: structs travel as they are. */
#ifndef PT_RENDER_CREW_MESSAGES_H
#define PT_RENDER_CREW_MESSAGES_H

#include <stdint.h>

#include "integ/integrator.h"
#include "render/rows.h"

enum pt_crew_kind {
    PT_CREW_HELLO,  /* member: ready; what must be the same everywhere follows as text */
    PT_CREW_FAILED, /* member: it cannot go on; why follows as text */
    PT_CREW_ROWS,   /* rank 0: sample these; the member sends the same message back, done */
    PT_CREW_END,    /* rank 0: there is no more to do */
    PT_CREW_BYE     /* member: its last message */
};

struct pt_crew_hello {
    uint32_t kind, threads;
    char text[]; /* the rest of the message, without terminator */
};

struct pt_crew_rows {
    uint32_t kind, serial; /* serial: which slice; an answer to an older one is thrown away */
    uint32_t planes, count;
    struct pt_integrator integrator;
    struct pt_row rows[]; /* [count], followed by the sums of each (pt_row_save) */
};

#endif
