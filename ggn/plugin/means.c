#include "plugin/means.h"

#include <lull/criterion_kit.h>

enum { MEANS = 2 }; /* the base and the next one */

struct state_header {
    char magic[8];
    uint64_t count, values; /* blocks; of one mean of each of them */
};

static struct state_header header_of(const struct gp_history *means)
{
    struct state_header header = {{'l', 'o', 'o', 'k', 's', '/', '1', 0}, means->count, 0};
    for (uint32_t id = 0; id < means->count; id++)
        header.values += means->block[id].slot.kept / sizeof(float);
    return header;
}

static struct gp_slot slot_of(const void *of, int32_t width, int32_t height)
{
    (void)of;
    return (struct gp_slot){.kept = 3 * (size_t)width * (size_t)height * sizeof(float)};
}

int32_t gp_means_create(struct gp_history *means, const struct lull_frame *frame, struct lull_error *err)
{
    const struct gp_history_form form = {MEANS, "two means at", slot_of, NULL};
    return gp_history_create(means, &form, frame, err);
}

const float *gp_means_begin(struct gp_history *means, uint32_t id, uint64_t spp, float **keep, uint64_t *spp_base)
{
    struct gp_head *head = &means->block[id].pending;
    struct ggn_stopper *s = &head->stopper;
    *head = means->block[id].head;
    *keep = NULL;
    if (!s->used || spp / 2 >= s->spp[s->used - 1]) {
        *keep = gp_history_kept(means, id, gp_head_push(head, MEANS, s->used));
        if (s->used == MEANS)
            s->spp[0] = s->spp[--s->used];
        s->spp[s->used++] = spp;
    }
    const uint32_t which = s->used == MEANS && s->spp[0] >= spp ? 1 : 0;
    *spp_base = s->spp[which];
    return *spp_base < spp ? gp_history_kept(means, id, head->order[which]) : NULL;
}

int32_t gp_means_save(const struct gp_history *means, const struct lull_writer *writer, struct lull_error *err)
{
    const struct state_header header = header_of(means);
    int32_t status = means->count ? writer->write(writer, &header, sizeof header) : LULL_OK;
    for (uint32_t id = 0; id < means->count && !status; id++) {
        const struct gp_history_block *b = &means->block[id];
        const struct ggn_stopper *s = &b->head.stopper;
        uint64_t spp[MEANS] = {0}; /* the newest is the last one */
        memcpy(spp + MEANS - s->used, s->spp, s->used * sizeof *spp);
        status = writer->write(writer, spp, sizeof spp);
        for (uint32_t k = 0; k < s->used && !status; k++)
            status = writer->write(writer, gp_history_kept(means, id, b->head.order[k]), b->slot.kept);
    }
    return status ? lull_kit_fail(err, status, "save: the host could not write it") : LULL_OK;
}

static int32_t load_blocks(struct gp_history *means, const struct lull_reader *reader, struct lull_error *err)
{
    for (uint32_t id = 0; id < means->count; id++) {
        struct gp_history_block *b = &means->block[id];
        struct ggn_stopper *s = &b->head.stopper;
        uint64_t spp[MEANS];
        if (reader->read(reader, spp, sizeof spp))
            return lull_kit_fail(err, LULL_E_IO, "load: the state ends early, at block %u", id);
        if (spp[0] >= spp[1] && (spp[0] || spp[1]))
            return lull_kit_fail(err, LULL_E_IO, "load: the state's means at block %u are out of order", id);
        s->used = spp[0] ? MEANS : spp[1] > 0;
        memcpy(s->spp, spp + MEANS - s->used, s->used * sizeof *spp);
        for (uint32_t k = 0; k < s->used; k++)
            if (reader->read(reader, gp_history_kept(means, id, b->head.order[k]), b->slot.kept))
                return lull_kit_fail(err, LULL_E_IO, "load: the state ends early, at block %u", id);
    }
    return LULL_OK;
}

int32_t gp_means_load(struct gp_history *means, const struct lull_reader *reader, struct lull_error *err)
{
    struct state_header header, wanted = header_of(means);
    struct gp_history fresh;
    if (!means->count)
        return LULL_OK;
    if (reader->read(reader, &header, sizeof header))
        return lull_kit_fail(err, LULL_E_IO, "load: the state ends early");
    if (memcmp(&header, &wanted, sizeof header) != 0)
        return lull_kit_fail(err, LULL_E_IO, "load: the state is that of another criterion or frame");
    int32_t status = gp_history_like(&fresh, means, err);
    if (!status)
        status = load_blocks(&fresh, reader, err);
    return gp_history_take(means, &fresh, status);
}
