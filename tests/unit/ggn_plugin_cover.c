/* Which rectangles are denoised for blocks that are due: every block is in one, with all that the denoiser must see. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "denoise/oidn.h"
#include "plugin/denoised/cover.h"

enum { SIDE = 200, COLUMNS = 4, BLOCKS = 16 };
static const struct lull_rect area = {0, 0, SIDE *COLUMNS, SIDE *COLUMNS};

static struct lull_rect core_of(uint32_t id)
{
    const int32_t x = (int32_t)(id % COLUMNS) * SIDE, y = (int32_t)(id / COLUMNS) * SIDE;
    return (struct lull_rect){x, y, x + SIDE, y + SIDE};
}

/* Covers the blocks of a mask; returns how many pixels that takes. */
static int64_t cover(uint32_t mask, int64_t most, uint32_t *kept)
{
    struct gd_group groups[BLOCKS];
    uint32_t next[BLOCKS], seen = 0, count = 0;
    int64_t pixels = 0;
    for (uint32_t i = 0; i < BLOCKS; i++)
        if (mask >> i & 1) {
            const struct lull_rect core = core_of(i);
            groups[count++] = (struct gd_group){gd_box_around(&core, &area), i, i};
        }
    *kept = gd_cover(groups, count, next, most);
    for (uint32_t g = 0; g < *kept; g++) {
        pixels += gd_area_of(&groups[g].box);
        for (uint32_t i = groups[g].first;; i = next[i]) {
            const struct lull_rect core = core_of(i), box = gd_box_around(&core, &area), *of = &groups[g].box;
            assert_true(of->x0 <= box.x0 && of->y0 <= box.y0 && of->x1 >= box.x1 && of->y1 >= box.y1);
            assert_false(seen >> i & 1);
            seen |= 1u << i;
            if (i == groups[g].last)
                break;
        }
    }
    assert_int_equal(seen, mask);
    return pixels;
}

static void boxes(void **unused)
{
    (void)unused;
    const struct lull_rect corner = core_of(0), inside = core_of(5), off = {-7, 3, 40, 90}, odd = {-30, 3, 5000, 400};
    const struct lull_rect first = gd_box_around(&corner, &area), second = gd_box_around(&inside, &area);
    assert_true(first.x0 == -LULL_OIDN_MARGIN && first.y0 == -LULL_OIDN_MARGIN && first.x1 == 208 + 80);
    assert_true(second.x0 == 192 - 80 && second.y1 == 400 + 80);
    const struct lull_rect box = gd_box_around(&off, &odd); /* the grid begins at -46, -13 */
    assert_true(box.x0 == -46 && box.y0 == -13 && box.x1 == -46 + 96 + 80 && box.y1 == -13 + 112 + 80);
}

static void neighbours_share(void **unused)
{
    (void)unused;
    uint32_t kept;
    assert_true(cover(0xffff, 1 << 20, &kept) == 832 * 832 && kept == 1);
    assert_true(cover(0x8001, 1 << 20, &kept) == 2 * 304 * 304 && kept == 2); /* far apart */
    assert_true(cover(0x0003, 1 << 20, &kept) == 496 * 304 && kept == 1);
    cover(0xffff, 500000, &kept); /* no rectangle is too large */
    assert_int_equal(kept, 2);
    cover(0xffff, 1, &kept);
    assert_int_equal(kept, BLOCKS);
    assert_true(cover(0, 1, &kept) == 0 && kept == 0);
    for (uint32_t mask = 1; mask < 0xffff; mask += 97)
        cover(mask, 1 << 20, &kept);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(boxes), cmocka_unit_test(neighbours_share)};
    return cmocka_run_group_tests_name("cover", tests, NULL, NULL);
}
