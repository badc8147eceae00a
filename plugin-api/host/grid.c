#include "host/frame.h"

#include <math.h>
#include <search.h>
#include <stdlib.h>

/* Blocks by default: up to so many pixels wide, and small enough that a picture has so many. */
enum { USUAL_BLOCK = 200, LEAST_DEFAULT = 16, ENOUGH_BLOCKS = 12 };
/* A block takes some 300 bytes: more are a mistake. */
enum { MOST_BLOCKS = 1 << 24 };

static int32_t least(int32_t a, int32_t b) { return a < b ? a : b; }
static int32_t most(int32_t a, int32_t b) { return a > b ? a : b; }

static struct lull_host_block fresh(uint32_t id, struct lull_rect r)
{
    return (struct lull_host_block){.id = id,
                                    .x0 = r.x0,
                                    .y0 = r.y0,
                                    .x1 = r.x1,
                                    .y1 = r.y1,
                                    .p_noisy = (double)NAN,
                                    .error = (double)NAN,
                                    .predicted_spp = (double)NAN};
}

static int is_inside(const struct lull_rect *r, const struct lull_host_config *g)
{
    return r->x0 >= 0 && r->x0 < r->x1 && r->x1 <= (int32_t)g->width && r->y0 >= 0 && r->y0 < r->y1 &&
           r->y1 <= (int32_t)g->height;
}

static uint64_t count_of(const struct lull_host_config *g, uint32_t size)
{
    return (uint64_t)((g->width - 1) / size + 1) * ((g->height - 1) / size + 1);
}

/* No block at the edge is narrower than half of the others. */
static int is_even(uint32_t length, uint32_t size)
{
    return length <= size || length % size == 0 || 2 * (length % size) >= size;
}

/* The block size, up to `largest`, with which the picture has enough blocks: the largest even one, if there is one. */
static uint32_t default_size(const struct lull_host_config *g, uint32_t largest)
{
    uint32_t fine = 0;
    if (count_of(g, largest) >= ENOUGH_BLOCKS)
        return largest;
    for (uint32_t size = largest - 1; size >= LEAST_DEFAULT; size--) {
        if (count_of(g, size) < ENOUGH_BLOCKS)
            continue;
        if (is_even(g->width, size) && is_even(g->height, size))
            return size;
        fine = fine > 0 ? fine : size;
    }
    return fine > 0 ? fine : largest < LEAST_DEFAULT ? largest : LEAST_DEFAULT;
}

static int32_t choose_size(const struct lull_host_config *g, const struct lull_requirements *needs,
                           struct lull_host_blocks *b, struct lull_error *err)
{
    uint32_t own_width = needs && needs->block_width ? needs->block_width : USUAL_BLOCK;
    uint32_t own_height = needs && needs->block_height ? needs->block_height : USUAL_BLOCK;
    uint32_t width = g->block_width, height = g->block_height;
    if (needs && needs->block_width && !(needs->flags & LULL_REQ_FLEXIBLE)) {
        width = width ? width : own_width;
        height = height ? height : own_height;
    } else if (width == 0 || height == 0) {
        uint32_t size = default_size(g, own_width < own_height ? own_width : own_height);
        width = width ? width : size;
        height = height ? height : size;
    }
    if (width > INT32_MAX || height > INT32_MAX)
        return lull_error_set(err, LULL_E_INVALID, "blocks of %ux%u pixels are too large", width, height);
    b->block_width = (int32_t)width;
    b->block_height = (int32_t)height;
    return LULL_OK;
}

static int32_t make_list(struct lull_host_blocks *b, uint64_t count, struct lull_error *err)
{
    if (count > MOST_BLOCKS)
        return lull_error_set(err, LULL_E_INVALID, "%llu blocks are too many: expected at most %d",
                              (unsigned long long)count, MOST_BLOCKS);
    b->count = (uint32_t)count;
    b->list = calloc(b->count, sizeof *b->list);
    return b->list ? LULL_OK : lull_host_no_memory(err, "blocks");
}

static int32_t lay_grid(const struct lull_host_config *g, int clip, struct lull_host_blocks *b, struct lull_error *err)
{
    struct lull_rect crop = {g->crop[0], g->crop[1], g->crop[2], g->crop[3]};
    const int32_t width = (int32_t)g->width, height = (int32_t)g->height, w = b->block_width, h = b->block_height;
    if (crop.x0 == 0 && crop.y0 == 0 && crop.x1 == 0 && crop.y1 == 0)
        crop = (struct lull_rect){0, 0, width, height};
    if (!is_inside(&crop, g))
        return lull_error_set(err, LULL_E_INVALID, "crop %d,%d,%d,%d: it must lie inside %ux%u pixels and not be empty",
                              crop.x0, crop.y0, crop.x1, crop.y1, g->width, g->height);
    b->columns = (uint32_t)((width - 1) / w + 1);
    b->rows = (uint32_t)((height - 1) / h + 1);
    int32_t c0 = crop.x0 / w, c1 = (crop.x1 - 1) / w + 1, r0 = crop.y0 / h, r1 = (crop.y1 - 1) / h + 1;
    const int32_t code = make_list(b, (uint64_t)(c1 - c0) * (uint64_t)(r1 - r0), err);
    if (code != LULL_OK)
        return code;
    b->list_columns = (uint32_t)(c1 - c0);
    struct lull_host_block *out = b->list;
    for (int32_t r = r0; r < r1; r++) {
        for (int32_t c = c0; c < c1; c++) {
            struct lull_rect at = {c * w, r * h, least(width - c * w, w) + c * w, least(height - r * h, h) + r * h};
            if (clip)
                at = (struct lull_rect){most(at.x0, crop.x0), most(at.y0, crop.y0), least(at.x1, crop.x1),
                                        least(at.y1, crop.y1)};
            *out++ = fresh((uint32_t)r * b->columns + (uint32_t)c, at);
        }
    }
    return LULL_OK;
}

static int by_top(const void *a, const void *b)
{
    const struct lull_host_block *x = *(const struct lull_host_block *const *)a,
                                 *y = *(const struct lull_host_block *const *)b;
    const int rows = (x->y0 > y->y0) - (x->y0 < y->y0);
    return rows ? rows : (x->x0 > y->x0) - (x->x0 < y->x0);
}

/* Blocks that one line of pixels crosses have an order; two that overlap have none. */
static int by_columns(const void *a, const void *b)
{
    const struct lull_host_block *x = a, *y = b;
    return (x->x0 >= y->x1) - (y->x0 >= x->x1);
}

/* A line of pixels goes down the picture, with a tree of the blocks that it crosses. One that it has left stays in the tree
 * until another takes its columns. */
static int32_t check_disjoint(const struct lull_host_block *list, uint32_t count, struct lull_error *err)
{
    const struct lull_host_block **sorted = calloc(count, sizeof *sorted);
    if (!sorted)
        return lull_host_no_memory(err, "blocks");
    void *line = NULL;
    int32_t code = LULL_OK;
    for (uint32_t i = 0; i < count; i++)
        sorted[i] = &list[i];
    qsort(sorted, count, sizeof *sorted, by_top);
    for (uint32_t i = 0; i < count && code == LULL_OK; i++) {
        const struct lull_host_block *b = sorted[i], *other = NULL, *const * found;
        while ((found = tsearch(b, &line, by_columns)) && *found != b && (*found)->y1 <= b->y0)
            tdelete(*found, &line, by_columns);
        if (!found)
            code = lull_host_no_memory(err, "blocks");
        else if (*found != b) {
            for (uint32_t k = 0; k < i; k++) /* the leftmost one is named */
                if (sorted[k]->y1 > b->y0 && by_columns(sorted[k], b) == 0 && (!other || sorted[k]->x0 < other->x0))
                    other = sorted[k];
            code = lull_error_set(err, LULL_E_INVALID, "blocks %u (%d,%d,%d,%d) and %u (%d,%d,%d,%d) overlap", other->id,
                                  other->x0, other->y0, other->x1, other->y1, b->id, b->x0, b->y0, b->x1, b->y1);
        }
    }
    while (line)
        tdelete(*(const struct lull_host_block *const *)line, &line, by_columns);
    free(sorted);
    return code;
}

static int32_t lay_own(const struct lull_host_config *g, struct lull_host_blocks *b, struct lull_error *err)
{
    if (!g->layout)
        return lull_error_set(err, LULL_E_INVALID, "layout is NULL, layout_count is %u", g->layout_count);
    if (g->layout_count == 0 || g->layout_stride < sizeof(struct lull_rect) || g->layout_stride % sizeof(int32_t) != 0 ||
        (uintptr_t)g->layout % sizeof(int32_t) != 0)
        return lull_error_set(err, LULL_E_INVALID, "the layout has no blocks or a bad stride");
    const int32_t code = make_list(b, g->layout_count, err);
    if (code != LULL_OK)
        return code;
    for (uint32_t i = 0; i < b->count; i++) {
        const struct lull_rect *r = (const void *)((const char *)g->layout + (size_t)i * g->layout_stride);
        if (!is_inside(r, g))
            return lull_error_set(err, LULL_E_INVALID,
                                  "block %u (%d,%d,%d,%d) must lie inside %ux%u pixels and not be empty", i, r->x0, r->y0,
                                  r->x1, r->y1, g->width, g->height);
        b->list[i] = fresh(i, *r);
    }
    return check_disjoint(b->list, b->count, err);
}

int32_t lull_host_lay_out(const struct lull_host_config *g, const struct lull_requirements *needs, int clip,
                          struct lull_host_blocks *out, struct lull_error *err)
{
    struct lull_host_blocks b = {.struct_size = sizeof b,
                                 .flags = g->flags & (LULL_HOST_UNIFORM | LULL_HOST_OPEN_ENDED),
                                 .spp_min = g->spp_min,
                                 .spp_max = g->spp_max,
                                 .check_step = g->check_step > 0 ? g->check_step : 1,
                                 .x0 = INT32_MAX,
                                 .y0 = INT32_MAX};
    if (g->width < 1 || g->height < 1 || g->width > INT32_MAX || g->height > INT32_MAX)
        return lull_error_set(err, LULL_E_INVALID, "a picture of %ux%u pixels: expected 1 to 2^31 - 1", g->width, g->height);
    int32_t code = choose_size(g, needs, &b, err);
    if (code == LULL_OK)
        code = g->layout || g->layout_count > 0 ? lay_own(g, &b, err) : lay_grid(g, clip, &b, err);
    if (code != LULL_OK) {
        free(b.list);
        return code;
    }
    for (uint32_t i = 0; i < b.count; i++) {
        b.x0 = least(b.x0, b.list[i].x0);
        b.y0 = least(b.y0, b.list[i].y0);
        b.x1 = most(b.x1, b.list[i].x1);
        b.y1 = most(b.y1, b.list[i].y1);
    }
    *out = b;
    return LULL_OK;
}
