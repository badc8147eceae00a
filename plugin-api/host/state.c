#include "host/frame.h"

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

/* Remembers the first failure. */
struct sink {
    const struct lull_writer *writer;
    int32_t code;
};

static void put(struct sink *s, const void *data, size_t size)
{
    if (s->code == LULL_OK && size > 0)
        s->code = s->writer->write(s->writer, data, size);
}

static void put_count(struct sink *s, uint64_t n) { put(s, &n, sizeof n); }

static void put_frame(struct sink *s, const struct lull_host_frame *f, const struct bytes *history)
{
    put_count(s, f->blocks.count);
    for (uint32_t i = 0; i < f->blocks.count; i++) {
        const struct lull_host_block *b = &f->blocks.list[i];
        struct block_record record = {b->spp,     b->next_spp,   b->asked_spp,     b->rays,     b->dropped,
                                      b->p_noisy, b->error,      b->predicted_spp, b->thread_s, b->reason,
                                      b->checks,  b->stop_votes, b->asked};
        put(s, &record, sizeof record);
    }
    put(s, &f->totals, sizeof(struct totals_record));
    put_count(s, f->dropped_count);
    put(s, f->dropped, sizeof f->dropped);
    put_count(s, history->used);
    put(s, history->data, history->used);
    for (uint32_t i = 0; i < f->blocks.count && !(f->config.flags & LULL_HOST_HALF_KNOWN); i++)
        put_count(s, f->blocks.list[i].half_spp);
}

int32_t lull_host_save(const struct lull_host_frame *f, const struct lull_writer *writer, struct lull_error *err)
{
    struct bytes history = {0};
    struct lull_writer keep = {.struct_size = sizeof keep, .context = &history, .write = write_bytes};
    struct sink s = {.writer = writer};
    int32_t code = lull_host_given(err, "frame", f, "writer", writer, "write", writer ? writer->write : NULL, NULL);
    if (code != LULL_OK)
        return code;
    code = f->criterion ? lull_host_save_history(f->criterion, &keep, err) : LULL_OK;
    if (code == LULL_OK) {
        put_frame(&s, f, &history);
        code = s.code == LULL_OK ? LULL_OK : lull_error_set(err, s.code, "the state could not be written");
    }
    free(history.data);
    return code;
}

struct source {
    const char *name;
    struct const_bytes bytes;
    struct lull_error *err;
};

static int32_t take(struct source *s, void *data, size_t size)
{
    struct lull_reader reader = {.struct_size = sizeof reader, .context = &s->bytes};
    return read_bytes(&reader, data, size) == LULL_OK
               ? LULL_OK
               : lull_error_set(s->err, LULL_E_IO, "%s: the checkpoint is too short", s->name);
}

static int32_t take_blocks(struct source *s, const struct lull_host_blocks *blocks, struct lull_host_block *list)
{
    uint64_t count = 0;
    int32_t code = take(s, &count, sizeof count);
    if (code == LULL_OK && count != blocks->count)
        code = lull_error_set(s->err, LULL_E_IO, "%s: the checkpoint has another number of blocks", s->name);
    for (uint32_t i = 0; i < blocks->count && code == LULL_OK; i++) {
        struct block_record record = {0};
        struct lull_host_block *b = &list[i];
        if ((code = take(s, &record, sizeof record)) != LULL_OK)
            break;
        if (record.spp > LULL_HOST_MOST_SPP || record.next_spp > LULL_HOST_MOST_SPP || record.reason < 0 ||
            record.reason >= LULL_REASON_COUNT)
            return lull_error_set(s->err, LULL_E_IO, "%s: block %u of the checkpoint makes no sense", s->name, b->id);
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
    return code;
}

/* What a state holds beside its blocks. */
struct parts {
    struct totals_record totals;
    uint64_t dropped_count, history_size;
    struct lull_host_sample dropped[LULL_HOST_DROPPED_KEPT];
    const unsigned char *history;
};

static int32_t take_parts(struct source *s, const struct lull_host_frame *f, struct lull_host_block *list, struct parts *p)
{
    uint64_t halves = f->config.flags & LULL_HOST_HALF_KNOWN ? 0 : f->blocks.count;
    int32_t code = take(s, &p->totals, sizeof p->totals);
    if (code == LULL_OK)
        code = take(s, &p->dropped_count, sizeof p->dropped_count);
    if (code == LULL_OK && p->dropped_count > LULL_HOST_DROPPED_KEPT)
        code = lull_error_set(s->err, LULL_E_IO, "%s: the checkpoint makes no sense", s->name);
    if (code == LULL_OK)
        code = take(s, p->dropped, sizeof p->dropped);
    if (code == LULL_OK)
        code = take(s, &p->history_size, sizeof p->history_size);
    if (code != LULL_OK)
        return code;
    size_t left = s->bytes.size - s->bytes.at;
    if (p->history_size > left || left - p->history_size != halves * sizeof(uint64_t) ||
        (!f->criterion && p->history_size > 0))
        return lull_error_set(s->err, LULL_E_IO, "%s: the checkpoint has a wrong length", s->name);
    p->history = s->bytes.data + s->bytes.at;
    s->bytes.at += (size_t)p->history_size;
    for (uint64_t i = 0; i < halves && code == LULL_OK; i++) {
        code = take(s, &list[i].half_spp, sizeof list[i].half_spp);
        if (code == LULL_OK && list[i].half_spp > list[i].spp)
            code = lull_error_set(s->err, LULL_E_IO, "%s: block %u of the checkpoint makes no sense", s->name, list[i].id);
    }
    return code;
}

static int32_t load(struct lull_host_frame *f, const void *data, uint64_t size, const char *name, int history,
                    struct lull_error *err)
{
    struct source s = {.name = name, .bytes = {.data = data, .size = (size_t)size}, .err = err};
    struct parts p = {0};
    int32_t code = lull_host_given(err, "frame", f, "name", name, "data", size > 0 ? data : name, NULL);
    if (code != LULL_OK)
        return code;
    struct lull_host_block *list = malloc(f->blocks.count * sizeof *list);
    if (!list)
        return lull_host_no_memory(err, name);
    memcpy(list, f->blocks.list, f->blocks.count * sizeof *list);
    code = take_blocks(&s, &f->blocks, list);
    if (code == LULL_OK)
        code = take_parts(&s, f, list, &p);
    if (code == LULL_OK && f->criterion && history)
        code = lull_host_load_history(f->criterion, p.history, p.history_size, err);
    if (code == LULL_OK) {
        memcpy(f->blocks.list, list, f->blocks.count * sizeof *list);
        memcpy(&f->totals, &p.totals, sizeof p.totals);
        memcpy(f->dropped, p.dropped, sizeof p.dropped);
        f->dropped_count = (uint32_t)p.dropped_count;
    }
    free(list);
    return code;
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
