/* SPDX-License-Identifier: MIT
 *
 * Memory, descriptors, time.
 */
#include "check.h"

#include <dirent.h>
#include <stdlib.h>

static long descriptors(void)
{
    long count = 0;
    DIR *d = opendir("/proc/self/fd");
    if (!d)
        return 0;
    while (readdir(d))
        count++;
    closedir(d);
    return count;
}

/* Repeats something so often three times over. What each repeat leaves behind grows in the second part and in the third; a
 * cache or a table that is made once, whenever that is, grows in one of them at most. Numbers of repeats, never a time: the
 * verdict is the same on a busy machine. */
static void repeat(struct lc *c, void (*once)(struct lc *), int times, const char *what)
{
    enum { PARTS = 3 };
    long count[PARTS] = {0}, bytes[PARTS] = {0}, files[PARTS] = {0};
    if (c->report->failures)
        return;
    for (int part = 0; part < PARTS; part++) {
        for (int i = 0; i < times && !c->report->failures; i++)
            once(c);
        files[part] = descriptors();
        lc_alloc_live(&count[part], &bytes[part]);
    }
    /* less than a byte each time in as many allocations is how the C library rounds up */
    int more = count[1] > count[0] && count[2] > count[1];
    int larger = bytes[1] - bytes[0] >= times && bytes[2] - bytes[1] >= times;
    LC_EXPECT(c, !more && !larger, "%d times %s left %ld bytes behind, the next %d left %ld", times, what,
              bytes[1] - bytes[0], times, bytes[2] - bytes[1]);
    LC_EXPECT(c, files[1] <= files[0] || files[2] <= files[1], "%s leaves files open", what);
    lc_note(c, "%d times %s", PARTS * times, what);
}

static void create_destroy(struct lc *c)
{
    struct lull_instance *instance = lc_create(c, NULL);
    if (instance)
        c->criterion->destroy(instance);
}

static void failing_create(struct lc *c)
{
    struct lull_pair bad = {"no-such-parameter", "1"};
    struct lull_instance *instance = NULL;
    c->criterion->create(NULL, &bad, 1, sizeof bad, &instance, NULL);
}

static void short_session(struct lc *c)
{
    struct lc_session s;
    if (lc_session_open(&s, c, NULL) != 0)
        return;
    lc_session_steps(&s, 1);
    lc_session_restart(&s);
    lc_session_steps(&s, 2);
    lc_session_close(&s);
}

void lc_check_leaks(struct lc *c)
{
    const int fewer = lc_is_script(c->path) ? 10 : 1; /* an instance is a process */
    repeat(c, create_destroy, 50 / fewer, "create and destroy");
    repeat(c, failing_create, 100, "a failing create");
    repeat(c, short_session, 10 / fewer, "a frame with RESTART");
}

/* create and begin_frame with the k-th allocation failing, for every k: an error or success, never a crash or a leak. */
void lc_check_out_of_memory(struct lc *c)
{
    enum { MOST = 20000 };
    if (lc_alloc_count() < 0) {
        lc_skip(c, "allocations cannot be counted in a sanitizer build");
        return;
    }
    struct lc_film film;
    lc_film_init(&film, c, NULL);
    struct lull_frame frame;
    lc_film_frame(&film, &frame, c->planes);
    long k = 0;
    int done = 0;
    for (; k < MOST && !done && !c->report->failures; k++) {
        struct lull_instance *instance = NULL;
        struct lull_error err = {.struct_size = sizeof err};
        lc_alloc_fail_after(k);
        int32_t status = c->criterion->create(NULL, c->pairs, c->pair_count, sizeof *c->pairs, &instance, &err);
        int created = status == LULL_OK;
        if (created)
            status = c->criterion->begin_frame(instance, &frame, &err);
        lc_alloc_fail_after(-1);
        LC_EXPECT(c, created || !instance, "create ran out of memory and touched the instance");
        LC_EXPECT(c, status <= 0, "create or begin_frame returned %d", status);
        done = status == LULL_OK;
        if (created && !done) /* the instance is as before: it can still do it */
            LC_EXPECT(c, c->criterion->begin_frame(instance, &frame, NULL) == LULL_OK,
                      "begin_frame cannot be repeated after it ran out of memory");
        if (created)
            c->criterion->destroy(instance);
    }
    lc_note(c, "%ld allocations in create and begin_frame", k - done);
    lc_film_release(&film);
}

/* After its first calls, evaluate allocates nothing. */
void lc_check_evaluate_allocates(struct lc *c, struct lc_session *s)
{
    if (lc_alloc_count() < 0) {
        lc_skip(c, "allocations cannot be counted in a sanitizer build");
        return;
    }
    lc_session_steps(s, 2); /* libraries underneath may allocate on first use */
    lc_film_advance(&s->film, 0, s->spp);
    struct lc_image image;
    lc_session_image(s, &image);
    struct lull_decision d;
    lc_decision_preset(&d);
    long before = lc_alloc_count();
    int32_t status = c->criterion->evaluate(s->instance, &image.view, &s->film.blocks[0], sizeof(struct lull_block), &d,
                                            sizeof d, 1, NULL);
    long after = lc_alloc_count();
    LC_EXPECT(c, status == LULL_OK, "evaluate: %d", status);
    LC_EXPECT(c, after == before, "evaluate made %ld allocations", after - before);
    lc_image_release(&image);
}

void lc_check_time(struct lc *c)
{
    int flexible = (c->req.flags & LULL_REQ_FLEXIBLE) != 0;
    int32_t w = c->req.block_width > 0 ? (int32_t)c->req.block_width : 200;
    int32_t h = c->req.block_height > 0 ? (int32_t)c->req.block_height : 200;
    struct lc_session s;
    if (lc_session_open(&s, c, &(struct lc_manner){.size = {2 * w, h, w, h}}) != 0)
        return;
    lc_session_steps(&s, LC_STEPS);
    if (s.evaluated > 0)
        lc_note(c, "%.3f ms per block of %dx%d%s, one thread, mean of %llu", 1e3 * s.evaluate_s / (double)s.evaluated, w, h,
                flexible ? " (flexible)" : "", (unsigned long long)s.evaluated);
    lc_session_close(&s);
}
