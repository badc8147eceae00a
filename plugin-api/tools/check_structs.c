/* SPDX-License-Identifier: MIT
 *
 * Hosts of other versions: structs that end where version 1.0 ends (nothing may be read or written beyond), structs that
 * are too short, structs and array elements that are longer.
 */
#include "check.h"

#include <string.h>

/* What a call is given that says its size: one struct for each call, and the error for all. */
enum { HOST, REQUIREMENTS, FRAME, VIEW, CALLS, ERROR = CALLS, STRUCTS };

/* An instance that is given structs which end where nothing can be read beyond. */
struct life {
    struct lc *check;
    size_t cut[STRUCTS]; /* bytes fewer than in version 1.0 */
    struct lull_instance *instance;
    struct lull_error *err;
    int32_t status[CALLS]; /* 1: not called, as evaluate is after a create or begin_frame that failed */
    struct lull_requirements got;
};

static void evaluate(struct life *l, const struct lc_film *film, uint32_t planes)
{
    const struct lc_layout layout = {0};
    struct lull_decision presets[LC_FILM_BLOCKS];
    struct lc_image image;
    lc_image_build(&image, l->check, film, &layout, planes);
    for (int i = 0; i < LC_FILM_BLOCKS; i++)
        lc_decision_preset(&presets[i]);
    struct lull_view v = image.view;
    v.planes = lc_place(l->check, v.planes, sizeof *v.planes * LULL_PLANE_COUNT);
    v.all = lc_place(l->check, film->blocks, sizeof *v.all * LC_FILM_BLOCKS);
    struct lull_decision *d = lc_place(l->check, presets, sizeof presets);
    const struct lull_view *view = lc_place_struct(l->check, &v, sizeof v - l->cut[VIEW]);
    l->status[VIEW] =
        l->check->criterion->evaluate(l->instance, view, v.all, sizeof *v.all, d, sizeof *d, LC_FILM_BLOCKS, l->err);
    for (int i = 0; i < LC_FILM_BLOCKS && l->status[VIEW] == LULL_OK; i++)
        lc_decision_check(l->check, &film->blocks[i], &d[i]);
    lc_image_release(&image);
}

static void open_frame(struct life *l)
{
    struct lc *c = l->check;
    struct lc_film film;
    struct lull_frame frame;
    lc_film_init(&film, c, NULL);
    for (uint32_t i = 0; i < film.block_count; i++)
        lc_film_advance(&film, i, c->req.first_spp + c->req.first_spp % 2 + 2);
    lc_film_frame(&film, &frame, c->planes);
    frame.blocks = lc_place(c, film.rects, sizeof *film.rects * film.block_count);
    const struct lull_frame *at = lc_place_struct(c, &frame, sizeof frame - l->cut[FRAME]);
    l->status[FRAME] = c->criterion->begin_frame(l->instance, at, l->err);
    if (l->status[FRAME] == LULL_OK) {
        evaluate(l, &film, frame.planes);
        c->criterion->end_frame(l->instance);
    }
    lc_film_release(&film);
}

static void live(struct life *l)
{
    struct lc *c = l->check;
    const struct lull_error blank = {0};
    struct lull_requirements req = {0};
    struct lc_host host;
    lc_host_init(&host, c, 1);
    for (int i = 0; i < CALLS; i++)
        l->status[i] = 1;
    const struct lull_host *h = lc_place_struct(c, &host.host, sizeof host.host - l->cut[HOST]);
    l->err = lc_place_struct(c, &blank, sizeof blank - l->cut[ERROR]);
    l->status[HOST] = c->criterion->create(h, c->pairs, c->pair_count, sizeof *c->pairs, &l->instance, l->err);
    if (l->status[HOST] != LULL_OK)
        return;
    struct lull_requirements *r = lc_place_struct(c, &req, sizeof req - l->cut[REQUIREMENTS]);
    l->status[REQUIREMENTS] = c->criterion->requirements(l->instance, r, l->err);
    memcpy(&l->got, r, sizeof req - l->cut[REQUIREMENTS]);
    open_frame(l);
    c->criterion->destroy(l->instance);
}

void lc_check_older(struct lc *c)
{
    struct life exact = {.check = c}, no_message = {.check = c, .cut = {[ERROR] = sizeof(struct lull_error) - 8}};
    const int32_t *status = exact.status;
    live(&exact);
    LC_EXPECT(c, status[REQUIREMENTS] == LULL_OK && status[VIEW] == LULL_OK,
              "structs of exactly version 1.0: create %d, requirements %d, begin_frame %d, evaluate %d", status[HOST],
              status[REQUIREMENTS], status[FRAME], status[VIEW]);
    LC_EXPECT(c,
              exact.got.planes_used == c->req.planes_used && exact.got.first_spp == c->req.first_spp &&
                  exact.got.bytes_per_block == c->req.bytes_per_block,
              "requirements differ for a struct of exactly version 1.0");

    /* the error struct is for the caller's convenience: a short one is not written, or not beyond its end */
    struct life short_host = no_message;
    short_host.cut[HOST] = 8;
    live(&no_message);
    LC_EXPECT(c, no_message.status[VIEW] == LULL_OK, "an error struct of 8 bytes makes a call fail (%d)",
              no_message.status[VIEW]);
    live(&short_host);
    LC_EXPECT(c, short_host.status[HOST] != LULL_OK, "create succeeds with a host struct shorter than 1.0");
}

void lc_check_too_short(struct lc *c)
{
    static const struct {
        const char *what, *call;
        size_t size;
    } structs[CALLS] = {[HOST] = {"host struct", "create", sizeof(struct lull_host)},
                        [REQUIREMENTS] = {"struct", "requirements", sizeof(struct lull_requirements)},
                        [FRAME] = {"frame struct", "begin_frame", sizeof(struct lull_frame)},
                        [VIEW] = {"view struct", "evaluate", sizeof(struct lull_view)}};
    for (int only_8 = 0; only_8 < 2; only_8++)
        for (int i = 0; i < CALLS; i++) {
            struct life l = {.check = c};
            l.cut[i] = only_8 ? structs[i].size - 8 : 8;
            live(&l);
            LC_EXPECT(c, l.status[i] == LULL_E_VERSION, "%s %s: %s %d", structs[i].what,
                      only_8 ? "of 8 bytes" : "shorter than 1.0", structs[i].call, l.status[i]);
        }
}

/* requirements and the error in memory whose rest must stay as it is. */
static void check_tails(struct lc *c)
{
    enum { TAIL = 64 };
    struct {
        struct lull_requirements req;
        unsigned char tail[TAIL];
    } r;
    struct {
        struct lull_error err;
        unsigned char tail[TAIL];
    } e;
    memset(&r, 0xa5, sizeof r);
    memset(&e, 0xa5, sizeof e);
    r.req.struct_size = sizeof r;
    e.err = (struct lull_error){.struct_size = sizeof e};
    struct lull_instance *instance = lc_create(c, NULL);
    if (!instance)
        return;
    int32_t status = c->criterion->requirements(instance, &r.req, &e.err);
    LC_EXPECT(c, status == LULL_OK && r.req.struct_size == sizeof r, "requirements into a longer struct: %d, size %u",
              status, r.req.struct_size);
    c->criterion->destroy(instance);
    struct lull_pair unknown = {"no-such-parameter", "1"};
    struct lull_instance *none = NULL;
    c->criterion->create(NULL, &unknown, 1, sizeof unknown, &none, &e.err);
    for (int i = 0; i < TAIL; i++)
        if (!LC_EXPECT(c, r.tail[i] == 0xa5 && e.tail[i] == 0xa5, "wrote past the end of a struct it knows"))
            return;
}

void lc_check_newer(struct lc *c)
{
    struct lc_manner wide = {.slack = 40, .layout = {.extra_planes = 3, .plane_slack = 24}};
    lc_run_both(c, NULL, &wide, "wider structs and strides");

    /* pairs with a stride */
    struct {
        struct lull_pair pair;
        uint64_t rest;
    } pairs[2] = {{{"no-such-parameter", "1"}, ~UINT64_C(0)}, {{"nor-this", "1"}, ~UINT64_C(0)}};
    struct lull_instance *none = NULL;
    LC_EXPECT(c, c->criterion->create(NULL, &pairs[0].pair, 2, sizeof pairs[0], &none, NULL) == LULL_E_KEY,
              "pairs with a wider stride are misread");
    check_tails(c);
}
