/*
 * When memory runs out in the middle of a parallel loop of a library in C++, its exception cannot leave the loop, and the
 * process is aborted with what C++ says of it. Between these two it ends with a line and exit status 1 instead, as any other
 * lack of memory does. One thread at a time.
 */
#ifndef PT_GEOM_TERMINATE_H
#define PT_GEOM_TERMINATE_H

/* what: what memory was wanted for, as in base_fail_nomem; a literal. */
void pt_terminate_begin(const char *what);
void pt_terminate_end(void);

#endif
