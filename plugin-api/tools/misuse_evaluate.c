/* SPDX-License-Identifier: MIT */
#include "misuse.h"

#include <limits.h>
#include <math.h>
#include <string.h>

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
    lc_judge(m, "evaluate", status, err);
    for (uint32_t i = 0; i < k->count && status == LULL_OK && k->decision_stride >= sizeof *presets; i++)
        lc_decision_check(m->check, &k->blocks[i], (const void *)(out + (size_t)i * k->decision_stride));
}

/* The session's last question once more, about some of its blocks. */
static void evaluate_of_session(struct lc_misuse *m, struct evaluate_call *k)
{
    const uint32_t first = lc_draw(m, LC_FILM_BLOCKS);
    *k = (struct evaluate_call){.view = m->image.view,
                                .count = 1 + lc_draw(m, LC_FILM_BLOCKS - first),
                                .size = sizeof k->view,
                                .block_stride = sizeof *k->blocks,
                                .decision_stride = sizeof(struct lull_decision)};
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        k->planes[p] = *lc_image_plane(&m->image, p);
    memcpy(k->blocks, &m->s.film.blocks[first], k->count * sizeof *k->blocks);
}

void lc_misuse_evaluate(struct lc_misuse *m)
{
    struct evaluate_call k;
    evaluate_of_session(m, &k);
    lc_make_up(m, m->s.instance);
    uint32_t n = lc_how_many(m);
    if (!m->open)
        lc_wrong(m, CODE(LULL_E_STATE), "no frame is open"), n -= lc_draw(m, 2);
    for (; n > 0; n--)
        spoil_evaluate(m, &k);
    send_evaluate(m, &k);
}

void lc_loose_evaluate(struct lc_misuse *m)
{
    struct evaluate_call k;
    evaluate_of_session(m, &k);
    for (uint32_t n = lc_how_many(m); n > 0; n--)
        loosen_evaluate(m, &k);
    send_evaluate(m, &k);
}
