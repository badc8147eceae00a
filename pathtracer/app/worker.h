/* Any process of an MPI job but rank 0. */
#ifndef PT_WORKER_H
#define PT_WORKER_H

#include "session.h"

/* Makes everything as rank 0 makes it, tells it what that is and works for it until the end. Who interrupts or ends the job
 * does it through rank 0. */
int pt_worker_run(struct pt_session *session, struct base_err *err);

#endif
