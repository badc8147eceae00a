/* SPDX-License-Identifier: MIT
 *
 * Hosts of other versions: structs that end where version 1.0 ends (nothing may be read or written beyond), structs that
 * are too short, structs and array elements that are longer.
 */
#include "check.h"

#include <stdlib.h>
#include <string.h>

/* A copy of a struct, or of an array, of which only `size` bytes exist. */
struct guarded {
    void *at;
    size_t mapped;
};

static int guarded_copy(struct lc *c, struct guarded *g, const void *from, size_t size)
{
    g->at = lc_guard_alloc(size, &g->mapped);
    if (!LC_EXPECT(c, g->at, "out of memory"))
        return -1;
    memcpy(g->at, from, size);
    return 0;
}

/* The same of one that begins with its size. */
static int guarded_init(struct lc *c, struct guarded *g, const void *from, size_t size)
{
    const uint32_t struct_size = (uint32_t)size;
    if (guarded_copy(c, g, from, size) != 0)
        return -1;
    memcpy(g->at, &struct_size, sizeof struct_size);
    return 0;
}

static void guarded_release(struct guarded *g) { lc_guard_free(g->at, g->mapped); }

/* Every struct that the host passes, each of so many bytes fewer than in version 1.0. */
struct short_structs {
    size_t host, requirements, frame, view, error;
};

struct short_calls {
    int32_t create, requirements, begin_frame, evaluate;
    struct lull_requirements got;
};

static void short_evaluate(struct lc *c, const struct short_structs *cut, struct lull_instance *instance,
                           const struct lc_film *film, uint32_t planes, struct lull_error *err, struct short_calls *calls)
{
    struct lc_image image;
    const struct lc_layout layout = {0};
    struct guarded view = {0}, descriptors = {0}, blocks = {0}, decisions = {0};
    struct lull_decision d[LC_FILM_BLOCKS];
    if (lc_image_build(&image, film, &layout, planes) != 0)
        return;
    for (int i = 0; i < LC_FILM_BLOCKS; i++)
        lc_decision_preset(&d[i]);
    struct lull_view *v = &image.view;
    if (guarded_copy(c, &descriptors, v->planes, sizeof(struct lull_plane) * LULL_PLANE_COUNT) == 0 &&
        guarded_copy(c, &blocks, film->blocks, sizeof(struct lull_block) * LC_FILM_BLOCKS) == 0 &&
        guarded_copy(c, &decisions, d, sizeof d) == 0) {
        v->planes = descriptors.at;
        v->all = blocks.at;
        if (guarded_init(c, &view, v, sizeof *v - cut->view) == 0)
            calls->evaluate = c->criterion->evaluate(instance, view.at, blocks.at, sizeof(struct lull_block), decisions.at,
                                                     sizeof *d, LC_FILM_BLOCKS, err);
        for (uint32_t i = 0; i < LC_FILM_BLOCKS && calls->evaluate == LULL_OK; i++)
            lc_decision_check(c, &film->blocks[i], (const struct lull_decision *)decisions.at + i);
    }
    guarded_release(&view);
    guarded_release(&descriptors);
    guarded_release(&blocks);
    guarded_release(&decisions);
    lc_image_release(&image);
}

static void short_frame(struct lc *c, const struct short_structs *cut, struct lull_instance *instance,
                        struct lull_error *err, struct short_calls *calls)
{
    struct lc_film film;
    if (lc_film_init_for(&film, &c->req, 1, 0) != 0)
        return;
    for (uint32_t i = 0; i < film.block_count; i++)
        lc_film_advance(&film, i, c->req.first_spp + c->req.first_spp % 2 + 2);
    struct lull_frame frame;
    lc_film_frame(&film, &frame, c->planes);
    struct guarded rects, g;
    if (guarded_copy(c, &rects, film.rects, film.block_count * sizeof *film.rects) == 0) {
        frame.blocks = rects.at;
        if (guarded_init(c, &g, &frame, sizeof frame - cut->frame) == 0) {
            calls->begin_frame = c->criterion->begin_frame(instance, g.at, err);
            guarded_release(&g);
        }
        if (calls->begin_frame == LULL_OK) {
            short_evaluate(c, cut, instance, &film, frame.planes, err, calls);
            c->criterion->end_frame(instance);
        }
        guarded_release(&rects);
    }
    lc_film_release(&film);
}

static void short_life(struct lc *c, const struct short_structs *cut, struct short_calls *calls)
{
    *calls = (struct short_calls){1, 1, 1, 1, {0}};
    struct lc_host host;
    struct guarded h, r, e;
    struct lull_error blank = {0};
    struct lull_requirements req = {0};
    if (lc_host_init(&host, c, 1) != 0)
        return;
    if (guarded_init(c, &h, &host.host, sizeof host.host - cut->host) != 0 ||
        guarded_init(c, &r, &req, sizeof req - cut->requirements) != 0 ||
        guarded_init(c, &e, &blank, sizeof blank - cut->error) != 0)
        return;
    struct lull_instance *instance = NULL;
    calls->create = c->criterion->create(h.at, c->pairs, c->pair_count, sizeof *c->pairs, &instance, e.at);
    if (calls->create == LULL_OK) {
        calls->requirements = c->criterion->requirements(instance, r.at, e.at);
        memcpy(&calls->got, r.at, sizeof req - cut->requirements);
        short_frame(c, cut, instance, e.at, calls);
        c->criterion->destroy(instance);
    }
    guarded_release(&h);
    guarded_release(&r);
    guarded_release(&e);
    lc_host_release(&host);
}

static void check_older(struct lc *c)
{
    struct short_structs exact = {0};
    struct short_calls calls;
    short_life(c, &exact, &calls);
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
    short_life(c, &no_message, &calls);
    LC_EXPECT(c, calls.evaluate == LULL_OK, "an error struct of 8 bytes makes a call fail (%d)", calls.evaluate);
    struct short_structs one_short = {.host = 8, .error = sizeof(struct lull_error) - 8};
    short_life(c, &one_short, &calls);
    LC_EXPECT(c, calls.create != LULL_OK, "create succeeds with a host struct shorter than 1.0");
}

static void check_too_short(struct lc *c)
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
            short_life(c, &cut, &calls);
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

static void check_newer(struct lc *c)
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

const struct lc_check lc_struct_checks[] = {
    {"older-host", "reads and writes nothing past structs of version 1.0", check_older},
    {"short-structs", "structs shorter than 1.0 are refused", check_too_short},
    {"newer-host", "longer structs and wider strides change nothing", check_newer},
    {0},
};
