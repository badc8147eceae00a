/*
 * A member of the crew (crew.h): any process of an MPI job but rank 0. It samples the rows that it is sent and sends them
 * back, and asks the criterion about blocks that it is sent; of the image it knows nothing else.
 */
#ifndef PT_RENDER_CREW_MEMBER_H
#define PT_RENDER_CREW_MEMBER_H

#include "base/err.h"
#include "base/peers.h"
#include "base/threads.h"
#include "render/render.h"

/* What a member works with; borrows. */
struct pt_crew_tools {
    struct base_threads *threads;
    struct pt_row_maker maker; /* its integrator is not used: it comes with the rows */
    struct pt_render *render;  /* whose criterion is asked, made like that of rank 0; NULL: rows only */
};

/* Tells rank 0 that this process is ready; text: the lines that must be those of rank 0. */
int pt_crew_member_join(struct base_peers *peers, const struct pt_crew_tools *tools, const char *text, struct base_err *err);
/* Tells rank 0 why it cannot go on. */
int pt_crew_member_fail(struct base_peers *peers, const struct base_err *why, struct base_err *err);
/* Works until rank 0 says that it is over; without tools (NULL), after a failure, it only waits for that. A failure has been
 * told to rank 0. */
int pt_crew_member_serve(struct base_peers *peers, const struct pt_crew_tools *tools, struct base_err *err);

#endif
