/* SPDX-License-Identifier: MIT
 *
 * The same questions put in other ways: once more, in another order, to other instances, by the host's workers, in
 * concurrent calls, with another floating-point environment. Run a TSan build of lull-check and of the criterion to find
 * races, not only their results.
 */
#include "check.h"

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

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

void lc_check_workers(struct lc *c)
{
    struct lc_log expected;
    if (lc_run(c, NULL, &expected) != 0)
        return;
    for (uint32_t threads = 1; threads <= c->workers; threads *= 2)
        for (int reverse = 0; reverse < 2; reverse++) {
            struct lc_host host;
            lc_host_init(&host, c, threads);
            host.reverse = reverse;
            struct lc_manner hosted = {.host = &host.host};
            if (lc_run_as(c, &hosted, &expected, 1, "parallel_for of the host") < 0)
                lc_note(c, "that was with %u workers", host.host.max_workers);
        }
}

void lc_check_concurrent(struct lc *c)
{
    if (c->criterion->thread_level < LULL_THREADS_FULL) {
        lc_skip(c, "it does not declare FULL");
        return;
    }
    struct lc_log expected;
    struct lc_host host;
    if (lc_run(c, NULL, &expected) != 0)
        return;
    lc_host_init(&host, c, 4);
    for (int i = 0; i < 4; i++) {
        struct lc_manner concurrent = {.ask = LC_ASK_CONCURRENTLY, .host = &host.host, .slack = i % 2 ? 8 : 0};
        lc_run_as(c, &concurrent, &expected, 1, "concurrent calls");
    }
}

struct instance_thread {
    struct lc *check;
    struct lc_log log;
    int result;
};

static void *instance_run(void *arg)
{
    struct instance_thread *t = arg;
    t->result = lc_run(t->check, NULL, &t->log);
    return NULL;
}

void lc_check_instances(struct lc *c)
{
    enum { THREADS = 3 };
    if (c->criterion->thread_level < LULL_THREADS_INSTANCE) {
        lc_skip(c, "it declares NONE");
        return;
    }
    struct lc_log expected;
    if (lc_run(c, NULL, &expected) != 0)
        return;
    c->concurrent = 1;
    struct instance_thread threads[THREADS];
    for (int i = 0; i < THREADS; i++)
        threads[i].check = c;
    lc_at_once(instance_run, threads, sizeof *threads, THREADS);
    for (int i = 0; i < THREADS; i++)
        if (threads[i].result == 0)
            lc_log_compare(c, &expected, &threads[i].log, lc_deterministic(c), "one of three concurrent instances");
    c->concurrent = 0;
}

/* Every call already compares the control register; here with a host that flushes subnormals and traps nothing. */
void lc_check_fp(struct lc *c)
{
    struct lc_log expected, got;
    struct lull_process_state before, after;
    lull_process_state_read(&before);
    if (lc_run(c, NULL, &expected) != 0)
        return;
    lull_process_state_read(&after);
    LC_EXPECT(c, after.thread_count <= before.thread_count, "a session left %ld thread(s) behind",
              after.thread_count - before.thread_count);
#if defined(__SSE__)
    enum { FTZ_DAZ = 0x8040 };
    _mm_setcsr(_mm_getcsr() | FTZ_DAZ);
    int result = lc_run(c, NULL, &got);
    LC_EXPECT(c, (_mm_getcsr() & FTZ_DAZ) == FTZ_DAZ, "a session changed the host's FTZ or DAZ");
    _mm_setcsr(_mm_getcsr() & ~(unsigned)FTZ_DAZ);
    if (result == 0)
        lc_log_compare(c, &expected, &got, 0, "with FTZ and DAZ");
#else
    (void)got;
    lc_note(c, "FTZ and DAZ are not tried on this machine");
#endif
}
