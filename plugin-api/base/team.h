/*
 * Processes that work in step (over base/peers.h): each does its share of a piece of work, then all have the whole of it.
 *
 * Every process makes the same calls in the same order. Everything passes rank 0, which therefore knows who is missing and
 * names him. Whole results are put together in the order of the ranks, so that they are the same whatever arrives first. The
 * first failure stays: every later call fails at once, with what was to be shared left as it was. NULL is a team of one, for
 * which every call does nothing and succeeds. Only the thread that opened the peers may call what sends or receives.
 */
#ifndef BASE_TEAM_H
#define BASE_TEAM_H

#include <signal.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/peers.h"

struct base_team;

/* Opens the peers of this process; *out is NULL where it has none. */
int base_team_open(struct base_team **out, struct base_err *err);
/* Of peers that are there already and become the team's own. */
int base_team_create(struct base_peers *peers, struct base_team **out, struct base_err *err);
/* The end of this process's part: what went wrong (text, of status not 0) reaches rank 0. There it returns the exit status
 * of all, after everybody's part has ended: its own, else the first other that is not 0, with its text in *err. A team that
 * has lost somebody ends here and now. Releases the team. NULL is allowed. */
int base_team_close(struct base_team *team, int status, const char *text, struct base_err *err);

/* From now on a process that owes its part for timeout_s is given up (0: never), and when *interrupted becomes set at rank 0
 * it looks whether that is because a process has died. interrupted may be NULL and is borrowed. */
void base_team_watch(struct base_team *team, double timeout_s, const volatile sig_atomic_t *interrupted);

int base_team_rank(const struct base_team *team);    /* 0 without team */
int base_team_count(const struct base_team *team);   /* 1 without */
int base_team_threads(const struct base_team *team); /* as base_peers_threads */

/* What went to and fro at this process so far. */
struct base_team_traffic {
    uint64_t messages, bytes;
    double waiting_s; /* wall seconds in which it had nothing to do but wait */
};
struct base_team_traffic base_team_traffic(const struct base_team *team);

/* Of n items in order, those of `rank` are [first(rank), first(rank + 1)). */
long base_team_first(const struct base_team *team, long n, int rank);
/* The largest share of n items. */
long base_team_most(const struct base_team *team, long n);

/* Refuses (BASE_EINVAL, at rank 0) a process whose lines of key=value are not those of rank 0. */
int base_team_agree(struct base_team *team, const char *text, struct base_err *err);
/* Everybody gets rank 0's bytes. */
int base_team_tell(struct base_team *team, void *data, size_t size);
/* all: bytes [start[r], start[r + 1]) have been filled by rank r; then everybody has all of them. start: [count + 1]. */
int base_team_gather(struct base_team *team, void *all, const size_t *start);
/* The same of n items of `size` bytes, shared out as base_team_first says. */
int base_team_gather_items(struct base_team *team, void *items, size_t size, long n);
/* Hands bytes to rank 0, which gets everybody's [count], but for its own; they may be written into and are there until the
 * next call, which must be base_team_tell: else somebody could be a call ahead. NULL at the others, without team, and after
 * a failure. */
struct base_team_part {
    void *data;
    size_t size;
};
const struct base_team_part *base_team_collect(struct base_team *team, const void *mine, size_t size);

/* A part of that rank is not what it should be: a failure. */
int base_team_refuse(struct base_team *team, int rank);
/* Whether everybody is still there, of whom rank 0 can tell; a failure otherwise. */
int base_team_look(struct base_team *team);
/* The first failure of any call so far, 0: none. */
int base_team_failed(const struct base_team *team, struct base_err *err);

#endif
