/* SPDX-License-Identifier: MIT */
#include "misuse.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PAIRS_MAX = 72, TEXT_MAX = 6000 };

struct create_call {
    struct lull_host host;
    struct lull_pair pairs[PAIRS_MAX];
    uint32_t pair_count, pair_stride, host_size;
    int no_place, no_pairs;
    char text[TEXT_MAX];
};

static void add_pair(struct create_call *k, const char *key, const char *value)
{
    if (k->pair_count < PAIRS_MAX)
        k->pairs[k->pair_count++] = (struct lull_pair){key, value};
}

/* Bytes that are no number, choice or name of anything: they begin with '%', which also finds who prints them as a format.
 */
static const char *gibberish(struct lc_misuse *m, struct create_call *k)
{
    const uint32_t length = lc_draw(m, 4) ? 1 + lc_draw(m, 40) : 1 + lc_draw(m, TEXT_MAX - 1);
    k->text[0] = '%';
    for (uint32_t i = 1; i < length; i++)
        k->text[i] = (char)(1 + lc_draw(m, 255));
    k->text[length] = '\0';
    return k->text;
}

static const char *out_of_range(struct lc_misuse *m, struct create_call *k, const struct lull_param *p)
{
    static const char *const none[] = {"", "nan", "-nan", "inf", "-inf", "1e999999", "-1e999999", "0x1", "1 ", "1,0", "1e"};
    const double end = lc_draw(m, 2) ? p->max : p->min, beyond = end + (end == p->max ? 1 : -1) * fmax(1, fabs(end) * 0.01);
    if (p->type == LULL_PARAM_BOOL)
        return lc_draw(m, 2) ? "2" : "-1";
    if (p->type > LULL_PARAM_FLOAT || lc_draw(m, 3) == 0)
        return gibberish(m, k);
    if (lc_draw(m, 2) || !isfinite(beyond))
        return none[lc_draw(m, sizeof none / sizeof *none)];
    snprintf(k->text, TEXT_MAX, "%.0f", beyond > 0 ? ceil(beyond) : floor(beyond));
    return k->text;
}

/* A wrong value for one of the parameters, perhaps after or before a good one. */
static void spoil_value(struct lc_misuse *m, struct create_call *k)
{
    const struct lull_criterion *t = m->check->criterion;
    if (t->param_count == 0)
        return;
    const struct lull_param *p = lc_param(m->check, lc_draw(m, t->param_count));
    const uint32_t twice = lc_draw(m, 3);
    if (p->type > LULL_PARAM_CHOICE) {
        lc_wrong(m, MAY, "a file or text of any bytes");
        add_pair(k, p->name, gibberish(m, k));
        return;
    }
    lc_wrong(m, twice == 1 ? MAY : CODE(LULL_E_VALUE), twice == 1 ? "a bad value before a good one" : "a bad value");
    if (twice == 2 && p->default_value)
        add_pair(k, p->name, p->default_value);
    add_pair(k, p->name, out_of_range(m, k, p));
    if (twice == 1 && p->default_value)
        add_pair(k, p->name, p->default_value);
}

static void spoil_create(struct lc_misuse *m, struct create_call *k)
{
    switch (lc_draw(m, 8)) {
    case 0: lc_wrong(m, INVALID, "no place for the instance"), k->no_place = 1; break;
    case 1:
        lc_wrong(m, INVALID, "pairs at NULL");
        k->no_pairs = 1;
        k->pair_count += k->pair_count == 0;
        break;
    case 2: lc_wrong(m, INVALID, "no key"), add_pair(k, NULL, "1"); break;
    case 3: lc_wrong(m, INVALID | CODE(LULL_E_KEY), "no value"), add_pair(k, "no-such-parameter", NULL); break;
    case 4: lc_wrong(m, VERSION, "a short host"), k->host_size = lc_too_small(m, sizeof k->host); break;
    case 5:
        lc_wrong(m, SIZE, "a short stride of the pairs");
        k->pair_stride = lc_too_small(m, sizeof *k->pairs);
        k->pair_count += k->pair_count == 0;
        break;
    case 6: lc_wrong(m, CODE(LULL_E_KEY), "an unknown key"), add_pair(k, gibberish(m, k), "1"); break;
    default: spoil_value(m, k);
    }
}

void lc_misuse_create(struct lc_misuse *m)
{
    struct lc *c = m->check;
    struct create_call k = {.host = {.api_minor = LULL_API_MINOR},
                            .pair_count = c->pair_count,
                            .pair_stride = sizeof *k.pairs,
                            .host_size = sizeof k.host};
    for (uint32_t i = 0; i < c->pair_count; i++)
        k.pairs[i] = c->pairs[i];
    for (uint32_t n = lc_how_many(m); n > 0; n--)
        spoil_create(m, &k);
    struct lull_instance *const none = (struct lull_instance *)(void *)&k, *instance = none;
    const struct lull_host *host = lc_place_struct(m->check, &k.host, k.host_size);
    const struct lull_pair *pairs = lc_place(m->check, k.pairs, (size_t)k.pair_count * k.pair_stride);
    struct lull_error *err = lc_announce(m, "create");
    int32_t status =
        c->criterion->create(k.host_size == sizeof k.host && lc_draw(m, 2) ? NULL : host, k.no_pairs ? NULL : pairs,
                             k.pair_count, k.pair_stride, k.no_place ? NULL : &instance, err);
    lc_judge(m, status, err);
    LC_EXPECT(c, (status == LULL_OK) == (instance != none), "call %llu: create: status %d, and the instance is %stouched",
              (unsigned long long)m->calls, status, instance == none ? "un" : "");
    if (instance != none)
        c->criterion->destroy(instance);
}

void lc_misuse_requirements(struct lc_misuse *m)
{
    struct lull_requirements req = {0};
    const uint32_t which = lc_draw(m, 4), size = which == 2 ? lc_too_small(m, sizeof req) : (uint32_t)sizeof req;
    if (which == 0)
        lc_wrong(m, INVALID, "no instance"), m->instance = NULL;
    if (which == 1)
        lc_wrong(m, INVALID, "no struct to fill");
    if (which == 2)
        lc_wrong(m, VERSION, "a short struct to fill");
    struct lull_requirements *r = lc_place_struct(m->check, &req, size);
    struct lull_error *err = lc_announce(m, "requirements");
    int32_t status = m->check->criterion->requirements(m->instance, which == 1 ? NULL : r, err);
    lc_judge(m, status, err);
}

/* What is wrong with a call about a stream, in words: none, a short struct, one that cannot work, and what fails in the end.
 * Returns which: 0 no instance, then these. */
static uint32_t spoil_stream(struct lc_misuse *m, uint32_t full_size, uint32_t *size, const char *const words[4])
{
    const uint32_t which = lc_draw(m, 5);
    *size = which == 2 ? lc_too_small(m, full_size) : full_size;
    if (!m->open)
        lc_wrong(m, CODE(LULL_E_STATE), "no frame is open");
    if (which == 0)
        lc_wrong(m, INVALID, "no instance"), m->instance = NULL;
    else if (which < 4)
        lc_wrong(m, which == 2 ? VERSION : INVALID, words[which - 1]);
    else if (m->open && m->saved.size > 0)
        lc_wrong(m, REFUSED, words[3]);
    return which;
}

void lc_misuse_save(struct lc_misuse *m)
{
    static const char *const words[] = {"no writer", "a short writer", "a writer that cannot write", "writing fails"};
    struct lc_buffer b = {.limit = m->saved.size > 0 ? lc_draw(m, (uint32_t)m->saved.size) : 0};
    struct lull_writer writer = {.context = &b, .write = lc_buffer_write};
    uint32_t size, which = spoil_stream(m, sizeof writer, &size, words);
    if (m->codes == 0)
        return; /* there is nothing to be written */
    if (which == 3)
        writer.write = NULL;
    const struct lull_writer *at = lc_place_struct(m->check, &writer, size);
    struct lull_error *err = lc_announce(m, "save");
    int32_t status = m->state->save(m->instance, which == 1 ? NULL : at, err);
    free(b.data);
    lc_judge(m, status, err);
}

static void send_load(struct lc_misuse *m, struct lc_buffer *b, int no_reader, int no_read, uint32_t size)
{
    struct lull_reader reader = {.context = b, .read = no_read ? NULL : lc_buffer_read};
    const struct lull_reader *at = lc_place_struct(m->check, &reader, size);
    struct lull_error *err = lc_announce(m, "load");
    int32_t status = m->state->load(m->instance, no_reader ? NULL : at, err);
    lc_judge(m, status, err);
}

void lc_misuse_load(struct lc_misuse *m)
{
    static const char *const words[] = {"no reader", "a short reader", "a reader that cannot read", "a state cut short"};
    struct lc_buffer b = {.data = m->saved.data, .size = m->saved.size};
    uint32_t size, which = spoil_stream(m, sizeof(struct lull_reader), &size, words);
    if (m->codes == 0)
        return;
    if (which == 4 && m->open)
        b.size = lc_draw(m, (uint32_t)m->saved.size);
    send_load(m, &b, which == 1, which == 3, size);
}

void lc_loose_load(struct lc_misuse *m)
{
    struct lc_buffer b = {.size = m->saved.size, .data = lc_need(m->check, malloc((size_t)m->saved.size))};
    memcpy(b.data, m->saved.data, (size_t)b.size);
    lc_wrong(m, MAY, "a damaged state");
    for (uint32_t n = 1 + lc_draw(m, 4); n > 0; n--) {
        char *at = &b.data[lc_draw(m, (uint32_t)b.size)];
        *at = (char)lc_draw(m, 256);
    }
    send_load(m, &b, 0, 0, sizeof(struct lull_reader));
    free(b.data);
}
