/* Rectangles of pixels, of which a block is one. Pure functions, any thread. */
#ifndef GGN_PLUGIN_RECT_H
#define GGN_PLUGIN_RECT_H

#include <lull/criterion_kit.h>

static inline int32_t gp_most(int32_t a, int32_t b) { return a > b ? a : b; }

static inline int32_t gp_least(int32_t a, int32_t b) { return a < b ? a : b; }

static inline struct lull_rect gp_rect_of(const struct lull_block *b)
{
    return (struct lull_rect){b->x0, b->y0, b->x1, b->y1};
}

static inline int gp_rect_same(struct lull_rect a, struct lull_rect b) { return memcmp(&a, &b, sizeof a) == 0; }

/* What is in both; an x1 or y1 that is not above x0 or y0 says that nothing is. */
static inline struct lull_rect gp_rect_common(struct lull_rect a, struct lull_rect b)
{
    return (struct lull_rect){gp_most(a.x0, b.x0), gp_most(a.y0, b.y0), gp_least(a.x1, b.x1), gp_least(a.y1, b.y1)};
}

/* The smallest one around both. */
static inline struct lull_rect gp_rect_around(struct lull_rect a, struct lull_rect b)
{
    return (struct lull_rect){gp_least(a.x0, b.x0), gp_least(a.y0, b.y0), gp_most(a.x1, b.x1), gp_most(a.y1, b.y1)};
}

/* And around all blocks of a checked frame. */
static inline struct lull_rect gp_rect_of_frame(const struct lull_frame *frame)
{
    struct lull_rect all = *lull_kit_rect(frame, 0);
    for (uint32_t i = 1; i < frame->block_count; i++)
        all = gp_rect_around(all, *lull_kit_rect(frame, i));
    return all;
}

#endif
