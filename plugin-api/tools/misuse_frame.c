/* SPDX-License-Identifier: MIT */
#include "misuse.h"

#include <limits.h>
#include <math.h>
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
    lc_judge(m, status, err);
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

struct evaluate_call {
    struct lull_view view;
    struct lull_plane planes[LULL_PLANE_COUNT];
    struct lull_block blocks[LC_FILM_BLOCKS];
    uint32_t count, size, block_stride, decision_stride;
    int no_view, no_planes, no_blocks, no_decisions;
};

static void spoil_plane(struct lc_misuse *m, struct evaluate_call *k)
{
    static const double scales[] = {0, (double)NAN, (double)INFINITY, -(double)INFINITY};
    unsigned plane = lc_draw(m, LULL_PLANE_COUNT);
    while (!(m->check->req.planes_required & LULL_PLANE_BIT(plane)))
        plane = (plane + 1) % LULL_PLANE_COUNT;
    struct lull_plane *p = &k->planes[plane];
    switch (lc_draw(m, 7)) {
    case 0: lc_wrong(m, PLANE, "a plane at NULL"), p->data = NULL; break;
    case 1: lc_wrong(m, PLANE, "too few planes"), k->view.plane_count = lc_draw(m, plane + 1); break;
    case 2:
        lc_wrong(m, PLANE, "a plane of an unknown type");
        p->type = lc_draw(m, 2) ? 4 + (int32_t)lc_draw(m, INT_MAX - 4) : -1;
        break;
    case 3:
        lc_wrong(m, PLANE, "a plane of an unknown normaliser");
        p->normaliser = lc_draw(m, 2) ? 4 + (int32_t)lc_draw(m, 99) : INT_MIN;
        break;
    case 4: lc_wrong(m, PLANE, "a plane of too few channels"), p->channels = lc_draw(m, lc_plane_channels[plane]); break;
    case 5:
        lc_wrong(m, PLANE, "a plane of a scale that is none");
        p->scale = scales[lc_draw(m, sizeof scales / sizeof *scales)];
        break;
    default:
        lc_wrong(m, PLANE, "a plane that wants WEIGHT, which is not there");
        k->planes[LULL_PLANE_WEIGHT].data = NULL;
        p->normaliser = LULL_NORM_WEIGHT;
    }
}

static void spoil_block(struct lc_misuse *m, struct evaluate_call *k)
{
    struct lull_block *b = &k->blocks[lc_draw(m, k->count)];
    struct lull_view *v = &k->view;
    const uint32_t which = lc_draw(m, 6), far = lc_draw(m, 2), some = lc_draw(m, 1000);
    switch (which) {
    case 0:
        lc_wrong(m, INVALID, "a block that the frame has not");
        b->id = m->s.film.block_count + (far ? 1000000 * some : 0);
        break;
    case 1: lc_wrong(m, INVALID, "block 4294967295"), b->id = UINT32_MAX; break;
    case 2: lc_wrong(m, INVALID, "an empty block"), b->y1 = b->y0; break;
    case 3: lc_wrong(m, INVALID, "a block from right to left"), b->x0 = b->x1 + (int32_t)some; break;
    case 4: lc_wrong(m, INVALID, "a block beyond the view"), b->y1 = far ? INT32_MAX : v->y1 + 1; break;
    default: lc_wrong(m, INVALID, "a view that does not hold a block"), *(some % 2 ? &v->x1 : &v->y1) = far ? INT32_MIN : 0;
    }
}

static void spoil_evaluate(struct lc_misuse *m, struct evaluate_call *k)
{
    const uint32_t needed = m->check->req.planes_required;
    switch (lc_draw(m, needed ? 14 : 9)) {
    case 0: lc_wrong(m, INVALID, "no instance"), m->instance = NULL; break;
    case 1: lc_wrong(m, INVALID, "no view"), k->no_view = 1; break;
    case 2: lc_wrong(m, INVALID, "blocks at NULL"), k->no_blocks = 1; break;
    case 3: lc_wrong(m, INVALID, "decisions at NULL"), k->no_decisions = 1; break;
    case 4: lc_wrong(m, VERSION, "a short view"), k->size = lc_too_small(m, sizeof k->view); break;
    case 5: lc_wrong(m, SIZE, "a short stride of the blocks"), k->block_stride = lc_too_small(m, sizeof *k->blocks); break;
    case 6:
        lc_wrong(m, SIZE, "a short stride of the decisions");
        k->decision_stride = lc_too_small(m, sizeof(struct lull_decision));
        break;
    case 9: lc_wrong(m, INVALID | PLANE, "planes at NULL"), k->no_planes = 1; break;
    case 10:
        lc_wrong(m, SIZE | PLANE, "a short stride of the planes");
        k->view.plane_stride = lc_too_small(m, sizeof *k->planes);
        break;
    case 11:
    case 12:
    case 13: spoil_plane(m, k); break;
    default: spoil_block(m, k);
    }
}

/* What the header does not say is refused: the rectangle of a block that a criterion need not keep, counts of samples, what
 * is only for information. */
static void loosen_evaluate(struct lc_misuse *m, struct evaluate_call *k)
{
    struct lull_block *b = &k->blocks[lc_draw(m, k->count)];
    struct lull_view *v = &k->view;
    switch (lc_draw(m, 8)) {
    case 0:
        lc_wrong(m, MAY, "a block of another rectangle");
        b->x0 = v->x0, b->y0 = v->y0, b->x1 = v->x1 - (int32_t)lc_draw(m, 2), b->y1 = v->y1;
        break;
    case 1: lc_wrong(m, MAY, "fewer samples than before"), b->spp /= 2, b->half_spp = b->spp / 2; break;
    case 2:
        lc_wrong(m, MAY, "more samples than can be");
        b->spp = UINT64_MAX >> lc_draw(m, 16);
        b->half_spp = b->spp / 2;
        break;
    case 3: lc_wrong(m, MAY, "more samples in HALF than in all"), b->half_spp = b->spp + 1 + lc_draw(m, 1000); break;
    case 4: lc_wrong(m, MAY, "a block twice"), *b = k->blocks[0]; break;
    case 5: lc_wrong(m, MAY, "unknown flags"), b->flags = 1u << (2 + lc_draw(m, 30)), v->flags = 1u << lc_draw(m, 32); break;
    case 6: lc_wrong(m, MAY, "times of nonsense"), b->thread_s = lc_nonsense(m), v->elapsed_s = lc_nonsense(m); break;
    default:
        lc_wrong(m, MAY, "states of all blocks that are none");
        v->all_stride = 0;
        v->all_count = lc_draw(m, 2) ? 1 : v->all_count;
        if (lc_draw(m, 2))
            v->all = NULL;
    }
}

static void send_evaluate(struct lc_misuse *m, const struct evaluate_call *k)
{
    struct lull_view v = k->view;
    struct lull_decision presets[LC_FILM_BLOCKS];
    for (uint32_t i = 0; i < k->count; i++)
        lc_decision_preset(&presets[i]);
    const void *planes = lc_place_array(m->check, k->planes, sizeof *k->planes, v.plane_count, v.plane_stride);
    const void *blocks = lc_place_array(m->check, k->blocks, sizeof *k->blocks, k->count, k->block_stride);
    char *out = lc_place_array(m->check, presets, sizeof *presets, k->count, k->decision_stride);
    v.planes = k->no_planes ? NULL : planes;
    const struct lull_view *view = lc_place_struct(m->check, &v, k->size);
    struct lull_error *err = lc_announce(m, "evaluate");
    int32_t status =
        m->check->criterion->evaluate(m->instance, k->no_view ? NULL : view, k->no_blocks ? NULL : blocks, k->block_stride,
                                      k->no_decisions ? NULL : (void *)out, k->decision_stride, k->count, err);
    lc_judge(m, status, err);
    for (uint32_t i = 0; i < k->count && status == LULL_OK && k->decision_stride >= sizeof *presets; i++)
        lc_decision_check(m->check, &k->blocks[i], (const void *)(out + (size_t)i * k->decision_stride));
}

void lc_misuse_evaluate(struct lc_misuse *m, int loose)
{
    /* the session's last question once more, about some of its blocks */
    const uint32_t first = lc_draw(m, LC_FILM_BLOCKS);
    struct evaluate_call k = {.view = m->image.view,
                              .count = 1 + lc_draw(m, LC_FILM_BLOCKS - first),
                              .size = sizeof k.view,
                              .block_stride = sizeof *k.blocks,
                              .decision_stride = sizeof(struct lull_decision)};
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        k.planes[p] = *lc_image_plane(&m->image, p);
    memcpy(k.blocks, &m->s.film.blocks[first], k.count * sizeof *k.blocks);
    uint32_t n = lc_how_many(m);
    if (!loose && !m->open)
        lc_wrong(m, CODE(LULL_E_STATE), "no frame is open"), n -= lc_draw(m, 2);
    for (; n > 0; n--)
        (loose ? loosen_evaluate : spoil_evaluate)(m, &k);
    send_evaluate(m, &k);
}
