/* SPDX-License-Identifier: MIT */
#include "misuse.h"

#include <limits.h>
#include <string.h>

struct frame_call {
    struct lull_frame frame;
    struct lull_rect rects[LC_FILM_BLOCKS];
    uint32_t size;
    int no_frame, no_blocks;
};

static void spoil_rect(struct lc_misuse *m, const struct lull_frame *f, struct lull_rect *r)
{
    switch (lc_draw(m, 6)) {
    case 0: lc_wrong(m, INVALID, "an empty block"), r->x1 = r->x0; break;
    case 1: lc_wrong(m, INVALID, "a block upside down"), r->y1 = INT32_MIN; break;
    case 2: lc_wrong(m, INVALID, "a block beyond the right edge"), r->x1 = (int32_t)f->width + 1; break;
    case 3:
        lc_wrong(m, INVALID, "a block below the picture");
        r->y1 = lc_draw(m, 2) ? (int32_t)f->height + 1 : INT32_MAX;
        break;
    case 4: lc_wrong(m, INVALID, "a block above the picture"), r->y0 = lc_draw(m, 2) ? -1 : INT32_MIN; break;
    default: lc_wrong(m, INVALID, "a block left of the picture"), r->x0 = -1 - (int32_t)lc_draw(m, INT_MAX);
    }
}

static void spoil_frame(struct lc_misuse *m, struct frame_call *k)
{
    const uint32_t needed = m->check->req.planes_required;
    switch (lc_draw(m, needed ? 9 : 8)) {
    case 0: lc_wrong(m, INVALID, "no instance"), m->instance = NULL; break;
    case 1: lc_wrong(m, INVALID, "no frame"), k->no_frame = 1; break;
    case 2: lc_wrong(m, VERSION, "a short frame"), k->size = lc_too_small(m, sizeof k->frame); break;
    case 3: lc_wrong(m, INVALID, "blocks at NULL"), k->no_blocks = 1; break;
    case 4: lc_wrong(m, INVALID, "no blocks"), k->frame.block_count = 0; break;
    case 5:
        lc_wrong(m, SIZE, "a short stride of the blocks");
        k->frame.block_stride = lc_too_small(m, sizeof *k->rects);
        break;
    case 6: lc_wrong(m, INVALID, "an empty picture"), k->frame.width = 0; break;
    case 7: spoil_rect(m, &k->frame, &k->rects[lc_draw(m, k->frame.block_count + (k->frame.block_count == 0))]); break;
    default: lc_wrong(m, PLANE, "planes missing"), k->frame.planes &= ~needed;
    }
}

/* From 2^28 to 2^31 - 1, often a power of two: products of such numbers and of sizes overflow in many ways. */
static uint32_t huge(struct lc_misuse *m)
{
    const uint32_t shift = lc_draw(m, 4);
    return ((uint32_t)INT32_MAX >> shift) + (shift > 0);
}

/* What the header does not say is refused. */
static void loosen_frame(struct lc_misuse *m, struct frame_call *k)
{
    struct lull_frame *f = &k->frame;
    switch (lc_draw(m, 8)) {
    case 0: lc_wrong(m, MAY, "blocks that overlap"), k->rects[0] = k->rects[f->block_count - 1]; break;
    case 1: lc_wrong(m, MAY, "an exposure of nonsense"), f->exposure = lc_nonsense(m); break;
    case 2:
        lc_wrong(m, MAY, "an unknown transfer");
        f->transfer = (int32_t)lc_draw(m, 5) + 3;
        f->gamma = lc_nonsense(m);
        break;
    case 3:
        lc_wrong(m, MAY, "limits that contradict");
        f->spp_min = 1 + lc_draw(m, 1000);
        f->spp_max = lc_draw(m, (uint32_t)f->spp_min);
        break;
    case 4: lc_wrong(m, MAY, "a matrix of nonsense"), f->rgb_to_xyz[lc_draw(m, 9)] = lc_nonsense(m); break;
    case 5:
        lc_wrong(m, MAY, "times of nonsense");
        f->time_budget_s = lc_nonsense(m);
        f->sample_clamp = lc_nonsense(m);
        break;
    case 6:
        lc_wrong(m, MAY, "unknown flags and planes");
        f->flags |= 1u << (4 + lc_draw(m, 28));
        f->planes |= 1u << (8 + lc_draw(m, 24));
        break;
    default:
        lc_wrong(m, MAY, "one block larger than any memory");
        f->block_count = 1;
        f->width = huge(m), f->height = huge(m);
        k->rects[0] = (struct lull_rect){0, 0, (int32_t)f->width, (int32_t)f->height};
    }
}

static void send_frame(struct lc_misuse *m, const struct frame_call *k)
{
    struct lull_frame f = k->frame;
    const void *rects = lc_place_array(m->check, k->rects, sizeof *k->rects, f.block_count, f.block_stride);
    f.blocks = k->no_blocks ? NULL : rects;
    const struct lull_frame *at = lc_place_struct(m->check, &f, k->size);
    struct lull_error *err = lc_announce(m, "begin_frame");
    int32_t status = m->check->criterion->begin_frame(m->instance, k->no_frame ? NULL : at, err);
    lc_judge(m, "begin_frame", status, err);
}

static void frame_of_session(const struct lc_misuse *m, struct frame_call *k)
{
    *k = (struct frame_call){.size = sizeof k->frame};
    lc_film_frame(&m->s.film, &k->frame, m->s.planes);
    memcpy(k->rects, m->s.film.rects, sizeof k->rects);
}

void lc_misuse_begin(struct lc_misuse *m)
{
    struct frame_call k;
    frame_of_session(m, &k);
    lc_make_up(m, m->s.instance);
    uint32_t n = lc_how_many(m);
    k.frame.flags |= lc_draw(m, 2) ? LULL_FRAME_RESTART : 0;
    if (m->open && !(k.frame.flags & LULL_FRAME_RESTART))
        lc_wrong(m, CODE(LULL_E_STATE), "a frame is open"), n--;
    for (; n > 0; n--)
        spoil_frame(m, &k);
    send_frame(m, &k);
}

void lc_loose_begin(struct lc_misuse *m)
{
    struct frame_call k;
    frame_of_session(m, &k);
    k.frame.flags |= lc_draw(m, 4) ? LULL_FRAME_RESTART : 0;
    for (uint32_t n = lc_how_many(m); n > 0; n--)
        loosen_frame(m, &k);
    send_frame(m, &k);
}
