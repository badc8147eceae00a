/* SPDX-License-Identifier: MIT
 *
 * Hosts of other versions: structs that end where version 1.0 ends (nothing may be read or written beyond), structs that
 * are too short, structs and array elements that are longer.
 */
#include "check.h"

#include <string.h>

/* Every struct that the host passes, each of so many bytes fewer than in version 1.0. */
struct short_structs {
    size_t host, requirements, frame, view, error;
};

struct short_calls {
    int32_t create, requirements, begin_frame, evaluate;
    struct lull_requirements got;
};

/* An instance, and what it is given. */
struct life {
    struct lc *check;
    const struct short_structs *cut;
    struct lull_instance *instance;
    struct lull_error *err;
    struct short_calls calls;
};

static void short_evaluate(struct life *l, const struct lc_film *film, uint32_t planes)
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
    const struct lull_view *view = lc_place_struct(l->check, &v, sizeof v - l->cut->view);
    l->calls.evaluate =
        l->check->criterion->evaluate(l->instance, view, v.all, sizeof *v.all, d, sizeof *d, LC_FILM_BLOCKS, l->err);
    for (int i = 0; i < LC_FILM_BLOCKS && l->calls.evaluate == LULL_OK; i++)
        lc_decision_check(l->check, &film->blocks[i], &d[i]);
    lc_image_release(&image);
}

static void short_frame(struct life *l)
{
    struct lc *c = l->check;
    struct lc_film film;
    struct lull_frame frame;
    lc_film_init_for(&film, c, 1, 0);
    for (uint32_t i = 0; i < film.block_count; i++)
        lc_film_advance(&film, i, c->req.first_spp + c->req.first_spp % 2 + 2);
    lc_film_frame(&film, &frame, c->planes);
    frame.blocks = lc_place(c, film.rects, sizeof *film.rects * film.block_count);
    const struct lull_frame *at = lc_place_struct(c, &frame, sizeof frame - l->cut->frame);
    l->calls.begin_frame = c->criterion->begin_frame(l->instance, at, l->err);
    if (l->calls.begin_frame == LULL_OK) {
        short_evaluate(l, &film, frame.planes);
        c->criterion->end_frame(l->instance);
    }
    lc_film_release(&film);
}

static struct short_calls short_life(struct lc *c, const struct short_structs *cut)
{
    struct life l = {.check = c, .cut = cut, .calls = {1, 1, 1, 1, {0}}};
    const struct lull_error blank = {0};
    struct lull_requirements req = {0};
    struct lc_host host;
    lc_host_init(&host, c, 1);
    const struct lull_host *h = lc_place_struct(c, &host.host, sizeof host.host - cut->host);
    l.err = lc_place_struct(c, &blank, sizeof blank - cut->error);
    l.calls.create = c->criterion->create(h, c->pairs, c->pair_count, sizeof *c->pairs, &l.instance, l.err);
    if (l.calls.create == LULL_OK) {
        struct lull_requirements *r = lc_place_struct(c, &req, sizeof req - cut->requirements);
        l.calls.requirements = c->criterion->requirements(l.instance, r, l.err);
        memcpy(&l.calls.got, r, sizeof req - cut->requirements);
        short_frame(&l);
        c->criterion->destroy(l.instance);
    }
    return l.calls;
}

void lc_check_older(struct lc *c)
{
    struct short_structs exact = {0};
    struct short_calls calls = short_life(c, &exact);
    LC_EXPECT(c,
              calls.create == LULL_OK && calls.requirements == LULL_OK && calls.begin_frame == LULL_OK &&
                  calls.evaluate == LULL_OK,
              "structs of exactly version 1.0: create %d, requirements %d, begin_frame %d, evaluate %d", calls.create,
              calls.requirements, calls.begin_frame, calls.evaluate);
    LC_EXPECT(c,
              calls.got.planes_used == c->req.planes_used && calls.got.first_spp == c->req.first_spp &&
                  calls.got.bytes_per_block == c->req.bytes_per_block,
              "requirements differ for a struct of exactly version 1.0");

    /* the error struct is for the caller's convenience: a short one is not written, or not beyond its end */
    struct short_structs no_message = {.error = sizeof(struct lull_error) - 8};
    calls = short_life(c, &no_message);
    LC_EXPECT(c, calls.evaluate == LULL_OK, "an error struct of 8 bytes makes a call fail (%d)", calls.evaluate);
    struct short_structs one_short = {.host = 8, .error = sizeof(struct lull_error) - 8};
    calls = short_life(c, &one_short);
    LC_EXPECT(c, calls.create != LULL_OK, "create succeeds with a host struct shorter than 1.0");
}

void lc_check_too_short(struct lc *c)
{
    struct short_structs cut = {0};
    struct short_calls calls;
    const struct {
        const char *what, *call;
        size_t *cut, size;
        const int32_t *status;
    } structs[] = {{"host struct", "create", &cut.host, sizeof(struct lull_host), &calls.create},
                   {"struct", "requirements", &cut.requirements, sizeof(struct lull_requirements), &calls.requirements},
                   {"frame struct", "begin_frame", &cut.frame, sizeof(struct lull_frame), &calls.begin_frame},
                   {"view struct", "evaluate", &cut.view, sizeof(struct lull_view), &calls.evaluate}};
    for (int only_8 = 0; only_8 < 2; only_8++)
        for (size_t i = 0; i < sizeof structs / sizeof *structs; i++) {
            *structs[i].cut = only_8 ? structs[i].size - 8 : 8;
            calls = short_life(c, &cut);
            LC_EXPECT(c, *structs[i].status == LULL_E_VERSION, "%s %s: %s %d", structs[i].what,
                      only_8 ? "of 8 bytes" : "shorter than 1.0", structs[i].call, *structs[i].status);
            *structs[i].cut = 0;
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
