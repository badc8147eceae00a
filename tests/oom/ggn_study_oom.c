/* Every allocation of a study fails once: its file, plans, the store (SQLite's own allocations too), requests, export and
 * import, estimates. An error, no crash, no leak, and a trial is stored whole or not at all. */
#include "support/ggn_cmocka.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/threads.h"
#include "study/api.h"
#include "study/stimuli.h"
#include "study/summary.h"
#include "study/transfer.h"
#include "support/fail_alloc.h"
#include "support/ggn_noise.h"

#define KEY "0123456789abcdef0123456789abcdef"

static const char text[] =
    "{\"format\":\"lull-study\",\"version\":1,\"id\":\"" KEY "\",\"task\":\"2ifc\",\"seed\":7,\"trials\":10,\"repeats\":1,"
    "\"catch_share\":0.1,\"show_ms\":1,\"gap_ms\":1,\"break_every\":0,\"min_catch_passed\":0.5,\"max_untouched\":0.5,"
    "\"views\":[{\"name\":\"v\",\"width\":20,\"height\":10,\"blocks\":["
    "{\"id\":0,\"x0\":0,\"y0\":0,\"x1\":10,\"y1\":10,\"levels\":[16,64,256]},"
    "{\"id\":1,\"x0\":10,\"y0\":0,\"x1\":20,\"y1\":10,\"levels\":[16,64,256]}]}]}";
static struct ggn_study study;
static struct ggn_study_store *store;
static char dir[] = "/tmp/ggn_oom_study.XXXXXX", path[64];

static int setup(void **state)
{
    struct ggn_study_person p = {.id = "00000001", .key = KEY, .seed = 3, .created = "now"};
    (void)state;
    if (!mkdtemp(dir) || ggn_study_parse("t", text, strlen(text), &study, NULL) ||
        ggn_study_store_open(NULL, study.id, 1, &store, NULL) || ggn_study_store_add_person(store, &p, "{}", NULL))
        return -1;
    for (int slot = 0; slot < 20; slot++)
        if (ggn_study_store_add_trial(
                store, 1, &(struct ggn_study_trial){.slot = slot, .level = 64, .answer = 1, .at = "now"}, NULL) != 1)
            return -1;
    snprintf(path, sizeof path, "%s/trials.json", dir);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    ggn_study_store_close(store);
    ggn_study_release(&study);
    unlink(path);
    return rmdir(dir);
}

static int definition(struct base_err *err)
{
    struct ggn_study s;
    struct ggn_study_plan plan;
    int rc = ggn_study_parse("t", text, strlen(text), &s, err);
    if (rc)
        return rc;
    char *printed = ggn_study_print(&s);
    if (!printed)
        rc = base_fail_nomem(err, "t");
    if (!rc)
        rc = ggn_study_plan_init(&plan, &s, 1, err);
    if (!rc)
        ggn_study_plan_release(&plan);
    free(printed);
    ggn_study_release(&s);
    return rc;
}

static int estimates(struct base_err *err)
{
    struct ggn_study_people people;
    struct ggn_study_ceiling ceiling;
    struct base_threads *threads = base_threads_create(1, err);
    int rc = threads ? ggn_study_people_init(&people, &study, store, threads, err) : BASE_ENOMEM;
    if (!rc) {
        rc = ggn_study_people_estimate(&people, threads, err);
        if (!rc)
            rc = ggn_study_ceiling(&people, &ceiling, err);
        ggn_study_people_release(&people);
    }
    base_threads_destroy(threads);
    return rc;
}

static int there_and_back(struct base_err *err)
{
    struct ggn_study_store *copy = NULL;
    int n, rc = ggn_study_export(&study, store, path, &n, err);
    if (!rc)
        rc = ggn_study_store_open(NULL, study.id, 1, &copy, err);
    if (rc)
        return rc;
    /* the export holds trials at one level in catch trials too: refused, after everything was read */
    rc = ggn_study_import(&study, copy, path, &n, err);
    ggn_study_store_close(copy);
    return rc == BASE_EINVAL ? 0 : rc;
}

static int ask(const char *method, const char *address, const char *body)
{
    struct ggn_study_site site = {.dir = dir, .page_dir = dir, .study = &study, .store = store};
    struct ggn_study_request q = {
        .method = method, .path = address, .content_type = "application/json", .body = body, .size = strlen(body)};
    struct ggn_study_response r;
    ggn_study_answer(&site, &q, &r);
    free(r.body);
    return r.status;
}

static int requests(struct base_err *err)
{
    int person = ask("GET", "/api/people/" KEY, ""), profile = ask("POST", "/api/people/" KEY "/profile", "{\"a\":[1,2]}");
    int trial = ask("POST", "/api/people/" KEY "/trials", "{\"slot\":0,\"level\":64,\"answer\":1,\"ms\":0}");
    /* memory that lacks while a body is read looks like a bad body: refused either way, and asked again by the page */
    return person == 200 && profile == 200 && (trial == 200 || trial == 400) ? 0 : base_fail(err, BASE_ENOMEM, "refused");
}

/* A block's pictures. */
static struct seq_block recording;

static int pictures(struct base_err *err)
{
    struct ggn_stimuli s;
    int rc = ggn_stimuli_init(&s, &recording, 1, err);
    if (rc)
        return rc;
    uint8_t *rgb = malloc((size_t)3 * recording.width * recording.height);
    rc = rgb ? ggn_stimuli_make(&s, s.n - 1, rgb, err) : base_fail_nomem(err, "t");
    free(rgb);
    ggn_stimuli_release(&s);
    return rc;
}

static void fail_each(int (*body)(struct base_err *), int quiet)
{
    enum { MANY = 20000 };
    long k = 1;
    assert_int_equal(body(NULL), 0);
    for (; k < MANY; k++) {
        struct base_err err = {0};
        fail_arm(k);
        int rc = body(&err), failed = fail_disarm();
        if (!failed)
            break;
        if (rc ? err.text[0] == '\0' : !quiet)
            fail_msg("allocation %ld failed and nothing was said", k);
    }
    assert_true(k > 2 && k < MANY);
    assert_int_equal(body(NULL), 0);
}

static void a_study(void **state)
{
    (void)state;
    fail_each(definition, 0);
}

/* SQLite does without some of what it asks for: then all is well in spite of it. */
static void a_report(void **state)
{
    (void)state;
    fail_each(estimates, 1);
}

static void a_transfer(void **state)
{
    (void)state;
    fail_each(there_and_back, 1);
}

static void a_block(void **state)
{
    static const uint32_t levels[] = {20, 400};
    (void)state;
    for (uint32_t reference_spp = 0; reference_spp <= 800; reference_spp += 800) {
        const struct ggn_noise noise = {12, 10, levels, 2, reference_spp, 1, 0, 1, 0};
        recording = ggn_noise_block(&noise);
        fail_each(pictures, 0);
        seq_block_release(&recording);
    }
}

static void a_request(void **state)
{
    struct ggn_study_trial *trials;
    int n;
    (void)state;
    fail_each(requests, 1);
    assert_int_equal(ggn_study_store_trials(store, 1, &trials, &n, NULL), 0);
    assert_int_equal(n, 20);
    free(trials);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(a_study), cmocka_unit_test(a_report), cmocka_unit_test(a_transfer),
                                       cmocka_unit_test(a_block), cmocka_unit_test(a_request)};
    return cmocka_run_group_tests_name("oom_study", tests, setup, teardown);
}
