/*
 * Approval: a text against the one recorded in tests/golden/NAME.txt, words as they are, numbers within a tolerance. What is recorded was
 * made by the product and looked at; it says that nothing has changed, not that it is right.
 *
 * To record anew, on purpose: RECORD=1 build/tests/…/PROGRAM, then look at `git diff tests/golden`.
 */
#ifndef TESTS_SUPPORT_GGN_APPROVE_H
#define TESTS_SUPPORT_GGN_APPROVE_H

/* tolerance: of numbers, relative to the recorded one or to 0.01, whichever is larger; at least 1e-6 of numbers with decimals, and one
 * in the last of three or more. Fails the running cmocka test with the line that differs. */
void ggn_approve(const char *name, const char *text, double tolerance);

#endif
