/* SPDX-License-Identifier: MIT
 *
 * create and its parameters, requirements.
 */
#include "check.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Creates with the command line's parameters and one more, and destroys. */
static int32_t try_pair(struct lc *c, const char *key, const char *value, struct lull_error *err)
{
    struct lull_pair pairs[LC_PAIRS_MAX + 1];
    uint32_t count = c->pair_count;
    memcpy(pairs, c->pairs, sizeof c->pairs);
    pairs[count++] = (struct lull_pair){key, value};
    struct lull_instance *const untouched = (struct lull_instance *)(void *)&pairs;
    struct lull_instance *instance = untouched;
    *err = (struct lull_error){.struct_size = sizeof *err};
    int32_t status = c->criterion->create(NULL, pairs, count, sizeof *pairs, &instance, err);
    if (status == LULL_OK) {
        LC_EXPECT(c, instance != untouched, "create succeeded without an instance (%s=%s)", key, value);
        LC_EXPECT(c, err->code == 0 && err->message[0] == '\0', "create succeeded and filled the error (%s=%s)", key, value);
        if (instance != untouched)
            c->criterion->destroy(instance);
    } else {
        LC_EXPECT(c, instance == untouched, "create failed and touched the instance (%s=%s)", key, value);
        LC_EXPECT(c, status < 0, "create returned the positive number %d (%s=%s)", status, key, value);
        LC_EXPECT(c, err->code == status, "the error's code is %d, the status %d (%s=%s)", err->code, status, key, value);
        LC_EXPECT(c, memchr(err->message, '\0', sizeof err->message) != NULL, "the error's message has no end");
        LC_EXPECT(c, err->message[0] != '\0', "create failed without a message (%s=%s)", key, value);
    }
    return status;
}

static void expect_status(struct lc *c, const char *key, const char *value, int32_t expected)
{
    struct lull_error err;
    int32_t status = try_pair(c, key, value, &err);
    LC_EXPECT(c, status == expected, "%s=%.60s: status %d, expected %d", key, value, status, expected);
    if (expected != LULL_OK && status == expected)
        LC_EXPECT(c, strstr(err.message, key) != NULL, "%s=%.60s: the message does not name the key: %s", key, value,
                  err.message);
}

void lc_check_unknown_key(struct lc *c)
{
    expect_status(c, "no-such-parameter", "1", LULL_E_KEY);
    expect_status(c, "", "1", LULL_E_KEY);
    for (uint32_t i = 0; i < c->criterion->param_count; i++) {
        char longer[80];
        snprintf(longer, sizeof longer, "%sx", lc_param(c, i)->name);
        int known = 0;
        for (uint32_t k = 0; k < c->criterion->param_count; k++)
            known |= strcmp(lc_param(c, k)->name, longer) == 0;
        if (!known)
            expect_status(c, longer, "1", LULL_E_KEY);
    }
}

static void check_choices(struct lc *c, const struct lull_param *p)
{
    char choice[200];
    for (const char *at = p->choices; *at != '\0';) {
        size_t length = strcspn(at, "|");
        snprintf(choice, sizeof choice, "%.*s", (int)(length < 199 ? length : 199), at);
        expect_status(c, p->name, choice, LULL_OK);
        at += length + (at[length] == '|');
    }
    expect_status(c, p->name, "no such choice", LULL_E_VALUE);
    expect_status(c, p->name, "", LULL_E_VALUE);
}

/* A value beyond the end of a range, if the type has one. */
static int beyond(double limit, double direction, char text[400])
{
    double v = limit + direction * fmax(1, fabs(limit) * 0.01);
    if (!isfinite(v))
        return 0;
    snprintf(text, 400, "%.0f", direction > 0 ? ceil(v) : floor(v));
    return 1;
}

void lc_check_params(struct lc *c)
{
    static const char *const not_numbers[] = {"",    " ",   "x",  "1x",   "1 2", "--1",
                                              "nan", "inf", "1e", "0x10", "1,5", "1e99999"};
    for (uint32_t i = 0; i < c->criterion->param_count; i++) {
        const struct lull_param *p = lc_param(c, i);
        if (p->default_value)
            expect_status(c, p->name, p->default_value, LULL_OK);
        if (p->type <= LULL_PARAM_BOOL)
            for (size_t k = 0; k < sizeof not_numbers / sizeof *not_numbers; k++)
                expect_status(c, p->name, not_numbers[k], LULL_E_VALUE);
        char text[400];
        if (p->type <= LULL_PARAM_FLOAT && beyond(p->max, 1, text))
            expect_status(c, p->name, text, LULL_E_VALUE);
        if (p->type <= LULL_PARAM_FLOAT && beyond(p->min, -1, text))
            expect_status(c, p->name, text, LULL_E_VALUE);
        if (p->type == LULL_PARAM_INT && p->min < p->max && p->max - p->min < 1e15) {
            snprintf(text, sizeof text, "%.1f", p->min + 0.5);
            expect_status(c, p->name, text, LULL_E_VALUE);
        }
        if (p->type == LULL_PARAM_BOOL) {
            expect_status(c, p->name, "0", LULL_OK);
            expect_status(c, p->name, "1", LULL_OK);
            expect_status(c, p->name, "2", LULL_E_VALUE);
        }
        if (p->type == LULL_PARAM_CHOICE)
            check_choices(c, p);
    }
    if (c->criterion->param_count == 0)
        lc_note(c, "it has no parameters");
}

void lc_check_null(struct lc *c)
{
    const struct lull_criterion *t = c->criterion;
    struct lull_instance *instance = NULL;
    struct lull_pair bad = {"no-such-parameter", "1"}, hole = {NULL, NULL};
    LC_EXPECT(c, t->create(NULL, &bad, 1, sizeof bad, &instance, NULL) == LULL_E_KEY,
              "unknown key, NULL error: not refused");
    LC_EXPECT(c, t->create(NULL, &hole, 1, sizeof hole, &instance, NULL) != LULL_OK, "a pair of NULLs is accepted");
    LC_EXPECT(c, !instance, "a failed create touched the instance");
    LC_EXPECT(c, t->create(NULL, c->pairs, c->pair_count, sizeof bad, NULL, NULL) == LULL_E_INVALID,
              "create without a place for the instance is not refused");
    if (c->pair_count == 0) {
        LC_EXPECT(c, t->create(NULL, NULL, 0, 0, &instance, NULL) == LULL_OK,
                  "create(NULL, NULL, 0, 0, &instance, NULL) fails");
        t->destroy(instance);
    }
    t->destroy(NULL);

    /* a host that offers nothing, not even a number of workers */
    struct lull_host bare = {.struct_size = sizeof bare, .api_minor = LULL_API_MINOR};
    lc_run_both(c, NULL, &(struct lc_manner){.host = &bare}, "NULL host against a host of NULLs");
}

void lc_check_requirements(struct lc *c)
{
    struct lull_instance *instance = lc_create(c, NULL);
    if (!instance)
        return;
    struct lull_requirements r[2];
    for (int i = 0; i < 2; i++) {
        memset(&r[i], i ? 0xff : 0, sizeof r[i]); /* every field is written, whatever it held */
        r[i].struct_size = sizeof r[i];
        struct lull_error err = {.struct_size = sizeof err};
        int32_t status = c->criterion->requirements(instance, &r[i], &err);
        LC_EXPECT(c, status == LULL_OK, "requirements failed (%d): %s", status, err.message);
    }
    LC_EXPECT(c, memcmp(&r[0], &r[1], sizeof r[0]) == 0, "requirements leaves fields unset, or differs from call to call");
    const struct lull_requirements *q = &r[0];
    const uint32_t known = (UINT32_C(1) << LULL_PLANE_COUNT) - 1;
    LC_EXPECT(c, q->struct_size == sizeof *q, "requirements changed struct_size");
    LC_EXPECT(c, (q->planes_required & ~q->planes_used) == 0, "a required plane is not used (%#x, %#x)", q->planes_required,
              q->planes_used);
    if (c->criterion->api_minor <= LULL_API_MINOR)
        LC_EXPECT(c, (q->planes_used & ~known) == 0 && (q->flags & ~LULL_REQ_FLEXIBLE) == 0, "unknown planes or flags");
    LC_EXPECT(c, q->first_spp >= 1, "first_spp is 0");
    LC_EXPECT(c, (q->flags & LULL_REQ_FLEXIBLE) || (q->block_width > 0 && q->block_height > 0),
              "not flexible, but without a block size");
    LC_EXPECT(c, q->block_width <= 16384 && q->block_height <= 16384 && q->halo <= 16384, "absurd block size or halo");
    lc_note(c, "block %ux%u%s, halo %u, first at %llu spp, %llu bytes per block, planes used %#x, required %#x",
            q->block_width, q->block_height, q->flags & LULL_REQ_FLEXIBLE ? " (flexible)" : "", q->halo,
            (unsigned long long)q->first_spp, (unsigned long long)q->bytes_per_block, q->planes_used, q->planes_required);
    c->criterion->destroy(instance);
}
