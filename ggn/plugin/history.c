#include "plugin/history.h"

#include <lull/criterion_kit.h>

static size_t slot_bytes(struct gp_slot slot) { return (slot.made + slot.kept + 63) & ~(size_t)63; }

uint64_t gp_history_block_bytes(int window, struct gp_slot slot)
{
    return (uint64_t)(window + 1) * slot_bytes(slot) + 2 * sizeof(struct gp_head);
}

int32_t gp_history_create(struct gp_history *history, const struct gp_history_form *form, const struct lull_frame *frame,
                          struct lull_error *err)
{
    const uint64_t slots = (uint64_t)form->window + 1, heads = frame->block_count * sizeof(struct gp_history_block);
    uint64_t bytes = 0;
    *history = (struct gp_history){0};
    for (uint32_t i = 0; i < frame->block_count && bytes <= PTRDIFF_MAX; i++) {
        const struct lull_rect *r = lull_kit_rect(frame, i);
        const int32_t width = r->x1 - r->x0, height = r->y1 - r->y0;
        const int countable = (uint64_t)width * (uint64_t)height <= PTRDIFF_MAX / 64; /* so that no size below overflows */
        bytes = countable ? bytes + slots * slot_bytes(form->slot(form->of, width, height)) : UINT64_MAX;
    }
    if (bytes > PTRDIFF_MAX - heads - 64)
        return lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: the blocks are too large for memory");
    /* One piece of memory, so that no check allocates and a frame that is too large fails at its beginning. */
    unsigned char *memory = aligned_alloc(64, (size_t)((bytes + heads + 63) & ~(uint64_t)63));
    if (!memory)
        return lull_kit_fail(err, LULL_E_MEMORY, "begin_frame: no memory for %s %u blocks", form->what, frame->block_count);

    *history =
        (struct gp_history){.form = *form, .count = frame->block_count, .block = (void *)(memory + bytes), .bytes = memory};
    size_t at = 0;
    for (uint32_t i = 0; i < frame->block_count; i++) {
        const struct lull_rect r = *lull_kit_rect(frame, i);
        struct gp_history_block *b = &history->block[i];
        *b = (struct gp_history_block){.rect = r, .slot = form->slot(form->of, r.x1 - r.x0, r.y1 - r.y0), .at = at};
        at += slots * slot_bytes(b->slot);
        for (uint32_t k = 0; k < slots; k++)
            b->head.order[k] = k;
    }
    return LULL_OK;
}

int32_t gp_history_like(struct gp_history *fresh, const struct gp_history *h, struct lull_error *err)
{
    const struct lull_frame frame = {.blocks = &h->block->rect, .block_count = h->count, .block_stride = sizeof *h->block};
    return gp_history_create(fresh, &h->form, &frame, err);
}

int32_t gp_history_take(struct gp_history *history, struct gp_history *fresh, int32_t status)
{
    gp_history_release(status ? fresh : history);
    if (!status)
        *history = *fresh;
    return status;
}

void gp_history_release(struct gp_history *history)
{
    free(history->bytes);
    *history = (struct gp_history){0};
}

void *gp_history_made(const struct gp_history *h, uint32_t id, uint32_t slot)
{
    return h->bytes + h->block[id].at + slot * slot_bytes(h->block[id].slot);
}

void *gp_history_kept(const struct gp_history *h, uint32_t id, uint32_t slot)
{
    return (unsigned char *)gp_history_made(h, id, slot) + h->block[id].slot.made;
}

uint32_t gp_head_push(struct gp_head *head, int window, uint32_t before)
{
    uint32_t slot = head->order[before];
    if (before == (uint32_t)window) {
        /* the oldest image leaves; its slot is the next spare one */
        uint32_t oldest = head->order[0];
        memmove(head->order, head->order + 1, (size_t)window * sizeof head->order[0]);
        head->order[window] = oldest;
    }
    head->made &= ~(UINT32_C(1) << slot);
    return slot;
}
