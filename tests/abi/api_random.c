/*
 * Every cheap criterion through the ABI with random frames within its rules: tilings, planes, strides of either sign, types, scales,
 * normalisers, pixels of any bits, calls in any permitted order. Under ASan what is read beyond a plane or written beyond a decision
 * ends the test. API_RANDOM_CALLS=N makes N calls of evaluate instead of a few; the seed is fixed.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>
#include <math.h>

#include <lull/loader.h>

#include "support/api_folders.h"

enum { MOST_BLOCKS = 12, USUAL_CALLS = 3000 };

static char criteria[2048];
static uint64_t state = 4711;

static uint32_t draw(uint32_t below) /* SplitMix64 */
{
    uint64_t x = state += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return (uint32_t)((x ^ (x >> 31)) >> 32) % below;
}

/* --- planes ---------------------------------------------------------------------------------------------------------------- */

/* A number as renders have them, seldom one that they should not have. */
static double number(void)
{
    static const double odd[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, -1, 1e30, -1e30, 1e-42, 0, 65504, 4294967295.0};
    return draw(40) == 0 ? odd[draw(sizeof odd / sizeof *odd)] : (double)draw(1000) / 500;
}

static void store(char *at, int32_t type)
{
    double d = number();
    float f = (float)d;
    uint32_t u = draw(2) ? draw(1000) : UINT32_MAX - draw(3);
    uint16_t h = (uint16_t)draw(65536);
    memcpy(at, type == LULL_TYPE_F64 ? (void *)&d : type == LULL_TYPE_F16 ? (void *)&h : type == LULL_TYPE_U32 ? (void *)&u : (void *)&f,
           type == LULL_TYPE_F64 ? 8 : type == LULL_TYPE_F16 ? 2 : 4);
}

/* A plane of w by h pixels in memory of exactly its size, in any order of its dimensions and directions. The caller frees. */
static void *random_plane(struct lull_plane *p, unsigned plane, int64_t w, int64_t h, int has_weight)
{
    static const uint32_t channels[LULL_PLANE_COUNT] = {3, 1, 1, 1, 3, 3, 3, 1};
    static const int32_t types[] = {LULL_TYPE_F32, LULL_TYPE_F16, LULL_TYPE_F64, LULL_TYPE_U32};
    static const int order[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    const int32_t normalisers[] = {LULL_NORM_ONE, plane == LULL_PLANE_HALF ? LULL_NORM_HALF_SPP : LULL_NORM_SPP,
                                   has_weight ? LULL_NORM_WEIGHT : LULL_NORM_ONE};
    const int *nest = order[draw(6)];
    int counted = plane == LULL_PLANE_SPP || plane == LULL_PLANE_WEIGHT;
    int32_t type = types[draw(4)];
    int64_t extent[3] = {channels[plane] + draw(2), w, h}, stride[3], size = type == LULL_TYPE_F64 ? 8 : type == LULL_TYPE_F16 ? 2 : 4;
    int64_t bytes = size, offset = 0;
    for (int i = 0; i < 3; i++) {
        stride[nest[i]] = bytes;
        bytes *= extent[nest[i]];
    }
    char *memory = malloc((size_t)bytes);
    assert_non_null(memory);
    for (int64_t at = 0; at < bytes; at += size)
        store(memory + at, type);
    for (int i = 0; i < 3; i++)
        if (i > 0 && draw(3) == 0) {
            offset += stride[i] * (extent[i] - 1);
            stride[i] = -stride[i];
        }
    *p = (struct lull_plane){.data = memory + offset, .stride_c = stride[0], .stride_x = stride[1], .stride_y = stride[2],
                             .scale = draw(2) ? 1 : 0.25, .type = type, .normaliser = counted ? LULL_NORM_ONE : normalisers[draw(3)],
                             .channels = (uint32_t)extent[0]};
    return memory;
}

/* --- a frame ----------------------------------------------------------------------------------------------------------------- */

struct picture {
    struct lull_rect rects[MOST_BLOCKS];
    struct lull_block blocks[MOST_BLOCKS];
    uint32_t count, planes;
    int32_t x0, y0, x1, y1;
};

/* Columns and rows of any width; the view begins anywhere. */
static void random_tiling(struct picture *p)
{
    int32_t columns = 1 + (int32_t)draw(4), rows = 1 + (int32_t)draw(3), width[4], height[3];
    p->x0 = (int32_t)draw(2) * 1000, p->y0 = (int32_t)draw(2) * 77;
    for (int32_t i = 0; i < 4; i++)
        width[i] = 1 + (int32_t)draw(13);
    for (int32_t i = 0; i < 3; i++)
        height[i] = 1 + (int32_t)draw(13);
    p->count = 0;
    p->y1 = p->y0;
    for (int32_t j = 0; j < rows; j++, p->y1 += height[j - 1]) {
        p->x1 = p->x0;
        for (int32_t i = 0; i < columns; i++, p->x1 += width[i - 1])
            p->rects[p->count++] = (struct lull_rect){p->x1, p->y1, p->x1 + width[i], p->y1 + height[j]};
    }
    for (uint32_t i = 0; i < p->count; i++)
        p->blocks[i] = (struct lull_block){.id = i, .x0 = p->rects[i].x0, .y0 = p->rects[i].y0, .x1 = p->rects[i].x1, .y1 = p->rects[i].y1,
                                           .thread_s = (double)NAN};
}

static void check_decision(const char *id, const struct lull_block *b, const struct lull_decision *d)
{
    int good = (d->action == LULL_CONTINUE || d->action == LULL_STOP) && (d->action == LULL_CONTINUE || b->spp > 0) &&
               (d->action == LULL_STOP || d->next_spp == 0 || d->next_spp > b->spp) &&
               (isnan(d->p_noisy) || (d->p_noisy >= 0 && d->p_noisy <= 1)) && (isnan(d->error) || (d->error >= 0 && isfinite(d->error))) &&
               (isnan(d->predicted_spp) || (d->predicted_spp >= 0 && isfinite(d->predicted_spp)));
    if (!good)
        fail_msg("%s: block %u at %llu spp: action %d, next %llu, p %g, error %g, predicted %g", id, b->id, (unsigned long long)b->spp,
                 d->action, (unsigned long long)d->next_spp, d->p_noisy, d->error, d->predicted_spp);
}

/* Some of the blocks, with more samples than before or as many, in arrays of exactly their size. */
static void random_evaluate(const struct lull_criterion *c, struct lull_instance *in, struct picture *p)
{
    void *memory[LULL_PLANE_COUNT] = {0};
    struct lull_plane planes[LULL_PLANE_COUNT] = {{0}};
    struct lull_view view = {.struct_size = sizeof view, .x0 = p->x0, .y0 = p->y0, .x1 = p->x1, .y1 = p->y1, .planes = planes,
                             .plane_count = LULL_PLANE_COUNT, .plane_stride = sizeof *planes, .elapsed_s = (double)NAN};
    uint32_t block_stride = (uint32_t)sizeof(struct lull_block) + 8 * draw(3), count = 1 + draw(p->count), first = draw(p->count);
    uint32_t decision_stride = (uint32_t)sizeof(struct lull_decision) + 8 * draw(3);
    char *blocks = malloc((size_t)count * block_stride), *decisions = malloc((size_t)count * decision_stride);
    assert_true(blocks && decisions);
    for (unsigned k = 0; k < LULL_PLANE_COUNT; k++)
        if (p->planes & LULL_PLANE_BIT(k))
            memory[k] = random_plane(&planes[k], k, p->x1 - p->x0, p->y1 - p->y0, (p->planes & LULL_PLANE_BIT(LULL_PLANE_WEIGHT)) != 0);
    for (uint32_t i = 0; i < count; i++) {
        struct lull_block *b = &p->blocks[(first + i) % p->count];
        struct lull_decision d = {.action = LULL_CONTINUE, .p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
        b->spp += draw(5) == 0 ? 0 : 1 + draw(1u << draw(20));
        b->half_spp = draw(10) == 0 ? draw(2) * b->spp : b->spp / 2;
        memcpy(blocks + (size_t)i * block_stride, b, sizeof *b);
        memcpy(decisions + (size_t)i * decision_stride, &d, sizeof d);
    }
    if (draw(2)) {
        view.all = p->blocks;
        view.all_count = p->count;
        view.all_stride = sizeof *p->blocks;
    }
    struct lull_error err = {.struct_size = sizeof err};
    const void *b = blocks;
    void *d = decisions;
    int32_t status = c->evaluate(in, &view, b, block_stride, d, decision_stride, count, &err);
    if (status != LULL_OK)
        fail_msg("%s: evaluate within the rules: %d, %s", c->id, status, err.message);
    for (uint32_t i = 0; i < count; i++) {
        struct lull_decision got;
        memcpy(&got, decisions + (size_t)i * decision_stride, sizeof got);
        check_decision(c->id, &p->blocks[(first + i) % p->count], &got);
    }
    for (unsigned k = 0; k < LULL_PLANE_COUNT; k++)
        free(memory[k]);
    free(blocks);
    free(decisions);
}

/* An instance, some frames of it, some calls in each; returns the calls. */
static long random_life(const struct lull_criterion *c)
{
    struct lull_instance *in = NULL;
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_requirements need = {.struct_size = sizeof need};
    struct picture p;
    long calls = 0;
    assert_int_equal(c->create(NULL, NULL, 0, sizeof(struct lull_pair), &in, &err), LULL_OK);
    assert_int_equal(c->requirements(in, &need, &err), LULL_OK);
    for (uint32_t frame = 1 + draw(3), open = 0; frame > 0; frame--) {
        random_tiling(&p);
        p.planes = need.planes_required | (draw(256) & ((1u << LULL_PLANE_COUNT) - 1));
        struct lull_frame f = {.struct_size = sizeof f, .flags = open ? LULL_FRAME_RESTART : 0, .width = (uint32_t)p.x1, .height = (uint32_t)p.y1,
                               .blocks = p.rects, .block_count = p.count, .block_stride = sizeof *p.rects, .planes = p.planes,
                               .transfer = draw(2) ? LULL_TRANSFER_SRGB : LULL_TRANSFER_LINEAR, .gamma = 2.2, .exposure = draw(2) ? 1 : 0.3,
                               .spp_min = 1, .spp_max = UINT64_C(1) << 40, .rgb_to_xyz = {0.41, 0.36, 0.18, 0.21, 0.72, 0.07, 0.02, 0.12, 0.95}};
        int32_t status = c->begin_frame(in, &f, &err);
        if (status != LULL_OK)
            fail_msg("%s: begin_frame within the rules: %d, %s", c->id, status, err.message);
        for (uint32_t k = draw(6); k > 0; k--, calls++)
            random_evaluate(c, in, &p);
        open = draw(2);
        if (!open)
            c->end_frame(in);
    }
    c->destroy(in);
    return calls;
}

static void nothing_within_the_rules_breaks_a_criterion(void **unused)
{
    static const char *const names[] = {"null", "fixed", "halfbuf", "variance", "ggn:observer"};
    const char *wanted = getenv("API_RANDOM_CALLS");
    long calls = wanted ? atol(wanted) : USUAL_CALLS;
    (void)unused;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char spec[2200];
        const char *dirs[] = {criteria}, *colon = strchr(names[i], ':');
        struct lull_search search = {.dirs = dirs, .dir_count = 1};
        struct lull_found found;
        struct lull_error err = {.struct_size = sizeof err};
        snprintf(spec, sizeof spec, "%s/%.*s.so%s", criteria, colon ? (int)(colon - names[i]) : (int)strlen(names[i]), names[i], colon ? colon : "");
        if (lull_open(&search, spec, &found, &err) != LULL_OK)
            fail_msg("%s: %s", spec, err.message);
        long done = 0;
        while (done < calls / 5)
            done += random_life(found.criterion);
        print_message("%s: %ld calls\n", found.criterion->id, done);
    }
}

int main(void)
{
    if (api_folder(criteria, sizeof criteria, API_CRITERIA) != 0)
        return 1;
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_within_the_rules_breaks_a_criterion)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
