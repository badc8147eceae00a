/* SPDX-License-Identifier: MIT
 *
 * What a library must not change when it is loaded or called: how the calling thread calculates, which signals it takes,
 * what it and the process take for a decimal point; what signals do; the number of threads. Thread safe, but that another
 * thread may change what is of the process; the count is a snapshot.
 */
#ifndef LULL_PROCESS_STATE_H
#define LULL_PROCESS_STATE_H

#include <locale.h>
#include <signal.h>

enum { LULL_STATE_SIGNALS = 5, LULL_STATE_LOCALE = 64 };

struct lull_process_state {
    unsigned long long fp_control; /* MXCSR without its status flags, FPCR; 0 on other machines */
    unsigned short x87_control;    /* of x86; else 0 */
    sigset_t blocked;              /* signals, by the thread */
    locale_t thread_locale;
    char locale[LULL_STATE_LOCALE]; /* LC_NUMERIC of the process; "" where its name is longer */
    int has_actions;                /* those below were read */
    struct sigaction actions[LULL_STATE_SIGNALS];
    long thread_count; /* 0 if the system does not say */
};

/* All; the count takes memory. */
void lull_process_state_read(struct lull_process_state *state);
/* All but the count. */
void lull_signal_state_read(struct lull_process_state *state);
/* What a call must leave as it is, however short: all above `has_actions`. */
void lull_thread_state_read(struct lull_process_state *state);

/* The calling thread's MXCSR or FPCR, as above. */
unsigned long long lull_fp_control_get(void);
void lull_fp_control_set(unsigned long long value);

/* Puts back what is otherwise now, of what was read, but for threads. What that was, in words; NULL: nothing. */
const char *lull_process_state_restore(const struct lull_process_state *state);

#endif
