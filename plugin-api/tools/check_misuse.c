/* SPDX-License-Identifier: MIT
 *
 * Random calls outside the rules. A good session and calls that the header forbids take turns; what is wrong with a call is
 * drawn from tables, one thing or several at once, by a seed.
 *
 * - What the header says is refused must be refused, with one of the codes that fit what is wrong and with a message, and
 *   must leave no trace: the good session ends with the answers that it gives undisturbed.
 * - Where the header leaves it open (blocks that overlap, an exposure of NaN, samples that become fewer) a second instance
 *   is asked, which is thrown away: it may refuse or answer, but not with nonsense.
 *
 * All memory that a call is given ends right before a page that cannot be touched, structs that are too short included. Not
 * tried, since nothing is promised: calls after destroy, pointers to nowhere, arrays shorter than their count.
 */
#include "check.h"

#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum slot { AT_HOST, AT_PAIRS, AT_FRAME, AT_RECTS, AT_VIEW, AT_PLANES, AT_BLOCKS, AT_DECISIONS, AT_STREAM, AT_ERROR, SLOTS };
enum { SLOT_SIZE = 8192, BLOCKS_MAX = 8, PAIRS_MAX = 72, TEXT_MAX = 6000 };

/* Sets of statuses: the header's codes are -1 to -11. */
#define CODE(status) (UINT32_C(1) << -(status))
#define MAY (~UINT32_C(0)) /* the header leaves it open */
static const uint32_t INVALID = CODE(LULL_E_INVALID), VERSION = CODE(LULL_E_VERSION), PLANE = CODE(LULL_E_PLANE),
                      SIZE = CODE(LULL_E_INVALID) | CODE(LULL_E_VERSION), REFUSED = MAY & ~CODE(LULL_OK);

struct misuse {
    struct lc *check;
    uint64_t random, calls, refused;
    void *slot[SLOTS]; /* owns */
    size_t mapped[SLOTS];
    struct lc_session s;         /* what must not be disturbed */
    struct lc_image image;       /* of its film */
    struct lull_instance *loose; /* owns; whatever it is given */
    const struct lull_state *state;
    struct lc_buffer saved; /* a state of the session */
    int open;               /* the session's frame is */

    /* the call that is being made up */
    struct lull_instance *instance;
    uint32_t codes; /* that fit what is wrong; 0: nothing is */
    char what[400];
};

static uint32_t draw(struct misuse *m, uint32_t below) /* SplitMix64 (Steele, Lea, Flood 2014) */
{
    uint64_t x = m->random += UINT64_C(0x9e3779b97f4a7c15);
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (uint32_t)((x ^ (x >> 31)) >> 32) % below;
}

static double nonsense(struct misuse *m)
{
    static const double numbers[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, 0, -1, 1e300, -1e300, 1e-320, 5e18};
    return numbers[draw(m, sizeof numbers / sizeof *numbers)];
}

/* Memory for so many bytes, eight at least, before a page that cannot be touched. */
static void *place(struct misuse *m, enum slot slot, const void *from, size_t size)
{
    size_t room = size < 8 ? 8 : (size + 7) / 8 * 8;
    char *at = (char *)m->slot[slot] + SLOT_SIZE - room;
    memset(at, 0xa5, room);
    if (from && size > 0)
        memcpy(at, from, size);
    return at;
}

/* The same for a struct that says it has so many bytes. */
static void *place_struct(struct misuse *m, enum slot slot, const void *from, size_t size)
{
    uint32_t struct_size = (uint32_t)size;
    void *at = place(m, slot, from, size);
    memcpy(at, &struct_size, sizeof struct_size);
    return at;
}

/* Notes what is wrong. Of several wrong things any may be complained about; a call is open to the criterion only if each is.
 */
static void wrong(struct misuse *m, uint32_t codes, const char *what)
{
    size_t length = strlen(m->what);
    snprintf(m->what + length, sizeof m->what - length, "%s%s", m->codes ? ", " : "", what);
    if (m->codes == 0)
        m->codes = codes;
    else if (codes == MAY || m->codes == MAY)
        m->codes = codes == m->codes ? MAY : REFUSED;
    else
        m->codes |= codes;
}

static uint32_t too_small(struct misuse *m, size_t size) { return 8 * draw(m, (uint32_t)(size / 8)); }

/* --- one call ---------------------------------------------------------------------------------------------------------- */

static const char untouched[] = "untouched";

/* An error struct, a short one, or none; says the call to whoever finds the process dead. */
static struct lull_error *announce(struct misuse *m, const char *function)
{
    struct lull_error blank = {.code = INT_MAX, .message = "untouched"};
    const uint32_t form = draw(m, 8);
    m->calls++;
    lc_doing(m->check, "call %llu of seed %llu: %s: %s", (unsigned long long)m->calls, (unsigned long long)m->check->seed,
             function, m->codes ? m->what : "as it should be");
    if (form == 0)
        return NULL;
    return place_struct(m, AT_ERROR, &blank, form == 1 ? too_small(m, sizeof blank) : sizeof blank);
}

/* Is this one of the expected statuses, and does the error say the same? */
static void judge(struct misuse *m, const char *function, int32_t status, const struct lull_error *err)
{
    const uint32_t allowed = m->codes ? m->codes : CODE(LULL_OK);
    struct lc *c = m->check;
    m->refused += (allowed & CODE(LULL_OK)) == 0;
    if (status > LULL_OK || status < LULL_E_INTERNAL || !(allowed & CODE(status))) {
        char fitting[64] = "";
        for (int32_t s = LULL_OK; s >= LULL_E_INTERNAL; s--)
            if (allowed & CODE(s))
                snprintf(fitting + strlen(fitting), sizeof fitting - strlen(fitting), " %d", s);
        lc_fail(c, "call %llu of seed %llu: %s: %s: status %d, expected%s", (unsigned long long)m->calls,
                (unsigned long long)c->seed, function, m->codes ? m->what : "as it should be", status, fitting);
    } else if (err && err->struct_size == sizeof *err) {
        int terminated = memchr(err->message, '\0', sizeof err->message) != NULL;
        int fits = status == LULL_OK ? err->code == INT_MAX && strcmp(err->message, untouched) == 0
                                     : err->code == status && terminated && err->message[0] != '\0' &&
                                           strcmp(err->message, untouched) != 0;
        LC_EXPECT(c, fits, "call %llu of seed %llu: %s: %s: status %d, but the error says %d, \"%.*s\"",
                  (unsigned long long)m->calls, (unsigned long long)c->seed, function, m->what, status, err->code, 200,
                  err->message);
    }
}

static void make_up(struct misuse *m, struct lull_instance *instance)
{
    m->instance = instance;
    m->codes = 0;
    m->what[0] = '\0';
}

/* One thing is wrong, sometimes several. */
static uint32_t how_many(struct misuse *m)
{
    const uint32_t another = draw(m, 4), more = draw(m, 16);
    return 1u + (another == 0) + (more == 0);
}

/* --- create ------------------------------------------------------------------------------------------------------------ */

struct create_call {
    struct lull_host host;
    struct lull_pair pairs[PAIRS_MAX];
    uint32_t pair_count, pair_stride, host_size;
    int no_place, no_pairs;
    char text[TEXT_MAX];
};

static void add_pair(struct create_call *k, const char *key, const char *value)
{
    if (k->pair_count < PAIRS_MAX)
        k->pairs[k->pair_count++] = (struct lull_pair){key, value};
}

/* Bytes that are no number, choice or name of anything: they begin with '%', which also finds who prints them as a format.
 */
static const char *gibberish(struct misuse *m, struct create_call *k)
{
    const uint32_t length = draw(m, 4) ? 1 + draw(m, 40) : 1 + draw(m, TEXT_MAX - 1);
    k->text[0] = '%';
    for (uint32_t i = 1; i < length; i++)
        k->text[i] = (char)(1 + draw(m, 255));
    k->text[length] = '\0';
    return k->text;
}

static const char *out_of_range(struct misuse *m, struct create_call *k, const struct lull_param *p)
{
    static const char *const none[] = {"", "nan", "-nan", "inf", "-inf", "1e999999", "-1e999999", "0x1", "1 ", "1,0", "1e"};
    const double end = draw(m, 2) ? p->max : p->min, beyond = end + (end == p->max ? 1 : -1) * fmax(1, fabs(end) * 0.01);
    if (p->type == LULL_PARAM_BOOL)
        return draw(m, 2) ? "2" : "-1";
    if (p->type > LULL_PARAM_FLOAT || draw(m, 3) == 0)
        return gibberish(m, k);
    if (draw(m, 2) || !isfinite(beyond))
        return none[draw(m, sizeof none / sizeof *none)];
    snprintf(k->text, TEXT_MAX, "%.0f", beyond > 0 ? ceil(beyond) : floor(beyond));
    return k->text;
}

/* A wrong value for one of the parameters, perhaps after or before a good one. */
static void spoil_value(struct misuse *m, struct create_call *k)
{
    const struct lull_criterion *t = m->check->criterion;
    if (t->param_count == 0)
        return;
    const void *at = (const char *)t->params + (size_t)draw(m, t->param_count) * t->param_stride;
    const struct lull_param *p = at;
    const uint32_t twice = draw(m, 3);
    if (p->type > LULL_PARAM_CHOICE) {
        wrong(m, MAY, "a file or text of any bytes");
        add_pair(k, p->name, gibberish(m, k));
        return;
    }
    wrong(m, twice == 1 ? MAY : CODE(LULL_E_VALUE), twice == 1 ? "a bad value before a good one" : "a bad value");
    if (twice == 2 && p->default_value)
        add_pair(k, p->name, p->default_value);
    add_pair(k, p->name, out_of_range(m, k, p));
    if (twice == 1 && p->default_value)
        add_pair(k, p->name, p->default_value);
}

static void spoil_create(struct misuse *m, struct create_call *k)
{
    switch (draw(m, 8)) {
    case 0: wrong(m, INVALID, "no place for the instance"), k->no_place = 1; break;
    case 1:
        wrong(m, INVALID, "pairs at NULL"), k->no_pairs = 1;
        k->pair_count += k->pair_count == 0;
        break;
    case 2: wrong(m, INVALID, "no key"), add_pair(k, NULL, "1"); break;
    case 3: wrong(m, INVALID | CODE(LULL_E_KEY), "no value"), add_pair(k, "no-such-parameter", NULL); break;
    case 4: wrong(m, VERSION, "a short host"), k->host_size = too_small(m, sizeof k->host); break;
    case 5:
        wrong(m, SIZE, "a short stride of the pairs"), k->pair_stride = too_small(m, sizeof *k->pairs);
        k->pair_count += k->pair_count == 0;
        break;
    case 6: wrong(m, CODE(LULL_E_KEY), "an unknown key"), add_pair(k, gibberish(m, k), "1"); break;
    default: spoil_value(m, k);
    }
}

static void call_create(struct misuse *m)
{
    struct lc *c = m->check;
    struct create_call k = {.host = {.api_minor = LULL_API_MINOR},
                            .pair_count = c->pair_count,
                            .pair_stride = sizeof *k.pairs,
                            .host_size = sizeof k.host};
    for (uint32_t i = 0; i < c->pair_count; i++)
        k.pairs[i] = c->pairs[i];
    make_up(m, NULL);
    for (uint32_t n = how_many(m); n > 0; n--)
        spoil_create(m, &k);
    struct lull_instance *const none = (struct lull_instance *)(void *)&k, *instance = none;
    const struct lull_host *host = place_struct(m, AT_HOST, &k.host, k.host_size);
    const struct lull_pair *pairs = place(m, AT_PAIRS, k.pairs, (size_t)k.pair_count * k.pair_stride);
    struct lull_error *err = announce(m, "create");
    int32_t status =
        c->criterion->create(k.host_size == sizeof k.host && draw(m, 2) ? NULL : host, k.no_pairs ? NULL : pairs,
                             k.pair_count, k.pair_stride, k.no_place ? NULL : &instance, err);
    judge(m, "create", status, err);
    LC_EXPECT(c, (status == LULL_OK) == (instance != none), "call %llu: create: status %d, and the instance is %stouched",
              (unsigned long long)m->calls, status, instance == none ? "un" : "");
    if (instance != none)
        c->criterion->destroy(instance);
}

static void call_requirements(struct misuse *m)
{
    struct lull_requirements req = {0};
    make_up(m, m->s.instance);
    const uint32_t which = draw(m, 4), size = which == 2 ? too_small(m, sizeof req) : (uint32_t)sizeof req;
    if (which == 0)
        wrong(m, INVALID, "no instance"), m->instance = NULL;
    if (which == 1)
        wrong(m, INVALID, "no struct to fill");
    if (which == 2)
        wrong(m, VERSION, "a short struct to fill");
    struct lull_requirements *r = place_struct(m, AT_FRAME, &req, size);
    struct lull_error *err = announce(m, "requirements");
    int32_t status = m->check->criterion->requirements(m->instance, which == 1 ? NULL : r, err);
    judge(m, "requirements", status, err);
}

/* --- begin_frame ------------------------------------------------------------------------------------------------------- */

struct frame_call {
    struct lull_frame frame;
    struct lull_rect rects[BLOCKS_MAX];
    uint32_t size;
    int no_frame, no_blocks;
};

static void spoil_rect(struct misuse *m, const struct lull_frame *f, struct lull_rect *r)
{
    switch (draw(m, 6)) {
    case 0: wrong(m, INVALID, "an empty block"), r->x1 = r->x0; break;
    case 1: wrong(m, INVALID, "a block upside down"), r->y1 = INT32_MIN; break;
    case 2: wrong(m, INVALID, "a block beyond the right edge"), r->x1 = (int32_t)f->width + 1; break;
    case 3: wrong(m, INVALID, "a block below the picture"), r->y1 = draw(m, 2) ? (int32_t)f->height + 1 : INT32_MAX; break;
    case 4: wrong(m, INVALID, "a block above the picture"), r->y0 = draw(m, 2) ? -1 : INT32_MIN; break;
    default: wrong(m, INVALID, "a block left of the picture"), r->x0 = -1 - (int32_t)draw(m, INT_MAX);
    }
}

static void spoil_frame(struct misuse *m, struct frame_call *k)
{
    const uint32_t needed = m->check->req.planes_required;
    switch (draw(m, needed ? 9 : 8)) {
    case 0: wrong(m, INVALID, "no instance"), m->instance = NULL; break;
    case 1: wrong(m, INVALID, "no frame"), k->no_frame = 1; break;
    case 2: wrong(m, VERSION, "a short frame"), k->size = too_small(m, sizeof k->frame); break;
    case 3: wrong(m, INVALID, "blocks at NULL"), k->no_blocks = 1; break;
    case 4: wrong(m, INVALID, "no blocks"), k->frame.block_count = 0; break;
    case 5: wrong(m, SIZE, "a short stride of the blocks"), k->frame.block_stride = too_small(m, sizeof *k->rects); break;
    case 6: wrong(m, INVALID, "an empty picture"), k->frame.width = 0; break;
    case 7: spoil_rect(m, &k->frame, &k->rects[draw(m, k->frame.block_count + (k->frame.block_count == 0))]); break;
    default: wrong(m, PLANE, "planes missing"), k->frame.planes &= ~needed;
    }
}

/* From 2^28 to 2^31 - 1, often a power of two: products of such numbers and of sizes overflow in many ways. */
static uint32_t huge(struct misuse *m)
{
    const uint32_t shift = draw(m, 4);
    return ((uint32_t)INT32_MAX >> shift) + (shift > 0);
}

/* What the header does not say is refused. */
static void loosen_frame(struct misuse *m, struct frame_call *k)
{
    struct lull_frame *f = &k->frame;
    switch (draw(m, 8)) {
    case 0: wrong(m, MAY, "blocks that overlap"), k->rects[0] = k->rects[f->block_count - 1]; break;
    case 1: wrong(m, MAY, "an exposure of nonsense"), f->exposure = nonsense(m); break;
    case 2: wrong(m, MAY, "an unknown transfer"), f->transfer = (int32_t)draw(m, 5) + 3, f->gamma = nonsense(m); break;
    case 3:
        wrong(m, MAY, "limits that contradict"), f->spp_min = 1 + draw(m, 1000), f->spp_max = draw(m, (uint32_t)f->spp_min);
        break;
    case 4: wrong(m, MAY, "a matrix of nonsense"), f->rgb_to_xyz[draw(m, 9)] = nonsense(m); break;
    case 5: wrong(m, MAY, "times of nonsense"), f->time_budget_s = nonsense(m), f->sample_clamp = nonsense(m); break;
    case 6:
        wrong(m, MAY, "unknown flags and planes"), f->flags |= 1u << (4 + draw(m, 28)), f->planes |= 1u << (8 + draw(m, 24));
        break;
    default:
        wrong(m, MAY, "one block larger than any memory"), f->block_count = 1;
        f->width = huge(m), f->height = huge(m);
        k->rects[0] = (struct lull_rect){0, 0, (int32_t)f->width, (int32_t)f->height};
    }
}

static int32_t send_frame(struct misuse *m, const struct frame_call *k)
{
    struct lull_frame f = k->frame;
    const uint32_t stride = f.block_stride;
    char *rects = place(m, AT_RECTS, NULL, (size_t)f.block_count * stride);
    for (uint32_t i = 0; i < f.block_count && stride >= sizeof *k->rects; i++)
        memcpy(rects + (size_t)i * stride, &k->rects[i], sizeof *k->rects);
    f.blocks = k->no_blocks ? NULL : (const struct lull_rect *)(const void *)rects;
    const struct lull_frame *at = place_struct(m, AT_FRAME, &f, k->size);
    struct lull_error *err = announce(m, "begin_frame");
    int32_t status = m->check->criterion->begin_frame(m->instance, k->no_frame ? NULL : at, err);
    judge(m, "begin_frame", status, err);
    return status;
}

static void frame_of_session(const struct misuse *m, struct frame_call *k)
{
    *k = (struct frame_call){.size = sizeof k->frame};
    lc_film_frame(&m->s.film, &k->frame, m->s.planes);
    k->frame.block_count = k->frame.block_count < BLOCKS_MAX ? k->frame.block_count : BLOCKS_MAX;
    memcpy(k->rects, m->s.film.rects, k->frame.block_count * sizeof *k->rects);
}

static void call_begin(struct misuse *m)
{
    struct frame_call k;
    frame_of_session(m, &k);
    make_up(m, m->s.instance);
    uint32_t n = how_many(m);
    k.frame.flags |= draw(m, 2) ? LULL_FRAME_RESTART : 0;
    if (m->open && !(k.frame.flags & LULL_FRAME_RESTART))
        wrong(m, CODE(LULL_E_STATE), "a frame is open"), n--;
    for (; n > 0; n--)
        spoil_frame(m, &k);
    send_frame(m, &k);
}

/* --- evaluate ---------------------------------------------------------------------------------------------------------- */

struct evaluate_call {
    struct lull_view view;
    struct lull_plane planes[LULL_PLANE_COUNT];
    struct lull_block blocks[BLOCKS_MAX];
    uint32_t count, size, block_stride, decision_stride;
    int no_view, no_planes, no_blocks, no_decisions;
};

static void spoil_plane(struct misuse *m, struct evaluate_call *k)
{
    static const double scales[] = {0, (double)NAN, (double)INFINITY, -(double)INFINITY};
    unsigned plane = draw(m, LULL_PLANE_COUNT);
    while (!(m->check->req.planes_required & LULL_PLANE_BIT(plane)))
        plane = (plane + 1) % LULL_PLANE_COUNT;
    struct lull_plane *p = &k->planes[plane];
    switch (draw(m, 7)) {
    case 0: wrong(m, PLANE, "a plane at NULL"), p->data = NULL; break;
    case 1: wrong(m, PLANE, "too few planes"), k->view.plane_count = draw(m, plane + 1); break;
    case 2:
        wrong(m, PLANE, "a plane of an unknown type"), p->type = draw(m, 2) ? 4 + (int32_t)draw(m, INT_MAX - 4) : -1;
        break;
    case 3:
        wrong(m, PLANE, "a plane of an unknown normaliser"), p->normaliser = draw(m, 2) ? 4 + (int32_t)draw(m, 99) : INT_MIN;
        break;
    case 4: wrong(m, PLANE, "a plane of too few channels"), p->channels = draw(m, lc_plane_channels[plane]); break;
    case 5:
        wrong(m, PLANE, "a plane of a scale that is none"), p->scale = scales[draw(m, sizeof scales / sizeof *scales)];
        break;
    default:
        wrong(m, PLANE, "a plane that wants WEIGHT, which is not there"), k->planes[LULL_PLANE_WEIGHT].data = NULL;
        p->normaliser = LULL_NORM_WEIGHT;
    }
}

static void spoil_block(struct misuse *m, struct evaluate_call *k)
{
    struct lull_block *b = &k->blocks[draw(m, k->count)];
    struct lull_view *v = &k->view;
    const uint32_t which = draw(m, 6), far = draw(m, 2), some = draw(m, 1000);
    switch (which) {
    case 0:
        wrong(m, INVALID, "a block that the frame has not"), b->id = m->s.film.block_count + (far ? 1000000 * some : 0);
        break;
    case 1: wrong(m, INVALID, "block 4294967295"), b->id = UINT32_MAX; break;
    case 2: wrong(m, INVALID, "an empty block"), b->y1 = b->y0; break;
    case 3: wrong(m, INVALID, "a block from right to left"), b->x0 = b->x1 + (int32_t)some; break;
    case 4: wrong(m, INVALID, "a block beyond the view"), b->y1 = far ? INT32_MAX : v->y1 + 1; break;
    default: wrong(m, INVALID, "a view that does not hold a block"), *(some % 2 ? &v->x1 : &v->y1) = far ? INT32_MIN : 0;
    }
}

static void spoil_evaluate(struct misuse *m, struct evaluate_call *k)
{
    const uint32_t needed = m->check->req.planes_required;
    switch (draw(m, needed ? 14 : 9)) {
    case 0: wrong(m, INVALID, "no instance"), m->instance = NULL; break;
    case 1: wrong(m, INVALID, "no view"), k->no_view = 1; break;
    case 2: wrong(m, INVALID, "blocks at NULL"), k->no_blocks = 1; break;
    case 3: wrong(m, INVALID, "decisions at NULL"), k->no_decisions = 1; break;
    case 4: wrong(m, VERSION, "a short view"), k->size = too_small(m, sizeof k->view); break;
    case 5: wrong(m, SIZE, "a short stride of the blocks"), k->block_stride = too_small(m, sizeof *k->blocks); break;
    case 6:
        wrong(m, SIZE, "a short stride of the decisions");
        k->decision_stride = too_small(m, sizeof(struct lull_decision));
        break;
    case 9: wrong(m, INVALID | PLANE, "planes at NULL"), k->no_planes = 1; break;
    case 10:
        wrong(m, SIZE | PLANE, "a short stride of the planes"), k->view.plane_stride = too_small(m, sizeof *k->planes);
        break;
    case 11:
    case 12:
    case 13: spoil_plane(m, k); break;
    default: spoil_block(m, k);
    }
}

/* What the header does not say is refused: the rectangle of a block that a criterion need not keep, counts of samples, what
 * is only for information. */
static void loosen_evaluate(struct misuse *m, struct evaluate_call *k)
{
    struct lull_block *b = &k->blocks[draw(m, k->count)];
    struct lull_view *v = &k->view;
    switch (draw(m, 8)) {
    case 0:
        wrong(m, MAY, "a block of another rectangle");
        b->x0 = v->x0, b->y0 = v->y0, b->x1 = v->x1 - (int32_t)draw(m, 2), b->y1 = v->y1;
        break;
    case 1: wrong(m, MAY, "fewer samples than before"), b->spp /= 2, b->half_spp = b->spp / 2; break;
    case 2: wrong(m, MAY, "more samples than can be"), b->spp = UINT64_MAX >> draw(m, 16), b->half_spp = b->spp / 2; break;
    case 3: wrong(m, MAY, "more samples in HALF than in all"), b->half_spp = b->spp + 1 + draw(m, 1000); break;
    case 4: wrong(m, MAY, "a block twice"), *b = k->blocks[0]; break;
    case 5: wrong(m, MAY, "unknown flags"), b->flags = 1u << (2 + draw(m, 30)), v->flags = 1u << draw(m, 32); break;
    case 6: wrong(m, MAY, "times of nonsense"), b->thread_s = nonsense(m), v->elapsed_s = nonsense(m); break;
    default:
        wrong(m, MAY, "states of all blocks that are none"), v->all_stride = 0, v->all_count = draw(m, 2) ? 1 : v->all_count;
        if (draw(m, 2))
            v->all = NULL;
    }
}

static int32_t send_evaluate(struct misuse *m, const struct evaluate_call *k)
{
    struct lull_view v = k->view;
    const struct lull_decision *decisions;
    char *planes = place(m, AT_PLANES, NULL, (size_t)v.plane_count * v.plane_stride);
    for (uint32_t i = 0; i < v.plane_count && v.plane_stride >= sizeof *k->planes; i++)
        memcpy(planes + (size_t)i * v.plane_stride, &k->planes[i], sizeof *k->planes);
    char *blocks = place(m, AT_BLOCKS, NULL, (size_t)k->count * k->block_stride);
    for (uint32_t i = 0; i < k->count && k->block_stride >= sizeof *k->blocks; i++)
        memcpy(blocks + (size_t)i * k->block_stride, &k->blocks[i], sizeof *k->blocks);
    char *out = place(m, AT_DECISIONS, NULL, (size_t)k->count * k->decision_stride);
    for (uint32_t i = 0; i < k->count && k->decision_stride >= sizeof *decisions; i++)
        lc_decision_preset((void *)(out + (size_t)i * k->decision_stride));
    v.planes = k->no_planes ? NULL : (const void *)planes;
    const struct lull_view *view = place_struct(m, AT_VIEW, &v, k->size);
    struct lull_error *err = announce(m, "evaluate");
    int32_t status = m->check->criterion->evaluate(m->instance, k->no_view ? NULL : view,
                                                   k->no_blocks ? NULL : (void *)blocks, k->block_stride,
                                                   k->no_decisions ? NULL : (void *)out, k->decision_stride, k->count, err);
    judge(m, "evaluate", status, err);
    for (uint32_t i = 0; i < k->count && status == LULL_OK && k->decision_stride >= sizeof *decisions; i++) {
        decisions = (const void *)(out + (size_t)i * k->decision_stride);
        lc_decision_check(m->check, &k->blocks[i], decisions);
    }
    return status;
}

/* The session's last question once more, about some of its blocks. */
static void evaluate_of_session(struct misuse *m, struct evaluate_call *k)
{
    const uint32_t all = m->s.film.block_count < BLOCKS_MAX ? m->s.film.block_count : BLOCKS_MAX, first = draw(m, all);
    *k = (struct evaluate_call){.view = m->image.view,
                                .count = 1 + draw(m, all - first),
                                .size = sizeof k->view,
                                .block_stride = sizeof *k->blocks,
                                .decision_stride = sizeof(struct lull_decision)};
    for (unsigned p = 0; p < LULL_PLANE_COUNT; p++)
        k->planes[p] = *lc_image_plane(&m->image, p);
    memcpy(k->blocks, &m->s.film.blocks[first], k->count * sizeof *k->blocks);
}

static void call_evaluate(struct misuse *m)
{
    struct evaluate_call k;
    evaluate_of_session(m, &k);
    make_up(m, m->s.instance);
    uint32_t n = how_many(m);
    if (!m->open)
        wrong(m, CODE(LULL_E_STATE), "no frame is open"), n -= draw(m, 2);
    for (; n > 0; n--)
        spoil_evaluate(m, &k);
    send_evaluate(m, &k);
}

/* --- lull.state/1 ------------------------------------------------------------------------------------------------------ */

/* What is wrong with a call about a stream, in words: none, a short struct, one that cannot work, and what fails in the end.
 * Returns which: 0 no instance, then these. */
static uint32_t spoil_stream(struct misuse *m, uint32_t full_size, uint32_t *size, const char *const words[4])
{
    const uint32_t which = draw(m, 5);
    *size = which == 2 ? too_small(m, full_size) : full_size;
    make_up(m, m->s.instance);
    if (!m->open)
        wrong(m, CODE(LULL_E_STATE), "no frame is open");
    if (which == 0)
        wrong(m, INVALID, "no instance"), m->instance = NULL;
    else if (which < 4)
        wrong(m, which == 2 ? VERSION : INVALID, words[which - 1]);
    else if (m->open && m->saved.size > 0)
        wrong(m, REFUSED, words[3]);
    return which;
}

static void call_save(struct misuse *m)
{
    static const char *const words[] = {"no writer", "a short writer", "a writer that cannot write", "writing fails"};
    struct lc_buffer b = {.limit = m->saved.size > 0 ? draw(m, (uint32_t)m->saved.size) : 0};
    struct lull_writer writer = {.context = &b, .write = lc_buffer_write};
    uint32_t size, which = spoil_stream(m, sizeof writer, &size, words);
    if (m->codes == 0)
        return; /* there is nothing to be written */
    if (which == 3)
        writer.write = NULL;
    const struct lull_writer *at = place_struct(m, AT_STREAM, &writer, size);
    struct lull_error *err = announce(m, "save");
    int32_t status = m->state->save(m->instance, which == 1 ? NULL : at, err);
    free(b.data);
    judge(m, "save", status, err);
}

static void send_load(struct misuse *m, struct lc_buffer *b, int no_reader, int no_read, uint32_t size)
{
    struct lull_reader reader = {.context = b, .read = no_read ? NULL : lc_buffer_read};
    const struct lull_reader *at = place_struct(m, AT_STREAM, &reader, size);
    struct lull_error *err = announce(m, "load");
    int32_t status = m->state->load(m->instance, no_reader ? NULL : at, err);
    judge(m, "load", status, err);
}

static void call_load(struct misuse *m)
{
    static const char *const words[] = {"no reader", "a short reader", "a reader that cannot read", "a state cut short"};
    struct lc_buffer b = {.data = m->saved.data, .size = m->saved.size};
    uint32_t size, which = spoil_stream(m, sizeof(struct lull_reader), &size, words);
    if (m->codes == 0)
        return;
    if (which == 4 && m->open)
        b.size = draw(m, (uint32_t)m->saved.size);
    send_load(m, &b, which == 1, which == 3, size);
}

/* --- what the header leaves open -----------------------------------------------------------------------------------------
 */

static void loose_frame(struct misuse *m)
{
    struct frame_call k;
    frame_of_session(m, &k);
    k.frame.flags |= draw(m, 4) ? LULL_FRAME_RESTART : 0;
    for (uint32_t n = how_many(m); n > 0; n--)
        loosen_frame(m, &k);
    send_frame(m, &k);
}

static void loose_evaluate(struct misuse *m)
{
    struct evaluate_call k;
    evaluate_of_session(m, &k);
    for (uint32_t n = how_many(m); n > 0; n--)
        loosen_evaluate(m, &k);
    send_evaluate(m, &k);
}

static void loose_load(struct misuse *m)
{
    struct lc_buffer b = {.size = m->saved.size, .data = malloc((size_t)m->saved.size + 1)};
    if (!b.data)
        return;
    memcpy(b.data, m->saved.data, (size_t)b.size);
    wrong(m, MAY, "a damaged state");
    for (uint32_t n = 1 + draw(m, 4); n > 0; n--) {
        char *at = &b.data[draw(m, (uint32_t)b.size)];
        *at = (char)draw(m, 256);
    }
    send_load(m, &b, 0, 0, sizeof(struct lull_reader));
    free(b.data);
}

static void call_loose(struct misuse *m)
{
    const uint32_t which = draw(m, 8);
    if (!m->loose)
        m->loose = lc_create(m->check, m->s.manner.host);
    if (!m->loose)
        return;
    make_up(m, m->loose);
    if (which < 2)
        loose_frame(m);
    else if (which == 2 && m->state && m->saved.size > 0)
        loose_load(m);
    else
        loose_evaluate(m);
}

/* --- lives ------------------------------------------------------------------------------------------------------------- */

/* Calls that answer with a pointer. */
static void call_lookup(struct misuse *m)
{
    static const char *const ids[] = {"",    "lull.state", "lull.state/", "lull.state/2", "lull.state/11", "LULL.STATE/1",
                                      "%n%s"};
    struct lc *c = m->check;
    const char *id = ids[draw(m, sizeof ids / sizeof *ids)];
    lc_doing(c, "call %llu of seed %llu: get_extension(\"%s\")", (unsigned long long)++m->calls, (unsigned long long)c->seed,
             id);
    LC_EXPECT(c, !c->criterion->get_extension(id), "it claims the extension \"%s\"", id);
    c->criterion->destroy(NULL);
    if (!m->open)
        c->criterion->end_frame(m->s.instance);
}

static void disturb(struct misuse *m)
{
    const uint64_t most = m->check->misuse, end = m->calls + draw(m, 40);
    while (m->calls < end && m->calls < most && !m->check->failed) {
        const uint32_t which = draw(m, 20);
        if (which < 3)
            call_create(m);
        else if (which < 4)
            call_requirements(m);
        else if (which < 7)
            call_begin(m);
        else if (which < 12)
            call_evaluate(m);
        else if (which < 14 && m->state)
            (which == 12 ? call_save : call_load)(m);
        else if (which < 19)
            call_loose(m);
        else
            call_lookup(m);
    }
}

/* The image and the state as they are now, then calls. */
static void disturb_session(struct misuse *m)
{
    struct lc *c = m->check;
    if (lc_session_image(&m->s, &m->image) != 0)
        return;
    if (m->open && m->state) {
        struct lull_error err = {.struct_size = sizeof err};
        free(m->saved.data);
        m->saved = (struct lc_buffer){.limit = UINT64_MAX};
        LC_EXPECT(c, lc_state_save(m->state, &m->s, &m->saved, &err) == LULL_OK, "save: %s", err.message);
    }
    disturb(m);
    lc_image_release(&m->image);
}

static void end_frame(struct misuse *m)
{
    m->check->criterion->end_frame(m->s.instance);
    m->open = m->s.open = 0;
}

/* A session from create to destroy, disturbed before, between and after its steps. */
static void live(struct misuse *m, const struct lc_log *expected)
{
    struct lc *c = m->check;
    struct lc_host host;
    struct lc_manner manner = {0};
    if (lc_host_init(&host, c, 1) != 0)
        return;
    host.reverse = (int)draw(m, 2);
    manner.host = draw(m, 2) ? &host.host : NULL;
    if (lc_session_open(&m->s, c, &manner) == 0) {
        struct lull_frame frame;
        end_frame(m);
        disturb_session(m);
        lc_film_frame(&m->s.film, &frame, m->s.planes);
        m->open = m->s.open = LC_EXPECT(c, lc_begin(c, m->s.instance, &frame, NULL) == LULL_OK,
                                        "after %llu refused calls no frame can be begun", (unsigned long long)m->refused);
        for (int step = 0; step < LC_STEPS && !c->failed; step++) {
            disturb_session(m);
            lc_session_step(&m->s);
        }
        if (!c->failed)
            lc_log_compare(c, expected, &m->s.log, lc_deterministic(c), "after refused calls");
        end_frame(m);
        disturb_session(m);
        lc_session_close(&m->s);
    }
    c->criterion->destroy(m->loose);
    m->loose = NULL;
    lc_host_release(&host);
}

static void check_misuse(struct lc *c)
{
    struct misuse m = {.check = c, .random = c->seed, .state = c->criterion->get_extension(LULL_EXT_STATE)};
    struct lc_log expected;
    int room = 1;
    for (int i = 0; i < SLOTS; i++)
        room &= (m.slot[i] = lc_guard_alloc(SLOT_SIZE, &m.mapped[i])) != NULL;
    if (LC_EXPECT(c, room, "out of memory") && lc_run(c, NULL, &expected) == 0) {
        while (m.calls < c->misuse && !c->failed)
            live(&m, &expected);
        lc_log_release(&expected);
    }
    lc_note(c, "%llu calls, %llu of them had to be refused", (unsigned long long)m.calls, (unsigned long long)m.refused);
    free(m.saved.data);
    for (int i = 0; i < SLOTS; i++)
        if (m.slot[i])
            lc_guard_free(m.slot[i], m.mapped[i]);
}

const struct lc_check lc_misuse_checks[] = {
    {"misuse", "random calls outside the rules are refused and leave no trace", check_misuse},
    {0},
};
