/*
 * A criterion that keeps what it is shown: each look at a block becomes a file FOLDER/BLOCK-SPP.planes, so that rules can be tried
 * on real renders without rendering again. FOLDER is LULL_PLANES. It stops nothing and asks again at LULL_PLANES_GROWTH times the
 * samples (1.19).
 *
 * A file is little endian: "LULLPLN1", u32 width, height, spp, half_spp, then float32 estimates, planar, rows from the top: COLOR,
 * HALF, ALBEDO, NORMAL of three channels and MOMENT2 of one, in this order; planes that the view lacks are zeros.
 */
#include <lull/criterion_kit.h>

#include <stdio.h>

static const struct lull_param params[1]; /* none */

enum { PLANES = 5 };
static const unsigned planes[PLANES] = {LULL_PLANE_COLOR, LULL_PLANE_HALF, LULL_PLANE_ALBEDO, LULL_PLANE_NORMAL,
                                        LULL_PLANE_MOMENT2};

#define BIT(plane) LULL_PLANE_BIT(LULL_PLANE_##plane)
static const uint32_t used = BIT(COLOR) | BIT(HALF) | BIT(ALBEDO) | BIT(NORMAL) | BIT(MOMENT2);

static void put_plane(const struct lull_view *view, const struct lull_block *b, unsigned plane, FILE *file)
{
    struct lull_kit_span s;
    for (uint32_t c = 0; c < lull_kit_channels(plane); c++)
        for (lull_kit_span_begin(&s, view, b, used); lull_kit_span_next(&s);)
            for (int32_t i = 0; i < s.count; i++) {
                float value = s.planes & LULL_PLANE_BIT(plane) ? (float)s.value[plane][i][c] : 0.0f;
                fwrite(&value, sizeof value, 1, file);
            }
}

static void judge(struct lull_instance *in, const struct lull_view *view, const struct lull_block *b,
                  struct lull_decision *d, uint32_t worker)
{
    const char *folder = getenv("LULL_PLANES"), *growth = getenv("LULL_PLANES_GROWTH");
    const uint32_t head[4] = {(uint32_t)(b->x1 - b->x0), (uint32_t)(b->y1 - b->y0), (uint32_t)b->spp, (uint32_t)b->half_spp};
    const uint64_t next = (uint64_t)ceil((double)b->spp * (growth ? atof(growth) : 1.19));
    char name[4096];
    (void)in, (void)worker;
    d->next_spp = next > b->spp ? next + next % 2 : b->spp + 2;
    snprintf(name, sizeof name, "%s/%u-%06u.planes", folder ? folder : ".", b->id, (unsigned)b->spp);
    FILE *file = fopen(name, "wb");
    if (!file)
        return;
    fwrite("LULLPLN1", 8, 1, file);
    fwrite(head, sizeof head, 1, file);
    for (int k = 0; k < PLANES; k++)
        put_plane(view, b, planes[k], file);
    fclose(file);
}

static const struct lull_kit_rule rule = {.planes_required = BIT(COLOR), .planes_used = used, .judge = judge};

LULL_KIT_CRITERION(rule, params, 0, "planes", "Keeps what it is shown", "1.0",
                   "Writes the planes of each look at a block into a file.");
