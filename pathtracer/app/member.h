/* Any process of an MPI job but rank 0. */
#ifndef PT_MEMBER_H
#define PT_MEMBER_H

#include "session.h"

/* Makes everything as rank 0 makes it, tells it what that is and works for it until the end. rc: what became of the command
 * line, with err. Who interrupts or ends the job does it through rank 0. */
int pt_member_serve(struct pt_session *session, int rc, struct base_err *err);

#endif
