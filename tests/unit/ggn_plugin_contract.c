/*
 * The criteria of ggn as their tables say, and their answers against the parts that they are made of (judge, reader of a baseline,
 * visibility) asked directly under the one stopping rule: several blocks of several sizes, batches, failed calls, saved and damaged
 * states, a second frame, other displays.
 */
#include "support/ggn_cmocka.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cjson/cJSON.h>
#include <lull/criterion.h>

#include "base/colour.h"
#include "baselines/baseline.h"
#include "model/inference.h"
#include "model/stopper.h"
#include "model/window.h"
#include "nn/hash.h"
#include "observer/observer.h"
#include "model/visibility.h"
#include "plugin/criteria.h"
#include "plugin/model_path.h"
#include "plugin/windowed.h"
#include "sequence/tail.h"
#include "support/approve.h"
#include "support/ggn_heap.h"

enum { WIDTH = 60, HEIGHT = 44, BLOCKS = 3, WINDOW = 2, VALUES = 3 * 24 * 30 };
static const struct lull_rect rects[BLOCKS] = {{1, 2, 22, 20}, {30, 0, 60, 24}, {5, 25, 22, 44}};

static char network[] = "/tmp/ggn_contract_net.XXXXXX", attributes[] = "/tmp/ggn_contract_svm.XXXXXX";
static struct ggn_model *model;
static struct ggn_baseline svm;
static struct ggn_policy policy;

/* --- the picture ----------------------------------------------------------------------------------------------------------------------- */

static float color[HEIGHT][WIDTH][3], half[HEIGHT][WIDTH][3];

/* What `spp` samples give; a little less than half of them are in HALF. Noise differs from block to block. */
static void render(uint64_t spp)
{
    for (uint32_t i = 0; i < HEIGHT * WIDTH; i++)
        for (uint32_t c = 0; c < 3; c++) {
            const double clean = 0.2 + 0.15 * sin(0.2 * (i % WIDTH)) + 0.1 * c, sigma = i % WIDTH > 28 ? 0.7 : 0.1;
            const double n = (double)spp, h = (double)(spp * 3 / 8), a = ggn_hash_unit(3 * i + c, (uint32_t)spp) - 0.5,
                         b = ggn_hash_unit(3 * i + c, (uint32_t)spp + 9999) - 0.5;
            const double first = clean + sigma * a / sqrt(h), second = clean + sigma * b / sqrt(n - h);
            half[i / WIDTH][i % WIDTH][c] = (float)first;
            color[i / WIDTH][i % WIDTH][c] = (float)((h * first + (n - h) * second) / n);
        }
}

static double luminance(const float rgb[3]) { return 0.2 * (double)rgb[0] + 0.7 * (double)rgb[1] + 0.1 * (double)rgb[2]; }

/* --- host ------------------------------------------------------------------------------------------------------------------------------ */

static struct lull_frame frame_of(uint32_t planes, const struct ggn_display *display, uint64_t spp_max)
{
    static const int32_t transfers[] = {LULL_TRANSFER_SRGB, LULL_TRANSFER_LINEAR, LULL_TRANSFER_GAMMA};

    return (struct lull_frame){.struct_size = sizeof(struct lull_frame),
                               .width = WIDTH,
                               .height = HEIGHT,
                               .blocks = rects,
                               .block_count = BLOCKS,
                               .block_stride = sizeof rects[0],
                               .planes = planes,
                               .exposure = display->exposure,
                               .transfer = transfers[display->transfer == GGN_TRANSFER_LINEAR  ? 1
                                                     : display->transfer == GGN_TRANSFER_GAMMA ? 2
                                                                                               : 0],
                               .gamma = display->gamma,
                               .spp_max = spp_max,
                               .rgb_to_xyz = {0, 0, 0, 0.2, 0.7, 0.1, 0, 0, 0}};
}

static const struct ggn_display usual = {GGN_TRANSFER_SRGB, 2.2, 1};

/* Last task first, each on another worker: with as many as the host has, where it has several. */
static int32_t last_first(const struct lull_host *host, uint64_t count, lull_task_fn fn, void *arg)
{
    for (uint64_t task = count; task-- > 0;)
        fn(arg, task, (uint32_t)(task * 7 % host->max_workers));
    return LULL_OK;
}

static struct lull_instance *created(const struct lull_criterion *c, const char *path, const char *key, const char *value)
{
    static const struct lull_host hosts[] = {{.struct_size = sizeof hosts[0], .max_workers = 1},
                                             {.struct_size = sizeof hosts[0], .max_workers = 3, .parallel_for = last_first}};
    static int next;
    const struct lull_pair pairs[] = {{path ? "model" : key, path ? path : value}, {key, value}};
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_instance *in = NULL;

    if (c->create(&hosts[next++ % 2], pairs, (uint32_t)((path != NULL) + (key != NULL)), sizeof pairs[0], &in, &err) !=
        LULL_OK)
        fail_msg("%s", err.message);
    return in;
}

static int32_t evaluate(const struct lull_criterion *c, struct lull_instance *in, uint64_t spp, uint32_t ids,
                        struct lull_decision *d)
{
    struct lull_plane planes[LULL_PLANE_COUNT] = {
        [LULL_PLANE_COLOR] = {color, 12, 12 * WIDTH, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0},
        [LULL_PLANE_HALF] = {half, 12, 12 * WIDTH, 4, 1, LULL_TYPE_F32, LULL_NORM_ONE, 3, 0}};
    const struct lull_view view = {.struct_size = sizeof view,
                                   .x1 = WIDTH,
                                   .y1 = HEIGHT,
                                   .planes = planes,
                                   .plane_count = LULL_PLANE_COUNT,
                                   .plane_stride = sizeof planes[0],
                                   .elapsed_s = (double)NAN};
    struct lull_block blocks[BLOCKS];
    struct lull_error err = {.struct_size = sizeof err};
    uint32_t n = 0;

    for (uint32_t id = 0; id < BLOCKS; id++)
        if (ids >> id & 1)
            blocks[n++] = (struct lull_block){.id = id,
                                              .x0 = rects[id].x0,
                                              .y0 = rects[id].y0,
                                              .x1 = rects[id].x1,
                                              .y1 = rects[id].y1,
                                              .spp = spp,
                                              .half_spp = spp * 3 / 8,
                                              .thread_s = (double)NAN};
    for (uint32_t i = 0; i < n; i++)
        d[i] = (struct lull_decision){.p_noisy = (double)NAN, .predicted_spp = (double)NAN, .error = (double)NAN};
    if (n && spp == UINT64_MAX)
        blocks[n - 1].x1--;
    return c->evaluate(in, &view, blocks, sizeof blocks[0], d, sizeof d[0], n, &err);
}

/* --- the same from its parts ----------------------------------------------------------------------------------------------------------- */

/* One block's history, and what the rule sees of it. */
struct other {
    struct ggn_stop_rule rule;
    struct ggn_stopper stopper;
    struct ggn_display display;
    const struct lull_rect *r;
    int is_network, images;
    uint8_t codes[GGN_WINDOW_MAX][VALUES];
};

static int across(const struct other *o) { return o->r->x1 - o->r->x0; }

static int down(const struct other *o) { return o->r->y1 - o->r->y0; }

static double other_noise(void *data)
{
    const struct other *o = data;
    const struct ggn_stopper *s = &o->stopper;

    return o->is_network ? ggn_window_noise(o->codes[0], o->codes[o->images - 1], (size_t)(3 * across(o) * down(o)),
                                            (double)s->spp[0], (double)s->spp[s->used - 1])
                         : (double)NAN;
}

static double other_logit(void *data)
{
    const struct other *o = data;
    double logit, look[128 * 4];

    if (!o->is_network) {
        struct ggn_baseline_reader *r = ggn_baseline_reader_create(&svm, NULL);
        const double *looks[] = {look};
        ggn_baseline_extract(r, o->codes[o->images - 1], across(o), down(o), look);
        logit = ggn_baseline_logit(r, looks, across(o), down(o));
        ggn_baseline_reader_destroy(r);
        return logit;
    }
    static uint16_t denoised[WINDOW][VALUES];
    const uint8_t *n[WINDOW];
    const uint16_t *d[WINDOW];
    struct ggn_inference *j = ggn_inference_create(model, GGN_PRECISION_F32, NULL, NULL);
    for (int i = 0; i < WINDOW; i++) {
        n[i] = o->codes[i];
        d[i] = denoised[i];
        ggn_inference_denoise(j, n[i], denoised[i], across(o), down(o));
    }
    logit = ggn_inference_logit(j, n, d, NULL, NULL, across(o), down(o));
    ggn_inference_destroy(j);
    return logit;
}

/* |half − mean| · √(h/(n − h)) of the luminance, over the mean luminance. */
static int other_tail(void *data, double *tail999, double *gini)
{
    const struct other *o = data;
    double noise[VALUES], sum = 0, h = floor((double)o->stopper.asked_spp * 3 / 8), n = (double)o->stopper.asked_spp;
    size_t count = 0;

    if (!o->is_network)
        return 0;
    for (int y = o->r->y0; y < o->r->y1; y++)
        for (int x = o->r->x0; x < o->r->x1; x++) {
            sum += luminance(color[y][x]);
            noise[count++] = fabs(sqrt(h / (n - h)) * (luminance(half[y][x]) - luminance(color[y][x])));
        }
    struct seq_tail tail = seq_tail_of(noise, count, sum / (double)count);
    *tail999 = tail.tail999;
    *gini = tail.gini;
    return 1;
}

static void other_ask(struct other *o, uint64_t spp)
{
    const struct ggn_evidence evidence = {o, other_noise, other_logit, other_tail, NULL};

    if (!ggn_stopper_ask(&o->rule, &o->stopper, spp))
        return;
    if (o->images == o->rule.window)
        memmove(o->codes[0], o->codes[1], (size_t)--o->images * sizeof o->codes[0]);
    uint8_t *to = o->codes[o->images++];
    for (int c = 0; c < 3; c++)
        for (int y = o->r->y0; y < o->r->y1; y++)
            for (int x = o->r->x0; x < o->r->x1; x++)
                *to++ = ggn_preprocess((double)color[y][x][c], &o->display, NULL);
    ggn_stopper_decide(&o->rule, &o->stopper, &evidence);
}

static int same_number(double a, double b) { return isnan(a) ? isnan(b) : fabs(a - b) <= 1e-9 * fmax(1, fabs(b)); }

static void same(const struct lull_decision *d, const struct ggn_verdict *v, uint32_t id, uint64_t spp)
{
    if (d->action != (v->stop ? LULL_STOP : LULL_CONTINUE) || d->flags != (v->too_early ? LULL_DECISION_TOO_EARLY : 0) ||
        d->next_spp != v->next_spp || !same_number(d->p_noisy, v->p) || !same_number(d->predicted_spp, v->predicted_spp) ||
        !same_number(d->error, v->noise))
        fail_msg("block %u at %llu: action %d flags %u next %llu p %g predicted %g error %g, not %u %u %llu %g %g %g", id,
                 (unsigned long long)spp, d->action, d->flags, (unsigned long long)d->next_spp, d->p_noisy, d->predicted_spp,
                 d->error, v->stop, v->too_early, (unsigned long long)v->next_spp, v->p, v->predicted_spp, v->noise);
}

/* --- state ----------------------------------------------------------------------------------------------------------------------------- */

enum { ROOM = 100000 };
static unsigned char saved[ROOM];
static size_t saved_size, read_at;

static int32_t write_bytes(const struct lull_writer *writer, const void *data, uint64_t size)
{
    (void)writer;
    if (saved_size + size > ROOM)
        return LULL_E_IO;
    memcpy(saved + saved_size, data, size);
    saved_size += size;
    return LULL_OK;
}

static int32_t read_bytes(const struct lull_reader *reader, void *data, uint64_t size)
{
    (void)reader;
    if (read_at + size > saved_size)
        return LULL_E_IO;
    memcpy(data, saved + read_at, size);
    read_at += size;
    return LULL_OK;
}

static const struct lull_writer writer = {.struct_size = sizeof writer, .write = write_bytes};
static const struct lull_reader reader = {.struct_size = sizeof reader, .read = read_bytes};

static void save(const struct lull_criterion *c, const struct lull_instance *in)
{
    const struct lull_state *state = c->get_extension(LULL_EXT_STATE);

    saved_size = 0;
    assert_int_equal(state->save(in, &writer, NULL), LULL_OK);
}

/* What loading says; "" where it works. */
static const char *load(const struct lull_criterion *c, struct lull_instance *in)
{
    static struct lull_error err;
    const struct lull_state *state = c->get_extension(LULL_EXT_STATE);

    err = (struct lull_error){.struct_size = sizeof err};
    read_at = 0;
    int32_t status = state->load(in, &reader, &err);
    assert_true(status == LULL_OK || status == LULL_E_IO);
    return status ? err.message : "";
}

/* --- tests ----------------------------------------------------------------------------------------------------------------------------- */

/* All levels of all blocks; every second batch in another order of calls, a failed call and a repeated one between. */
static void follow(const struct lull_criterion *c, const char *path, int is_network, const struct ggn_display *display,
                   uint64_t spp_max, const struct ggn_policy *p)
{
    static struct other others[BLOCKS];
    struct lull_instance *in = created(c, path, NULL, NULL), *other = created(c, path, NULL, NULL);
    struct lull_frame frame = frame_of(0xff, display, spp_max);
    int stopped = 0, early = 0;

    for (int second = 0; second < 2; second++) { /* a frame that begins anew knows nothing */
        assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
        frame.flags = 0;
        if (second)
            c->end_frame(other);
        assert_int_equal(c->begin_frame(other, &frame, NULL), LULL_OK);
        frame.flags = LULL_FRAME_RESTART;
        for (int id = 0; id < BLOCKS; id++)
            others[id] = (struct other){.rule = {.policy = *p, .window = is_network ? WINDOW : 1, .spp_max = spp_max},
                                        .display = *display,
                                        .r = &rects[id],
                                        .is_network = is_network};
        static const uint64_t levels[] = {4, 8, 9, 16, 16, 32, 40, 64, 128, 256, 512, 1024};
        for (size_t k = 0; k < sizeof levels / sizeof levels[0]; k++) {
            struct lull_decision d[BLOCKS], twice[BLOCKS];
            const uint32_t ids = k % 3 == 1 ? 5 : 7;
            render(levels[k]);
            if (k % 2) /* none of the frame's blocks: nothing of the call may stay */
                assert_int_equal(evaluate(c, in, UINT64_MAX, 7, d), LULL_E_INVALID);
            if (k == 5 && second) { /* another instance goes on from here */
                save(c, in);
                assert_string_equal(load(c, other), "");
                struct lull_instance *swap = in;
                in = other;
                other = swap;
            }
            assert_int_equal(evaluate(c, in, levels[k], ids, d), LULL_OK);
            assert_int_equal(evaluate(c, in, levels[k], ids, twice), LULL_OK);
            assert_memory_equal(d, twice, sizeof d[0] * (ids == 7 ? 3 : 2));
            for (uint32_t id = 0, n = 0; id < BLOCKS; id++)
                if (ids >> id & 1) {
                    other_ask(&others[id], levels[k]);
                    stopped += d[n].action == LULL_STOP;
                    early += d[n].flags != 0;
                    same(&d[n++], &others[id].stopper.verdict, id, levels[k]);
                    /* an image is denoised once, when the network is first asked about it */
                    uint32_t made = 0;
                    for (int i = 0; is_network && i < WINDOW && !isnan(others[id].stopper.verdict.p); i++)
                        made |= UINT32_C(1) << in->history.head[id].order[i];
                    assert_int_equal(in->history.head[id].made & made, made);
                }
            assert_int_equal(evaluate(c, in, levels[k] - 1, 1, d), LULL_E_INVALID); /* fewer samples than before */
        }
    }
    assert_true(stopped > 0 && early > 0);
    c->destroy(in);
    c->destroy(other);
}

static void answers_of_the_network(void **state)
{
    static const struct ggn_display displays[] = {
        {GGN_TRANSFER_SRGB, 2.2, 1}, {GGN_TRANSFER_GAMMA, 1.8, 2}, {GGN_TRANSFER_LINEAR, 2.2, 0.5}};
    size_t used = 0;
    (void)state;

    for (int i = 0; i < 4; i++) {
        follow(&ggn_plugin_ggn, network, 1, &displays[i % 3], i % 2 ? 200 : 0, &policy);
        used = i == 2 ? ggn_heap_used() : used;
    }
    assert_in_range(ggn_heap_used() - used + 20000, 0, 40000); /* what is destroyed is gone */
}

static void answers_of_a_baseline(void **state)
{
    (void)state;
    follow(&ggn_plugin_attributes, attributes, 0, &usual, 0, &svm.policy);
}

/* What is saved: a header, then of each block its place, its head and the kept bytes; no other criterion's, model's or setting's. */
static void states(void **state)
{
    static const char *const settings[][2] = {{"visible", "0.4"}, {"passes", "2"},    {"gate", "0"},         {"tail", "3"},
                                              {"gini", "0.7"},    {"first-spp", "9"}, {"precision", "bf16"}, {NULL, NULL}};
    static const char foreign[] = "state: saved by another criterion, model, parameter set or frame";
    const struct lull_criterion *c = &ggn_plugin_ggn;
    const struct lull_frame frame = frame_of(0xff, &usual, 0);
    struct lull_instance *in = created(c, network, NULL, NULL),
                         *svms = created(&ggn_plugin_attributes, attributes, NULL, NULL);
    struct lull_decision d[BLOCKS];
    const size_t head = sizeof(struct ggn_stopper) + (GGN_WINDOW_MAX + 1) * 4 + 12;
    size_t want = 24;
    (void)state;

    assert_null(c->get_extension("lull.other/1"));
    assert_null(c->get_extension(NULL));
    const struct lull_state *extension = c->get_extension(LULL_EXT_STATE);
    struct lull_error err = {.struct_size = sizeof err};
    assert_int_equal(extension->save(in, &writer, &err), LULL_E_STATE);
    assert_string_equal(err.message, "save: no frame is open");
    assert_int_equal(extension->load(in, &reader, &err), LULL_E_STATE);
    assert_string_equal(err.message, "load: no frame is open");
    assert_int_equal(extension->save(NULL, &writer, &err), LULL_E_INVALID);
    assert_string_equal(err.message, "save: an argument is missing");
    assert_int_equal(extension->load(in, NULL, &err), LULL_E_INVALID);
    assert_string_equal(err.message, "load: an argument is missing");
    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    assert_int_equal(ggn_plugin_attributes.begin_frame(svms, &frame, NULL), LULL_OK);
    for (uint64_t spp = 8; spp <= 16; spp *= 2) {
        render(spp);
        assert_int_equal(evaluate(c, in, spp, spp == 8 ? 3 : 1, d), LULL_OK);
    }
    save(c, in);
    for (int id = 0; id < BLOCKS; id++)
        want +=
            sizeof rects[0] + head +
            (size_t)(id == 0 ? 2 : id == 1) * (size_t)(3 * (rects[id].x1 - rects[id].x0) * (rects[id].y1 - rects[id].y0));
    assert_int_equal(saved_size, want);
    assert_memory_equal(saved, "GGNSTAT3", 8);
    const uint32_t numbers[] = {BLOCKS, WINDOW, (uint32_t)head};
    assert_memory_equal(saved + 12, numbers, sizeof numbers);
    assert_memory_equal(saved + 24, &rects[0], sizeof rects[0]);
    assert_string_equal(load(&ggn_plugin_attributes, svms), foreign);
    for (int i = 0; settings[i][0]; i++) {
        struct lull_instance *set = created(c, network, settings[i][0], settings[i][1]);
        assert_int_equal(c->begin_frame(set, &frame, NULL), LULL_OK);
        assert_string_equal(load(c, set), foreign);
        c->destroy(set);
    }
    /* damaged in every word of the first head, or cut anywhere: a line, and the instance answers as before */
    for (size_t at = 24 + sizeof rects[0]; at < 24 + sizeof rects[0] + head; at += 4) {
        unsigned char keep[4];
        memcpy(keep, saved + at, 4);
        memset(saved + at, 0xff, 4);
        const char *said = load(c, in);
        if (*said)
            assert_string_equal(said, "state: block 0 does not fit the frame");
        memcpy(saved + at, keep, 4);
        assert_string_equal(load(c, in), "");
    }
    saved[24]++;
    assert_string_equal(load(c, in), "state: block 0 does not fit the frame");
    saved[24]--;
    const size_t whole = saved_size;
    for (saved_size = 0; saved_size < whole; saved_size += 1 + saved_size / 3) {
        char line[64] = "state: it ends early";
        const size_t first = 24 + sizeof rects[0] + head + 2 * (size_t)(3 * 21 * 18);
        if (saved_size >= 24)
            snprintf(line, sizeof line, "state: it ends early, at block %d", saved_size >= first);
        const char *said = load(c, in);
        if (saved_size < first + sizeof rects[0] + head + 3 * 30 * 24)
            assert_string_equal(said, line);
        else
            assert_string_equal(said, "state: it ends early, at block 2");
    }
    saved_size = whole;
    assert_string_equal(load(c, in), "");
    c->destroy(in);
    ggn_plugin_attributes.destroy(svms);
}

/* Which of order's and the head's words make a state impossible. */
static void impossible_heads(void **state)
{
    const struct lull_criterion *c = &ggn_plugin_ggn;
    const struct lull_frame frame = frame_of(0xff, &usual, 0);
    struct lull_instance *in = created(c, network, NULL, NULL);
    struct lull_decision d[BLOCKS];
    const size_t order = 24 + sizeof rects[0] + sizeof(struct ggn_stopper), made = order + (GGN_WINDOW_MAX + 1) * 4,
                 bad = made + 4;
    static const uint32_t cases[][3] = {{0, 3, 0}, {4, 0, 0}, {8, 3, 0}, {8, 2, 1}, {12, 7, 1}};
    (void)state;

    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    render(8);
    assert_int_equal(evaluate(c, in, 8, 7, d), LULL_OK);
    save(c, in);
    const uint32_t first[] = {0, 1, 2};
    assert_memory_equal(saved + order, first, sizeof first);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        uint32_t keep;
        memcpy(&keep, saved + order + cases[i][0], 4);
        memcpy(saved + order + cases[i][0], &cases[i][1], 4);
        assert_string_equal(load(c, in), cases[i][2] ? "" : "state: block 0 does not fit the frame");
        memcpy(saved + order + cases[i][0], &keep, 4);
    }
    saved[made] = 1; /* what can be made again is never said to be there */
    assert_string_equal(load(c, in), "state: block 0 does not fit the frame");
    saved[made] = 0;
    saved[bad] = 1;
    assert_string_equal(load(c, in), "");
    saved[bad] = 2;
    assert_string_equal(load(c, in), "state: block 0 does not fit the frame");
    c->destroy(in);
}

/* Values that are none: the block is flagged until it has been seen without. */
static void broken_pixels(void **state)
{
    const struct lull_criterion *c = &ggn_plugin_ggn;
    const struct lull_frame frame = frame_of(0xff, &usual, 0);
    struct lull_instance *in = created(c, network, NULL, NULL);
    struct lull_decision d[BLOCKS];
    (void)state;

    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    render(8);
    color[3][2][1] = NAN;
    color[30][6][0] = INFINITY;
    color[5][40][2] = -3; /* less than no light is no broken value */
    assert_int_equal(evaluate(c, in, 8, 7, d), LULL_OK);
    assert_int_equal(d[0].flags, LULL_DECISION_TOO_EARLY | LULL_DECISION_BAD_INPUT);
    assert_int_equal(d[1].flags, LULL_DECISION_TOO_EARLY);
    assert_int_equal(d[2].flags, LULL_DECISION_TOO_EARLY | LULL_DECISION_BAD_INPUT);
    render(16);
    assert_int_equal(evaluate(c, in, 16, 7, d), LULL_OK);
    assert_int_equal(d[0].flags | d[2].flags, 0);
    c->destroy(in);
}

/* Error of the block whose two pictures of light, [3][P] each, differ by noise of 2 / split times the mean's. */
static double error_by_hand(const struct lull_rect *r, float light[2][VALUES], double split)
{
    const int w = r->x1 - r->x0, height = r->y1 - r->y0, pixels = w * height;
    static float l[2][VALUES];
    static double scratch[5 * 64];
    double texture; /* the block is one patch */

    for (int side = 0; side < 2; side++)
        ggn_visible_lightness(light[side], (size_t)pixels, l[side]);
    ggn_visible_texture(l[0], l[1], w, height, scratch, &texture);
    for (int i = 0; i < pixels; i++)
        l[0][i] = (float)split * (l[0][i] - l[1][i]);
    return (1 + 1.94 / sqrt(pixels)) * ggn_visible_noise(l[0], w, height, &texture, scratch, NULL) /
           ggn_observer_default.level;
}

/* Every answer of the observer by the formulas of its header, for halves that are unequal. */
static void answers_of_the_observer(void **state)
{
    static const struct ggn_display displays[] = {
        {GGN_TRANSFER_SRGB, 2.2, 1}, {GGN_TRANSFER_GAMMA, 1.8, 2}, {GGN_TRANSFER_LINEAR, 2.2, 0.5}};
    const struct lull_criterion *c = &ggn_plugin_observer;
    const double stop = ggn_observer_error_at(&ggn_observer_default, GGN_OBSERVER_VISIBLE);
    int stopped = 0, went_on = 0;
    (void)state;

    for (int k = 0; k < 3; k++) {
        const struct lull_frame frame = frame_of(0xff, &displays[k], 0);
        struct lull_instance *in = created(c, NULL, NULL, NULL);
        assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
        for (uint64_t spp = 16; spp <= 4096; spp *= 16) {
            struct lull_decision d[BLOCKS];
            const double n = (double)spp, h = floor(n * 3 / 8);
            render(spp);
            assert_int_equal(evaluate(c, in, spp, 7, d), LULL_OK);
            for (int id = 0; id < BLOCKS; id++) {
                const struct lull_rect *r = &rects[id];
                const int w = r->x1 - r->x0, height = r->y1 - r->y0, pixels = w * height;
                static float light[2][VALUES];
                for (int i = 0; i < 3 * pixels; i++) {
                    const int y = r->y0 + i % pixels / w, x = r->x0 + i % w;
                    double a = (double)half[y][x][i / pixels], b = (n * (double)color[y][x][i / pixels] - h * a) / (n - h);
                    for (int side = 0; side < 2; side++) {
                        double v = fmin(fmax(displays[k].exposure * (side ? b : a), 0), 1);
                        v = k == 1 ? pow(v, 1 / 1.8) : v;
                        light[side][i] = (float)(k ? base_srgb_eotf(v) : v);
                    }
                }
                const double error = error_by_hand(r, light, sqrt(h * (n - h)) / n);
                assert_true(fabs(d[id].error / error - 1) < 1e-6 && d[id].flags == 0);
                assert_true(fabs(d[id].p_noisy - 0.5 * erfc(-2 * log2(error) / (ggn_observer_default.spread * sqrt(2)))) <
                            1e-6);
                assert_int_equal(d[id].action, error <= stop ? LULL_STOP : LULL_CONTINUE);
                double predicted = error <= stop ? n : n * (error / stop) * (error / stop);
                assert_true(fabs(d[id].predicted_spp / predicted - 1) < 1e-5);
                if (error > stop)
                    assert_true(d[id].next_spp == (uint64_t)ceil(fmin(fmax(d[id].predicted_spp, 1.04 * n), 1.5 * n)));
                stopped += error <= stop;
                went_on += error > stop;
            }
        }
        c->end_frame(in);
        c->end_frame(in);
        c->destroy(in);
    }
    assert_true(stopped > 3 && went_on > 3);
    c->destroy(NULL);
    c->end_frame(NULL);
}

/* Without HALF: each answer from the mean and the look that the header of plugin/means.h names, asked twice, and after a call
 * that failed. */
static void answers_from_means(void **state)
{
    static const uint64_t spp[] = {8, 16, 24, 40, 100, 101, 4096}, base[] = {0, 0, 16, 16, 40, 40, 100};
    enum { COUNT = sizeof spp / sizeof spp[0] };
    static float looks[COUNT][HEIGHT][WIDTH][3], light[2][VALUES];
    const struct lull_criterion *c = &ggn_plugin_observer;
    const struct lull_frame frame = frame_of(LULL_PLANE_BIT(LULL_PLANE_COLOR), &usual, 0);
    struct lull_instance *in = created(c, NULL, NULL, NULL);
    (void)state;

    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    for (int k = 0; k < COUNT; k++) {
        struct lull_decision d[BLOCKS], again[BLOCKS];
        int of = 0;
        render(spp[k]);
        memcpy(looks[k], color, sizeof color);
        while (spp[of] < base[k])
            of++;
        assert_int_equal(evaluate(c, in, UINT64_MAX, 7, d), LULL_E_INVALID);
        assert_int_equal(evaluate(c, in, spp[k], 7, d), LULL_OK);
        assert_int_equal(evaluate(c, in, spp[k], 7, again), LULL_OK);
        assert_memory_equal(d, again, sizeof d);
        for (int id = 0; id < BLOCKS; id++) {
            const struct lull_rect *r = &rects[id];
            const int w = r->x1 - r->x0, pixels = w * (r->y1 - r->y0);
            const double scale = sqrt((double)base[k] / (double)(spp[k] - base[k]));
            if (!base[k]) {
                assert_true(d[id].action == LULL_CONTINUE && (d[id].flags & LULL_DECISION_TOO_EARLY) && isnan(d[id].error));
                continue;
            }
            for (int i = 0; i < 3 * pixels; i++) {
                const int y = r->y0 + i % pixels / w, x = r->x0 + i % w, ch = i / pixels;
                const double m = (double)color[y][x][ch], noise = scale * (m - (double)looks[of][y][x][ch]);
                light[0][i] = (float)fmin(fmax(m + noise, 0), 1);
                light[1][i] = (float)fmin(fmax(m - noise, 0), 1);
            }
            const double error = error_by_hand(r, light, 0.5);
            assert_true(fabs(d[id].error / error - 1) < 1e-5 && d[id].flags == 0);
            assert_int_equal(d[id].action, error <= ggn_observer_error_at(&ggn_observer_default, GGN_OBSERVER_VISIBLE)
                                               ? LULL_STOP
                                               : LULL_CONTINUE);
        }
    }
    c->destroy(in);
}

/* Two pixels that one bright sample each has hit hold a grey block that is at rest without them. */
static void fireflies(void **state)
{
    const struct lull_criterion *c = &ggn_plugin_observer;
    (void)state;

    for (int hot = 0; hot < 2; hot++)
        for (int halves = 0; halves < 2; halves++) {
            const struct lull_frame frame = frame_of(halves ? 0xff : LULL_PLANE_BIT(LULL_PLANE_COLOR), &usual, 0);
            struct lull_instance *in = created(c, NULL, NULL, NULL);
            struct lull_decision d[BLOCKS];
            assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
            for (uint64_t spp = 256; spp <= 1024; spp *= 4) {
                for (int i = 0; i < HEIGHT * WIDTH * 3; i++)
                    (&color[0][0][0])[i] = (&half[0][0][0])[i] =
                        0.4f + 1e-4f * (float)ggn_hash_unit((uint32_t)i, (uint32_t)spp);
                for (int ch = 0; ch < 3 && hot && spp == 1024; ch++) {
                    color[8][9][ch] += 300.0f / 1024;
                    half[8][9][ch] += 300.0f / 384;
                    color[12][15][ch] += 300.0f / 1024;
                }
                half[5][5][0] += 1e-4f;
                assert_int_equal(evaluate(c, in, spp, 1, d), LULL_OK);
            }
            assert_int_equal(d[0].action, hot ? LULL_CONTINUE : LULL_STOP);
            c->destroy(in);
        }
}

/* Tables, requirements and refusals of all criteria, as recorded. */
static void tables(void **state)
{
    char *text;
    size_t size;
    FILE *f = open_memstream(&text, &size);
    (void)state;

    static const struct lull_criterion *const all[] = {&ggn_plugin_ggn, &ggn_plugin_observer, &ggn_plugin_svd_entropy,
                                                       &ggn_plugin_attributes, &ggn_plugin_noise_mask};
    for (uint32_t i = 0; i < sizeof all / sizeof all[0]; i++) {
        const struct lull_criterion *c = all[i];
        fprintf(f, "> %u %s: %s, version %s\n%s\nthreads %d capabilities %u\n", i, c->id, c->name, c->version,
                c->description, c->thread_level, (unsigned)c->capabilities);
        for (uint32_t k = 0; k < c->param_count; k++) {
            const struct lull_param *p = &c->params[k];
            fprintf(f, "%s: type %d default %s in %g to %g of %s: %s\n", p->name, p->type,
                    p->default_value ? p->default_value : "-", p->min, p->max, p->choices ? p->choices : "-", p->help);
        }
        const char *path = i == 0 ? network : i == 3 ? attributes : NULL;
        if (i == 2 || i == 4)
            continue;
        struct lull_instance *in = created(c, path, NULL, NULL);
        struct lull_requirements need = {.struct_size = sizeof need};
        assert_int_equal(c->requirements(in, &need, NULL), LULL_OK);
        fprintf(f, "needs planes %u, uses %u, %ux%u, halo %u, about %u checks from %llu on, %llu bytes\n",
                need.planes_required, need.planes_used, need.block_width, need.block_height, need.halo, need.checks_hint,
                (unsigned long long)need.first_spp, (unsigned long long)need.bytes_per_block);
        c->destroy(in);
    }
    fclose(f);
    approve_text("tests/golden/ggn_plugin_tables.txt", text);
    free(text);
}

/* Whole lines of what create refuses, and where models are looked for. */
static void refusals(void **state)
{
    struct ggn_hyper one = model->hyper;
    char path[] = "/tmp/ggn_contract_one.XXXXXX", want[300], found[4096];
    struct lull_error err = {.struct_size = sizeof err};
    struct lull_instance *in = NULL;
    struct lull_pair pair = {"model", "/nonexistent.ggn"};
    (void)state;

    char missing[128];
    snprintf(missing, sizeof missing, "model: /nonexistent.ggn: %s", strerror(ENOENT));
    assert_int_equal(ggn_plugin_ggn.create(NULL, &pair, 1, sizeof pair, &in, &err), LULL_E_IO);
    assert_string_equal(err.message, missing);
    assert_int_equal(ggn_plugin_noise_mask.create(NULL, &pair, 1, sizeof pair, &in, &err), LULL_E_IO);
    assert_string_equal(err.message, missing);
    assert_int_equal(ggn_plugin_ggn.create(NULL, &pair, 1, sizeof pair, NULL, &err), LULL_E_INVALID);
    pair.value = network;
    assert_int_equal(ggn_plugin_attributes.create(NULL, &pair, 1, sizeof pair, &in, &err), LULL_E_IO);
    snprintf(want, sizeof want, "model: %s: not a baseline for attributes", network);
    assert_string_equal(err.message, want);
    for (int window = 1; window <= 16; window += 15) {
        one.window = window;
        struct ggn_model *m = ggn_model_create(&one, NULL);
        assert_true(m && close(mkstemp(path)) == 0);
        assert_int_equal(ggn_model_save(m, path, GGN_F16, NULL), 0);
        ggn_model_destroy(m);
        pair.value = path;
        assert_int_equal(ggn_plugin_ggn.create(NULL, &pair, 1, sizeof pair, &in, &err), window == 1 ? LULL_E_IO : LULL_OK);
        snprintf(want, sizeof want, "model: %s: windows of 1 images", path);
        if (window == 1)
            assert_string_equal(err.message, want);
        else
            ggn_plugin_ggn.destroy(in);
        unlink(path);
        strcpy(path + strlen(path) - 6, "XXXXXX");
    }
    setenv("GGN_TEST_MODEL", "/some/where", 1);
    assert_true(gp_model_find("lull-2.ggn", "GGN_TEST_MODEL", found, sizeof found) == 1 && !strcmp(found, "/some/where"));
    setenv("GGN_TEST_MODEL", "", 1);
    assert_int_equal(gp_model_find("lull-2.ggn", "GGN_TEST_MODEL", found, sizeof found), 1);
    assert_non_null(strstr(found, "/ggn/models/lull-2.ggn"));
    assert_int_equal(access(found, R_OK), 0);
    assert_int_equal(gp_model_find("no-such.ggn", "GGN_TEST_MODEL", found, sizeof found), 0);
    assert_int_equal(strncmp(found, "no no-such.ggn beside ", 22), 0);
    const char *places =
        ", in ../share/lull, ../../share/lull or the source tree's ggn/models; give model=FILE or set GGN_TEST_MODEL";
    assert_string_equal(found + strlen(found) - strlen(places), places);
    assert_int_equal(gp_model_find("no-such.ggn", NULL, found, sizeof found), 0);
    assert_string_equal(found + strlen(found) - 16, " give model=FILE");
}

/* --- setup ----------------------------------------------------------------------------------------------------------------------------- */

static int setup(void **state)
{
    const struct ggn_hyper hyper = {GGN_PRESET_LULL, 18, 21, WINDOW, 3, 4, 3, 0, 0, 0};
    cJSON *from = cJSON_CreateObject();
    int fd[2] = {mkstemp(network), mkstemp(attributes)};

    (void)state;
    if (close(fd[0]) || close(fd[1]) || !(model = ggn_model_create(&hyper, NULL)))
        return -1;
    for (int net = 0; net < GGN_NETS; net++) {
        ggn_weights_init(model->weights[net], GGN_INIT_HASH, 60 + (uint32_t)net);
        ggn_weights_pack(model->weights[net], NULL);
    }
    policy = ggn_policy_default();
    policy.first_spp = 8;
    policy.ratio = 1.9;
    policy.gate_noise = 0.05;
    policy.slope = 2;
    policy.tail999 = 0.06;
    policy.passes = 3;
    policy.scale = 20;
    policy.shift = 2.5;
    if (ggn_policy_set(model, &policy, NULL) || ggn_model_save(model, network, GGN_F32, NULL) ||
        ggn_baseline_init(&svm, GGN_ATTRIBUTES_SVM, 21, 18, 1, NULL) || ggn_svm_init(&svm.svm, 26, 4, NULL))
        return -1;
    for (uint32_t i = 0; i < ggn_svm_values(&svm.svm); i++)
        svm.svm.values[i] = (float)(i < 26 ? 2 : i < 52 ? 0.3 : ggn_hash_unit(i, 5) - 0.5);
    svm.svm.gamma = 0.1;
    svm.svm.rho = -0.02;
    svm.policy.first_spp = 8;
    svm.policy.ratio = 1.9;
    svm.policy.passes = 2;
    svm.policy.threshold = 0.51;
    int rc = ggn_baseline_save(&svm, attributes, GGN_F32, from, NULL);
    cJSON_Delete(from);
    return rc;
}

static int teardown(void **state)
{
    (void)state;
    ggn_model_destroy(model);
    ggn_baseline_release(&svm);
    return unlink(network) | unlink(attributes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(answers_of_the_network),
                                       cmocka_unit_test(answers_of_a_baseline),
                                       cmocka_unit_test(states),
                                       cmocka_unit_test(impossible_heads),
                                       cmocka_unit_test(broken_pixels),
                                       cmocka_unit_test(answers_of_the_observer),
                                       cmocka_unit_test(answers_from_means),
                                       cmocka_unit_test(fireflies),
                                       cmocka_unit_test(tables),
                                       cmocka_unit_test(refusals)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
