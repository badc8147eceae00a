/*
 * Every criterion through the ABI with random frames within its rules: parameters, tilings, planes, strides of either sign, types,
 * scales, normalisers, pixels of any bits, tasks in any order on any worker, calls in any permitted order, cancelled ones, states that
 * are saved, damaged and loaded. Under ASan what is read beyond a plane or written beyond a decision ends the test. Calls outside the
 * rules are lull-check's (-o misuse).
 *
 * API_RANDOM_CALLS=N makes N calls of evaluate to each criterion instead of a few, API_RANDOM_CRITERION=ID to this one only. Each
 * criterion begins with API_RANDOM_SEED (4711), so that a long run can be made in pieces, one seed each.
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

enum { MOST_BLOCKS = 12, MOST_PARAMS = 12, MOST_WORKERS = 3, STATE_ROOM = 1 << 20 };

static char criteria[2048];
static uint64_t state;
static int calm;    /* no noise to speak of in this frame, so that those are asked whom a gate spares */
static long judged; /* answers with a probability */

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
    static const double odd[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, -1, 1e30, -1e30, 1e-42, 0,
                                 65504,       4294967295.0};
    if (draw(40) == 0 && !calm)
        return odd[draw(sizeof odd / sizeof *odd)];
    return calm ? 0.5 + 1e-6 * (double)draw(1000) : (double)draw(1000) / 500;
}

static void store(char *at, int32_t type)
{
    double d = number();
    float f = (float)d;
    uint32_t u = draw(2) || calm ? draw(1000) : UINT32_MAX - draw(3);
    uint16_t h = calm ? 0x3800 : (uint16_t)draw(65536);
    memcpy(at,
           type == LULL_TYPE_F64   ? (void *)&d
           : type == LULL_TYPE_F16 ? (void *)&h
           : type == LULL_TYPE_U32 ? (void *)&u
                                   : (void *)&f,
           type == LULL_TYPE_F64   ? 8
           : type == LULL_TYPE_F16 ? 2
                                   : 4);
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
    int32_t type = types[draw(calm ? 3 : 4)];
    int64_t extent[3] = {channels[plane] + draw(2), w, h}, stride[3],
            size = type == LULL_TYPE_F64   ? 8
                   : type == LULL_TYPE_F16 ? 2
                                           : 4;
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
    *p = (struct lull_plane){.data = memory + offset,
                             .stride_c = stride[0],
                             .stride_x = stride[1],
                             .stride_y = stride[2],
                             .scale = draw(2) || calm ? 1 : 0.25,
                             .type = type,
                             .normaliser = counted || calm ? LULL_NORM_ONE : normalisers[draw(3)],
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
        p->blocks[i] = (struct lull_block){.id = i,
                                           .x0 = p->rects[i].x0,
                                           .y0 = p->rects[i].y0,
                                           .x1 = p->rects[i].x1,
                                           .y1 = p->rects[i].y1,
                                           .thread_s = (double)NAN};
}

static void check_decision(const char *id, const struct lull_block *b, const struct lull_decision *d)
{
    int good = (d->action == LULL_CONTINUE || d->action == LULL_STOP) && (d->action == LULL_CONTINUE || b->spp > 0) &&
               (d->action == LULL_STOP || d->next_spp == 0 || d->next_spp > b->spp) &&
               (isnan(d->p_noisy) || (d->p_noisy >= 0 && d->p_noisy <= 1)) &&
               (isnan(d->error) || (d->error >= 0 && isfinite(d->error))) &&
               (isnan(d->predicted_spp) || (d->predicted_spp >= 0 && isfinite(d->predicted_spp)));
    if (!good)
        fail_msg("%s: block %u at %llu spp: action %d, next %llu, p %g, error %g, predicted %g", id, b->id,
                 (unsigned long long)b->spp, d->action, (unsigned long long)d->next_spp, d->p_noisy, d->error,
                 d->predicted_spp);
}

/* One call; what it answers is checked, then it is repeated at times: the same question has the same answer. */
static void call_evaluate(const struct lull_criterion *c, struct lull_instance *in, const struct lull_view *view,
                          const char *blocks, uint32_t block_stride, uint32_t count)
{
    const struct lull_decision preset = {
        .action = LULL_CONTINUE, .p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
    uint32_t stride = (uint32_t)sizeof preset + 8 * draw(3), times = 1 + (draw(4) == 0);
    size_t bytes = (size_t)count * stride;
    char *decisions = calloc(1, bytes + (bytes == 0)), *first = calloc(1, bytes + (bytes == 0));
    assert_true(decisions && first);
    for (uint32_t time = 0; time < times; time++) {
        struct lull_error err = {.struct_size = sizeof err};
        const void *b = blocks;
        void *d = decisions;
        for (uint32_t i = 0; i < count; i++)
            memcpy(decisions + (size_t)i * stride, &preset, sizeof preset);
        int32_t status = c->evaluate(in, view, b, block_stride, d, stride, count, &err);
        if (status == LULL_E_CANCELLED)
            break;
        if (status != LULL_OK)
            fail_msg("%s: evaluate within the rules: %d, %s", c->id, status, err.message);
        for (uint32_t i = 0; i < count; i++) {
            struct lull_decision got;
            struct lull_block block;
            memcpy(&got, decisions + (size_t)i * stride, sizeof got);
            memcpy(&block, blocks + (size_t)i * block_stride, sizeof block);
            check_decision(c->id, &block, &got);
            judged += !isnan(got.p_noisy);
        }
        if (time == 0)
            memcpy(first, decisions, bytes);
        else if (memcmp(first, decisions, bytes) != 0)
            fail_msg("%s: the same question, another answer", c->id);
    }
    free(first);
    free(decisions);
}

/* Some of the blocks, or none, with more samples than before or as many, in arrays of exactly their size. */
static void random_evaluate(const struct lull_criterion *c, struct lull_instance *in, struct picture *p)
{
    void *memory[LULL_PLANE_COUNT] = {0};
    struct lull_plane planes[LULL_PLANE_COUNT] = {{0}};
    struct lull_view view = {.struct_size = sizeof view,
                             .x0 = p->x0,
                             .y0 = p->y0,
                             .x1 = p->x1,
                             .y1 = p->y1,
                             .planes = planes,
                             .plane_count = LULL_PLANE_COUNT,
                             .plane_stride = sizeof *planes,
                             .elapsed_s = (double)NAN};
    uint32_t stride = (uint32_t)sizeof(struct lull_block) + 8 * draw(3), count = draw(50) == 0 ? 0 : 1 + draw(p->count);
    uint32_t first = draw(p->count);
    char *blocks = malloc((size_t)count * stride + (count == 0));
    assert_non_null(blocks);
    for (unsigned k = 0; k < LULL_PLANE_COUNT; k++)
        if (p->planes & LULL_PLANE_BIT(k))
            memory[k] = random_plane(&planes[k], k, p->x1 - p->x0, p->y1 - p->y0,
                                     (p->planes & LULL_PLANE_BIT(LULL_PLANE_WEIGHT)) != 0);
    for (uint32_t i = 0; i < count; i++) {
        struct lull_block *b = &p->blocks[(first + i) % p->count];
        b->spp += draw(5) == 0 ? 0 : draw(3) ? 16 + b->spp / 2 : 1 + draw(1u << draw(20));
        b->half_spp = draw(10) == 0 ? draw(2) * b->spp : b->spp / 2;
        b->flags = draw(20) == 0 ? LULL_BLOCK_FINAL : 0;
        memcpy(blocks + (size_t)i * stride, b, sizeof *b);
    }
    if (draw(2)) {
        view.all = p->blocks;
        view.all_count = p->count;
        view.all_stride = sizeof *p->blocks;
    }
    call_evaluate(c, in, &view, blocks, stride, count);
    for (unsigned k = 0; k < LULL_PLANE_COUNT; k++)
        free(memory[k]);
    free(blocks);
}

/* --- a host ------------------------------------------------------------------------------------------------------------------ */

/* Every task once, from any first one on, each on any worker. */
static int32_t any_order(const struct lull_host *h, uint64_t count, lull_task_fn fn, void *arg)
{
    uint64_t first = count > 0 ? draw((uint32_t)count) : 0;
    for (uint64_t i = 0; i < count; i++)
        fn(arg, (first + i) % count, draw(h->max_workers));
    return LULL_OK;
}

static int32_t seldom(const struct lull_host *h)
{
    (void)h;
    return draw(500) == 0;
}

static const struct lull_host host = {
    .struct_size = sizeof host, .max_workers = MOST_WORKERS, .parallel_for = any_order, .cancelled = seldom};

/* --- parameters -------------------------------------------------------------------------------------------------------------- */

struct choice {
    struct lull_pair pairs[MOST_PARAMS];
    char text[MOST_PARAMS][64];
    uint32_t count;
};

/* Values within the tables of a few parameters; of numbers any magnitude in their range. */
static void random_parameters(const struct lull_criterion *c, struct choice *chosen)
{
    chosen->count = 0;
    for (uint32_t i = 0; i < c->param_count && i < MOST_PARAMS; i++) {
        const struct lull_param *p = (const void *)((const char *)c->params + (size_t)i * c->param_stride);
        char *text = chosen->text[chosen->count];
        double low = fmax(p->min, 1e-6), number = fmin(p->max, low * exp(log(p->max / low) * draw(1000) / 999));
        if (p->type == LULL_PARAM_FILE || p->type == LULL_PARAM_TEXT || draw(3) > 0)
            continue;
        if (p->type == LULL_PARAM_BOOL)
            snprintf(text, 64, "%u", draw(2));
        else if (p->type == LULL_PARAM_CHOICE)
            snprintf(text, 64, "%.*s", (int)strcspn(p->choices, "|"), p->choices);
        else
            snprintf(text, 64, "%.*f", p->type == LULL_PARAM_INT ? 0 : 7, draw(10) == 0 ? p->min : number);
        chosen->pairs[chosen->count++] = (struct lull_pair){p->name, text};
    }
}

static struct lull_instance *create(const struct lull_criterion *c, const struct lull_host *h, const struct choice *chosen)
{
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_instance *in = NULL;
    if (c->create(h, chosen->pairs, chosen->count, sizeof *chosen->pairs, &in, &err) != LULL_OK)
        fail_msg("%s: create within the tables: %s", c->id, err.message);
    return in;
}

static void begin(const struct lull_criterion *c, struct lull_instance *in, const struct lull_frame *f)
{
    struct lull_error err = {.struct_size = sizeof err};
    int32_t status = c->begin_frame(in, f, &err);
    if (status != LULL_OK)
        fail_msg("%s: begin_frame within the rules: %d, %s", c->id, status, err.message);
}

/* --- states ------------------------------------------------------------------------------------------------------------------ */

static unsigned char saved[STATE_ROOM];
static size_t saved_size, saved_read;

static int32_t keep(const struct lull_writer *w, const void *data, uint64_t size)
{
    (void)w;
    assert_true(size <= STATE_ROOM - saved_size);
    memcpy(saved + saved_size, data, size);
    saved_size += size;
    return LULL_OK;
}

static int32_t give(const struct lull_reader *r, void *data, uint64_t size)
{
    (void)r;
    if (size > saved_size - saved_read)
        return LULL_E_IO;
    memcpy(data, saved + saved_read, size);
    saved_read += size;
    return LULL_OK;
}

static void save(const struct lull_criterion *c, const struct lull_state *ext, const struct lull_instance *in)
{
    const struct lull_writer w = {.struct_size = sizeof w, .write = keep};
    struct lull_error err = {.struct_size = sizeof err};
    if (ext->save(in, &w, &err) != LULL_OK)
        fail_msg("%s: save: %s", c->id, err.message);
}

/* Offers the saved state with one wrong byte, perhaps cut; 1: it was refused, and `in` still saves what it loaded before. */
static int refuses_damage(const struct lull_criterion *c, const struct lull_state *ext, struct lull_instance *in)
{
    const struct lull_reader r = {.struct_size = sizeof r, .read = give};
    struct lull_error err = {.struct_size = sizeof err};
    size_t at = draw((uint32_t)saved_size), whole = saved_size;
    unsigned char was = saved[at];
    saved[at] ^= (unsigned char)(1 + draw(255));
    saved_size = draw(2) ? draw((uint32_t)saved_size) : saved_size;
    saved_read = 0;
    int32_t status = ext->load(in, &r, &err);
    saved[at] = was;
    saved_size = whole;
    if (status == LULL_OK)
        return 0;
    assert_true(status == LULL_E_IO && err.message[0] != '\0');
    save(c, ext, in);
    if (saved_size != 2 * whole || memcmp(saved, saved + whole, whole) != 0)
        fail_msg("%s: a state that was refused left its trace", c->id);
    return 1;
}

/* The instance's state in a new one, which takes its place unless it was talked into a damaged one. */
static struct lull_instance *move_state(const struct lull_criterion *c, struct lull_instance *in, const struct lull_host *h,
                                        const struct choice *chosen, const struct lull_frame *frame)
{
    const struct lull_state *ext = c->get_extension(LULL_EXT_STATE);
    const struct lull_reader r = {.struct_size = sizeof r, .read = give};
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_frame f = *frame;
    if (!ext)
        return in;
    saved_size = saved_read = 0;
    save(c, ext, in);
    f.flags &= ~LULL_FRAME_RESTART;
    struct lull_instance *to = create(c, h, chosen);
    begin(c, to, &f);
    if (ext->load(to, &r, &err) != LULL_OK)
        fail_msg("%s: load of what was saved: %s", c->id, err.message);
    if (saved_size > 0 && draw(2) && !refuses_damage(c, ext, to)) {
        c->destroy(to);
        return in;
    }
    c->destroy(in);
    return to;
}

/* --- lives ------------------------------------------------------------------------------------------------------------------- */

/* An instance, some frames of it, some calls in each; returns the calls. */
static long random_life(const struct lull_criterion *c)
{
    const struct lull_host *h = draw(2) ? &host : NULL;
    struct choice chosen = {.count = 0};
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_requirements need = {.struct_size = sizeof need};
    struct picture p;
    long calls = 0;
    if (draw(2))
        random_parameters(c, &chosen);
    struct lull_instance *in = create(c, h, &chosen);
    assert_int_equal(c->requirements(in, &need, &err), LULL_OK);
    for (uint32_t frame = 1 + draw(3), open = 0; frame > 0; frame--) {
        random_tiling(&p);
        p.planes = need.planes_required | (draw(256) & ((1u << LULL_PLANE_COUNT) - 1));
        struct lull_frame f = {.struct_size = sizeof f,
                               .flags = (open ? LULL_FRAME_RESTART : 0) | (draw(8) & ~LULL_FRAME_RESTART),
                               .width = (uint32_t)p.x1,
                               .height = (uint32_t)p.y1,
                               .blocks = p.rects,
                               .block_count = p.count,
                               .block_stride = sizeof *p.rects,
                               .planes = p.planes,
                               .transfer = (int32_t)draw(4),
                               .gamma = 2.2,
                               .exposure = draw(2) ? 1 : 0.3,
                               .sample_clamp = draw(2) * 10,
                               .spp_min = 1,
                               .spp_max = UINT64_C(1) << 40,
                               .rgb_to_xyz = {0.41, 0.36, 0.18, 0.21, 0.72, 0.07, 0.02, 0.12, 0.95}};
        begin(c, in, &f);
        calm = draw(3) == 0;
        for (uint32_t k = draw(draw(4) ? 6 : 20); k > 0; k--, calls++) {
            random_evaluate(c, in, &p);
            if (draw(8) == 0)
                in = move_state(c, in, h, &chosen, &f);
        }
        open = draw(2);
        if (!open)
            c->end_frame(in);
    }
    c->destroy(in);
    return calls;
}

/* What make test spends on each: a call that asks a network costs as much as thousands of others. */
static const struct {
    const char *library, *id;
    long usual_calls;
} shipped[] = {
    {"null", "null", 600},           {"fixed", "fixed", 600},         {"halfbuf", "halfbuf", 600},
    {"variance", "variance", 600},   {"observer", "observer", 600},   {"ggn", "ggn", 120},
    {"baselines", "attributes", 30}, {"baselines", "noise-mask", 30}, /* svd-entropy has no model yet */
    {"denoised", "denoised", 100},                                    /* with the denoiser of tests/stub */
};

static void nothing_within_the_rules_breaks_a_criterion(void **unused)
{
    const char *wanted = getenv("API_RANDOM_CALLS"), *only = getenv("API_RANDOM_CRITERION"),
               *seed = getenv("API_RANDOM_SEED");
    long all = 0;
    (void)unused;
    for (size_t i = 0; i < sizeof shipped / sizeof *shipped; i++) {
        long calls = wanted ? atol(wanted) : shipped[i].usual_calls, done = 0;
        char spec[2200];
        const char *dirs[] = {criteria};
        struct lull_search search = {.dirs = dirs, .dir_count = 1};
        struct lull_found found;
        struct lull_error err = {.struct_size = sizeof err};
        if (only && strcmp(only, shipped[i].id) != 0)
            continue;
        snprintf(spec, sizeof spec, "%s/%s.so:%s", criteria, shipped[i].library, shipped[i].id);
        if (lull_open(&search, spec, &found, &err) != LULL_OK)
            fail_msg("%s: %s", spec, err.message);
        judged = 0;
        for (state = seed ? strtoull(seed, NULL, 10) : 4711; done < calls;)
            done += random_life(found.criterion);
        print_message("%s: %ld calls, %ld probabilities\n", found.criterion->id, done, judged);
        all += done;
    }
    assert_true(all > 0); /* an id that is not shipped */
}

int main(void)
{
    char stub[2048];
    if (api_folder(criteria, sizeof criteria, API_CRITERIA) != 0 || api_folder(stub, sizeof stub, "../oidn-stub") != 0)
        return 1;
    setenv("LULL_OIDN", stub, 1);
    const struct CMUnitTest tests[] = {cmocka_unit_test(nothing_within_the_rules_breaks_a_criterion)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
