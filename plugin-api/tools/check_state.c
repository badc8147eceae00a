/* SPDX-License-Identifier: MIT
 *
 * The extension lull.state/1: save, load, and states that are cut short or damaged.
 */
#include "check.h"

#include <stdlib.h>
#include <string.h>

int32_t lc_buffer_write(const struct lull_writer *writer, const void *data, uint64_t size)
{
    struct lc_buffer *b = writer->context;
    if (size > b->limit - b->size)
        return LULL_E_IO;
    char *grown = realloc(b->data, (size_t)(b->size + size + 1));
    if (!grown)
        return LULL_E_MEMORY;
    b->data = grown;
    if (size > 0)
        memcpy(b->data + b->size, data, (size_t)size);
    b->size += size;
    return LULL_OK;
}

int32_t lc_buffer_read(const struct lull_reader *reader, void *data, uint64_t size)
{
    struct lc_buffer *b = reader->context;
    if (size > b->size - b->at)
        return LULL_E_IO;
    if (size > 0)
        memcpy(data, b->data + b->at, (size_t)size);
    b->at += size;
    return LULL_OK;
}

int32_t lc_state_save(const struct lull_state *state, const struct lc_session *s, struct lc_buffer *b,
                      struct lull_error *err)
{
    struct lull_writer writer = {.struct_size = sizeof writer, .context = b, .write = lc_buffer_write};
    return state->save(s->instance, &writer, err);
}

static int32_t load(const struct lull_state *state, const struct lc_session *s, struct lc_buffer *b, struct lull_error *err)
{
    struct lull_reader reader = {.struct_size = sizeof reader, .context = b, .read = lc_buffer_read};
    b->at = 0;
    return state->load(s->instance, &reader, err);
}

/* Destroys the instance and goes on with another one that has loaded the state. */
static int replace_instance(struct lc *c, const struct lull_state *state, struct lc_session *s, struct lc_buffer *b)
{
    c->criterion->end_frame(s->instance);
    c->criterion->destroy(s->instance);
    s->instance = lc_create(c, NULL);
    if (!s->instance)
        return -1;
    struct lull_frame frame;
    lc_film_frame(&s->film, &frame, s->planes);
    struct lull_error err = {.struct_size = sizeof err};
    int32_t status = lc_begin(c, s->instance, &frame, &err);
    if (status == LULL_OK)
        status = load(state, s, b, &err);
    return LC_EXPECT(c, status == LULL_OK, "load after begin_frame: %d, %s", status, err.message) ? 0 : -1;
}

/* States that were cut short, then some with one byte changed: refused, or accepted where it does not matter. */
static void damage(struct lc *c, const struct lull_state *state, struct lc_session *s, const struct lc_buffer *whole)
{
    uint64_t stride = whole->size / 64 + 1;
    for (uint64_t size = 0; size < whole->size; size += stride) {
        struct lc_buffer cut = {.data = whole->data, .size = size};
        struct lull_error err = {.struct_size = sizeof err};
        int32_t status = load(state, s, &cut, &err);
        if (!LC_EXPECT(c, status != LULL_OK, "a state cut to %llu of %llu bytes is accepted", (unsigned long long)size,
                       (unsigned long long)whole->size))
            break;
    }
    for (uint64_t at = 0; at < whole->size; at += stride) {
        struct lc_buffer bad = {.data = lc_need(c, malloc((size_t)whole->size)), .size = whole->size};
        memcpy(bad.data, whole->data, (size_t)whole->size);
        bad.data[at] = (char)~bad.data[at];
        load(state, s, &bad, NULL);
        free(bad.data);
    }
}

static void run_state(struct lc *c, const struct lull_state *state)
{
    struct lc_log expected;
    struct lc_session s;
    if (lc_run(c, NULL, &expected) != 0 || lc_session_open(&s, c, NULL) != 0)
        return;
    struct lc_buffer whole = {.limit = UINT64_MAX};
    int ok = 1;
    for (int step = 0; step < LC_STEPS && ok; step++) {
        struct lc_buffer b = {.limit = UINT64_MAX};
        struct lull_error err = {.struct_size = sizeof err};
        ok = LC_EXPECT(c, lc_state_save(state, &s, &b, &err) == LULL_OK, "save: %s", err.message) &&
             replace_instance(c, state, &s, &b) == 0 && lc_session_step(&s) == 0;
        free(whole.data);
        whole = b;
    }
    if (ok)
        lc_log_compare(c, &expected, &s.log, lc_deterministic(c), "saved and loaded before every step");
    if (ok && whole.size > 0) {
        struct lc_buffer full = {.limit = whole.size / 2};
        LC_EXPECT(c, lc_state_save(state, &s, &full, NULL) != LULL_OK, "save does not notice that writing failed");
        free(full.data);
        /* a refused load changes nothing: the good state, then every bad one, then one more step */
        replace_instance(c, state, &s, &whole);
        damage(c, state, &s, &whole);
    }
    lc_note(c, "%llu bytes for %u blocks", (unsigned long long)whole.size, s.film.block_count);
    free(whole.data);
    lc_session_close(&s);
}

static void run_refused(struct lc *c, const struct lull_state *state)
{
    struct lc_log expected;
    struct lc_session s;
    if (lc_run(c, NULL, &expected) != 0)
        return;
    if (lc_session_open(&s, c, NULL) == 0) {
        lc_session_steps(&s, 3);
        struct lc_buffer b = {.limit = UINT64_MAX};
        if (lc_state_save(state, &s, &b, NULL) == LULL_OK && b.size > 0) {
            struct lc_buffer cut = {.data = b.data, .size = b.size - 1};
            LC_EXPECT(c, load(state, &s, &cut, NULL) != LULL_OK, "a state without its last byte is accepted");
        }
        free(b.data);
        if (lc_session_steps(&s, LC_STEPS - 3) == 0)
            lc_log_compare(c, &expected, &s.log, lc_deterministic(c), "after a refused load");
        lc_session_close(&s);
    }
}

void lc_check_state(struct lc *c)
{
    const struct lull_state *state = c->criterion->get_extension(LULL_EXT_STATE);
    if (!state) {
        lc_skip(c, "it does not offer lull.state/1");
        return;
    }
    if (!LC_EXPECT(c, LULL_HAS(struct lull_state, state, load) && state->save && state->load, "lull.state/1 is incomplete"))
        return;
    run_state(c, state);
    run_refused(c, state);
}
