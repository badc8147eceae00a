/*
 * The blocks of an image, what is known about each, and when each is asked about next.
 *
 * The grid always starts at the image's upper left corner, so that a crop does not move it; blocks at the right and lower
 * edge are smaller. A crop selects the blocks that it touches, and these are rendered whole: a criterion judges the same
 * pixels with and without it. Plain data, no locks.
 */
#ifndef PT_RENDER_BLOCKS_H
#define PT_RENDER_BLOCKS_H

#include <stdint.h>

#include "base/err.h"

enum pt_block_reason {
    PT_REASON_NONE,      /* still active */
    PT_REASON_CRITERION, /* converged: the criterion said stop */
    PT_REASON_SPP_MAX,   /* --spp-max reached */
    PT_REASON_UNIFORM,   /* --spp reached */
    PT_REASON_TIME,      /* --time-budget spent */
    PT_REASON_INTERRUPT, /* SIGINT */
    PT_REASON_DROPPED,   /* the criterion said stop twice, but non-finite samples were seen: not called converged */
    PT_REASON_COUNT
};
/* "criterion", "spp-max", … Static text. */
const char *pt_block_reason_name(int reason);

struct pt_block {
    uint32_t id;            /* place in the full image's grid, row by row */
    int32_t x0, y0, x1, y1; /* pixels, end exclusive */
    uint64_t spp, next_spp; /* next_spp: where the next check is; > spp while the block is being rendered */
    int32_t reason;         /* enum pt_block_reason; the block is active while NONE */
    uint32_t checks;
    uint32_t stop_votes;    /* successive STOP answers, counted for blocks that dropped samples */
    uint32_t asked;         /* a decision is known: p_noisy, error, predicted_spp are of the check at asked_spp */
    uint64_t asked_spp;
    double p_noisy, error, predicted_spp; /* NaN = not known */
    double thread_s;
    uint64_t rays, dropped;
};

struct pt_blocks {
    struct pt_block *list;  /* owns; by id */
    uint32_t count;
    uint32_t columns, rows; /* of the full image's grid */
    uint32_t list_columns;  /* of the part that is in the list, which is a rectangle of blocks */
    int block_width, block_height;
    int x0, y0, x1, y1;     /* smallest rectangle that holds all blocks of the list */
};

/* crop = {x0, y0, x1, y1} inside the image, not empty. clip: cut blocks to the crop (when nobody judges them). */
int pt_blocks_init(struct pt_blocks *blocks, int width, int height, int block_width, int block_height, const int crop[4],
                   int clip, struct base_err *err);
void pt_blocks_release(struct pt_blocks *blocks);

/* The sample count of the check after one at spp: `asked` when the criterion named one, else a geometric step. */
uint64_t pt_blocks_next_check(uint64_t spp, uint64_t asked, uint64_t spp_max);

/* Re-opens stopped blocks beside one that has more than max_seam times their samples, up to that ratio, so that no edge in
 * noise level shows. Returns how many were re-opened. */
uint32_t pt_blocks_reopen(struct pt_blocks *blocks, double max_seam);

#endif
