/* SPDX-License-Identifier: MIT
 *
 * The life cycle: calls out of order, frames of every shape, restart, cancelling.
 */
#include "check.h"

#include <stdlib.h>

/* Is the open session still as good as one that nothing happened to? Closes it. */
static void finish_and_compare(struct lc *c, struct lc_session *s, const char *what)
{
    struct lc_log expected;
    const struct lc_manner same_host = {.host = s->manner.host};
    if (lc_session_steps(s, LC_STEPS - (int)s->step) == 0 && lc_run(c, &same_host, &expected) == 0)
        lc_log_compare(c, &expected, &s->log, lc_deterministic(c), what);
    lc_session_close(s);
}

/* About one block, or none. */
static int32_t evaluate(struct lc_session *s, const struct lull_view *view, const struct lull_block *block)
{
    struct lull_decision d;
    lc_decision_preset(&d);
    return s->check->criterion->evaluate(s->instance, view, block, sizeof *block, block ? &d : NULL, sizeof d, block != NULL,
                                         NULL);
}

static int32_t evaluate_nothing(struct lc_session *s)
{
    struct lc_image image;
    lc_session_image(s, &image);
    int32_t status = evaluate(s, &image.view, NULL);
    lc_image_release(&image);
    return status;
}

void lc_check_order(struct lc *c, struct lc_session *s)
{
    struct lull_frame frame;
    lc_film_frame(&s->film, &frame, s->planes);
    LC_EXPECT(c, c->criterion->begin_frame(s->instance, &frame, NULL) == LULL_E_STATE,
              "begin_frame while a frame is open, without RESTART, is not refused");
    c->criterion->end_frame(s->instance);
    LC_EXPECT(c, evaluate_nothing(s) == LULL_E_STATE, "evaluate after end_frame is not refused");
    c->criterion->end_frame(s->instance);
    LC_EXPECT(c, lc_begin(c, s->instance, &frame, NULL) == LULL_OK, "a second frame cannot be begun");
    finish_and_compare(c, s, "second frame against a first");

    struct lc_session unopened = {.check = c, .instance = lc_create(c, NULL), .planes = c->planes, .open = 1};
    if (!unopened.instance)
        return;
    lc_film_init(&unopened.film, c, NULL);
    LC_EXPECT(c, evaluate_nothing(&unopened) == LULL_E_STATE, "evaluate before begin_frame is not refused");
    lc_session_close(&unopened); /* with the end of a frame that was never begun */

    struct lc_session open;
    if (lc_session_open(&open, c, NULL) == 0) {
        lc_session_steps(&open, 2);
        open.open = 0; /* destroyed with its frame open */
        lc_session_close(&open);
    }
}

void lc_check_zero_blocks(struct lc *c, struct lc_session *s)
{
    for (int i = 0; i < 3; i++) {
        LC_EXPECT(c, evaluate_nothing(s) == LULL_OK, "evaluate of no block fails");
        lc_session_step(s);
    }
    finish_and_compare(c, s, "empty calls in between");
}

static void run_frame(struct lc *c, int32_t width, int32_t height, int32_t block_w, int32_t block_h)
{
    const struct lc_manner sized = {.size = {width, height, block_w, block_h}};
    struct lc_session s;
    if (lc_session_open(&s, c, &sized) == 0)
        lc_session_steps(&s, LC_STEPS);
    else
        lc_note(c, "that was a frame of %dx%d in blocks of %dx%d", width, height, block_w, block_h);
    lc_session_close(&s);
}

void lc_check_shapes(struct lc *c)
{
    int flexible = (c->req.flags & LULL_REQ_FLEXIBLE) != 0;
    int32_t w = flexible ? 200 : (int32_t)c->req.block_width, h = flexible ? 200 : (int32_t)c->req.block_height;
    run_frame(c, 1, 1, w, h); /* a frame smaller than a block is all edge */
    run_frame(c, 3, 1, w, h);
    run_frame(c, 1, h + 1, w, h);
    run_frame(c, w + 1, h, w, h);
    if (flexible) {
        run_frame(c, 5, 4, 1, 1);
        run_frame(c, 300, 2, 299, 1);
        run_frame(c, 64, 64, 13, 64);
    }
}

void lc_check_block_size(struct lc *c)
{
    if (c->req.flags & LULL_REQ_FLEXIBLE) {
        lc_skip(c, "it takes blocks of any size");
        return;
    }
    struct lull_instance *instance = lc_create(c, NULL);
    struct lc_film film;
    const int32_t w = (int32_t)c->req.block_width, h = (int32_t)c->req.block_height;
    const struct lc_manner larger = {.size = {2 * w + 10, 2 * h + 10, w + 5, h + 5}};
    if (instance) {
        lc_film_init(&film, c, &larger);
        struct lull_frame frame;
        lc_film_frame(&film, &frame, c->planes);
        int32_t status = lc_begin(c, instance, &frame, NULL);
        LC_EXPECT(c, status == LULL_E_UNSUPPORTED || status == LULL_OK, "blocks of another size: %d", status);
        lc_film_release(&film);
    }
    c->criterion->destroy(instance);
}

/* Frames and calls that make no sense, in the middle of a good session. */
void lc_check_invalid(struct lc *c, struct lc_session *s)
{
    lc_session_steps(s, 2);
    struct lull_frame good, bad;
    lc_film_frame(&s->film, &good, s->planes);
    good.flags |= LULL_FRAME_RESTART;
    bad = good, bad.blocks = NULL, bad.block_count = 0;
    LC_EXPECT(c, lc_begin(c, s->instance, &bad, NULL) == LULL_E_INVALID, "a frame without blocks is not refused");
    bad = good, bad.blocks = NULL;
    LC_EXPECT(c, lc_begin(c, s->instance, &bad, NULL) == LULL_E_INVALID, "blocks at NULL are not refused");
    struct lull_error err = {.struct_size = sizeof err};
    if (s->film.block_count > 0 && c->req.planes_required != 0) {
        bad = good, bad.planes = 0;
        LC_EXPECT(c, lc_begin(c, s->instance, &bad, &err) == LULL_E_PLANE, "a frame without planes is not refused");
        LC_EXPECT(c, err.code == LULL_E_PLANE && err.message[0] != '\0', "a refused frame leaves no message");
    }
    LC_EXPECT(c, c->criterion->begin_frame(s->instance, NULL, NULL) == LULL_E_INVALID, "a NULL frame is not refused");

    struct lc_image image;
    lc_session_image(s, &image);
    struct lull_block block = s->film.blocks[0];
    block.id = s->film.block_count;
    int32_t status = evaluate(s, &image.view, &block);
    LC_EXPECT(c, status == LULL_E_INVALID, "a block that is not in the frame: %d", status);
    block.id = UINT32_MAX;
    status = evaluate(s, &image.view, &block);
    LC_EXPECT(c, status == LULL_E_INVALID, "block 4294967295: %d", status);
    status = evaluate(s, NULL, s->film.blocks);
    LC_EXPECT(c, status == LULL_E_INVALID, "a NULL view: %d", status);
    lc_image_release(&image);
    finish_and_compare(c, s, "after refused calls");
}

void lc_check_restart(struct lc *c, struct lc_session *s)
{
    lc_session_steps(s, 3);
    if (lc_session_restart(s) == 0)
        finish_and_compare(c, s, "after RESTART");

    /* RESTART on an instance without an open frame is a plain beginning */
    struct lc_session first;
    struct lc_manner flagged = {.frame_flags = LULL_FRAME_RESTART};
    if (lc_session_open(&first, c, &flagged) == 0)
        finish_and_compare(c, &first, "RESTART of nothing");
}

void lc_check_final(struct lc *c, struct lc_session *s)
{
    int reopens = (c->criterion->capabilities & LULL_CAP_REOPENS) != 0;
    struct lull_decision d[LC_FILM_BLOCKS];
    lc_session_steps(s, 2);
    for (uint32_t i = 0; i < s->film.block_count; i++) {
        lc_film_advance(&s->film, i, s->spp << (i % 2));
        s->film.blocks[i].flags = LULL_BLOCK_FINAL | (reopens ? LULL_BLOCK_STOPPED : 0);
    }
    lc_session_judge(s, NULL, d, "of final blocks");
}

/* A host that wants the call back, and leaves out tasks: an error or a full answer, and no harm to what follows. */
void lc_check_cancel(struct lc *c)
{
    struct lc_host host;
    struct lc_session s;
    lc_host_init(&host, c, c->workers);
    struct lc_manner hosted = {.host = &host.host};
    if (lc_session_open(&s, c, &hosted) == 0) {
        uint32_t ids[LC_FILM_BLOCKS];
        struct lull_decision d[LC_FILM_BLOCKS];
        for (int step = 0; step < LC_STEPS && (uint32_t)step == s.step; step++) {
            const uint32_t due = lc_session_advance(&s, ids);
            struct lull_error err = {.struct_size = sizeof err};
            host.cancel = 1;
            int32_t status = lc_session_ask(&s, NULL, ids, due, d, &err);
            LC_EXPECT(c, status == LULL_OK || status == LULL_E_CANCELLED, "a cancelled evaluate: %d, %s", status,
                      err.message);
            host.cancel = 0;
            lc_session_step(&s);
        }
        finish_and_compare(c, &s, "after cancelled calls");
    }
}
