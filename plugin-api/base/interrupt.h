/*
 * Being asked to end: SIGINT, SIGTERM, SIGHUP (the terminal or the connection is gone) and SIGXCPU (the soft limit of
 * processor time). A program that catches them ends its work where it can, leaves its outputs whole, and exits with status
 * 130.
 */
#ifndef BASE_INTERRUPT_H
#define BASE_INTERRUPT_H

#include <signal.h>

/* What a program calls first: SIGXFSZ is ignored. A file that may not grow (ulimit -f) is an error of what is written, as on
 * a full disk, and no end without a word. Standard input, output and error that are closed become /dev/null: else files and
 * connections would get their numbers, and what is said would go into them. */
void base_interrupt_begin(void);

/* What a program calls last: flushes standard output and returns the exit status. What did not get out is said in a line
 * that begins with `program` (NULL: nothing is said) and makes a status of 0 one of bad input; but whoever reads a pipe may
 * stop reading, as `head` does: then nothing is said, and the status is that of SIGPIPE. */
int base_interrupt_end(const char *program, int status);

/* How often it was asked to end. */
extern volatile sig_atomic_t base_interrupted;

/* From here on the first signal of a kind asks and a second one kills, but SIGXCPU, which comes again and again, only asks.
 * Under nohup SIGHUP stays ignored (a shell that ignores SIGINT for what it runs in the background means its own). SIGPIPE
 * is ignored: whoever read what the program says may go away without ending it. */
void base_interrupt_catch(void);
/* For a process that another one tells when to end: all are ignored. */
void base_interrupt_ignore(void);

#endif
