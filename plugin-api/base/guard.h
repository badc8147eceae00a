/*
 * Around calls into libraries that do not live up to a lack of memory: constructors throw while a library is loaded,
 * pointers go unchecked, threads wait for one that never began. Nobody can go on behind such a call, but the process need
 * not be aborted, or wait for ever: it ends with one line and exit status 1, as for any other lack of memory.
 */
#ifndef BASE_GUARD_H
#define BASE_GUARD_H

/* For a program, once. Without it, as in a renderer that has the host library, the others do nothing. */
void base_guard_enable(void);

enum base_guard {
    BASE_GUARD_CALLS,
    BASE_GUARD_LOADING, /* what the libraries write to standard error is dropped */
    BASE_GUARD_START,   /* a minute ends the process, too: for what takes milliseconds, or waits for ever */
};

/* From here to base_guard_end(), what would end the process by std::terminate or a signal of the kind of SIGSEGV says `what`
 * (borrowed) instead. Pairs may nest and come from several threads: the first one counts. Behind them std::terminate, which
 * nothing but a library's own thread comes to, still ends with a line. */
void base_guard_begin(const char *what, enum base_guard how);
void base_guard_end(void);

#endif
