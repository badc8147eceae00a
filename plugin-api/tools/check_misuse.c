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

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

uint32_t lc_draw(struct lc_misuse *m, uint32_t below) /* SplitMix64 (Steele, Lea, Flood 2014) */
{
    uint64_t x = m->random += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (uint32_t)((x ^ (x >> 31)) >> 32) % below;
}

double lc_nonsense(struct lc_misuse *m)
{
    static const double numbers[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, 0, -1, 1e300, -1e300, 1e-320, 5e18};
    return numbers[lc_draw(m, sizeof numbers / sizeof *numbers)];
}

void lc_wrong(struct lc_misuse *m, uint32_t codes, const char *what)
{
    size_t length = strlen(m->what);
    snprintf(m->what + length, sizeof m->what - length, "%s%s", m->codes ? ", " : "", what);
    if (m->codes == 0)
        m->codes = codes;
    else if (codes == MAY || m->codes == MAY)
        m->codes = codes == m->codes ? MAY : REFUSED;
    else
        m->codes |= codes;
}

uint32_t lc_too_small(struct lc_misuse *m, size_t size) { return 8 * lc_draw(m, (uint32_t)(size / 8)); }

static const char untouched[] = "untouched";

struct lull_error *lc_announce(struct lc_misuse *m, const char *function)
{
    struct lull_error blank = {.code = INT_MAX, .message = "untouched"};
    const uint32_t form = lc_draw(m, 8);
    m->calls++;
    lc_doing(m->check, "call %llu of seed %llu: %s: %s", (unsigned long long)m->calls, (unsigned long long)m->check->seed,
             function, m->codes ? m->what : "as it should be");
    if (form == 0)
        return NULL;
    return lc_place_struct(m->check, &blank, form == 1 ? lc_too_small(m, sizeof blank) : sizeof blank);
}

void lc_judge(struct lc_misuse *m, int32_t status, const struct lull_error *err)
{
    const uint32_t allowed = m->codes ? m->codes : CODE(LULL_OK);
    struct lc *c = m->check;
    const char *call = c->report->doing;
    m->refused += (allowed & CODE(LULL_OK)) == 0;
    if (status > LULL_OK || status < LULL_E_INTERNAL || !(allowed & CODE(status))) {
        char fitting[64] = "";
        for (int32_t s = LULL_OK; s >= LULL_E_INTERNAL; s--)
            if (allowed & CODE(s))
                snprintf(fitting + strlen(fitting), sizeof fitting - strlen(fitting), " %d", s);
        lc_fail(c, "%s: status %d, expected%s", call, status, fitting);
    } else if (err && err->struct_size == sizeof *err) {
        int terminated = memchr(err->message, '\0', sizeof err->message) != NULL;
        int fits = status == LULL_OK ? err->code == INT_MAX && strcmp(err->message, untouched) == 0
                                     : err->code == status && terminated && err->message[0] != '\0' &&
                                           strcmp(err->message, untouched) != 0;
        LC_EXPECT(c, fits, "%s: status %d, but the error says %d, \"%.200s\"", call, status, err->code, err->message);
    }
}

uint32_t lc_how_many(struct lc_misuse *m)
{
    const uint32_t another = lc_draw(m, 4), more = lc_draw(m, 16);
    return 1u + (another == 0) + (more == 0);
}

static void call_loose(struct lc_misuse *m)
{
    const uint32_t which = lc_draw(m, 8);
    if (!m->loose)
        m->loose = lc_create(m->check, m->s.manner.host);
    if (!m->loose)
        return;
    m->instance = m->loose;
    if (which < 2)
        lc_loose_begin(m);
    else if (which == 2 && m->state && m->saved.size > 0)
        lc_loose_load(m);
    else
        lc_misuse_evaluate(m, 1);
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
        m->instance = m->s.instance;
        m->codes = 0;
        m->what[0] = '\0';
        if (which < 3)
            lc_misuse_create(m);
        else if (which < 4)
            lc_misuse_requirements(m);
        else if (which < 7)
            lc_misuse_begin(m);
        else if (which < 12)
            lc_misuse_evaluate(m, 0);
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
