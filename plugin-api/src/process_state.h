/* SPDX-License-Identifier: MIT
 *
 * What a library must not change when it is loaded or called: the calling thread's floating-point control register and the
 * number of threads of the process. Thread safe; the count is a snapshot.
 */
#ifndef LULL_PROCESS_STATE_H
#define LULL_PROCESS_STATE_H

struct lull_process_state {
    unsigned long long fp_control; /* MXCSR without its status flags, FPCR; 0 on other machines */
    long thread_count;             /* 0 if the system does not say */
};

void lull_process_state_read(struct lull_process_state *state);

/* Sets the calling thread's floating-point control register to what it was. */
void lull_process_state_restore(const struct lull_process_state *state);

#endif
