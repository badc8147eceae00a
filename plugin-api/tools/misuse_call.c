/* SPDX-License-Identifier: MIT */
#include "misuse.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
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

void lc_judge(struct lc_misuse *m, const char *function, int32_t status, const struct lull_error *err)
{
    const uint32_t allowed = m->codes ? m->codes : CODE(LULL_OK);
    struct lc *c = m->check;
    m->refused += (allowed & CODE(LULL_OK)) == 0;
    if (status > LULL_OK || status < LULL_E_INTERNAL || !(allowed & CODE(status))) {
        char fitting[64] = "";
        for (int32_t s = LULL_OK; s >= LULL_E_INTERNAL; s--)
            if (allowed & CODE(s))
                snprintf(fitting + strlen(fitting), sizeof fitting - strlen(fitting), " %d", s);
        lc_fail(c, "call %llu of seed %llu: %s: %s: status %d, expected%s", (unsigned long long)m->calls,
                (unsigned long long)c->seed, function, m->codes ? m->what : "as it should be", status, fitting);
    } else if (err && err->struct_size == sizeof *err) {
        int terminated = memchr(err->message, '\0', sizeof err->message) != NULL;
        int fits = status == LULL_OK ? err->code == INT_MAX && strcmp(err->message, untouched) == 0
                                     : err->code == status && terminated && err->message[0] != '\0' &&
                                           strcmp(err->message, untouched) != 0;
        LC_EXPECT(c, fits, "call %llu of seed %llu: %s: %s: status %d, but the error says %d, \"%.*s\"",
                  (unsigned long long)m->calls, (unsigned long long)c->seed, function, m->what, status, err->code, 200,
                  err->message);
    }
}

void lc_make_up(struct lc_misuse *m, struct lull_instance *instance)
{
    m->instance = instance;
    m->codes = 0;
    m->what[0] = '\0';
}

uint32_t lc_how_many(struct lc_misuse *m)
{
    const uint32_t another = lc_draw(m, 4), more = lc_draw(m, 16);
    return 1u + (another == 0) + (more == 0);
}
