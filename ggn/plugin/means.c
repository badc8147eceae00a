#include "plugin/means.h"

#include <lull/criterion_kit.h>

enum { SLOTS = 3, BASE = 0, NEXT = 1, SPARE = 2 };

struct state_header {
    char magic[8];
    uint64_t count, values;
};

static struct state_header header_of(const struct gp_means *l)
{
    return (struct state_header){{'l', 'o', 'o', 'k', 's', '/', '1', 0}, l->count, l->values};
}

/* values: of one mean of each block. The caller fills `at`. */
static int32_t allocate(struct gp_means *means, uint32_t count, uint64_t values, struct lull_error *err)
{
    const size_t n = count, heads = (n + 1) * sizeof(size_t) + 2 * n * sizeof(struct gp_mean_head);
    if (values > (PTRDIFF_MAX - heads) / (SLOTS * sizeof(float)))
        return lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: the blocks are too large for memory");
    unsigned char *memory = calloc(1, heads + SLOTS * (size_t)values * sizeof(float));
    if (!memory)
        return lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: no memory for two means at %u blocks", count);
    struct gp_means l = {.count = count, .values = (size_t)values, .memory = memory};
    void *p = memory;
    l.head = p;
    l.pending = l.head + n;
    p = l.pending + n;
    l.at = p;
    p = l.at + n + 1;
    l.pixels = p;
    for (uint32_t id = 0; id < count; id++)
        l.head[id] = (struct gp_mean_head){.slot = {BASE, NEXT, SPARE}};
    *means = l;
    return LULL_OK;
}

int32_t gp_means_create(struct gp_means *means, const struct lull_frame *frame, struct lull_error *err)
{
    uint64_t values = 0;
    for (uint32_t id = 0; id < frame->block_count && values <= PTRDIFF_MAX; id++) {
        const struct lull_rect *r = lull_kit_rect(frame, id);
        values += 3 * (uint64_t)(r->x1 - r->x0) * (uint64_t)(r->y1 - r->y0);
    }
    int32_t status = allocate(means, frame->block_count, values, err);
    if (status)
        return status;
    for (uint32_t id = 0; id < frame->block_count; id++) {
        const struct lull_rect *r = lull_kit_rect(frame, id);
        means->at[id + 1] = means->at[id] + 3 * (size_t)(r->x1 - r->x0) * (size_t)(r->y1 - r->y0);
    }
    return LULL_OK;
}

void gp_means_release(struct gp_means *means)
{
    free(means->memory);
    *means = (struct gp_means){0};
}

size_t gp_means_values(const struct gp_means *l, uint32_t id) { return l->at[id + 1] - l->at[id]; }

static float *pixels_of(const struct gp_means *l, uint32_t id, uint32_t slot)
{
    return l->pixels + SLOTS * l->at[id] + slot * gp_means_values(l, id);
}

const float *gp_means_begin(struct gp_means *l, uint32_t id, uint64_t spp, float **keep, uint64_t *spp_base)
{
    struct gp_mean_head *h = &l->pending[id];
    *h = l->head[id];
    *keep = NULL;
    if (spp / 2 >= h->next) { /* the first mean, too */
        const uint32_t base = h->slot[BASE];
        h->base = h->next;
        h->next = spp;
        h->slot[BASE] = h->slot[NEXT];
        h->slot[NEXT] = h->slot[SPARE];
        h->slot[SPARE] = base;
        *keep = pixels_of(l, id, h->slot[NEXT]);
    }
    const int which = h->base > 0 && h->base < spp ? BASE : NEXT;
    *spp_base = which == BASE ? h->base : h->next;
    return *spp_base < spp ? pixels_of(l, id, h->slot[which]) : NULL;
}

void gp_means_commit(struct gp_means *l, uint32_t id) { l->head[id] = l->pending[id]; }

int32_t gp_means_save(const struct gp_means *l, const struct lull_writer *writer, struct lull_error *err)
{
    struct state_header header = header_of(l);
    int32_t status = l->count ? writer->write(writer, &header, sizeof header) : LULL_OK;
    for (uint32_t id = 0; id < l->count && !status; id++) {
        const struct gp_mean_head *h = &l->head[id];
        const uint64_t spp[2] = {h->base, h->next};
        const size_t bytes = gp_means_values(l, id) * sizeof(float);
        status = writer->write(writer, spp, sizeof spp);
        for (int k = BASE; k <= NEXT && !status; k++)
            status = spp[k] ? writer->write(writer, pixels_of(l, id, h->slot[k]), bytes) : LULL_OK;
    }
    return status ? lull_kit_fail(err, status, "save: the host could not write it") : LULL_OK;
}

static int32_t load_blocks(struct gp_means *l, const struct lull_reader *reader, struct lull_error *err)
{
    for (uint32_t id = 0; id < l->count; id++) {
        const size_t bytes = gp_means_values(l, id) * sizeof(float);
        uint64_t spp[2];
        if (reader->read(reader, spp, sizeof spp))
            return lull_kit_fail(err, LULL_E_IO, "load: the state ends early, at block %u", id);
        if (spp[BASE] >= spp[NEXT] && (spp[BASE] || spp[NEXT]))
            return lull_kit_fail(err, LULL_E_IO, "load: the state's means at block %u are out of order", id);
        l->head[id].base = spp[BASE];
        l->head[id].next = spp[NEXT];
        for (int k = BASE; k <= NEXT; k++)
            if (spp[k] && reader->read(reader, pixels_of(l, id, (uint32_t)k), bytes))
                return lull_kit_fail(err, LULL_E_IO, "load: the state ends early, at block %u", id);
    }
    return LULL_OK;
}

int32_t gp_means_load(struct gp_means *means, const struct lull_reader *reader, struct lull_error *err)
{
    struct state_header header, wanted = header_of(means);
    struct gp_means l;
    if (!means->count)
        return LULL_OK;
    if (reader->read(reader, &header, sizeof header))
        return lull_kit_fail(err, LULL_E_IO, "load: the state ends early");
    if (memcmp(&header, &wanted, sizeof header) != 0)
        return lull_kit_fail(err, LULL_E_IO, "load: the state is that of another criterion or frame");
    int32_t status = allocate(&l, means->count, means->values, err);
    if (status)
        return status;
    memcpy(l.at, means->at, ((size_t)l.count + 1) * sizeof *l.at);
    status = load_blocks(&l, reader, err);
    if (status) {
        gp_means_release(&l);
        return status;
    }
    gp_means_release(means);
    *means = l;
    return LULL_OK;
}
