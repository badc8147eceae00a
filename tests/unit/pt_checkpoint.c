/* Checkpoints: a resumed render is identical, bad ones are refused, and their layout byte by byte. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zlib.h>
#include <cmocka.h>

#include "base/files.h"
#include "render/checkpoint.h"
#include "support/pt_fake.h"
#include "support/pt_identity.h"

/* --- time, interrupt, checkpoint ------------------------------------------------------------------------------------ */

struct stop_after {
    int slices;
    const char *checkpoint;
    volatile sig_atomic_t now;
};

static int count_down(void *data, struct pt_render *r, struct base_err *err)
{
    struct stop_after *s = data;
    (void)r, (void)err;
    s->now = --s->slices <= 0;
    return 0;
}

static int save(void *data, struct pt_render *r, struct base_err *err)
{
    const struct stop_after *s = data;
    return pt_checkpoint_save(s->checkpoint, r, PT_IDENTITY("a=1\nb=2\n"), err);
}

/* Interrupted after each of the first slices, saved, loaded into a new render and finished: the same bytes. */
static void resumed_render_is_identical(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX";
    close(mkstemp(path));
    struct pt_render_config config = pt_fake_config();
    config.planes = PT_FILM_ALL;
    struct pt_fake_run whole = pt_fake_render(&config, pt_fake_nan, 2, "32");
    for (int slices = 1; slices < 12; slices += 2) {
        struct stop_after stop = {.slices = slices, .checkpoint = path};
        struct pt_render_hooks hooks = {.slice = count_down, .interrupted = &stop.now, .suspend = save, .data = &stop},
                               none = {0};
        enum pt_render_outcome outcome;
        struct base_err err = {0};
        struct pt_fake_run r = {.pool = base_threads_create(2, &err)};
        struct lull_pair pair = {"at", "32"};
        for (int part = 0; part < 2; part++) {
            assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, r.pool, NULL, &r.criterion, &err), 0);
            assert_int_equal(pt_render_create(&config, NULL, pt_fake_nan, r.pool, r.criterion, &r.render, &err), 0);
            if (part == 1)
                assert_int_equal(pt_checkpoint_load(path, r.render, PT_IDENTITY("a=1\nb=2\n"), &err), 0);
            assert_int_equal(pt_render_run(r.render, part == 0 ? &hooks : &none, &outcome, &err), 0);
            assert_int_equal(outcome, part == 0 ? PT_RENDER_INTERRUPTED : PT_RENDER_DONE);
            if (part == 0) {
                pt_render_destroy(r.render);
                lull_host_close(r.criterion);
            }
        }
        pt_fake_assert_same(whole.render, r.render);
        pt_fake_release(&r);
    }
    pt_fake_release(&whole);
    unlink(path);
}

/* --- other limits, another rule ------------------------------------------------------------------------------------- */

struct settings {
    uint64_t spp_min, spp_max;
    const char *at; /* of the fake criterion; NULL: uniform */
    double max_seam;
};

struct keeper {
    const char *path, *text;
    int saved;
};

static int keep(void *data, struct pt_render *r, struct base_err *err)
{
    struct keeper *k = data;
    k->saved++;
    return pt_checkpoint_save(k->path, r, PT_IDENTITY(k->text), err);
}

/* To its end by these settings, from path if `resume`, kept there; pilot_spp ends it before, 0: does not. */
static struct pt_fake_run go_on(const struct settings *s, const char *path, int resume, uint64_t pilot_spp)
{
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    struct lull_pair pair = {"at", s->at};
    enum pt_render_outcome outcome;
    char text[100];
    struct pt_fake_run r = {.pool = base_threads_create(2, &err)};
    snprintf(text, sizeof text, "a=1\nspp-min=%d\nspp-max=%d\nmax-seam=%g\n%s%s\n", (int)s->spp_min, (int)s->spp_max,
             s->max_seam, s->at ? "param=at=" : "", s->at ? s->at : "b=2");
    struct keeper keeper = {path, text, 0};
    const struct pt_render_hooks hooks = {.suspend = keep, .data = &keeper};
    config.spp_min = s->spp_min;
    config.spp_max = s->spp_max;
    config.uniform = !s->at;
    config.max_seam = s->max_seam;
    config.planes = PT_FILM_ALL;
    config.pilot_spp = pilot_spp;
    config.pilot_s = 1e9;
    if (s->at)
        assert_int_equal(pt_criterion_create(pt_fake_criterion(), &pair, 1, r.pool, NULL, &r.criterion, &err), 0);
    assert_int_equal(pt_render_create(&config, NULL, pt_fake_nan, r.pool, r.criterion, &r.render, &err), 0);
    if (resume && pt_checkpoint_load(path, r.render, PT_IDENTITY(text), &err) != 0)
        fail_msg("%s", err.text);
    assert_int_equal(pt_render_run(r.render, &hooks, &outcome, &err), 0);
    if (outcome == PT_RENDER_PILOT)
        assert_int_equal(pt_checkpoint_save(path, r.render, PT_IDENTITY(text), &err), 0);
    else
        assert_true(keeper.saved == 1 || (s->max_seam > 0 && keeper.saved > 0));
    return r;
}

static void run_and_forget(const struct settings *s, const char *path, uint64_t pilot_spp)
{
    struct pt_fake_run r = go_on(s, path, 0, pilot_spp);
    pt_fake_release(&r);
}

/* A finished render of at most `first` samples goes on to `then`, or there, as if it had been asked for that at once. */
static void check_limits(const char *path, const char *at, uint64_t first, uint64_t then)
{
    const struct settings low = {at ? 8 : first, first, at, 0}, high = {at ? 8 : then, then, at, 0};
    struct pt_fake_run whole = go_on(&high, path, 0, 0), part = go_on(&low, path, 0, 0), r = go_on(&high, path, 1, 0);
    for (uint32_t i = 0; i < part.render->blocks->count; i++)
        assert_true(part.render->blocks->list[i].spp <= first && part.render->blocks->list[i].reason != LULL_REASON_NONE);
    pt_fake_assert_same(whole.render, r.render);
    assert_true(whole.render->totals->samples == r.render->totals->samples);
    pt_fake_release(&r);
    r = go_on(&low, path, 1, 0); /* back: it has more, and keeps it */
    assert_true(whole.render->totals->samples == r.render->totals->samples);
    pt_fake_release(&r);
    pt_fake_release(&part);
    pt_fake_release(&whole);
}

static void finished_renders_go_on(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX";
    close(mkstemp(path));
    static const uint64_t limits[] = {8, 9, 10, 30, 37, 64, 100, 255, 256}; /* checks are at 8, 10, 12, 14, 17, 20 … */
    for (size_t i = 0; i < sizeof limits / sizeof limits[0]; i++)
        for (size_t k = i; k < sizeof limits / sizeof limits[0]; k += 1 + i % 2) {
            check_limits(path, "32", limits[i], limits[k]);
            check_limits(path, NULL, limits[i], limits[k]);
        }
    unlink(path);
}

static void assert_same_picture(const struct pt_render *a, const struct pt_render *b)
{
    assert_memory_equal(a->film.color, b->film.color, a->film.pixels * 3 * sizeof(double));
    for (uint32_t i = 0; i < a->blocks->count; i++)
        assert_true(a->blocks->list[i].spp == b->blocks->list[i].spp &&
                    a->blocks->list[i].reason == b->blocks->list[i].reason &&
                    a->blocks->list[i].checks == b->blocks->list[i].checks);
}

/* Where the rule only says when to stop, another one goes on to the picture that it would have made at once. */
static void another_rule_goes_on(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX";
    close(mkstemp(path));
    static const char *const at[] = {"16", "17", "40", "63"};
    for (int i = 0; i < 4; i++)
        for (int k = i; k < 4; k++) {
            const struct settings first = {8, 256, at[i], 0}, then = {8, 256, at[k], 0};
            struct pt_fake_run whole = go_on(&then, path, 0, 0), part = go_on(&first, path, 0, 0);
            struct pt_fake_run r = go_on(&then, path, 1, 0), back = go_on(&first, path, 1, 0);
            assert_same_picture(whole.render, r.render);
            assert_true(back.render->totals->samples == r.render->totals->samples);
            pt_fake_release(&back);
            pt_fake_release(&r);
            pt_fake_release(&part);
            pt_fake_release(&whole);
        }
    unlink(path);
}

/* More samples at least, and smaller steps between neighbours, for blocks that were stopped and for those under way. */
static void other_limits_go_on(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX";
    close(mkstemp(path));
    const struct settings usual = {8, 256, "16", 0}, least = {50, 256, "16", 0}, even = {8, 256, "16", 1.25};
    for (uint64_t pilot_spp = 0; pilot_spp < 40; pilot_spp += 13) {
        run_and_forget(&usual, path, pilot_spp);
        struct pt_fake_run r = go_on(&least, path, 1, 0);
        for (uint32_t i = 0; i < r.render->blocks->count; i++)
            assert_true(r.render->blocks->list[i].spp >= 50);
        pt_fake_release(&r);
        run_and_forget(&usual, path, pilot_spp);
        r = go_on(&even, path, 1, 0);
        const struct lull_host_block *b = r.render->blocks->list;
        for (uint32_t i = 0; i + 1 < r.render->blocks->count; i++) /* rows of four */
            assert_true(i % 4 == 3 || (double)b[i + 1].spp <= 1.25 * (double)b[i].spp);
        pt_fake_release(&r);
    }
    unlink(path);
}

static void bad_checkpoints_are_refused(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX";
    close(mkstemp(path));
    struct pt_render_config config = pt_fake_config();
    struct pt_fake_run r = pt_fake_render(&config, pt_fake_noise, 1, "16");
    struct base_err err = {0};
    assert_int_equal(pt_checkpoint_save(path, r.render, PT_IDENTITY("seed=1\n"), &err), 0);
    assert_int_equal(pt_checkpoint_load(path, r.render, PT_IDENTITY("seed=2\n"), &err), BASE_EINVAL);
    assert_non_null(strstr(err.text, "made with seed=1, but this render has seed=2"));
    FILE *f = fopen(path, "rb");
    static unsigned char data[1 << 20];
    size_t n = fread(data, 1, sizeof data, f);
    fclose(f);
    for (size_t cut = 0; cut < n; cut += n / 17 + 1) {
        f = fopen(path, "wb");
        fwrite(data, 1, cut, f);
        fclose(f);
        assert_int_equal(pt_checkpoint_load(path, r.render, PT_IDENTITY("seed=1\n"), &err), BASE_EINVAL);
    }
    for (size_t at = 0; at < n; at += n / 13 + 1) {
        data[at] ^= 0x10;
        f = fopen(path, "wb");
        fwrite(data, 1, n, f);
        fclose(f);
        assert_int_equal(pt_checkpoint_load(path, r.render, PT_IDENTITY("seed=1\n"), &err), BASE_EINVAL);
        data[at] ^= 0x10;
    }
    pt_fake_release(&r);
    unlink(path);
}

/* --- a checkpoint, byte by byte ------------------------------------------------------------------------------------------ */

static const unsigned char *piece(const unsigned char *at, const void *expected, size_t n)
{
    assert_memory_equal(at, expected, n);
    return at + n;
}

static const unsigned char *word(const unsigned char *at, uint64_t expected) { return piece(at, &expected, 8); }

static const unsigned char *check_block_record(const unsigned char *at, const struct lull_host_block *b)
{
    at = word(word(word(word(word(at, b->spp), b->next_spp), b->asked_spp), b->rays), b->dropped);
    at = piece(piece(piece(piece(at, &b->p_noisy, 8), &b->error, 8), &b->predicted_spp, 8), &b->thread_s, 8);
    return piece(piece(piece(piece(at, &b->reason, 4), &b->checks, 4), &b->stop_votes, 4), &b->asked, 4);
}

/* Writes the bytes with a good checksum and wants this answer. */
static void expect_answer(const char *path, unsigned char *data, size_t n, struct pt_render *r, const char *settings,
                          const char *words)
{
    struct base_err err = {0};
    char line[256];
    uint32_t crc = (uint32_t)crc32_z(0, data, n - 4);
    memcpy(data + n - 4, &crc, 4);
    FILE *f = fopen(path, "wb");
    assert_true(f && fwrite(data, 1, n, f) == n && fclose(f) == 0);
    int rc = pt_checkpoint_load(path, r, PT_IDENTITY(settings), &err);
    snprintf(line, sizeof line, "%s: %s", path, words ? words : "");
    if (rc != (words ? BASE_EINVAL : 0) || (words && strcmp(err.text, line) != 0))
        fail_msg("%d \"%s\", expected \"%s\"", rc, err.text, line);
}

static void put_word(unsigned char *at, uint64_t value) { memcpy(at, &value, 8); }

static void checkpoints_have_a_layout(void **state)
{
    (void)state;
    char path[] = "/tmp/pt_render_test_XXXXXX", *bytes;
    close(mkstemp(path));
    struct pt_render_config config = pt_fake_config();
    struct base_err err = {0};
    size_t size;
    config.planes = PT_FILM_ALL;
    struct pt_fake_run r = pt_fake_render(&config, pt_fake_nan, 1, "16");
    const struct pt_film *f = &r.render->film;
    uint32_t kept;
    const struct lull_host_sample *dropped = lull_host_dropped(r.render->frame, &kept);
    assert_true(kept > 0 && kept <= LULL_HOST_DROPPED_KEPT);
    assert_int_equal(pt_checkpoint_save(path, r.render, PT_IDENTITY("a=1\nb=2\n"), &err), 0);
    assert_int_equal(base_file_read(path, 1 << 24, &bytes, &size, &err), 0);
    unsigned char *data = (unsigned char *)bytes;
    const unsigned char *at = piece(word(piece(data, "LULLCKP1", 8), 8), "a=1\nb=2\n", 8), *film = at, *list, *drops,
                        *history;
    at = word(at, f->bytes);
    assert_int_equal(f->bytes, f->pixels * 124);
    at = piece(piece(piece(at, f->color, 24 * f->pixels), f->half, 24 * f->pixels), f->moment2, 8 * f->pixels);
    at = piece(piece(piece(at, f->albedo, 24 * f->pixels), f->normal, 24 * f->pixels), f->depth, 8 * f->pixels);
    at = piece(piece(piece(at, f->depth_hits, 4 * f->pixels), f->dropped, 4 * f->pixels), f->dropped_half, 4 * f->pixels);
    list = at;
    at = word(at, 12);
    for (int i = 0; i < 12; i++)
        at = check_block_record(at, &r.render->blocks->list[i]);
    const struct lull_host_totals *t = r.render->totals;
    at = word(word(word(word(at, t->samples), t->paths), t->rays), t->dropped);
    at = piece(piece(at, &t->render_s, 8), &t->criterion_s, 8);
    drops = at = word(word(word(at, t->checks), t->failed_checks), t->skipped_checks);
    history = at = piece(word(at, kept), dropped, 12 * LULL_HOST_DROPPED_KEPT);
    at = word(at, 4 * 64) + 4 * 64; /* the fake criterion's counts */
    assert_int_equal(at + 4 - data, size);

    struct {
        size_t at;
        uint64_t good, bad;
        const char *words;
    } const faults[] = {
        {(size_t)(film - data), f->bytes, f->bytes + 1, "the checkpoint has another number of bytes of pixels"},
        {(size_t)(list - data), 12, 11, "the checkpoint has another number of blocks"},
        {(size_t)(list - data) + 8 + 88 * 5, 256, UINT64_C(1) << 31, "block 5 of the checkpoint makes no sense"},
        {(size_t)(list - data) + 16 + 88 * 11, 256, UINT64_C(1) << 31, "block 11 of the checkpoint makes no sense"},
        {(size_t)(drops - data), 16, 17, "the checkpoint makes no sense"},
        {(size_t)(history - data), 256, 255, "the checkpoint has a wrong length"},
        {8, 8, 9, "made with other settings"},
        {8, 8, size, "the checkpoint is too short"},
    };
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        unsigned char before[8];
        memcpy(before, data + faults[i].at, 8);
        put_word(data + faults[i].at, faults[i].good);
        expect_answer(path, data, size, r.render, "a=1\nb=2\n", NULL);
        put_word(data + faults[i].at, faults[i].bad);
        expect_answer(path, data, size, r.render, "a=1\nb=2\n", faults[i].words);
        memcpy(data + faults[i].at, before, 8);
    }
    unsigned char *reason = data + (list - data) + 8 + 72;
    for (int32_t k = -1; k <= LULL_REASON_COUNT; k++) {
        memcpy(reason, &k, 4);
        expect_answer(path, data, size, r.render, "a=1\nb=2\n",
                      k < 0 || k == LULL_REASON_COUNT ? "block 0 of the checkpoint makes no sense" : NULL);
    }
    expect_answer(path, data, size, r.render, "a=1\nb=3\n", "made with b=2, but this render has b=3");
    expect_answer(path, data, size, r.render, "a=1\nb=", "made with b=2, but this render has b=");
    expect_answer(path, data, size, r.render, "a=1\n", "made with b=2, but this render has no b");
    expect_answer(path, data, size, r.render, "a=1\nb=2\nc=3\n", "made without c, but this render has c=3");
    expect_answer(path, data, (size_t)(history - data) + 4, r.render, "a=1\nb=2\n",
                  "block 0 of the checkpoint makes no sense");
    *reason = 1;
    memset(reason + 1, 0, 3);
    expect_answer(path, data, (size_t)(history - data) + 4, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, (size_t)(drops - data) + 4, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, (size_t)(list - data) + 8 + 4, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, 12, r.render, "a=1\nb=2\n", "the checkpoint is too short");
    expect_answer(path, data, 11, r.render, "a=1\nb=2\n", "not a checkpoint");
    data[7] = '2';
    expect_answer(path, data, size, r.render, "a=1\nb=2\n", "not a checkpoint");
    free(bytes);
    pt_fake_release(&r);
    unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(resumed_render_is_identical), cmocka_unit_test(finished_renders_go_on),
        cmocka_unit_test(another_rule_goes_on),        cmocka_unit_test(other_limits_go_on),
        cmocka_unit_test(bad_checkpoints_are_refused), cmocka_unit_test(checkpoints_have_a_layout),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
