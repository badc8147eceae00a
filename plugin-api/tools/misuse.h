/* SPDX-License-Identifier: MIT
 *
 * Calls outside the rules, for check_misuse.c.
 *
 * A call is made up from a good one: lc_wrong notes each thing that is spoilt and which codes fit it, lc_announce says it to
 * whoever finds the process dead, and lc_judge holds the answer against the codes. One thread.
 */
#ifndef LULL_CHECK_MISUSE_H
#define LULL_CHECK_MISUSE_H

#include "check.h"

/* Sets of statuses: the header's codes are -1 to -11. */
#define CODE(status) (UINT32_C(1) << -(status))
#define MAY (~UINT32_C(0)) /* the header leaves it open */
static const uint32_t INVALID = CODE(LULL_E_INVALID), VERSION = CODE(LULL_E_VERSION), PLANE = CODE(LULL_E_PLANE),
                      SIZE = CODE(LULL_E_INVALID) | CODE(LULL_E_VERSION), REFUSED = MAY & ~CODE(LULL_OK);

struct lc_misuse {
    struct lc *check;
    uint64_t random, calls, refused;
    struct lc_session s;         /* what must not be disturbed */
    struct lc_image image;       /* of its film */
    struct lull_instance *loose; /* owns; whatever it is given */
    const struct lull_state *state;
    struct lc_buffer saved; /* a state of the session */
    int open;               /* the session's frame is */

    /* the call that is being made up */
    struct lull_instance *instance;
    uint32_t codes; /* that fit what is wrong; 0: nothing is */
    char what[400];
};

/* --- check_misuse.c: what a call with wrong arguments is --------------------------------------------------------------- */

/* A random number below `below`. */
uint32_t lc_draw(struct lc_misuse *m, uint32_t below);
/* A number that makes no sense, or hardly any. */
double lc_nonsense(struct lc_misuse *m);
/* A size that is too small, a multiple of 8. */
uint32_t lc_too_small(struct lc_misuse *m, size_t size);
/* How many things are to be wrong: one, sometimes several. */
uint32_t lc_how_many(struct lc_misuse *m);

/* Notes what is wrong. Of several wrong things any may be complained about; a call is open to the criterion only if each
 * is. */
void lc_wrong(struct lc_misuse *m, uint32_t codes, const char *what);
/* An error struct, a short one, or none. */
struct lull_error *lc_announce(struct lc_misuse *m, const char *function);
/* Is this one of the expected statuses of the call that was announced, and does the error say the same? */
void lc_judge(struct lc_misuse *m, int32_t status, const struct lull_error *err);

/* --- the calls --------------------------------------------------------------------------------------------------------- */

/* What the header says is refused. */
void lc_misuse_create(struct lc_misuse *m);
void lc_misuse_requirements(struct lc_misuse *m);
void lc_misuse_begin(struct lc_misuse *m);
/* Of the extension lull.state/1, which the criterion has. */
void lc_misuse_save(struct lc_misuse *m);
void lc_misuse_load(struct lc_misuse *m);

/* What the header leaves open. */
void lc_loose_begin(struct lc_misuse *m);
void lc_loose_load(struct lc_misuse *m); /* of m->saved, which is not empty */

/* Either. */
void lc_misuse_evaluate(struct lc_misuse *m, int loose);

#endif
