/* What the host offers a criterion while it runs: messages for people and a parallel loop. */
#ifndef PT_RENDER_HOST_SERVICES_H
#define PT_RENDER_HOST_SERVICES_H

#include <lull/criterion.h>

#include "base/threads.h"

struct pt_host_services {
    const char *name;               /* of the criterion, for messages; borrows */
    struct base_threads *threads;   /* borrows; NULL = one worker */
    void (*warn)(void *data, const char *line); /* may be NULL */
    void *warn_data;
};

/* The table for lull_criterion.create. *services must stay where it is as long as the criterion lives. */
struct lull_host pt_host_services_table(struct pt_host_services *services);

#endif
