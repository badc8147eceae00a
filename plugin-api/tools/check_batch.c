/* SPDX-License-Identifier: MIT
 *
 * The same questions put in other ways.
 */
#include "check.h"

void lc_check_repeat(struct lc *c)
{
    struct lc_manner twice = {.ask = LC_ASK_TWICE};
    if (!lc_deterministic(c))
        lc_note(c, "not deterministic: compared with a tolerance");
    lc_run_both(c, NULL, NULL, "the same session once more");
    lc_run_both(c, NULL, &twice, "each question twice");
    if (c->req.block_width == 0 && c->req.block_height == 0)
        return;
    struct lc_manner nominal = {.nominal = 1}, nominal_singly = {.nominal = 1, .ask = LC_ASK_SINGLY};
    int invariant = (c->criterion->capabilities & LULL_CAP_BATCH_INVARIANT) != 0;
    lc_run_both(c, &nominal, invariant ? &nominal_singly : &nominal, "blocks of the size it was made for, once more");
}

void lc_check_batch(struct lc *c)
{
    if (!(c->criterion->capabilities & LULL_CAP_BATCH_INVARIANT)) {
        lc_skip(c, "it does not declare BATCH_INVARIANT");
        return;
    }
    struct lc_manner reversed = {.ask = LC_ASK_REVERSED}, singly = {.ask = LC_ASK_SINGLY};
    lc_run_both(c, NULL, &reversed, "blocks in reverse order");
    lc_run_both(c, NULL, &singly, "one block per call");
}

/* Two instances whose calls alternate, on different pictures. */
void lc_check_two(struct lc *c)
{
    struct lc_manner one = {.seed = 1}, two = {.seed = 2};
    struct lc_log alone[2];
    struct lc_session a, b;
    if (lc_run(c, &one, &alone[0]) != 0 || lc_run(c, &two, &alone[1]) != 0)
        return;
    if (lc_session_open(&a, c, &one) == 0) {
        if (lc_session_open(&b, c, &two) == 0) {
            for (int i = 0; i < LC_STEPS; i++) {
                lc_session_step(&a);
                lc_session_step(&b);
            }
            lc_log_compare(c, &alone[0], &a.log, lc_deterministic(c), "first of two instances");
            lc_log_compare(c, &alone[1], &b.log, lc_deterministic(c), "second of two instances");
            lc_session_close(&b);
        }
        lc_session_close(&a);
    }
}
