/* The criteria of ggn as their tables say, and the answers of networks and baselines against the parts that they are made of (judge, reader
 * of a baseline) asked directly under the one stopping rule: several blocks of several sizes, batches, failed calls, saved and damaged
 * states, a second frame, other displays. */
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
#include "plugin/criteria.h"
#include "plugin/windowed.h"
#include "sequence/tail.h"
#include "support/approve.h"
#include "support/ggn_heap.h"
#include "support/ggn_plugin_host.h"

enum { WINDOW = 2, VALUES = 3 * 24 * 30 };

static char network[] = "/tmp/ggn_contract_net.XXXXXX", attributes[] = "/tmp/ggn_contract_svm.XXXXXX";

static struct ggn_model *model;

static struct ggn_baseline svm;

static struct ggn_policy policy;

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
    struct ggn_inference *j = ggn_inference_create(model, NULL, NULL);
    for (int i = 0; i < WINDOW; i++) {
        n[i] = o->codes[i];
        d[i] = denoised[i];
        ggn_inference_denoise(j, n[i], denoised[i], across(o), down(o));
    }
    logit = ggn_inference_logit(j, n, d, NULL, NULL, across(o), down(o));
    ggn_inference_destroy(j);
    return logit;
}

static void other_ask(struct other *o, uint64_t spp)
{
    const struct ggn_evidence evidence = {o, other_logit, NULL};

    if (!ggn_stopper_ask(&o->rule, &o->stopper, spp))
        return;
    if (o->images == o->rule.window)
        memmove(o->codes[0], o->codes[1], (size_t)--o->images * sizeof o->codes[0]);
    uint8_t *to = o->codes[o->images++];
    for (int c = 0; c < 3; c++)
        for (int y = o->r->y0; y < o->r->y1; y++)
            for (int x = o->r->x0; x < o->r->x1; x++)
                *to++ = ggn_preprocess((double)gp_host_color[y][x][c], &o->display, NULL);
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
    static struct other others[GP_HOST_BLOCKS];
    struct lull_instance *in = gp_host_create(c, path, NULL, NULL), *other = gp_host_create(c, path, NULL, NULL);
    struct lull_frame frame = gp_host_frame(0xff, display, spp_max);
    int stopped = 0, early = 0;

    for (int second = 0; second < 2; second++) { /* a frame that begins anew knows nothing */
        assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
        frame.flags = 0;
        if (second)
            c->end_frame(other);
        assert_int_equal(c->begin_frame(other, &frame, NULL), LULL_OK);
        frame.flags = LULL_FRAME_RESTART;
        for (int id = 0; id < GP_HOST_BLOCKS; id++)
            others[id] = (struct other){.rule = {.policy = *p, .window = is_network ? WINDOW : 1},
                                        .display = *display,
                                        .r = &gp_host_rects[id],
                                        .is_network = is_network};
        static const uint64_t levels[] = {4, 8, 9, 16, 16, 32, 40, 64, 128, 256, 512, 1024};
        for (size_t k = 0; k < sizeof levels / sizeof levels[0]; k++) {
            struct lull_decision d[GP_HOST_BLOCKS], twice[GP_HOST_BLOCKS];
            const uint32_t ids = k % 3 == 1 ? 5 : 7;
            gp_host_render(levels[k]);
            if (k % 2) /* none of the frame's blocks: nothing of the call may stay */
                assert_int_equal(gp_host_evaluate(c, in, UINT64_MAX, 7, d), LULL_E_INVALID);
            if (k == 5 && second) { /* another instance goes on from here */
                save(c, in);
                assert_string_equal(load(c, other), "");
                struct lull_instance *swap = in;
                in = other;
                other = swap;
            }
            assert_int_equal(gp_host_evaluate(c, in, levels[k], ids, d), LULL_OK);
            assert_int_equal(gp_host_evaluate(c, in, levels[k], ids, twice), LULL_OK);
            assert_memory_equal(d, twice, sizeof d[0] * (ids == 7 ? 3 : 2));
            for (uint32_t id = 0, n = 0; id < GP_HOST_BLOCKS; id++)
                if (ids >> id & 1) {
                    other_ask(&others[id], levels[k]);
                    stopped += d[n].action == LULL_STOP;
                    early += d[n].flags != 0;
                    same(&d[n++], &others[id].stopper.verdict, id, levels[k]);
                    /* an image is denoised once, when the network is first asked about it */
                    uint32_t made = 0;
                    for (int i = 0; is_network && i < WINDOW && !isnan(others[id].stopper.verdict.p); i++)
                        made |= UINT32_C(1) << in->frame.history.block[id].head.order[i];
                    assert_int_equal(in->frame.history.block[id].head.made & made, made);
                }
            assert_int_equal(gp_host_evaluate(c, in, levels[k] - 1, 1, d), LULL_E_INVALID); /* fewer samples than before */
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
    follow(&ggn_plugin_attributes, attributes, 0, &gp_host_usual, 0, &svm.policy);
}

/* What is saved: a header, then of each block its place, its head and the kept bytes; no other criterion's, model's or setting's. */
static void states(void **state)
{
    static const char *const settings[][2] = {{"visible", "0.4"}, {"passes", "2"}, {"first-spp", "9"}, {NULL, NULL}};
    static const char foreign[] = "state: saved by another criterion, model, parameter set or frame";
    const struct lull_criterion *c = &ggn_plugin_ggn;
    const struct lull_frame frame = gp_host_frame(0xff, &gp_host_usual, 0);
    struct lull_instance *in = gp_host_create(c, network, NULL, NULL),
                         *svms = gp_host_create(&ggn_plugin_attributes, attributes, NULL, NULL);
    struct lull_decision d[GP_HOST_BLOCKS];
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
        gp_host_render(spp);
        assert_int_equal(gp_host_evaluate(c, in, spp, spp == 8 ? 3 : 1, d), LULL_OK);
    }
    save(c, in);
    for (int id = 0; id < GP_HOST_BLOCKS; id++)
        want += sizeof gp_host_rects[0] + head +
                (size_t)(id == 0 ? 2 : id == 1) * (size_t)(3 * (gp_host_rects[id].x1 - gp_host_rects[id].x0) *
                                                           (gp_host_rects[id].y1 - gp_host_rects[id].y0));
    assert_int_equal(saved_size, want);
    assert_memory_equal(saved, "GGNSTAT3", 8);
    const uint32_t numbers[] = {GP_HOST_BLOCKS, WINDOW, (uint32_t)head};
    assert_memory_equal(saved + 12, numbers, sizeof numbers);
    assert_memory_equal(saved + 24, &gp_host_rects[0], sizeof gp_host_rects[0]);
    assert_string_equal(load(&ggn_plugin_attributes, svms), foreign);
    for (int i = 0; settings[i][0]; i++) {
        struct lull_instance *set = gp_host_create(c, network, settings[i][0], settings[i][1]);
        assert_int_equal(c->begin_frame(set, &frame, NULL), LULL_OK);
        assert_string_equal(load(c, set), foreign);
        c->destroy(set);
    }
    /* damaged in every word of the first head, or cut anywhere: a line, and the instance answers as before */
    for (size_t at = 24 + sizeof gp_host_rects[0]; at < 24 + sizeof gp_host_rects[0] + head; at += 4) {
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
        const size_t first = 24 + sizeof gp_host_rects[0] + head + 2 * (size_t)(3 * 21 * 18);
        if (saved_size >= 24)
            snprintf(line, sizeof line, "state: it ends early, at block %d", saved_size >= first);
        const char *said = load(c, in);
        if (saved_size < first + sizeof gp_host_rects[0] + head + 3 * 30 * 24)
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
    const struct lull_frame frame = gp_host_frame(0xff, &gp_host_usual, 0);
    struct lull_instance *in = gp_host_create(c, network, NULL, NULL);
    struct lull_decision d[GP_HOST_BLOCKS];
    const size_t order = 24 + sizeof gp_host_rects[0] + sizeof(struct ggn_stopper), made = order + (GGN_WINDOW_MAX + 1) * 4,
                 bad = made + 4;
    static const uint32_t cases[][3] = {{0, 3, 0}, {4, 0, 0}, {8, 3, 0}, {8, 2, 1}, {12, 7, 1}};
    (void)state;

    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    gp_host_render(8);
    assert_int_equal(gp_host_evaluate(c, in, 8, 7, d), LULL_OK);
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
    const struct lull_frame frame = gp_host_frame(0xff, &gp_host_usual, 0);
    struct lull_instance *in = gp_host_create(c, network, NULL, NULL);
    struct lull_decision d[GP_HOST_BLOCKS];
    (void)state;

    assert_int_equal(c->begin_frame(in, &frame, NULL), LULL_OK);
    gp_host_render(8);
    gp_host_color[3][2][1] = NAN;
    gp_host_color[30][6][0] = INFINITY;
    gp_host_color[5][40][2] = -3; /* less than no light is no broken value */
    assert_int_equal(gp_host_evaluate(c, in, 8, 7, d), LULL_OK);
    assert_int_equal(d[0].flags, LULL_DECISION_TOO_EARLY | LULL_DECISION_BAD_INPUT);
    assert_int_equal(d[1].flags, LULL_DECISION_TOO_EARLY);
    assert_int_equal(d[2].flags, LULL_DECISION_TOO_EARLY | LULL_DECISION_BAD_INPUT);
    gp_host_render(16);
    assert_int_equal(gp_host_evaluate(c, in, 16, 7, d), LULL_OK);
    assert_int_equal(d[0].flags | d[2].flags, 0);
    c->destroy(in);
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
        struct lull_instance *in = gp_host_create(c, path, NULL, NULL);
        struct lull_requirements need = {.struct_size = sizeof need};
        assert_int_equal(c->requirements(in, &need, NULL), LULL_OK);
        fprintf(f, "needs planes %u, uses %u, %ux%u, halo %u, about %u checks from %llu on, %llu bytes\n",
                need.planes_required, need.planes_used, need.block_width, need.block_height, need.halo, need.checks_hint,
                (unsigned long long)need.first_spp, (unsigned long long)need.bytes_per_block);
        c->destroy(in);
    }
    fclose(f);
    approve_text("tests/unit/ggn_plugin_tables.txt", text);
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
    assert_true(gp_model_find("lull-3.ggn", "GGN_TEST_MODEL", found, sizeof found) == 1 && !strcmp(found, "/some/where"));
    setenv("GGN_TEST_MODEL", "", 1);
    assert_int_equal(gp_model_find("lull-3.ggn", "GGN_TEST_MODEL", found, sizeof found), 1);
    assert_non_null(strstr(found, "/ggn/models/lull-3.ggn"));
    assert_int_equal(access(found, R_OK), 0);
    assert_int_equal(gp_model_find("no-such.ggn", "GGN_TEST_MODEL", found, sizeof found), 0);
    assert_int_equal(strncmp(found, "no no-such.ggn beside ", 22), 0);
    const char *places =
        ", in share/lull of its prefix or the source tree's ggn/models; give model=FILE or set GGN_TEST_MODEL";
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
    policy.slope = 2;
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
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(answers_of_the_network),
        cmocka_unit_test(answers_of_a_baseline),
        cmocka_unit_test(states),
        cmocka_unit_test(impossible_heads),
        cmocka_unit_test(broken_pixels),
        cmocka_unit_test(tables),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
