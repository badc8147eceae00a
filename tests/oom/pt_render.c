/* Every allocation of a render, of its outputs and of a sequence fails once: an error, no crash, no leak, no file left. */
#include <limits.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/files.h"
#include "render/checkpoint.h"
#include "render/output.h"
#include "render/quote.h"
#include "render/sequence.h"
#include "sequence/recording.h"
#include "scene/scene.h"
#include "support/fail_alloc.h"
#include "support/pt_fake.h"
#include "support/pt_identity.h"

static char folder[] = "/tmp/pt_oom_XXXXXX";
static struct base_threads *pool;

static int setup(void **state)
{
    struct base_err err;
    (void)state;
    pool = base_threads_create(1, &err);
    return mkdtemp(folder) && pool ? 0 : -1;
}

static int teardown(void **state)
{
    char command[64];
    (void)state;
    base_threads_destroy(pool);
    snprintf(command, sizeof command, "rm -r %s", folder);
    return system(command);
}

static const char *in_folder(const char *name)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int open_render(struct pt_render **render, struct lull_host_criterion **criterion, struct base_err *err)
{
    struct pt_render_config config = pt_fake_config();
    int rc = pt_criterion_create(pt_fake_criterion(), NULL, 0, pool, NULL, criterion, err);
    config.planes = PT_FILM_ALL;
    return !rc ? pt_render_create(&config, NULL, pt_fake_nan, pool, *criterion, render, err) : rc;
}

static void creating(void **state)
{
    int failures = 0;
    (void)state;
    for (long k = 1; k < 1000; k++) {
        struct pt_render *render = NULL;
        struct lull_host_criterion *criterion = NULL;
        struct base_err err = {0};
        fail_arm(k);
        int rc = open_render(&render, &criterion, &err);
        int happened = fail_disarm();
        if (happened) {
            assert_int_equal(rc, BASE_ENOMEM);
            assert_null(render);
            assert_true(err.text[0] != '\0');
            failures++;
        }
        pt_render_destroy(render);
        lull_host_close(criterion);
        if (!happened)
            break;
    }
    assert_in_range(failures, 12, 100);
}

/* Whichever allocation of a running render fails, the blocks go on: a check without memory costs time only. */
static void checking(void **state)
{
    long failed = 0;
    (void)state;
    for (long k = 1, happened = 1; happened && k < 100000; k++) {
        struct pt_render *render = NULL;
        struct lull_host_criterion *criterion = NULL;
        struct base_err err = {0};
        struct pt_render_hooks hooks = {0};
        enum pt_render_outcome outcome;
        assert_int_equal(open_render(&render, &criterion, &err), 0);
        fail_arm(k);
        assert_int_equal(pt_render_run(render, &hooks, &outcome, &err), 0);
        happened = fail_disarm();
        failed += (long)render->totals->failed_checks;
        for (uint32_t i = 0; i < render->blocks->count; i++)
            assert_int_not_equal(render->blocks->list[i].reason, LULL_REASON_NONE);
        pt_render_destroy(render);
        lull_host_close(criterion);
    }
    assert_in_range(failed, 1, 100000);
}

static struct pt_output_info info = {.of = {.scene = "a.pbrt", .kernel = "k"}, .effects = PT_FX_ALL};

static int write_report(struct pt_render *r, struct base_err *err)
{
    return pt_output_report(in_folder("r.json"), r, &info, err);
}
static int write_exr(struct pt_render *r, struct base_err *err) { return pt_output_exr(in_folder("a.exr"), r, &info, err); }
static int write_csv(struct pt_render *r, struct base_err *err)
{
    return pt_output_stop_map(in_folder("s.csv"), r, &info, err);
}
static int save_checkpoint(struct pt_render *r, struct base_err *err)
{
    return pt_checkpoint_save(in_folder("c.ckp"), r, PT_IDENTITY("a=1\n"), err);
}
static int load_checkpoint(struct pt_render *r, struct base_err *err)
{
    return pt_checkpoint_load(in_folder("c.ckp"), r, PT_IDENTITY("a=1\n"), err);
}

struct bytes {
    char *data;
    size_t size;
};

static struct bytes bytes_of(const char *name)
{
    struct bytes b;
    struct base_err err = {0};
    assert_int_equal(base_file_read(in_folder(name), 1 << 26, &b.data, &b.size, &err), 0);
    return b;
}

static void assert_same_file(const char *name, struct bytes expected)
{
    struct bytes b = bytes_of(name);
    assert_int_equal(b.size, expected.size);
    assert_memory_equal(b.data, expected.data, b.size);
    free(b.data);
}

/* Each allocation of the job fails once: an error and no file or, where a library did without, the whole file. */
static void fail_each(struct pt_render *render, int (*job)(struct pt_render *, struct base_err *), const char *name,
                      struct bytes whole)
{
    for (long k = 1, happened = 1; happened; k++) {
        struct base_err err = {0};
        unlink(in_folder(name));
        fail_arm(k);
        int rc = job(render, &err);
        happened = fail_disarm();
        assert_true(happened || !rc);
        if (!rc)
            assert_same_file(name, whole);
        else
            assert_int_not_equal(access(in_folder(name), F_OK), 0);
        assert_true(!rc || ((rc == BASE_ENOMEM || rc == BASE_EIO) && err.text[0]));
        assert_true(k < 5000);
    }
}

/* The same for reading, into a new render each time: an error, or everything is there, as saving it again shows. */
static void fail_each_load(struct bytes whole)
{
    int failures = 0;
    for (long k = 1, happened = 1; happened; k++) {
        struct pt_render *render = NULL;
        struct lull_host_criterion *criterion = NULL;
        struct base_err err = {0};
        assert_int_equal(open_render(&render, &criterion, &err), 0);
        fail_arm(k);
        int rc = load_checkpoint(render, &err);
        happened = fail_disarm();
        assert_true(happened || !rc);
        assert_true(!rc || ((rc == BASE_ENOMEM || rc == BASE_EIO) && err.text[0]));
        assert_same_file("c.ckp", whole); /* reading changes nothing */
        if (!rc) {
            assert_int_equal(save_checkpoint(render, &err), 0);
            assert_same_file("c.ckp", whole);
        }
        failures += rc != 0;
        pt_render_destroy(render);
        lull_host_close(criterion);
        assert_true(k < 5000);
    }
    assert_true(failures > 0);
}

static void writing_and_reading(void **state)
{
    static const struct {
        int (*job)(struct pt_render *, struct base_err *);
        const char *file;
    } jobs[] = {{write_report, "r.json"}, {write_exr, "a.exr"}, {write_csv, "s.csv"}, {save_checkpoint, "c.ckp"}};
    struct pt_render *render = NULL;
    struct lull_host_criterion *criterion = NULL;
    struct base_err err = {0};
    struct pt_render_hooks hooks = {0};
    enum pt_render_outcome outcome;
    (void)state;
    info.reproducible = 1;
    assert_int_equal(open_render(&render, &criterion, &err), 0);
    assert_int_equal(pt_render_run(render, &hooks, &outcome, &err), 0);
    for (size_t j = 0; j < sizeof jobs / sizeof *jobs; j++) {
        assert_int_equal(jobs[j].job(render, &err), 0);
        struct bytes whole = bytes_of(jobs[j].file);
        fail_each(render, jobs[j].job, jobs[j].file, whole);
        free(whole.data);
    }
    assert_int_equal(save_checkpoint(render, &err), 0);
    struct bytes whole = bytes_of("c.ckp");
    fail_each_load(whole);
    free(whole.data);
    pt_render_destroy(render);
    lull_host_close(criterion);
}

static void recording(void **state)
{
    struct pt_sequence_config config = {.directory = in_folder("seq"),
                                        .levels = "linear:2:4:2",
                                        .blocks = "3",
                                        .reference_spp = 2,
                                        .scene_path = "a.pbrt",
                                        .render = pt_fake_config()};
    char directory[128];
    (void)state;
    snprintf(directory, sizeof directory, "%s", config.directory);
    config.directory = directory;
    for (long k = 1;; k++) {
        struct base_err err = {0};
        int stopped;
        config.reference_spp = (uint64_t)k + 1; /* never to be resumed */
        char manifest[160];
        snprintf(manifest, sizeof manifest, "%s/manifest.json", directory);
        unlink(manifest);
        fail_arm(k);
        static const struct pt_render_hooks no_hooks;
        static const struct pt_scene empty; /* the kernel here needs none */
        int rc = pt_sequence_record(&config, &empty, pt_fake_noise, pool, NULL, &no_hooks, &stopped, &err);
        int happened = fail_disarm();
        if (!happened) {
            assert_int_equal(rc, 0);
            break;
        }
        assert_true(!rc || rc == BASE_ENOMEM || rc == BASE_EIO);
        if (k > 5000)
            fail();
    }
    char command[160];
    snprintf(command, sizeof command, "! ls -A %s | grep -q tmp", directory);
    assert_int_equal(system(command), 0);
}

/* A frame whose every allocation in turn failed once while it was recorded is whole in the end, and is read or refused. */
static void recording_frames(void **state)
{
    struct pt_sequence_config config = {.directory = in_folder("looks"),
                                        .levels = "linear:2:4:2",
                                        .planes = 1u << SEQ_PLANE_HALF | 1u << SEQ_PLANE_MOMENT2,
                                        .reference_spp = 2,
                                        .scene_path = "a.pbrt",
                                        .render = pt_fake_config()};
    static const struct pt_render_hooks no_hooks;
    static const struct pt_scene empty;
    static struct seq_recording m;
    char directory[128], command[192];
    (void)state;
    snprintf(directory, sizeof directory, "%s", config.directory);
    config.directory = directory;
    config.render.width = config.render.height = config.render.crop[2] = config.render.crop[3] = 16;
    for (int recording = 1; recording >= 0; recording--)
        for (long k = 1;; k++) {
            struct base_err err = {0};
            struct seq_look look;
            int stopped, rc;
            snprintf(command, sizeof command, "rm -rf %s", directory);
            if (recording)
                assert_int_equal(system(command), 0);
            fail_arm(k);
            if (recording)
                rc = pt_sequence_record_frame(&config, &empty, pt_fake_noise, pool, NULL, &no_hooks, &stopped, &err);
            else if ((rc = seq_recording_read(directory, &m, &err)) == 0) {
                float out[3 * 16 * 16];
                if ((rc = seq_recording_read_look(directory, &m, 0, &look, &err)) == 0) {
                    rc = seq_shown(&look.records[0], SEQ_PLANE_HALF, out, &err);
                    seq_look_release(&look);
                }
                seq_recording_release(&m);
            }
            if (!fail_disarm()) {
                assert_int_equal(rc, 0);
                break;
            }
            assert_true(!rc || rc == BASE_ENOMEM || rc == BASE_EIO || rc == BASE_EINVAL);
            assert_true(k < 5000);
            snprintf(command, sizeof command, "! ls -A %s 2>/dev/null | grep -q tmp", directory);
            assert_int_equal(system(command), 0);
        }
}

/* The k-th allocation of opening (finishing 0) or of finishing a quote fails; *happened: there were as many. */
static int quote(struct pt_render *render, int finishing, long k, int *happened, struct base_err *err)
{
    struct pt_quote *q = NULL;
    enum pt_render_outcome outcome;
    fail_arm(finishing ? LONG_MAX : k);
    int rc = pt_quote_create(render, NULL, &q, err);
    *happened = fail_disarm();
    struct pt_render_hooks hooks = {.quote = q ? q->quote : NULL};
    if (!rc && finishing) {
        assert_int_equal(pt_render_run(render, &hooks, &outcome, err), 0);
        fail_arm(k);
        rc = pt_quote_finish(q, render, err);
        *happened = fail_disarm();
    }
    pt_quote_destroy(q);
    return rc;
}

static void quoting(void **state)
{
    int failures = 0, silent = 0;
    (void)state;
    for (int finishing = 0; finishing < 2; finishing++) {
        for (long k = 1, happened = 1; k < 1000 && happened; k++) {
            struct pt_render *render = NULL;
            struct lull_host_criterion *criterion = NULL;
            struct base_err err = {0};
            int was = 0;
            assert_int_equal(open_render(&render, &criterion, &err), 0);
            render->config.pilot_spp = 40;
            render->config.pilot_s = 1e9;
            int rc = quote(render, finishing, k, &was, &err);
            if (was && !rc)                              /* the C library sorts without room of its own */
                assert_true(finishing && silent++ < 12); /* blocks */
            else
                assert_int_equal(rc, was ? BASE_ENOMEM : 0);
            assert_true(!rc || err.text[0] != '\0');
            failures += was;
            happened = was;
            pt_render_destroy(render);
            lull_host_close(criterion);
        }
    }
    assert_in_range(failures, 12, 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(creating),  cmocka_unit_test(checking),         cmocka_unit_test(writing_and_reading),
        cmocka_unit_test(recording), cmocka_unit_test(recording_frames), cmocka_unit_test(quoting)};
    return cmocka_run_group_tests(tests, setup, teardown);
}
