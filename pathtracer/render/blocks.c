#include "render/blocks.h"

#include <math.h>
#include <stdlib.h>

/* Between checks that the criterion did not place, samples grow by this factor: cost of checks stays proportional to
 * log(spp) and a block overshoots its threshold by 15 % at most. */
static const double CHECK_RATIO = 1.15;

const char *pt_block_reason_name(int reason)
{
    static const char *const names[PT_REASON_COUNT] = {"none", "criterion", "spp-max", "uniform", "time", "interrupt",
                                                       "dropped"};
    return reason >= 0 && reason < PT_REASON_COUNT ? names[reason] : "unknown";
}

static int imin(int a, int b) { return a < b ? a : b; }
static int imax(int a, int b) { return a > b ? a : b; }

int pt_blocks_init(struct pt_blocks *blocks, int width, int height, int block_width, int block_height, const int crop[4],
                   int clip, struct base_err *err)
{
    struct pt_blocks b = {.block_width = block_width, .block_height = block_height};
    b.columns = (uint32_t)((width - 1) / block_width + 1);
    b.rows = (uint32_t)((height - 1) / block_height + 1);
    int c0 = crop[0] / block_width, c1 = (crop[2] - 1) / block_width + 1;
    int r0 = crop[1] / block_height, r1 = (crop[3] - 1) / block_height + 1;
    b.list_columns = (uint32_t)(c1 - c0);
    b.count = b.list_columns * (uint32_t)(r1 - r0);
    b.list = calloc(b.count, sizeof *b.list);
    if (!b.list)
        return base_fail_nomem(err, "blocks");

    struct pt_block *out = b.list;
    for (int r = r0; r < r1; r++) {
        for (int c = c0; c < c1; c++, out++) {
            *out = (struct pt_block){.id = (uint32_t)r * b.columns + (uint32_t)c, .p_noisy = NAN, .error = NAN,
                                     .predicted_spp = NAN};
            out->x0 = c * block_width;
            out->y0 = r * block_height;
            out->x1 = imin(width - out->x0, block_width) + out->x0;
            out->y1 = imin(height - out->y0, block_height) + out->y0;
            if (clip) {
                out->x0 = imax(out->x0, crop[0]);
                out->y0 = imax(out->y0, crop[1]);
                out->x1 = imin(out->x1, crop[2]);
                out->y1 = imin(out->y1, crop[3]);
            }
        }
    }
    b.x0 = b.list[0].x0;
    b.y0 = b.list[0].y0;
    b.x1 = b.list[b.count - 1].x1;
    b.y1 = b.list[b.count - 1].y1;
    *blocks = b;
    return 0;
}

void pt_blocks_release(struct pt_blocks *blocks)
{
    free(blocks->list);
    *blocks = (struct pt_blocks){0};
}

uint64_t pt_blocks_next_check(uint64_t spp, uint64_t asked, uint64_t spp_max)
{
    uint64_t next = asked > spp ? asked : (uint64_t)ceil((double)spp * CHECK_RATIO);
    if (next <= spp)
        next = spp + 1;
    return next > spp_max ? spp_max : next;
}

/* Samples of the block's most sampled edge neighbour. */
static uint64_t neighbour_spp(const struct pt_blocks *b, uint32_t i)
{
    uint32_t column = i % b->list_columns;
    uint64_t most = 0;
    if (column > 0 && b->list[i - 1].spp > most)
        most = b->list[i - 1].spp;
    if (column + 1 < b->list_columns && b->list[i + 1].spp > most)
        most = b->list[i + 1].spp;
    if (i >= b->list_columns && b->list[i - b->list_columns].spp > most)
        most = b->list[i - b->list_columns].spp;
    if (i + b->list_columns < b->count && b->list[i + b->list_columns].spp > most)
        most = b->list[i + b->list_columns].spp;
    return most;
}

uint32_t pt_blocks_reopen(struct pt_blocks *b, double max_seam)
{
    uint32_t reopened = 0;
    for (uint32_t i = 0; i < b->count; i++) {
        struct pt_block *block = &b->list[i];
        if (block->reason != PT_REASON_CRITERION && block->reason != PT_REASON_DROPPED)
            continue;
        uint64_t need = (uint64_t)ceil((double)neighbour_spp(b, i) / max_seam);
        if (need <= block->spp)
            continue;
        block->reason = PT_REASON_NONE;
        block->next_spp = need;
        reopened++;
    }
    return reopened;
}
