/* SPDX-License-Identifier: MIT
 *
 * The same picture stored in every way; pictures that are extreme; planes that are missing or broken.
 */
#include "check.h"

#include <math.h>
#include <stdio.h>

struct stored {
    struct lc_layout layout;
    const char *name;
};

static void compare_layouts(struct lc *c, const struct stored *list, size_t count, int exact)
{
    struct lc_log expected;
    if (lc_run(c, NULL, &expected) == 0)
        for (size_t i = 0; i < count; i++) {
            const struct lc_manner manner = {.layout = list[i].layout};
            if (lc_run_as(c, &manner, &expected, exact, list[i].name) < 0)
                lc_note(c, "that was with %s", list[i].name);
        }
}

#define COUNT(array) (sizeof(array) / sizeof *(array))

void lc_check_strides(struct lc *c)
{
    static const struct stored list[] = {
        {{.bottom_up = 1}, "rows bottom-up"},
        {{.right_left = 1}, "columns from the right"},
        {{.padded = 1}, "RGBA"},
        {{.planar = 1}, "planar channels"},
        {{.padded = 1, .bottom_up = 1}, "RGBA bottom-up"},
        {{.planar = 1, .bottom_up = 1, .right_left = 1}, "planar, bottom-up, from the right"},
        {{.guard = 1}, "nothing readable beyond the image"},
        {{.guard = 1, .bottom_up = 1}, "nothing readable beyond the image, bottom-up"},
    };
    compare_layouts(c, list, COUNT(list), 1);
}

void lc_check_types(struct lc *c)
{
    static const struct stored list[] = {
        {{.type = LULL_TYPE_F16}, "f16"},
        {{.type = LULL_TYPE_F64}, "f64"},
        {{.type = LULL_TYPE_U32, .scale = 1.0 / 256}, "u32 with scale 1/256"},
        {{.scale = 0.25}, "f32 with scale 1/4"},
    };
    compare_layouts(c, list, COUNT(list), 0);
}

void lc_check_normalisers(struct lc *c)
{
    static const struct stored list[] = {
        {{.normaliser = LULL_NORM_SPP}, "f32 sums"},
        {{.normaliser = LULL_NORM_SPP, .type = LULL_TYPE_F64}, "f64 sums"},
        {{.normaliser = LULL_NORM_SPP, .type = LULL_TYPE_U32, .scale = 1.0 / 256}, "u32 sums"},
        {{.normaliser = LULL_NORM_WEIGHT}, "f32 weighted sums"},
        {{.normaliser = LULL_NORM_WEIGHT, .type = LULL_TYPE_F64}, "f64 weighted sums"},
    };
    compare_layouts(c, list, COUNT(list), 0);
}

/* The same blocks as the window of a larger picture: a view that does not begin at the origin. */
void lc_check_window(struct lc *c, struct lc_session *s)
{
    enum { DX = 1000, DY = 700 };
    c->criterion->end_frame(s->instance);
    struct lull_frame frame;
    lc_film_frame(&s->film, &frame, s->planes);
    frame.width += DX + 5;
    frame.height += DY + 7;
    struct lull_error err = {.struct_size = sizeof err};
    for (uint32_t i = 0; i < s->film.block_count; i++) {
        struct lull_rect *r = &s->film.rects[i];
        *r = (struct lull_rect){r->x0 + DX, r->y0 + DY, r->x1 + DX, r->y1 + DY};
        lc_film_advance(&s->film, i, s->spp);
    }
    int32_t status = lc_begin(c, s->instance, &frame, &err);
    if (LC_EXPECT(c, status == LULL_OK, "begin_frame of a crop: %d, %s", status, err.message)) {
        struct lc_image image;
        lc_session_image(s, &image);
        image.view.x0 += DX, image.view.x1 += DX, image.view.y0 += DY, image.view.y1 += DY;
        struct lull_decision d[LC_FILM_BLOCKS];
        for (uint32_t i = 0; i < s->film.block_count; i++) {
            struct lull_block *b = &s->film.blocks[i];
            b->x0 += DX, b->x1 += DX, b->y0 += DY, b->y1 += DY;
        }
        lc_session_judge(s, &image, d, "of a crop");
    }
}

enum spoil { SPOIL_ABSENT, SPOIL_CUT, SPOIL_TYPE, SPOIL_NORMALISER, SPOIL_CHANNELS, SPOIL_WEIGHT, SPOIL_COUNT };

/* The status of an evaluate call on a spoilt image; 1: no session could be opened. */
static int32_t ask_spoilt(struct lc *c, unsigned plane, enum spoil spoil)
{
    struct lc_session s;
    if (lc_session_open(&s, c, NULL) != 0)
        return 1;
    lc_film_advance(&s.film, 0, s.spp);
    struct lc_image image;
    struct lull_decision decision[LC_FILM_BLOCKS];
    uint32_t id = 0;
    struct lull_error err = {.struct_size = sizeof err};
    lc_session_image(&s, &image);
    struct lull_plane *p = lc_image_plane(&image, plane);
    switch (spoil) {
    case SPOIL_ABSENT: p->data = NULL; break;
    case SPOIL_CUT: image.view.plane_count = plane; break;
    case SPOIL_TYPE: p->type = 99; break;
    case SPOIL_NORMALISER: p->normaliser = -1; break;
    case SPOIL_CHANNELS: p->channels = lc_plane_channels[plane] - 1; break;
    default: p->normaliser = LULL_NORM_WEIGHT; lc_image_plane(&image, LULL_PLANE_WEIGHT)->data = NULL;
    }
    int32_t status = lc_session_ask(&s, &image, &id, 1, decision, &err);
    if (status != LULL_OK && lc_session_steps(&s, 2) != 0)
        lc_note(c, "that was after a refused evaluate");
    lc_session_close(&s);
    return status;
}

void lc_check_missing(struct lc *c)
{
    struct lull_instance *instance = lc_create(c, NULL);
    struct lc_film film;
    if (!instance)
        return;
    lc_film_init(&film, c, NULL);
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++) {
        if (!(c->req.planes_required & LULL_PLANE_BIT(p)))
            continue;
        struct lull_frame frame;
        lc_film_frame(&film, &frame, c->planes & ~LULL_PLANE_BIT(p));
        struct lull_error err = {.struct_size = sizeof err};
        int32_t status = lc_begin(c, instance, &frame, &err);
        LC_EXPECT(c, status == LULL_E_PLANE, "begin_frame without %s: %d", lc_plane_names[p], status);
        if (status == LULL_OK)
            c->criterion->end_frame(instance);
        LC_EXPECT(c, ask_spoilt(c, p, SPOIL_ABSENT) == LULL_E_PLANE, "evaluate without %s is not refused",
                  lc_plane_names[p]);
        LC_EXPECT(c, ask_spoilt(c, p, SPOIL_CUT) == LULL_E_PLANE, "evaluate with planes up to %s is not refused",
                  lc_plane_names[p]);
    }
    c->criterion->destroy(instance);
    lc_film_release(&film);
    struct lc_log log;
    lc_run(c, &(struct lc_manner){.required_only = 1}, &log);
    if (c->req.halo > 0)
        lc_run(c, &(struct lc_manner){.no_all = 1}, &log);
}

void lc_check_broken_planes(struct lc *c)
{
    static const char *const what[SPOIL_COUNT] = {
        "", "", "of an unknown type", "of an unknown normaliser", "with too few channels", "normalised by an absent WEIGHT"};
    if (c->req.planes_required == 0)
        lc_skip(c, "it reads no plane");
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++) {
        if (!(c->req.planes_required & LULL_PLANE_BIT(p)))
            continue;
        for (unsigned spoil = SPOIL_TYPE; spoil < SPOIL_COUNT; spoil++)
            if (p != LULL_PLANE_WEIGHT || spoil != SPOIL_WEIGHT)
                LC_EXPECT(c, ask_spoilt(c, p, (enum spoil)spoil) == LULL_E_PLANE, "%s %s is not refused", lc_plane_names[p],
                          what[spoil]);
    }
}

/* Steps with a value poked into every `every`-th pixel (all planes); returns the flags that all answers share. */
static uint32_t steps_with_value(struct lc *c, float value, int every)
{
    struct lc_session s;
    uint32_t flags = ~UINT32_C(0);
    if (lc_session_open(&s, c, NULL) != 0)
        return flags;
    struct lull_decision d[LC_FILM_BLOCKS];
    char what[64];
    snprintf(what, sizeof what, "with pixels of %g", (double)value);
    for (int step = 0; step < 4; step++, s.spp *= 4) {
        struct lc_image image;
        for (uint32_t i = 0; i < s.film.block_count; i++)
            lc_film_advance(&s.film, i, s.spp);
        lc_session_image(&s, &image);
        for (int32_t i = 0; i < s.film.width * s.film.height; i += every)
            lc_image_poke(&image, i % s.film.width, i / s.film.width, value);
        if (!lc_session_judge(&s, &image, d, what))
            break;
        for (uint32_t i = 0; i < s.film.block_count; i++)
            flags &= d[i].flags | (d[i].flags & LULL_DECISION_TOO_EARLY ? LULL_DECISION_BAD_INPUT : 0);
    }
    lc_session_close(&s);
    return flags;
}

void lc_check_values(struct lc *c)
{
    static const float values[] = {NAN, INFINITY, -INFINITY, -1, 1e30f, -1e30f, 3e38f, 1e-42f, 0};
    for (size_t i = 0; i < COUNT(values); i++)
        for (int every = 1; every <= 97; every += 96) {
            uint32_t flags = steps_with_value(c, values[i], every);
            if (!isfinite(values[i]) && every == 1 && (c->req.planes_required & LULL_PLANE_BIT(LULL_PLANE_COLOR)))
                LC_EXPECT(c, flags & LULL_DECISION_BAD_INPUT, "pixels of %g are not flagged as bad input",
                          (double)values[i]);
        }
}

void lc_check_flat(struct lc *c)
{
    static const struct lc_paint paints[] = {{0, 0, 0}, {0.5, 0.5, 0}, {0, 1, 1}}; /* black, constant, half black */
    for (size_t i = 0; i < COUNT(paints); i++) {
        struct lc_log log;
        lc_run(c, &(struct lc_manner){.paint = &paints[i]}, &log);
    }
}

#define GREY 0.25f
enum { BLOCK_SIDE = 200 }; /* what renderers' blocks are like, if the criterion takes any */

/* A light that one sample of the pixel has found, n times as bright as it is shown: in the half buffer's samples or not. */
static void light_pixel(struct lc_image *image, const struct lull_block *b, int32_t x, int in_half)
{
    const float shown = 4; /* well beyond white */
    const int32_t y = (b->y1 - b->y0) / 2;
    const float n = (float)b->spp;
    lc_image_poke_plane(image, LULL_PLANE_COLOR, x, y, shown);
    lc_image_poke_plane(image, LULL_PLANE_MOMENT2, x, y, shown * shown * n);
    lc_image_poke_plane(image, LULL_PLANE_HALF, x, y, in_half ? shown * n / (float)b->half_spp : GREY);
}

/* The step at which an even grey block is stopped, LC_STEPS if at none; with fireflies, two of its pixels hang on one
 * sample. */
static int grey_stops_at(struct lc *c, int fireflies)
{
    static const struct lc_paint grey = {(double)GREY, (double)GREY, 0};
    struct lc_session s;
    int step = 0, action = LULL_CONTINUE, sized = c->req.block_width > 0 && c->req.block_height > 0;
    const int32_t w = sized ? (int32_t)c->req.block_width : BLOCK_SIDE;
    const int32_t h = sized ? (int32_t)c->req.block_height : BLOCK_SIDE;
    if (lc_session_open(&s, c, &(struct lc_manner){.size = {w, h, w, h}, .paint = &grey}) != 0)
        return 0;
    for (; step < LC_STEPS && action == LULL_CONTINUE; step += action == LULL_CONTINUE, s.spp *= 2) {
        struct lc_image image;
        struct lull_decision d[LC_FILM_BLOCKS];
        const struct lull_block *b = &s.film.blocks[0];
        lc_film_advance(&s.film, b->id, s.spp);
        lc_session_image(&s, &image);
        if (fireflies) {
            light_pixel(&image, b, (b->x1 - b->x0) / 4, 1);
            light_pixel(&image, b, (b->x1 - b->x0) / 2, 0);
        }
        if (!lc_session_judge(&s, &image, d, "of a grey block"))
            break;
        action = d[0].action;
    }
    lc_session_close(&s);
    return step;
}

/* Whoever is given the halves or the second moment can see that a pixel hangs on one sample; the mean over 40,000 pixels
 * hardly shows it. Only what would stop the block without these pixels can fail. */
void lc_check_firefly(struct lc *c)
{
    int has_evidence =
        (c->req.planes_required & (LULL_PLANE_BIT(LULL_PLANE_HALF) | LULL_PLANE_BIT(LULL_PLANE_MOMENT2))) != 0;
    int calm = grey_stops_at(c, 0), hot = grey_stops_at(c, 1);
    if (!has_evidence)
        lc_note(c, "it requires neither HALF nor MOMENT2: what it does with a firefly is its own affair");
    else if (calm == LC_STEPS)
        lc_note(c, "it does not stop an even grey block either");
    else
        LC_EXPECT(c, hot == LC_STEPS, "a block with two pixels that hang on one sample each is stopped at check %d",
                  hot + 1);
}

/* Before the first sample nothing can be decided, and nothing may be divided by it. */
void lc_check_no_samples(struct lc *c)
{
    static const int32_t normalisers[] = {LULL_NORM_ONE, LULL_NORM_SPP, LULL_NORM_WEIGHT};
    for (size_t k = 0; k < COUNT(normalisers); k++) {
        struct lc_session s;
        struct lc_manner manner = {.layout = {.normaliser = normalisers[k]}};
        if (lc_session_open(&s, c, &manner) != 0)
            return;
        struct lull_decision d[LC_FILM_BLOCKS];
        for (uint64_t spp = 0; spp < 3; spp++) {
            for (uint32_t i = 0; i < s.film.block_count; i++)
                lc_film_advance(&s.film, i, spp * (i % 2)); /* even blocks stay without */
            lc_session_judge(&s, NULL, d, "at 0 samples");
        }
        lc_session_steps(&s, 2);
        lc_session_close(&s);
    }
}
