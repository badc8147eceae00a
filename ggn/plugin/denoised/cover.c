#include "plugin/denoised/cover.h"

#include "denoise/oidn.h"
#include "plugin/rect.h"

enum { LOOK_BACK = 8 }; /* groups that one is held against */

/* One side: pixels [*from, *to) become those of the box. */
static void widen(int32_t *from, int32_t *to, int32_t area0, int32_t area1)
{
    const int32_t origin = area0 - LULL_OIDN_MARGIN;
    const int32_t first = (*from - origin) / LULL_OIDN_GRID, end = (*to - 1 - origin) / LULL_OIDN_GRID + 1;
    *from = gp_most(origin, origin + first * LULL_OIDN_GRID - LULL_OIDN_HALO);
    *to = gp_least(area1 + LULL_OIDN_MARGIN, origin + end * LULL_OIDN_GRID + LULL_OIDN_HALO);
}

struct lull_rect gd_box_around(const struct lull_rect *core, const struct lull_rect *area)
{
    struct lull_rect box = *core;
    widen(&box.x0, &box.x1, area->x0, area->x1);
    widen(&box.y0, &box.y1, area->y0, area->y1);
    return box;
}

int64_t gd_area_of(const struct lull_rect *rect) { return ((int64_t)rect->x1 - rect->x0) * ((int64_t)rect->y1 - rect->y0); }

/* Of the last groups the one with which `one` saves most pixels; `count`: none saves any. */
static uint32_t best_of(const struct gd_group *groups, uint32_t count, const struct gd_group *one, int64_t most)
{
    uint32_t best = count;
    int64_t saved = 0;
    for (uint32_t i = count > LOOK_BACK ? count - LOOK_BACK : 0; i < count; i++) {
        const struct lull_rect both = gp_rect_around(groups[i].box, one->box);
        const int64_t joined = gd_area_of(&both), saves = gd_area_of(&groups[i].box) + gd_area_of(&one->box) - joined;
        if (joined <= most && saves > saved) {
            saved = saves;
            best = i;
        }
    }
    return best;
}

/* Once through the groups: each is joined to one before it, or stays. */
static uint32_t join(struct gd_group *groups, uint32_t count, uint32_t *next, int64_t most)
{
    uint32_t kept = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct gd_group one = groups[i];
        const uint32_t to = best_of(groups, kept, &one, most);
        if (to == kept) {
            groups[kept++] = one;
            continue;
        }
        groups[to].box = gp_rect_around(groups[to].box, one.box);
        next[groups[to].last] = one.first;
        groups[to].last = one.last;
    }
    return kept;
}

uint32_t gd_cover(struct gd_group *groups, uint32_t count, uint32_t *next, int64_t most)
{
    uint32_t kept = join(groups, count, next, most);
    for (uint32_t before = count; kept < before;) {
        before = kept;
        kept = join(groups, kept, next, most);
    }
    return kept;
}
