/*
 * Recorded answers: a text file with cases and what the product answers to each, compared token by token (numbers within bounds).
 *
 *     # comment          kept
 *     = words            options of the next case, for whoever answers
 *     @ a.ply text       a line of a file beside the case; \c at its end: the file ends there
 *     > text             the first line of the case
 *     >> text            each further one
 *       answer           two blanks before it; made anew when the environment has RECORD=1, and then to be read
 */
#ifndef TESTS_SUPPORT_PT_APPROVE_H
#define TESTS_SUPPORT_PT_APPROVE_H

enum { PT_APPROVE_TEXT = 1 << 14, PT_APPROVE_FILES = 4 };

struct pt_approve_case {
    char options[200], text[PT_APPROVE_TEXT]; /* lines end in \n */
    struct {
        char name[64], text[PT_APPROVE_TEXT];
    } files[PT_APPROVE_FILES];
};

/* The answer to a case, malloc'ed. */
typedef char *pt_approve_answer(struct pt_approve_case *c);

/* Fails the test, with the first difference of each case, unless the answers are those in the file. */
void pt_approve(const char *path, pt_approve_answer *answer);
/* The same characters and whole numbers; others may differ in the sixth digit, or in the last one that is printed of three or more
 * decimals: sums in another order, sines of another C library. */
int pt_approve_same(const char *a, const char *b);

#endif
