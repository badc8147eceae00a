#include "host/frame.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/identity.h"

/*
 * blocks, block records; totals; dropped samples; criterion bytes, criterion; half counts unless they follow from the
 * samples. Counts are u64, records are the structs below, made without padding.
 */
struct block_record {
    uint64_t spp, next_spp, asked_spp, rays, dropped;
    double p_noisy, error, predicted_spp, thread_s;
    int32_t reason;
    uint32_t checks, stop_votes, asked;
};

struct totals_record {
    uint64_t samples, paths, rays, dropped;
    double render_s, criterion_s;
    uint64_t checks, failed_checks, skipped_checks;
};
_Static_assert(offsetof(struct lull_host_totals, criterion_thread_s) == sizeof(struct totals_record),
               "the totals begin with what is saved of them");

struct bytes {
    unsigned char *data;
    size_t used, room;
};

static int32_t write_bytes(const struct lull_writer *writer, const void *data, uint64_t size)
{
    struct bytes *b = writer->context;
    if (size > SIZE_MAX / 4 - b->used)
        return LULL_E_MEMORY;
    if (b->used + size > b->room) {
        size_t room = (b->used + (size_t)size) * 2;
        unsigned char *grown = realloc(b->data, room);
        if (!grown)
            return LULL_E_MEMORY;
        b->data = grown;
        b->room = room;
    }
    if (size > 0)
        memcpy(b->data + b->used, data, (size_t)size);
    b->used += (size_t)size;
    return LULL_OK;
}

struct const_bytes {
    const unsigned char *data;
    size_t at, size;
};

static int32_t read_bytes(const struct lull_reader *reader, void *data, uint64_t size)
{
    struct const_bytes *b = reader->context;
    if (size > b->size - b->at)
        return LULL_E_IO;
    if (size > 0)
        memcpy(data, b->data + b->at, (size_t)size);
    b->at += (size_t)size;
    return LULL_OK;
}

static const struct lull_state *state_extension(const struct lull_host_criterion *c)
{
    return c->table->get_extension ? c->table->get_extension(LULL_EXT_STATE) : NULL;
}

int32_t lull_host_save_history(const struct lull_host_criterion *c, const struct lull_writer *writer, struct lull_error *err)
{
    int32_t code = lull_host_given(err, "criterion", c, "writer", writer, "write", writer ? writer->write : NULL, NULL);
    if (code != LULL_OK)
        return code;
    const struct lull_state *state = state_extension(c);
    struct lull_error e = {.struct_size = sizeof e};
    for (int s = 0; state && s <= LULL_HOST_STEPS && code == LULL_OK; s++)
        code = c->instances[s] ? state->save(c->instances[s], writer, &e) : LULL_OK;
    return code == LULL_OK ? code : lull_host_blame(c, "cannot save its state: ", code, &e, err);
}

int32_t lull_host_load_history(struct lull_host_criterion *c, const void *data, uint64_t size, struct lull_error *err)
{
    const struct lull_state *state = state_extension(c);
    if (!state)
        return size == 0
                   ? LULL_OK
                   : lull_error_set(err, LULL_E_IO, "criterion %s keeps no state, but the checkpoint has one", c->table->id);
    struct const_bytes b = {.data = data, .size = (size_t)size};
    struct lull_reader reader = {.struct_size = sizeof reader, .context = &b, .read = read_bytes};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = LULL_OK;
    for (int s = 0; s <= LULL_HOST_STEPS && code == LULL_OK; s++)
        code = c->instances[s] ? state->load(c->instances[s], &reader, &e) : LULL_OK;
    if (code != LULL_OK)
        return lull_host_blame(c, "cannot load its state: ", code, &e, err);
    if (b.at != b.size)
        return lull_error_set(err, LULL_E_IO, "criterion %s: %zu bytes of its state were left over", c->table->id,
                              b.size - b.at);
    return LULL_OK;
}

/* A state on its way, out or in. After the first failure nothing more passes. */
struct passage {
    const struct lull_writer *to; /* NULL: it is read */
    struct const_bytes from;
    const char *name; /* of the file that is read */
    struct lull_error *err;
    int32_t code;
};

static void refuse(struct passage *s, const char *why)
{
    if (s->code == LULL_OK)
        s->code = lull_error_set(s->err, LULL_E_IO, "%s: %s", s->name, why);
}

static void refuse_block(struct passage *s, const struct lull_host_block *b)
{
    char why[64];
    snprintf(why, sizeof why, "block %u of the checkpoint makes no sense", b->id);
    refuse(s, why);
}

static void pass(struct passage *s, void *data, size_t size)
{
    struct lull_reader reader = {.struct_size = sizeof reader, .context = &s->from};
    if (s->code != LULL_OK || size == 0)
        return;
    if (!s->to && read_bytes(&reader, data, size) != LULL_OK)
        refuse(s, "the checkpoint is too short");
    if (s->to && (s->code = s->to->write(s->to, data, size)) != LULL_OK)
        lull_error_set(s->err, s->code, "the state could not be written");
}

static uint64_t pass_count(struct passage *s, uint64_t n)
{
    pass(s, &n, sizeof n);
    return n;
}

static void pass_blocks(struct passage *s, const struct lull_host_blocks *blocks)
{
    if (pass_count(s, blocks->count) != blocks->count)
        refuse(s, "the checkpoint has another number of blocks");
    for (uint32_t i = 0; i < blocks->count && s->code == LULL_OK; i++) {
        struct lull_host_block *b = &blocks->list[i];
        struct block_record record = {b->spp,     b->next_spp,   b->asked_spp,     b->rays,     b->dropped,
                                      b->p_noisy, b->error,      b->predicted_spp, b->thread_s, b->reason,
                                      b->checks,  b->stop_votes, b->asked};
        pass(s, &record, sizeof record);
        if (s->to)
            continue;
        if (record.spp > LULL_HOST_MOST_SPP || record.next_spp > LULL_HOST_MOST_SPP || record.reason < 0 ||
            record.reason >= LULL_REASON_COUNT)
            refuse_block(s, b);
        b->spp = record.spp;
        b->next_spp = record.next_spp;
        b->asked_spp = record.asked_spp;
        b->rays = record.rays;
        b->dropped = record.dropped;
        b->p_noisy = record.p_noisy;
        b->error = record.error;
        b->predicted_spp = record.predicted_spp;
        b->thread_s = record.thread_s;
        b->reason = record.reason;
        b->checks = record.checks;
        b->stop_votes = record.stop_votes;
        b->asked = record.asked;
    }
}

/* history: the criterion's bytes; of a state that is read, where they stand in it. */
static void pass_frame(struct passage *s, struct lull_host_frame *f, struct const_bytes *history)
{
    const uint32_t halves = f->config.flags & LULL_HOST_HALF_KNOWN ? 0 : f->blocks.count;
    pass_blocks(s, &f->blocks);
    pass(s, &f->totals, sizeof(struct totals_record));
    const uint64_t dropped_count = pass_count(s, f->dropped_count);
    if (dropped_count > LULL_HOST_DROPPED_KEPT)
        refuse(s, "the checkpoint makes no sense");
    f->dropped_count = (uint32_t)dropped_count;
    pass(s, f->dropped, sizeof f->dropped);
    const uint64_t size = pass_count(s, history->size), left = s->from.size - s->from.at;
    if (s->to)
        pass(s, (void *)(uintptr_t)history->data, history->size);
    else if (size > left || left - size != halves * sizeof(uint64_t) || (!f->criterion && size > 0))
        refuse(s, "the checkpoint has a wrong length");
    else {
        *history = (struct const_bytes){.data = s->from.data + s->from.at, .size = (size_t)size};
        s->from.at += (size_t)size;
    }
    for (uint32_t i = 0; i < halves && s->code == LULL_OK; i++) {
        struct lull_host_block *b = &f->blocks.list[i];
        pass(s, &b->half_spp, sizeof b->half_spp);
        if (!s->to && b->half_spp > b->spp)
            refuse_block(s, b);
    }
}

int32_t lull_host_save(const struct lull_host_frame *f, const struct lull_writer *writer, struct lull_error *err)
{
    struct bytes history = {0};
    struct lull_writer keep = {.struct_size = sizeof keep, .context = &history, .write = write_bytes};
    struct passage s = {.to = writer, .err = err};
    int32_t code = lull_host_given(err, "frame", f, "writer", writer, "write", writer ? writer->write : NULL, NULL);
    if (code != LULL_OK)
        return code;
    struct lull_host_frame saved = *f;
    s.code = f->criterion ? lull_host_save_history(f->criterion, &keep, err) : LULL_OK;
    pass_frame(&s, &saved, &(struct const_bytes){.data = history.data, .size = history.used});
    free(history.data);
    return s.code;
}

static int32_t load(struct lull_host_frame *f, const void *data, uint64_t size, const char *name, int with_history,
                    struct lull_error *err)
{
    struct passage s = {.from = {.data = data, .size = (size_t)size}, .name = name, .err = err};
    struct const_bytes history = {0};
    int32_t code = lull_host_given(err, "frame", f, "name", name, "data", size > 0 ? data : name, NULL);
    if (code != LULL_OK)
        return code;
    struct lull_host_frame loaded = *f;
    const size_t list_size = f->blocks.count * sizeof *f->blocks.list;
    struct lull_host_block *list = malloc(list_size);
    if (!list)
        return lull_host_no_memory(err, name);
    loaded.blocks.list = memcpy(list, f->blocks.list, list_size);
    pass_frame(&s, &loaded, &history);
    if (s.code == LULL_OK && f->criterion && with_history)
        s.code = lull_host_load_history(f->criterion, history.data, history.size, err);
    if (s.code == LULL_OK) {
        loaded.blocks.list = memcpy(f->blocks.list, list, list_size); /* it stays where it is */
        *f = loaded;
    }
    free(list);
    return s.code;
}

int32_t lull_host_load(struct lull_host_frame *f, const void *data, uint64_t size, const char *name, struct lull_error *err)
{
    return load(f, data, size, name, 1, err);
}

int32_t lull_host_load_blocks(struct lull_host_frame *f, const void *data, uint64_t size, const char *name,
                              struct lull_error *err)
{
    return load(f, data, size, name, 0, err);
}

int32_t lull_host_same_identity(const char *saved, uint64_t saved_size, const char *present, const char *name,
                                struct lull_error *err)
{
    static const struct base_identity_words words = {": made with", ": made without", "this render"};
    struct base_err why = {0};
    int32_t code = lull_host_given(err, "saved", saved, "present", present, "name", name, NULL);
    if (code != LULL_OK)
        return code;
    const struct base_identity ours = {.text = (char *)(size_t)present, .size = strlen(present)};
    return base_identity_compare(&ours, saved, (size_t)saved_size, name, &words, NULL, &why) == 0
               ? LULL_OK
               : lull_error_set(err, LULL_E_VALUE, "%s", why.text);
}
