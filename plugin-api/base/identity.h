/*
 * What a result depends on, written once: lines "key=value\n" that a checkpoint or another process keeps beside it and that
 * are compared before work goes on. Most lines are options, which say so in their table (base/options.h); the rest are
 * checksums of what was read. A zeroed object is an empty text. Not thread-safe.
 */
#ifndef BASE_IDENTITY_H
#define BASE_IDENTITY_H

#include <stddef.h>
#include <stdint.h>

#include "base/err.h"

/* What another value of a key means. Above BASE_DECIDES are the program's own numbers, for keys whose values may differ:
 * the result then goes on with others. */
enum { BASE_NO_IDENTITY, BASE_DECIDES, BASE_OWN_ROLE };

enum { BASE_IDENTITY_ROLES = 8 };
struct base_identity_role {
    const char *key; /* borrows static text */
    int role;
};

struct base_identity {
    char *text; /* owns; [size] and a NUL; NULL: nothing yet */
    size_t size;
    struct base_identity_role roles[BASE_IDENTITY_ROLES]; /* until the first without a key; every other key decides */
    int failed;                                           /* memory ran out: lines are missing */
};

/* Appends a line; what is no text in the value becomes '?'. */
void base_identity_add(struct base_identity *identity, const char *key, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/* Numbers with a blank behind each, in digits that tell every double apart; at most 16. */
void base_identity_add_reals(struct base_identity *identity, const char *key, const double *values, int count);
/* Lines with this key have a role of the program's own. */
void base_identity_role(struct base_identity *identity, const char *key, int role);
/* Appends all lines of another. */
void base_identity_append(struct base_identity *identity, const struct base_identity *other);
/* BASE_ENOMEM when lines are missing. */
int base_identity_check(const struct base_identity *identity, struct base_err *err);
void base_identity_release(struct base_identity *identity);

/* How a difference is put: NAME": made with" a=1, but "this render" has a=2. */
struct base_identity_words {
    const char *with, *without, *here;
};

/* Compares lines that were kept, theirs[0, size), with ours, key by key whatever their order; of a key that stands more than
 * once, line by line. BASE_EINVAL names the first difference that decides. *changed, which may be NULL, gets bit 1 << role
 * for each other role with a difference. Nothing is believed of theirs. */
int base_identity_compare(const struct base_identity *ours, const char *theirs, size_t size, const char *name,
                          const struct base_identity_words *words, unsigned *changed, struct base_err *err);

#endif
