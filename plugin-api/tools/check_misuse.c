/* SPDX-License-Identifier: MIT
 *
 * Random calls outside the rules. A good session and calls that the header forbids take turns; what is wrong with a call is
 * drawn from tables, one thing or several at once, by a seed.
 *
 * - What the header says is refused must be refused, with one of the codes that fit what is wrong and with a message, and
 *   must leave no trace: the good session ends with the answers that it gives undisturbed.
 * - Where the header leaves it open (blocks that overlap, an exposure of NaN, samples that become fewer) a second instance
 *   is asked, which is thrown away: it may refuse or answer, but not with nonsense.
 *
 * All memory that a call is given ends right before a page that cannot be touched, structs that are too short included. Not
 * tried, since nothing is promised: calls after destroy, pointers to nowhere, arrays shorter than their count.
 */
#include "misuse.h"

#include <stdlib.h>

static void call_loose(struct lc_misuse *m)
{
    const uint32_t which = lc_draw(m, 8);
    if (!m->loose)
        m->loose = lc_create(m->check, m->s.manner.host);
    if (!m->loose)
        return;
    lc_make_up(m, m->loose);
    if (which < 2)
        lc_loose_begin(m);
    else if (which == 2 && m->state && m->saved.size > 0)
        lc_loose_load(m);
    else
        lc_loose_evaluate(m);
}

/* Calls that answer with a pointer. */
static void call_lookup(struct lc_misuse *m)
{
    static const char *const ids[] = {"",    "lull.state", "lull.state/", "lull.state/2", "lull.state/11", "LULL.STATE/1",
                                      "%n%s"};
    struct lc *c = m->check;
    const char *id = ids[lc_draw(m, sizeof ids / sizeof *ids)];
    lc_doing(c, "call %llu of seed %llu: get_extension(\"%s\")", (unsigned long long)++m->calls, (unsigned long long)c->seed,
             id);
    LC_EXPECT(c, !c->criterion->get_extension(id), "it claims the extension \"%s\"", id);
    c->criterion->destroy(NULL);
    if (!m->open)
        c->criterion->end_frame(m->s.instance);
}

static void disturb(struct lc_misuse *m)
{
    const uint64_t most = m->check->misuse, end = m->calls + lc_draw(m, 40);
    while (m->calls < end && m->calls < most && !m->check->report->failures) {
        const uint32_t which = lc_draw(m, 20);
        if (which < 3)
            lc_misuse_create(m);
        else if (which < 4)
            lc_misuse_requirements(m);
        else if (which < 7)
            lc_misuse_begin(m);
        else if (which < 12)
            lc_misuse_evaluate(m);
        else if (which < 14 && m->state)
            (which == 12 ? lc_misuse_save : lc_misuse_load)(m);
        else if (which < 19)
            call_loose(m);
        else
            call_lookup(m);
    }
}

/* The image and the state as they are now, then calls. */
static void disturb_session(struct lc_misuse *m)
{
    struct lc *c = m->check;
    lc_session_image(&m->s, &m->image);
    if (m->open && m->state) {
        struct lull_error err = {.struct_size = sizeof err};
        free(m->saved.data);
        m->saved = (struct lc_buffer){.limit = UINT64_MAX};
        LC_EXPECT(c, lc_state_save(m->state, &m->s, &m->saved, &err) == LULL_OK, "save: %s", err.message);
    }
    disturb(m);
    lc_image_release(&m->image);
}

static void end_frame(struct lc_misuse *m)
{
    m->check->criterion->end_frame(m->s.instance);
    m->open = m->s.open = 0;
}

/* A session from create to destroy, disturbed before, between and after its steps. */
static void live(struct lc_misuse *m, const struct lc_log *expected)
{
    struct lc *c = m->check;
    struct lc_host host;
    struct lc_manner manner = {0};
    lc_host_init(&host, c, 1);
    host.reverse = (int)lc_draw(m, 2);
    manner.host = lc_draw(m, 2) ? &host.host : NULL;
    if (lc_session_open(&m->s, c, &manner) == 0) {
        struct lull_frame frame;
        end_frame(m);
        disturb_session(m);
        lc_film_frame(&m->s.film, &frame, m->s.planes);
        m->open = m->s.open = LC_EXPECT(c, lc_begin(c, m->s.instance, &frame, NULL) == LULL_OK,
                                        "after %llu refused calls no frame can be begun", (unsigned long long)m->refused);
        for (int step = 0; step < LC_STEPS && !c->report->failures; step++) {
            disturb_session(m);
            lc_session_step(&m->s);
        }
        if (!c->report->failures)
            lc_log_compare(c, expected, &m->s.log, lc_deterministic(c), "after refused calls");
        end_frame(m);
        disturb_session(m);
        lc_session_close(&m->s);
    }
    c->criterion->destroy(m->loose);
    m->loose = NULL;
}

void lc_check_misuse(struct lc *c)
{
    struct lc_misuse m = {.check = c, .random = c->seed, .state = c->criterion->get_extension(LULL_EXT_STATE)};
    struct lc_log expected;
    if (lc_run(c, NULL, &expected) == 0)
        while (m.calls < c->misuse && !c->report->failures)
            live(&m, &expected);
    lc_note(c, "%llu calls, %llu of them had to be refused", (unsigned long long)m.calls, (unsigned long long)m.refused);
    free(m.saved.data);
}
