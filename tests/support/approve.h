/*
 * Approval: a text against the one recorded in a file. It says that nothing has changed, not that it is right: what is recorded
 * was made by the product and read by somebody. To record anew, on purpose: RECORD=1 with the test, then read `git diff tests`.
 *
 * A record:
 *
 *     # exact                                    the first line says how near is the same: to the byte, or
 *     # decimals within 1e-5 of themselves + 3e-7     words and whole numbers as they are, other numbers so near, or
 *     # numbers within 2e-3 of themselves + 2e-5      whole numbers too
 *     # …; of each answer 12 lines and marks     longer answers are recorded by their first lines and a mark for each hundred others
 *     # comment          kept
 *     > words            what is asked, as the test understands it: a heading, or the first line of a case
 *     >> words           a further line of it
 *     = words            options of the next case
 *     @ a.ply words      a line of a file beside the case; \c at its end: the file ends there
 *       answer           two blanks before it
 *
 * Whatever the tolerance, the last digit of three or more decimals may turn, and errors ("-1: …") and warnings are exact. A mark holds
 * a checksum of the words and a weighted sum of the numbers' logarithms, with what the sum may be off (support/approve.c).
 * The whole of what a test said lies in $BUILD/approve/ when it differs, or always when the environment has WHOLE=1.
 * A new record begins as a file with its first line.
 */
#ifndef TESTS_SUPPORT_APPROVE_H
#define TESTS_SUPPORT_APPROVE_H

/* Called for each section in turn, a heading and the answer to it; difference: NULL, or what is recorded and what is said now. */
typedef void approve_report(void *user, const char *section, const char *difference);
/* The number of sections that differ, or -1 when the record cannot be read or written, which is reported of section NULL. The text is as
 * in a record, from the second line on. */
int approve(const char *path, const char *text, approve_report *report, void *user);

/* In a cmocka test, which fails with the differences. The text's headings begin with "> ", its answers need no blanks. */
void approve_text(const char *path, const char *text);

enum { APPROVE_TEXT = 1 << 14, APPROVE_FILES = 4 };

struct approve_case {
    char options[200], text[APPROVE_TEXT]; /* lines end in \n */
    struct {
        char name[64], text[APPROVE_TEXT];
    } files[APPROVE_FILES];
};

/* The answer to a case, malloc'ed. */
typedef char *approve_answer(struct approve_case *c);
/* In a cmocka test: asks all cases of a record. */
void approve_cases(const char *path, approve_answer *answer);

#endif
