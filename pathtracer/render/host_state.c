#include "render/host_state.h"

#include <stdlib.h>
#include <string.h>

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

static const struct lull_state *state_extension(const struct pt_criterion *c)
{
    return c->table->get_extension ? c->table->get_extension(LULL_EXT_STATE) : NULL;
}

int pt_criterion_save(const struct pt_criterion *c, unsigned char **data, size_t *size, struct base_err *err)
{
    const struct lull_state *state = state_extension(c);
    struct bytes b = {0};
    if (state) {
        struct lull_writer writer = {.struct_size = sizeof writer, .context = &b, .write = write_bytes};
        struct lull_error e = {.struct_size = sizeof e};
        int32_t code = LULL_OK;
        for (int s = 0; s <= PT_MASK_STEPS && code == LULL_OK; s++)
            code = c->dialled[s] ? state->save(c->dialled[s], &writer, &e) : LULL_OK;
        if (code != LULL_OK) {
            free(b.data);
            return pt_criterion_fail(c, "cannot save its state: ", code, &e, err);
        }
    }
    *data = b.data;
    *size = b.used;
    return 0;
}

int pt_criterion_load(struct pt_criterion *c, const unsigned char *data, size_t size, struct base_err *err)
{
    const struct lull_state *state = state_extension(c);
    if (!state)
        return size == 0 ? 0 : base_fail(err, BASE_EINVAL, "criterion %s keeps no state, but the checkpoint has one",
                                         c->table->id);
    struct const_bytes b = {.data = data, .size = size};
    struct lull_reader reader = {.struct_size = sizeof reader, .context = &b, .read = read_bytes};
    struct lull_error e = {.struct_size = sizeof e};
    int32_t code = LULL_OK;
    for (int s = 0; s <= PT_MASK_STEPS && code == LULL_OK; s++)
        code = c->dialled[s] ? state->load(c->dialled[s], &reader, &e) : LULL_OK;
    if (code != LULL_OK)
        return pt_criterion_fail(c, "cannot load its state: ", code, &e, err);
    if (b.at != size)
        return base_fail(err, BASE_EINVAL, "criterion %s: %zu bytes of its state were left over", c->table->id, size - b.at);
    return 0;
}
