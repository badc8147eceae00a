/* SPDX-License-Identifier: MIT */
#include "misuse.h"

#include <stdlib.h>
#include <string.h>

/* What is wrong with a call about a stream, in words: none, a short struct, one that cannot work, and what fails in the end.
 * Returns which: 0 no instance, then these. */
static uint32_t spoil_stream(struct lc_misuse *m, uint32_t full_size, uint32_t *size, const char *const words[4])
{
    const uint32_t which = lc_draw(m, 5);
    *size = which == 2 ? lc_too_small(m, full_size) : full_size;
    lc_make_up(m, m->s.instance);
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
    lc_judge(m, "save", status, err);
}

static void send_load(struct lc_misuse *m, struct lc_buffer *b, int no_reader, int no_read, uint32_t size)
{
    struct lull_reader reader = {.context = b, .read = no_read ? NULL : lc_buffer_read};
    const struct lull_reader *at = lc_place_struct(m->check, &reader, size);
    struct lull_error *err = lc_announce(m, "load");
    int32_t status = m->state->load(m->instance, no_reader ? NULL : at, err);
    lc_judge(m, "load", status, err);
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
