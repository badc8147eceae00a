/* Whole frames: looks hold what a criterion is shown, as the film has it, and what it answered; a recording that is interrupted
 * anywhere becomes the same files. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>
#include <math.h>

#include "base/colour.h"
#include "base/files.h"
#include "render/sequence.h"
#include "scene/scene.h"
#include "sequence/recording.h"
#include "support/pt_captured.h"
#include "support/pt_fake.h"

enum { BLOCKS = 12, ALL = 1 << SEQ_PLANE_HALF | 1 << SEQ_PLANE_MOMENT2 | 1 << SEQ_PLANE_NORMAL | 1 << SEQ_PLANE_DEPTH };

static struct base_threads *pool;
static pt_kernel *kernel = pt_fake_noise;

static int setup(void **state)
{
    (void)state;
    pool = base_threads_create(2, NULL);
    return pool ? 0 : -1;
}

static int teardown(void **state)
{
    (void)state;
    base_threads_destroy(pool);
    return 0;
}

static void make_folder(char folder[32])
{
    strcpy(folder, "/tmp/pt_recorder_XXXXXX");
    assert_non_null(mkdtemp(folder));
}

static void remove_folder(const char *folder)
{
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", folder);
    assert_int_equal(system(command), 0);
}

static struct pt_sequence_config make_config(const char *folder, const char *levels)
{
    static const struct lull_pair at = {"at", "40"};
    return (struct pt_sequence_config){.directory = folder,
                                       .levels = levels,
                                       .planes = ALL,
                                       .reference_spp = 48,
                                       .scene_path = "x/room-view3.pbrt",
                                       .criterion = "./fake.so",
                                       .pairs = &at,
                                       .pair_count = 1,
                                       .render = pt_fake_config()};
}

static int record(const struct pt_sequence_config *config, const struct pt_render_hooks *hooks, int *stopped,
                  struct base_err *err)
{
    static const struct pt_scene empty; /* the kernel here needs none */
    struct lull_host_criterion *criterion = NULL;
    if (config->criterion)
        assert_int_equal(
            pt_criterion_create(pt_fake_criterion(), config->pairs, config->pair_count, pool, NULL, &criterion, err), 0);
    const int rc = pt_sequence_record_frame(config, &empty, kernel, pool, criterion, hooks, stopped, err);
    lull_host_close(criterion);
    return rc;
}

static void record_all(const struct pt_sequence_config *config)
{
    struct base_err err = {0};
    int stopped = 7;
    if (record(config, &(struct pt_render_hooks){0}, &stopped, &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(stopped, 0);
}

/* Planes of a record against the film that gave them, by the words of FORMAT.md. */
static void check_planes(const struct seq_record *r, const struct pt_render *of, uint32_t planes)
{
    static float out[SEQ_PLANES_END][3 * 256];
    const struct pt_film *f = &of->film;
    const size_t pixels = (size_t)r->width * r->height;
    for (uint32_t p = SEQ_PLANE_COLOR; p < SEQ_PLANES_END; p++)
        assert_int_equal(seq_shown(r, (enum seq_plane_number)p, out[p], NULL), planes >> p & 1 ? 0 : BASE_EINVAL);
    for (size_t i = 0; i < pixels; i++) {
        const size_t at = pt_film_index(f, r->x0 + (int)(i % r->width), r->y0 + (int)(i / r->width));
        const double n = r->spp - f->dropped[at], h = r->half_spp;
        double mean[3], half[3], rest[3];
        for (size_t c = 0; c < 3; c++) {
            mean[c] = f->color[3 * at + c] / n;
            half[c] = f->half ? f->half[3 * at + c] / (h - f->dropped_half[at]) : 0;
            rest[c] = (r->spp * mean[c] - h * half[c]) / (r->spp - h);
            if (planes >> SEQ_PLANE_COLOR & 1)
                assert_true(out[SEQ_PLANE_COLOR][c * pixels + i] == (float)mean[c]);
            if (planes >> SEQ_PLANE_HALF & 1)
                assert_true(fabs((double)out[SEQ_PLANE_HALF][c * pixels + i] - half[c]) <= 1e-7 * half[c]);
            if (planes >> SEQ_PLANE_REST & 1)
                assert_true(fabs((double)out[SEQ_PLANE_REST][c * pixels + i] - rest[c]) <= 1e-7 * (1 + rest[c]));
            if (planes >> SEQ_PLANE_NORMAL & 1)
                assert_true(out[SEQ_PLANE_NORMAL][c * pixels + i] == (float)(f->normal[3 * at + c] / r->spp));
        }
        const double y = base_luminance(mean[0], mean[1], mean[2]);
        if (planes >> SEQ_PLANE_MOMENT2 & 1)
            assert_true(fabs((double)out[SEQ_PLANE_MOMENT2][i] - (f->moment2[at] / n - y * y)) <= 1e-9);
        if (planes >> SEQ_PLANE_DEPTH & 1)
            assert_true(out[SEQ_PLANE_DEPTH][i] == (float)f->depth[at]);
        if (planes >> SEQ_PLANE_DROPPED & 1)
            assert_true(out[SEQ_PLANE_DROPPED][i] == (float)f->dropped[at] &&
                        out[SEQ_PLANE_DROPPED_HALF][i] == (float)f->dropped_half[at]);
    }
}

static struct pt_render *render_uniform(uint32_t spp, uint32_t seed, uint32_t planes)
{
    struct pt_render_config c = pt_fake_config();
    struct pt_render_hooks none = {0};
    enum pt_render_outcome outcome;
    struct pt_render *r;
    c.spp_min = c.spp_max = spp;
    c.uniform = 1;
    c.planes = planes;
    c.integrator.seed = seed;
    assert_int_equal(pt_render_create(&c, NULL, kernel, pool, NULL, &r, NULL), 0);
    assert_int_equal(pt_render_run(r, &none, &outcome, NULL), 0);
    return r;
}

/* In step: each level is the film of a render of so many samples; references are renders of other seeds. */
static void levels_in_step(void **state)
{
    static const uint32_t spp[] = {1, 5, 9};
    struct seq_recording m;
    char folder[32];
    (void)state;
    make_folder(folder);
    struct pt_sequence_config config = make_config(folder, "linear:1:9:4");
    config.criterion = NULL;
    record_all(&config);
    assert_int_equal(seq_recording_read(folder, &m, NULL), 0);
    assert_true(m.n_files == 5 && m.of.n_levels == 3 && m.of.n_blocks == BLOCKS && m.criterion[0] == '\0');
    assert_true(m.finished == (1u << SEQ_PART_LOOKS | 1u << SEQ_PART_REFERENCE) && m.frame.spp_min == 8 &&
                m.frame.spp_max == 256);
    for (uint32_t k = 0; k < 5; k++) {
        const uint32_t refers = k > 2, n = refers ? 48 : spp[k];
        const uint32_t seed =
            refers ? pt_sequence_reference_seed(config.render.integrator.seed, (int)k - 3) : config.render.integrator.seed;
        struct pt_render *r = render_uniform(n, seed, PT_FILM_ALL);
        struct seq_look l;
        assert_int_equal(seq_recording_read_look(folder, &m, k, &l, NULL), 0);
        assert_true(l.count == BLOCKS && l.seed == seed);
        for (uint32_t i = 0; i < BLOCKS; i++) {
            assert_true(l.records[i].kind == (refers ? SEQ_REFERENCE : SEQ_LEVEL) && l.records[i].spp == n);
            assert_int_equal(l.records[i].half_spp, refers ? 0 : n / 2 + n % 2);
            check_planes(&l.records[i], r,
                         refers   ? 1u << SEQ_PLANE_COLOR
                         : n == 1 ? ALL | 1u << SEQ_PLANE_COLOR /* the half is all of it */
                                  : ALL | 1u << SEQ_PLANE_REST);
            assert_true(isnan(seq_stat(&l.records[i], "action")));
        }
        seq_look_release(&l);
        pt_render_destroy(r);
    }
    assert_true(pt_sequence_reference_seed(7, 0) != pt_sequence_reference_seed(7, 1));
    seq_recording_release(&m);
    remove_folder(folder);
}

/* At the looks of the criterion, which stops column c at 40 (1 + c % 4) samples: blocks leave as they stop, with its answers. */
static void looks_of_a_criterion(void **state)
{
    struct seq_recording m;
    char folder[32];
    uint32_t last[BLOCKS] = {0}, beyond[BLOCKS] = {0};
    (void)state;
    make_folder(folder);
    struct pt_sequence_config config = make_config(folder, NULL);
    config.past_stops = 1;
    config.render.spp_max = 200;
    record_all(&config);
    assert_int_equal(seq_recording_read(folder, &m, NULL), 0);
    assert_string_equal(m.spec, "./fake.so");
    assert_string_equal(m.criterion, "fake");
    assert_string_equal(m.parameters, "at=40\n");
    for (uint32_t k = 0; k < m.n_files; k++) {
        struct seq_look l;
        assert_int_equal(seq_recording_read_look(folder, &m, k, &l, NULL), 0);
        for (uint32_t i = 0; i < l.count && m.files[k].part != SEQ_PART_REFERENCE; i++) {
            const struct seq_record *r = &l.records[i];
            struct pt_render *of = render_uniform(r->spp, config.render.integrator.seed, PT_FILM_ALL);
            const uint32_t stop = 40 * (1 + r->block % 4);
            uint32_t *to = r->kind == SEQ_LEVEL ? last : beyond;
            assert_int_equal(r->kind, m.files[k].part == SEQ_PART_LOOKS ? SEQ_LEVEL : SEQ_BEYOND);
            assert_true(r->spp > to[r->block] && r->spp <= 200);
            to[r->block] = r->spp;
            assert_true(seq_stat(r, "action") == (r->spp >= stop));
            assert_true(seq_stat(r, "predicted_spp") == stop && seq_stat(r, "error") > 0.5 && seq_stat(r, "next_spp") == 0);
            check_planes(r, of, ALL | 1u << SEQ_PLANE_REST);
            pt_render_destroy(of);
        }
        seq_look_release(&l);
    }
    for (uint32_t i = 0; i < BLOCKS; i++) {
        const uint32_t stop = 40 * (1 + i % 4);
        assert_true(last[i] >= stop && last[i] <= ceil(1.15 * stop) && beyond[i] == 200);
    }
    seq_recording_release(&m);
    remove_folder(folder);
}

/* Samples that are not finite: estimates are of the others, and both counts are there where some are missing. */
static void dropped_samples(void **state)
{
    struct seq_recording m;
    struct seq_look l;
    char folder[32];
    (void)state;
    make_folder(folder);
    kernel = pt_fake_nan;
    struct pt_sequence_config config = make_config(folder, "linear:100:100:1");
    record_all(&config);
    struct pt_render *r = render_uniform(100, config.render.integrator.seed, PT_FILM_ALL);
    kernel = pt_fake_noise;
    assert_int_equal(seq_recording_read(folder, &m, NULL), 0);
    assert_int_equal(seq_recording_read_look(folder, &m, 0, &l, NULL), 0);
    for (uint32_t i = 0; i < BLOCKS; i++) {
        const uint32_t missing = i % 4 == 0 ? 1u << SEQ_PLANE_DROPPED | 1u << SEQ_PLANE_DROPPED_HALF : 0;
        assert_true((seq_stat(&l.records[i], "dropped") > 0) == (missing != 0));
        check_planes(&l.records[i], r, ALL | 1u << SEQ_PLANE_REST | missing);
    }
    seq_look_release(&l);
    seq_recording_release(&m);
    pt_render_destroy(r);
    remove_folder(folder);
}

/* --- interruption --------------------------------------------------------------------------------------------------- */

static volatile sig_atomic_t asked;
static int slices, fails;

static int end_at(void *data, struct pt_render *r, struct base_err *err)
{
    (void)data;
    (void)r;
    if (--slices > 0)
        return 0;
    asked = !fails;
    return fails ? base_fail(err, BASE_EIO, "the disk is gone") : 0;
}

/* All but times of two recordings. */
static void same_recordings(const char *a, const char *b)
{
    struct seq_recording m, n;
    assert_int_equal(seq_recording_read(a, &m, NULL), 0);
    assert_int_equal(seq_recording_read(b, &n, NULL), 0);
    assert_true(m.n_files == n.n_files && m.finished == n.finished);
    for (uint32_t k = 0; k < m.n_files; k++) {
        struct seq_look x, y;
        assert_int_equal(seq_recording_read_look(a, &m, k, &x, NULL), 0);
        assert_int_equal(seq_recording_read_look(b, &n, k, &y, NULL), 0);
        assert_true(x.count == y.count && x.number == y.number);
        for (uint32_t i = 0; i < x.count; i++) {
            const struct seq_record *p = &x.records[i], *q = &y.records[i];
            assert_true(p->block == q->block && p->spp == q->spp && p->n_planes == q->n_planes && p->kind == q->kind);
            for (const char *const *s = (const char *const[]){"action", "error", "p_noisy", "next_spp", NULL}; *s; s++)
                assert_true(seq_stat(p, *s) == seq_stat(q, *s) || (isnan(seq_stat(p, *s)) && isnan(seq_stat(q, *s))));
            for (uint32_t s = 0; s < p->n_planes; s++) {
                assert_true(p->planes[s].plane == q->planes[s].plane &&
                            p->planes[s].stored_bytes == q->planes[s].stored_bytes);
                assert_memory_equal(p->planes[s].stored, q->planes[s].stored, p->planes[s].stored_bytes);
            }
        }
        seq_look_release(&x);
        seq_look_release(&y);
    }
    seq_recording_release(&m);
    seq_recording_release(&n);
}

static int count_states(const char *folder)
{
    char command[128];
    snprintf(command, sizeof command, "exit $(ls %s | grep -c ckp)", folder);
    return system(command) >> 8;
}

/* It ends after every so many slices, by a request or by a failure, until it is whole. */
static void interrupted(const struct pt_sequence_config *whole, int every)
{
    char folder[32];
    int stopped = 1, rc = 0, runs = 0;
    make_folder(folder);
    struct pt_sequence_config config = *whole;
    config.directory = folder;
    const struct pt_render_hooks hooks = {.slice = end_at, .interrupted = &asked};
    for (; stopped || rc; runs++) {
        struct base_err err = {0};
        asked = 0;
        slices = every;
        fails = runs % 3 == 2;
        stopped = 0;
        rc = record(&config, &hooks, &stopped, &err);
        if (rc)
            assert_string_equal(err.text, "the disk is gone");
        assert_true(runs < 400 && count_states(folder) <= 1);
        if (fails) /* so many more are needed to get any further */
            every++;
    }
    assert_true(runs > 1);
    assert_int_equal(count_states(folder), 0);
    same_recordings(whole->directory, folder);
    remove_folder(folder);
}

static void interruption(void **state)
{
    char folder[32];
    (void)state;
    for (int in_step = 0; in_step < 2; in_step++) {
        make_folder(folder);
        struct pt_sequence_config config = make_config(folder, in_step ? "geometric:4:60:1.5" : NULL);
        config.past_stops = !in_step;
        config.render.spp_max = 120;
        record_all(&config);
        for (int every = 1; every < 8; every += 3)
            interrupted(&config, every);
        remove_folder(folder);
    }
}

/* A folder of another recording is refused by what differs; a file that is damaged, by its name. */
static void refusals(void **state)
{
    struct base_err err = {0};
    char folder[32], path[64];
    int stopped;
    (void)state;
    make_folder(folder);
    struct pt_sequence_config config = make_config(folder, "linear:8:8:1");
    const struct pt_render_hooks none = {0};
    record_all(&config);
    config.planes &= ~(1u << SEQ_PLANE_HALF);
    assert_int_equal(record(&config, &none, &stopped, &err), 0); /* the criterion reads them: nothing is new */
    config = make_config(folder, "linear:8:9:1");
    assert_int_equal(record(&config, &none, &stopped, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "; use another folder"));
    config = make_config(folder, "linear:8:8:1");
    config.pairs = &(struct lull_pair){"at", "41"};
    assert_int_equal(record(&config, &none, &stopped, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "begun with param=at=40, but this render has param=at=41; use another folder"));
    config = make_config(folder, "linear:8:8:1");
    config.planes = 0;
    config.reference_spp = 8;
    config.criterion = NULL;
    assert_int_equal(pt_sequence_record(&config, &(struct pt_scene){0}, kernel, pool, NULL, &none, &stopped, &err),
                     BASE_EINVAL);
    assert_non_null(strstr(err.text, "looks at a whole frame (version 2 of the format), expected blocks alone (version 1)"));
    snprintf(path, sizeof path, "%s/look-00001.lseq", folder);
    assert_int_equal(truncate(path, 100), 0);
    config = make_config(folder, "linear:8:8:1");
    assert_int_equal(record(&config, &none, &stopped, &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "look-00001.lseq: "));
    remove_folder(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_in_step),  cmocka_unit_test(looks_of_a_criterion),
        cmocka_unit_test(dropped_samples), cmocka_unit_test(interruption),
        cmocka_unit_test(refusals),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}
