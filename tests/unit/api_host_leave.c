/* A criterion that changes what is the renderer's, and one that answers what nobody may: the renderer goes on as it was. */
#define _GNU_SOURCE /* locale_t */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <fenv.h>
#include <locale.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "support/api_host_film.h"

enum mischief { ROUNDING, BLOCKED, THREAD_LOCALE, LOCALE, HANDLER, TASK };

static struct lull_criterion own; /* the table as it was */
static enum mischief mischief;
static locale_t other_locale;

static void turn_rounding(void *arg, uint64_t task, uint32_t worker)
{
    (void)arg;
    (void)task;
    (void)worker;
    fesetround(FE_UPWARD);
}

static void misbehave(const struct lull_host *host)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    switch (mischief) {
    case ROUNDING: turn_rounding(NULL, 0, 0); break;
    case BLOCKED: pthread_sigmask(SIG_BLOCK, &set, NULL); break;
    case THREAD_LOCALE: uselocale(other_locale); break;
    case LOCALE: assert_non_null(setlocale(LC_NUMERIC, "C.UTF-8")); break;
    case HANDLER: signal(SIGTERM, SIG_IGN); break;
    case TASK: assert_int_equal(host->parallel_for(host, 1, turn_rounding, NULL), LULL_OK); break;
    }
}

static int32_t bad_create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                          struct lull_instance **out, struct lull_error *e)
{
    misbehave(host);
    return own.create(host, pairs, count, stride, out, e);
}

static int32_t bad_evaluate(struct lull_instance *in, const struct lull_view *seen, const struct lull_block *blocks,
                            uint32_t block_stride, struct lull_decision *decisions, uint32_t decision_stride, uint32_t count,
                            struct lull_error *e)
{
    misbehave(in->host);
    return own.evaluate(in, seen, blocks, block_stride, decisions, decision_stride, count, e);
}

/* All is as it was read, and this was said. */
static void expect_as_before(const struct lull_process_state *before, const char *warning)
{
    const char *changed = lull_process_state_restore(before);
    if (changed)
        fail_msg("changed: %s", changed);
    assert_string_equal(warned, warning);
    warned[0] = '\0';
}

static void what_a_call_changes_is_put_back(void **state)
{
    static const char *const told[] = {"1: criterion logger: evaluate changed the floating-point control register; restored",
                                       "1: criterion logger: evaluate changed which signals are blocked; restored",
                                       "1: criterion logger: evaluate changed the locale of the thread; restored",
                                       "1: criterion logger: evaluate changed the decimal point of the locale; restored",
                                       NULL, /* while it renders, the handlers are others' */
                                       "1: criterion logger: a task changed the floating-point control register; restored"};
    static const uint32_t due[1] = {2};
    struct lull_decision got[1];
    struct lull_process_state before;
    (void)state;
    for (size_t i = 0; i < sizeof told / sizeof told[0]; i++) {
        if (!told[i])
            continue;
        set_up(ALL_PLANES, 0);
        begin();
        mischief = (enum mischief)i;
        table.evaluate = bad_evaluate;
        lull_process_state_read(&before);
        for (int again = 0; again < 2; again++) { /* it is said once */
            assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_OK);
            expect_as_before(&before, again ? "" : told[i]);
        }
        table = own;
        tear_down();
    }
}

static void what_create_changes_is_put_back(void **state)
{
    struct lull_process_state before;
    (void)state;
    lull_process_state_read(&before);
    mischief = HANDLER;
    table.create = bad_create;
    set_up(ALL_PLANES, 0);
    table = own;
    expect_as_before(&before, "1: criterion logger: create changed what a signal does; restored");
    tear_down();
}

/* --- answers ------------------------------------------------------------------------------------------------------------ */

static int32_t failing_create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                              struct lull_instance **out, struct lull_error *e)
{
    (void)host;
    (void)pairs;
    (void)count;
    (void)stride;
    *out = (struct lull_instance *)(uintptr_t)16; /* of which nothing must be believed */
    memset(e->message, 'x', sizeof e->message);
    memcpy(e->message, "one\ntwo\a", 8);
    return 7;
}

static int32_t empty_create(const struct lull_host *host, const struct lull_pair *pairs, uint32_t count, uint32_t stride,
                            struct lull_instance **out, struct lull_error *e)
{
    (void)host;
    (void)pairs;
    (void)count;
    (void)stride;
    (void)out;
    (void)e;
    return LULL_OK;
}

static void a_create_that_fails_oddly_fails(void **state)
{
    (void)state;
    err = (struct lull_error){.struct_size = sizeof err};
    table.create = failing_create;
    assert_int_equal(lull_host_create(&services, &table, NULL, 0, &criterion, &err), LULL_E_INTERNAL);
    assert_memory_equal(err.message, "criterion logger: one two xxx", 29);
    table.create = empty_create;
    assert_int_equal(lull_host_create(&services, &table, NULL, 0, &criterion, &err), LULL_E_INTERNAL);
    assert_string_equal(err.message, "criterion logger: create made no instance");
    table = own;
}

static void what_cannot_be_is_not_known(void **state)
{
    static const uint32_t due[1] = {2};
    struct lull_decision got[1];
    (void)state;
    set_up(ALL_PLANES, 0);
    begin();
    for (int i = 0; i < 2; i++) {
        const double odd = i ? (double)INFINITY : -1;
        heard.answer[2] = (struct lull_decision){.p_noisy = odd, .error = -0.5, .predicted_spp = -3};
        assert_int_equal(lull_host_evaluate(criterion, frame, &view, due, NULL, 1, got, &err), LULL_OK);
        assert_true(isnan(got[0].p_noisy) && isnan(got[0].error) && isnan(got[0].predicted_spp));
    }
    tear_down();
}

static void what_it_says_is_one_line(void **state)
{
    (void)state;
    set_up(ALL_PLANES, 0);
    lull_host_say(criterion, LULL_LOG_WARNING, "one\ntwo\x1b[2J");
    assert_string_equal(warned, "1: criterion logger: one two [2J");
    lull_host_say(criterion, LULL_LOG_WARNING, NULL);
    assert_string_equal(warned, "1: criterion logger: ");
    tear_down();
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_a_call_changes_is_put_back), cmocka_unit_test(what_create_changes_is_put_back),
        cmocka_unit_test(a_create_that_fails_oddly_fails), cmocka_unit_test(what_cannot_be_is_not_known),
        cmocka_unit_test(what_it_says_is_one_line)};
    own = table;
    other_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    freelocale(other_locale);
    return failed;
}
